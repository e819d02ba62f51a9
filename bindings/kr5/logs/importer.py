"""The experiments of a recording from the columns of logs, as a map tells."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import kr5
import kr5.cell
import kr5.io
from kr5 import arm_log
from kr5.logs.column_list import names_in_order
from kr5.logs.episodes import LogSource, log_sources, short_name
from kr5.logs.log import Log
from kr5.logs.log_checks import LogProblem, Origin, check_loads, check_positions, merged_problems
from kr5.logs.log_file import read_log
from kr5.logs.log_time import LogTimes, command_cycle, inside_span, is_measured, is_timed
from kr5.logs.map_file import Clock, Experiment, Map, Source, Tool, column_family, load_map
from kr5.logs.servo_gain import SERVO_GAIN
from kr5.logs.sparse_columns import aligned, longest_step, never_complete
from kr5.logs.values import Series, interpolate, low_pass, to_si, tool_poses

LEAST_SMOOTHED = 30  # rows of positions
LEAST_ROWS = 10  # of an experiment once its ends are left out
EDGE = 2.0  # periods of the cut-off at the ends of a log, where the filter knows one side of the motion only
MOST_OFF = 0.05  # of a number of rows in a cycle, from a whole one
LOADS = ("tau", "i")
Readings = dict[str, list[np.ndarray]]  # of columns: uninterrupted parts
Complete = Callable[[kr5.cell.Recording, Readings], None]


class Importer:
    """Turns logs into experiments. `notes` says in words what was done to the numbers."""

    def __init__(self, map: Map, log: Path | None):
        self.map, self.default = map, log
        self.cell = kr5.cell.load_cell(map.cell)
        self.logs: dict[tuple[Path, int | None], Log] = {}
        self.notes: list[str] = []
        self.time = LogTimes(map, self.log_of, self.note)
        self.smoothings: dict[
            tuple[Path, int | None, str], arm_log.Smoothing
        ] = {}  # by log and first column, all parts alike
        self.readings: Readings = {}  # of loads, before long experiments were thinned

    def log_file(self, name: str | None) -> Path:
        beside = self.default if self.default and self.map.words.by_option else self.map.file
        file = beside.parent / name if name else self.default
        if file is None:
            raise kr5.IoError(
                f"{self.map.shown}: an experiment names no log; expected log: FILE, or a log beside --map"
            )
        return file

    def log(self, name: str | None, episode: int | None = None) -> Log:
        key = (self.log_file(name), episode)
        if key not in self.logs:
            keeps_off = any(SERVO_GAIN in e.sources for e in self.map.experiments)
            self.logs[key] = read_log(key[0], self.map.header, self.map.words, episode=episode, keeps_off=keeps_off)
            for note in self.logs[key].notes:
                self.note(note)
        return self.logs[key]

    def log_of(self, experiment: Experiment) -> Log:
        return self.log(experiment.entry.log, experiment.entry.episode)

    def origins(self) -> list[Origin]:
        """Where each experiment comes from."""
        logs = [LogSource(self.log_file(e.entry.log), e.entry.episode) for e in self.map.experiments]
        return [
            Origin(e.sources, short_name(log, logs), self.time.shift(self.log_of(e), e))
            for e, log in zip(self.map.experiments, logs)
        ]

    def where(self, experiment: Experiment) -> str:
        return f"{self.map.shown}: experiment '{experiment.entry.name}'"

    def note(self, text: str) -> None:
        if text not in self.notes:
            self.notes.append(text)

    def experiment(self, experiment: Experiment) -> Any:
        where = self.where(experiment)
        sources = experiment.sources
        log = self.log_of(experiment)
        t = self.time.main_time(log, experiment, where)
        keep = self.chosen_rows(len(t), experiment, where)
        series = self.all_series(log, t, experiment, keep)
        if isinstance(tool := sources.get("tool"), Tool):
            series["tool"] = Series(t, tool_poses(tool, log))
        if is_timed(experiment) and is_measured(experiment) and not self.map.resample.low_pass:
            grid = self.measured_grid(series, experiment, where)
        elif is_timed(experiment):
            grid = self.time.grid(t[keep], series, experiment, where, self.cycle_of_rows(t[keep], experiment))
        else:
            keep &= inside_span(t, experiment)
            grid = t[keep]
        columns = {"t": grid + self.time.shift(log, experiment)}
        for name, s in series.items():
            values = self.at(name, s, grid, experiment) if is_timed(experiment) else s.values[keep]
            columns |= dict(zip(self.members(name, sources), values.T))
        out = kr5.cell.Experiment(
            name=experiment.entry.name,
            kind=experiment.entry.kind,
            file=f"{experiment.entry.name}.csv",
            split=experiment.entry.split,
        )
        if is_measured(experiment):
            out.joint_reference = kr5.cell.JointReference("measured")
            if is_timed(experiment) and not self.map.resample.low_pass:
                out.speed_noise = self.smoothings[self.positions_of(experiment)].speed_noise
        out.data = self.table(columns, sources, experiment, where)
        return kr5.cell.split_lead_in(out, experiment.entry.lead_in)

    def cycle_of_rows(self, t: np.ndarray, experiment: Experiment) -> float | None:
        """Interval [s] of a motion under commands of which the log has several rows in a cycle of the servo."""
        cycle = command_cycle(self.cell)
        if experiment.entry.kind != "motion" or "qc" not in experiment.sources or len(t) < 3:
            return None
        if not cycle or self.map.resample.every:
            return None
        rows = cycle / float(np.median(np.diff(np.unique(t))))
        if round(rows) < 2 or abs(rows - round(rows)) > MOST_OFF * rows:
            return None
        self.note(f"rows every {cycle:g} s, the cycle of the servo ({self.method()})")
        return cycle

    def all_series(self, log: Log, t: np.ndarray, experiment: Experiment, keep: np.ndarray) -> dict[str, Series]:
        return {
            name: self.series(source, name, log, t, experiment, keep)
            for name, source in experiment.sources.items()
            if isinstance(source, Source) and not source.measured and name != "t"
        }

    def chosen_rows(self, rows: int, experiment: Experiment, where: str) -> np.ndarray:
        first, last = experiment.entry.rows or (1, rows)
        if last > rows:
            raise kr5.IoError(f"{where}: rows: found {first} to {last}, expected rows of the log's {rows}")
        out = np.zeros(rows, bool)
        out[first - 1 : last] = True
        return out

    def measured_grid(self, series: dict[str, Series], experiment: Experiment, where: str) -> np.ndarray:
        """Smooths the positions, and gives the instants of the log that are kept."""
        if "q" not in series:
            raise kr5.IoError(
                f"{where}: columns.qc: found from: measured, but columns.q is missing, which contains the measured"
                " values"
            )
        q, loads, beside = _with_loads(series)
        chosen = self.smoothing(series, experiment, where)
        if chosen.even_step > 0:
            even = q.t[0] + chosen.even_step * np.arange(len(q.t))
            for name, s in series.items():
                if np.array_equal(s.t, q.t):
                    series[name] = Series(even, s.values)
            self.note("the time stamps came late; the samples were taken at even steps")
        q = series["q"]
        times = q.t if loads is None or beside else loads.t  # noise of the loads stays as it is, without interpolation
        even_q = arm_log.smooth_positions(q.t, q.values, chosen)
        series["q"] = Series(np.asarray(even_q.t), np.asarray(even_q.q))
        if chosen.smooths:
            self.note(
                f"positions were smoothed at {chosen.cutoff:.3g} Hz (no delay), since speeds and accelerations follow"
                " from them; efforts and currents are as logged"
            )
        low = max([experiment.span()[0], *(s.t[0] for s in series.values() if len(s.t))])
        high = min([experiment.span()[1], *(np.nextafter(s.t[-1], np.inf) for s in series.values() if len(s.t))])
        span, positions = (arm_log.TimeSpan(begin=a, end=b) for a, b in ((low, high), (q.t[0], q.t[-1])))
        self.read_loads(series, times[arm_log.kept_rows(times, chosen, span, positions)], experiment)
        out = times[arm_log.kept_rows(times, chosen, span, positions, arm_log.MOST_ROWS)]
        if len(out) < LEAST_ROWS:
            smoothing = ""
            if chosen.smooths:
                smoothing = f", since smoothing the positions takes {EDGE / chosen.cutoff:.2g} s at each end"
            raise kr5.IoError(
                f"{where}: found {len(q.t)} rows over {q.t[-1] - q.t[0]:.3g} s, of which {len(out)} can be compared"
                f"{smoothing}; expected at least {LEAST_ROWS}: log a longer motion"
            )
        return out

    def read_loads(self, series: dict[str, Series], t: np.ndarray, experiment: Experiment) -> None:
        """Notes the loads at the rate that the motion needs, for their noise."""
        for name in (name for name in LOADS if name in series):
            values = self.at(name, series[name], t, experiment)
            for member, column in zip(self.members(name, experiment.sources), values.T):
                self.readings.setdefault(member, []).append(column)

    def smoothing(self, series: dict[str, Series], experiment: Experiment, where: str) -> arm_log.Smoothing:
        """That of the experiment of a log which moves fastest: all parts of a log are smoothed alike."""
        key = self.positions_of(experiment)
        if key not in self.smoothings:
            found = [_smoothing_of(series, where)]
            for other in self.map.experiments:
                if other is not experiment and is_measured(other) and self.positions_of(other) == key:
                    log = self.log_of(other)
                    t = self.time.main_time(log, other, self.map.shown)
                    keep = self.chosen_rows(len(t), other, self.map.shown)
                    found.append(_smoothing_of(self.all_series(log, t, other, keep), self.where(other)))
            self.smoothings[key] = max(found, key=lambda s: s.cutoff)
            self.smoothings[key].speed_noise = np.max([s.speed_noise for s in found], axis=0)
        return self.smoothings[key]

    def positions_of(self, experiment: Experiment) -> tuple[Path, int | None, str]:
        """Log and first column of the positions."""
        source = experiment.sources["q"]
        assert isinstance(source, Source), "of joints"
        log = self.log(source.log) if source.log else self.log_of(experiment)
        return log.file, experiment.entry.episode, source.names[0]

    # Values

    def series(
        self, source: Source, name: str, main: Log, t: np.ndarray, experiment: Experiment, keep: np.ndarray
    ) -> Series:
        if source.value is not None:
            values = np.tile(source.value, (len(t), 1))
            return Series(t, to_si(source, name, values, self.cell, self.note))
        log = self.log(source.log) if source.log else main
        raw = [log.column(n, source.where) for n in source.names]
        if len({len(r) for r in raw}) > 1:
            raise kr5.IoError(
                f"{source.where}: columns of different lengths in {log.file}:"
                f" {', '.join(f'{n} {len(r)}' for n, r in zip(source.names, raw))}"
            )
        own = self.own_time(source, log, main, t, len(raw[0]), experiment)
        values = to_si(source, name, np.column_stack(raw), self.cell, self.note)
        if not is_timed(experiment):
            return self.still_values(source, log, Series(own, values), keep)
        if source.delay:
            own = own - source.delay
            self.note(
                f"{source.members[0]} and similar columns were logged {1e3 * abs(source.delay):g} ms"
                f" {'late' if source.delay > 0 else 'early'}; their times are corrected"
            )
        out = self.in_order(
            self.without_missing(source, log, Series(own, values), keep if own is t else None), experiment
        )
        if source.missing == "interpolate":
            self.check_gaps(source, log, out, experiment)
        return out

    def still_values(self, source: Source, log: Log, s: Series, keep: np.ndarray) -> Series:
        """All rows, those without a number not kept: what stands still is not interpolated."""
        lacks = ~np.isfinite(s.values).all(axis=1)
        if (lacks & keep).any() and source.missing == "fail":
            self.without_missing(source, log, s, None)
        keep &= ~lacks
        return s

    def own_time(
        self, source: Source, log: Log, main: Log, t: np.ndarray, rows: int, experiment: Experiment
    ) -> np.ndarray:
        """The time of the stream a source comes from, which may be the main one."""
        clock = source.clock
        if clock is None and (own := log.clocks.get(log.streams[source.names[0]])):
            main_clock = self.time.clock_of(experiment)
            clock = Clock(column=own, offset=main_clock.offset if main_clock else 0.0)
        if clock is None and log is not main and self.map.clock is not None:
            clock = self.map.clock
        if clock is not None:
            out = self.time.times(log, clock, rows, source.where, experiment)
            if len(out) == len(t) and np.array_equal(out, t):
                return t
            self.note(
                f"{source.members[0]} and similar columns have a separate clock; they were resampled"
                f" to the main one ({self.method()})"
            )
        else:
            out = t
        if rows != len(out):
            main_clock, key = self.time.clock_of(experiment), f"{_key(source)}.clock"
            if main_clock is not None and main_clock.every is not None:
                remedy = "if both begin together, at the same interval, state it for this one, too: "
                remedy += self.map.words.put(key, every=main_clock.every)
            else:
                remedy = f"specify its clock: {self.map.words.put(key, column='NAME', unit='s')}"
            raise kr5.FileError(
                log.file,
                f"{source.names[0]} and similar columns have {rows} rows beside a clock of {len(out)}; {remedy}",
            )
        return out

    def without_missing(self, source: Source, log: Log, s: Series, keep: np.ndarray | None) -> Series:
        lacks = ~np.isfinite(s.values).all(axis=1)
        if not lacks.any():
            return s
        rows = np.flatnonzero(lacks)
        if source.missing == "fail":
            column = source.names[int(np.flatnonzero(~np.isfinite(s.values[rows[0]]))[0])]
            raise kr5.FileError(
                log.file,
                f"{log.row(rows[0])}, column '{column}': found no number (empty, NaN or infinite;"
                f" {len(rows)} of {len(s.t)} rows), expected one in each row;"
                f" {self.map.words.put(_key(source), missing='interpolate')} fills them where the sensor is slower than"
                f" the log, {self.map.words.put(_key(source), missing='drop')} leaves these rows out",
            )
        what = f"{source.members[0]} and similar columns: {len(rows)} of {len(s.t)} rows without a number were "
        if source.missing == "drop" and keep is not None:
            keep &= ~lacks
            self.note(what + "left out")
        else:
            self.note(what + f"filled from their neighbours ({self.method()})")
        if source.missing == "interpolate" and never_complete(s.values):
            t, values = aligned(s.t, s.values)
            every = 2 if column_family(source.members[0]) in ("tau", "i") else 1  # rows that share no reading
            return Series(t[::every], values[::every])
        if lacks.all():
            raise kr5.IoError(f"{source.where}: no row of {log.file} has a number in all of its columns")
        return Series(s.t[~lacks], s.values[~lacks])

    def check_gaps(self, source: Source, log: Log, s: Series, experiment: Experiment) -> None:
        """Values between rows far apart are not made up."""
        t = s.t[inside_span(s.t, experiment)]
        clock = self.time.clock_of(experiment)
        most = longest_step(t, clock.max_gap if clock else None)
        wide = np.flatnonzero(np.diff(t) > most)
        if len(wide) and self.map.resample.method != "previous":
            before, after = t[wide[0]], t[wide[0] + 1]
            raise kr5.FileError(
                log.file,
                f"column '{source.names[0]}': found no number for {after - before:.4g} s ({len(wide)} such"
                f" gaps), expected one about every {np.median(np.diff(t)):.4g} s; make the parts before and after two"
                f" experiments (to: {before:.5g}, from: {after:.5g}), or allow it with clock:"
                f" {{max_gap: {1.01 * np.diff(t).max():.3g}}}",
            )

    def in_order(self, s: Series, experiment: Experiment) -> Series:
        """Sorted by time, and only what the experiment needs."""
        cut = self.map.resample.low_pass
        room = arm_log.SMOOTHING_MARGIN if is_measured(experiment) else 0.0
        margin = 2.0 / cut if cut else room  # a filter needs room at its ends
        inside = inside_span(s.t, experiment, margin)
        s = Series(s.t[inside], s.values[inside])
        t, first = np.unique(s.t, return_index=True)
        if len(t) < len(s.t) or np.any(np.diff(s.t) < 0):
            self.note(f"rows were sorted by time; {len(s.t) - len(t)} with a duplicate time were left out")
        clock = self.time.clock_of(experiment)
        near = is_measured(experiment) and not cut
        own = contiguous(t, experiment, clock.max_gap if clock else None) if near else slice(None)
        return Series(t[own], s.values[first][own])

    def at(self, name: str, s: Series, grid: np.ndarray, experiment: Experiment) -> np.ndarray:
        """Values at the instants of the experiment, after a low-pass where the map asks for one."""
        cut = self.map.resample.low_pass
        if cut:
            s = low_pass(s, cut, self.map.shown)
            self.note(f"low-passed at {cut:g} Hz (Butterworth of order 4, forth and back: no delay)")
        elif len(s.t) == len(grid) and np.array_equal(s.t, grid):
            return s.values
        if self.map.resample.every:
            self.note(f"rows every {self.map.resample.every:g} s ({self.method()})")
        smooth = name == "q" and is_measured(experiment)  # accelerations follow from it
        held = name == SERVO_GAIN  # which switches
        return interpolate(s, grid, "previous" if held else "cubic" if smooth else self.map.resample.method)

    def method(self) -> str:
        return {"linear": "linear between rows", "cubic": "cubic spline", "previous": "the value before"}[
            self.map.resample.method
        ]

    # Table

    def members(self, name: str, sources: dict[str, Any]) -> list[str]:
        return ["x", "y", "z", "qw", "qx", "qy", "qz"] if name == "tool" else sources[name].members

    def table(self, columns: dict[str, np.ndarray], sources: dict[str, Any], experiment: Experiment, where: str) -> Any:
        rows = len(columns["t"])
        if "qc" in sources and sources["qc"].measured:
            self.note(
                "the measured joint values replace the commands, so that the recording"
                " contains no information about the servos"
            )
            if "q1" not in columns:
                raise kr5.IoError(
                    f"{where}: columns.qc: found from: measured, but columns.q is missing,"
                    " which contains the measured values"
                )
            for i in range(self.map.joints):
                columns[f"qc{i + 1}"] = columns[f"q{i + 1}"]
            if "q" in sources:
                columns = {k: v for k, v in columns.items() if column_family(k) != "q"}
        columns.setdefault("pose", np.arange(rows, dtype=float))
        columns.setdefault("run", np.zeros(rows))
        wanted = kr5.cell.columns(kr5.cell.Kind(experiment.entry.kind), self.map.joints)
        for column in wanted:
            if not column.group and column.name not in columns:
                name = column_family(column.name)
                put = self.map.words.put("columns.qc", **{"from": "measured", "unit": "rad"})
                remedy = f"; {put} is for logs without commands" if name == "qc" else ""
                raise kr5.IoError(
                    f"{where}: columns.{name} is missing: {column.name} [{column.unit}] is required for kind"
                    f" {experiment.entry.kind}{remedy}"
                )
        names = [c.name for c in wanted if c.name in columns]
        if other := [n for n in names if len(columns[n]) != rows]:
            raise kr5.IoError(
                f"{where}: columns.{column_family(other[0])}: found {len(columns[other[0]])} rows beside {rows} times; "
                "streams of an "
                f"experiment of kind {experiment.entry.kind} need the same rows"
            )
        return kr5.io.Table(names, np.column_stack([columns[n] for n in names]))


NO_LOADS = np.zeros((0, 0))


def _with_loads(series: dict[str, Series]) -> tuple[Series, Series | None, bool]:
    """Positions, loads, and whether both stand in the same rows."""
    q, loads = series["q"], next((series[n] for n in ("tau", "i") if n in series), None)
    return q, loads, loads is not None and np.array_equal(loads.t, q.t)


def _smoothing_of(series: dict[str, Series], where: str) -> arm_log.Smoothing:
    q, loads, beside = _with_loads(series)
    if len(q.t) < LEAST_SMOOTHED:
        raise kr5.IoError(
            f"{where}: found {len(q.t)} rows of positions without a gap, expected at least {LEAST_SMOOTHED};"
            " log a longer motion, or at a higher rate"
        )
    try:
        return arm_log.choose_smoothing(q.t, q.values, loads.values if loads is not None and beside else NO_LOADS)
    except kr5.Error as error:
        raise kr5.IoError(
            f"{where}: found {len(q.t)} rows over {q.t[-1] - q.t[0]:.3g} s, which do not tell how fast the arm"
            f" moves ({error}); log at a higher rate, or a longer motion"
        ) from error


def contiguous(t: np.ndarray, experiment: Experiment, max_gap: float | None) -> slice:
    """Rows without a gap from those of the experiment: what a filter may use beyond its ends; t rises [s]."""
    begin, end = experiment.span()
    parts = arm_log.parts_without_gap(t, max_gap or 0.0)
    own = [(a, b) for a, b in parts if t[b - 1] >= begin and t[a] < end]
    return slice(own[0][0], own[-1][1]) if own else slice(None)


def _key(source: Source) -> str:
    """Where a map says what a family of columns comes from."""
    return f"columns.{column_family(source.members[0])}"


def import_recording(
    log: Path | None,
    map_file: Path,
    complete: Complete | None = None,
    shown: str | None = None,
    columns: str | None = None,
    episodes: str = "",
) -> tuple[Any, list[str], list[Any]]:
    """The recording, what was done to its numbers, and what speaks against them. `complete` may add to its cell what
    the log tells of it, before it is checked; it gets the readings of loads, too, as kr5.arm_log takes them. `shown`:
    what errors name in place of a map that no user wrote. `columns`: names of the columns of the log in their order,
    in place of the map's. `episodes`: those of the data set `log` of which each experiment of the map is made."""
    importer = Importer(load_map(map_file, shown), log)
    if episodes:
        importer.map.experiments = _of_episodes(importer.map.experiments, log, episodes)
    if columns:
        importer.map.header = names_in_order(columns)
    experiments = [importer.experiment(e) for e in importer.map.experiments]
    recording = kr5.cell.Recording(importer.cell, experiments)
    words = importer.map.words
    origins = importer.origins()
    found = [d for e, o in zip(experiments, origins) for d in check_positions(recording.cell, e, words, o)]
    if complete is not None and not found:
        complete(recording, importer.readings)
    found = found or [d for e, o in zip(experiments, origins) for d in check_loads(recording.cell, e, words, o)]
    return recording, importer.notes, merged_problems(found or _data_problems(recording, importer))


def _of_episodes(experiments: list[Experiment], log: Path | None, episodes: str) -> list[Experiment]:
    """The experiments of a map, once for each episode of a data set."""
    if log is None or any(e.entry.episode is not None or e.entry.log for e in experiments):
        raise kr5.InvalidArgument(
            "--episodes: only for a log beside a map whose experiments name neither log nor episode"
        )
    sources, _ = log_sources([log], episodes)
    return [
        replace(e, entry=e.entry.model_copy(update={"episode": s.episode, "name": f"{e.entry.name}-{s.episode}"}))
        for s in sources
        for e in experiments
    ]


def _data_problems(recording: kr5.cell.Recording, importer: Importer) -> list[LogProblem]:
    """What the check of recordings says of the tables; of the model, which the log does not contradict, it is noted."""
    found = []
    measured = {Path(e.file).stem: str(e.joint_reference) == "measured" for e in recording.experiments}
    for p in kr5.cell.check(recording):
        name, field = Path(p.file).stem, p.field or "table"
        if name not in measured:
            importer.note(f"the cell: {field}: found {p.found}, expected {p.expected}")
            continue
        if measured[name] and column_family(field) == "qc":  # what was measured stands for the commands
            field = "q" + field.removeprefix("qc")
        remedy = f"check columns.{column_family(field)}"
        if field == "t":
            even = importer.map.words.put("resample", every="SECONDS")
            remedy = f"{even} spaces rows evenly; the cycle stands in servo.cycle of the cell"
        found.append(LogProblem(name, field, p.found, p.expected, remedy))
    return found
