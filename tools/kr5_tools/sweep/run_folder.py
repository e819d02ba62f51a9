"""The folder of a long run: a file that says what is run, and one to which what is finished is appended, so that a run
that was killed goes on."""

import fcntl
import json
import os
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import kr5
from kr5.files import results, writing


@dataclass(frozen=True)
class Kind:
    """Names of what such a folder holds."""

    what: str  # of the run, for messages
    format: str
    description: str  # file
    data: str  # file
    options: dict[str, str]  # what must be as it was, with the option that says it


class RunFolder(ABC):
    """Results that are finished, and a place for more. One process at a time; a result is on the disk before it
    counts."""

    def __init__(self, path: Path, kind: Kind, described: Mapping[str, object]):
        self.path, self.kind, self.note = path, kind, ""
        try:
            self._check_folder()
            path.mkdir(parents=True, exist_ok=True)
            self.file = open(path / kind.data, "a+b")  # noqa: SIM115, it is open as long as the run
        except kr5.Error:
            raise
        except OSError as error:
            raise kr5.FileError(
                error.filename or path, f"cannot be written: {error.strerror}", remedy="choose another folder (-o)"
            ) from error
        try:
            self._lock()  # before anything is changed, and before another run's description is read
            if (path / kind.description).exists():
                self._compare(described)
            else:
                results.write_result(path / kind.description, kind.format, **described)
                writing.publish()  # the results that are added belong to it
            self._read()
        except BaseException:
            self.file.close()
            raise

    def _check_folder(self) -> None:
        """Complains of a folder that is not that of such a run; one that was killed as it began may have left its
        first files.
        """
        path, kind = self.path, self.kind
        if (path / kind.description).is_file() or not path.is_dir():
            return
        begun = (f.name.startswith(".kr5-") or (f.name == kind.data and not f.stat().st_size) for f in path.iterdir())
        if not all(begun):
            raise kr5.FileError(
                path,
                f"is a folder with other files and without {kind.description}; expected a new"
                f" folder, or that of a {kind.what} to continue",
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.file.close()

    def _compare(self, wanted: Mapping[str, object]) -> None:
        file = self.path / self.kind.description
        found = results.read_result(file, self.kind.format)
        for name, option in self.kind.options.items():
            now = writing.to_plain({**wanted, "version": kr5.__version__}[name])
            if found.get(name) != now:
                raise kr5.FileError(
                    file,
                    f"{name}: found {json.dumps(found.get(name))}, now it is {json.dumps(now)};"
                    f" a {self.kind.what} continues with its original settings: the same {option}, or another"
                    " folder (-o)",
                )

    def _lock(self) -> None:
        try:
            fcntl.flock(self.file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise kr5.FileError(
                self.path,
                f"another {self.kind.what} is using this folder; wait for its end, or choose another folder (-o)",
            ) from None

    @abstractmethod
    def _read(self) -> None:
        """Takes in the results that are there."""

    def _append(self, data: bytes) -> None:
        self.file.write(data)
        self.file.flush()
        os.fsync(self.file.fileno())
