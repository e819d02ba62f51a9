"""What the columns of a log mean: format `kr5-map/1`, a YAML file written by hand or by `kr5 recording guess`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from . import common
from .recording_units import factor

FORMAT = "kr5-map/1"
WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
JOINT_FAMILIES = ("q", "qc", "i", "tau")
METHODS = ("linear", "cubic", "previous")

EXAMPLE = """\
format: kr5-map/1
cell: cell.yaml                     # beside this file
clock: {column: time, unit: ms}     # or {every: 0.004} for a log without a clock
columns:
  qc: {from: "cmd_{}", unit: deg}   # {} counts joints from 1, {0} from 0; or a list of names
  q: {from: "pos_{}", unit: deg}
  i: {from: "cur_{}", unit: mA}
  wrench: {from: [Fx, Fy, Fz, Mx, My, Mz], unit: [N, N m], frame: [0, 0, 0, 0, 0, 1.5708]}
resample: {every: 0.012, low_pass: 30}
experiments:
- {name: motion-1, kind: motion, split: fit, to: 20}
- {name: motion-2, kind: motion, split: check, from: 20}
"""

KEYS = """\
unit: rad deg mrad turn, m cm mm um, A mA, N kN mN, N m, N mm, mN m, s ms us ns
scale, offset: (number of the log * scale + offset) * unit; a number, or a list with one a joint
side: motor: of angles and torques on the motors, which the cell's structure matrix takes to the joints (tau from A, i from N m: by its torque constants)
frame: pose x y z roll pitch yaw of the sensor of the log in S; scale: -1 where the log has what the tool exerts
missing: interpolate or drop rows without a number; by default they are refused
log, clock: of columns in another file, or with a clock of their own: they are brought to the main one by resample.method
clock: column, unit, offset [s], every [s], repair: sort (rows out of order), max_gap [s]
resample: every [s], method: linear, cubic or previous, low_pass [Hz]
qc from: measured, where no commands were logged
tool, for kind poses: from (x, y, z and the rotation), position: mm, rotation: quaternion_xyzw, quaternion_wxyz, rotation_vector, rpy, kuka_abc or matrix, angle: deg, device: pose of the measuring device in B, mark: pose of the measured body in E
experiments: name, kind, split, from and to [s], log, columns of their own
header: names of the columns of a text file without them
"""


@dataclass
class Clock:
    column: str | None = None
    unit: str = "s"
    every: float | None = None
    offset: float = 0.0
    repair: str | None = None
    max_gap: float | None = None

    def seconds(self) -> float:
        return factor(self.unit, ("time",), "clock")[0]


@dataclass
class Source:
    """Where a family of columns comes from; lists have one value a member."""

    where: str
    members: list[str]
    names: list[str] | None = None
    value: list[float] | None = None
    measured: bool = False  # of commands: what was measured stands for them
    unit: list[str] = field(default_factory=list)
    scale: list[float] = field(default_factory=list)
    offset: list[float] = field(default_factory=list)
    side: str = "joint"
    frame: list[float] | None = None
    log: str | None = None
    clock: Clock | None = None
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
class Map:
    file: Path
    cell: Path
    joints: int
    clock: Clock | None
    columns: dict[str, Any]
    resample: dict[str, Any]
    experiments: list[dict[str, Any]]
    header: list[str] | None = None

    def fail(self, text: str) -> None:
        common.fail(f"{self.file}: {text}")


def load(file: Path) -> Map:
    """Reads a map and checks its form; complains with field, what was found and what was expected."""
    try:
        data = yaml.safe_load(file.read_text(encoding="utf-8"))
    except yaml.YAMLError as error:
        common.fail(f"{file}: is no YAML ({' '.join(str(error).split())})")
    where = str(file)
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        common.fail(f"{file}: format: found {data.get('format') if isinstance(data, dict) else data!r}, expected {FORMAT}")
    _keys(data, ("format", "cell", "clock", "columns", "resample", "experiments", "header"), where)
    for key, kind in (("cell", str), ("columns", dict), ("experiments", list)):
        if not isinstance(data.get(key), kind) or not data[key]:
            common.fail(f"{file}: {key}: found {data.get(key)!r}, expected {_WANTED[key]}")
    cell = file.parent / data["cell"]
    import kr5.cell

    joints = kr5.cell.load_cell(cell).robot.joints
    clock = read_clock(data["clock"], f"{file}: clock") if "clock" in data else None
    out = Map(file, cell, joints, clock, data["columns"], _resample(data.get("resample", {}), f"{file}: resample"), [],
              data.get("header"))
    out.experiments = [_experiment(out, e, i) for i, e in enumerate(data["experiments"])]
    names = [e["name"] for e in out.experiments]
    if len(set(names)) < len(names):
        out.fail("experiments: two have the same name")
    return out


_WANTED = {"cell": "the cell file, such as cell.yaml", "columns": "what each family of columns comes from, such as "
           "q: {from: \"pos_{}\", unit: deg}", "experiments": "a list such as [{name: motion-1, kind: motion, split: fit}]"}


def _keys(data: Any, known: tuple[str, ...], where: str) -> None:
    if not isinstance(data, dict):
        common.fail(f"{where}: found {data!r}, expected keys and values: {', '.join(known)}")
    for key in data:
        if key not in known:
            import difflib

            near = difflib.get_close_matches(str(key), known, 1, 0.6)
            common.fail(f"{where}: found the unknown key '{key}', expected {f'{near[0]!r}' if near else ', '.join(known)}")


def read_clock(data: Any, where: str) -> Clock:
    _keys(data, ("column", "unit", "every", "offset", "repair", "max_gap"), where)
    out = Clock(**data)
    if (out.column is None) == (out.every is None):
        common.fail(f"{where}: expected either column: NAME (and its unit), or every: SECONDS for a log without a clock")
    if out.repair not in (None, "sort"):
        common.fail(f"{where}: repair: found {out.repair!r}, expected sort")
    for key in ("every", "max_gap"):
        if getattr(out, key) is not None and not (isinstance(getattr(out, key), (int, float)) and getattr(out, key) > 0):
            common.fail(f"{where}: {key}: found {getattr(out, key)!r}, expected a positive number [s]")
    factor(out.unit, ("time",), where)
    return out


def _resample(data: Any, where: str) -> dict[str, Any]:
    _keys(data, ("every", "method", "low_pass"), where)
    if data.get("method", "linear") not in METHODS:
        common.fail(f"{where}: method: found {data['method']!r}, expected one of {', '.join(METHODS)}")
    for key in ("every", "low_pass"):
        if key in data and not (isinstance(data[key], (int, float)) and data[key] > 0):
            common.fail(f"{where}: {key}: found {data[key]!r}, expected a positive number [{'s' if key == 'every' else 'Hz'}]")
    return data


def _experiment(map: Map, data: Any, index: int) -> dict[str, Any]:
    import kr5.cell

    where = f"{map.file}: experiments[{index}]"
    _keys(data, ("name", "kind", "split", "from", "to", "log", "columns"), where)
    kinds = ("motion", "poses", "views", "scan", "step", "press", "profile")
    if not isinstance(data.get("name"), str) or data.get("kind") not in kinds or data.get("split") not in ("fit", "check"):
        common.fail(f"{where}: found name {data.get('name')!r}, kind {data.get('kind')!r}, split {data.get('split')!r}; expected a "
                    f"name, one of {', '.join(kinds)}, and fit or check")
    for key in ("from", "to"):
        if key in data and not isinstance(data[key], (int, float)):
            common.fail(f"{where}: {key}: found {data[key]!r}, expected seconds since the beginning of the log")
    columns = kr5.cell.columns(data["kind"], map.joints)
    families = [f for f in dict.fromkeys(family(c.name) for c in columns) if f != "t"] + (["tool"] if data["kind"] == "poses" else [])
    given = data.get("columns", {})
    _keys(given, tuple(families), f"{where}.columns")
    _keys(map.columns, ALL_FAMILIES, f"{map.file}: columns")
    sources = {}
    for name in families:
        if name in given or name in map.columns:
            at = f"{where}.columns.{name}" if name in given else f"{map.file}: columns.{name}"
            members = [c.name for c in columns if family(c.name) == name]
            sources[name] = read_source(given.get(name, map.columns.get(name)), name, members, at)
    return {**data, "sources": sources}


def family(column: str) -> str:
    """`q` of q3, `wrench` of fx; other columns stand alone."""
    if column in WRENCH:
        return "wrench"
    stem = column.rstrip("0123456789")
    return stem if stem in JOINT_FAMILIES and stem != column else column


ALL_FAMILIES = (*JOINT_FAMILIES, "wrench", "tool", "pose", "view", "line", "run", "marker", "corner", "u", "v", "speed", "x", "y",
                "z", "qw", "qx", "qy", "qz", "sphere", "zc", "tilt", "alpha", "cx", "cy", "fc")


def read_source(data: Any, name: str, members: list[str], where: str) -> Any:
    if isinstance(data, str):
        data = {"from": data}
    if name == "tool":
        return _read_tool(data, where)
    _keys(data, ("from", "value", "unit", "scale", "offset", "side", "frame", "log", "clock", "missing"), where)
    if ("from" in data) == ("value" in data):
        common.fail(f"{where}: expected either from: the column of the log, or value: a number that holds throughout")
    n = len(members)
    out = Source(where, members)
    if data.get("from") == "measured" and name == "qc":
        out.measured = True
    elif "from" in data:
        out.names = names_of(data["from"], n, where)
    else:
        out.value = _numbers(data["value"], n, where, "value")
    out.unit = _units(data.get("unit"), n, where, name)
    out.scale, out.offset = _numbers(data.get("scale", 1.0), n, where, "scale"), _numbers(data.get("offset", 0.0), n, where, "offset")
    out.side, out.missing, out.log = data.get("side", "joint"), data.get("missing", "fail"), data.get("log")
    for key, words in (("side", ("joint", "motor")), ("missing", ("fail", "interpolate", "drop"))):
        if getattr(out, key) not in words:
            common.fail(f"{where}: {key}: found {getattr(out, key)!r}, expected {' or '.join(words)}")
    if "frame" in data:
        out.frame = _six(data["frame"], where, "frame")
    if "clock" in data:
        out.clock = read_clock(data["clock"], f"{where}.clock")
    return out


def _read_tool(data: Any, where: str) -> Tool:
    _keys(data, ("from", "position", "rotation", "angle", "device", "mark"), where)
    if not isinstance(data.get("from"), list):
        common.fail(f"{where}: from: found {data.get('from')!r}, expected a list of columns: x, y, z and those of the rotation")
    out = Tool(where, [str(n) for n in data["from"]], **{k: data[k] for k in ("position", "rotation", "angle") if k in data})
    for key in ("device", "mark"):
        if key in data:
            setattr(out, key, _six(data[key], where, key))
    return out


def names_of(given: Any, n: int, where: str) -> list[str]:
    """Columns of the log, one a member: a list, a pattern with {} (or {0}) to count, or one name for one member."""
    if isinstance(given, list):
        names = [str(g) for g in given]
    elif n == 1 and "{" not in str(given):
        names = [str(given)]
    else:
        first = 0 if "{0}" in str(given) else 1
        mark = next((m for m in ("{0}", "{1}", "{}") if m in str(given)), None)
        if mark is None:
            common.fail(f"{where}: from: found '{given}', expected {n} names, or one with {{}} where the joint is counted")
        names = [str(given).replace(mark, str(first + i)) for i in range(n)]
    if len(names) != n:
        common.fail(f"{where}: from: found {len(names)} names, expected {n}")
    return names


def _units(given: Any, n: int, where: str, name: str) -> list[str]:
    if given is None:
        if name in ("pose", "view", "line", "run", "marker", "corner", "sphere", "qw", "qx", "qy", "qz"):
            return ["-"] * n
        common.fail(f"{where}: unit: is missing; expected the unit in the log, such as deg, rad, mm, A, mA, N m")
    if name == "wrench" and isinstance(given, list) and len(given) == 2:
        return [str(given[0])] * 3 + [str(given[1])] * 3
    units = [str(u) for u in given] if isinstance(given, list) else [str(given)] * n
    if len(units) != n:
        common.fail(f"{where}: unit: found {len(units)}, expected one, or {n}")
    return units


def _numbers(given: Any, n: int, where: str, key: str) -> list[float]:
    values = given if isinstance(given, list) else [given] * n
    if len(values) != n or not all(isinstance(v, (int, float)) and np.isfinite(v) for v in values):
        common.fail(f"{where}: {key}: found {given!r}, expected a number, or a list of {n}")
    return [float(v) for v in values]


def _six(given: Any, where: str, key: str) -> list[float]:
    if not isinstance(given, list) or len(given) != 6 or not all(isinstance(v, (int, float)) for v in given):
        common.fail(f"{where}: {key}: found {given!r}, expected a pose x y z roll pitch yaw [m, rad]")
    return [float(v) for v in given]
