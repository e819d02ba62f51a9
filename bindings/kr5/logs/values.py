"""Numbers of a log in SI, on the joint side, in the frames of the cell, and at other instants."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import kr5
import kr5.cell
from kr5 import arm_log, physics
from kr5.logs.log import Log
from kr5.logs.map_file import Source, Tool
from kr5.logs.units import MIDDLE_TICK, OF_RANGE, UNITS, unit_factor

MAX_ROWS = 5_000_000  # to be smoothed at once
Note = Callable[[str], None]


@dataclass
class Series:
    """Values of a family over its own time."""

    t: np.ndarray
    values: np.ndarray


def column_unit(cell: kr5.cell.Cell, name: str, member: int, source: Source) -> float:
    """Size in SI of the unit of the log of one column of a family."""
    return _scale_of(source, name, cell, member)[0]


def _scale_of(source: Source, name: str, cell: kr5.cell.Cell, member: int) -> tuple[float, float, str]:
    """Size in SI of the unit of a column, the value of its zero, and what it is of."""
    unit, quantities = source.unit[member], column_quantities(cell, name, member)
    if unit in OF_RANGE and name in ("q", "qc"):
        limits = cell.robot.limits
        low, high = (float(ends[member]) for ends in (limits.lower, limits.upper)) if limits else (np.nan, np.nan)
        if not np.isfinite(high - low):
            raise kr5.IoError(
                f"{source.where}: unit: found {unit}, per cent of the range of a joint, of which the model states no"
                " limits; state them in the model, or what 1 % is as scale and unit"
            )
        if unit == "percent":
            return (high - low) / 100, low, quantities[0]
        return (high - low) / 200, (low + high) / 2, quantities[0]
    factor, quantity = unit_factor(unit, quantities, source.where)
    return factor, -MIDDLE_TICK * factor if unit == "tick" else 0.0, quantity


def to_si(source: Source, name: str, raw: np.ndarray, cell: kr5.cell.Cell, note: Note) -> np.ndarray:
    """Numbers of the log in SI, on the joint side (currents: on the motors), wrenches in S."""
    out = np.empty(raw.shape)
    kinds = []
    for k in range(len(source.unit)):
        scale, zero, quantity = _scale_of(source, name, cell, k)
        out[:, k] = (raw[:, k] * source.scale[k] + source.offset[k]) * scale + zero
        kinds.append(quantity)
    if name == "wrench" and source.frame:
        R, p = (T := kr5.from_xyzrpy(source.frame))[:3, :3], T[:3, 3]
        force = out[:, :3] @ R.T
        return np.column_stack([force, out[:, 3:] @ R.T + np.cross(p, force)])
    if name in ("q", "qc", "i", "tau"):
        return across_gears(source, name, out, cell, note, "current" if "current" in kinds else "torque")
    return out


QUANTITY = {
    "t": ("time",),
    "x": ("length",),
    "y": ("length",),
    "z": ("length",),
    "zc": ("length",),
    "cx": ("length",),
    "cy": ("length",),
    "speed": ("speed",),
    "u": ("pixel",),
    "v": ("pixel",),
    "tilt": ("angle",),
    "alpha": ("angle",),
    "fc": ("force",),
}


def column_quantities(cell: kr5.cell.Cell, name: str, member: int) -> tuple[str, ...]:
    if name in ("q", "qc"):
        slide = str(cell.robot.dh[member].type) == "prismatic"
        return ("length",) if slide else ("angle",)
    if name in ("i", "tau"):
        return ("torque", "force", "current")
    if name == "wrench":
        return ("force",) if member < 3 else ("torque",)
    return QUANTITY.get(name, ("none",))


def of_motors(source: Source) -> bool:
    """Whether a family was measured on the motors, as currents are on whatever side they are stated."""
    return source.side == "motor" or any(unit in UNITS["current"] for unit in source.unit)


def across_gears(
    source: Source, name: str, values: np.ndarray, cell: kr5.cell.Cell, note: Note, quantity: str
) -> np.ndarray:
    """Motor to joint side and back by the structure matrix S; torque to current and back by the torque constants."""
    drives = cell.drives
    motor = of_motors(source)
    if (name in ("q", "qc") and not motor) or (name == "tau" and not motor):
        return values
    if drives is None:
        raise kr5.IoError(
            f"{source.where}: needs drives (structure, torque_constant) in the cell, which it does not have"
        )
    S, constant = np.asarray(drives.structure), np.asarray(drives.torque_constant)
    if name in ("q", "qc"):
        note(f"{name}: motor angles were converted to joint angles by the structure matrix of the cell")
        return values @ np.linalg.inv(S).T
    if name == "tau":
        note("tau: motor torques were converted to joint torques by the structure matrix of the cell")
        return np.asarray(physics.reported_torques(cell, values) if quantity == "current" else values @ S)
    if quantity == "torque":
        note("i: torques were converted to currents by the torque constants of the cell")
        return np.asarray((values if motor else values @ np.linalg.inv(S)) / constant)
    return values


def tool_poses(tool: Tool, log: Log) -> np.ndarray:
    """x y z qw qx qy qz of the tool in the base."""
    import kr5.calibration

    form = {"position": tool.position, "rotation": tool.rotation, "angle": tool.angle}
    choices = {f["name"]: f.get("choices") for f in kr5.calibration.PoseFormat.fields()}
    for key, word in form.items():
        if choices.get(key) and word not in choices[key]:
            raise kr5.IoError(f"{tool.where}: {key}: found '{word}', expected one of {', '.join(choices[key])}")
    rows = np.column_stack([log.column(n, tool.where) for n in tool.names])
    if not np.isfinite(rows).all():
        row = int(np.flatnonzero(~np.isfinite(rows).all(axis=1))[0])
        raise kr5.FileError(
            log.file,
            f"{log.row(row)}: found no number in a column of the tool's pose; delete the row, which has no measurement",
        )
    try:
        poses = kr5.calibration.to_poses(rows, kr5.calibration.PoseFormat(**form))
    except kr5.Error as error:
        raise kr5.FileError(
            log.file, f"{', '.join(tool.names)}: {error}; are 'rotation', 'angle' and the order of columns right?"
        ) from error
    device, mark = kr5.from_xyzrpy(tool.device), np.linalg.inv(kr5.from_xyzrpy(tool.mark))
    poses = device @ np.array(poses) @ mark
    from scipy.spatial.transform import Rotation

    xyzw = Rotation.from_matrix(poses[:, :3, :3]).as_quat(canonical=True)
    return np.column_stack([poses[:, :3, 3], xyzw[:, 3], xyzw[:, :3]])


def low_pass(s: Series, cut: float, where: str) -> Series:
    """Zero-phase Butterworth low-pass of order 4 (run forth and back), on even steps."""
    step = arm_log.middle_step(s.t)
    if cut >= 0.5 / step:
        raise kr5.IoError(
            f"{where}: resample.low_pass: found {cut:g} Hz, expected less than half the rate of the log,"
            f" {0.5 / step:.4g} Hz"
        )
    count = (s.t[-1] - s.t[0]) / step + 1
    if not 30 < count <= MAX_ROWS:
        raise kr5.IoError(
            f"{where}: resample.low_pass: found {count:.4g} rows to smooth, expected 30 to {MAX_ROWS}, at even "
            f"steps of {step:.4g} s"
        )
    smoothed = arm_log.smooth_positions(s.t, s.values, arm_log.Smoothing(cutoff=cut, smooths=True))
    return Series(np.asarray(smoothed.t), np.asarray(smoothed.q))


def interpolate(s: Series, grid: np.ndarray, method: str) -> np.ndarray:
    if method == "cubic":
        return np.asarray(arm_log.positions_at(arm_log.Positions(t=s.t, q=s.values), grid))
    if method == "previous":
        return s.values[np.clip(np.searchsorted(s.t, grid, "right") - 1, 0, len(s.t) - 1)]
    return np.column_stack([np.interp(grid, s.t, column) for column in s.values.T])
