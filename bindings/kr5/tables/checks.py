"""Numbers that must be there."""

from collections.abc import Sequence

import numpy as np

import kr5
from kr5.logs.log import Log


def check_finite(log: Log, names: Sequence[str], values: np.ndarray, may_lack: bool = False) -> None:
    """Refuses rows without a number, rows x names; where they may lack, only those that are infinite."""
    bad = np.isinf(values) if may_lack else ~np.isfinite(values)
    if not bad.any():
        return
    row, k = (int(v) for v in np.argwhere(bad)[0])
    count = int(bad.any(axis=1).sum())
    more = f" ({count} such rows)" if count > 1 else ""
    found = "no number" if np.isnan(values[row, k]) else f"'{values[row, k]}'"
    raise kr5.IoError(
        f"{log.file}: {log.row(row)}, column '{names[k]}': found {found}{more}, expected a finite number; correct or"
        " delete the row"
    )
