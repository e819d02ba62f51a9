"""The page of a measured gap (`kr5-gap-measure/1`): where it is, and that of every column."""

from pathlib import Path
from typing import Any, cast

from kr5.files.result_types import ResultData

from kr5_tools.cli.numbers import NONE, format_count, root_mean_square
from kr5_tools.pages.tables_page import write_tables_page

NARROW = 5.0  # [in]: readable on a phone
TITLE = "Gap between simulation and recording"


def write_page(data: dict[str, Any], source: str, output: Path, png: Path | None) -> list[Path]:
    """Writes the page and, where they are wanted, the plots; returns the files of these."""
    from kr5_tools.calibrate.plots import Plot

    text = "Gap of every column; the mark is the limit of noise, and columns above it are red."
    plots = [Plot("gaps", "Every column", text, gap_figure(data["columns"], data["limits"], NARROW))]
    parts: list[dict[str, Any]] = [
        {"title": "", "texts": [summary_text(data)], "plots": [], "tables": [parts_table(data["parts"])]},
        {"title": "Columns", "texts": [], "plots": plots, "tables": columns_tables(data)},
    ]
    return write_tables_page(cast(ResultData, data), TITLE, "kr5 gap measure", source, parts, output, png)


def summary_text(data: dict[str, Any]) -> str:
    above = [gap for name, gap in data["columns"].items() if gap > data["limits"].get(name, float("inf"))]
    count = format_count(len(above), "column", ("is", "are")) if above else "No column is"
    return (
        f"The RMS gap over {len(data['columns'])} columns is {data['gap']:.3f} times the noise; 1 is the floor, which"
        f" noise alone leaves. {count} above the limit of noise"
        + (f", with an RMS gap of {root_mean_square(above):.3f}." if above else ".")
    )


def parts_table(parts: list[dict[str, Any]]) -> dict[str, Any]:
    rows = [
        [
            part["by"],
            part["name"],
            str(part["columns"]),
            str(part["exceeding"]),
            f"{part['gap']:.3f}",
            f"{100 * part['share']:.1f}" if part["share"] > 0 else NONE,
        ]
        for part in parts
    ]
    columns = ["by", "name", "columns", "above limit", "RMS gap [-]", "share of excess [%]"]
    return {"title": "Where", "columns": columns, "rows": rows, "texts": []}


def columns_tables(data: dict[str, Any]) -> list[dict[str, Any]]:
    """Columns above their limit, and the others; the widest gap first."""
    above: list[list[str]] = []
    others: list[list[str]] = []
    for name, gap in sorted(data["columns"].items(), key=lambda item: -item[1]):
        limit = data["limits"].get(name)
        row = [name, f"{gap:.3f}", NONE if limit is None else f"{limit:.3f}"]
        (above if limit is not None and gap > limit else others).append(row)
    columns = ["column", "gap [-]", "limit [-]"]
    found: list[dict[str, Any]] = []
    if above:
        found.append({"title": "Above the limit of noise", "columns": columns, "rows": above, "texts": []})
    if others:
        title = f"{len(others)} columns within the limit of noise"
        found.append({"title": title, "columns": columns, "rows": others, "texts": [], "folded": True})
    return found


def gap_figure(gaps: dict[str, float], limits: dict[str, float], width: float = 9.0) -> Any:
    """A bar a column, in groups by experiment; those above their limit in red."""
    import numpy as np

    from kr5_tools.pages.plot_style import BLUE, GREY, RED, STYLE, plt

    experiments = list(dict.fromkeys(name.partition(".")[0] for name in gaps))
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(width, 1.2 + 0.19 * len(gaps) + 0.1 * len(experiments)))
        at, place, ticks = 0.0, [], []
        for experiment in experiments:
            for name in (n for n in gaps if n.partition(".")[0] == experiment):
                limit = limits.get(name, float("inf"))
                place.append(at)
                ticks.append(name)
                axes.barh(at, gaps[name], color=RED if gaps[name] > limit else BLUE, height=0.8)
                if np.isfinite(limit):
                    axes.plot([limit, limit], [at - 0.45, at + 0.45], color=GREY, linewidth=1)
                at += 1
            at += 0.6
        widest = max(gaps.values())
        axes.set_xscale("log") if widest > 20 else axes.set_xlim(0, max(1.6, 1.05 * widest))
        axes.axvline(1.0, color=GREY, linewidth=0.8)
        axes.set_yticks(np.array(place), ticks, fontsize=8)
        axes.set_ylim(at - 0.5, -0.8)
        axes.grid(axis="y", visible=False)
        axes.set_xlabel("gap: RMS of recorded − simulated over noise [-]\ngrey mark: limit of noise; red: above it")
    return figure
