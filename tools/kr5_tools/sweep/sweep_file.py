"""The folder of a sweep: sweep.json says what is swept, trials.csv has a line for every finished trial (format
kr5-sweep/1)."""

import csv
import hashlib
import io
import tempfile
from dataclasses import asdict, astuple, fields
from pathlib import Path
from typing import Any

import kr5
import kr5.cell
from kr5.files.documents import check_readable

from kr5_tools.sweep.run_folder import Kind, RunFolder
from kr5_tools.sweep.trials import HEADER, Grid, Key, Trial, check_trial

SWEEP = Kind(
    what="sweep",
    format="kr5-sweep/1",
    description="sweep.json",
    data="trials.csv",
    options={
        "tilts": "--tilts",
        "clearances": "--clearances",
        "orientations": "--orientation",
        "strategies": "--strategy",
        "insert_by": "--insert-by",
        "seed": "--seed",
        "cell_sha256": "--cell",
        "version": "kr5",
    },
)


def cell_text(cell: kr5.cell.Cell) -> str:
    """The cell as one text, which every form of it gives alike."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "cell.yaml"
        kr5.cell.save_cell(cell, file)
        return file.read_text(encoding="utf-8")


def read_trials(file: Path, grid: Grid) -> list[Trial]:
    """The finished trials of a sweep, in the order of their keys; the folder is left as it is."""
    check_readable(file, "the trials of the sweep beside its sweep.json")
    try:
        data = file.read_bytes()
    except OSError as error:
        raise kr5.FileError(
            file, f"cannot be read: {error.strerror}; expected the trials of the sweep beside its sweep.json"
        ) from error
    whole = data.rfind(b"\n") + 1
    trials = parse_trials(data[:whole], file, grid) if whole else {}
    if not trials:
        raise kr5.FileError(file, "has no finished trial", remedy="run the sweep first: kr5 sweep insertion")
    return [trials[key] for key in sorted(trials)]


def parse_trials(data: bytes, file: Path, grid: Grid) -> dict[Key, Trial]:
    """The trials of whole lines, the first of which names the columns."""
    try:
        lines = list(csv.reader(data.decode("utf-8").split("\n")[:-1]))
    except (UnicodeDecodeError, csv.Error) as error:
        raise kr5.FileError(file, f"is not a table of trials ({error})", remedy="choose another folder (-o)") from error
    if tuple("max_force" if name == "greatest_force" else name for name in lines[0]) != HEADER:  # as it was called
        raise kr5.FileError(
            file, f"found other columns than {','.join(HEADER)}", line=1, remedy="choose another folder (-o)"
        )
    found = (_parse_trial(line, file, number, grid) for number, line in enumerate(lines[1:], 2))
    return {trial.key: trial for trial in found}


def _parse_trial(line: list[str], file: Path, number: int, grid: Grid) -> Trial:
    try:
        types: list[Any] = [f.type for f in fields(Trial)]
        values: list[Any] = [kind(value) for kind, value in zip(types, line, strict=True)]
        trial = Trial(*values)
        check_trial(trial, grid)
        return trial
    except (ValueError, OverflowError) as error:
        raise kr5.FileError(
            file, f"is not a trial ({error})", line=number, remedy="delete this line to run the trial again"
        ) from error


class SweepFolder(RunFolder):
    """Trials that are finished, and a place for more."""

    def __init__(self, path: Path, grid: Grid, cell: str):
        self.trials: dict[Key, Trial] = {}
        self.grid = grid
        described = {**asdict(grid), "cell_sha256": hashlib.sha256(cell.encode()).hexdigest(), "cell": cell}
        super().__init__(path, SWEEP, described)

    def _read(self) -> None:
        """What is finished. A last line without its end was being written when the sweep was killed: it is cut off."""
        self.file.seek(0)
        data = self.file.read()
        whole = data.rfind(b"\n") + 1
        if whole < len(data):
            self.note = (
                f"{self.path / 'trials.csv'}: the last line was truncated when the sweep was"
                " killed; that trial is run again"
            )
            self.file.truncate(whole)
        if not whole:
            self._append_rows([HEADER])
            return
        self.trials = parse_trials(data[:whole], self.path / "trials.csv", self.grid)

    def add(self, trials: list[Trial]) -> None:
        """Keeps finished trials, come what may."""
        self._append_rows([astuple(trial) for trial in trials])
        self.trials |= {trial.key: trial for trial in trials}

    def _append_rows(self, rows: list[tuple[object, ...]]) -> None:
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows(rows)
        self._append(text.getvalue().encode())

    def missing(self, keys: list[Key]) -> list[Key]:
        return [key for key in keys if key not in self.trials]
