"""Lists of numbers given as one option."""

import math

import kr5

MOST_VALUES = 1000  # of one axis; more is a step that was mistyped


def parse_values(option: str, text: str) -> tuple[float, ...]:
    """The numbers of FROM:TO:STEP, both ends with it, or of a list."""
    expected = "numbers as 5,15,25 or FROM:TO:STEP as 5:25:5"
    try:
        if ":" in text:
            first, last, step = (float(part) for part in text.split(":"))
            if not step > 0 or not first <= last < math.inf:
                expected = "FROM:TO:STEP with FROM up to TO and a STEP above 0, as 5:25:5"
                raise ValueError
            count = math.floor((last - first) / step + 1e-9) + 1
            found = [float(f"{first + k * step:.9g}") for k in range(min(count, MOST_VALUES + 1))]
        else:
            found = [float(part) for part in text.split(",")]
    except (ValueError, OverflowError):
        raise kr5.InvalidArgument(f"{option}: found {text!r}, expected {expected}") from None
    if not all(0 < x < math.inf for x in found):
        raise kr5.InvalidArgument(f"{option}: found {text!r}, expected numbers above 0")
    if len(found) > MOST_VALUES:
        raise kr5.InvalidArgument(f"{option}: found {text!r}, more than {MOST_VALUES} values; expected {expected}")
    return tuple(sorted(set(found)))
