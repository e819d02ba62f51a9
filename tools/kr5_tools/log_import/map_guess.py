"""A map proposed for logs: what each shows, its columns by their names, units by the size of their numbers, its clock,
and which parts of it are to fit and which to check."""

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import kr5.cell
import numpy as np

from kr5_tools.cli import terminal
from kr5_tools.log_import.clock_guess import USUAL_STEP, GuessedClock, guess_clock, require_clock
from kr5_tools.log_import.column_names import Family, FoundFamilies
from kr5_tools.log_import.experiment_split import RawPart, split_parts
from kr5_tools.log_import.kind_guess import WRENCH_NAMES, LogPart, log_parts, wrench_columns
from kr5_tools.log_import.log import Log
from kr5_tools.log_import.log_file import read_log
from kr5_tools.log_import.map_file import names_of
from kr5_tools.log_import.rest_guess import joints_move
from kr5_tools.log_import.sparse_columns import aligned, covered, never_complete

LENGTHS = ("x", "y", "z", "zc", "cx", "cy")
FARTHEST = 20.0  # [m] a cell reaches, beyond which a length is in millimetres
LOADS = ("tau", "i")


@dataclass
class GuessedMap:
    """The map, a reason for each of its parts, and what a person should know besides."""

    entry: dict[str, Any]
    reasons: list[list[str]] = field(default_factory=list)  # item, proposal, reason
    notes: list[str] = field(default_factory=list)
    logs_of: dict[tuple[str, str], list[str]] = field(default_factory=dict)  # of an item and its proposal

    def because(self, log: str, item: str, proposal: str, reason: str) -> None:
        """Adds a reason; logs that are read alike share one."""
        logs = self.logs_of.setdefault((item, proposal), [])
        if not logs:
            self.reasons.append([item, proposal, reason])
        if log not in logs:
            logs.append(log)

    def told(self) -> list[list[str]]:
        """The reasons, with the logs where there are several."""
        every = {log for logs in self.logs_of.values() for log in logs}
        if len(every) < 2:
            return self.reasons
        out = []
        for item, proposal, reason in self.reasons:
            logs = self.logs_of.get((item, proposal), [])
            where = "" if not logs else f" of {logs[0]}" if len(logs) == 1 else f" of {len(logs)} logs"
            out.append([item + where, proposal, reason])
        return out


def guess_map(
    files: Sequence[Path], cell: Any, cell_file: Path, output: Path | None = None, every: float | None = None
) -> GuessedMap:
    """A map of the logs of one cell; `every`: interval of logs without a clock [s]."""
    out = GuessedMap({"format": "kr5-map/1", "cell": _beside(cell_file, output)})
    parts: list[tuple[RawPart, dict[str, Any], GuessedClock | None]] = []
    for file in files:
        log = read_log(file)
        parts += [_read_part(part, cell, every, out, file.name) for part in _parts_of(log, cell)]
    if not parts:
        terminal.fail("no log: expected at least one")
    entries = split_parts([raw for raw, _, _ in parts], out.reasons)
    if len(parts) == 1:
        _, columns, clock = parts[0]
        out.entry |= ({"clock": clock.entry} if clock and clock.entry else {}) | {"columns": columns}
        out.entry["experiments"] = [entry for _, entry in entries]
    else:
        out.entry["columns"] = {}
        out.entry["experiments"] = [entry | _own_entries(files, parts, index, output) for index, entry in entries]
    return out


def _own_entries(
    files: Sequence[Path],
    parts: list[tuple[RawPart, dict[str, Any], GuessedClock | None]],
    index: int,
    output: Path | None,
) -> dict[str, Any]:
    """Log, clock and columns of one experiment among others."""
    raw, columns, clock = parts[index]
    own: dict[str, Any] = {"log": _beside(raw.file, output)} if len(files) > 1 else {}
    if clock and clock.entry:
        own["clock"] = clock.entry
    return own | {"columns": columns}


def _beside(file: Path, output: Path | None) -> str:
    return str(file.absolute()) if output is None else os.path.relpath(file, output.parent)


def _parts_of(log: Log, cell: Any) -> list[LogPart]:
    names, number = list(cell.robot.joint_names), cell.robot.joints
    parts, families = log_parts(log, names, number)
    if not parts:
        _refuse_unknown(log, families, names, number)
    return parts


def _refuse_unknown(log: Log, families: FoundFamilies, names: list[str], number: int) -> None:
    shown = ", ".join(list(log.columns)[:12]) + (" ..." if len(log.columns) > 12 else "")
    words = [w for w in families.joint_words if re.search(r"[A-Za-z]", w)][:number]
    expected = f"; the model names {', '.join(names)}" if names else ""
    if names and words:
        terminal.fail(
            f"{log.file}: the log names joints such as {', '.join(words)}{expected}: is this the model of the robot in"
            " the log? Choose another model, or name its columns: --set columns.q.from=[...]"
        )
    terminal.fail(
        f"{log.file}: found no {number} columns of joint positions, by their names or counted (q1, pos_1, ...), among"
        f" {shown}{expected}; name them: --set columns.q.from=[...], or write a map, see kr5 recording import --help"
    )


def _read_part(
    part: LogPart, cell: Any, every: float | None, out: GuessedMap, where: str
) -> tuple[RawPart, dict[str, Any], GuessedClock | None]:
    columns, clock = (
        _motion_columns(part, cell, every, out, where)
        if part.kind == "motion"
        else _kind_columns(part, cell, every, out, where)
    )
    return _raw_part(part, columns, clock, cell), columns, clock


# Motions


def _motion_columns(
    part: LogPart, cell: Any, every: float | None, out: GuessedMap, where: str
) -> tuple[dict[str, Any], GuessedClock]:
    log, found, columns = part.log, part.families, dict[str, Any]()
    q, qc = found.first("q"), found.first("qc")
    load = next((f for name in LOADS if (f := found.first(name))), None)
    servo = bool(cell.servo and cell.servo.joint)
    for family in [f for f in (qc if servo else None, q, load) if f]:
        columns[family.name] = _joint_entry(family, log, cell, out, where)
    if "qc" not in columns:
        _use_measured(columns, q, qc, log, cell, servo, out, where)
    _note_others(found, columns, out, where)
    wrench = wrench_columns(log)
    if wrench:
        columns["wrench"] = {"from": wrench, "unit": ["N", "N m"]}
        if not all(np.isfinite(log.columns[n]).all() for n in wrench):
            columns["wrench"]["missing"] = "interpolate"
        out.because(where, "wrench", ", ".join(wrench), "from the names; its unit, frame and sign must be checked")
    _keep_rows_of_readings(columns, load or q, log)
    first = next(f for f in (qc, q, load) if f)
    cycle = cell.servo.cycle if cell.servo else None
    clock = require_clock(guess_clock(log, first.columns[0], cycle, every), log)
    out.because(where, "clock", clock.proposal, clock.reason)
    return columns, clock


def _joint_entry(family: Family, log: Log, cell: Any, out: GuessedMap, where: str) -> dict[str, Any]:
    values = _values(family, log)
    empty = [name for name, column in zip(family.columns, values.T) if not np.isfinite(column).any()]
    if empty:
        terminal.fail(
            f"{log.file}: {empty[0] if len(empty) == 1 else f'{empty[0]} to {empty[-1]}'}: found no number in any row,"
            " expected"
            f" {'positions' if family.name in ('q', 'qc') else 'efforts'} of the joints; is the publisher asked to fill"
            " them in?"
        )
    unit, why = _joint_unit(family, values, log, cell)
    entry: dict[str, Any] = {"from": _pattern(family.columns), "unit": unit}
    if family.motor_side:
        entry["side"] = "motor"
        why += "; on the motor side, by the name"
    if not np.isfinite(values).all():
        entry["missing"] = "drop" if family.name in ("q", "qc") and not never_complete(values) else "interpolate"
    names = list(cell.robot.joint_names)
    how = "by the names of the joints" if family.named and names else "counted"
    shown = unit if isinstance(unit, str) else "/".join(dict.fromkeys(unit))
    out.because(where, family.name, f"{family.columns[0]} to {family.columns[-1]} [{shown}]", f"{how}; {why}")
    return entry


def _keep_rows_of_readings(columns: dict[str, Any], readings: Family | None, log: Log) -> None:
    """Where commands stand in rows of their own, everything is brought to the rows of the readings, whose noise stays
    as it is."""
    if "missing" not in columns["qc"] or readings is None:
        return
    for entry in columns.values():
        if "missing" in entry:
            entry["missing"] = "interpolate"
    entry = columns[readings.name]
    if "missing" in entry and not never_complete(_values(readings, log)):
        entry["missing"] = "drop"


def _values(family: Family, log: Log) -> np.ndarray:
    return np.column_stack([log.columns[n] for n in family.columns])


def _joint_unit(family: Family, values: np.ndarray, log: Log, cell: Any) -> tuple[str | list[str], str]:
    """Unit of the columns, from their name or the size of their numbers."""
    if family.unit == "%":
        terminal.fail(
            f"{log.file}: {family.columns[0]} to {family.columns[-1]}: found per cent of a rated value, expected"
            " N m, N or A; state what 100 % is for each joint: --set 'columns.tau.scale=[...]' with the rated torque"
            " over 100, and --set columns.tau.unit='N m'"
        )
    size = float(np.nanmax(np.abs(values)))
    why = f"values up to {size:.4g}"
    if family.name in ("q", "qc", "qd"):
        slides = [str(j.type) == "prismatic" for j in cell.robot.dh]
        turning = values[:, [not s for s in slides]]
        size = float(np.nanmax(np.abs(turning))) if turning.size else 0.0
        ratio = _gear_ratio(cell) if family.motor_side else 1.0
        unit = family.unit if family.unit in ("deg", "rad") else "deg" if size > 7 * ratio else "rad"
        length = "mm" if family.unit == "mm" or (any(slides) and _largest(values, slides) > FARTHEST) else "m"
        too_large = " are too large for radians" if unit == "deg" and family.unit is None else ""
        return (unit if not any(slides) else [length if s else unit for s in slides]), why + too_large
    if family.name == "i":
        return _stated(family, ("mA",), "mA" if size > 200 else "A", why, " are too large for A")
    if any(str(j.type) == "prismatic" for j in cell.robot.dh):
        return ["N" if str(j.type) == "prismatic" else "N m" for j in cell.robot.dh], why
    return _stated(family, ("N m", "N mm"), "N mm" if size > 5000 else "N m", why, " are too large for N m")


def _stated(family: Family, units: tuple[str, ...], guessed: str, why: str, too_large: str) -> tuple[str, str]:
    if family.unit in units:
        return str(family.unit), f"{why}; unit from the name"
    return guessed, why + (too_large if guessed in ("mA", "N mm") else "")


def _largest(values: np.ndarray, chosen: list[bool]) -> float:
    return float(np.nanmax(np.abs(values[:, chosen])))


def _gear_ratio(cell: Any) -> float:
    return float(np.abs(np.asarray(cell.drives.structure)).max()) if cell.drives else 100.0


def _use_measured(
    columns: dict[str, Any],
    q: Family | None,
    qc: Family | None,
    log: Log,
    cell: Any,
    servo: bool,
    out: GuessedMap,
    where: str,
) -> None:
    """Measured positions for the motion, where no commands were logged, or none can be simulated."""
    if q is None and qc is not None:
        columns["q"] = _joint_entry(
            Family("q", qc.columns, qc.stem, qc.unit, qc.motor_side, qc.named), log, cell, out, where
        )
        why = "only commands were logged and the model has no joint servo: they stand for what was measured"
    elif q is not None:
        why = (
            "the model has no joint servo, so that commands cannot be simulated"
            if qc
            else "no column looks like commands"
        )
    else:
        terminal.fail(
            f"{log.file}: found efforts or currents of the joints and no positions; expected positions (q1, pos_1,"
            " position, ...), without which no motion can be simulated"
        )
    columns["qc"] = {"from": "measured", "unit": "rad"}
    out.because(where, "qc", "measured", why)


def _note_others(found: FoundFamilies, columns: dict[str, Any], out: GuessedMap, where: str) -> None:
    for name, families in found.families.items():
        unused = families[1:] if name in columns else families if name != "qd" else []
        for family in unused:
            note = f"{family.columns[0]} to {family.columns[-1]} ({name}) are not used"
            if note not in out.notes:
                out.notes.append(note)


# Other kinds


def _kind_columns(
    part: LogPart, cell: Any, every: float | None, out: GuessedMap, where: str
) -> tuple[dict[str, Any], GuessedClock | None]:
    columns: dict[str, Any] = {}
    q = part.families.first("q")
    members = [f"q{k + 1}" for k in range(cell.robot.joints)]
    if q is not None and any(c.name == "q1" for c in kr5.cell.columns(kr5.cell.Kind(part.kind), cell.robot.joints)):
        columns["q"] = _joint_entry(q, part.log, cell, out, where)
    wrench = [part.named[n] for n in WRENCH_NAMES if n in part.named]
    if len(wrench) == len(WRENCH_NAMES):
        columns["wrench"] = {"from": wrench, "unit": ["N", "N m"]}
    for name, column in part.named.items():
        if name != "t" and name not in members and column not in wrench:
            columns[name] = {"from": column, "unit": _value_unit(name, part.log.columns[column])}
    first = next(iter(part.named.values()))
    moving = part.kind in ("step", "press", "profile")
    cycle = cell.servo.cycle if cell.servo and moving else None
    clock = guess_clock(part.log, first, cycle, every, USUAL_STEP if moving else None)
    shown = ", ".join(n for n in columns if n not in ("q", "wrench"))
    out.because(where, "kind", part.kind, f"it has the columns {shown}")
    return columns, clock


UNITLESS = ("pose", "view", "line", "run", "marker", "corner", "sphere", "qw", "qx", "qy", "qz")


def _value_unit(name: str, values: np.ndarray) -> str:
    size = float(np.nanmax(np.abs(values))) if np.isfinite(values).any() else 0.0
    if name in UNITLESS:
        return "-"
    if name in LENGTHS:
        return "mm" if size > FARTHEST else "m"
    if name in ("tilt", "alpha"):
        return "deg" if size > 7 else "rad"
    return {"u": "px", "v": "px", "speed": "m/s", "fc": "N"}[name]


# Experiments


def _raw_part(part: LogPart, columns: dict[str, Any], clock: GuessedClock | None, cell: Any) -> RawPart:
    """What the split needs to know of a part: its times, its motion in SI, its runs."""
    log, rows = part.log, len(next(iter(part.log.columns.values())))
    run = kr5.cell.run_column(kr5.cell.Kind(part.kind))
    runs = log.columns[part.named[run]] if run in part.named else None
    if part.kind != "motion":
        return RawPart(part.kind, log.file, np.arange(rows, dtype=float), runs=runs)
    assert clock is not None, "a motion has a clock"
    name = "q" if "q" in columns else "qc"
    source = columns[name]
    family = part.families.first(name) or part.families.first("qc")
    assert family is not None, "a motion has positions"
    t, q = _positions_in_time(log, family, clock)
    units = source["unit"] if isinstance(source["unit"], list) else [source["unit"]] * q.shape[1]
    q = q * [{"deg": np.pi / 180, "mm": 1e-3}.get(u, 1.0) for u in units]
    if source.get("side") == "motor" and cell.drives is not None:
        q = q @ np.linalg.inv(np.asarray(cell.drives.structure)).T
    others = [f for key in ("qc", *LOADS) if key in columns and (f := part.families.first(key)) and f is not family]
    others = [f for f in others if columns[f.name].get("from") != "measured"]
    known = np.isfinite(q).all(axis=1) & np.isfinite(t)
    known[known] = covered(t[known], [_in_time(log, n, clock) for f in others for n in f.columns])
    if not known.any():
        named = f"{family.columns[0]} and {(others or [family])[0].columns[-1]}"
        terminal.fail(
            f"{log.file}: the columns of the joints, {named} among them, have no"
            " numbers at the same time; expected positions and efforts of one motion: record them together"
        )
    if not joints_move(q[known]):
        terminal.fail(
            f"{log.file}: no joint moves: the farthest goes {np.ptp(q[known], axis=0).max():.2g} rad (m); an arm at"
            " rest shows gravity only, which many causes explain alike; log a motion of every joint, such as kr5"
            " identify excitation makes"
        )
    commanded = columns["qc"].get("from") != "measured"
    return RawPart("motion", log.file, t[known], q[known], commanded=commanded, settle=_settle_time(cell))


def _in_time(log: Log, column: str, clock: GuessedClock) -> tuple[np.ndarray, np.ndarray]:
    """A column with its times from the beginning of the log [s], which are those of its stream."""
    values = log.columns[column]
    own = log.clocks.get(log.streams[column])
    if own is not None:
        begin = min(float(np.min(log.columns[c])) for c in log.clocks.values())
        return log.columns[own] - begin, values
    return clock.seconds if len(clock.seconds) == len(values) else np.arange(len(values), dtype=float), values


def _positions_in_time(log: Log, family: Family, clock: GuessedClock) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and positions, rows x joints; joints that stand in rows of their own at the times of the first."""
    t, values = _in_time(log, family.columns[0], clock)[0], _values(family, log)
    return aligned(t, values) if never_complete(values) else (t, values)


def _settle_time(cell: Any) -> float:
    """Time after which a servo has forgotten how it began [s]."""
    if not (cell.servo and cell.servo.joint):
        return 0.0
    return float(max(8 / (s.damping_ratio * s.natural_frequency) + s.delay for s in cell.servo.joint))


def _pattern(names: list[str]) -> Any:
    """One name with {} where joints are counted, or the list."""
    match = re.findall(r"\d+", names[0])
    if match and match[-1] in ("0", "1"):
        at = names[0].rindex(match[-1])
        pattern = names[0][:at] + ("{}" if match[-1] == "1" else "{0}") + names[0][at + len(match[-1]) :]
        if names_of(pattern, len(names), "") == names:
            return pattern
    return names
