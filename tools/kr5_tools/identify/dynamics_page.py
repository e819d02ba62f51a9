"""Page of identified dynamics: torques by joint, errors, base parameters, findings."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from kr5.files.result_types import ResultData

from kr5_tools.calibrate.plots import Plot
from kr5_tools.cli.numbers import format_number
from kr5_tools.identify.dynamics_errors import error_rows
from kr5_tools.pages.plot_style import BEHIND, BLUE, RED, STYLE, WIDE, plt
from kr5_tools.pages.tables_page import write_tables_page

PARTS = (("fitted", "fitted"), ("held_out", "held out"))


def torque_plot(curves: dict[str, Any], joint: int) -> Any:
    """Measured and predicted torque of a joint, and their difference; the held-out part beside the fitted one."""
    shown = [(name, title) for name, title in PARTS if name in curves]
    figure, grid = plt.subplots(
        2, len(shown), figsize=(WIDE, 3.6), squeeze=False, sharey="row", height_ratios=(2, 1), sharex="col"
    )
    for column, (name, title) in enumerate(shown):
        t = np.array(curves[name]["t"], float)
        measured, predicted = (np.array(curves[name][key], float)[:, joint] for key in ("measured", "predicted"))
        gaps = np.flatnonzero(np.diff(t) > 5 * np.median(np.diff(t))) + 1  # between runs nothing was measured
        t, measured, predicted = (np.insert(v, gaps, np.nan) for v in (t, measured, predicted))
        top, bottom = grid[0][column], grid[1][column]
        top.plot(t, measured, label="measured", **BEHIND)
        top.plot(t, predicted, color=BLUE, linewidth=0.9, label="predicted")
        bottom.plot(t, measured - predicted, color=RED, linewidth=0.8, label="residual")
        top.set_title(title)
        bottom.set_xlabel("t [s]")
    grid[0][0].set_ylabel("torque [N m]")
    grid[1][0].set_ylabel("residual [N m]")
    figure.legend(*grid[0][0].get_legend_handles_labels(), loc="outside upper right", fontsize=9, ncols=2)
    return figure


def write_page(data: ResultData, source: str, output: Path, png: Path | None) -> list[Path]:
    """Writes the page of a kr5-dynamics/1 result, and its plots where they are wanted."""
    result = data["result"]
    with plt.rc_context(STYLE):
        plots = [
            Plot(
                f"torque_{k + 1}",
                f"Joint {k + 1}",
                "Smoothed measured torque, the torque that the model predicts, and their difference.",
                torque_plot(result["curves"], k),
                wide=True,
            )
            for k in range(len(result["errors"]["fitted"]["rms"]))
        ]
    parts = [
        page_part("Torque errors", [_error_table(result["errors"])], [_error_text(result)]),
        {**page_part("Torques by joint", [], []), "plots": plots},
        page_part("Base parameters", [figure_table(data)], _condition_texts(result)),
    ]
    if result["findings"]:
        rows = [[f["severity"], f["column"], f["text"]] for f in result["findings"]]
        table = {"title": "", "columns": ["severity", "column", "finding"], "rows": rows, "texts": []}
        parts.append(page_part("Findings about the log", [table], []))
    return write_tables_page(data, "Dynamics of the arm", "kr5 identify dynamics", source, parts, output, png)


def page_part(title: str, tables: Sequence[Mapping[str, object]], texts: list[str]) -> dict[str, Any]:
    """A part of a page without plots."""
    return {"title": title, "texts": texts, "plots": [], "tables": tables}


def _error_table(errors: dict[str, Any]) -> dict[str, Any]:
    columns, rows = error_rows(errors)
    cells = [[format_number(c) if isinstance(c, float) else c for c in row] for row in rows]
    return {"title": "", "columns": columns, "rows": cells, "texts": []}


def _error_text(result: dict[str, Any]) -> str:
    errors = result["errors"]
    text = f"All joints: {100 * errors['fitted']['total']:.3g} % of the measured torque fitted"
    if "held_out" in errors:
        text += f", {100 * errors['held_out']['total']:.3g} % held out"
    return text + "; torques as logged, before smoothing."


def figure_table(data: ResultData) -> dict[str, Any]:
    """The figures with their standard deviations."""
    rows = [
        [f["name"], format_number(f["value"], f["std"]), format_number(f["std"], f["std"]), f["unit"]]
        for f in data["figures"]
    ]
    return {"title": "", "columns": ["", "value", "± std", "unit"], "rows": rows, "texts": []}


def _condition_texts(result: dict[str, Any]) -> list[str]:
    out = [
        f"Condition number of the observation matrix {result['condition']:.4g}, with columns of unit length"
        f" {result['scaled_condition']:.4g}."
    ]
    if result["unidentifiable"]:
        out.append("Not determined by the motion: " + ", ".join(result["unidentifiable"]) + ".")
    if result["unmoved"]:
        out.append("Joints that never moved: " + ", ".join(str(j) for j in result["unmoved"]) + ".")
    return out
