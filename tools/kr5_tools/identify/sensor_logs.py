"""Logs that the identifications of servo, contact and force sensor read: experiments of a recording, or a log."""

from pathlib import Path
from typing import Any

import kr5
import kr5.cell
import numpy as np
from kr5 import cell
from kr5.logs.log_file import is_log_folder

MOST_DRAWN = 1500  # samples in a result file, for its plots


def is_recording(source: Path) -> bool:
    return source.is_dir() and not is_log_folder(source)


def believed_cell(recording: kr5.cell.Recording | None, cell_file: Path | None) -> Any:
    """The cell that is named, else that of the recording, else None."""
    if cell_file:
        return cell.load_cell(cell_file)
    return recording.cell if recording is not None else None


def need_target_cell(believed: kr5.cell.Cell, write_cell: Path | None) -> None:
    if write_cell and believed is None:
        raise kr5.InvalidArgument("--write-cell: --cell is missing; name the cell into which the result is put")


def experiments_of(recording: kr5.cell.Recording, kind: str) -> list[Any]:
    """The experiments of a kind that may be used to estimate."""
    found = [e for e in recording.experiments if str(e.kind) == kind and str(e.split) == "fit"]
    if not found:
        kinds = ", ".join(dict.fromkeys(str(e.kind) for e in recording.experiments))
        raise kr5.FileError(
            recording.folder, f"has no experiment of the kind {kind} with split fit; found the kinds {kinds}"
        )
    return found


def joined_runs(experiments: list[kr5.cell.Experiment], names: list[str]) -> tuple[np.ndarray, list[int]]:
    """Columns of experiments below each other (N x names), and the first row of each run."""
    parts, starts, rows = [], [], 0
    for experiment in experiments:
        columns = [np.asarray(experiment[name]) for name in names]
        part = np.column_stack(columns)
        runs = np.asarray(experiment["run"]) if "run" in experiment.data.columns else np.zeros(len(part))
        starts += [rows + int(i) for i in run_starts(runs)]
        parts.append(part)
        rows += len(part)
    return np.vstack(parts), starts


def run_starts(runs: np.ndarray) -> list[int]:
    return [0, *(np.flatnonzero(np.diff(runs)) + 1)]


def thinned(rows: int) -> np.ndarray:
    """Rows that are kept for plots."""
    return np.arange(0, rows, max(1, -(-rows // MOST_DRAWN)))


def verdict_of(text: str, warnings: list[str]) -> dict[str, str]:
    return {"word": "doubtful" if warnings else "good", "text": "; ".join([text, *warnings])}
