"""The page of picks from a bin (`kr5-pick/1`): the cylinders from above, and one row for each."""

from pathlib import Path
from typing import Any

import numpy as np
from kr5.files.result_types import ResultData

from kr5_tools.cli.numbers import format_number
from kr5_tools.pages.tables_page import figures_table, write_tables_page


def write_page(data: ResultData, source: str, output: Path, png: Path | None) -> list[Path]:
    """Writes the page and, where they are wanted, the plots; returns the files of these."""
    from kr5_tools.calibrate.plots import Plot
    from kr5_tools.pages.plot_style import STYLE, plt
    from kr5_tools.picking.picture import draw_pellets

    plots = []
    if data["pellets"]:
        with plt.rc_context(STYLE):
            wide, high, _ = np.ptp([p["centre"] for p in data["pellets"]], axis=0) + 0.02
            figure, axes = plt.subplots(figsize=(6.4, float(np.clip(1.4 + 5.4 * high / wide, 2.8, 7.0))))
            draw_pellets(axes, np.eye(4), data["pellets"])
            axes.set(xlabel="x of the base [mm]", ylabel="y of the base [mm]", aspect="equal")
        plots.append(Plot("picks", "The cylinders from above", "Seen along Z of the base.", figure, True))
    tables = [figures_table(data["figures"]), pellets_table(data["pellets"])]
    parts = [{"title": "", "texts": [], "plots": plots, "tables": tables}]
    return write_tables_page(data, "Picks from a bin", "kr5 pick", source, parts, output, png)


def pellets_table(pellets: list[dict[str, Any]]) -> dict[str, Any]:
    """In the order of the picks."""
    rows = []
    for number, pellet in enumerate(pellets, 1):
        std = 1e3 * float(np.sqrt(max(np.linalg.eigvalsh(np.array(pellet["covariance"])[:3, :3]))))
        rows.append(
            [
                str(number),
                pellet["finding"].replace("_", " "),
                *(f"{1e3 * x:.2f}" for x in pellet["centre"]),
                format_number(std, std),
                f"{100 * pellet['exposed']:.0f}",
                pellet["reason"],
            ]
        )
    columns = ["order", "finding", "x [mm]", "y [mm]", "z [mm]", "± std [mm]", "exposed [%]", "reason"]
    texts = ["Centres in the base. ± is the standard deviation in the least certain direction."]
    return {"title": "Cylinders", "columns": columns, "rows": rows, "texts": texts}
