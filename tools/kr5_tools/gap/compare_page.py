"""The page of a comparison of recordings (`kr5-gap-comparison/1`): what changed, and what both have in common."""

from pathlib import Path
from typing import Any, cast

from kr5.files.result_types import ResultData
from kr5.gap import display_unit, effect_text

from kr5_tools.cli.numbers import NONE, format_number, format_percent
from kr5_tools.pages.tables_page import write_tables_page

TITLE = "Difference between recordings"
NARROW = 5.0  # [in]: readable on a phone
POSE_NUMBERS = 16  # of a 4x4 matrix


def write_page(data: dict[str, Any], source: str, output: Path, png: Path | None) -> list[Path]:
    """Writes the page and, where they are wanted, the plots; returns the files of these."""
    from kr5_tools.calibrate.plots import Plot

    parts: list[dict[str, Any]] = [{"title": "", "texts": [data["text"]], "plots": [], "tables": []}]
    if data["changes"]:
        parts.append({"title": "Changes", "texts": [], "plots": [], "tables": [changes_table(data["changes"])]})
    if data["common"]:
        items = common_texts(data["common"])
        parts.append({"title": "In both recordings", "texts": [f"{t}." for t in items], "plots": [], "tables": []})
    if columns := data["difference"].get("shrink", {}).get("columns"):
        text = "Gap between the recordings in every column that differs; noise alone leaves 1."
        plot = Plot("columns", "Columns", text, columns_figure(columns))
        parts.append({"title": "Where they differ", "texts": [], "plots": [plot], "tables": []})
    return write_tables_page(cast(ResultData, data), TITLE, "kr5 gap compare", source, parts, output, png)


def changes_table(changes: list[dict[str, Any]]) -> dict[str, Any]:
    """A row a number of what changed."""
    rows = [
        row
        for change in changes
        for parameter in change["parameters"]
        for row in _parameter_rows(change, parameter, change["parameters"].index(parameter) == 0)
    ]
    columns = ["effect", "parameter", "first", "second", "change", "probable"]
    return {"title": "Changes", "columns": columns, "rows": rows, "texts": []}


def common_texts(names: list[dict[str, Any]]) -> list[str]:
    return [effect_text(name["effect"], name["target"]) for name in names]


def columns_figure(columns: dict[str, list[float]]) -> Any:
    """The gap of each column before and after the changes."""
    import numpy as np

    from kr5_tools.pages.plot_style import BLUE, GREY, RED, STYLE, plt

    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(NARROW, 1.4 + 0.38 * len(columns)))
        at = np.arange(len(columns))
        axes.barh(
            at - 0.2, [before for before, _ in columns.values()], height=0.38, color=RED, label="between the recordings"
        )
        axes.barh(at + 0.2, [after for _, after in columns.values()], height=0.38, color=BLUE, label="with the changes")
        axes.axvline(1.0, color=GREY, linewidth=0.8)
        axes.set_yticks(at, list(columns), fontsize=8)
        axes.invert_yaxis()
        axes.set_xlabel("gap [-]")
        axes.legend(loc="lower right", fontsize=8)
        axes.grid(axis="y", visible=False)
    return figure


def _parameter_rows(change: dict[str, Any], parameter: dict[str, Any], first: bool) -> list[list[str]]:
    either = parameter["second"] or parameter["first"]
    if len(either) == POSE_NUMBERS:
        return [[effect_text(change["effect"], change["target"]), parameter["name"], NONE, "pose", NONE, ""]]
    factor, unit = display_unit(parameter["unit"], either, change["target"])
    rows = []
    for k, std in enumerate(parameter["std"]):
        before, now = (_number(parameter[key], k, factor, std) for key in ("first", "second"))
        difference = NONE
        if k < min(len(parameter["first"]), len(parameter["second"])):
            change_of = factor * (parameter["second"][k] - parameter["first"][k])
            difference = f"{format_number(change_of, factor * std)} ± {format_number(factor * std, factor * std)}"
        named = first and k == 0
        axis = f" {'xyz'[k]}" if 1 < len(parameter["std"]) <= 3 else ""
        rows.append(
            [
                effect_text(change["effect"], change["target"]) if named else "",
                f"{parameter['name'].replace('_', ' ')}{axis} [{unit or '-'}]",
                before,
                now,
                difference,
                _short_percent(change["probability"]) if named else "",
            ]
        )
    return rows


def _short_percent(share: float) -> str:
    return format_percent(share, more=">", less="<")


def _number(values: list[float], k: int, factor: float, std: float) -> str:
    return format_number(factor * values[k], factor * std) if k < len(values) else NONE
