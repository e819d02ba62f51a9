"""A run of the fuzzer: a command of `kr5` with the files that it reads."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Job:
    """A command and the files that it reads."""

    group: str  # row of the table
    arguments: str  # with spaces between; relative to a folder that holds the files of `folder`
    folder: str
    files: tuple[str, ...]  # those to be changed, as patterns
    outputs: tuple[str, ...] = ()  # files that were there and must stay when the command fails
    weight: float = 1.0
    code: int = 0  # exit code with the files as they are

    def words(self) -> list[str]:
        return self.arguments.split()
