"""Recordings of real arms (`data/dyn_*`, `data/geo_ur5_wam_lasertracker`), brought in by `kr5 recording import`.

Torques stand in the currents `i` of drives whose torque constants are set so that the unit of a column is its noise.
What noise is cannot be known of a real arm: declared is what the model identified on the fit part leaves there, so that
1.0 is that model."""

import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import kr5
import kr5.cell
import kr5.gap
import kr5.identification
import kr5.io
import kr5.kinematics
import numpy as np
import yaml
from kr5.logs.importer import import_recording

import real_arms_identify as identify
from kr5_tools.identify.motion_logs import read_motions

H = np.pi / 2


@dataclass
class TorqueArm:
    """An arm whose joint positions and torques were logged."""

    name: str
    log: str  # below data/
    robot: Any
    columns: dict[str, Any]  # as in a map
    clock: dict[str, Any]
    every: float  # [s]
    low_pass: float  # [Hz]
    fit: tuple[float, float]  # [s]
    check: tuple[float, float]
    structure: np.ndarray | None = None
    rotors: bool = False
    tool: bool = False
    published: str = "–"


@dataclass
class Prepared:
    """A recording with the model that was identified on its fit part, and how far that is from the noise that
    neighbours show."""

    recording: Any
    cell: Any
    offset: np.ndarray
    sigma: np.ndarray
    floor: float
    objections: list[str] = field(default_factory=list)  # of the importer against the log


def columns(q: str | list[str], torque: str | list[str], unit: Any = "rad", **more: Any) -> dict[str, Any]:
    """Positions and torques on the joint side; no commands."""
    return {
        "qc": {"from": "measured", "unit": unit},
        "q": {"from": q, "unit": unit},
        "i": {"from": torque, "unit": "N m", **more},
    }


def plain_robot(rows: list[tuple[float, float, float]], masses: list[float]) -> Any:
    """DH rows (b, a, alpha), and links of these masses whose moments are to be identified."""
    links = [kr5.cell.Link(mass=m, com=np.zeros(3), inertia=[0.01 * m] * 3 + [0.0] * 3) for m in masses]
    return kr5.cell.Robot(dh=[kr5.kinematics.DhJoint(b=b, a=a, alpha=alpha) for b, a, alpha in rows], links=links)


def panda() -> TorqueArm:
    rows = [
        (0.333, 0, -H),
        (0, 0, H),
        (0.316, 0.0825, H),
        (0, -0.0825, -H),
        (0.384, 0, H),
        (0, 0.088, H),
        (0.107, 0, 0),
    ]
    return TorqueArm(
        "Panda",
        "dyn_panda_gaz2019/panda_excitation.csv",
        plain_robot(rows, [4.97, 0.65, 3.23, 3.59, 1.23, 1.67, 0.74]),
        columns("q{}", "tau{}"),
        {"column": "t", "unit": "s", "max_gap": 0.02, "repair": "sort"},
        0.05,
        8,
        (0.1, 13.5),
        (13.5, 20.4),
        published="Gaz 2019: 1.41 % of torque, on the data fitted",
    )


def ur10() -> TorqueArm:
    rows = [(0.1273, 0, H), (0, -0.612, 0), (0, -0.5723, 0), (0.163941, 0, H), (0.1157, 0, -H), (0.0922, 0, 0)]
    return TorqueArm(
        "UR10",
        "dyn_ur10_unisa/ur10_exciting_trajectory.csv",
        plain_robot(rows, [7.78, 12.93, 3.87, 1.96, 1.96, 0.2]),
        columns("q{}", "tau{}"),
        {"column": "t", "unit": "s"},
        0.2,
        2.2,
        (0.1, 18.0),
        (18.0, 27.3),
        published="no figure for this file",
    )


def tx40(data: Path) -> TorqueArm:
    """Motor 6 turns with joints 5 and 6."""
    S = np.diag([32.0, 32.0, 45.0, -48.0, 45.0, 32.0])
    S[5, 4] = 32.0
    zero = S @ np.array([0, -H, H, 0, 0, 0])
    found = kr5.cell.import_urdf(data / "dyn_tx40_figaroh/tx40_mdh_modified.urdf")
    side = {"side": "motor"}
    wanted = {
        "qc": {"from": "measured", "unit": "rad"},
        "q": {"from": "qm{}", "unit": "rad", "offset": zero.tolist(), **side},
        "i": {"from": "taum{}", "unit": "N m", **side},
    }
    return TorqueArm(
        "TX40",
        "dyn_tx40_figaroh/tx40_motor_log.csv",
        found.cell.robot,
        wanted,
        {"column": "t", "unit": "s"},
        0.04,
        10,
        (0.1, 5.0),
        (5.0, 7.45),
        S,
        rotors=True,
        published="figaroh: fs1 6.97, fv1 8.11, fs2 8.25, fv2 5.52",
    )


def tiago(data: Path) -> TorqueArm:
    names = ["torso", *(f"arm{k}" for k in range(1, 8))]
    scale = np.array([1, 0.136, 0.136, -0.087, -0.087, -0.0613, -0.0613, -0.0613]) * [
        1,
        100,
        100,
        100,
        100,
        336,
        336,
        336,
    ]
    found = kr5.cell.import_urdf(data / "dyn_tiago_figaroh/tiago_no_hand.urdf", "", "arm_tool_link")
    wanted = columns([f"q_{n}" for n in names], [f"eff_{n}" for n in names], ["m"] + ["rad"] * 7, scale=scale.tolist())
    return TorqueArm(
        "TIAGo",
        "dyn_tiago_figaroh/tiago_log.csv",
        found.cell.robot,
        wanted,
        {"column": "t", "unit": "s", "max_gap": 0.2, "repair": "sort"},
        0.25,
        1.8,
        (0.1, 50),
        (50, 80),
        published="base parameters, no error stated",
    )


def med7(data: Path) -> TorqueArm:
    found = kr5.cell.import_urdf(data / "dyn_lbr_med7_kcl/med7dock.urdf", "", "link_shaft")
    return TorqueArm(
        "LBR Med7",
        "dyn_lbr_med7_kcl/med7_measurements.csv",
        found.cell.robot,
        columns("q_{0}", "tau_{0}", scale=-1),
        {"every": 0.01},
        0.05,
        8,
        (6.0, 12.2),
        (12.2, 16.4),
        tool=True,
        published="none stated",
    )


def nominal_cell(arm: TorqueArm) -> Any:
    n = arm.robot.joints
    out = kr5.cell.Cell(robot=arm.robot, noise=kr5.cell.Noise(current=1.0))
    out.drives = kr5.cell.Drives(
        structure=np.eye(n) if arm.structure is None else arm.structure,
        rotor_inertia=np.zeros(n),
        torque_constant=np.ones(n),
        friction=kr5.cell.Friction(coulomb=np.zeros(n), viscous=np.zeros(n)),
    )
    at_once = kr5.cell.SecondOrder(natural_frequency=20 / arm.every, damping_ratio=1.0, delay=0.0)
    out.servo = kr5.cell.Servo(cycle=arm.every, joint=[at_once])
    if arm.tool:
        out.tool = kr5.cell.Tool(T_flange_tool=np.eye(4))
    return out


def write_map(arm: TorqueArm, folder: Path) -> Path:
    """The map of an arm's log, beside the cell that it names."""
    kr5.cell.save_cell(nominal_cell(arm), folder / "cell.yaml")
    parts = [
        {"name": split, "kind": "motion", "split": split, "from": a, "to": b}
        for split, (a, b) in (("fit", arm.fit), ("check", arm.check))
    ]
    map_file = folder / "map.yaml"
    map_file.write_text(
        yaml.safe_dump(
            {
                "format": "kr5-map/1",
                "cell": "cell.yaml",
                "clock": arm.clock,
                "columns": arm.columns,
                "experiments": parts,
                "resample": {"every": arm.every, "low_pass": arm.low_pass},
            }
        )
    )
    return map_file


def bring_in(arm: TorqueArm, data: Path) -> tuple[Any, list[str]]:
    """The recording, through a map, and what the importer objects to."""
    with tempfile.TemporaryDirectory() as folder:
        recording, _, objections = import_recording(data / arm.log, write_map(arm, Path(folder)))
    return recording, [d.text() for d in objections]


def motions(arm: TorqueArm, data: Path) -> Any:
    """The log as it came, for identification: neither resampled nor smoothed."""
    with tempfile.TemporaryDirectory() as folder:
        return read_motions(data / arm.log, None, write_map(arm, Path(folder)), 0.0)


def joined_log(motions: Any) -> Any:
    """Fit and check as one log again."""
    logs = [*motions.fit, *motions.check]
    t, q, tau = (np.concatenate([np.asarray(getattr(log, k)) for log in logs]) for k in ("t", "q", "tau"))
    return kr5.identification.JointLog(t=t, q=q, tau=tau)


def with_torques(recording: Any, cell: Any, change: Any) -> Any:
    """The recording with other currents. The first row, at which the simulator starts from rest, takes the residual of
    the next."""
    n, experiments = cell.robot.joints, []
    for e in recording.experiments:
        y, shown = change(identify.recorded([e], n)), identify.columns(cell, [e])
        y[0] = shown[0] + y[1] - shown[1]
        values = {name: np.array(e[name]) for name in e.data.columns} | {f"i{k + 1}": y[:, k] for k in range(n)}
        out = kr5.cell.Experiment(name=e.name, kind=e.kind, file=e.file, split=e.split)
        out.data = kr5.io.Table(list(values), np.column_stack(list(values.values())))
        experiments.append(out)
    return kr5.cell.Recording(cell, experiments)


def prepare(arm: TorqueArm, data: Path, cell: Any = None) -> Prepared:
    """Identifies on the fit part, and states the noise. `cell` has another structure than the one with which angles
    were read."""
    recording, objections = bring_in(arm, data)
    recording.cell = cell or recording.cell
    found = identify.identify(recording.cell, recording.experiments, arm.rotors)
    fit = [e for e in recording.experiments if str(e.split) == "fit"]
    residual = (identify.recorded(fit, arm.robot.joints) - identify.columns(found.cell, fit) - found.offset)[1:]
    sigma = residual.std(0)
    seen = 1.4826 * np.median(np.abs(residual[:-2] - 2 * residual[1:-1] + residual[2:]), axis=0) / np.sqrt(6)
    scaled = identify.with_drives(found.cell, torque_constant=np.asarray(found.cell.drives.torque_constant) * sigma)
    out = with_torques(recording, scaled, lambda y: (y - found.offset) / sigma)
    return Prepared(out, scaled, found.offset, sigma, 2 / float(np.median(seen / sigma)), objections)


def without_friction(cell: Any, joints: list[int]) -> Any:
    keep = np.array([k + 1 not in joints for k in range(cell.robot.joints)], float)
    friction = cell.drives.friction
    return identify.with_drives(cell, coulomb=friction.coulomb * keep, viscous=friction.viscous * keep)


# Poses under a laser tracker

NOMINAL = {  # DH rows (b, a, alpha), tool along z [m]
    "UR5": (
        [(0.08925, 0, H), (0, -0.425, 0), (0, -0.39225, 0), (0.10915, 0, H), (0.09465, 0, -H), (0.0823, 0, 0)],
        0.031,
    ),
    "WAM": ([(0, 0, -H), (0, 0, H), (0.55, 0.045, -H), (0, -0.045, H), (0.3, 0, -H), (0, 0, H), (0.06, 0, 0)], 0.044),
}


def tracked(name: str, data: Path) -> Any:
    """The grid to fit, the random poses to check; measured = target + difference. Noise is stated by `state_noise`."""
    rows, tool = NOMINAL[name]
    cell = kr5.cell.Cell(
        robot=kr5.cell.Robot(dh=[kr5.kinematics.DhJoint(b=b, a=a, alpha=alpha) for b, a, alpha in rows]),
        tool=kr5.cell.Tool(T_flange_tool=kr5.from_xyzrpy([0, 0, tool, 0, 0, 0])),
        noise=kr5.cell.Noise(pose_position=1e-4),
    )
    n = len(rows)
    experiments = []
    with tempfile.TemporaryDirectory() as folder:
        kr5.cell.save_cell(cell, Path(folder) / "cell.yaml")
        for split, part in (("fit", "grid"), ("check", "random")):
            log = np.genfromtxt(
                data / f"geo_ur5_wam_lasertracker/3D_{name}_uncalibrated_{part}_cleaned.csv", delimiter=",", names=True
            )
            sums = {axis: log[f"{axis}_t"] + log[f"{axis}_dif"] for axis in "xyz"}
            np.savez(Path(folder) / f"{part}.npz", q=np.column_stack([log[f"joint_{k + 1}"] for k in range(n)]), **sums)
            wanted = {"q": {"from": "q[{0}]", "unit": "deg"}} | {axis: {"from": axis, "unit": "mm"} for axis in "xyz"}
            map_file = Path(folder) / f"{part}.yaml"
            map_file.write_text(
                yaml.safe_dump(
                    {
                        "format": "kr5-map/1",
                        "cell": "cell.yaml",
                        "columns": wanted,
                        "experiments": [{"name": part, "kind": "poses", "split": split}],
                    }
                )
            )
            experiments += import_recording(Path(folder) / f"{part}.npz", map_file)[0].experiments
    return kr5.cell.Recording(cell, experiments)


def position_errors(cell: Any, experiment: Any) -> np.ndarray:
    """Distance of the tool from where it was measured [m]."""
    shown = identify.SIMULATOR.predict(cell, experiment)
    return np.linalg.norm(np.column_stack([shown[a] - experiment[a] for a in "xyz"]), axis=1)


def all_of_dh(cell: Any, experiment: Any) -> Any:
    """Least squares of every DH parameter, base and tool: the usual calibration, without a choice of parameters."""
    from scipy.optimize import least_squares

    n = cell.robot.joints
    q = np.column_stack([experiment[f"q{k + 1}"] for k in range(n)])
    seen = np.column_stack([experiment[a] for a in "xyz"])

    def build(p: np.ndarray) -> Any:
        rows = [
            kr5.kinematics.DhJoint(
                b=j.b + d[0], a=j.a + d[1], alpha=j.alpha + d[2], theta_offset=j.theta_offset + d[3], beta=d[4]
            )
            for j, d in zip(cell.robot.dh, p[: 5 * n].reshape(n, 5))
        ]
        T = np.array(cell.tool.T_flange_tool)
        T[:3, 3] += p[-3:]
        return kr5.cell.Cell(
            robot=kr5.cell.Robot(dh=rows, T_base_0=kr5.from_xyzrpy(p[5 * n : 5 * n + 6])),
            tool=kr5.cell.Tool(T_flange_tool=T),
        )

    def residual(p: np.ndarray) -> np.ndarray:
        chain, tool = build(p).nominal_chain(), np.array(cell.tool.T_flange_tool[:3, 3]) + p[-3:]
        T = np.asarray(chain.flanges(q)).reshape(-1, 4, 4)
        return np.concatenate([1e3 * (T[:, :3, :3] @ tool + T[:, :3, 3] - seen).ravel(), p / 0.05])

    return build(least_squares(residual, np.zeros(5 * n + 9)).x)
