"""Result files: what every calibration and diagnosis writes with -o."""

import datetime
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

import kr5
from kr5.files.writing import to_plain, write_json

# What shows a file of another format.
SHOWN_BY = {
    "kr5-cell/1": "kr5 cell show FILE",
    "kr5-dataset/1": "kr5 calibrate hand-eye FOLDER",
    "kr5-map/1": "kr5 recording import LOG --map FILE",
    "kr5-protocol/1": "kr5 report FILE.yaml",
    "kr5-recording/1": "kr5 replay FOLDER",
    "kr5-scene/1": "kr5 scene run FILE -o PAGE.html",
    "kr5-sensitivity-run/1": "kr5 report on the result.json of kr5 sensitivity",
}


def fail_format(file: Path, found: object, expected: Iterable[str]) -> NoReturn:
    """Complains of a file of another format, and says what shows it."""
    from kr5.files.documents import display_value

    shown = SHOWN_BY.get(found) if isinstance(found, str) else None
    remedy = f"such a file is for {shown}" if shown else ""
    problem = f"found {display_value(found)}, expected {one_of(expected)}"
    raise kr5.FileError(file, problem, field="format", remedy=remedy)


def one_of(names: Iterable[str]) -> str:
    several = list(names)
    return several[0] if len(several) == 1 else f"one of {', '.join(several)}"


def write_result(file: Path | None, format: str, **keys: object) -> dict[str, Any]:
    """Makes a result (`format`, version, created, command, and `keys`), writes it if there is a file, returns it."""
    created = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    command = " ".join([_program(), *sys.argv[1:]])
    data = {"format": format, "version": kr5.__version__, "created": created, "command": command, **to_plain(keys)}
    write_json(data, file)
    return data


def _program() -> str:
    """What is running: the command, also as `python -m kr5_tools`, or a program of the user."""
    name = Path(sys.argv[0]).name
    return "kr5" if name in ("", "__main__.py") else name


def write_if_usable(data: Mapping[str, object], fit: kr5.FitReport, *files: Path | None) -> None:
    """Writes a result where it is wanted; one that must not be used is told, and no older file is lost for it."""
    if not fit.usable:
        raise kr5.InvalidArgument(fit.message)
    for file in files:
        write_json(data, file)


def read_result(file: Path, *formats: str) -> dict[str, Any]:
    """Reads a result file of one of the formats (of any, when none is named), and checks it against its model."""
    from kr5.files.documents import parse_json, read_text, validate_document
    from kr5.files.result_models import model_of

    expected = "a result file written by a kr5 command with -o"
    text = read_text(file, expected)
    data = parse_json(text, file, expected)
    found = data.get("format") if isinstance(data, dict) else None
    if not isinstance(found, str) or not _is_expected(found, formats):
        fail_format(file, found, formats or ["that of a result, such as kr5-hand-eye/1"])
    validate_document(data, model_of(found), file, text)
    return dict(data)


def _is_expected(format: str, formats: Sequence[str]) -> bool:
    if formats:
        return format in formats
    return format.startswith("kr5-") and "/" in format and format not in SHOWN_BY
