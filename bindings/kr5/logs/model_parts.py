"""What a log needs of a model that its description does not state: parts to try effects on, noise, torque constants,
and how far the best model of the arm stays off."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

import kr5
import kr5.cell
import kr5.gap
import kr5.predict
from kr5 import identification
from kr5.logs.joint_columns import range_text
from kr5.logs.joint_motion import arm_model, merged_motion, motion_of

SHOWN = 3.0  # standard deviations from which friction or an offset beside it counts
SURE = 5.0  # standard deviations that a torque constant must be above zero
FRICTION_SPEED = 0.002  # [rad/s or m/s] over which dry friction changes its sign, as in the format of cells
DEAD_SHARE = 0.1  # of the spread of the model's loads, below which a column shows nothing of them
SHOWN_BY_CHANCE = 2.0  # standard deviations that what a model leaves may seem smaller than it is
CLEAR_DELAY = 10.0  # gain of log likelihood: chance alone, of which chi-square shows 20, reaches it once in 1e5
GREATEST_DELAY = 0.1  # that is searched [s]
LEAST_STEP = 0.004  # of that search [s]
UNLIKE = 0.5  # correlation, from which a column shows the loads in another unit
NO_WEIGHT = 100.0  # times what a column leaves, which then says nothing for any effect
LEAST_NOISE = 3e-3  # of the spread of a load: what a simulation without noise leaves of rounding and smoothing
NORMAL_MAD = 1.4826  # standard deviation over median absolute deviation


def with_parts_to_try(cell: Any) -> tuple[Any, list[str]]:
    """The cell with drives and tool, where its description has none: rotors, friction and payload can then be tried."""
    notes, n = [], cell.robot.joints
    if cell.drives is None and cell.robot.links:
        cell.drives = kr5.cell.Drives(
            structure=np.eye(n),
            rotor_inertia=np.zeros(n),
            torque_constant=np.ones(n),
            friction=kr5.cell.Friction(coulomb=np.zeros(n), viscous=np.zeros(n)),
        )
        notes.append("the model states no drives: friction and rotor inertia are taken as 0")
    if cell.tool is None:
        cell.tool = kr5.cell.Tool(T_flange_tool=np.eye(4))
        notes.append("the model states no tool: nothing is taken to hang on the flange")
    return cell, notes


KEPT_PARTS = ("servo", "camera", "board", "targets", "laser", "contact", "peg", "tube")  # no description states them


def with_parts_of(model: Any, own: Any) -> Any:
    """The robot of a description in the cell of a recording: noise, sensors, and what else the description does not
    state, stay those of the recording. Ends with an error where it is another robot."""
    cell = model.cell
    _require_same_joints(model, own)
    cell.noise = own.noise
    for part in KEPT_PARTS:
        if not getattr(cell, part):
            setattr(cell, part, getattr(own, part))
    if own.drives is not None:
        cell.drives = _drives_of(cell.drives, own.drives, str(model.kind) == "mjcf")
    if own.tool is not None and cell.tool.mass == 0:
        cell.tool = _tool_of(cell, own)
    return cell


def _require_same_joints(model: Any, own: Any) -> None:
    cell, names = model.cell, list(own.robot.joint_names)
    if cell.robot.joints != own.robot.joints:
        raise kr5.FileError(
            model.file,
            f"found {cell.robot.joints} joints, expected {own.robot.joints}, as the recording has; is"
            " this the model of its robot, and do --base and --tip name its arm?",
        )
    if names and cell.robot.joint_names and names != list(model.joints):
        raise kr5.FileError(
            model.file,
            f"found the joints {', '.join(model.joints)}, expected {', '.join(names)}, as the recording"
            " has; is this the model of its robot?",
        )


def _drives_of(stated: Any, own: Any, has_rotors: bool) -> Any:
    """Gears and motors of the recording, with the friction of the description where it states any, and its rotors,
    which it states on the side of the joints."""
    if stated is None:
        return own
    own.friction = stated.friction
    if has_rotors:
        back = np.linalg.inv(np.asarray(own.structure))
        own.rotor_inertia = np.diag(back.T @ np.diag(np.asarray(stated.rotor_inertia)) @ back).copy()
    return own


def _tool_of(cell: Any, own: Any) -> Any:
    """The tool of the recording, unless the arm of the description reaches to its tip and so has it as a link."""
    tip, flange = (at[:3, 3] for at in (own.T_base_tool(np.zeros(own.robot.joints)), _flange(own)))
    end = _flange(cell)[:3, 3]
    if np.linalg.norm(end - flange) <= np.linalg.norm(end - tip):
        return own.tool
    tool = kr5.cell.Tool()
    tool.T_flange_sensor = np.linalg.inv(np.asarray(own.tool.T_flange_tool)) @ np.asarray(own.tool.T_flange_sensor)
    return tool


def _flange(cell: Any) -> np.ndarray:
    """Pose of the flange in the base, at zero joint angles."""
    tool = np.eye(4) if cell.tool is None else np.asarray(cell.tool.T_flange_tool)
    return np.asarray(cell.T_base_tool(np.zeros(cell.robot.joints)) @ np.linalg.inv(tool))


def with_noise(recording: Any) -> list[str]:
    """States the noise of columns for which the cell has none, as neighbouring rows show it; notes in words."""
    cell, notes = recording.cell, []
    n = cell.robot.joints
    for family, own in (("i", "joint_current"), ("tau", "joint_torque")):
        columns = [f"{family}{k + 1}" for k in range(n)]
        logs = [e for e in recording.experiments if columns[0] in e.data]
        if not logs or _is_stated(cell, family):
            continue
        noise = cell.noise
        if family == "tau" and cell.drives is not None and noise.current > 0:
            shares = np.asarray(cell.drives.structure).T * np.asarray(cell.drives.torque_constant) * noise.current
            noise.joint_torque = np.linalg.norm(shares, axis=1).tolist()
            cell.noise = noise
            notes.append("noise of the joint torques follows from that of the currents")
            continue
        readings = [[np.asarray(e[c]) for e in logs] for c in columns]
        sigma = [max(difference_noise(x), LEAST_NOISE * float(np.concatenate(x).std())) for x in readings]
        setattr(noise, own, sigma)
        cell.noise = noise
        units = ["A"] * n if family == "i" else [_load_unit(cell, k) for k in range(n)]
        shown = [f"{s:.2g}" if len(set(units)) == 1 else f"{s:.2g} {unit}" for s, unit in zip(sigma, units)]
        unit = f" [{units[0]}]" if len(set(units)) == 1 else ""
        notes.append(f"noise of {range_text(columns)}, from neighbouring rows{unit}: {', '.join(shown)}")
    for key, columns in (
        ("position", [f"q{k + 1}" for k in range(n)]),
        ("force", ["fx", "fy", "fz"]),
        ("torque", ["tx", "ty", "tz"]),
    ):
        logs = [e for e in recording.experiments if columns[0] in e.data and str(e.kind) == "motion"]
        if not logs or cell.noise.of(key) > 0:
            continue
        value = float(
            np.median([difference_noise([np.asarray(e[c]) for e in logs]) for c in columns if c in logs[0].data])
        )
        noise = cell.noise
        setattr(noise, key, value)
        cell.noise = noise
        notes.append(f"noise.{key}, from neighbouring rows: {value:.2g}")
    recording.cell = cell
    return notes


def _load_unit(cell: Any, joint: int) -> str:
    """Unit of what a joint bears."""
    return "N" if str(cell.robot.dh[joint].type) == "prismatic" else "N m"


def _is_stated(cell: Any, family: str) -> bool:
    """Whether the cell states the noise of currents or joint torques; `torque` is that of the wrist sensor, where there
    is one."""
    noise = cell.noise
    if family == "i":
        return bool(noise.current > 0 or len(noise.joint_current))
    return bool(len(noise.joint_torque) or (noise.torque > 0 and noise.force == 0))


def difference_noise(parts: list[np.ndarray]) -> float:
    """Standard deviation of one reading by third differences, in which what is smooth cancels; of coarse numbers, that
    of their step."""
    third = np.concatenate([np.diff(x, 3) for x in parts]) / np.sqrt(20.0)
    sigma = NORMAL_MAD * float(np.median(np.abs(third)))
    steps = np.abs(np.concatenate([np.diff(x) for x in parts]))
    coarse = float(steps[steps > 0].min()) / np.sqrt(12.0) if (steps > 0).any() else 0.0
    return max(sigma, coarse, 1e-9)


def with_torque_constants(recording: Any) -> list[str]:
    """Torque constants [N m/A on the joint side, N/A of a slide] of a model that states none, by the currents that its
    torques take; masses of the model that are all off by one factor cannot be told from them."""
    cell, n = recording.cell, recording.cell.robot.joints
    fit = [e for e in recording.experiments if str(e.kind) == "motion" and str(e.split) == "fit" and "i1" in e.data]
    if not fit:
        return []
    motion = merged_motion([motion_of(cell, e) for e in fit])
    torque = np.vstack([_nominal_torques(cell, e) for e in fit])
    current = np.vstack([np.column_stack([e[f"i{k + 1}"] for k in range(n)]) for e in fit])
    constants, deviations = [], []
    for k in range(n):
        value, std = _torque_constant(torque[:, k], np.asarray(motion.qd)[:, k], current[:, k])
        if not value > SURE * std:
            raise kr5.InvalidArgument(
                f"the log does not tell the torque constant of joint {k + 1} ({value:.3g} ± {std:.2g}"
                f" {_load_unit(cell, k)}/A), which the model does not state; state them:"
                " --set 'cell.drives.torque_constant=[...]', or log torques"
            )
        constants.append(value)
        deviations.append(std)
    drives = cell.drives
    drives.torque_constant = np.array(constants)
    cell.drives = drives
    recording.cell = cell
    units = [f"{_load_unit(cell, k)}/A" for k in range(n)]
    one = units[0] if len(set(units)) == 1 else ""
    shown = ", ".join(f"{v:.3g} ± {s:.1g}{'' if one else f' {u}'}" for v, s, u in zip(constants, deviations, units))
    return [f"torque constants from the log, for the masses of the model{f' [{one}]' if one else ''}: {shown}"]


def _torque_constant(torque: np.ndarray, speed: np.ndarray, current: np.ndarray) -> tuple[float, float]:
    """Slope of torque over current, and its standard deviation; friction and offset stand beside it as far as the log
    shows any."""
    columns = [torque, np.tanh(speed / FRICTION_SPEED), speed, np.ones_like(speed)]
    while True:
        A = np.column_stack(columns)
        scale = np.linalg.norm(A, axis=0)
        scale[scale == 0] = 1.0
        solution, _, rank, _ = np.linalg.lstsq(A / scale, current, rcond=1e-8)
        left = current - A / scale @ solution
        correlation = _lag_one(left)
        variance = left @ left / max(len(current) - rank, 1) * (1 + correlation) / (1 - correlation)
        std = np.sqrt(variance * np.diag(np.linalg.pinv((A / scale).T @ (A / scale))))
        sure = np.abs(solution[1:]) / np.maximum(std[1:], 1e-300)
        if not len(sure) or sure.min() > SHOWN:
            break
        del columns[1 + int(sure.argmin())]
    slope, deviation = solution[0] / scale[0], std[0] / scale[0]
    return (1 / slope, float(deviation / slope**2)) if slope > 0 else (0.0, np.inf)


def _lag_one(x: np.ndarray) -> float:
    """Correlation of neighbours, by which fewer samples count."""
    power = float(x @ x)
    return float(np.clip(x[1:] @ x[:-1] / power, 0.0, 0.999)) if power > 0 else 0.0


def _nominal_torques(cell: Any, experiment: Any) -> np.ndarray:
    bare = kr5.cell.parse_cell(cell.to_yaml())
    bare.drives = None
    shown = kr5.predict.FastSimulator().predict(bare, experiment)
    return np.column_stack([shown[f"tau{k + 1}"] for k in range(cell.robot.joints)])


@dataclass
class KnownErrors:
    """How far the best model of an arm stays off in each load column, and the joints whose loads show nothing of it."""

    errors: list[Any] = field(default_factory=list)  # kr5.gap.ColumnError
    dead: list[int] = field(default_factory=list)  # from 0
    delay: float = 0.0  # by which the loads were clearly logged late; negative: early [s]


def known_errors(recording: Any) -> KnownErrors:
    """Base parameters, friction and rotors are fitted to the rows to fit, of an arm on measured positions. Of a joint
    whose loads were not measured, the error is all of them. Effects that are not in that model, such as torque ripple
    or backlash, are found where they stand out of it. Empty unless motions are on measured positions."""
    cell, n = recording.cell, recording.cell.robot.joints
    fit = [
        e
        for e in recording.experiments
        if str(e.split) == "fit" and str(e.joint_reference) == "measured" and ("tau1" in e.data or "i1" in e.data)
    ]
    if not fit or cell.drives is None:
        return KnownErrors()
    tau = np.vstack([np.asarray(motion_of(cell, e).tau) for e in fit])
    nominal = np.vstack([_nominal_torques(cell, e) for e in fit])
    dead = dead_columns(tau, nominal)
    family = "tau" if "tau1" in fit[0].data else "i"
    left, delay = _left_by_best_model(cell, fit, tau.std(axis=0), [k for k in range(n) if k not in dead])
    # Where the motion determines no such model, its error is not known to be more than chance makes of it.
    left = np.zeros_like(tau) if left is None else left
    dead_left = NO_WEIGHT * (tau - nominal)[:, dead]
    left[:, dead] = np.sqrt((dead_left**2).mean(axis=0))
    if family == "i":
        left = left @ np.linalg.inv(np.asarray(cell.drives.structure)) / np.asarray(cell.drives.torque_constant)
    noise = np.array([cell.noise.of("torque" if family == "tau" else "current", k) for k in range(n)])
    scatter = SHOWN_BY_CHANCE * np.sqrt(2 / len(left)) * noise**2  # of a mean square
    smooth = np.sqrt(np.maximum((left**2).mean(axis=0) - noise**2 + scatter, scatter))
    stated = [k for k in range(n) if noise[k] > 0]  # others are not compared
    errors = [kr5.gap.ColumnError(column=f"motion.{family}{k + 1}", error=float(smooth[k])) for k in stated]
    return KnownErrors(errors, dead, delay)


def _left_by_best_model(
    cell: Any, fit: list[Any], spread: np.ndarray, live: list[int]
) -> tuple[np.ndarray | None, float]:
    """Torques that the best rigid arm with friction leaves, rows x joints [N m or N], None where the motion determines
    none; and how late they were logged [s], where that is clear. If so, the best arm is fitted at that delay, so that a
    clock fault is not counted as an error of the arm. spread: standard deviation of each torque [N m or N]."""
    terms = [identification.JointTerms(offset=True, rotor_inertia=True)] * cell.robot.joints
    model, options = arm_model(cell, terms), identification.DynamicsOptions(held_out=0.0)

    @cache
    def left(delay: float) -> np.ndarray | None:
        motion = merged_motion([motion_of(cell, e, delay) for e in fit])
        found = identification.identify_dynamics(motion, model, options)
        return np.asarray(motion.tau) - np.asarray(found.predicted) if found.fit.usable else None

    def negative_log_likelihood(delay: float) -> float:
        rest = left(delay)
        if rest is None:
            return np.inf
        return float(independent[live] @ np.log((rest[:, live] ** 2).mean(axis=0) + floor) / 2)

    on_time = left(0.0)
    if on_time is None or not live:
        return on_time, 0.0
    correlation = np.array([_lag_one(x) for x in on_time.T])
    independent = len(on_time) * (1 - correlation) / (1 + correlation)
    floor = (LEAST_NOISE * spread[live]) ** 2 + np.finfo(float).tiny  # below which a residual is rounding
    row = float(np.median(np.diff(fit[0]["t"])))
    delay = _best_delay(negative_log_likelihood, max(row, LEAST_STEP))
    gain = negative_log_likelihood(0.0) - negative_log_likelihood(delay)
    if abs(delay) < row / 2 or not gain >= CLEAR_DELAY:
        return on_time, 0.0
    return left(delay), delay


def _best_delay(cost: Callable[[float], float], step: float) -> float:
    """The delay of the least cost [s]: a walk from none, then between its steps; none where the walk does not end."""
    at = 0
    while True:
        best = min((at, at - 1, at + 1), key=lambda k: cost(k * step))
        if best == at:
            break
        at = best
        if abs(at) * step > GREATEST_DELAY:
            return 0.0
    found = minimize_scalar(
        cost, bounds=((at - 1) * step, (at + 1) * step), method="bounded", options={"xatol": step / 50}
    )
    return float(found.x)


def dead_columns(got: np.ndarray, model: np.ndarray) -> list[int]:
    """Columns that show hardly anything where the model shows a load, as of a joint whose effort is not measured; both
    rows x joints."""
    out = []
    for k in range(got.shape[1]):
        a, b = got[:, k] - got[:, k].mean(), model[:, k] - model[:, k].mean()
        alike = abs(float(a @ b)) / max(float(np.linalg.norm(a) * np.linalg.norm(b)), 1e-300)
        if a.std() < DEAD_SHARE * b.std() and alike < UNLIKE:
            out.append(k)
    return out
