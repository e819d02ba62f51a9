"""Columns and numbers that must be there."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

import kr5
from kr5.logs.log import Log

MOST_SHOWN = 16  # columns


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


def missing_columns(
    file: Path, columns: Sequence[str], named: bool, lacking: Sequence[str], what: str, option: str, example: str
) -> str:
    """The one sentence about columns that are not there. what: the quantity in words; option: of the command, that
    names the columns; example: a list of columns that the command could take."""
    if not named:
        return (
            f"{file}: found {len(columns)} columns without names; missing: {', '.join(lacking)}; name the columns in"
            f" their order: --columns {example}"
        )
    shown = ", ".join(columns[:MOST_SHOWN])
    more = f" and {len(columns) - MOST_SHOWN} more" if len(columns) > MOST_SHOWN else ""
    options = " and ".join(dict.fromkeys(o for o in (option, "--columns") if o))
    return (
        f"{file}: found the columns {shown}{more}; missing: {', '.join(lacking)} ({what}{'; ' if what else ''}see"
        f" {options})"
    )
