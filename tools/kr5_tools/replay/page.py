"""The page in which a cell moves: its scene in 3D, what moves in it, and the signals beside it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import kr5
import kr5.cell
import numpy as np
from kr5.files import writing

from kr5_tools.cli.numbers import format_count
from kr5_tools.replay.runs import Run, page_runs


def cell_scene(cell: kr5.cell.Cell, T_base_actual: np.ndarray | None = None) -> dict[str, Any]:
    """What a page draws of a cell: the arm's rows, what it carries, what stands beside it. `T_base_actual`: where the
    tube really is, if not where the cell says."""
    from kr5_tools.cell.frames import target_frames

    tube, peg, sphere, board = cell.tube, cell.peg, cell.laser and cell.laser.target, cell.board
    boards = [
        {"T": T, "rows": board.rows, "cols": board.cols, "marker": board.marker, "gap": board.gap}
        for name, T in target_frames(cell, "T_base_target").items()
        if board and name.endswith("board")
    ]
    scene: dict[str, Any] = writing.to_plain(
        {
            "T_base_0": cell.robot.T_base_0,
            "joints": [{**row.to_dict(), "type": str(row.type)} for row in cell.robot.dh],
            "T_flange_tool": cell.tool and cell.tool.T_flange_tool,
            "T_flange_sensor": cell.tool and cell.tool.T_flange_sensor,
            "T_flange_camera": cell.T_flange_camera(),
            "T_flange_scanner": cell.T_flange_scanner(),
            "boards": boards,
            "peg": peg and {"radius": peg.radius, "length": peg.length},
            "tube": (
                tube
                and {"inner": tube.inner_radius, "outer": tube.outer_radius, "depth": tube.depth, "T": tube.T_base_tube}
            ),
            "sphere": sphere and {"centre": sphere.sphere, "radius": sphere.radius},
        }
    )
    if T_base_actual is not None:
        scene["tube"]["T"] = writing.to_plain(T_base_actual)
    return scene


def make_page(
    cell: kr5.cell.Cell,
    runs: list[Run],
    source: Path,
    made_by: str = "kr5 replay",
    title: str = "",
    solids: Sequence[kr5.cell.PlacedObject] = (),
    T_base_actual: np.ndarray | None = None,
    template: str = "replay.html",
    **values: object,
) -> str:
    """The HTML of the page. `solids`: solids that stand in the cell beside its own. `T_base_actual`: as of cell_scene.
    A template that extends replay.html gets `values`."""
    from kr5_tools.pages.rendering import render_page, script_json

    text = f"{format_count(cell.robot.joints, 'joint')}, {format_count(len(runs), 'run')}"
    data = {
        **cell_scene(cell, T_base_actual),
        "runs": page_runs(runs),
        "solids": [_drawn(cell, solid, runs[0]) for solid in solids],
    }
    return render_page(
        template,
        brand=made_by,
        title=title or cell.name or source.stem,
        text=text,
        runs=[option_text(run) for run in runs],
        signals=any(r.signals for r in runs),
        data=script_json(data),
        version=kr5.__version__,
        source=source.name,
        **values,
    )


def option_text(run: Run) -> str:
    """A run in the list of experiments: its name, and its widest gap where that is above the limit of noise."""
    gaps = [signal.gap or 0.0 for signal in run.signals if signal.above]
    return f"{run.name}, gap up to {max(gaps):.1f}" if gaps else run.name


def drawn_solid(solid: kr5.cell.PlacedObject) -> dict[str, Any]:
    """A solid as a page draws it."""
    out: dict[str, Any] = writing.to_plain({**solid.to_dict(), "T": solid.T_base_object})
    return out


def _drawn(cell: kr5.cell.Cell, solid: kr5.cell.PlacedObject, run: Run) -> dict[str, Any]:
    """The same; of a bench without end, the part below the tool."""
    out = drawn_solid(solid)
    if solid.width > 1.0 and run.q is not None:
        tip = cell.T_base_tool(run.q[0])
        out |= {"width": 0.5, "height": 0.5}
        for i in range(2):
            out["T"][i][3] = float(tip[i, 3])
    return out
