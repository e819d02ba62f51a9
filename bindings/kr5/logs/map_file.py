"""What the columns of a log mean: format `kr5-map/1`, a YAML file written by hand or by `kr5 recording guess`."""

import difflib
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, field_validator, model_validator

import kr5
from kr5.files.documents import (
    Document,
    Pose,
    PositiveNumber,
    check_names,
    fail_at,
    name_of_field,
    parse_yaml,
    read_text,
    validate_document,
)
from kr5.logs.entry_words import IN_MAP, EntryWords
from kr5.logs.servo_gain import SERVO_GAIN
from kr5.logs.units import unit_factor

WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
JOINT_FAMILIES = ("q", "qc", "i", "tau")
COMPONENTS = re.compile(r"(.+)\[(\d{1,6}):(\d{1,6})\]")  # of a vector, from the first up to and without the last
MOST_COMPONENTS = 10_000

EXAMPLE = """\
format: kr5-map/1
cell: cell.yaml                     # beside this file
clock: {column: time, unit: ms}     # or {every: 0.004} without a clock
columns:
  qc: {from: "cmd_{}", unit: deg}   # {} counts joints from 1, {0} from 0
  q: {from: "pos_{}", unit: deg}
  i: {from: "cur_{}", unit: mA}
  wrench:
    from: [Fx, Fy, Fz, Mx, My, Mz]  # a list of names
    unit: [N, N m]
    frame: [0, 0, 0, 0, 0, 1.5708]  # pose of the sensor of the log in S
resample: {every: 0.012, low_pass: 30}
experiments:
- {name: motion-1, kind: motion, split: fit, to: 20}
- {name: motion-2, kind: motion, split: check, from: 20}
"""


class Clock(Document):
    """Where the times of a log stand, or the interval between its rows."""

    column: str | None = Field(None, description="name of the column with the times")
    unit: str = Field("s", description="unit of the times: s, ms, us or ns")
    every: PositiveNumber | None = Field(None, description="interval of a log without a clock [s]")
    offset: float = Field(0.0, description="added to the times [s]")
    repair: Literal["sort"] | None = Field(None, description="what is done with rows out of order")
    max_gap: PositiveNumber | None = Field(None, description="longest gap between rows that is accepted [s]")

    @model_validator(mode="after")
    def _column_or_interval(self) -> "Clock":
        if (self.column is None) == (self.every is None):
            raise ValueError("either column: NAME (and its unit), or every: SECONDS for a log without a clock")
        return self

    def seconds(self) -> float:
        return unit_factor(self.unit, ("time",), "clock")[0]


class Resampling(Document):
    every: PositiveNumber | None = Field(None, description="interval of the rows of the recording [s]")
    method: Literal["linear", "cubic", "previous"] = Field(
        "linear", description="interpolation between rows of the log"
    )
    low_pass: PositiveNumber | None = Field(None, description="cut-off frequency of a filter without delay [Hz]")


class ExperimentEntry(Document):
    name: str = Field(min_length=1, description="name of the experiment")
    kind: Literal["motion", "poses", "views", "scan", "step", "press", "profile"] = Field(description="what was done")
    split: Literal["fit", "check"] = Field(description="use of the data: to estimate, or only to judge")
    begin: float | None = Field(None, alias="from", description="seconds since the beginning of the log")
    end: float | None = Field(None, alias="to", description="seconds since the beginning of the log")
    rows: list[int] | None = Field(None, min_length=2, max_length=2, description="first and last row, from 1")
    lead_in: float = Field(0.0, ge=0, description="time at the beginning that is simulated and not judged [s]")
    log: str | None = Field(None, description="file of its log, where it is not the main one")
    episode: int | None = Field(None, ge=0, description="number of its recording in a data set of several")
    clock: Clock | None = Field(None, description="clock of that log")
    columns: dict[str, Any] = Field({}, description="columns of its own, in place of those of the map")

    @field_validator("rows")
    @classmethod
    def _rising(cls, rows: list[int] | None) -> list[int] | None:
        if rows is not None and not 1 <= rows[0] <= rows[1]:
            raise ValueError(f"found {rows}, expected the first and the last row, from 1")
        return rows


class SourceEntry(Document):
    columns: str | list[str | int] | None = Field(None, alias="from", description="column of the log, or one each")
    value: float | list[float] | None = Field(None, description="number that holds throughout, in place of a column")
    unit: str | list[str] | None = Field(None, description="unit of the log, for all members or of each")
    scale: float | list[float] = Field(
        1.0, description="what 1 of the log is, for all members or of each; -1 turns a sign"
    )
    offset: float | list[float] = Field(0.0, description="added after scale, in the unit of the log")
    side: Literal["joint", "motor"] = Field("joint", description="side of the gears on which it was measured")
    frame: Pose | None = Field(None, description="pose of the sensor of the log in S [m, rad]")
    log: str | None = Field(None, description="file of these columns, where it is not the main log")
    clock: Clock | None = Field(None, description="clock of these columns, where they have one of their own")
    delay: float = Field(
        0.0, allow_inf_nan=False, description="time after the other columns at which they were logged [s]"
    )
    missing: Literal["fail", "interpolate", "drop"] = Field(
        "fail", description="what is done with rows without a number"
    )

    @model_validator(mode="after")
    def _column_or_value(self) -> "SourceEntry":
        if (self.columns is None) == (self.value is None):
            raise ValueError("either from: the column of the log, or value: a number that holds throughout")
        return self


class ToolEntry(Document):
    columns: list[str | int] = Field(alias="from", description="a list of columns: x, y, z and those of the rotation")
    position: str = Field("m", description="unit of x, y, z")
    rotation: str = Field("quaternion_xyzw", description="form of the rotation, as in dataset.yaml")
    angle: str = Field("rad", description="unit of angles: rad or deg")
    device: Pose = Field([0.0] * 6, description="pose of the measuring device in B [m, rad]")
    mark: Pose = Field([0.0] * 6, description="pose of the measured body in E [m, rad]")


class MapFile(Document):
    format: Literal["kr5-map/1"]
    cell: str = Field(min_length=1, description="the cell file, such as cell.yaml")
    clock: Clock | None = Field(None, description="where the times of the log stand")
    columns: dict[str, Any] = Field(
        description='what each family of columns comes from, such as q: {from: "pos_{}", unit: deg}'
    )
    resample: Resampling = Field(Resampling(), description="interval of the recording; without every, that of the log")
    experiments: list[ExperimentEntry] = Field(
        min_length=1, description="a list such as [{name: motion-1, kind: motion, split: fit}]"
    )
    header: list[str | int] | None = Field(None, description="names of the columns of a file without them")

    @field_validator("experiments")
    @classmethod
    def _names_differ(cls, experiments: list[ExperimentEntry]) -> list[ExperimentEntry]:
        check_names([e.name for e in experiments])
        return experiments

    @model_validator(mode="after")
    def _some_columns(self) -> "MapFile":
        if not self.columns and not all(e.columns for e in self.experiments):
            raise ValueError("columns: found none; expected those of all experiments here, or of each in its entry")
        return self


@dataclass
class Source:
    """Where a family of columns comes from; lists have one value a member."""

    where: str
    members: list[str]
    names: list[str] = field(default_factory=list)
    value: list[float] | None = None
    measured: bool = False  # of commands: what was measured stands for them
    unit: list[str] = field(default_factory=list)
    scale: list[float] = field(default_factory=list)
    offset: list[float] = field(default_factory=list)
    side: str = "joint"
    frame: list[float] | None = None
    log: str | None = None
    clock: Clock | None = None
    delay: float = 0.0
    missing: str = "fail"


@dataclass
class Tool:
    """Poses measured from outside: of a body carried by the tool, in the frame of the device that measures."""

    where: str
    names: list[str]
    position: str = "m"
    rotation: str = "quaternion_xyzw"
    angle: str = "rad"
    device: list[float] = field(default_factory=lambda: [0.0] * 6)
    mark: list[float] = field(default_factory=lambda: [0.0] * 6)


@dataclass
class Experiment:
    """An experiment of the map with the sources of its columns."""

    entry: ExperimentEntry
    sources: dict[str, Source | Tool]

    def span(self) -> tuple[float, float]:
        """Where it begins and ends in the log [s]."""
        begin, end = self.entry.begin, self.entry.end
        return (-math.inf if begin is None else begin, math.inf if end is None else end)


@dataclass
class Map:
    file: Path
    cell: Path
    joints: int
    clock: Clock | None
    resample: Resampling
    experiments: list[Experiment]
    header: list[str] | None = None
    shown: str = ""  # by which errors name it
    words: EntryWords = IN_MAP


EXPECTED = "a map of columns (kr5-map/1); `kr5 recording guess LOG --cell CELL -o MAP.yaml` proposes one"


def load_map(file: Path, shown: str | None = None) -> Map:
    """Reads a map and checks its form; ends with an error that names field, what was found and what was expected.
    `shown`: what errors name in place of a map that no user wrote, whose entries are given with --set."""
    import kr5.cell

    text, folder = read_text(file, EXPECTED), file.parent
    document = parse_yaml(text, file, EXPECTED)
    if shown is not None:
        file, text = Path(shown), ""
    entry = validate_document(document, MapFile, file, text)
    cell = folder / entry.cell
    joints = kr5.cell.load_cell(cell).robot.joints
    for clock in (entry.clock, *(e.clock for e in entry.experiments)):
        if clock:
            unit_factor(clock.unit, ("time",), f"{file}: clock")
    _check_families(entry.columns, ALL_FAMILIES, file, ("columns",), text)
    experiments = [_experiment(file, text, entry, index, joints) for index in range(len(entry.experiments))]
    header = None if entry.header is None else [str(name) for name in entry.header]
    words = EntryWords(by_option=shown is not None)
    return Map(folder / file.name, cell, joints, entry.clock, entry.resample, experiments, header, str(file), words)


def _check_families(
    given: Mapping[str, object], known: Sequence[str], file: Path, at: tuple[int | str, ...], text: str
) -> None:
    for name in given:
        if name not in known:
            near = difflib.get_close_matches(str(name), known, 1, 0.6)
            fail_at(file, at, f"unknown key '{name}', expected {near[0] if near else ', '.join(known)}", text)


def _experiment(file: Path, text: str, map: MapFile, index: int, joints: int) -> Experiment:
    import kr5.cell

    entry = map.experiments[index]
    at = ("experiments", index, "columns")
    columns = kr5.cell.columns(kr5.cell.Kind(entry.kind), joints)
    families = [f for f in dict.fromkeys(column_family(c.name) for c in columns) if f != "t"]
    families += ["tool"] if entry.kind == "poses" else []
    _check_families(entry.columns, families, file, at, text)
    sources = {}
    for name in families:
        own = name in entry.columns
        if own or name in map.columns:
            members = [c.name for c in columns if column_family(c.name) == name]
            place: tuple[int | str, ...] = (*at, name) if own else ("columns", name)
            data = entry.columns[name] if own else map.columns[name]
            sources[name] = read_source(data, name, members, file, place, text)
    return Experiment(entry, sources)


def column_family(column: str) -> str:
    """`q` of q3, `wrench` of fx; other columns stand alone."""
    if column in WRENCH:
        return "wrench"
    stem = column.rstrip("0123456789")
    return stem if stem in JOINT_FAMILIES and stem != column else column


ALL_FAMILIES = (
    *JOINT_FAMILIES,
    SERVO_GAIN,
    "wrench",
    "tool",
    "pose",
    "view",
    "line",
    "run",
    "marker",
    "corner",
    "u",
    "v",
    "speed",
    "x",
    "y",
    "z",
    "qw",
    "qx",
    "qy",
    "qz",
    "sphere",
    "zc",
    "tilt",
    "alpha",
    "cx",
    "cy",
    "fc",
)


def read_source(
    data: object, name: str, members: list[str], file: Path, at: tuple[int | str, ...], text: str
) -> Source | Tool:
    """Where a family of columns comes from; `at` is where the map says it."""
    where = f"{file}: {name_of_field(at)}"
    if name == "tool":
        tool = validate_document(data, ToolEntry, file, text, at)
        names = [str(column) for column in tool.columns]
        return Tool(where, names, tool.position, tool.rotation, tool.angle, tool.device, tool.mark)
    entry = validate_document({"from": data} if isinstance(data, str) else data, SourceEntry, file, text, at)
    n = len(members)
    measured = entry.columns == "measured" and name == "qc"
    if entry.clock:
        unit_factor(entry.clock.unit, ("time",), f"{where}.clock")
    return Source(
        where,
        members,
        names=[] if entry.columns is None or measured else names_of(entry.columns, n, where),
        value=None if entry.value is None else _numbers(entry.value, n, where, "value"),
        measured=measured,
        unit=_units(entry.unit, n, where, name),
        scale=_numbers(entry.scale, n, where, "scale"),
        offset=_numbers(entry.offset, n, where, "offset"),
        side=entry.side,
        frame=entry.frame,
        log=entry.log,
        clock=entry.clock,
        delay=entry.delay,
        missing=entry.missing,
    )


def names_of(given: object, n: int, where: str) -> list[str]:
    """Columns of the log, one a member: a list, a pattern with {} (or {0}) to count, components of a vector as
    `qpos[7:13]`, the last left out, or one name for one member."""
    if isinstance(given, list):
        names = [str(g) for g in given]
    elif part := COMPONENTS.fullmatch(str(given)):
        names = [f"{part[1]}[{k}]" for k in range(int(part[2]), min(int(part[3]), int(part[2]) + MOST_COMPONENTS))]
    elif n == 1 and "{" not in str(given):
        names = [str(given)]
    else:
        first = 0 if "{0}" in str(given) else 1
        mark = next((m for m in ("{0}", "{1}", "{}") if m in str(given)), None)
        if mark is None:
            raise kr5.IoError(
                f"{where}: from: found '{given}', expected {n} names, one with {{}} where the joint is counted, or"
                " components of a vector, such as qpos[0:6]"
            )
        names = [str(given).replace(mark, str(first + i)) for i in range(n)]
    if len(names) != n:
        raise kr5.IoError(f"{where}: from: found {len(names)} names, expected {n}")
    return names


def _units(given: object, n: int, where: str, name: str) -> list[str]:
    if given is None:
        if name in ("pose", "view", "line", "run", "marker", "corner", "sphere", "qw", "qx", "qy", "qz"):
            return ["-"] * n
        raise kr5.IoError(f"{where}: unit: is missing; expected the unit in the log, such as deg, rad, mm, A, mA, N m")
    if name == "wrench" and isinstance(given, list) and len(given) == 2:
        return [str(given[0])] * 3 + [str(given[1])] * 3
    units = [str(u) for u in given] if isinstance(given, list) else [str(given)] * n
    if len(units) != n:
        raise kr5.IoError(f"{where}: unit: found {len(units)}, expected one, or {n}")
    return units


def _numbers(given: float | list[float], n: int, where: str, key: str) -> list[float]:
    values = given if isinstance(given, list) else [given] * n
    if len(values) != n:
        raise kr5.IoError(f"{where}: {key}: found {given!r}, expected a number, or a list of {n}")
    return [float(v) for v in values]
