"""Units a log may have, as factors to SI. Which there are says the library (`kr5/io/column_unit.hpp`)."""

import kr5
import kr5.io

UNITS: dict[str, dict[str, float]] = {}  # by quantity, that of SI first
for _unit in kr5.io.column_units():
    UNITS.setdefault(_unit.quantity, {})[_unit.name] = _unit.factor


MIDDLE_TICK = 2048  # of an encoder with 4096 counts a turn, taken for the zero of its joint
OF_RANGE = ("percent", "signed_percent")  # of the range of a joint from its lower end, of half of it from its middle


def unit_factor(unit: str, quantities: tuple[str, ...], where: str) -> tuple[float, str]:
    """Factor to SI of a unit, and which of the quantities it is of."""
    for quantity in quantities:
        if unit in UNITS[quantity]:
            return UNITS[quantity][unit], quantity
    known = [u for q in quantities for u in UNITS[q]]
    raise kr5.IoError(f"{where}: unit: found '{unit}', expected one of {', '.join(known)}")
