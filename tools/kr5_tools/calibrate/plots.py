"""The plots of a result file, made with matplotlib. Each function gives a figure, or None when the result has not what
it shows. `plots_of` lists all that apply, for the page and for `--png`."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from kr5.files.result_types import FrameData, ResultData
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from kr5_tools.calibrate.axis_study_plots import study_noise, study_parameters
from kr5_tools.calibrate.dynamics_plots import (
    condition_history,
    excitation_motion,
    gravity_overlay,
    joint_springs,
    limit_use,
)
from kr5_tools.calibrate.kinematics_plots import parameter_changes, posture_errors, posture_spread, posture_value
from kr5_tools.calibrate.laser_plots import cloud_plot, profile_errors, study_plot
from kr5_tools.calibrate.repeatability_plots import distance_histogram, return_order, return_spread
from kr5_tools.calibrate.residual_plots import (
    coverage_plot,
    residual_cloud,
    residual_field,
    robot_positions,
    robot_rotations,
    touch_errors,
    view_errors,
)
from kr5_tools.calibrate.response_plots import contact_curve, force_loop_plot, servo_responses, wrench_overlays
from kr5_tools.calibrate.workspace_plots import condition_map, dexterity_map, reachable_region, singular_value_map
from kr5_tools.pages.plot_style import BLUE, GREEN, GREY, ON_PALE, RED, STYLE, WIDE, WIDTH, plt

CAMERA_PARAMETERS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
POSE_PARAMETERS = ("x", "y", "z", "rx", "ry", "rz")


@dataclass
class Plot:
    """A figure with its name (of the PNG file), its title, and what it shows, in words."""

    name: str
    title: str
    text: str
    figure: Figure
    wide: bool = False


def correlation_plot(data: ResultData) -> Figure | None:
    result = data.get("result", {})
    covariance = np.array(result.get("covariance", []), dtype=float)
    if covariance.ndim != 2 or covariance.shape[0] != covariance.shape[1]:
        return None
    names = {12: CAMERA_PARAMETERS, 6: POSE_PARAMETERS, 3: POSE_PARAMETERS[:3]}.get(len(covariance))
    free = np.isfinite(np.diag(covariance)) & (np.diag(covariance) > 0)
    if names is None or free.sum() < 2:
        return None
    covariance, names = covariance[np.ix_(free, free)], tuple(n for n, f in zip(names, free) if f)
    std = np.sqrt(np.diag(covariance))
    matrix = covariance / np.outer(std, std)
    figure, axes = plt.subplots(figsize=(WIDTH, WIDTH))
    shown = axes.imshow(matrix, cmap="RdBu_r", vmin=-1, vmax=1)
    axes.set_xticks(range(len(names)), names)
    axes.set_yticks(range(len(names)), names)
    axes.grid(False)
    axes.tick_params(length=0)
    for i in range(len(names)):
        for j in range(len(names)):
            if i != j and abs(matrix[i, j]) >= 0.3:
                axes.annotate(
                    f"{matrix[i, j]:.1f}".replace("0.", "."),
                    (j, i),
                    ha="center",
                    va="center",
                    fontsize=8.5,
                    color="white" if abs(matrix[i, j]) > 0.65 else ON_PALE,
                )
    figure.colorbar(shown, ax=axes, label="correlation [-]", location="bottom", shrink=0.8, aspect=30)
    return figure


def model_plot(data: ResultData) -> Figure | None:
    rows = [m for m in data.get("result", {}).get("models", ()) if m.get("held_out_rms")]
    if len(rows) < 2:
        return None
    rows = sorted(rows, key=lambda m: m["held_out_rms"])[:12][::-1]
    figure, axes = plt.subplots(figsize=(WIDTH, 0.9 + 0.4 * len(rows)))
    at = np.arange(len(rows))
    axes.plot([m["fitted_rms"] for m in rows], at, "o", mfc="none", color=GREY, label="fitted views")
    axes.plot([m["held_out_rms"] for m in rows], at, "o", color=BLUE, label="held-out views")
    axes.set_yticks(at, [])
    for y, model in zip(at, rows):  # above its marks, since names may be longer than the plot is wide beside it
        name = model_name(model) + (" (used)" if model.get("chosen") else "")
        axes.text(0.01, y + 0.22, name, transform=axes.get_yaxis_transform(), fontsize=8.5, va="bottom")
    axes.set_ylim(-0.5, len(rows) - 0.2)
    if rows[0]["held_out_rms"] > 4 * rows[-1]["held_out_rms"]:
        axes.set_xscale("log")
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xlabel("RMS distance [px]")
    axes.legend(fontsize=9, loc="lower left", bbox_to_anchor=(0, 1), ncols=2)
    return figure


def model_name(model: Mapping[str, object]) -> str:
    """Short name of a camera model."""
    extra = [w for w, key in (("square pixels", "square_pixels"), ("bent target", "bent_target")) if model.get(key)]
    return " + ".join([str(model.get("lens", "?")), *extra])


def alignment_plot(data: ResultData) -> Figure | None:
    """Speed of turning seen by robot and camera, before and after the offset between their clocks."""
    a = data.get("alignment")
    if not a:
        return None
    figure, axes = plt.subplots(2, 1, figsize=(WIDE, 4.4), sharex=True, sharey=True)
    for ax, shift, title in (
        (axes[0], 0.0, "as stamped"),
        (axes[1], float(a["offset"]), f"with the offset of {1e3 * a['offset']:.2f} ms"),
    ):
        ax.plot(a["t_robot"], a["robot"], color=BLUE, linewidth=1.2, label="robot")
        ax.plot(
            np.array(a["t_camera"], dtype=float) - shift,
            a["camera"],
            color=RED,
            linewidth=1,
            linestyle="--",
            label="camera",
        )
        ax.set_title(title, loc="left")
        ax.set_ylabel(a.get("label", "angular speed [rad/s]"))
    axes[0].legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=2)
    axes[1].set_xlabel("robot clock [s]")
    return figure


def root_poses(frames: list[FrameData]) -> dict[str, np.ndarray]:
    """Pose of every frame in the root; a frame with an unknown or circular parent is taken as it stands."""
    by_name = {f["name"]: f for f in frames}

    def resolve(name: str, depth: int = 0) -> np.ndarray:
        frame = by_name[name]
        T = np.array(frame["T"], dtype=float)
        parent = frame.get("parent")
        return resolve(parent, depth + 1) @ T if parent is not None and parent in by_name and depth < len(frames) else T

    return {name: resolve(name) for name in by_name}


def frames_3d(data: ResultData) -> Figure | None:
    frames = data.get("frames")
    if not frames:
        return None
    poses = root_poses(frames)
    figure = plt.figure(figsize=(WIDE, 5.2))
    axes = figure.add_subplot(projection="3d")
    origins = np.array([T[:3, 3] for T in poses.values()])
    span = max(float(np.ptp(origins, axis=0).max()), 0.05)
    for name, T in poses.items():
        few = len(poses) <= 12
        for k, colour in enumerate((RED, GREEN, BLUE)):
            tip = T[:3, 3] + 0.08 * span * (1 if few else 0.5) * T[:3, k]
            axes.plot(*np.array([T[:3, 3], tip]).T, color=colour, linewidth=1.6 if few else 0.9)
        if few or name.isidentifier():
            axes.text(*T[:3, 3], " " + name, fontsize=9)
    middle = (origins.min(axis=0) + origins.max(axis=0)) / 2
    half = 0.55 * span
    axes.set(
        xlim=middle[0] + np.array([-half, half]),
        ylim=middle[1] + np.array([-half, half]),
        zlim=middle[2] + np.array([-half, half]),
        xlabel="x [m]",
        ylabel="y [m]",
        zlabel="z [m]",
    )
    axes.set_box_aspect((1, 1, 1))
    axes.view_init(elev=25, azim=-55)
    return figure


# name, title, function, wide, what it shows
CATALOGUE: list[tuple[str, str, Callable[[ResultData], Figure | None], bool, str]] = [
    ("views", "Error of each view", view_errors, False, "RMS distance between the points seen and those predicted."),
    (
        "robot_position",
        "Robot position, view by view",
        robot_positions,
        False,
        "Displacement of the robot with which the view would agree.",
    ),
    (
        "robot_rotation",
        "Robot orientation, view by view",
        robot_rotations,
        False,
        "Rotation of the robot with which the view would agree.",
    ),
    (
        "touches",
        "Error of each touch",
        touch_errors,
        False,
        "Position of the tip by each pose, relative to the fixed point.",
    ),
    (
        "posture_errors",
        "Errors of the postures",
        posture_errors,
        False,
        "Number of postures by error, with the identified arm and with the nominal one, base and tool fitted.",
    ),
    (
        "posture_value",
        "What each further posture adds",
        posture_value,
        False,
        "Uncertainty by the number of postures, each chosen as the best addition to those before.",
    ),
    (
        "posture_spread",
        "Joint values of the postures",
        posture_spread,
        False,
        "Chosen postures (blue) within the range of the candidates (grey).",
    ),
    (
        "parameter_changes",
        "Changes of the parameters",
        parameter_changes,
        True,
        "Identified minus nominal, with two standard deviations. Grey: only together with others.",
    ),
    (
        "profile_errors",
        "Errors of the profiles",
        profile_errors,
        True,
        "Distance of what each profile shows from its target, in the fit and predicted from the other profiles.",
    ),
    (
        "cloud",
        "Profiles in the base",
        cloud_plot,
        True,
        "Points of all profiles with the calibrated scanner, by height; surfaces seen twice lie on each other.",
    ),
    (
        "servo",
        "Response of the servo",
        servo_responses,
        True,
        "Command, measured and fitted position, sample by sample, with the residual below.",
    ),
    (
        "contact",
        "Force against depth",
        contact_curve,
        True,
        "Measured and fitted force over the depth, with the residual beside.",
    ),
    (
        "force_loop",
        "Force loop over the stiffness",
        force_loop_plot,
        True,
        "Gain at which the loop begins to oscillate, steady error and overshoot at each stiffness of the contact.",
    ),
    (
        "wrench",
        "Wrench, measured and fitted",
        wrench_overlays,
        True,
        "Each component of the force sensor with what the identified sensor and tool give.",
    ),
    (
        "study",
        "Error against stand-off and speed",
        study_plot,
        True,
        "Error of a sphere's centre; synchronised: poses interpolated at the times at which the profiles were taken.",
    ),
    (
        "study_noise",
        "Error against noise and arc",
        study_noise,
        True,
        "RMS over the parameters of the identified arm and the simulated trials.",
    ),
    (
        "study_parameters",
        "Error of each parameter",
        study_parameters,
        True,
        "RMS over the simulated trials, at the noise usual of each device and the widest arc.",
    ),
    (
        "residual_field",
        "Residuals over the image",
        residual_field,
        True,
        (
            "Seen minus predicted, at the position in the image, magnified. Arrows in random directions are"
            " noise; a pattern shows a lens that the model does not describe."
        ),
    ),
    (
        "residual_cloud",
        "Spread of the residuals",
        residual_cloud,
        False,
        "Seen minus predicted. A round distribution about the centre is noise.",
    ),
    (
        "coverage",
        "Coverage of the image",
        coverage_plot,
        False,
        "Number of points in each part of the image.",
    ),
    (
        "correlation",
        "Correlation of the estimates",
        correlation_plot,
        False,
        "Near ±1, the two parameters can compensate each other; only their combination is well determined.",
    ),
    (
        "models",
        "Camera models compared",
        model_plot,
        False,
        "Selection by the error on held-out views.",
    ),
    (
        "alignment",
        "Robot and camera clocks",
        alignment_plot,
        True,
        "The same motion, as measured by the robot and by the camera.",
    ),
    (
        "returns",
        "Scatter of the returns",
        return_spread,
        True,
        "Measured positions less the barycentre of their point; the circle is RP.",
    ),
    (
        "return_distances",
        "Distances from the barycentre",
        distance_histogram,
        False,
        "All returns; RP is the mean plus three standard deviations.",
    ),
    (
        "return_order",
        "Returns in their order",
        return_order,
        True,
        "Deviations in the order of the test; the line is the trend common to all points.",
    ),
    (
        "reachable",
        "Reachable region",
        reachable_region,
        False,
        "Radius and height about axis 1, within the joint limits; the dashed line is the reach.",
    ),
    (
        "dexterity",
        "Manipulability",
        dexterity_map,
        False,
        "Maximum manipulability of the point over all postures there (linear rows of the Jacobian).",
    ),
    (
        "min_singular_value",
        "Smallest singular value",
        singular_value_map,
        False,
        "Of the whole Jacobian, linear rows over the reach; the best posture there. Near 0 the arm is singular.",
    ),
    (
        "condition",
        "Condition number",
        condition_map,
        False,
        "Of the same Jacobian, the minimum over all postures there; 1 would move alike in every direction.",
    ),
    ("motion", "Motion", excitation_motion, True, "Joint values of the designed motion."),
    (
        "limit_use",
        "Use of the limits",
        limit_use,
        False,
        "Maximum position range, speed, acceleration and nominal torque of each joint, over its limit.",
    ),
    (
        "condition_history",
        "Condition number",
        condition_history,
        False,
        "Of the base regressor, after the random starts and each exchange that gained.",
    ),
    (
        "joint_springs",
        "Springs of the joints",
        joint_springs,
        True,
        "Motor minus link angle over the torque on the link; the line is the law that was found, with its play.",
    ),
    (
        "slow_torques",
        "Torques of the slow motion",
        gravity_overlay,
        True,
        "Measured; predicted by gravity and friction; and gravity alone, a panel a joint.",
    ),
    ("frames", "Frames in space", frames_3d, True, "Axes x orange, y green, z blue."),
]


def plots_of(data: ResultData, skip: tuple[str, ...] = ()) -> list[Plot]:
    """Every plot that the result has the data for. Close the figures after use."""
    out = []
    with plt.rc_context(STYLE):
        for name, title, function, wide, text in CATALOGUE:
            if name not in skip and (figure := function(data)) is not None:
                out.append(Plot(name, title, text, figure, wide))
    return out
