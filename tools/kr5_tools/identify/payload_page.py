"""Page of an identified payload: what it adds to the torques, errors with and without it, the body."""

from pathlib import Path

import numpy as np
from kr5.files.result_types import ResultData

from kr5_tools.calibrate.plots import Plot
from kr5_tools.cli.numbers import format_number
from kr5_tools.identify.dynamics_page import figure_table, page_part, torque_plot
from kr5_tools.pages.plot_style import STYLE, plt
from kr5_tools.pages.tables_page import write_tables_page


def write_page(data: ResultData, source: str, output: Path, png: Path | None) -> list[Path]:
    """Writes the page of a kr5-payload/1 result, and its plots where they are wanted."""
    result = data["result"]
    curves = {"fitted": result["curves"]}
    with plt.rc_context(STYLE):
        plots = [
            Plot(
                f"payload_torque_{k + 1}",
                f"Joint {k + 1}",
                "Measured torque less that of the arm without the load, the torque of the load that was found, and the"
                " difference: friction that has changed, and noise.",
                torque_plot(curves, k),
                wide=True,
            )
            for k in range(np.shape(result["curves"]["measured"])[1])
        ]
    errors = result["errors"]
    rows = [
        [f"{k + 1}", format_number(a), format_number(b)]
        for k, (a, b) in enumerate(zip(errors["without"]["rms"], errors["fitted"]["rms"], strict=True))
    ]
    columns = ["joint", "without the load [N m]", "with the load [N m]"]
    parts = [
        page_part("Load", [figure_table(data)], ["Centre and inertia in the frame of the flange."]),
        page_part("Torque errors", [{"title": "", "columns": columns, "rows": rows, "texts": []}], []),
        {**page_part("What the load adds", [], []), "plots": plots},
    ]
    return write_tables_page(data, "Payload of the arm", "kr5 identify payload", source, parts, output, png)
