"""The folder of a sweep: sweep.json says what is swept, trials.csv has a line for every finished trial (format
kr5-sweep/1)."""

import csv
import fcntl
import hashlib
import io
import json
import os
import tempfile
from dataclasses import asdict, astuple, fields
from pathlib import Path
from typing import Any

from kr5_tools.cli import terminal
from kr5_tools.files import results, writing
from kr5_tools.sweep.trials import HEADER, Grid, Key, Trial, check_trial

FORMAT = "kr5-sweep/1"
OPTIONS = {
    "tilts": "--tilts",
    "clearances": "--clearances",
    "orientations": "--orientation",
    "strategies": "--strategy",
    "insert_by": "--insert-by",
    "seed": "--seed",
    "cell_sha256": "--cell",
    "version": "kr5",
}


def cell_text(cell: Any) -> str:
    """The cell as one text, which every form of it gives alike."""
    import kr5.cell

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "cell.yaml"
        kr5.cell.save_cell(cell, file)
        return file.read_text(encoding="utf-8")


class SweepFolder:
    """Trials that are finished, and a place for more. One process at a time; a line is on the disk before `add`
    returns."""

    def __init__(self, path: Path, grid: Grid, cell: str):
        self.path, self.note = path, ""
        self.trials: dict[Key, Trial] = {}
        self.grid, described = grid, self._describe(grid, cell)
        self._check_folder()
        path.mkdir(parents=True, exist_ok=True)
        self.file = open(path / "trials.csv", "a+b")  # noqa: SIM115, it is open as long as the sweep
        try:
            self._lock()  # before anything is changed, and before another sweep's description is read
            if (path / "sweep.json").exists():
                self._compare(described)
            else:
                results.write_result(path / "sweep.json", FORMAT, **described)
                writing.publish()  # the trials that are added belong to it
            self._read()
        except BaseException:
            self.file.close()
            raise

    def _check_folder(self) -> None:
        """Complains of a folder that is not that of a sweep; one that was killed as it began may have left its
        first files.
        """
        path = self.path
        if (path / "sweep.json").is_file() or not path.is_dir():
            return
        begun = (
            f.name.startswith(".kr5-") or (f.name == "trials.csv" and not f.stat().st_size) for f in path.iterdir()
        )
        if not all(begun):
            terminal.fail(
                f"{path}: is a folder with other files and without sweep.json; expected a new"
                " folder, or that of a sweep to continue"
            )

    def __enter__(self) -> "SweepFolder":
        return self

    def __exit__(self, *error: object) -> None:
        self.file.close()

    @staticmethod
    def _describe(grid: Grid, cell: str) -> dict[str, Any]:
        return {**asdict(grid), "cell_sha256": hashlib.sha256(cell.encode()).hexdigest(), "cell": cell}

    def _compare(self, wanted: dict[str, Any]) -> None:
        import kr5

        file = self.path / "sweep.json"
        found = results.read_result(file, FORMAT)
        for name, option in OPTIONS.items():
            now = writing.to_plain({**wanted, "version": kr5.__version__}[name])
            if found.get(name) != now:
                terminal.fail(
                    f"{file}: {name}: found {json.dumps(found.get(name))}, now it is {json.dumps(now)}; a sweep"
                    f" continues with its original settings: the same {option}, or another folder (-o)"
                )

    def _lock(self) -> None:
        try:
            fcntl.flock(self.file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            terminal.fail(
                f"{self.path}: another sweep is using this folder; wait for its end, or choose another folder (-o)"
            )

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
            self._append([HEADER])
            return
        try:
            lines = list(csv.reader(data[:whole].decode("utf-8").split("\n")[:-1]))
        except (UnicodeDecodeError, csv.Error) as error:
            terminal.fail(f"{self.path / 'trials.csv'}: is not a table of trials ({error}); choose another folder (-o)")
        if tuple(lines[0]) != HEADER:
            terminal.fail(
                f"{self.path / 'trials.csv'}:1: found other columns than {','.join(HEADER)}; choose another folder (-o)"
            )
        for number, line in enumerate(lines[1:], 2):
            trial = self._parse(line, number)
            self.trials[trial.key] = trial

    def _parse(self, line: list[str], number: int) -> Trial:
        try:
            types: list[Any] = [f.type for f in fields(Trial)]
            values: list[Any] = [kind(value) for kind, value in zip(types, line, strict=True)]
            trial = Trial(*values)
            check_trial(trial, self.grid)
            return trial
        except (ValueError, OverflowError) as error:
            terminal.fail(
                f"{self.path / 'trials.csv'}:{number}: is not a trial ({error}); delete"
                " this line to run the trial again"
            )

    def add(self, trials: list[Trial]) -> None:
        """Keeps finished trials, come what may."""
        self._append([astuple(trial) for trial in trials])
        self.trials |= {trial.key: trial for trial in trials}

    def _append(self, rows: list[tuple[Any, ...]]) -> None:
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows(rows)
        self.file.write(text.getvalue().encode())
        self.file.flush()
        os.fsync(self.file.fileno())

    def missing(self, keys: list[Key]) -> list[Key]:
        return [key for key in keys if key not in self.trials]
