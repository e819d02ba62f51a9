"""Numbers with units, as people read them: how many digits, and which unit."""

import math
from collections.abc import Iterable, Sequence
from typing import Union

NONE = "–"  # in place of a number that there is not
# Factor and unit that a table shows in place of one in SI.
TABLE_UNITS = {
    "m": (1e3, "mm"),
    "rad": (180 / math.pi, "deg"),
    "rad/(N m)": (1e6, "µrad/(N m)"),
    "m/N": (1e6, "µm/N"),
}
# The same in a sentence.
TEXT_UNITS = {
    "m": (1e3, "mm"),
    "rad": (180 / math.pi, "°"),
    "s": (1e3, "ms"),
    "kg m^2": (1e6, "kg mm²"),
    "-": (1.0, ""),
}


def table_unit(unit: str) -> tuple[float, str]:
    return TABLE_UNITS.get(unit, (1.0, unit))


def text_unit(unit: str, largest: float = 0.0) -> tuple[float, str]:
    """Of numbers up to `largest` in SI; long times stay in seconds."""
    if unit == "s" and largest >= 1:
        return 1.0, "s"
    return TEXT_UNITS.get(unit, (1.0, unit.replace("N.m", "N m").replace(".", " ").replace("^2", "²")))


def format_number(value: float | None, std: float | None = None) -> str:
    """A number with as many digits as its uncertainty allows (two digits of it), else four."""
    if value is None or not math.isfinite(value):
        return NONE
    if not std or not 0 < std < math.inf:
        return f"{value:.4g}"
    return f"{value:.{min(max(1 - math.floor(math.log10(std)), 0), 9)}f}"


Numbers = Union[float, Sequence["Numbers"]]  # noqa: UP007  nested lists of them


def format_values(value: Numbers) -> str:
    """A number or a nested list of numbers, each with five digits."""
    if isinstance(value, Sequence):
        return f"[{', '.join(format_values(v) for v in value)}]"
    return f"{value:.5g}"


def format_degrees(angle: float | None, digits: int = 1, sign: bool = False) -> str:
    """An angle in radians, in degrees."""
    return NONE if angle is None else f"{math.degrees(angle):{'+' if sign else ''}.{digits}f}"


def format_count(number: int, noun: str, verb: tuple[str, str] | None = None) -> str:
    """1 view, 2 views; with a verb, as in ("contradicts", "contradict"), the one that agrees."""
    text = f"{number} {noun}{'' if number == 1 else 's'}"
    return f"{text} {verb[number != 1]}" if verb else text


def root_mean_square(values: Iterable[float]) -> float:
    numbers = list(values)
    return math.sqrt(sum(v * v for v in numbers) / len(numbers)) if numbers else 0.0


def format_range(low: float, high: float) -> str:
    return f"{low:.3g} to {high:.3g}"


def format_percent(share: float, more: str = "more than", less: str = "less than") -> str:
    """A share that says neither 0 nor 100 %, which no measurement does; what is below 0 is less than 1 %."""
    if share >= 0.995:
        return f"{more} 99.9 %" if share > 0.9995 else f"{more} 99 %"
    return f"{less} 1 %" if share < 0.005 else f"{100 * share:.0f} %"
