"""What kind of experiment a log, or one stream of a log with several topics, shows."""

import re
from dataclasses import dataclass, field

import kr5.cell
from kr5.logs.column_names import Family, FoundFamilies, find_families
from kr5.logs.log import Log
from kr5.logs.map_file import JOINT_FAMILIES, names_of
from kr5.logs.overrides import GivenEntries

# Columns that only this kind has, the most special kind first; joint columns are asked for beside these.
SIGNS: tuple[tuple[str, frozenset[str]], ...] = (
    ("profile", frozenset({"tilt", "alpha", "cx", "cy", "fc", "z"})),
    ("views", frozenset({"marker", "corner", "u", "v"})),
    ("scan", frozenset({"line", "speed", "x", "z"})),
    ("step", frozenset({"zc", "z"})),  # a press, where a wrench was logged
    ("poses", frozenset({"x", "y", "z"})),
)
WRENCH_NAMES = ("fx", "fy", "fz", "tx", "ty", "tz")
WRENCH = [re.compile(rf"(^|[^a-z])(?:{p})[_./]?{a}$") for p in ("f|force", "t|m|torque|moment") for a in "xyz"]
WITH_JOINTS = ("views", "scan", "poses", "motion")


@dataclass
class LogPart:
    """A log, or one of its streams, with what was recognised in it."""

    kind: str
    log: Log  # with the columns of the part alone
    named: dict[str, str] = field(default_factory=dict)  # column of the kind: column of the log
    families: FoundFamilies = field(default_factory=FoundFamilies)
    notes: list[str] = field(default_factory=list)


def log_parts(
    log: Log, joints: list[str], number: int, stated: dict[str, list[str]] | None = None
) -> tuple[list[LogPart], FoundFamilies]:
    """The parts of a log that show something, and the families of joints in the whole of it. `stated`: columns of
    families that the user names."""
    whole = families_of(log, joints, number, stated or {})
    parts, unused = [], []
    for stream in dict.fromkeys(log.streams.values()):
        own = _columns_of(log, stream)
        names = {name.split(":")[-1]: name for name in own.columns}
        families = families_of(own, joints, number, stated or {})
        kind = next((k for k, signs in SIGNS if signs <= names.keys() and _has_joints(k, families)), None)
        if kind == "poses" and any(name in families.families for name in ("tau", "i", "qc")):
            unused.append(f"{', '.join(names[k] for k in 'xyz')} are not used, since the log is one of a motion")
            kind = None
        wrench = wrench_columns(own)
        if kind == "step" and wrench:
            kind = "press"
        if kind:
            names |= dict(zip(WRENCH_NAMES, wrench))
            wanted = [c.name for c in kr5.cell.columns(kr5.cell.Kind(kind), number)]
            parts.append(LogPart(kind, own, {c: names[c] for c in wanted if c in names}, families))
    rest = [part.log.streams[next(iter(part.log.columns))] for part in parts]
    if any(log.streams[f.columns[0]] not in rest for f in whole.families.get("q", []) + whole.families.get("qc", [])):
        parts.insert(0, LogPart("motion", log, {}, whole, unused))
    return parts, whole


def stated_columns(given: GivenEntries, number: int) -> dict[str, list[str]]:
    """The columns of families of joints that the user names."""
    return {
        name: names_of(entry["from"], number, f"columns.{name}")
        for name, entry in given.columns.items()
        if name in JOINT_FAMILIES and entry.get("from") not in (None, "measured")
    }


def families_of(log: Log, joints: list[str], number: int, stated: dict[str, list[str]]) -> FoundFamilies:
    """The families by their names, those that the user names before them."""
    out = find_families(log, joints, number)
    for name, columns in stated.items():
        if all(column in log.columns for column in columns):
            out.families.setdefault(name, []).insert(0, Family(name, columns))
    return out


def wrench_columns(log: Log) -> list[str]:
    """The six columns of a wrist sensor, by their names; none where one of them is missing."""
    found = [n for pattern in WRENCH for n in [c for c in log.columns if pattern.search(c.lower())][:1]]
    return found if len(found) == len(WRENCH) else []


def _has_joints(kind: str, families: FoundFamilies) -> bool:
    return kind not in WITH_JOINTS or "q" in families.families


def _columns_of(log: Log, stream: str) -> Log:
    out = Log(log.file, lines=log.lines, text_columns=log.text_columns)
    for name, values in log.columns.items():
        if log.streams[name] == stream:
            out.add(name, values, stream)
    out.arrays = {stem: columns for stem, columns in log.arrays.items() if columns[0] in out.columns}
    out.labels, out.percent_likely = log.labels, log.percent_likely
    if stream in log.clocks:
        out.clocks[stream] = log.clocks[stream]
    return out
