"""The plots of a result file, made with matplotlib. Each function gives a figure, or None when the result has not what it
shows. `plots_of` lists all that apply, for the page and for `--png`."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402
from matplotlib.ticker import LogLocator, NullLocator  # noqa: E402

# Okabe and Ito's palette, which people with any colour vision tell apart; outliers are also marked in words or shape.
BLUE, RED, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#6b7280"
STYLE = {
    "font.family": "sans-serif", "font.size": 10.5, "axes.titlesize": 10.5, "axes.spines.top": False,
    "axes.spines.right": False, "axes.edgecolor": "#9ca3af", "axes.labelcolor": "#1f2937", "xtick.color": "#374151",
    "ytick.color": "#374151", "axes.grid": True, "grid.color": "#e5e7eb", "grid.linewidth": 0.8, "axes.axisbelow": True,
    "svg.fonttype": "none", "svg.hashsalt": "kr5", "figure.constrained_layout.use": True, "legend.frameon": False,
}
CAMERA_PARAMETERS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
POSE_PARAMETERS = ("x", "y", "z", "rx", "ry", "rz")
WIDTH = 4.4  # [in]: readable at phone width, two or three beside each other on a desk
WIDE = 6.4
MOST_ARROWS = 3000


@dataclass
class Plot:
    """A figure with its name (of the PNG file), its title, and what it shows, in words."""

    name: str
    title: str
    text: str
    figure: Figure
    wide: bool = False


def _bars(names: list[str], values: np.ndarray, marked: np.ndarray, label: str, line: float | None = None) -> Figure:
    """Horizontal bars with names while these can be read, else a plain profile."""
    few = len(names) <= 40
    figure, axes = plt.subplots(figsize=(WIDTH, max(2.2, 0.6 + 0.22 * len(names)) if few else 3.2))
    at = np.arange(len(names))
    colours = [RED if m else BLUE for m in marked]
    if few:
        bars = axes.barh(at, values, color=colours, height=0.72)
        axes.set_yticks(at, [name if len(name) <= 18 else "…" + name[-17:] for name in names], fontsize=9)
        axes.invert_yaxis()
        axes.grid(axis="y", visible=False)
        axes.set_xlabel(label)
        for bar, m in zip(bars, marked):
            if m:
                axes.annotate(" outlier", (bar.get_width(), bar.get_y() + bar.get_height() / 2), color=RED,
                              va="center", fontsize=9, annotation_clip=False)
        axes.margins(x=0.18 if any(marked) else 0.05)
    else:
        axes.vlines(at, 0, values, color=colours, linewidth=1.5)
        axes.plot(at[marked], values[marked], "v", color=RED, label="outlier")
        axes.set(xlabel="view number, in order", ylabel=label)
        if any(marked):
            axes.legend()
    axes.set_xlim(left=0) if few else axes.set_ylim(bottom=0)
    if line is not None:
        (axes.axvline if few else axes.axhline)(line, color=GREY, linestyle="--", linewidth=1)
    return figure


def _view_bars(data: dict, key: str, factor: float, label: str) -> Figure | None:
    views = [v for v in data.get("views", ()) if isinstance(v.get(key), (int, float))]
    if len(views) < 2 or not any(v[key] for v in views):
        return None
    values = factor * np.array([v[key] for v in views])
    marked = np.array([bool(v.get("outlier")) for v in views])
    return _bars([str(v["name"]) for v in views], values, marked, label)


def view_errors(data: dict) -> Figure | None:
    return _view_bars(data, "rms_px", 1.0, "RMS distance, seen to predicted [px]")


def robot_positions(data: dict) -> Figure | None:
    return _view_bars(data, "robot_position", 1e3, "shift of the robot that would explain it [mm]")


def robot_rotations(data: dict) -> Figure | None:
    return _view_bars(data, "robot_rotation", 180 / np.pi, "turn of the robot that would explain it [deg]")


def touch_errors(data: dict) -> Figure | None:
    return _view_bars(data, "distance", 1e3, "tip to the touched point [mm]")


def _residuals(data: dict) -> tuple[np.ndarray, np.ndarray] | None:
    """All residuals, one row a point: u, v, du, dv; and whether its view is an outlier."""
    outliers = {v["name"] for v in data.get("views", ()) if v.get("outlier")}
    rows, marked = [], []
    for view in data.get("residuals", ()):
        block = np.array([view[k] for k in ("u", "v", "du", "dv")], dtype=float).T.reshape(-1, 4)
        rows.append(block)
        marked.append(np.full(len(block), view.get("view") in outliers))
    if not rows or not sum(map(len, rows)):
        return None
    points, bad = np.vstack(rows), np.concatenate(marked)
    good = np.isfinite(points).all(axis=1)
    return (points[good], bad[good]) if good.any() else None


def _image_axes(data: dict, axes: plt.Axes, points: np.ndarray) -> tuple[float, float]:
    width, height = data.get("image_size") or (points[:, 0].max() + 1, points[:, 1].max() + 1)
    axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), aspect="equal", xlabel="u [px]", ylabel="v [px]")
    for spine in axes.spines.values():
        spine.set_visible(True)
    return width, height


def residual_field(data: dict) -> Figure | None:
    found = _residuals(data)
    if found is None:
        return None
    points, bad = found
    if len(points) > MOST_ARROWS:
        keep = np.linspace(0, len(points) - 1, MOST_ARROWS).astype(int)
        points, bad = points[keep], bad[keep]
    width, height = data.get("image_size") or (4, 3)
    figure, axes = plt.subplots(figsize=(WIDE, min(WIDE * height / width + 0.4, 7.5)))
    width, _ = _image_axes(data, axes, points)
    sound = points[~bad] if (~bad).any() else points
    typical = float(np.median(np.hypot(sound[:, 2], sound[:, 3]))) or 1.0
    magnify = 0.02 * width / typical
    for which, colour in ((~bad, BLUE), (bad, RED)):
        if which.any():
            axes.quiver(*points[which].T, angles="xy", scale_units="xy", scale=1 / magnify, color=colour, width=0.0018,
                        headwidth=4, headlength=5)
    key = float(f"{2 * typical:.1g}")
    axes.plot([0.03 * width, 0.03 * width + key * magnify], [-0.045 * width] * 2, color="#111827", linewidth=2, clip_on=False)
    axes.annotate(f"{key:g} px", (0.04 * width + key * magnify, -0.045 * width), va="center", annotation_clip=False)
    if bad.any():
        axes.annotate("orange: views named as outliers", (width, -0.045 * width), color=RED, ha="right", va="center",
                      annotation_clip=False)
    return figure


def residual_cloud(data: dict) -> Figure | None:
    found = _residuals(data)
    if found is None:
        return None
    points, bad = found
    figure, axes = plt.subplots(figsize=(WIDTH, WIDTH * 0.92))
    sound = points[~bad] if (~bad).any() else points
    sigma = float(np.sqrt(np.mean(sound[:, 2:] ** 2)))
    limit = max(4.5 * sigma, 1e-9)
    inside = np.abs(points[:, 2:]).max(axis=1) < limit
    size = 9 if len(points) < 800 else 4
    axes.scatter(*points[inside & ~bad, 2:].T, s=size, color=BLUE, alpha=0.45, linewidths=0, rasterized=len(points) > 1500)
    axes.scatter(*points[inside & bad, 2:].T, s=size + 5, color=RED, marker="x", linewidths=0.8)
    for k in (1, 3):
        axes.add_patch(plt.Circle((0, 0), k * sigma, fill=False, color="#111827", linewidth=1, linestyle="-" if k == 1 else "--"))
        axes.annotate(f"{k}σ", (0, -k * sigma), fontsize=9, ha="center", va="bottom")
    beyond = int((~inside).sum())
    title = f"σ = {sigma:.3f} px per axis" + (f"\n{beyond} of {len(points)} beyond the frame" if beyond else "")
    axes.set(xlim=(-limit, limit), ylim=(limit, -limit), aspect="equal", xlabel="du [px]", ylabel="dv [px]", title=title)
    return figure


def coverage(data: dict) -> Figure | None:
    counts = np.array((data.get("result", {}).get("coverage") or {}).get("counts", []), dtype=float)
    size = data.get("image_size")
    if counts.ndim != 2 or not counts.size or not size:
        return None
    figure, axes = plt.subplots(figsize=(WIDTH, WIDTH * size[1] / size[0] + 0.75))
    shown = axes.imshow(counts, extent=(-0.5, size[0] - 0.5, size[1] - 0.5, -0.5), cmap="Blues", vmin=0, aspect="equal")
    rows, cols = counts.shape
    for i, j in zip(*np.nonzero(counts == 0)):
        axes.annotate("0", ((j + 0.5) * size[0] / cols, (i + 0.5) * size[1] / rows), ha="center", va="center", color=RED)
    figure.colorbar(shown, ax=axes, label="points in cell", location="bottom", shrink=0.8, aspect=30)
    axes.grid(False)
    axes.set(xlabel="u [px]", ylabel="v [px]")
    return figure


def correlation(data: dict) -> Figure | None:
    result = data.get("result", {})
    covariance = np.array(result.get("covariance", []), dtype=float)
    if covariance.ndim != 2 or covariance.shape[0] != covariance.shape[1]:
        return None
    names = {12: CAMERA_PARAMETERS, 6: POSE_PARAMETERS, 3: POSE_PARAMETERS[:3]}.get(len(covariance))
    free = np.isfinite(np.diag(covariance)) & (np.diag(covariance) > 0)
    if names is None or free.sum() < 2:
        return None
    covariance, names = covariance[np.ix_(free, free)], [n for n, f in zip(names, free) if f]
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
                axes.annotate(f"{matrix[i, j]:.1f}".replace("0.", "."), (j, i), ha="center", va="center", fontsize=8.5,
                              color="white" if abs(matrix[i, j]) > 0.65 else "#111827")
    figure.colorbar(shown, ax=axes, label="correlation [-]", location="bottom", shrink=0.8, aspect=30)
    return figure


def models(data: dict) -> Figure | None:
    rows = [m for m in data.get("result", {}).get("models", ()) if m.get("held_out_rms")]
    if len(rows) < 2:
        return None
    rows = sorted(rows, key=lambda m: m["held_out_rms"])[:12][::-1]
    figure, axes = plt.subplots(figsize=(WIDTH, 0.9 + 0.28 * len(rows)))
    at = np.arange(len(rows))
    axes.plot([m["fitted_rms"] for m in rows], at, "o", mfc="none", color=GREY, label="fitted views")
    axes.plot([m["held_out_rms"] for m in rows], at, "o", color=BLUE, label="views left out")
    axes.set_yticks(at, [model_name(m) + (" ◀" if m.get("chosen") else "") for m in rows], fontsize=9)
    if rows[0]["held_out_rms"] > 4 * rows[-1]["held_out_rms"]:
        axes.set_xscale("log")
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xlabel("RMS distance [px]")
    axes.legend(fontsize=9, loc="lower left", bbox_to_anchor=(0, 1), ncols=2)
    return figure


def model_name(model: dict) -> str:
    """Short name of a camera model."""
    extra = [w for w, key in (("square pixels", "square_pixels"), ("bent target", "bent_target")) if model.get(key)]
    return " + ".join([str(model.get("lens", "?")), *extra])


def alignment(data: dict) -> Figure | None:
    """Speed of turning seen by robot and camera, before and after the offset between their clocks."""
    a = data.get("alignment")
    if not a:
        return None
    figure, axes = plt.subplots(2, 1, figsize=(WIDE, 4.4), sharex=True, sharey=True)
    for ax, shift, title in ((axes[0], 0.0, "as stamped"), (axes[1], float(a["offset"]), f"with the offset of {1e3 * a['offset']:.2f} ms")):
        ax.plot(a["t_robot"], a["robot"], color=BLUE, linewidth=1.2, label="robot")
        ax.plot(np.array(a["t_camera"], dtype=float) - shift, a["camera"], color=RED, linewidth=1, linestyle="--", label="camera")
        ax.set_title(title, loc="left")
        ax.set_ylabel(a.get("label", "speed [rad/s]"))
    axes[0].legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=2)
    axes[1].set_xlabel("robot clock [s]")
    return figure


def root_poses(frames: list[dict]) -> dict[str, np.ndarray]:
    """Pose of every frame in the root; a frame with an unknown or circular parent is taken as it stands."""
    by_name = {f["name"]: f for f in frames}

    def resolve(name: str, depth: int = 0) -> np.ndarray:
        frame = by_name[name]
        T = np.array(frame["T"], dtype=float)
        parent = frame.get("parent")
        return resolve(parent, depth + 1) @ T if parent in by_name and depth < len(frames) else T

    return {name: resolve(name) for name in by_name}


def frames_3d(data: dict) -> Figure | None:
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
    axes.set(xlim=middle[0] + np.array([-half, half]), ylim=middle[1] + np.array([-half, half]),
             zlim=middle[2] + np.array([-half, half]), xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    axes.set_box_aspect((1, 1, 1))
    axes.view_init(elev=25, azim=-55)
    return figure


# name, title, function, wide, what it shows
CATALOGUE: list[tuple[str, str, Callable[[dict], Figure | None], bool, str]] = [
    ("views", "Error of each view", view_errors, False, "RMS distance between the points seen and those predicted."),
    ("robot_position", "Robot position, view by view", robot_positions, False,
     "How far the robot would have to stand elsewhere for the view to agree."),
    ("robot_rotation", "Robot orientation, view by view", robot_rotations, False,
     "How far the robot would have to be turned for the view to agree."),
    ("touches", "Error of each touch", touch_errors, False, "Where each pose puts the tip, from the one fixed point."),
    ("residual_field", "Residuals over the image", residual_field, True,
     "Seen minus predicted, at the place in the image, magnified. Arrows in all directions are noise; a pattern is a lens "
     "that the model does not describe."),
    ("residual_cloud", "Spread of the residuals", residual_cloud, False,
     "Seen minus predicted. A round cloud about the middle is noise."),
    ("coverage", "Coverage of the image", coverage, False, "Points seen in each part of the image; 0 where none was."),
    ("correlation", "Correlation of the estimates", correlation, False,
     "Near ±1: these two can make up for each other, and only together are they well known."),
    ("models", "Camera models compared", models, False, "Error on views left out decides; ◀ marks the model used."),
    ("alignment", "Robot and camera clocks", alignment, True, "The same motion, as the robot and as the camera saw it."),
    ("frames", "Frames in space", frames_3d, True, "Axes x orange, y green, z blue."),
]


def plots_of(data: dict[str, Any], skip: tuple[str, ...] = ()) -> list[Plot]:
    """Every plot that the result has the data for. Close the figures after use."""
    out = []
    with plt.rc_context(STYLE):
        for name, title, function, wide, text in CATALOGUE:
            if name not in skip and (figure := function(data)) is not None:
                out.append(Plot(name, title, text, figure, wide))
    return out
