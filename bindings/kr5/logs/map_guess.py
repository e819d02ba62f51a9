"""A map proposed for logs: what each shows, its columns by their names, units by the size of their numbers, its clock,
and which parts of it are to fit and which to check."""

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

import kr5
import kr5.cell
from kr5 import arm_log, identification
from kr5.logs.clock_guess import GuessedClock, guess_clock, require_clock
from kr5.logs.column_names import Family, FoundFamilies, is_quantity, spoken_joints
from kr5.logs.episodes import LogSource, kept_to_check, log_sources, stated_ends
from kr5.logs.experiment_split import RawPart, split_parts
from kr5.logs.joint_columns import FARTHEST, joint_entry, joint_values, range_text
from kr5.logs.joint_streams import in_time, values_at
from kr5.logs.kind_guess import WRENCH_NAMES, LogPart, log_parts, stated_columns, wrench_columns
from kr5.logs.log import Log
from kr5.logs.log_file import read_log
from kr5.logs.log_time import command_cycle
from kr5.logs.map_file import names_of
from kr5.logs.overrides import GivenEntries
from kr5.logs.servo_gain import SERVO_GAIN, scale_gains
from kr5.logs.sparse_columns import aligned, covered, never_complete
from kr5.logs.two_arms import choices_text

LENGTHS = ("x", "y", "z", "zc", "cx", "cy")
LOADS = ("tau", "i")
LEAST_REST = 1.0  # from row to row of an arm that rests in each of them [s]


@dataclass
class GuessedMap:
    """The map, a reason for each of its parts, and what a person should know besides."""

    entry: dict[str, Any]
    reasons: list[list[str]] = field(default_factory=list)  # item, proposal, reason
    notes: list[str] = field(default_factory=list)
    logs_of: dict[tuple[str, str], list[str]] = field(default_factory=dict)  # of an item and its proposal
    unused_commands: bool = False  # logged beside positions, and not simulated for want of a servo

    def because(self, log: str, item: str, proposal: str, reason: str) -> None:
        """Adds a reason; logs that are read alike share one."""
        logs = self.logs_of.setdefault((item, proposal), [])
        if not logs:
            self.reasons.append([item, proposal, reason])
        if log not in logs:
            logs.append(log)

    def note(self, *texts: str) -> None:
        """Adds notes that are not there yet."""
        self.notes += [text for text in texts if text not in self.notes]

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
    files: Sequence[Path],
    cell: kr5.cell.Cell,
    cell_file: Path,
    output: Path | None = None,
    given: GivenEntries | None = None,
) -> GuessedMap:
    """A map of the logs of one cell; `given`: what of it the user states."""
    out = GuessedMap({"format": "kr5-map/1", "cell": _beside(cell_file, output)})
    given = given or GivenEntries()
    parts: list[tuple[RawPart, dict[str, Any], GuessedClock | None]] = []
    sources, notes = log_sources(files, given.episodes)
    out.note(*notes)
    of_parts: list[LogSource] = []
    logs: list[Log] = []  # of the parts
    for source in sources:
        log, of_log = _read_parts(source, cell, given)
        out.note(*log.notes)
        for part in of_log:
            parts.append(_read_part(part, cell, given, out, source.name))
            of_parts.append(source)
            logs.append(log)
    if not parts:
        raise kr5.InvalidArgument("no log: expected at least one")
    for (raw, _, _), kept, end in zip(
        parts, kept_to_check(of_parts, given.check), stated_ends(of_parts, given.ends), strict=True
    ):
        raw.kept_to_check, raw.end = kept, end
        _report_end(raw, out)
    entries = split_parts([raw for raw, _, _ in parts], out.reasons)
    out.note(*scale_gains([(log, columns) for log, (_, columns, _) in zip(logs, parts, strict=True)], entries[0][0]))
    episodes = [{} if s.episode is None else {"episode": s.episode} for s in of_parts]
    if len(parts) == 1:
        _, columns, clock = parts[0]
        out.entry |= ({"clock": clock.entry} if clock and clock.entry else {}) | {"columns": columns}
        out.entry["experiments"] = [entry | episodes[0] for _, entry in entries]
    else:
        out.entry["columns"] = {}
        several = len(files) > 1
        out.entry["experiments"] = [
            entry
            | ({"log": _beside(of_parts[index].file, output)} if several else {})
            | episodes[index]
            | _own_entries(parts[index])
            for index, entry in entries
        ]
    return out


def _report_end(raw: RawPart, out: GuessedMap) -> None:
    """Says that a log is used up to a time, which some of its rows must be before."""
    if not np.isfinite(raw.end):
        return
    if raw.motion is None:
        raise kr5.InvalidArgument(f"--set end: {raw.name} is of kind {raw.kind}, which has no end; leave it out")
    t = np.asarray(raw.motion.t)
    if not raw.end > t[0]:
        raise kr5.InvalidArgument(
            f"--set end: found {raw.end:g} s, before the first row of {raw.name}; it goes from {t[0]:.4g} to"
            f" {t[-1]:.4g} s"
        )
    out.because(raw.name, "end", f"{raw.end:g} s", "as stated")


def _own_entries(part: tuple[RawPart, dict[str, Any], GuessedClock | None]) -> dict[str, Any]:
    """Clock and columns of one experiment among others."""
    _, columns, clock = part
    own: dict[str, Any] = {}
    if clock and clock.entry:
        own["clock"] = clock.entry
    return own | {"columns": columns}


def _beside(file: Path, output: Path | None) -> str:
    return str(file.absolute()) if output is None else os.path.relpath(file, output.parent)


def _read_parts(source: LogSource, cell: kr5.cell.Cell, given: GivenEntries) -> tuple[Log, list[LogPart]]:
    """A log and what it shows. Rows in which the motors are off stay, where commands move the arm by torque servos."""

    def read(keeps_off: bool) -> tuple[Log, list[LogPart]]:
        log = read_log(source.file, given.header, given.words, episode=source.episode, keeps_off=keeps_off)
        return log, _parts_of(log, cell, given)

    log, parts = read(cell.has_torque_servos and given.columns.get("qc", {}).get("from") != "measured")
    if SERVO_GAIN in log.columns and any(p.kind != "motion" or p.families.first("qc") is None for p in parts):
        return read(False)
    return log, parts


def _parts_of(log: Log, cell: kr5.cell.Cell, given: GivenEntries) -> list[LogPart]:
    names, number = list(cell.robot.joint_names), cell.robot.joints
    parts, families = log_parts(log, names, number, stated_columns(given, number))
    if not parts:
        _refuse_unknown(log, families, names, number, given)
    return parts


def _refuse_unknown(log: Log, families: FoundFamilies, names: list[str], number: int, given: GivenEntries) -> None:
    for name, entry in given.columns.items():  # one that is not there may be misspelt
        for column in names_of(entry["from"], number, f"columns.{name}") if entry.get("from") else ():
            if column != "measured":
                log.column(column, f"columns.{name}.from")
    shown = ", ".join(list(log.columns)[:12]) + (" ..." if len(log.columns) > 12 else "")
    topics, published = _published(log)
    if topics and not published:
        raise kr5.FileError(
            log.file,
            f"found no joint states in its topics {', '.join(topics[:12])}; record /joint_states, or name"
            " the columns of the positions in a map, see kr5 recording import --help",
        )
    if not log.columns and log.text_columns:
        raise kr5.IoError(log.unreadable(next(iter(log.text_columns))))
    for quantity, what in (("q", "positions"), ("qc", "commands")):
        _refuse_lacking(log, families, quantity, what, given)
    if choices := choices_text(log, families, number, given.words):
        sizes = ", ".join(f"{stem} has {size}" for stem, size in families.vectors.items())
        raise kr5.FileError(log.file, f"found no vector of {number} joint positions ({sizes}); {choices}")
    told = [w for w in families.joint_words if re.search(r"[A-Za-z]", w) and not is_quantity(w)]
    words = (published or spoken_joints(list(log.columns)) or told)[:number]
    expected = f"; the model names {', '.join(names)}" if names else ""
    q, tau = (given.words.put(f"columns.{name}", **{"from": "[...]"}) for name in ("q", "tau"))
    if names and words:
        raise kr5.FileError(
            log.file,
            f"the log names joints such as {', '.join(words)}{expected}: is this the model of the robot in"
            f" the log? Choose another model, or name its columns: {q}, and those of the efforts: {tau}",
        )
    what = "column of the position of the joint" if number == 1 else f"{number} columns of joint positions"
    how = "by its name" if number == 1 else "by their names or counted (q1, pos_1, ...)"
    if families.vectors:
        shown += f" (vectors: {', '.join(f'{stem} has {size}' for stem, size in families.vectors.items())})"
    raise kr5.FileError(
        log.file,
        f"found no {what}, {how}, among {shown}{expected}; name {'it' if number == 1 else 'them'}: {q}, or"
        " write a map, see kr5 recording import --help",
    )


def _refuse_lacking(log: Log, families: FoundFamilies, quantity: str, what: str, given: GivenEntries) -> None:
    """Ends where some joints of the model have a column of a quantity and others have none."""
    if not (lacking := families.lacking_of(quantity)):
        return
    raise kr5.FileError(
        log.file,
        f"found {what} of some joints, but not of {', '.join(lacking)}; expected those of every joint of"
        " the model: log them, too, end the arm before them with --tip LINK, or name the columns of all joints:"
        f" {given.words.put(f'columns.{quantity}', **{'from': '[...]'})}",
    )


def _published(log: Log) -> tuple[list[str], list[str]]:
    """The topics of a bag, and the joints whose positions its messages name."""
    fields = [name.rpartition(":") for name in log.columns]
    topics = {topic for topic, colon, _ in fields if colon and topic.startswith("/")}
    joints = [field.removeprefix("position.") for _, _, field in fields if field.startswith("position.")]
    return sorted(topics), list(dict.fromkeys(joints))


def _read_part(
    part: LogPart, cell: kr5.cell.Cell, given: GivenEntries, out: GuessedMap, where: str
) -> tuple[RawPart, dict[str, Any], GuessedClock | None]:
    columns, clock = (
        _motion_columns(part, cell, given, out, where)
        if part.kind == "motion"
        else _kind_columns(part, cell, given, out, where)
    )
    out.note(*part.notes)
    return _raw_part(part, columns, given, cell, where), columns, clock


# Motions


def _motion_columns(
    part: LogPart, cell: kr5.cell.Cell, given: GivenEntries, out: GuessedMap, where: str
) -> tuple[dict[str, Any], GuessedClock]:
    log, found, columns = part.log, part.families, dict[str, Any]()
    q, qc = found.first("q"), found.first("qc")
    _refuse_two_publishers(log, q)
    loads = [f for name in LOADS if (f := found.first(name))]
    load = next((f for f in loads if "from" in given.columns.get(f.name, {})), loads[0] if loads else None)
    commands = given.columns.get("qc", {}).get("from")
    simulates = commands != "measured" and (commands is not None or _has_servos(cell))
    wrench = _filled(wrench_columns(log), log, out)
    if not any("from" in given.columns.get(name, {}) for name in LOADS):  # a column that is misspelt is named later
        _report_partial_loads(part, given, out, needed=not (loads or wrench or (simulates and qc and q)))
    load = _with_signs(load, simulates and qc is not None and q is not None, log, given, out)
    for family in [f for f in (qc if simulates else None, q, load) if f]:
        beside = {"q": qc, "qc": q}.get(family.name)
        _add_joints(columns, family, log, cell, given, out, where, beside)
    if "qc" in columns and SERVO_GAIN in log.columns:
        columns[SERVO_GAIN] = {"from": SERVO_GAIN, "unit": "-"}
    if "qc" not in columns:
        _use_measured(columns, part, cell, given, out, where)
    _note_others(found, columns, out, where)
    if wrench:
        columns["wrench"] = {"from": wrench, "unit": ["N", "N m"]}
        if not all(np.isfinite(log.columns[n]).all() for n in wrench):
            columns["wrench"]["missing"] = "interpolate"
        out.because(where, "wrench", ", ".join(wrench), "from the names; its unit, frame and sign must be checked")
    _keep_rows_of_readings(columns, load or q, log)
    first = next(
        f for f in (qc if "from" not in columns["qc"] or columns["qc"]["from"] != "measured" else None, q, qc) if f
    )
    column = first.columns[0]
    guessed = guess_clock(log, column, command_cycle(cell), given.clock)
    name = "q" if "q" in columns else "qc"
    _require_motion(log, joint_values(columns[name], name, log, cell), guessed)
    clock = require_clock(guessed, column, log, given.words)
    out.because(where, "clock", clock.proposal, clock.reason)
    return columns, clock


def _require_motion(log: Log, positions: np.ndarray, clock: GuessedClock | None) -> None:
    """Complains of rows that are no samples of a motion. positions: samples x joints [rad or m]."""
    if (rows := len(positions)) < 3:
        raise kr5.FileError(
            log.file, f"found {rows} {'row' if rows == 1 else 'rows'}, expected a motion of at least three"
        )
    known = positions[np.isfinite(positions).all(axis=1)]
    stamped = clock is not None and "every" not in (clock.entry or {})
    steps = np.diff(clock.seconds) if clock is not None and stamped else np.zeros(0)
    steps = steps[np.isfinite(steps)]
    if len(steps) > 0 and np.median(steps) < LEAST_REST:
        return
    if len(known) < 3 or not identification.are_postures(known, clock is not None):
        return
    jump = float(np.median(np.abs(np.diff(known, axis=0)).max(axis=1)))
    raise kr5.FileError(
        log.file,
        f"its rows are postures at rest, not samples of a motion: a joint jumps by {jump:.2g} rad or m from row to row;"
        " log a motion with its clock, or give postures with torques to `kr5 identify gravity ROBOT LOG`",
    )


def _with_signs(
    load: Family | None, dispensable: bool, log: Log, given: GivenEntries, out: GuessedMap
) -> Family | None:
    """Loads, unless they are sizes without a sign and others than the user names; then a log of commands needs none."""
    if load is None or not dispensable or "from" in given.columns.get(load.name, {}):
        return load
    if not arm_log.magnitudes_only(log.stacked(load.columns)):
        return load
    out.note(f"{range_text(load.columns)} are not used: they never change their sign, as loads of joints do")
    return None


def _filled(columns: list[str], log: Log, out: GuessedMap) -> list[str]:
    """Columns of one sensor; none of them, with a note, where one has no number in any row."""
    if all(np.isfinite(log.columns[name]).any() for name in columns):
        return columns
    out.note(f"{log.file.name}: {range_text(columns)} are not used: found no number in any row")
    return []


def _report_partial_loads(part: LogPart, given: GivenEntries, out: GuessedMap, needed: bool) -> None:
    """Notes that loads of only some of the joints are not used; ends where nothing else can be compared."""
    for quantity, what in (("tau", "efforts"), ("i", "currents")):
        if needed:
            _refuse_lacking(part.log, part.families, quantity, what, given)
        elif lacking := part.families.lacking_of(quantity):
            names = ", ".join(lacking)
            out.note(f"{part.log.file.name}: {what} are not used, since those of {names} were not found")


def _refuse_two_publishers(log: Log, positions: Family | None) -> None:
    for name in positions.columns if positions else ():
        if arm_log.written_in_turn(np.asarray(log.columns[name])):
            raise kr5.FileError(
                log.file,
                f"{name} jumps to and fro from row to row: two publishers seem to take turns in this log;"
                " record it again with one of them, or export the topic of one alone",
            )


def _add_joints(
    columns: dict[str, Any],
    family: Family,
    log: Log,
    cell: kr5.cell.Cell,
    given: GivenEntries,
    out: GuessedMap,
    where: str,
    beside: Family | None = None,
) -> None:
    entry, proposal, why = joint_entry(family, log, cell, given, beside)
    columns[family.name] = entry
    if family.note:
        out.note(family.note)
    out.because(where, family.name, proposal, why)


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


def _use_measured(
    columns: dict[str, Any], part: LogPart, cell: kr5.cell.Cell, given: GivenEntries, out: GuessedMap, where: str
) -> None:
    """Measured positions for the motion, where no commands were logged, or none can be simulated."""
    q, qc = part.families.first("q"), part.families.first("qc")
    out.unused_commands |= q is not None and qc is not None and not _has_servos(cell)
    if given.columns.get("qc", {}).get("from") == "measured" and q is not None:
        why = "as stated"
    elif q is not None:
        why = (
            "the model states no servo of the joints (servo.joint, servo.torque), so that commands cannot be simulated"
            if qc
            else "no column looks like commands"
        )
    elif qc is not None:
        _add_joints(columns, replace(qc, name="q"), part.log, cell, given, out, where)
        why = (
            "only commands were logged and the model states no servo of the joints (servo.joint, servo.torque): they"
            " stand for what was measured"
        )
    else:
        raise kr5.FileError(
            part.log.file,
            "found efforts or currents of the joints and no positions; expected positions (q1, pos_1,"
            " position, ...), without which no motion can be simulated",
        )
    columns["qc"] = {"from": "measured", "unit": "rad"}
    used = "are taken for measured positions" if q is None else "not used; the measured positions drive the simulation"
    out.because(where, "commands", used, why)


def _note_others(found: FoundFamilies, columns: Mapping[str, object], out: GuessedMap, where: str) -> None:
    for name, families in found.families.items():
        unused = families[1:] if name in columns else families if name != "qd" else []
        for family in unused:
            out.note(f"{range_text(family.columns)} ({name}) {'is' if len(family.columns) == 1 else 'are'} not used")


# Other kinds


def _kind_columns(
    part: LogPart, cell: kr5.cell.Cell, given: GivenEntries, out: GuessedMap, where: str
) -> tuple[dict[str, Any], GuessedClock | None]:
    columns: dict[str, Any] = {}
    q = part.families.first("q")
    members = [f"q{k + 1}" for k in range(cell.robot.joints)]
    if q is not None and any(c.name == "q1" for c in kr5.cell.columns(kr5.cell.Kind(part.kind), cell.robot.joints)):
        _add_joints(columns, q, part.log, cell, given, out, where)
    wrench = [part.named[n] for n in WRENCH_NAMES if n in part.named]
    if len(wrench) == len(WRENCH_NAMES):
        columns["wrench"] = {"from": wrench, "unit": ["N", "N m"]}
    for name, column in part.named.items():
        if name != "t" and name not in members and column not in wrench:
            columns[name] = {"from": column, "unit": _value_unit(name, part.log.columns[column])}
    first = next(iter(part.named.values()))
    moving = part.kind in ("step", "press", "profile")
    cycle = command_cycle(cell) if moving else None
    clock = guess_clock(part.log, first, cycle, given.clock, arm_log.usual_row_step if moving else None)
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


def _raw_part(part: LogPart, columns: dict[str, Any], given: GivenEntries, cell: kr5.cell.Cell, where: str) -> RawPart:
    """What the split needs to know of a part: its times, its motion in SI, its runs."""
    log, rows = part.log, len(next(iter(part.log.columns.values())))
    run = kr5.cell.run_column(kr5.cell.Kind(part.kind))
    runs = log.columns[part.named[run]] if run in part.named else None
    if part.kind != "motion":
        return RawPart(part.kind, where, rows=rows, runs=runs)
    name = "q" if "q" in columns else "qc"
    family = part.families.first(name) or part.families.first("qc")
    assert family is not None, "a motion has positions"
    q = joint_values(columns[name], name, log, cell)
    column = family.columns[0]
    clock = require_clock(guess_clock(log, column, command_cycle(cell), given.clock), column, log, given.words)
    if len(clock.seconds) != len(q):
        raise kr5.FileError(
            log.file,
            f"{range_text(family.columns)}: found {len(q)} rows beside {len(clock.seconds)} of the clock"
            f" {clock.proposal}; choose one with a time for each row:"
            f" {given.words.put('clock', column='NAME')}",
        )
    t, q = aligned(clock.seconds, q) if never_complete(q) else (clock.seconds, q)
    others = [f for key in ("qc", *LOADS) if key in columns and (f := part.families.first(key)) and f is not family]
    others = [f for f in others if columns[f.name].get("from") != "measured"]
    known = np.isfinite(q).all(axis=1) & np.isfinite(t)
    known[known] = covered(t[known], [in_time(log, n, clock) for f in others for n in f.columns])
    if not known.any():
        named = f"{family.columns[0]} and {(others or [family])[0].columns[-1]}"
        raise kr5.FileError(
            log.file,
            f"the columns of the joints, {named} among them, have no numbers at the same time; expected"
            " positions and efforts of one motion: record them together",
        )
    t, first = np.unique(t[known], return_index=True)
    q = q[known][first]
    if not arm_log.joints_move(q):
        raise kr5.FileError(
            log.file,
            f"no joint moves: the farthest goes {np.ptp(q, axis=0).max():.2g} rad (m); an arm at"
            " rest shows gravity only, which many causes explain alike; log a motion of every joint, such as kr5"
            " identify excitation makes",
        )
    commanded = columns["qc"].get("from") != "measured"
    out = arm_log.LoggedMotion(t=t, q=q, commanded=commanded, stepwise=commanded and cell.has_torque_servos)
    stated = given.clock.get("max_gap")
    if isinstance(stated, (int, float)):  # the reader of maps refuses others
        out.max_gap = float(stated)
    if commanded and name == "q" and (own := part.families.first("qc")):
        commands = values_at(t, log, own, columns["qc"], cell, clock)
        if commands is not None:
            out.command = commands
    out.settle = arm_log.settle_time(cell, q[0])
    return RawPart("motion", where, motion=out)


def _has_servos(cell: kr5.cell.Cell) -> bool:
    """Whether commands can be simulated."""
    return cell.has_torque_servos or bool(cell.servo and cell.servo.joint)
