"""The motion in a log of an arm, whatever its format: times, commands and measured positions in SI."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import kr5
import kr5.cell
import kr5.kinematics
from kr5 import arm_log
from kr5.logs.clock_guess import guess_clock, require_clock
from kr5.logs.column_list import header_entry
from kr5.logs.column_names import Family, FoundFamilies, find_families
from kr5.logs.entry_words import EntryWords
from kr5.logs.joint_columns import joint_entry, joint_values
from kr5.logs.joint_streams import values_at
from kr5.logs.kind_guess import families_of, stated_columns
from kr5.logs.log import Log
from kr5.logs.log_file import read_log
from kr5.logs.map_file import COMPONENTS
from kr5.logs.overrides import GivenEntries, given_entries, parse_overrides
from kr5.logs.servo_gain import SERVO_GAIN
from kr5.logs.two_arms import choices_text

MOST_JOINTS = 99


@dataclass(frozen=True)
class MotionLog:
    """Arrays have a row an instant and a column a joint."""

    times: np.ndarray  # from the beginning of the log [s]
    positions: np.ndarray  # measured [rad or m]
    commands: np.ndarray | None  # at the same times [rad or m]; None: none were logged
    servo_gain: np.ndarray | None  # at the same times, as the firmware counts it, 0: motors off; None: not logged
    names: list[str]  # of the joints
    units: dict[str, str | list[str]]  # of `positions` and `commands` in the log
    columns: dict[str, list[str]]  # of the log
    notes: list[str] = field(default_factory=list)


def read_motion_log(
    path: str | os.PathLike[str],
    cell: kr5.cell.Cell | None = None,
    *,
    episode: int | None = None,
    every: float | None = None,
    columns: str = "",
    settings: Sequence[str] = (),
) -> MotionLog:
    """Reads the motion of an arm from a log in any format (`kr5.logs.ENDINGS`, folders and data sets).

    cell: the arm, whose joints tell order, units and limits; without, the joints are those of the log. episode: which
    recording of a data set. every: interval of rows without a clock [s]. columns: their names in order, where a log
    has none or others. settings: entries of the map, such as "columns.q.unit=deg".

    Raises kr5.FileError where a file cannot be read or shows no positions of the joints, with the remedy.
    """
    of_map, _ = parse_overrides([*([header_entry(columns)] if columns else []), *settings])
    given = given_entries(of_map)
    if every is not None:
        given.clock = {"every": every}
    log = read_log(Path(path), given.header, given.words, episode=episode, keeps_off=True)
    number = cell.robot.joints if cell is not None else _stated_number(given) or _number_of_joints(log)
    joints = list(cell.robot.joint_names) if cell is not None else []
    families = families_of(log, joints, number, stated_columns(given, number))
    q, qc = families.first("q"), families.first("qc")
    if q is None:
        raise kr5.FileError(log.file, _lacking_text(log, families, number, given.words))
    arm = cell if cell is not None else _joints_alone(number)
    entry, _, _ = joint_entry(q, log, arm, given, qc)
    values = joint_values(entry, "q", log, arm)
    clock = require_clock(guess_clock(log, q.columns[0], None, given.clock), q.columns[0], log, given.words)
    known = np.isfinite(values).all(axis=1) & np.isfinite(clock.seconds)
    times, positions = clock.seconds[known], values[known]
    notes = [*log.notes, *([q.note] if q.note else [])]
    units, named, commands = {"positions": entry["unit"]}, {"positions": q.columns}, None
    if qc is not None:
        of_commands, _, _ = joint_entry(qc, log, arm, given, q)
        commands = values_at(times, log, qc, of_commands, arm, clock)
        units["commands"], named["commands"] = of_commands["unit"], qc.columns
        notes += [qc.note] if qc.note else []
    stamps = log.columns.get(SERVO_GAIN)
    gain = None if stamps is None or len(stamps) != len(known) else stamps[known]
    names = joints or [log.labels.get(column, f"joint{k + 1}") for k, column in enumerate(q.columns)]
    return MotionLog(times, positions, commands, gain, names, units, named, notes)


def _stated_number(given: GivenEntries) -> int | None:
    """Of joints whose columns are named one by one, or as components of a vector."""
    stated = given.columns.get("q", {}).get("from")
    if isinstance(stated, list):
        return len(stated)
    part = COMPONENTS.fullmatch(str(stated))
    return int(part[3]) - int(part[2]) if part else None


def _number_of_joints(log: Log) -> int:
    """Of a log without a model: the size that positions have, with commands of as many where there are any; of
    vectors without what is named as a gripper."""
    sizes = {
        len(columns) - sum(arm_log.names_gripper(log.labels.get(c, "")) for c in columns)
        for columns in log.arrays.values()
    }
    found = {n: find_families(log, [], n) for n in sorted(sizes or range(1, MOST_JOINTS), reverse=True) if n > 0}
    both = [n for n, families in found.items() if {"q", "qc"} <= families.families.keys() and _is_plain(families)]
    some = [n for n, families in found.items() if "q" in families.families and _is_plain(families)]
    if not (both or some):
        raise kr5.FileError(
            log.file,
            f"found no positions of joints among {', '.join(list(log.columns)[:12])}; state the arm, or name the"
            " columns in their order: columns='t,q{1-6},...'",
        )
    return (both or some)[0]


def _is_plain(families: FoundFamilies) -> bool:
    """Whether positions are read without a component taken for a gripper by its place alone."""
    first = families.first("q")
    return first is not None and not first.guessed_gripper


def _joints_alone(number: int) -> kr5.cell.Cell:
    """Joints that turn, of which nothing else is known."""
    robot = kr5.cell.Robot()
    robot.dh = [kr5.kinematics.DhJoint() for _ in range(number)]
    return kr5.cell.Cell(robot=robot)


def _lacking_text(log: Log, families: FoundFamilies, number: int, words: EntryWords) -> str:
    choices = choices_text(log, families, number, words)
    put = words.put("columns.q", **{"from": "[...]"})
    sizes = ", ".join(f"{stem} has {size}" for stem, size in families.vectors.items())
    return (
        f"found no positions of every joint among {', '.join(list(log.columns)[:12])}"
        + (f"; of its vectors, {sizes}" if sizes else "")
        + (f"; {choices}" if choices else f"; name their columns: {put}")
    )
