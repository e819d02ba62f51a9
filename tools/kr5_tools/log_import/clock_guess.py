"""The clock of a log: which column tells the time, and in which unit."""

import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from kr5_tools.cli import terminal
from kr5_tools.log_import.log import Log

TIME = re.compile(
    r"(^|[^a-z])(t|time|timestamp|stamp|clock|zeit|seconds|sec|log_time|header\.stamp|header/stamp)(_?\[?(s|ms|us|ns)\]?)?$"
)
SCALES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
USUAL_STEP = 0.005  # [s] between rows of a controller's log
MOST_STEP = 0.5  # [s] above which no control log has its rows, whatever the unit


@dataclass
class GuessedClock:
    """What a map says of the clock (`None`: the log's streams have clocks of their own), and why."""

    entry: dict[str, Any] | None
    seconds: np.ndarray  # of the rows, from the beginning of the log
    proposal: str
    reason: str


def guess_clock(
    log: Log, column: str, cycle: float | None, every: float | None = None, usual: float | None = USUAL_STEP
) -> GuessedClock | None:
    """The clock of the rows of a column; nothing where no column looks like time and no interval is known. `usual`:
    step by which a unit that is not stated is told; none: stamps are in seconds."""
    rows = len(log.columns[column])
    stream = log.streams[column]
    own = log.clocks.get(stream)
    name = own or _time_column(log, stream)
    if every is not None or name is None:
        step = every if every is not None else cycle
        if step is None:
            return None
        why = "as asked for" if every is not None else "no column looks like time; this is the cycle of the cell"
        return GuessedClock({"every": step}, step * np.arange(rows), f"a row every {step:g} s", why)
    stamps = log.columns[name]
    steps = np.diff(stamps[np.isfinite(stamps)])
    step = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    usual = cycle or usual
    unit = "s" if own else stated_unit(name) or (_unit_of(step, usual) if usual else "s")
    scale = SCALES[unit]
    reason = f"a row every {step:.4g} {unit}" + (f", which is {step * scale:.4g} s" if scale != 1 else "")
    entry = None if own else {"column": name, "unit": unit}
    begin = min(float(np.nanmin(log.columns[c])) for c in (log.clocks.values() if own else [name]))
    return GuessedClock(entry, (stamps - begin) * scale, f"{name} [{unit}]", reason)


def _time_column(log: Log, stream: str) -> str | None:
    """The first column of a stream that looks like time and goes on in every row; else the first that looks like it."""
    names = [n for n in log.columns if log.streams[n] == stream and TIME.search(n.lower().split(":")[-1].strip("% "))]
    return next((n for n in names if _goes_on(log.columns[n])), names[0] if names else None)


def _goes_on(stamps: np.ndarray) -> bool:
    return bool(np.isfinite(stamps).all() and float(np.ptp(stamps)) > 0)


def stated_unit(name: str) -> str | None:
    """The unit that a name ends in: `time_ms`, `t [ns]`."""
    match = re.search(r"[_\[\s(](s|ms|us|ns|sec|nsec|nanosec)[\])]?$", name.lower())
    return {"sec": "s", "nsec": "ns", "nanosec": "ns"}.get(match[1], match[1]) if match else None


def _unit_of(step: float, usual: float) -> str:
    return min(SCALES, key=lambda u: abs(np.log(max(step, 1e-12) * SCALES[u] / usual)))


def require_clock(clock: GuessedClock | None, log: Log) -> GuessedClock:
    if clock is None:
        names = ", ".join(list(log.columns)[:12])
        terminal.fail(
            f"{log.file}: no column looks like time among {names}, and the model states no cycle; state the interval of"
            " its rows with --every SECONDS"
        )
    if not np.isfinite(clock.seconds).all() or (len(clock.seconds) > 1 and float(np.ptp(clock.seconds)) <= 0):
        terminal.fail(
            f"{log.file}: {clock.proposal}: found no time that goes on, expected a number in each row; choose another"
            " column with --set clock.column=NAME, or state the interval of its rows with --every SECONDS"
        )
    return clock
