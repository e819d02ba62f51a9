"""The page of one insertion: replay in 3D beside a close-up of the tube, what was done when, plots."""

from pathlib import Path
from typing import Any

import numpy as np

from kr5_tools.insertion import directions, ending_tables, messages
from kr5_tools.pages.rendering import embed_plot
from kr5_tools.replay.command import make_page

MOST_POSTURES = 1500


def insertion_page(result: Any, setup: Any, drawn: list[Any], source: Path) -> str:
    """The HTML."""
    look, icon = ("good", "✓") if result.inserted else ("unusable", "✗")
    return make_page(
        result.cell,
        [replay_run(result)],
        source,
        made_by="kr5 insert",
        title=page_title(setup),
        T_base_actual=true_tube(result),
        template="insert.html",
        look=look,
        icon=icon,
        endings=[messages.ending_text(p) for p in result.pegs],
        plots=[embed_plot(p) for p in drawn],
        tables=[
            ("Phases", "seen", ending_tables.PHASE_COLUMNS, ending_tables.phase_rows(result), ""),
            *_turn(result),
            (
                "Result",
                "numbers",
                ending_tables.PEG_COLUMNS,
                ending_tables.peg_rows(result),
                ending_tables.PEG_TEXT,
            ),
        ],
        given=setup_rows(setup),
    )


def _turn(result: Any) -> list[tuple[Any, ...]]:
    rows = directions.table_rows(result)
    return (
        [("Direction of the hole by the last turn", "numbers", directions.COLUMNS, rows, directions.TEXT)]
        if rows
        else []
    )


def page_title(setup: Any) -> str:
    return f"Insertion at {1e3 * setup.clearance:g} mm clearance, {np.degrees(setup.tilt):.3g}° tilt"


def setup_rows(setup: Any) -> list[tuple[str, str]]:
    x, y = (1e3 * v for v in setup.offset)
    return [
        ("clearance", f"{1e3 * setup.clearance:g} mm"),
        ("tilt", f"{np.degrees(setup.tilt):.3g}°"),
        ("offset of the tube", f"({x:.3f}, {y:.3f}) mm"),
        ("tube", "lying" if setup.horizontal else "standing"),
        ("strategy", str(setup.strategy)),
        ("pushed in by", str(setup.insert_by)),
        ("seed", str(setup.seed)),
    ]


def replay_run(result: Any) -> dict[str, Any]:
    """Postures over time, thinned out, with the phase that begins at each time."""
    rows, n = result.rows, result.cell.robot.joints
    t, q = np.asarray(rows["t"]), np.column_stack([rows[f"q{i + 1}"] for i in range(n)])
    keep = np.unique(np.linspace(0, len(t) - 1, min(len(t), MOST_POSTURES)).round().astype(int))
    pegs = len(result.pegs) > 1
    notes = [
        [
            round(p["begin"] - t[0], 4),
            f"{'peg ' + str(p['peg']) + ', ' if pegs else ''}attempt {p['attempt']}: {p['phase']}",
        ]
        for p in ending_tables.phases(rows)
    ]
    return {
        "name": "insertion",
        "t": (t[keep] - t[0]).round(4).tolist(),
        "q": q[keep].round(6).tolist(),
        "still": None,
        "notes": notes,
    }


def true_tube(result: Any) -> np.ndarray:
    """Pose of the tube in the base, where it really stands."""
    return np.asarray(np.array(result.cell.tube.T_base_tube) @ result.T_tube_actual)
