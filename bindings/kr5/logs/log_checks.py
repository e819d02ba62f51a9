"""What speaks against a map: numbers that make sense in another unit, on the other side of the gears, or in other
columns, with the entries of the map that correct it. What is wrong is found by kr5.arm_log."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

import kr5
import kr5.cell
from kr5 import arm_log
from kr5.arm_log import LogProblemKind, LogRemedy
from kr5.logs.column_order import exchanged, rearranged
from kr5.logs.entry_words import EntryWords
from kr5.logs.experiment_split import FIT_SHARE
from kr5.logs.joint_columns import range_text
from kr5.logs.map_file import Source, Tool, column_family
from kr5.logs.values import column_unit, of_motors

TIME_STEP = 0.01  # of the end of a log, as it is told [s]
THOUSANDTHS = {"A": "mA", "N": "mN", "N m": "N mm"}


@dataclass
class LogProblem:
    experiment: str
    column: str
    found: str
    expected: str
    remedy: str
    joint: str = ""  # of the column, as the model names it
    also: list[str] = field(default_factory=list)  # experiments with the same problem

    def text(self) -> str:
        what = f"{self.column} ({self.joint})" if self.joint else self.column
        more = f" (also in {', '.join(self.also)})" if self.also else ""
        return f"{self.experiment}: {what}: found {self.found}, expected {self.expected}; {self.remedy}{more}"


def merged_problems(problems: list[LogProblem]) -> list[LogProblem]:
    """Those that have one column and one remedy, told once."""
    out: dict[tuple[str, str], LogProblem] = {}
    for problem in problems:
        first = out.setdefault((problem.column, problem.remedy), problem)
        if first.experiment != problem.experiment and problem.experiment not in first.also:
            first.also.append(problem.experiment)
    return list(out.values())


@dataclass(frozen=True)
class Origin:
    """Where an experiment comes from."""

    sources: Mapping[str, Source | Tool]  # what the map says of its columns
    log: str = ""  # which of several logs and episodes, as an option names it
    shift: float = 0.0  # of its times against those of its log [s]
    problems: Sequence[arm_log.LogProblem] = ()  # all that were found at once


def check_positions(
    cell: kr5.cell.Cell, experiment: kr5.cell.Experiment, words: EntryWords, origin: Origin
) -> list[LogProblem]:
    """What speaks against the positions, the clock and the tool poses of an experiment; `words`: how a remedy names
    entries of its map."""
    found = arm_log.check_positions(cell, experiment)
    return [_told(p, cell, words, replace(origin, problems=found)) for p in found]


def check_loads(
    cell: kr5.cell.Cell, experiment: kr5.cell.Experiment, words: EntryWords, origin: Origin
) -> list[LogProblem]:
    """What speaks against the currents, torques and wrenches of a motion, whose positions are right."""
    return [_told(p, cell, words, origin) for p in arm_log.check_loads(cell, experiment)]


def _told(problem: arm_log.LogProblem, cell: kr5.cell.Cell, words: EntryWords, origin: Origin) -> LogProblem:
    """A problem in words, with the entries that correct it."""
    entries = _entries(problem, cell, words, origin)
    remedy = "" if problem.remedy in LENGTHS else problem.remedy_text(cell)  # which the entry says by itself
    return LogProblem(
        problem.experiment,
        problem.columns_text(),
        problem.found_text(cell),
        problem.expected_text(cell),
        _joined(remedy, entries),
        cell.robot.joint_names[problem.joint] if problem.joint >= 0 and cell.robot.joint_names else "",
    )


def _joined(remedy: str, entries: str) -> str:
    if not (remedy and entries):
        return remedy or entries
    return f"{remedy} {entries}" if remedy.endswith("?") else f"{remedy}: {entries}"


UNITS: dict[LogRemedy, dict[str, object]] = {
    LogRemedy.Degrees: {"unit": "deg"},
    LogRemedy.Radians: {"unit": "rad"},
    LogRemedy.MotorSide: {"side": "motor"},
    LogRemedy.DegreesOnMotorSide: {"unit": "deg", "side": "motor"},
    LogRemedy.Reverse: {"scale": -1},
    LogRemedy.Thousand: {"scale": 1000},
    LogRemedy.MotorTorques: {"unit": "N m", "side": "motor"},
    LogRemedy.JointTorques: {"unit": "N m"},
    LogRemedy.Currents: {"unit": "A"},
}
LENGTHS = {LogRemedy.PositionMetre: "m", LogRemedy.PositionCentimetre: "cm", LogRemedy.PositionMillimetre: "mm"}
CLOCKS = {LogRemedy.Milliseconds: "ms", LogRemedy.Microseconds: "us", LogRemedy.Nanoseconds: "ns"}


def _entries(problem: arm_log.LogProblem, cell: kr5.cell.Cell, words: EntryWords, origin: Origin) -> str:
    """The entries of the map that a remedy asks for, or the key that it speaks of; none where it asks for no single
    one."""
    columns, sources = list(problem.columns), origin.sources
    key, remedy = f"columns.{column_family(columns[0])}", problem.remedy
    if remedy in UNITS:
        return words.put(key, **UNITS[remedy])
    if remedy in LENGTHS:
        return words.put("columns.tool", position=LENGTHS[remedy])
    if remedy == LogRemedy.DeviceFrame:
        pose = kr5.to_xyzrpy(problem.T_base_device)
        return words.put("columns.tool", device=[float(f"{x:.5g}") for x in pose])
    if remedy in CLOCKS:
        return words.put("clock", unit=CLOCKS[remedy])
    if remedy == LogRemedy.ReverseSome:
        return words.put(key, scale=[-1 if c in columns else 1 for c in _channel_of(columns[0], cell)])
    if remedy == LogRemedy.Thousandth:
        unit = kr5.cell.find_column(kr5.cell.Kind.Motion, columns[0]).unit
        return words.put(key, unit=THOUSANDTHS[unit]) if column_family(columns[0]) in ("tau", "i") else ""
    if remedy == LogRemedy.PercentOfEffort:
        return words.put(key, scale=[float(f"{x / 100:.6g}") for x in cell.robot.limits.effort])
    if remedy == LogRemedy.UseMeasured:
        return words.put(key, **{"from": "measured"})
    if remedy == LogRemedy.ScaleCommands:
        return _scaling_entries(cell, problem, key, words, sources)
    if remedy == LogRemedy.CutLog:
        return words.end(_before(problem.found - origin.shift), origin.log, problem.experiment)
    if remedy == LogRemedy.Rearrange:
        return rearranged(columns, problem.reading.order, words, sources)
    if remedy == LogRemedy.Exchange:
        return exchanged(problem, origin.problems, cell, words, sources)
    if remedy == LogRemedy.Recount:
        return _convention_entries(cell, problem.reading, columns[1], words, sources)
    if problem.kind == LogProblemKind.FactorOfJoint:
        return words.put(key, scale="[...]")
    return key if problem.kind in (LogProblemKind.BeyondLimits, LogProblemKind.UnknownFactor) else ""


def _before(time: float) -> float:
    """A time of few digits [s] that is not later."""
    return math.floor(time / TIME_STEP) * TIME_STEP


def _scaling_entries(
    cell: kr5.cell.Cell, problem: arm_log.LogProblem, key: str, words: EntryWords, sources: Mapping[str, Any]
) -> str:
    """Entries that bring commands to the unit and zero of the positions."""
    source = sources["qc"]
    units = np.array([column_unit(cell, "qc", k, source) for k in range(cell.robot.joints)])
    factors, offsets = np.array(problem.factors), np.array(problem.offsets)
    scale = factors * np.array(source.scale)
    offset = factors * np.array(source.offset) + offsets / units
    rounded = {name: [float(f"{x:.4g}") for x in v] for name, v in (("scale", scale), ("offset", offset))}
    return words.put(key, **rounded)


def _channel_of(column: str, cell: kr5.cell.Cell) -> list[str]:
    """The columns of the quantity that one of them shows."""
    all_columns = kr5.cell.compared_columns(kr5.cell.Kind.Motion, cell.robot.joints)
    channel = next(c.channel for c in all_columns if c.name == column)
    return [c.name for c in all_columns if c.channel == channel]


def _convention_entries(
    cell: kr5.cell.Cell,
    reading: arm_log.JointReading,
    stem: str,
    words: EntryWords,
    sources: Mapping[str, Any],
) -> str:
    """Entries that count the joints as the model does. What was measured on the motors stays as it is: the gears join
    it to joints counted another way."""
    q, load, sign, zero = sources["q"], sources[stem], np.array(reading.sign), np.array(reading.zero)
    units = np.array([column_unit(cell, "q", k, q) for k in range(cell.robot.joints)])
    entries = []
    if of_motors(q) or of_motors(load):
        gear = np.asarray(cell.drives.structure)
        entries.append(("cell.drives", "structure", gear, gear * sign))
    of_q, zero = (1, gear * sign @ zero) if of_motors(q) else (sign, zero)
    of_load = 1 if of_motors(load) else sign
    entries += [
        ("columns.q", "scale", q.scale, of_q * np.array(q.scale)),
        ("columns.q", "offset", q.offset, of_q * np.array(q.offset) + zero / units),
        (f"columns.{stem}", "scale", load.scale, of_load * np.array(load.scale)),
        (f"columns.{stem}", "offset", load.offset, of_load * np.array(load.offset)),
    ]
    puts = [words.put(key, **{name: new.tolist()}) for key, name, old, new in entries if np.any(new != np.asarray(old))]
    return " ".join(puts) if words.by_option else ", ".join(puts)
