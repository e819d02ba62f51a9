"""Which part of a large log is kept in memory: columns of joints and times before others, and no more rows than fit."""

from collections.abc import Sequence

from kr5.arm_log import names_time, words_of
from kr5.logs.column_names import is_quantity

MOST_NUMBERS = 16_000_000  # of a log that are kept, which are 128 MB; some of them are held four times
WIDEST = 256  # numbers of a vector; longer ones are images


def needed_columns(names: Sequence[str], widths: Sequence[int], rows: int) -> list[str]:
    """Of a log with so many numbers that not all are kept, the columns whose names tell a time or a quantity of
    joints; else all. widths: numbers of each a row."""
    if rows * sum(widths) <= MOST_NUMBERS:
        return list(names)
    return [name for name in names if names_time(name) or any(is_quantity(word) for word in words_of(name))]


def kept_rows(rows: int, width: int) -> int:
    """The first rows that are kept of a log with so many numbers a row."""
    return min(rows, MOST_NUMBERS // max(width, 1))


def cut_note(name: str, kept: int, rows: int) -> str:
    return f"{name} has {rows} rows, of which the first {kept} are read: cut it into parts to use the others"
