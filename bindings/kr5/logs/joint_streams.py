"""Columns of joints over the times of their streams, which may differ."""

from collections.abc import Mapping

import numpy as np

import kr5.cell
from kr5.logs.clock_guess import GuessedClock
from kr5.logs.column_names import Family
from kr5.logs.joint_columns import joint_values
from kr5.logs.log import Log
from kr5.logs.log_time import beginning


def values_at(
    t: np.ndarray, log: Log, family: Family, entry: Mapping[str, object], cell: kr5.cell.Cell, clock: GuessedClock
) -> np.ndarray | None:
    """The values of a family [SI] at other times [s], rows x joints; nothing where they have no times of their own."""
    values = joint_values(entry, family.name, log, cell)
    own = in_time(log, family.columns[0], clock)[0]
    if len(own) != len(values):
        return None
    known = np.isfinite(values).all(axis=1) & np.isfinite(own)
    return np.column_stack([np.interp(t, own[known], column[known]) for column in values.T]) if known.any() else None


def in_time(log: Log, column: str, clock: GuessedClock) -> tuple[np.ndarray, np.ndarray]:
    """A column with its times from the beginning of the log [s], which are those of its stream."""
    values = log.columns[column]
    if own := log.clocks.get(log.streams[column]):
        return log.columns[own] - beginning(log, own), values
    if len(clock.seconds) != len(values):  # the importer says what is wrong with it
        return clock.seconds, np.zeros(len(clock.seconds))
    return clock.seconds, values
