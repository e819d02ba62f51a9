"""The unit of a column: as an option states it, as its name says, or as the size of its numbers tells."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import kr5
import kr5.io
from kr5.logs.units import UNITS
from kr5.tables.roles import LARGEST, OTHER_UNIT, Role, Units

UNIT_OPTIONS = {"angle": "--angle-unit", "length": "--length-unit"}
FULL = {"deg": "degrees", "mm": "millimetres"}
PLURAL = {"angle": "angles", "length": "lengths"}


@dataclass(frozen=True)
class ColumnName:
    """A column of a file, by what its name says."""

    column: str
    plain: str  # in small letters, without topic and unit
    unit: str | None


def read_name(column: str) -> ColumnName:
    """Takes the unit off a name: `q1 [deg]`, `time (ms)`, `x_mm`."""
    split = kr5.io.split_unit(column)
    known = kr5.io.find_unit(split.unit) if split.unit else None
    unit = known.name if known else split.unit or None
    return ColumnName(column, split.name.rsplit(":", 1)[-1].strip().lower(), unit)


def unit_of(
    role: Role, columns: Sequence[ColumnName], values: np.ndarray, units: Units, file: Path
) -> tuple[float | np.ndarray, str, list[str]]:
    """Factor to SI, the unit, and notes where it was not stated. Numbers that are too large in a stated unit are
    refused; without one they are read in the other that is usual."""
    if role.each:
        return _unit_of_each(role, columns, values, units, file)
    stated, named = units.stated(role), dict.fromkeys(c.unit for c in columns if c.unit is not None)
    shown = range_of([c.column for c in columns])
    if stated is not None:
        unit, how = stated, "stated"
    elif len(named) > 1:
        raise kr5.IoError(f"{file}: {shown}: found the units {', '.join(named)}, expected one for all of them")
    elif named:
        unit, how = next(iter(named)), "named"
    else:
        unit, how = role.usual_unit, "usual"
    factor = factor_of(role, unit, f"{file}: {shown}")
    kind, largest = role.quantities[0], role.largest or LARGEST.get(role.quantities[0], np.inf)
    size = float(np.nanmax(np.abs(values), initial=0.0))
    other = OTHER_UNIT.get(kind)
    if factor * size <= largest:
        return factor, unit, []
    if how == "usual" and other and UNITS[kind][other] * size <= largest * (1 if kind == "length" else 100):
        return UNITS[kind][other], other, [f"{shown} is read in {other}: {size:.4g} is too large for {unit}"]
    remedy = f" ({role.unit_option or UNIT_OPTIONS[kind]} {other})" if other else ""
    asked = f"; are they in {FULL.get(other, other)}?{remedy}" if other and unit != other else ""
    raise kr5.IoError(f"{file}: {shown}: {PLURAL.get(kind, kind)} of up to {size:.4g} {unit}{asked}")


def _unit_of_each(
    role: Role, columns: Sequence[ColumnName], values: np.ndarray, units: Units, file: Path
) -> tuple[np.ndarray, str, list[str]]:
    """The same, where columns are of several quantities."""
    factors, names, notes = np.ones(len(role.each)), dict[str, None](), list[str]()
    for kind in dict.fromkeys(role.each):
        own = [k for k, each in enumerate(role.each) if each == kind]
        factor, unit, said = unit_of(role.of_kind(kind), [columns[k] for k in own], values[:, own], units, file)
        factors[own] = factor
        names[unit] = None
        notes += said
    return factors, ", ".join(names), notes


def factor_of(role: Role, unit: str, where: str) -> float:
    """Factor to SI of a unit of one of the role's quantities."""
    for quantity in role.quantities:
        if unit in UNITS[quantity]:
            return UNITS[quantity][unit]
    known = [u for q in role.quantities for u in UNITS[q]]
    raise kr5.IoError(f"{where}: found the unit '{unit}', expected one of {', '.join(known)}")


def range_of(columns: Sequence[str]) -> str:
    """The first and the last of the columns."""
    return columns[0] if len(columns) == 1 else f"{columns[0]} to {columns[-1]}"
