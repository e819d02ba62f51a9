"""Errors and cautions of what is written in Python. Those of C++ are Error, InvalidArgument and IoError."""

import os
from collections.abc import Iterable

from ._kr5 import InvalidArgument, IoError


class FileError(IoError):
    """A file that cannot be used: where in it, what was found and expected, and how to mend it.

    file: as it was named. line: of the file, from 1, where it is known. field: key, column or option that it is about.
    problem: what was found, and what was expected. remedy: what to do; may be empty.
    """

    def __init__(
        self,
        file: str | os.PathLike[str],
        problem: str,
        *,
        line: int | None = None,
        field: str = "",
        remedy: str = "",
    ) -> None:
        self.file, self.line, self.field, self.problem, self.remedy = file, line, field, problem, remedy
        where = os.fspath(file) + (f":{line}" if line else "")
        super().__init__(f"{where}: {f'{field}: ' if field else ''}{problem}{f'; {remedy}' if remedy else ''}")

    def __reduce__(self) -> tuple[object, ...]:
        values = {"line": self.line, "field": self.field, "remedy": self.remedy}
        return _file_error, (self.file, self.problem, values)


def _file_error(file: str | os.PathLike[str], problem: str, values: dict[str, object]) -> FileError:
    """What was sent by another process."""
    return FileError(file, problem, **values)  # type: ignore[arg-type]


class Errors(InvalidArgument):
    """Several things that speak against an input at once. `messages`: each of them."""

    def __init__(self, messages: Iterable[str]) -> None:
        self.messages = tuple(messages)
        super().__init__("\n".join(self.messages))

    def __reduce__(self) -> tuple[object, ...]:
        return Errors, (self.messages,)


class Caution(UserWarning):
    """What a user should know about an input that is used, or about a result. The command prints it as a note; in
    Python it is a warning, which `warnings.filterwarnings` silences or turns into an error."""


class Implausible(Caution):
    """Numbers that make no sense as they were read, and that are used because the caller trusts them."""
