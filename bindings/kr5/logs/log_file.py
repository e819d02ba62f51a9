"""Logs as they come: files and folders, read into columns of numbers by name."""

import csv
import itertools
import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

import kr5
from kr5.files.documents import read_text
from kr5.logs.bag_file import is_bag_folder, read_bag
from kr5.logs.column_list import fitted_names
from kr5.logs.entry_words import IN_MAP, EntryWords
from kr5.logs.hdf5_file import hdf5_episodes, is_hdf5_set, read_hdf5, read_hdf5_episode
from kr5.logs.json_log import read_json_log
from kr5.logs.lerobot_set import is_lerobot, lerobot_episodes, read_lerobot
from kr5.logs.log import Log, TextCell
from kr5.logs.mcap_file import read_mcap
from kr5.logs.npz_file import read_npz
from kr5.logs.parquet_file import read_parquet
from kr5.logs.sage_folder import is_sage_folder, read_sage
from kr5.logs.servo_gain import note_servo_gain
from kr5.logs.torch_file import read_torch

MOST_HEAD = 1000  # lines before the first numbers
MAX_BYTES = 1 << 30  # of a text
DATE = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d")
MISSING = {"", "nan", "n/a", "na", "null", "none"}
LIST = re.compile(r"\[[^\[\]]*\]|\([^()]*\)")  # of numbers, in a cell
NUMBER = r"[-+]?\d+(,\d+)?([eE][-+]?\d+)?"
BLANKS_AND_DECIMAL_COMMAS = re.compile(rf" *{NUMBER}( +{NUMBER})+ *")


@dataclass(frozen=True)
class FileFormat:
    """A log that is a file with one of these endings."""

    name: str
    endings: tuple[str, ...]
    read: Callable[[Path], Log]


@dataclass(frozen=True)
class FolderFormat:
    """A log that is a folder, known by the files `marks` in it."""

    name: str
    marks: str
    holds: Callable[[Path], bool]
    read: Callable[[Path], Log]


@dataclass(frozen=True)
class DataSetFormat:
    """A file, or a folder with the files `marks`, of several recordings of one robot: its episodes, by number."""

    name: str
    marks: str
    holds: Callable[[Path], bool]
    episodes: Callable[[Path], list[int]]
    read: Callable[[Path, int], Log]


# A line here is a format of every command: errors and help texts take their words from it.
FILES = (
    FileFormat("NPZ", ("npz",), read_npz),
    FileFormat("MCAP", ("mcap",), read_mcap),
    FileFormat("ROS bag", ("db3", "bag"), read_bag),
    FileFormat("Parquet", ("parquet",), read_parquet),
    FileFormat("HDF5", ("h5", "hdf5"), read_hdf5),
    FileFormat("PyTorch", ("pt", "pth"), read_torch),
    FileFormat("JSON", ("json",), read_json_log),
)
FOLDERS = (
    FolderFormat("ROS bag", "metadata.yaml", is_bag_folder, read_bag),
    FolderFormat(
        "SAGE",
        "control.csv, state_motor.csv",
        is_sage_folder,
        lambda folder: read_sage(folder, lambda file: _read_text(file, None, IN_MAP, False)),
    ),
)
DATA_SETS = (
    DataSetFormat("LeRobot", "meta/info.json", is_lerobot, lerobot_episodes, read_lerobot),
    DataSetFormat("HDF5", "", is_hdf5_set, hdf5_episodes, read_hdf5_episode),
)
TEXTS = ("csv", "txt", "tsv", "dat", "log")
READERS = {ending: format.read for format in FILES for ending in format.endings}
ENDINGS = (*TEXTS, *READERS)
TABLE_ENDINGS = tuple(ending for ending in ENDINGS if ending != "json")  # poses in JSON have readers of their own
LOG_FORMATS = ", ".join(dict.fromkeys(["CSV with any separator", *(f.name for f in (*FILES, *FOLDERS, *DATA_SETS))]))
FOLDER_WORDS = "a folder in one of the formats " + ", ".join(
    f"{format.name} ({format.marks})" for format in (*FOLDERS, *DATA_SETS) if format.marks
)


def is_log_folder(path: Path) -> bool:
    """Whether a folder is a log, and no recording of kr5."""
    return path.is_dir() and (any(f.holds(path) for f in FOLDERS) or any(d.holds(path) for d in DATA_SETS))


def episodes_of(path: Path) -> list[int]:
    """Numbers of the episodes of a data set; none of a log that is no data set."""
    found = next((d for d in DATA_SETS if d.holds(path)), None)
    return found.episodes(path) if found else []


def read_log(
    file: Path,
    header: Sequence[str] | None = None,
    words: EntryWords = IN_MAP,
    unnamed: bool = False,
    episode: int | None = None,
    keeps_off: bool = False,
) -> Log:
    """Reads a log. `header` names the columns, where the file has no names or others; `unnamed`: without, a text is
    read whose columns have no names, by their numbers; `words`: how errors say where to give them; `episode`: which
    recording of a data set, where it has several; `keeps_off`: also rows in which the motors are off, with a column of
    the gain of the servos, as an arm is simulated that its servos move."""
    log = _read_any(file, header, words, unnamed, episode)
    note_servo_gain(log, keeps_off)
    return log


def _read_any(file: Path, header: Sequence[str] | None, words: EntryWords, unnamed: bool, episode: int | None) -> Log:
    for data_set in DATA_SETS:
        if data_set.holds(file):
            number = _only_episode(file, data_set.episodes(file)) if episode is None else episode
            return _renamed(data_set.read(file, number), header)
    if episode is not None:
        raise kr5.FileError(file, f"has no episodes, found episode {episode} asked for; leave --episodes out")
    for folder in FOLDERS:
        if folder.holds(file):
            return _renamed(folder.read(file), header)
    if file.is_dir():
        raise kr5.FileError(file, f"found a folder that is no log; expected {FOLDER_WORDS}, or a file")
    if not file.is_file():
        raise kr5.FileError(file, f"no such file; expected a log ({', '.join('.' + e for e in ENDINGS)})")
    ending = file.suffix.lower().lstrip(".")
    if ending in READERS:
        return _renamed(READERS[ending](file), header)
    if ending not in TEXTS:
        raise kr5.FileError(
            file, f"found the ending '.{ending}', expected one of {', '.join('.' + e for e in ENDINGS)}"
        )
    return _read_text(file, header, words, unnamed)


def _only_episode(file: Path, numbers: list[int]) -> int:
    if len(numbers) == 1:
        return numbers[0]
    if not numbers:
        raise kr5.FileError(file, "has no episode; expected at least one")
    raise kr5.FileError(
        file, f"has {len(numbers)} episodes ({numbers[0]} to {numbers[-1]}); choose one with --episodes {numbers[0]}"
    )


def _renamed(log: Log, header: Sequence[str] | None) -> Log:
    """With other names for its columns, where these are not among its own."""
    if not header:
        return log
    old = list(log.columns)
    new = dict(zip(old, fitted_names(header, old, len(old), log.file), strict=True))
    log.renamed = old != list(new.values())
    log.columns = {new[name]: values for name, values in log.columns.items()}
    log.streams = {new[name]: stream for name, stream in log.streams.items()}
    log.arrays = {stem: [new[name] for name in columns] for stem, columns in log.arrays.items()}
    log.labels = {new[name]: label for name, label in log.labels.items()}
    log.clocks = {stream: new[name] for stream, name in log.clocks.items()}
    return log


def _read_text(file: Path, header: Sequence[str] | None, words: EntryWords, unnamed: bool) -> Log:
    text = read_text(file, "a table of numbers under a line of names", MAX_BYTES)
    lines = [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and not _is_comment(line)]
    if not lines:
        raise kr5.FileError(file, "is empty; expected a line of column names and rows of numbers")
    delimiter = _delimiter_of([line for _, line in lines[:2]])
    try:
        rows = [(i, cells) for (i, _), cells in zip(lines, _split([line for _, line in lines], delimiter), strict=True)]
    except csv.Error as error:
        raise kr5.FileError(
            file, f"is not a table ({error}); expected a line of column names and rows of numbers"
        ) from error
    log = Log(file, form=_form_words(delimiter))
    first = rows[0][1]
    width = len(first) - (delimiter is not None and len(first) > 1 and not first[-1])  # a delimiter at the end
    numbers = [_is_number(cell, delimiter) for cell in first[:width]]
    log.named = not (any(numbers) if header else all(numbers))
    own = rows.pop(0)[1] if log.named else _commented_names(_line_above(text, lines[0][0]), delimiter, width)
    if header:
        names = fitted_names(header, own, width, file)
        log.renamed, log.named = names != own, True
    elif own:
        names, log.named = own, True
    elif unnamed:
        names = [str(k + 1) for k in range(width)]
        log.form.append("no names of columns")
    else:
        raise kr5.FileError(
            file,
            f"line {lines[0][0]}: found only numbers, expected the names of its {width} columns; specify them in"
            f" their order: {_header_words(words)}",
        )
    repeated = [r for _, r in rows if r == own]
    rows = [(i, r) for i, r in rows if r != own]
    if len(names) > 1 and not names[-1]:
        names = names[:-1]
    rows = [(i, r[:-1] if len(r) == len(names) + 1 and not r[-1] else r) for i, r in rows]
    if not rows:
        raise kr5.FileError(file, "has a line of names and no row of numbers")
    _check_shape(file, names, rows, words)
    log.order, log.lines = names, np.array([i for i, _ in rows])
    if repeated:
        log.notes.append(f"{file.name}: {_skipped(len(repeated), 'repeated header')}")
    for k, name in enumerate(names):
        _add_text_column(log, name, [r[k] for _, r in rows], delimiter)
    log.join_stamps()
    if dropped := log.drop_repeated_rows():
        log.notes.append(f"{file.name}: {_skipped(dropped, 'duplicate line')}")
    return log


@dataclass(frozen=True)
class TextForm:
    """How a text of numbers is written, by its first lines."""

    delimiter: str | None  # None: blanks
    names: list[str]  # in small letters; none where the first line has numbers
    rows_before: int  # lines before the numbers
    decimal_commas: bool


def read_text_form(file: Path) -> TextForm:
    """The form of a text whose rows are read by others, since they are many."""
    first: list[str] = []
    before, above = 0, ""
    with file.open(encoding="utf-8-sig") as stream:
        for line in itertools.islice(stream, MOST_HEAD):
            if line.strip() and not _is_comment(line):
                first.append(line.rstrip("\n"))
            elif not first:
                before, above = before + 1, line.strip() or above
            if len(first) == 2:
                break
    if not first:
        raise kr5.FileError(file, "is empty; expected a line of column names and rows of numbers")
    delimiter = _delimiter_of(first)
    cells = _split(first, delimiter)
    named = not any(_is_number(c, delimiter) for c in cells[0])
    names = cells[0] if named else _commented_names(above, delimiter, len(cells[0]))
    commas = delimiter != "," and "," in first[-1]
    return TextForm(delimiter, [c.lower() for c in names], before + named, commas)


def _delimiter_of(lines: list[str]) -> str | None:
    """What stands between the columns; None: blanks. Of numbers with decimal commas between blanks a comma is none."""
    if BLANKS_AND_DECIMAL_COMMAS.fullmatch(lines[-1]):
        return None
    return next((d for d in (";", "\t", "|", ",") if d in lines[0]), None)


def _split(lines: list[str], delimiter: str | None) -> list[list[str]]:
    if delimiter is None:
        return [line.split() for line in lines]
    return [[cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])] for line in lines]


def _form_words(delimiter: str | None) -> list[str]:
    named = {";": "semicolons between columns", "\t": "tabs between columns", "|": "bars between columns"}
    return [] if delimiter == "," else [named.get(delimiter or "", "blanks between columns")]


def _line_above(text: str, number: int) -> str:
    """The last line before a line that is not blank."""
    return next((line for line in reversed(text.splitlines()[: number - 1]) if line.strip()), "")


def _commented_names(above: str, delimiter: str | None, width: int) -> list[str]:
    """Names in the line above the first row, a comment, as numpy.savetxt writes them; none where they do not fit."""
    try:
        names = _split([above.lstrip().lstrip("#%").strip()], delimiter)[0]
    except csv.Error:
        return []
    fit = len(names) == width and len(set(names)) == width and all(re.match(r"[^\W\d]", name) for name in names)
    return names if fit else []


def _skipped(count: int, what: str) -> str:
    return f"1 {what} was skipped" if count == 1 else f"{count} {what}s were skipped"


def _header_words(words: EntryWords) -> str:
    named = "--columns 't,q{1-6},tau{1-6}' (_ for one that is not used, ... for all that follow)"
    return named if words.by_option else f"{named}, or header: [t, q1, ...] in the map"


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
            f"line of names: found {found}, expected a unique name for each column; specify others in their"
            f" order: {_header_words(words)}",
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


def _add_lists(log: Log, name: str, texts: list[str]) -> None:
    """A column whose cells hold lists of numbers."""
    rows = [text[1:-1].replace(",", " ").split() for text in texts]
    width = len(rows[0])
    for k, (row, text) in enumerate(zip(rows, texts)):
        bad = len(row) != width or not all(_is_readable(float, cell) for cell in row)
        if bad:
            line = 0 if log.lines is None else int(log.lines[k])
            raise kr5.FileError(
                log.file,
                f"line {line}, column '{name}': found {text:.60}, expected a list of {width} numbers, as in the first"
                " row; was the log truncated while it was written? Delete that line",
            )
    log.add_vector(name, np.array(rows, float).reshape(len(rows), width), "")


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


def _is_number(text: str, delimiter: str | None = ",") -> bool:
    return _is_readable(float, text if delimiter == "," else text.replace(",", "."))


def _add_text_column(log: Log, name: str, texts: list[str], delimiter: str | None) -> None:
    """Missing cells become NaN. Decimal commas are understood where columns are not parted by commas."""
    if (seconds := _seconds_of_dates(texts)) is not None:
        log.add(name, seconds, "")
        return
    if all(LIST.fullmatch(text) for text in texts):
        _add_lists(log, name, texts)
        return
    cells = ["nan" if _is_missing(text) else text for text in texts]
    if delimiter != "," and any("," in c for c in cells):
        cells = [c.replace(",", ".") for c in cells]
        log.form = list(dict.fromkeys([*log.form, "decimal commas"]))
    try:
        log.add(name, np.array(cells, float), "")
    except ValueError:
        read, expected = (_read_date, "a date with a time") if _are_dates(texts) else (float, "a number")
        at = next(i for i, cell in enumerate(cells) if cell != "nan" and not _is_readable(read, cell))
        log.texts[name] = texts
        log.text_columns[name] = TextCell(0 if log.lines is None else int(log.lines[at]), texts[at], expected)
