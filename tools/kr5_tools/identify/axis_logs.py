"""Logs that the identifications of servo, contact and force sensor read: experiments of a recording, or a CSV."""

from pathlib import Path
from typing import Any

import kr5
import numpy as np
from kr5 import cell, io

from kr5_tools.calibrate.postures import LENGTHS, values_of

MOST_DRAWN = 1500  # samples in a result file, for its plots


def is_recording(source: Path) -> bool:
    return source.is_dir()


def believed_cell(recording: Any, cell_file: Path | None) -> Any:
    """The cell that is named, else that of the recording, else None."""
    if cell_file:
        return cell.load_cell(cell_file)
    return recording.cell if recording is not None else None


def need_target_cell(believed: Any, write_cell: Path | None) -> None:
    if write_cell and believed is None:
        raise kr5.InvalidArgument("--write-cell: --cell is missing; name the cell into which the result is put")


def experiments_of(recording: Any, kind: str) -> list[Any]:
    """The experiments of a kind that may be used to estimate."""
    found = [e for e in recording.experiments if str(e.kind) == kind and str(e.split) == "fit"]
    if not found:
        kinds = ", ".join(dict.fromkeys(str(e.kind) for e in recording.experiments))
        raise kr5.FileError(
            recording.folder, f"has no experiment of the kind {kind} with split fit; found the kinds {kinds}"
        )
    return found


def joined_runs(experiments: list[Any], names: list[str]) -> tuple[np.ndarray, list[int]]:
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


def read_columns(
    file: Path, columns: str | None, usual: tuple[str, ...], optional: tuple[str, ...] = ()
) -> tuple[dict[str, np.ndarray], list[int]]:
    """Columns of a CSV by their usual names, those of `optional` where they are there, and the first row of each run,
    which a column `run` tells."""
    table = io.load_csv(file)
    if not len(table.values):
        raise kr5.FileError(file, "has no row of numbers")
    there = list(table.columns)
    if columns:
        named = [name.strip() for name in columns.split(",")]
        if not len(usual) <= len(named) <= len(usual) + len(optional):
            wanted = ",".join(usual) + "".join(f"[,{name}]" for name in optional)
            raise kr5.InvalidArgument(f"--columns: found {len(named)} names, expected {wanted}")
        roles = dict(zip((*usual, *optional), named))
    else:
        roles = {name: name for name in (*usual, *(name for name in optional if name in there))}
    out = {}
    for role, name in roles.items():
        sign = -1.0 if name.startswith("-") else 1.0
        out[role] = sign * values_of_column(file, table, name.lstrip("-"))
    runs = values_of_column(file, table, "run") if "run" in there else np.zeros(len(table.values))
    return out, run_starts(runs)


def values_of_column(file: Path, table: Any, name: str) -> np.ndarray:
    if name not in table.columns:
        raise kr5.FileError(file, f"found the columns {', '.join(table.columns)}; missing: {name} (see --columns)")
    return np.asarray(values_of(file, table, [name]))[:, 0]


def check_metres(name: str, values: np.ndarray, unit: str, where: Path) -> np.ndarray:
    """Positions in metres; refuses those that no arm reaches."""
    out = np.asarray(values, float) * LENGTHS[unit]
    if (most := float(np.abs(out).max(initial=0.0))) > 20.0:
        raise kr5.IoError(f"{where}: {name}: positions of up to {most:.0f} m; are they in millimetres? (--length mm)")
    return out


def thinned(rows: int) -> np.ndarray:
    """Rows that are kept for plots."""
    return np.arange(0, rows, max(1, -(-rows // MOST_DRAWN)))


def verdict_of(text: str, warnings: list[str]) -> dict[str, str]:
    return {"word": "doubtful" if warnings else "good", "text": "; ".join([text, *warnings])}
