"""Responses of servos in recordings."""

from typing import Any

import kr5.cell
import kr5.identification
import numpy as np
from kr5 import identification

from kr5_tools.identify.sensor_logs import (
    experiments_of,
    joined_runs,
)

PATH = "path correction"


def recorded_logs(
    recording: kr5.cell.Recording, joint: list[int] | None, options: kr5.identification.ServoOptions
) -> dict[str, Any]:
    """The responses of a recording by name; joints follow smooth commands."""
    if not joint:
        values, starts = joined_runs(experiments_of(recording, "step"), ["t", "zc", "z"])
        return {PATH: _log(values, starts)}
    options.command = "smooth"
    out = {}
    for number in joint:
        values, starts = joined_runs(experiments_of(recording, "motion"), ["t", f"qc{number}", f"q{number}"])
        out[f"joint {number}"] = _log(values, starts)
    return out


def _log(values: np.ndarray, starts: list[int]) -> Any:
    return identification.ServoLog(t=values[:, 0], command=values[:, 1], response=values[:, 2], run_starts=starts)
