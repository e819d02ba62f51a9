"""The clock of a log: which column tells the time, and in which unit."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

import kr5
from kr5 import arm_log
from kr5.logs.entry_words import EntryWords
from kr5.logs.log import Log
from kr5.logs.log_time import beginning
from kr5.logs.units import unit_factor


@dataclass
class GuessedClock:
    """What a map says of the clock (`None`: the log's streams have clocks of their own), and why."""

    entry: dict[str, Any] | None
    seconds: np.ndarray  # of the rows, from the beginning of the log
    proposal: str
    reason: str


def guess_clock(
    log: Log, column: str, cycle: float | None, given: dict[str, Any], usual: float | None = arm_log.usual_row_step
) -> GuessedClock | None:
    """The clock of the rows of a column; nothing where no column looks like time and no interval is known. `given`:
    what the user states of it. `usual`: step by which a unit that is not stated is told; none: stamps are in
    seconds."""
    rows = len(log.columns[column])
    stream = log.streams[column]
    own = log.clocks.get(stream)
    name = given.get("column") or own or _time_column(log, stream)
    if "every" in given or name is None:
        return _even_clock(log, rows, cycle, given)
    stamps = log.column(str(name), "clock.column")
    steps = np.diff(stamps[np.isfinite(stamps)])
    step = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    usual = cycle or usual
    unit = str(given["unit"]) if "unit" in given else ("s" if name == own else arm_log.time_unit_in(name))
    if not unit and usual and arm_log.counts_rows(stamps):
        raise kr5.FileError(
            log.file,
            f"{name} counts rows (0, 1, 2, ...), which is no time; state their interval with --every SECONDS, or the"
            " unit of the count with --set clock.unit=ms",
        )
    unit = unit or str(arm_log.guess_time_unit(stamps, usual or 0.0))
    scale = unit_factor(unit, ("time",), "clock")[0]
    reason = f"a row every {step:.4g} {unit}" + (f", which is {step * scale:.4g} s" if scale != 1 else "")
    entry = None if name == own and not given else {"column": name, "unit": unit} | given
    if not np.isfinite(stamps).any():
        return GuessedClock(entry, stamps, f"{name} [{unit}]", reason)
    seconds = (stamps - beginning(log, name)) * scale + _offset(given)
    return GuessedClock(entry, seconds, f"{name} [{unit}]", reason)


def _time_column(log: Log, stream: str) -> str | None:
    """The first column of a stream that looks like time and rises in every row; else the first that goes on; else the
    first that looks like time."""
    names = [n for n in log.time_columns() if log.streams[n] == stream]
    return max(names, key=lambda name: _steadiness(log.columns[name]), default=None)


def _steadiness(stamps: np.ndarray) -> int:
    """2: rises in every row; 1: goes on; 0: neither."""
    if not np.isfinite(stamps).all() or not float(np.ptp(stamps)) > 0:
        return 0
    return 2 if (np.diff(stamps) > 0).all() else 1


def _even_clock(log: Log, rows: int, cycle: float | None, given: dict[str, Any]) -> GuessedClock | None:
    """Rows at the interval that the user states, or else at that of the commands to the cell's drives."""
    step = given.get("every", cycle)
    unreadable = next((name for name in log.text_columns if arm_log.names_time(name)), None)
    if step is None and unreadable is not None:
        raise kr5.IoError(
            f"{log.unreadable(unreadable)}; correct it, or state the interval of the rows with --every SECONDS"
        )
    if step is None:
        return None
    if not isinstance(step, (int, float)) or not step > 0:
        raise kr5.InvalidArgument(f"clock.every: found {step!r:.40}, expected an interval above 0 s")
    lacking = f"{unreadable} holds text" if unreadable else "no column looks like time"
    why = "as asked for" if "every" in given else f"{lacking}; this is the cycle of the cell"
    seconds = step * np.arange(rows) + _offset(given)
    return GuessedClock({"every": step} | given, seconds, f"a row every {step:g} s", why)


def _offset(given: Mapping[str, object]) -> float:
    offset = given.get("offset", 0.0)
    if not isinstance(offset, (int, float)):
        raise kr5.InvalidArgument(f"clock.offset: found {offset!r:.40}, expected a number of seconds")
    return float(offset)


def require_clock(clock: GuessedClock | None, column: str, log: Log, words: EntryWords) -> GuessedClock:
    """The clock of the rows of a column, or an error that says how to state it."""
    if clock is None:
        rows = len(log.columns[column])
        others = [n for n in log.time_columns() if len(log.columns[n]) != rows]
        if others:
            raise kr5.FileError(
                log.file,
                f"{column} has {rows} rows, and {others[0]}, which looks like time, {len(log.columns[others[0]])};"
                " expected as many of each: export them again, or state the interval of the rows with --every SECONDS",
            )
        names = ", ".join(list(log.columns)[:12])
        raise kr5.FileError(
            log.file,
            f"no column looks like time among {names}, and the model states no interval of commands; state the"
            " interval of its rows with --every SECONDS",
        )
    if not np.isfinite(clock.seconds).all() or (len(clock.seconds) > 1 and float(np.ptp(clock.seconds)) <= 0):
        raise kr5.FileError(
            log.file,
            f"{clock.proposal}: found no time that goes on (no number, or too few digits), expected one in"
            f" each row; choose another column ({words.put('clock', column='NAME')}), or state the interval of its rows"
            " with --every SECONDS",
        )
    return clock
