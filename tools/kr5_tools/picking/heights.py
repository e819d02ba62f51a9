"""Heights of cylinders, as an option states them."""

import kr5
import numpy as np


def height_range(text: str) -> tuple[float, float]:
    """The range that an option states: LOW:HIGH, or one number [m]."""
    parts = text.split(":")
    try:
        values = [float(p) for p in parts]
    except ValueError:
        values = []
    if len(values) not in (1, 2) or not all(0 < v < np.inf for v in values) or values[0] > values[-1]:
        raise kr5.InvalidArgument(
            f"--height: found {text!r:.60}, expected LOW:HIGH or one number in metres, such as 0.014:0.017"
        )
    return values[0], values[-1]
