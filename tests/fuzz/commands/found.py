"""What runs have found: each with its changed input in a folder of its own, saved so that it is run again."""

import hashlib
import json
import os
import re
import shutil
from dataclasses import dataclass
from pathlib import Path

import inputs

PLACE = Path(__file__).parent / "found"
RECORD = "found.json"


@dataclass(frozen=True)
class Change:
    """What stands in the place of an input."""

    name: str  # of the input, relative to the folder of its job
    kind: str  # file | link | folder | pipe | missing
    content: bytes = b""  # of a file, or where a link leads


@dataclass(frozen=True)
class Found:
    """A run that ended as none may."""

    job: inputs.Job
    change: Change
    how: str  # it was changed
    problem: str
    there: tuple[str, ...]  # outputs that were there before


def take(file: Path, root: Path) -> Change:
    """What stands in the place of an input now."""
    name = str(file.relative_to(root))
    if file.is_symlink():
        return Change(name, "link", bytes(file.readlink()))
    if file.is_dir() or file.is_fifo():
        return Change(name, "folder" if file.is_dir() else "pipe")
    return Change(name, "file", file.read_bytes()) if file.exists() else Change(name, "missing")


def put(change: Change, root: Path) -> None:
    """Changes an input of a folder."""
    file = root / change.name
    if file.is_dir() and not file.is_symlink():
        shutil.rmtree(file)
    else:
        file.unlink(missing_ok=True)
    if change.kind == "file":
        file.write_bytes(change.content)
    elif change.kind == "link":
        file.symlink_to(change.content.decode())
    elif change.kind == "folder":
        file.mkdir()
    elif change.kind == "pipe":
        os.mkfifo(file)


def save(found: Found, place: Path = PLACE) -> Path:
    """The folder in which it is saved, by its command, problem and input; one that is there already is replaced."""
    words = [*found.job.words()[:2], found.problem.split(" at ")[0]]
    name = "-".join(re.sub(r"\W+", "-", word).strip("-").lower() for word in words)
    same = hashlib.sha256(f"{found.job.arguments}|{found.problem}|{found.change.name}".encode()).hexdigest()[:8]
    folder = place / f"{name}-{same}"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    record = {
        "command": found.job.arguments,
        "folder": found.job.folder,
        "input": found.change.name,
        "kind": found.change.kind,
        "how": found.how,
        "problem": found.problem,
        "there": list(found.there),
    }
    (folder / RECORD).write_text(json.dumps(record, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    if found.change.content:
        _content_file(folder, found.change.name).write_bytes(found.change.content)
    return folder


def load(place: Path = PLACE) -> list[Found]:
    """All that is saved. Raises ValueError for a command that is no job any more: it would be run to no purpose."""
    return [_load_one(record.parent) for record in sorted(place.glob(f"*/{RECORD}"))]


def _load_one(folder: Path) -> Found:
    record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    job = next((j for j in inputs.JOBS if (j.arguments, j.folder) == (record["command"], record["folder"])), None)
    if job is None:
        raise ValueError(f"{folder.name}: 'kr5 {record['command']}' is no job; write one that reads the same input")
    content = _content_file(folder, record["input"])
    change = Change(record["input"], record["kind"], content.read_bytes() if content.exists() else b"")
    return Found(job, change, record["how"], record["problem"], tuple(record["there"]))


def _content_file(folder: Path, name: str) -> Path:
    return folder / f"input{Path(name).suffix}"
