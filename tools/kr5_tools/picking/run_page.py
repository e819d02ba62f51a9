"""Page of an emptied bin: the bin from above at every decision, to step through or to play."""

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from kr5.files.result_types import ResultData

from kr5_tools.pages.rendering import embed_plot, render_page, script_json
from kr5_tools.picking.emptying import Emptying, Step
from kr5_tools.picking.run_statistics import bins_table, comparison_table, run_plots

if TYPE_CHECKING:
    import kr5.sim


def run_page(data: ResultData, run: Emptying, shape: "kr5.sim.BinShape") -> str:
    """The HTML. Coordinates are those of the bin, in mm."""
    from kr5_tools.pages.plot_style import plt

    T_bin_base = np.linalg.inv(np.asarray(shape.T_base_bin))
    drawn = run_plots(data)
    plots = [embed_plot(plot) for plot in drawn]
    for plot in drawn:
        plt.close(plot.figure)
    return render_page(
        "bin_run.html",
        plots=plots,
        tables=[bins_table(data), comparison_table(data)],
        title=f"A bin of {run.pellets} cylinders",
        brand="kr5 bin empty",
        source=f"seed {run.seed}",
        created=data.get("created"),
        version=data.get("version"),
        command=data.get("command"),
        verdict=data["verdict"],
        icon={"good": "✓"}.get(data["verdict"]["word"], "!"),
        figures=data["figures"],
        run=script_json(
            {"size": [1e3 * float(v) for v in shape.size], "steps": [_step(s, T_bin_base) for s in run.steps]}
        ),
    )


def _step(step: Step, T: np.ndarray) -> dict[str, Any]:
    keys = asdict(step)

    def point(p: npt.ArrayLike) -> list[float]:
        return [round(1e3 * float(v), 2) for v in T[:3, :3] @ np.asarray(p) + T[:3, 3]]

    def turn(d: npt.ArrayLike) -> list[float]:
        return [round(float(v), 4) for v in T[:3, :3] @ np.asarray(d)]

    keys["truth"] = [[*point(t[:3]), *turn(t[3:6]), round(1e3 * t[6], 2), round(1e3 * t[7], 2)] for t in step.truth]
    keys["found"] = [
        [
            *point(f["centre"]),
            *turn(f["axis"]),
            round(1e3 * f["radius"], 2),
            round(1e3 * f["height"], 2),
            int(f["ready"]),
        ]
        for f in step.found
    ]
    keys["tip"] = point(step.tip) if step.tip else None
    keys["approach"] = turn(step.approach) if step.approach else None
    keys["clearance"] = None if step.clearance is None else round(1e3 * step.clearance, 2)
    return keys
