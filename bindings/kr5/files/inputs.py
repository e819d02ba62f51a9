"""Which files a command reads that is given files and folders: they must not be written over."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import kr5
from kr5.files.documents import read_json, read_yaml
from kr5.files.paths import is_same

RECORDING = "recording.yaml"


def is_read(file: Path, given: Path) -> bool:
    """Whether a command that is given a file or a folder reads this file.

    Of a recording it reads what recording.yaml names, of another folder all that is there: but no page and no result
    that kr5 itself wrote into it, which may be written again.
    """
    if not given.is_dir():
        return is_same(file, given)
    if not file.exists():
        return False
    named = _named_files(given)
    if named is not None:
        return any(is_same(file, one) for one in named)
    inside = given.resolve() in file.resolve().parents or any(
        one.is_symlink() and is_same(file, one) for one in given.rglob("*")
    )
    return inside and not _is_own_result(file)


def _named_files(folder: Path) -> list[Path] | None:
    """The files of a recording; nothing of a folder that is none."""
    index = folder / RECORDING
    if not index.is_file():
        return None
    try:
        names = list(_texts(read_yaml(index)))
    except kr5.Error:
        return None
    named = [folder / name for name in names if name.strip("./")]  # "/", "." and "" hold far more than the recording
    return [index, *named, *(file for place in named if _is_folder(place) for file in place.rglob("*"))]


def _is_folder(place: Path) -> bool:
    try:
        return place.is_dir()
    except OSError:  # texts that are no names, such as notes longer than a name may be
        return False


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, (dict, list)):
        for item in value.values() if isinstance(value, dict) else value:
            yield from _texts(item)


def _is_own_result(file: Path) -> bool:
    if file.suffix.lower() in (".html", ".htm"):
        return True
    if file.suffix.lower() != ".json":
        return False
    try:
        data = read_json(file)
    except kr5.Error:
        return False
    return isinstance(data, dict) and str(data.get("format", "")).startswith("kr5-")
