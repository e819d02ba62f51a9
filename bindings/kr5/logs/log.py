"""A log of a real cell: columns of numbers by name."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import kr5
from kr5.arm_log import names_time

SECONDS = re.compile(r"^(.*?)[._/]?(secs?)$")
FRACTIONS = {"sec": ("nanosec", "nsec"), "secs": ("nsecs", "nanosecs")}  # [ns], beside the seconds


@dataclass(frozen=True)
class TextCell:
    """The first cell of a column that cannot be read as a number."""

    line: int
    text: str
    expected: str


@dataclass
class Log:
    """Columns by name. Columns of one stream have a row at the same instants; `clocks` names a stream's own time
    column."""

    file: Path
    columns: dict[str, np.ndarray] = field(default_factory=dict)
    streams: dict[str, str] = field(default_factory=dict)
    clocks: dict[str, str] = field(default_factory=dict)
    lines: np.ndarray | None = None  # of a text file, the line of each row
    text_columns: dict[str, TextCell] = field(default_factory=dict)
    texts: dict[str, list[str]] = field(default_factory=dict)  # of these columns, all cells
    order: list[str] = field(default_factory=list)  # of a text file, all columns as they stand in it
    named: bool = True  # false: columns without names, which are their numbers from 1
    renamed: bool = False  # by the caller
    form: list[str] = field(default_factory=list)  # how a text is written, where it is no plain CSV
    notes: list[str] = field(default_factory=list)  # what was done to the numbers when they were read
    arrays: dict[str, list[str]] = field(default_factory=dict)  # vectors of joints: their columns in their order
    percent_likely: bool = False  # the format may give positions in per cent of the range of a joint
    stated: dict[str, float] = field(default_factory=dict)  # numbers beside the rows, by name
    servo_gain_name: str = ""  # what the log calls the gain of its servos, where it has a column `servo_gain`
    labels: dict[str, str] = field(default_factory=dict)  # of columns of vectors: the joint, as the log names it

    def add_vector(self, name: str, values: npt.ArrayLike, stream: str, labels: Sequence[str] = ()) -> None:
        """A vector a row, of which each component is a column (`name[0]`, or `name.label`); one number a row is a
        column."""
        rows = np.asarray(values, float)
        if rows.ndim == 1:
            self.add(name, rows, stream)
            return
        own = list(labels) if len(set(labels)) == rows.shape[1] else []
        columns = [f"{name}.{own[k]}" if own else f"{name}[{k}]" for k in range(rows.shape[1])]
        for column, numbers in zip(columns, rows.T):
            self.add(column, numbers, stream)
        self.arrays[name] = columns
        self.labels |= dict(zip(columns, own))

    def add(self, name: str, values: npt.ArrayLike, stream: str) -> None:
        self.columns[name] = np.asarray(values, float)
        self.streams[name] = stream

    def join_stamps(self) -> None:
        """Times of ROS that stand in two columns (`header.stamp.sec`, `header.stamp.nanosec`) become one [s]
        (`header.stamp`)."""
        for name in list(self.columns):
            match = SECONDS.match(name)
            if match is None:
                continue
            ends = FRACTIONS[match[2]]
            rest = next((r for r in (name.removesuffix(match[2]) + end for end in ends) if r in self.columns), None)
            joined = match[1] or "time"
            if rest is None or joined in self.columns:
                continue
            values = self.columns[name] + 1e-9 * self.columns[rest]
            kept = {
                joined if c == name else c: values if c == name else v for c, v in self.columns.items() if c != rest
            }
            self.streams[joined] = self.streams[name]
            self.columns = kept

    def names(self) -> list[str]:
        """All columns, those of text included."""
        return self.order or list(self.columns)

    def time_columns(self) -> list[str]:
        """Columns whose names are those of a time."""
        return [name for name in self.columns if names_time(name)]

    def drop_repeated_rows(self) -> int:
        """Leaves out rows equal to the one before, if a time rises in all others: a logger wrote them twice. Gives
        their number. For logs of one stream."""
        if not self.columns:
            return 0
        kept = np.zeros(len(next(iter(self.columns.values()))), bool)
        kept[0] = True
        for values in self.columns.values():
            kept[1:] |= (values[1:] != values[:-1]) & ~(np.isnan(values[1:]) & np.isnan(values[:-1]))
        clocks = [self.columns[name][kept] for name in self.time_columns()]
        if kept.all() or kept.sum() < 2 or not any((np.diff(clock) > 0).all() for clock in clocks):
            return 0
        self.columns = {name: values[kept] for name, values in self.columns.items()}
        self.texts = {
            name: [c for c, keep in zip(cells, kept, strict=True) if keep] for name, cells in self.texts.items()
        }
        self.lines = None if self.lines is None else self.lines[kept]
        return int((~kept).sum())

    def keep_rows(self, stream: str, rows: slice) -> None:
        """Leaves out all other rows of a stream."""
        self.columns = {n: v[rows] if self.streams[n] == stream else v for n, v in self.columns.items()}
        self.texts = {n: cells[rows] for n, cells in self.texts.items()}
        self.lines = None if self.lines is None else self.lines[rows]

    def column(self, name: str, where: str) -> np.ndarray:
        if name in self.text_columns:
            raise kr5.IoError(self.unreadable(name))
        if name not in self.columns:
            import difflib

            near = difflib.get_close_matches(name, list(self.columns), 1, 0.5)
            hint = f"; did you mean '{near[0]}'? It has" if near else "; it has"
            names = list(self.columns)
            shown = ", ".join(names[:12]) + (f" and {len(names) - 12} more" if len(names) > 12 else "")
            raise kr5.IoError(f"{where}: found '{name}', which {self.file} does not have{hint}: {shown}")
        return self.columns[name]

    def stacked(self, names: Sequence[str]) -> np.ndarray:
        """Columns beside each other, which must have as many values."""
        for name in names[1:]:
            self.require_rows(name, len(self.columns[names[0]]), names[0])
        return np.column_stack([self.columns[name] for name in names])

    def require_rows(self, name: str, rows: int, first: str) -> None:
        """Refuses a column with other rows than the first one."""
        if len(self.columns[name]) != rows:
            raise kr5.FileError(
                self.file,
                f"{name} has {len(self.columns[name])} values and {first} has {rows}; expected as many of each, a row"
                " an instant: was an array cut off, or does it belong to another log?",
            )

    def unreadable(self, name: str) -> str:
        """Why a column of text has no numbers."""
        cell = self.text_columns[name]
        return f"{self.file}: line {cell.line}, column '{name}': found '{cell.text}', expected {cell.expected}"

    def row(self, index: int) -> str:
        """Where a row stands, in words."""
        return f"line {self.lines[index]}" if self.lines is not None else f"row {index + 1}"
