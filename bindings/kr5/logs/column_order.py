"""Entries of a map that name the columns of joints in another order."""

from collections.abc import Mapping, Sequence

import kr5.cell
from kr5 import arm_log
from kr5.arm_log import LogProblemKind
from kr5.logs.entry_words import EntryWords
from kr5.logs.map_file import Source, Tool, column_family


def rearranged(
    families: Sequence[str], joints: Sequence[int], words: EntryWords, sources: Mapping[str, Source | Tool]
) -> str:
    """Entries in which the columns of families stand in the order of the model. joints: that of each column, from 0."""
    puts = [
        words.put(f"columns.{family}", **{"from": _in_order(source.names, joints)})
        for family in families
        if isinstance(source := sources.get(family), Source) and source.names
    ]
    return (" " if words.by_option else ", ").join(puts)


def exchanged(
    problem: arm_log.LogProblem,
    others: Sequence[arm_log.LogProblem],
    cell: kr5.cell.Cell,
    words: EntryWords,
    sources: Mapping[str, Source | Tool],
) -> str:
    """Entries by which a joint follows its own command, or has its own load. others: what else speaks against the
    experiment."""
    number = cell.robot.joints
    if problem.kind != LogProblemKind.FollowsAnother:
        family = column_family(problem.columns[0])
        first, second = (int(column.removeprefix(family)) - 1 for column in problem.columns)
        return rearranged([family], _with(number, {first: second, second: first}), words, sources)
    joints = _followed(problem, others, number)
    of_positions = rearranged(["q"], joints, words, sources)
    of_commands = rearranged(["qc"], _inverse(joints), words, sources)
    if _named(sources.get("q"), cell) and not _named(sources.get("qc"), cell):
        return of_commands
    if _named(sources.get("qc"), cell):
        return of_positions
    return f"{of_positions}, or, where the positions are in the order of the model, {of_commands}"


def _followed(problem: arm_log.LogProblem, others: Sequence[arm_log.LogProblem], number: int) -> list[int]:
    """Whose command the position in each column follows: of all that were told, where that is an order; else of one
    pair of joints that are exchanged."""
    told = {p.joint: p.other for p in others if p.kind == LogProblemKind.FollowsAnother}
    every = _with(number, told)
    if sorted(every) == list(range(number)):
        return every
    return _with(number, {problem.joint: problem.other, problem.other: problem.joint})


def _with(number: int, other: Mapping[int, int]) -> list[int]:
    return [other.get(k, k) for k in range(number)]


def _inverse(joints: Sequence[int]) -> list[int]:
    return [joints.index(k) for k in range(len(joints))]


def _in_order(names: Sequence[str], joints: Sequence[int]) -> list[str]:
    return [names[k] for k in _inverse(joints)]


def _named(source: Source | Tool | None, cell: kr5.cell.Cell) -> bool:
    """Whether the columns of a family name the joints of the model."""
    joints = list(cell.robot.joint_names)
    return bool(
        isinstance(source, Source)
        and joints
        and all(joint.lower() in name.lower() for joint, name in zip(joints, source.names))
    )
