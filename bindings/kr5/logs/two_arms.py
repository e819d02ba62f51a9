"""Logs of two arms: vectors with the joints of both, one after the other, each with its gripper or without."""

from dataclasses import dataclass

from kr5 import arm_log
from kr5.logs.column_names import FoundFamilies, quantity_of_vector
from kr5.logs.entry_words import EntryWords
from kr5.logs.log import Log


@dataclass(frozen=True)
class ArmChoice:
    """The columns of the joints of one arm, of positions and commands."""

    which: str
    columns: dict[str, list[str]]  # of families


def choices_text(log: Log, found: FoundFamilies, number: int, words: EntryWords) -> str:
    """The entries that choose one arm of two, where vectors of a log have twice the numbers of an arm; else none."""
    choices = [choice for choice in _choices(log, found, number) if choice.columns]
    if not choices:
        return ""
    told = [
        f"of the {choice.which} with "
        + (" " if words.by_option else ", ").join(
            words.put(f"columns.{family}", **{"from": range_of(columns)}) for family, columns in choice.columns.items()
        )
        for choice in choices
    ]
    return f"two arms of {number} joints would have as many numbers: state the columns {', or '.join(told)}"


def range_of(columns: list[str]) -> str | list[str]:
    """Components that follow each other in one vector as `vector[7:13]`, the last left out; others as a list."""
    stem, bracket, first = columns[0].rpartition("[")
    begin = first.removesuffix("]")
    if not (bracket and first.endswith("]") and begin.isdecimal()):
        return columns
    end = int(begin) + len(columns)
    alike = columns == [f"{stem}[{k}]" for k in range(int(begin), end)]
    return f"{stem}[{begin}:{end}]" if alike else columns


def _choices(log: Log, found: FoundFamilies, number: int) -> list[ArmChoice]:
    first, second = ArmChoice("first arm", {}), ArmChoice("second arm", {})
    for stem, size in found.vectors.items():
        family = quantity_of_vector(stem)
        if family not in ("q", "qc") or size not in (2 * number, 2 * number + 2) or family in first.columns:
            continue
        columns = log.arrays[stem]
        for choice, half in ((first, columns[: size // 2]), (second, columns[size // 2 :])):
            choice.columns[family] = _joints(half, log, number)
    return [first, second]


def _joints(half: list[str], log: Log, number: int) -> list[str]:
    """Without the gripper: by its name, else the last."""
    named = [column for column in half if not arm_log.names_gripper(log.labels.get(column, ""))]
    return named if len(named) == number else half[:number]
