"""What a job measured, as a log of the arm, which `kr5 gap diagnose` reads as any other."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from kr5.logs.row_log import row_log

if TYPE_CHECKING:
    import kr5.io

TOPIC = "job"


def write_job_log(rows: "kr5.io.Table", file: Path) -> None:
    """Time since the first row [s], positions [rad or m] and currents [A] of the joints, a row a cycle."""
    found = [name for name in rows.columns if name[0] in "qi" and name[1:].isdigit()]
    measured = [name for name in found if np.isfinite(rows[name]).any()]
    time = np.asarray(rows["time"])
    with row_log(file, ["t", *measured], TOPIC) as put:
        put(np.column_stack([time - time[:1], *(rows[name] for name in measured)]))
