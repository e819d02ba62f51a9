"""Logs as they come: CSV, NPZ and MCAP files, read into columns of numbers by name."""

import csv
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from . import common

ENDINGS = ("csv", "txt", "tsv", "dat", "log", "npz", "mcap")


@dataclass
class Log:
    """Columns by name. Columns of one stream have a row at the same instants; `clocks` names a stream's own time column."""

    file: Path
    columns: dict[str, np.ndarray] = field(default_factory=dict)
    streams: dict[str, str] = field(default_factory=dict)
    clocks: dict[str, str] = field(default_factory=dict)
    lines: np.ndarray | None = None  # of a text file, the line of each row
    words: dict[str, tuple[int, str]] = field(default_factory=dict)  # columns that hold text: line, what stands there

    def add(self, name: str, values: Any, stream: str) -> None:
        self.columns[name] = np.asarray(values, float)
        self.streams[name] = stream

    def column(self, name: str, where: str) -> np.ndarray:
        if name in self.words:
            line, text = self.words[name]
            common.fail(f"{self.file}: line {line}, column '{name}': found '{text}', expected a number")
        if name not in self.columns:
            import difflib

            near = difflib.get_close_matches(name, list(self.columns), 1, 0.5)
            hint = f"; did you mean '{near[0]}'?" if near else ""
            names = list(self.columns)
            shown = ", ".join(names[:12]) + (f" and {len(names) - 12} more" if len(names) > 12 else "")
            common.fail(f"{where}: found '{name}', which {self.file} does not have{hint} It has: {shown}")
        return self.columns[name]

    def row(self, index: int) -> str:
        """Where a row stands, in words."""
        return f"line {self.lines[index]}" if self.lines is not None else f"row {index + 1}"


def read(file: Path, header: list[str] | None = None) -> Log:
    """Reads a log. `header` names the columns of a text file that has none."""
    if not file.is_file():
        common.fail(f"{file}: no such file; expected a log ({', '.join('.' + e for e in ENDINGS)})")
    ending = file.suffix.lower().lstrip(".")
    if ending not in ENDINGS:
        common.fail(f"{file}: found the ending '.{ending}', expected one of {', '.join('.' + e for e in ENDINGS)}")
    if ending == "npz":
        return _read_npz(file)
    if ending == "mcap":
        from .recording_mcap import read_mcap

        return read_mcap(file)
    return _read_text(file, header)


def _read_text(file: Path, header: list[str] | None) -> Log:
    try:
        text = file.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        common.fail(f"{file}: is no UTF-8 text (byte {error.start}); expected a table of numbers under a line of names")
    lines = [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and line.lstrip()[0] not in "#%"]
    if not lines:
        common.fail(f"{file}: is empty; expected a line of column names and rows of numbers")
    delimiter = next((d for d in (";", "\t", ",") if d in lines[0][1]), None)
    split = (lambda s: next(csv.reader([s], delimiter=delimiter))) if delimiter else str.split
    rows = [(i, [c.strip() for c in split(line)]) for i, line in lines]
    names = header or rows.pop(0)[1]
    if not header and all(_is_number(c) for c in names):
        common.fail(f"{file}: line {lines[0][0]}: found only numbers, expected the names of the columns; name them in the map: "
                    f"header: [{', '.join(f'column{i + 1}' for i in range(len(names)))}]")
    if names and not names[-1]:  # a delimiter at the end of every line
        names, rows = names[:-1], [(i, r[:-1] if len(r) == len(names) and not r[-1] else r) for i, r in rows]
    if not rows:
        common.fail(f"{file}: has a line of names and no row of numbers")
    _check_shape(file, names, rows)
    log = Log(file, lines=np.array([i for i, _ in rows]))
    for k, name in enumerate(names):
        _add_text_column(log, name, [r[k] for _, r in rows], delimiter)
    return log


def _check_shape(file: Path, names: list[str], rows: list[tuple[int, list[str]]]) -> None:
    twice = {n for n in names if names.count(n) > 1}
    if twice or "" in names:
        found = f"the name '{sorted(twice)[0]}' twice" if twice else "a column without a name"
        common.fail(f"{file}: line of names: found {found}, expected a name of its own for each column; give them in the map "
                    "(header: [...]) and delete that line")
    bad = [(i, len(r)) for i, r in rows if len(r) != len(names)]
    if bad:
        line, found = bad[0]
        more = f", and {len(bad) - 1} more such lines" if len(bad) > 1 else ""
        remedy = "was the log cut off while it was written? Delete that line" if line == rows[-1][0] else "mend or delete the line"
        common.fail(f"{file}: line {line}: found {found} values, expected {len(names)}, one a column{more}; {remedy}")


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _add_text_column(log: Log, name: str, texts: list[str], delimiter: str | None) -> None:
    """Empty cells become NaN. Decimal commas are understood where columns are not parted by commas."""
    cells = [t or "nan" for t in texts]
    if delimiter != "," and any("," in c for c in cells):
        cells = [c.replace(",", ".") for c in cells]
    try:
        log.add(name, np.array(cells, float), "")
    except ValueError:
        at = next(i for i, c in enumerate(cells) if not _is_number(c))
        log.words[name] = (int(log.lines[at]), texts[at])


def _read_npz(file: Path) -> Log:
    """Arrays by name; `q` of n x 6 becomes `q[0]` ... `q[5]`. Arrays of one length are one stream."""
    log = Log(file)
    try:
        with np.load(file, allow_pickle=False) as arrays:
            for name in arrays.files:
                values = arrays[name]
                if values.ndim == 0 or values.dtype.kind not in "fiub":
                    continue
                flat = values.reshape(len(values), -1)
                stream = f"{len(values)} rows"
                for k in range(flat.shape[1]):
                    log.add(name if values.ndim == 1 else f"{name}[{k}]", flat[:, k], stream)
    except (ValueError, OSError) as error:
        common.fail(f"{file}: cannot be read as NPZ: {error}; expected arrays of numbers saved with numpy.savez")
    if not log.columns:
        common.fail(f"{file}: holds no array of numbers")
    return log
