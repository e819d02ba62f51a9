"""Pages of tables and plots, part by part."""

from pathlib import Path
from typing import Any

from kr5.files import writing
from kr5.files.result_types import FigureData, ResultData, VerdictData

from kr5_tools.cli import terminal
from kr5_tools.cli.numbers import format_number
from kr5_tools.pages.rendering import embed_plot, render_page, write_png

ICONS = {"good": "✓", "doubtful": "!", "unusable": "✗"}


def write_tables_page(
    data: ResultData,
    title: str,
    brand: str,
    source: str,
    parts: list[dict[str, Any]],
    output: Path,
    png: Path | None,
) -> list[Path]:
    """Writes the page of `parts` (title, texts, plots, tables of title, columns, rows and texts, and lists of title and
    items) and, where they are wanted, the plots, which are closed; returns the files of these."""
    from kr5_tools.pages.plot_style import STYLE, plt

    drawn = [plot for part in parts for plot in part["plots"]]
    try:
        with terminal.spinner("Drawing the plots …"), plt.rc_context(STYLE):
            shown = [{**part, "plots": [embed_plot(plot) for plot in part["plots"]]} for part in parts]
            page = render_page(
                "tables.html",
                title=title,
                brand=brand,
                source=source,
                created=data.get("created"),
                version=data.get("version"),
                command=data.get("command"),
                verdict=data.get("verdict"),
                icon=_icon(data["verdict"]) if "verdict" in data else "",
                parts=shown,
            )
            writing.write_text(page, output)
            return write_png(drawn, png) if png else []
    finally:
        for plot in drawn:
            plt.close(plot.figure)


def _icon(verdict: VerdictData) -> str:
    """Of the verdict's own, else of its word."""
    return str(verdict.get("icon") or ICONS.get(verdict.get("word", ""), ""))


def figures_table(figures: list[FigureData]) -> dict[str, Any]:
    """The figures of a result, with as many digits as their uncertainty allows."""
    rows = [[f["name"], format_number(f["value"], f.get("std")), f["unit"]] for f in figures]
    return {"title": "Figures", "columns": ["quantity", "value", "unit"], "rows": rows, "texts": []}
