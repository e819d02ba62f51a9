"""Logs as they come: CSV, NPZ, MCAP files and ROS bags, read into columns of numbers by name."""

import csv
import re
from collections import Counter
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

import kr5
from kr5.files.documents import read_text
from kr5.logs.bag_file import is_bag_folder, read_bag
from kr5.logs.entry_words import IN_MAP, EntryWords
from kr5.logs.log import Log, TextCell
from kr5.logs.npz_file import read_npz

MAX_BYTES = 1 << 30  # of a text
DATE = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d")
MISSING = {"", "nan", "n/a", "na", "null", "none"}
ENDINGS = ("csv", "txt", "tsv", "dat", "log", "npz", "mcap", "db3", "bag")


def read_log(file: Path, header: list[str] | None = None, words: EntryWords = IN_MAP) -> Log:
    """Reads a log. `header` names the columns of a text file that has none; `words`: how errors say where to give
    it."""
    if is_bag_folder(file):
        return read_bag(file)
    if not file.is_file():
        raise kr5.FileError(file, f"no such file; expected a log ({', '.join('.' + e for e in ENDINGS)})")
    ending = file.suffix.lower().lstrip(".")
    if ending not in ENDINGS:
        raise kr5.FileError(
            file, f"found the ending '.{ending}', expected one of {', '.join('.' + e for e in ENDINGS)}"
        )
    if ending == "npz":
        return read_npz(file)
    if ending in ("db3", "bag"):
        return read_bag(file)
    if ending == "mcap":
        from kr5.logs.mcap_file import read_mcap

        return read_mcap(file)
    return _read_text(file, header, words)


def _read_text(file: Path, header: list[str] | None, words: EntryWords) -> Log:
    text = read_text(file, "a table of numbers under a line of names", MAX_BYTES)
    lines = [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and not _is_comment(line)]
    if not lines:
        raise kr5.FileError(file, "is empty; expected a line of column names and rows of numbers")
    delimiter = next((d for d in (";", "\t", ",") if d in lines[0][1]), None)
    split = (lambda s: next(csv.reader([s], delimiter=delimiter))) if delimiter else str.split
    try:
        rows = [(i, [c.strip() for c in split(line)]) for i, line in lines]
    except csv.Error as error:
        raise kr5.FileError(
            file, f"is not a table ({error}); expected a line of column names and rows of numbers"
        ) from error
    names = header or rows.pop(0)[1]
    if not header and all(_is_number(c) for c in names):
        raise kr5.FileError(
            file,
            f"line {lines[0][0]}: found only numbers, expected the names of the columns; specify them:"
            f" {_header_words(words, ', '.join(f'column{i + 1}' for i in range(len(names))))}",
        )
    own = [r for _, r in rows if r == names]
    rows = [(i, r) for i, r in rows if r != names]
    if names and not names[-1]:  # a delimiter at the end of every line
        names, rows = names[:-1], [(i, r[:-1] if len(r) == len(names) and not r[-1] else r) for i, r in rows]
    if not rows:
        raise kr5.FileError(file, "has a line of names and no row of numbers")
    _check_shape(file, names, rows, words)
    log = Log(file, lines=np.array([i for i, _ in rows]))
    if own:
        log.notes.append(f"{file.name}: {_skipped(len(own), 'repeated header')}")
    for k, name in enumerate(names):
        _add_text_column(log, name, [r[k] for _, r in rows], delimiter)
    log.join_stamps()
    if dropped := log.drop_repeated_rows():
        log.notes.append(f"{file.name}: {_skipped(dropped, 'duplicate line')}")
    return log


def _skipped(count: int, what: str) -> str:
    return f"1 {what} was skipped" if count == 1 else f"{count} {what}s were skipped"


def _header_words(words: EntryWords, names: str) -> str:
    return f"--set 'header=[{names}]'" if words.by_option else f"header: [{names}] in the map"


def _is_comment(line: str) -> bool:
    """The header of `rostopic echo -p`, which begins with %time, is none."""
    start = line.lstrip()
    return start[0] in "#%" and not start.startswith("%time")


def _check_shape(file: Path, names: list[str], rows: list[tuple[int, list[str]]], words: EntryWords) -> None:
    twice = {n for n, count in Counter(names).items() if count > 1}
    if twice or "" in names:
        found = f"the name '{sorted(twice)[0]}' twice" if twice else "a column without a name"
        raise kr5.FileError(
            file,
            f"line of names: found {found}, expected a unique name for each column; specify them"
            f" ({_header_words(words, '...')}) and delete that line",
        )
    bad = [(i, len(r)) for i, r in rows if len(r) != len(names)]
    if bad:
        number, count = bad[0]
        more = f", and {len(bad) - 1} more such lines" if len(bad) > 1 else ""
        remedy = (
            "was the log truncated while it was written? Delete that line"
            if number == rows[-1][0]
            else "correct or delete the line"
        )
        raise kr5.FileError(
            file, f"line {number}: found {count} values, expected {len(names)}, one a column{more}; {remedy}"
        )


def _seconds_of_dates(texts: list[str]) -> np.ndarray | None:
    """Seconds since 1970 of dates with times (ISO 8601; UTC where no zone is stated), NaN for missing ones; None if any
    cell is something else."""
    if not _are_dates(texts):
        return None
    try:
        return np.array([np.nan if _is_missing(text) else _read_date(text).timestamp() for text in texts])
    except ValueError:
        return None


def _are_dates(texts: list[str]) -> bool:
    return bool(DATE.match(next((text for text in texts if not _is_missing(text)), "")))


def _read_date(text: str) -> datetime:
    date = datetime.fromisoformat(text.removesuffix("UTC").rstrip())
    return date if date.tzinfo else date.replace(tzinfo=UTC)


def _is_missing(text: str) -> bool:
    return text.lower() in MISSING


def _is_readable(read: Callable[[str], Any], text: str) -> bool:
    try:
        read(text)
    except ValueError:
        return False
    return True


def _is_number(text: str) -> bool:
    return _is_readable(float, text)


def _add_text_column(log: Log, name: str, texts: list[str], delimiter: str | None) -> None:
    """Missing cells become NaN. Decimal commas are understood where columns are not parted by commas."""
    if (seconds := _seconds_of_dates(texts)) is not None:
        log.add(name, seconds, "")
        return
    cells = ["nan" if _is_missing(text) else text for text in texts]
    if delimiter != "," and any("," in c for c in cells):
        cells = [c.replace(",", ".") for c in cells]
    try:
        log.add(name, np.array(cells, float), "")
    except ValueError:
        read, expected = (_read_date, "a date with a time") if _are_dates(texts) else (float, "a number")
        at = next(i for i, cell in enumerate(cells) if cell != "nan" and not _is_readable(read, cell))
        log.text_columns[name] = TextCell(0 if log.lines is None else int(log.lines[at]), texts[at], expected)
