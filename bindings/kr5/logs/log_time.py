"""The times of logs: from which instant they are counted, and the instants of an experiment."""

from collections.abc import Callable

import numpy as np

import kr5
import kr5.cell
from kr5.logs.log import Log
from kr5.logs.map_file import Clock, Experiment, Map, Source
from kr5.logs.sparse_columns import longest_step
from kr5.logs.values import Note, Series

LONG_AGO = 1e6  # [s] after which a stamp counts from an epoch, not from the beginning of a session
MAX_ROWS = 5_000_000  # of an experiment
COARSE = 0.1  # share of rows with the time of the row before, from which stamps are rounded
KNOWN = 20.0  # steps of rounded stamps in a log, from which its interval is known
JUMP = 10.0  # intervals back, from which rows are no late ones
STILL = ("poses", "views", "scan")  # rows need not follow each other in time


def beginning(log: Log, column: str) -> float:
    """The stamp from which time is counted, in the unit of a column of times: the least of the log's streams, which
    share a clock."""
    columns = set(log.clocks.values()) if column in log.clocks.values() else {column}
    return min(float(np.nanmin(log.columns[c])) for c in columns)


class LogTimes:
    """The times of the experiments of a map. `open_log` gives the log of an experiment, `note` takes
    what was assumed."""

    def __init__(self, map: Map, open_log: Callable[[Experiment], Log], note: Note):
        self.map, self.open_log, self.note = map, open_log, note
        self.origins: dict[str, float] = {}  # earliest stamp [s] of each kind, where several logs share a clock

    def clock_of(self, experiment: Experiment) -> Clock | None:
        return experiment.entry.clock or self.map.clock

    def shift(self, log: Log, experiment: Experiment) -> float:
        """By how much a log begins after the first one of its kind [s]: several logs of one clock keep their order."""
        clock, kind = self.clock_of(experiment), experiment.entry.kind
        if experiment.entry.log is None or clock is None or clock.column is None:
            return 0.0
        if kind not in self.origins:
            own = [e for e in self.map.experiments if e.entry.kind == kind and e.entry.log]
            clocks = [(self.open_log(e), self.clock_of(e)) for e in own]
            first = min(beginning(x, c.column) * c.seconds() for x, c in clocks if c and c.column)
            self.origins[kind] = 0.0 if 0 <= first < LONG_AGO else first
        return beginning(log, clock.column) * clock.seconds() - self.origins[kind]

    def main_time(self, log: Log, experiment: Experiment, where: str) -> np.ndarray:
        """Time [s] of the rows of the log that the experiment is made of, from the log's beginning."""
        clock = self.clock_of(experiment)
        first = next(
            (s.names[0] for s in experiment.sources.values() if s.names and not (isinstance(s, Source) and s.log)),
            None,
        )
        if clock is None and first is not None and log.streams.get(first) in log.clocks:
            clock = Clock(column=log.clocks[log.streams[first]])
        if clock is None:
            if experiment.entry.kind not in STILL:
                put = self.map.words.put
                raise kr5.IoError(
                    f"{where}: needs a clock; add {put('clock', column='NAME', unit='s')}, or"
                    f" {put('clock', every='SECONDS')}"
                )
            clock = Clock(every=1.0)
            self.note("the log has no clock; rows are assumed to be 1 s apart")
        rows = len(log.column(first, where)) if first else 0
        return self.times(log, clock, rows, where, experiment)

    def times(self, log: Log, clock: Clock, rows: int, where: str, experiment: Experiment) -> np.ndarray:
        if clock.every is not None:
            return clock.every * np.arange(rows) + clock.offset
        assert clock.column is not None, "a clock has a column or an interval"
        stamps = log.column(clock.column, f"{self.map.shown}: clock.column")
        bad = np.flatnonzero(~np.isfinite(stamps))
        if len(bad):
            raise kr5.FileError(
                log.file,
                f"{log.row(bad[0])}, column '{clock.column}': found no time ({len(bad)} such rows), expected a number",
            )
        t = (stamps - beginning(log, clock.column)) * clock.seconds() + clock.offset
        if is_timed(experiment):
            self.check_order(log, clock, t, experiment)
        return t

    def check_order(self, log: Log, clock: Clock, t: np.ndarray, experiment: Experiment) -> None:
        back = np.flatnonzero(np.diff(t) <= 0)
        if len(back) and clock.repair != "sort":
            at = back[0] + 1
            what = "goes back" if t[at] < t[at - 1] else "stands still"
            raise kr5.FileError(
                log.file,
                f"{log.row(at)}, column '{clock.column}': time {what}: found {t[at]:.9g} s after"
                f" {t[at - 1]:.9g} s ({len(back)} such rows), expected increasing time; {self.order_remedy(log, t)}",
            )
        part = np.unique(t[inside_span(t, experiment)])
        steps = np.diff(part)
        most = longest_step(part, clock.max_gap)
        wide = np.flatnonzero(steps > most)
        if len(wide):
            before, after = part[wide[0]], part[wide[0] + 1]
            raise kr5.InvalidArgument(
                f"{log.file}: {log.row(int(np.flatnonzero(t == after)[0]))}, column '{clock.column}': found a gap of"
                f" {after - before:.4g} s ({len(wide)} such gaps), expected about {np.median(steps):.4g} s;"
                + (
                    ""
                    if self.map.words.by_option
                    else f" make the parts before and after two experiments (to: {(before + after) / 2:.5g}, from:"
                    f" {(before + after) / 2:.5g}), or"
                )
                + f" allow it with {self.map.words.put('clock', max_gap=float(f'{1.01 * steps.max():.3g}'))}"
            )

    def order_remedy(self, log: Log, t: np.ndarray) -> str:
        """What helps against times that do not increase: sorting helps against single rows only."""
        step = np.diff(t)
        coarse = float(step[step > 0].min(initial=np.inf))
        if (step == 0).mean() > COARSE:
            known = t[-1] - t[0] > KNOWN * coarse
            every = float(f"{(t[-1] - t[0]) / (len(t) - 1):.3g}") if known else "SECONDS"
            return (
                "the stamps have too few digits: export them with more, or state the interval of even rows:"
                f" {self.map.words.interval(every)}"
            )
        jumps = np.flatnonzero(step < -JUMP * np.median(step[step > 0]))
        if len(jumps):
            line = log.row(jumps[0] + 1)
            parts = "give the parts as two logs" if self.map.words.by_option else "make each part an experiment (rows:)"
            return f"several recordings, or a clock that was set: split the log before {line}, and {parts}"
        return f"{self.map.words.put('clock', repair='sort')} sorts the rows and leaves out those with a duplicate time"

    def grid(
        self,
        t: np.ndarray,
        series: dict[str, Series],
        experiment: Experiment,
        where: str,
        cycle: float | None = None,
    ) -> np.ndarray:
        """The instants of the experiment: those of the log, or evenly spaced as the map says or else by a cycle, where
        all streams have data."""
        low, high = experiment.span()
        t = np.unique(t)
        low = max([low, *(s.t[0] for s in series.values() if len(s.t))])
        end = min(s.t[-1] if len(s.t) else -np.inf for s in series.values())
        inside = t[(t >= low) & (t < high) & (t <= end)]
        if len(inside) < 10:
            raise kr5.IoError(
                f"{where}: only {len(inside)} rows of the log lie between from:"
                f" {_given(experiment.entry.begin, 'its beginning')} and to: {_given(experiment.entry.end, 'its end')};"
                f" its streams share {low:.4g} to {end:.4g} s. Is the unit of the clock right?"
            )
        every = self.map.resample.every or cycle
        if every and not (inside[-1] - inside[0]) / every <= MAX_ROWS:
            raise kr5.IoError(
                f"{where}: resample.every: found {every:g} s, which makes more than {MAX_ROWS} rows of "
                f"{inside[-1] - inside[0]:.4g} s; "
                "is the unit of the clock right, and is there a single row far from the others?"
            )
        return np.arange(inside[0], inside[-1] + 1e-9, every) if every else inside


def command_cycle(cell: kr5.cell.Cell) -> float | None:
    """The interval of commands [s]; none of torque servos, whose cycle is that of the loop that closes in the servo."""
    return cell.servo.cycle if cell.servo and not cell.has_torque_servos else None


def is_timed(experiment: Experiment) -> bool:
    """Rows follow each other in time, in one run."""
    return experiment.entry.kind not in STILL and "run" not in experiment.sources


def is_measured(experiment: Experiment) -> bool:
    """Measured positions stand for the motion."""
    qc = experiment.sources.get("qc")
    return isinstance(qc, Source) and qc.measured


def inside_span(t: np.ndarray, experiment: Experiment, margin: float = 0.0) -> np.ndarray:
    """Which times lie in the experiment, or no more than `margin` [s] outside."""
    begin, end = experiment.span()
    return (t >= begin - margin) & (t < end + margin)


def _given(value: float | None, otherwise: str) -> str:
    return otherwise if value is None else f"{value:g}"
