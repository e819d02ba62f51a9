"""A table as a command needs it: quantities in SI, words and poses, a row a reading."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import kr5
from kr5 import calibration
from kr5.tables.checks import missing_columns


@dataclass
class Table:
    """What was found for the roles of a command; a role that is not there has no entry."""

    file: Path
    rows: int
    columns: list[str]  # of the file
    numbers: dict[str, np.ndarray] = field(
        default_factory=dict
    )  # by role [SI]: rows, rows x joints, or rows x points x 3
    words: dict[str, list[str]] = field(default_factory=dict)
    poses: dict[str, list[np.ndarray]] = field(default_factory=dict)  # 4 x 4 each, as the rows state them
    pose_rows: dict[str, np.ndarray] = field(default_factory=dict)
    pose_formats: dict[str, calibration.PoseFormat] = field(default_factory=dict)
    names: dict[str, list[str]] = field(default_factory=dict)  # columns of a role
    units: dict[str, str] = field(default_factory=dict)  # of these columns in the file
    factors: dict[str, float | np.ndarray] = field(default_factory=dict)  # of these units to SI
    lines: np.ndarray | None = None  # of a text, the line of each row
    notes: list[str] = field(default_factory=list)  # how it was read, where that is not plain

    def __contains__(self, role: str) -> bool:
        return role in self.numbers or role in self.words or role in self.poses

    def __getitem__(self, role: str) -> np.ndarray:
        """Numbers of a role in SI."""
        return self.numbers[role]

    def get(self, role: str) -> np.ndarray | None:
        return self.numbers.get(role)

    def row(self, index: int) -> str:
        """Where a row stands, in words."""
        return f"line {self.lines[index]}" if self.lines is not None else f"row {index + 1}"

    def row_name(self, index: int) -> str:
        """A row by its file, such as `poses.csv:12`."""
        return f"{self.file.name}:{self.lines[index] if self.lines is not None else index + 1}"

    def lacks(self, column: str, what: str, option: str = "") -> kr5.IoError:
        """The error about a column that is not there, in the words of all commands."""
        return kr5.IoError(missing_columns(self.file, self.columns, True, [column], what, option, ""))

    def run_starts(self) -> list[int]:
        """First row of each run, which a role `run` tells."""
        if "run" not in self.numbers:
            return [0]
        return [0, *(int(k) for k in np.flatnonzero(np.diff(self.numbers["run"])) + 1)]
