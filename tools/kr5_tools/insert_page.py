"""The page of one insertion: replay in 3D beside a close-up of the tube, what was done when, plots."""

from pathlib import Path
from typing import Any

import numpy as np

from . import insert, insert_directions, insert_words
from .replay import make_page
from .report_page import embed

MOST_POSTURES = 1500


def make(result: Any, setup: Any, drawn: list[Any], source: Path) -> str:
    """The HTML."""
    look, icon = ("good", "✓") if result.inserted else ("unusable", "✗")
    return make_page(
        result.cell, [run(result)], source, made_by="kr5 insert", title=title(setup), T_B_tube=true_tube(result), template="insert.html",
        look=look, icon=icon, endings=[insert_words.ending(p) for p in result.pegs], plots=[embed(p) for p in drawn],
        tables=[("What was done", "seen", insert.PHASE_COLUMNS, insert.phase_rows(result), ""),
                *_turn(result), ("How it ended", "numbers", insert.PEG_COLUMNS, insert.peg_rows(result), insert.PEG_TEXT)],
        given=given(setup))


def _turn(result: Any) -> list[tuple]:
    rows = insert_directions.table_rows(result)
    return [("Where the last turn says the hole is", "numbers", insert_directions.COLUMNS, rows, insert_directions.TEXT)] if rows else []


def title(setup: Any) -> str:
    return f"Insertion at {1e3 * setup.clearance:g} mm clearance, {np.degrees(setup.tilt):.3g}° tilt"


def given(setup: Any) -> list[tuple[str, str]]:
    x, y = (1e3 * v for v in setup.offset)
    return [("clearance", f"{1e3 * setup.clearance:g} mm"), ("tilt", f"{np.degrees(setup.tilt):.3g}°"), ("offset of the tube", f"({x:.3f}, {y:.3f}) mm"),
            ("tube", "lying" if setup.horizontal else "standing"), ("strategy", str(setup.strategy)), ("pushed in by", str(setup.insert_by)),
            ("seed", str(setup.seed))]


def run(result: Any) -> dict[str, Any]:
    """Postures over time, thinned out, with the phase that begins at each time."""
    rows, n = result.rows, result.cell.robot.joints
    t, q = np.asarray(rows["t"]), np.column_stack([rows[f"q{i + 1}"] for i in range(n)])
    keep = np.unique(np.linspace(0, len(t) - 1, min(len(t), MOST_POSTURES)).round().astype(int))
    pegs = len(result.pegs) > 1
    notes = [[round(p["begin"] - t[0], 4), f"{'peg ' + str(p['peg']) + ', ' if pegs else ''}attempt {p['attempt']}: {p['phase']}"]
             for p in insert.phases(rows)]
    return {"name": "insertion", "t": (t[keep] - t[0]).round(4).tolist(), "q": q[keep].round(6).tolist(), "still": None, "notes": notes}


def true_tube(result: Any) -> np.ndarray:
    """Pose of the tube in the base, where it really stands."""
    return np.array(result.cell.tube.T_B_T) @ result.T_T_tube
