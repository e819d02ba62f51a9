"""Tables of numbers with units, for people."""

import dataclasses
from collections.abc import Iterable
from typing import Any

import numpy.typing as npt
from kr5.files.paths import shown_name
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, JustifyMethod, RenderResult
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from kr5_tools.cli.numbers import NONE, format_number

VERDICT_COLOURS = {"good": "green", "doubtful": "yellow", "unusable": "red"}


def figure_row(name: str, value: float, std: float | None, unit: str) -> dict[str, Any]:
    """One row of the table of numbers with uncertainty."""
    return {"name": name, "value": value, "std": std, "unit": unit}


def pose_figures(name: str, T: npt.ArrayLike, covariance: npt.ArrayLike) -> list[dict[str, Any]]:
    """Position [mm] and roll, pitch, yaw [deg] of a pose, with the deviations its covariance (right perturbation)
    gives."""
    import kr5
    import numpy as np

    centre, std = kr5.xyzrpy_with_std(T, covariance)
    axes = ("x", "y", "z", "roll", "pitch", "yaw")
    scale = [1e3] * 3 + [180 / np.pi] * 3
    units = ["mm"] * 3 + ["deg"] * 3
    return [figure_row(f"{name} {axes[i]}", centre[i] * scale[i], std[i] * scale[i], units[i]) for i in range(6)]


PADDING = 2  # spaces that a column takes beside its text
LEAST_TEXT = 20  # width to which a column of text is narrowed before the table is split
MOST_WORD = 36  # longest word that is not broken
LEAST_BROKEN = 6  # width of a column of text whose words are broken


@dataclasses.dataclass
class _Column:
    """A column with all its texts, its head first."""

    texts: list[str]
    is_text: bool

    @property
    def is_empty(self) -> bool:
        return len(self.texts) > 1 and all(text.strip() in ("", NONE) for text in self.texts[1:])

    @property
    def natural_width(self) -> int:
        return max(map(_text_width, self.texts))

    @property
    def min_width(self) -> int:
        """Below which numbers would be broken, or words."""
        if not self.is_text:
            return max(*map(_text_width, self.texts[1:]), _longest_word(self.texts[0]), 0)
        return max(min(self.natural_width, LEAST_TEXT), min(max(map(_longest_word, self.texts)), MOST_WORD))


def _text_width(text: str) -> int:
    return max(map(cell_len, text.split("\n")))


def _words(text: str) -> list[str]:
    """What is not broken: words, and units in brackets."""
    words: list[str] = []
    for word in text.split():
        if words and words[-1].startswith("[") and not words[-1].endswith("]"):
            words[-1] += f" {word}"
        else:
            words.append(word)
    return words


def _longest_word(text: str) -> int:
    return max(map(cell_len, _words(text)), default=0)


def _wrap_head(text: str, width: int) -> str:
    lines: list[str] = []
    for word in _words(text):
        if lines and cell_len(f"{lines[-1]} {word}") <= width:
            lines[-1] += f" {word}"
        else:
            lines.append(word)
    return "\n".join(lines)


class FittedTable:
    """A table that shows all its numbers in any width: heads and texts are wrapped, and what is still too wide is
    split into tables one below the other, each with the key columns, which are the first. Empty columns are left
    out."""

    def __init__(self, title: str, columns: list[_Column], keys: int = 1) -> None:
        self.title = title
        self.keys = columns[:keys]
        self.others = [column for column in columns[keys:] if not column.is_empty]

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        if self.title:
            yield Text(self.title, style="italic")
        for k, (columns, widths) in enumerate(self._parts(options.max_width)):
            if k:
                yield Text()
            yield _rich_table(columns, widths)

    def _parts(self, width: int) -> Iterable[tuple[list[_Column], list[int]]]:
        part = [*self.keys]
        for column in self.others:
            if len(part) > len(self.keys) and _min_total([*part, column]) > width:
                yield part, _widths(part, width)
                part = [*self.keys]
            part.append(column)
        yield part, _widths(part, width)


def _min_total(columns: list[_Column]) -> int:
    return sum(column.min_width + PADDING for column in columns)


def _widths(columns: list[_Column], width: int) -> list[int]:
    """What is left over the least widths goes to texts, then to the heads of numbers, in equal parts of what each
    would like more."""
    widths = [column.min_width for column in columns]
    spare = width - _min_total(columns)
    for is_text in (True, False):  # in a very narrow terminal words are broken, and at last what stands for numbers
        for i, column in enumerate(columns):
            if spare < 0 and column.is_text == is_text:
                cut = min(-spare, max(widths[i] - LEAST_BROKEN, 0))
                widths[i] -= cut
                spare += cut
    spare = max(spare, 0)
    for is_text in (True, False):
        wanted = [c.natural_width - c.min_width if c.is_text == is_text else 0 for c in columns]
        granted = min(spare, sum(wanted))
        widths = [w + (granted * more // sum(wanted) if more else 0) for w, more in zip(widths, wanted)]
        spare -= granted
    return widths


def _rich_table(columns: list[_Column], widths: list[int]) -> Table:
    table = Table(box=None, header_style="bold")
    for column, width in zip(columns, widths):
        justify: JustifyMethod = "left" if column.is_text else "right"
        table.add_column(Text(_wrap_head(column.texts[0], width)), justify=justify, width=width, overflow="fold")
    for row in zip(*(column.texts[1:] for column in columns)):
        table.add_row(*map(Text, row))
    return table


def make_table(
    title: str, columns: list[str], rows: Iterable[Iterable[object]], text: Iterable[int] = (), keys: int = 1
) -> FittedTable:
    """A table, its texts as they are, whose first column, and those of `text`, are text and whose others are numbers;
    units belong into the names of the columns. `keys`: how many of the first columns say what a row is about, and are
    repeated where the table is split."""
    texts = [[column] for column in columns]
    for row in rows:
        for cells, cell in zip(texts, row):
            cells.append(format_number(cell) if isinstance(cell, float) else shown_name(str(cell)))
        for cells in texts:  # of a row that is shorter
            cells += [""] * (max(map(len, texts)) - len(cells))
    is_text = {0, *text}
    return FittedTable(title, [_Column(cells, i in is_text) for i, cells in enumerate(texts)], keys)


def print_result(data: dict[str, Any], to: Console) -> None:
    """Verdict, causes and figures of a result, for people."""
    if verdict := data.get("verdict"):
        colour = VERDICT_COLOURS.get(verdict["word"], "default")
        to.print(
            f"[bold {colour}]{escape(verdict['word'].capitalize())}:[/] {escape(verdict['text'])}",
            soft_wrap=True,
            markup=True,
        )
    for cause in data.get("causes", ()):
        remedy = f" {cause['remedy']}" if cause.get("remedy") else ""
        name = cause["cause"].replace("_", " ")
        to.print(f"  - [bold]{escape(name)}[/]: {escape(cause['text'] + remedy)}", soft_wrap=True, markup=True)
    if rows := data.get("figures"):
        to.print()
        to.print(_figure_table(rows))


def _figure_table(rows: list[dict[str, Any]]) -> FittedTable:
    """Numbers with uncertainty; where a cause changes them, beside what they are without it."""
    cells = []
    for r in rows:
        corrected = r.get("corrected")
        cells.append(
            [
                r["name"],
                *_number_cells(r["value"], r.get("std")),
                *(_number_cells(*corrected) if corrected else [NONE, NONE]),
                r["unit"],
            ]
        )
    heads = ["quantity", "value", "± std", "corrected", "± std", "unit"]
    return make_table("", heads, cells, text=(5,))


def _number_cells(value: float, std: float | None) -> list[str]:
    return [format_number(value, std), format_number(std, std)]
