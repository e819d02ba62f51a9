"""Loads that stop at a limit: of the sensor, the driver or the logger."""

from dataclasses import dataclass

import numpy as np

SHARE = 0.01  # of the rows in which the joint moves
ROWS = 5
OTHERS = 5.0  # times as often as any value below the limit, which tells a limit from a coarse resolution
AT_REST = 0.01  # of the highest speed


@dataclass
class Saturation:
    limit: float  # in the unit of the column
    rows: int  # in which the column stands at it while the joint moves


def find_saturation(values: np.ndarray, speed: np.ndarray) -> Saturation | None:
    """Whether a column stands at its largest or smallest value again and again while its joint moves at `speed`."""
    moving = values[np.abs(speed) > AT_REST * np.abs(speed).max()]
    if not len(moving):
        return None
    levels, counts = np.unique(moving, return_counts=True)
    if len(levels) < 3:
        return None
    most = counts[1:-1].max()
    for limit, rows in ((levels[-1], counts[-1]), (levels[0], counts[0])):
        if rows >= ROWS and rows >= SHARE * len(moving) and rows >= OTHERS * most:
            return Saturation(float(limit), int(rows))
    return None
