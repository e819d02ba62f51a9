"""The experiments of a recording from the columns of logs, as a map tells."""

from pathlib import Path
from typing import Any

import kr5.cell
import kr5.io
import numpy as np

from . import common
from .recording_log import Log, read
from .recording_map import Clock, Map, Source, family
from .recording_values import Series, interpolated, smoothed, to_si, tool_poses

GAP = 5.0  # median time steps, more than which is a gap
STILL = ("poses", "views", "scan")  # rows need not follow each other in time


class Importer:
    """Turns logs into experiments. `notes` says in words what was done to the numbers."""

    def __init__(self, map: Map, log: Path):
        self.map, self.default = map, log
        self.cell = kr5.cell.load_cell(map.cell)
        self.logs: dict[Path, Log] = {}
        self.notes: list[str] = []

    def log(self, name: str | None) -> Log:
        file = self.map.file.parent / name if name else self.default
        if file not in self.logs:
            self.logs[file] = read(file, self.map.header)
        return self.logs[file]

    def note(self, text: str) -> None:
        if text not in self.notes:
            self.notes.append(text)

    def experiment(self, entry: dict[str, Any]) -> Any:
        where = f"{self.map.file}: experiment '{entry['name']}'"
        sources = entry["sources"]
        log = self.log(entry.get("log"))
        t = self.main_time(log, entry, where)
        keep = np.ones(len(t), bool)
        series: dict[str, Series] = {}
        for name, source in sources.items():
            if isinstance(source, Source) and not source.measured and name != "t":
                series[name] = self.series(source, name, log, t, entry, keep)
        if "tool" in sources:
            series["tool"] = Series(t, tool_poses(sources["tool"], log))
        grid = self.grid(t[keep], series, entry, where)
        columns = {"t": grid}
        for name, s in series.items():
            values = self.at(s, grid, entry)
            columns |= dict(zip(self.members(name, sources), values.T))
        out = kr5.cell.Experiment(name=entry["name"], kind=entry["kind"], file=f"{entry['name']}.csv", split=entry["split"])
        out.data = self.table(columns, sources, entry, where)
        return out

    # Time

    def main_time(self, log: Log, entry: dict[str, Any], where: str) -> np.ndarray:
        """Time [s] of the rows of the log that the experiment is made of, from the log's beginning."""
        clock = self.map.clock
        first = next((s.names[0] for s in entry["sources"].values() if getattr(s, "names", None) and not getattr(s, "log", None)), None)
        if clock is None and first is not None and log.streams.get(first) in log.clocks:
            clock = Clock(column=log.clocks[log.streams[first]])
        if clock is None:
            if entry["kind"] not in STILL:
                common.fail(f"{where}: needs a clock; add to the map: clock: {{column: NAME, unit: s}}, or {{every: SECONDS}}")
            clock = Clock(every=1.0)
            self.note("the log has no clock: rows are taken as a second apart")
        rows = len(log.column(first, where)) if first else 0
        return self.times(log, clock, rows, where, entry)

    def times(self, log: Log, clock: Clock, rows: int, where: str, entry: dict[str, Any]) -> np.ndarray:
        if clock.every is not None:
            return clock.every * np.arange(rows) + clock.offset
        stamps = log.column(clock.column, f"{self.map.file}: clock.column")
        bad = np.flatnonzero(~np.isfinite(stamps))
        if len(bad):
            common.fail(f"{log.file}: {log.row(bad[0])}, column '{clock.column}': found no time ({len(bad)} such rows), expected a number")
        t = (stamps - self.beginning(log, clock)) * clock.seconds() + clock.offset
        if is_timed(entry):
            self.check_order(log, clock, t, entry)
        return t

    def beginning(self, log: Log, clock: Clock) -> float:
        """The stamp from which time is counted: the least of the log's streams, which share a clock."""
        columns = set(log.clocks.values()) if clock.column in log.clocks.values() else {clock.column}
        return min(float(np.min(log.columns[c])) for c in columns)

    def check_order(self, log: Log, clock: Clock, t: np.ndarray, entry: dict[str, Any]) -> None:
        back = np.flatnonzero(np.diff(t) <= 0)
        if len(back) and clock.repair != "sort":
            at = back[0] + 1
            what = "goes back" if t[at] < t[at - 1] else "stands still"
            common.fail(f"{log.file}: {log.row(at)}, column '{clock.column}': time {what}: found {t[at]:.9g} s after {t[at - 1]:.9g} s "
                        f"({len(back)} such rows), expected time that increases; say clock: {{repair: sort}} in the map to sort the rows "
                        "and leave out those whose time stands twice")
        part = np.unique(t[within(t, entry)])
        steps = np.diff(part)
        most = clock.max_gap or (GAP * float(np.median(steps)) if len(steps) else np.inf)
        wide = np.flatnonzero(steps > most)
        if len(wide):
            before, after = part[wide[0]], part[wide[0] + 1]
            common.fail(f"{log.file}: {log.row(int(np.flatnonzero(t == after)[0]))}, column '{clock.column}': found a gap of "
                        f"{after - before:.4g} s ({len(wide)} such gaps), expected about {np.median(steps):.4g} s; make the parts before "
                        f"and after two experiments (to: {(before + after) / 2:.5g}, from: {(before + after) / 2:.5g}), or allow it with "
                        f"clock: {{max_gap: {1.01 * steps.max():.3g}}}")

    def grid(self, t: np.ndarray, series: dict[str, Series], entry: dict[str, Any], where: str) -> np.ndarray:
        """The instants of the experiment: those of the log, or evenly spaced, where all streams have data."""
        low, high = entry.get("from", -np.inf), entry.get("to", np.inf)
        if not is_timed(entry):
            return t[within(t, entry)]
        t = np.unique(t)
        low = max([low, *(s.t[0] for s in series.values() if len(s.t))])
        end = min(s.t[-1] if len(s.t) else -np.inf for s in series.values())
        inside = t[(t >= low) & (t < high) & (t <= end)]
        if len(inside) < 10:
            common.fail(f"{where}: only {len(inside)} rows of the log lie between from: {entry.get('from', 'its beginning')} and to: "
                        f"{entry.get('to', 'its end')}; its streams share {low:.4g} to {end:.4g} s. Is the unit of the clock right?")
        every = self.map.resample.get("every")
        return np.arange(inside[0], inside[-1] + 1e-9, every) if every else inside

    # Values

    def series(self, source: Source, name: str, main: Log, t: np.ndarray, entry: dict[str, Any], keep: np.ndarray) -> Series:
        if source.value is not None:
            values = np.tile(source.value, (len(t), 1))
            return Series(t, to_si(source, name, values, self.cell, self.note))
        log = self.log(source.log) if source.log else main
        raw = [log.column(n, source.where) for n in source.names]
        if len({len(r) for r in raw}) > 1:
            common.fail(f"{source.where}: columns of different lengths in {log.file}: {', '.join(f'{n} {len(r)}' for n, r in zip(source.names, raw))}")
        own = self.own_time(source, log, main, t, len(raw[0]), entry)
        values = to_si(source, name, np.column_stack(raw), self.cell, self.note)
        out = self.without_missing(source, log, Series(own, values), keep if own is t else None)
        return self.in_order(out, entry) if is_timed(entry) else out

    def own_time(self, source: Source, log: Log, main: Log, t: np.ndarray, rows: int, entry: dict[str, Any]) -> np.ndarray:
        """The time of the stream a source comes from, which may be the main one."""
        clock = source.clock
        if clock is None and (own := log.clocks.get(log.streams[source.names[0]])):
            clock = Clock(column=own, offset=self.map.clock.offset if self.map.clock else 0.0)
        if clock is None and log is not main and self.map.clock is not None:
            clock = self.map.clock
        if clock is not None:
            out = self.times(log, clock, rows, source.where, entry)
            if len(out) == len(t) and np.array_equal(out, t):
                return t
            self.note(f"{source.members[0]} and its like have a clock of their own; they were brought to the main one ({self.method()})")
        else:
            out = t
        if rows != len(out):
            common.fail(f"{source.where}: found {rows} rows beside a clock of {len(out)}; name its own: clock: {{column: NAME, unit: s}}")
        return out

    def without_missing(self, source: Source, log: Log, s: Series, keep: np.ndarray | None) -> Series:
        lacks = ~np.isfinite(s.values).all(axis=1)
        if not lacks.any():
            return s
        rows = np.flatnonzero(lacks)
        if source.missing == "fail":
            column = source.names[int(np.flatnonzero(~np.isfinite(s.values[rows[0]]))[0])]
            common.fail(f"{log.file}: {log.row(rows[0])}, column '{column}': found no number (empty, NaN or infinite; {len(rows)} of {len(s.t)} "
                        "rows), expected one in each row; say missing: interpolate beside this column in the map when the sensor is "
                        "slower than the log, or missing: drop to leave out these rows")
        what = f"{source.members[0]} and its like: {len(rows)} of {len(s.t)} rows without a number were "
        if source.missing == "drop" and keep is not None:
            keep &= ~lacks
            self.note(what + "left out")
        else:
            self.note(what + f"filled from their neighbours ({self.method()})")
        if lacks.all():
            common.fail(f"{source.where}: no row of {log.file} has a number in all of its columns")
        return Series(s.t[~lacks], s.values[~lacks])

    def in_order(self, s: Series, entry: dict[str, Any]) -> Series:
        """Sorted by time, and only what the experiment needs."""
        margin = 2.0 / self.map.resample["low_pass"] if "low_pass" in self.map.resample else 0.0  # a filter needs room at its ends
        inside = within(s.t, {k: entry[k] + sign * margin for k, sign in (("from", -1), ("to", 1)) if k in entry})
        s = Series(s.t[inside], s.values[inside])
        t, first = np.unique(s.t, return_index=True)
        if len(t) < len(s.t) or np.any(np.diff(s.t) < 0):
            self.note(f"rows were sorted by time; {len(s.t) - len(t)} whose time stood twice were left out")
        return Series(t, s.values[first])

    def at(self, s: Series, grid: np.ndarray, entry: dict[str, Any]) -> np.ndarray:
        """Values at the instants of the experiment, after a low-pass where the map asks for one."""
        if not is_timed(entry):
            return s.values[np.isin(s.t, grid)] if len(s.t) != len(grid) else s.values
        cut = self.map.resample.get("low_pass")
        if cut:
            s = smoothed(s, cut, str(self.map.file))
            self.note(f"low-passed at {cut:g} Hz (Butterworth of order 4, forth and back: no delay)")
        elif len(s.t) == len(grid) and np.array_equal(s.t, grid):
            return s.values
        if self.map.resample.get("every"):
            self.note(f"rows every {self.map.resample['every']:g} s ({self.method()})")
        return interpolated(s, grid, self.map.resample.get("method", "linear"))

    def method(self) -> str:
        return {"linear": "linear between rows", "cubic": "cubic spline", "previous": "the value before"}[self.map.resample.get("method", "linear")]

    # Table

    def members(self, name: str, sources: dict[str, Any]) -> list[str]:
        return ["x", "y", "z", "qw", "qx", "qy", "qz"] if name == "tool" else sources[name].members

    def table(self, columns: dict[str, np.ndarray], sources: dict[str, Any], entry: dict[str, Any], where: str) -> Any:
        rows = len(columns["t"])
        if "qc" in sources and sources["qc"].measured:
            self.note("no commands were logged: the measured joint values stand for them, so that nothing is learnt about the servos")
            for i in range(self.map.joints):
                columns[f"qc{i + 1}"] = columns[f"q{i + 1}"]
            if "q" in sources:
                columns = {k: v for k, v in columns.items() if family(k) != "q"}
        columns.setdefault("pose", np.arange(rows, dtype=float))
        columns.setdefault("run", np.zeros(rows))
        wanted = kr5.cell.columns(entry["kind"], self.map.joints)
        for column in wanted:
            if not column.group and column.name not in columns:
                common.fail(f"{where}: columns.{family(column.name)} is missing: {column.name} [{column.unit}] is required for kind "
                            f"{entry['kind']}" + ("; say qc: {from: measured, unit: rad} when no commands were logged" if family(column.name) == "qc" else ""))
        names = [c.name for c in wanted if c.name in columns]
        return kr5.io.Table(names, np.column_stack([columns[n] for n in names]))


def is_timed(entry: dict[str, Any]) -> bool:
    """Rows follow each other in time, in one run."""
    return entry["kind"] not in STILL and "run" not in entry["sources"]


def within(t: np.ndarray, entry: dict[str, Any]) -> np.ndarray:
    return (t >= entry.get("from", -np.inf)) & (t < entry.get("to", np.inf))
