"""Tables of numbers with units, for people."""

from collections.abc import Iterable
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from kr5_tools.cli.numbers import format_number

VERDICT_COLOURS = {"good": "green", "doubtful": "yellow", "unusable": "red"}


def figure_row(name: str, value: float, std: float | None, unit: str) -> dict[str, Any]:
    """One row of the table of numbers with uncertainty."""
    return {"name": name, "value": value, "std": std, "unit": unit}


def pose_figures(name: str, T: Any, covariance: Any) -> list[dict[str, Any]]:
    """Position [mm] and roll, pitch, yaw [deg] of a pose, with the deviations its covariance (right perturbation)
    gives."""
    import kr5
    import numpy as np

    centre, std = kr5.xyzrpy_with_std(T, covariance)
    axes = ("x", "y", "z", "roll", "pitch", "yaw")
    scale = [1e3] * 3 + [180 / np.pi] * 3
    units = ["mm"] * 3 + ["deg"] * 3
    return [figure_row(f"{name} {axes[i]}", centre[i] * scale[i], std[i] * scale[i], units[i]) for i in range(6)]


def make_table(title: str, columns: list[str], rows: Iterable[Iterable[Any]], text: Iterable[int] = ()) -> Table:
    """A table, its texts as they are, whose first column, and those of `text`, are text and whose others are numbers;
    units belong into the names of the columns."""
    out = Table(title=title, title_justify="left", box=None, header_style="bold")
    for i, column in enumerate(columns):
        out.add_column(column, justify="left" if i == 0 or i in text else "right")
    for row in rows:
        out.add_row(*(format_number(cell) if isinstance(cell, float) else str(cell) for cell in row))
    return out


def print_result(data: dict[str, Any], to: Console) -> None:
    """Verdict, causes and figures of a result, for people."""
    if rows := data.get("figures"):
        cells = (
            [r["name"], format_number(r["value"], r.get("std")), format_number(r.get("std"), r.get("std")), r["unit"]]
            for r in rows
        )
        to.print(make_table("", ["quantity", "value", "± std", "unit"], cells))
    if verdict := data.get("verdict"):
        colour = VERDICT_COLOURS.get(verdict["word"], "default")
        to.print(f"[bold {colour}]{escape(verdict['word'])}[/]: {escape(verdict['text'])}", soft_wrap=True, markup=True)
    for cause in data.get("causes", ()):
        remedy = f" {cause['remedy']}" if cause.get("remedy") else ""
        to.print(f"  [bold]{escape(cause['cause'])}[/]: {escape(cause['text'] + remedy)}", soft_wrap=True, markup=True)
