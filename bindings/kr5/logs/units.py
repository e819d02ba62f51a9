"""Units a log may have, as factors to SI."""

import math

import kr5

UNITS: dict[str, dict[str, float]] = {
    "angle": {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180, "turn": 2 * math.pi, "tick": 2 * math.pi / 4096},
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    "current": {"A": 1.0, "mA": 1e-3},
    "force": {"N": 1.0, "kN": 1e3, "mN": 1e-3},
    "torque": {"N m": 1.0, "Nm": 1.0, "N mm": 1e-3, "Nmm": 1e-3, "mN m": 1e-3, "mNm": 1e-3, "kN m": 1e3},
    "turn rate": {"rad/s": 1.0, "deg/s": math.pi / 180, "rpm": math.pi / 30},
    "speed": {"m/s": 1.0, "mm/s": 1e-3},
    "pixel": {"px": 1.0},
    "none": {"-": 1.0},
}


MIDDLE_TICK = 2048  # of an encoder with 4096 counts a turn, taken for the zero of its joint
OF_RANGE = ("percent", "signed_percent")  # of the range of a joint from its lower end, of half of it from its middle


def unit_factor(unit: str, quantities: tuple[str, ...], where: str) -> tuple[float, str]:
    """Factor to SI of a unit, and which of the quantities it is of."""
    for quantity in quantities:
        if unit in UNITS[quantity]:
            return UNITS[quantity][unit], quantity
    known = [u for q in quantities for u in UNITS[q]]
    raise kr5.IoError(f"{where}: unit: found '{unit}', expected one of {', '.join(known)}")
