"""How the columns of one quantity of the joints are to be read: unit, side of the gears, rows without a number."""

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import kr5
import kr5.cell
from kr5 import arm_log
from kr5.logs.column_names import Family
from kr5.logs.log import Log
from kr5.logs.map_file import Source, names_of, read_source
from kr5.logs.overrides import GivenEntries
from kr5.logs.sparse_columns import never_complete
from kr5.logs.values import to_si

FARTHEST = 20.0  # [m] a cell reaches, beyond which a length is in millimetres


def joint_entry(
    family: Family, log: Log, cell: kr5.cell.Cell, stated: GivenEntries, beside: Family | None = None
) -> tuple[dict[str, Any], str, str]:
    """Its entry in a map, what of it is proposed, and why. `stated`: what the user states; `beside`: other columns of
    the same quantity, which tell its unit, too."""
    given, put = stated.columns.get(family.name, {}), partial(stated.words.put, f"columns.{family.name}")
    if "side" in given:
        family = replace(family, motor_side=given["side"] == "motor")
    values = log.stacked(family.columns)
    if empty := [name for name, column in zip(family.columns, values.T) if not np.isfinite(column).any()]:
        raise kr5.FileError(
            log.file,
            f"{range_text(empty)}: found no number in any row, expected"
            f" {'positions' if family.name in ('q', 'qc') else 'efforts'} of the joints; check that the publisher fills"
            f" them in, or name other columns: {put(**{'from': '[...]'})}",
        )
    entry: dict[str, Any] = {"from": pattern_of(family.columns)}
    if "unit" in given:
        unit, why = given["unit"], "as stated"
    else:
        shown = [_scaled(values, given)]
        if beside is not None and (beside.unit, beside.motor_side) == (family.unit, family.motor_side):
            shown.append(_scaled(log.stacked(beside.columns), stated.columns.get(beside.name, {})))
        told = np.concatenate(shown) if len(shown) > 1 else shown[0]
        unit, why = _joint_unit(family, told, log, cell, None if "scale" in given else put)
    entry["unit"] = unit
    if family.motor_side:
        entry["side"] = "motor"
        why += f"; on the motor side, {'as stated' if 'side' in given else 'by the name'}"
    if not np.isfinite(values).all():
        entry["missing"] = "drop" if family.name in ("q", "qc") and not never_complete(values) else "interpolate"
    entry |= {key: value for key, value in given.items() if key != "from"}
    how = "as stated" if "from" in given else "by the names of the joints" if family.named else "counted"
    units = "/".join(dict.fromkeys(map(str, unit))) if isinstance(unit, list) else unit
    return entry, f"{range_text(family.columns)} [{units}]", how if how == why else f"{how}; {why}"


def range_text(columns: list[str]) -> str:
    """The first and the last of the columns."""
    return columns[0] if len(columns) == 1 else f"{columns[0]} to {columns[-1]}"


def pattern_of(names: list[str]) -> Any:
    """One name with {} where joints are counted, or the list."""
    match = re.findall(r"\d+", names[0])
    if match and match[-1] in ("0", "1"):
        at = names[0].rindex(match[-1])
        pattern = names[0][:at] + ("{}" if match[-1] == "1" else "{0}") + names[0][at + len(match[-1]) :]
        if names_of(pattern, len(names), "") == names:
            return pattern
    return names


def joint_values(entry: Mapping[str, object], name: str, log: Log, cell: kr5.cell.Cell) -> np.ndarray:
    """The columns in SI, on the joint side; rows x joints."""
    members = [f"{name}{k + 1}" for k in range(cell.robot.joints)]
    source = read_source(entry, name, members, Path(log.file), ("columns", name), "")
    assert isinstance(source, Source), "of joints"
    raw = np.column_stack([log.column(n, source.where) for n in source.names])
    return to_si(source, name, raw, cell, lambda _: None)


def _scaled(values: np.ndarray, given: Mapping[str, object]) -> np.ndarray:
    """What is told by the size of numbers is told of those that the user scales them to."""
    if not given.keys() & {"scale", "offset"}:
        return values
    try:
        return np.asarray(values * np.asarray(given.get("scale", 1.0), float) + np.asarray(given.get("offset", 0.0)))
    except (TypeError, ValueError):  # the reader of maps refuses it
        return values


def _joint_unit(
    family: Family, values: np.ndarray, log: Log, cell: kr5.cell.Cell, put: Callable[..., str] | None
) -> tuple[str | list[str], str]:
    """Unit of the columns, from their name or the size of their numbers. `put`: how errors ask for a scale, where none
    is stated."""
    if family.unit == "%" and family.name not in ("q", "qc") and put is not None:
        how = put(scale="[...]", unit="A" if family.name == "i" else "N m")
        raise kr5.FileError(
            log.file,
            f"{range_text(family.columns)}: found per cent of a rated value, expected N m, N or A; state"
            f" what 1 % is for each joint, and its unit: {how}",
        )
    size = _largest(values)
    why = f"values up to {size:.4g}"
    if family.name in ("q", "qc", "qd"):
        slides = [str(j.type) == "prismatic" for j in cell.robot.dh]
        turning = values[:, [not s for s in slides]] if any(slides) else values
        unit, told = _angle_unit(family, turning, [not s for s in slides], log, cell, put)
        length = "mm" if family.unit == "mm" or (any(slides) and _largest(values[:, slides]) > FARTHEST) else "m"
        return (unit if not any(slides) else [length if s else unit for s in slides]), why + told
    if family.name == "i":
        return _stated(family, ("mA",), "mA" if size > 200 else "A", why, " are too large for A")
    if any(str(j.type) == "prismatic" for j in cell.robot.dh):
        return ["N" if str(j.type) == "prismatic" else "N m" for j in cell.robot.dh], why
    return _stated(family, ("N m", "N mm"), "N mm" if size > 5000 else "N m", why, " are too large for N m")


TOLD = {
    "rad": "",
    "deg": " are too large for radians",
    "tick": " are whole, as counts of an encoder with 4096 a turn, of which 2048 is taken for zero",
    "percent": " are per cent of the range of each joint in the model",
    "signed_percent": " are per cent of half the range of each joint in the model, from its middle",
}


def _angle_unit(
    family: Family,
    turning: np.ndarray,
    turns: list[bool],
    log: Log,
    cell: kr5.cell.Cell,
    put: Callable[..., str] | None,
) -> tuple[str, str]:
    """Unit of angles, and what their numbers tell of it."""
    if family.unit in ("deg", "rad") or not turning.size:
        return family.unit or "rad", ""
    if family.motor_side:
        large = _largest(turning) > arm_log.MAX_RADIANS * _gear_ratio(cell)
        return ("deg", TOLD["deg"]) if large else ("rad", "")
    limits = cell.robot.limits
    none = np.zeros(0)
    low, high = (np.asarray(limits.lower)[turns], np.asarray(limits.upper)[turns]) if limits else (none, none)
    guess = arm_log.guess_joint_unit(turning, low, high)
    unit = str(guess.unit)
    if family.unit == "%" and unit in ("rad", "deg"):
        unit = "signed_percent" if float(np.nanmin(turning)) < 0 else "percent"
    if guess.degrees_or_percent and log.percent_likely and family.unit != "%" and put is not None:
        signed = "signed_percent" if float(np.nanmin(turning)) < 0 else "percent"
        raise kr5.FileError(
            log.file,
            f"{range_text(family.columns)}: found values up to {_largest(turning):.4g}, which may be"
            f" degrees, or per cent of the range of each joint, as LeRobot writes both; state which: {put(unit='deg')},"
            f" or {put(unit=signed)} (and the same of columns.{'qc' if family.name == 'q' else 'q'})",
        )
    return unit, TOLD[unit]


def _stated(family: Family, units: tuple[str, ...], guessed: str, why: str, too_large: str) -> tuple[str, str]:
    if family.unit in units:
        return str(family.unit), f"{why}; unit from the name"
    return guessed, why + (too_large if guessed in ("mA", "N mm") else "")


def _largest(values: np.ndarray) -> float:
    """The largest size of a number, without a copy of all of them."""
    return max(float(np.nanmax(values)), -float(np.nanmin(values)))


def _gear_ratio(cell: kr5.cell.Cell) -> float:
    return float(np.abs(np.asarray(cell.drives.structure)).max()) if cell.drives else 100.0
