"""The page of one insertion: replay in 3D beside a close-up of the tube, what was done when, plots."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from kr5_tools.insertion import directions, ending_tables, messages
from kr5_tools.pages.rendering import ShownPlot, embed_plot
from kr5_tools.replay.page import make_page
from kr5_tools.replay.runs import Run, thinned_run
from kr5_tools.replay.signals import signal_of

if TYPE_CHECKING:
    import kr5.sim

MOST_POSTURES = 1500


def insertion_page(
    result: "kr5.sim.InsertionResult", setup: "kr5.sim.InsertionSetup", drawn: Sequence[ShownPlot], source: Path
) -> str:
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


def _turn(result: "kr5.sim.InsertionResult") -> list[tuple[Any, ...]]:
    rows = directions.table_rows(result)
    return (
        [("Direction of the hole by the last turn", "numbers", directions.COLUMNS, rows, directions.TEXT)]
        if rows
        else []
    )


def page_title(setup: "kr5.sim.InsertionSetup") -> str:
    return f"Insertion at {1e3 * setup.clearance:g} mm clearance, {np.degrees(setup.tilt):.3g}° tilt"


def setup_rows(setup: "kr5.sim.InsertionSetup") -> list[tuple[str, str]]:
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


# Columns of an insertion that its page shows as signals: label, unit and quantity.
SIGNALS = {
    "fz": ("force along the tube", "N", "force"),
    "fx": ("force along x of the tube", "N", "force"),
    "fy": ("force along y of the tube", "N", "force"),
    "tx": ("moment about x of the tube", "N m", "moment"),
    "ty": ("moment about y of the tube", "N m", "moment"),
    "tz": ("moment about z of the tube", "N m", "moment"),
    "true_z": ("height of the peg's bottom above the true face", "m", "peg"),
    "true_tilt": ("tilt of the peg against the true tube", "rad", "peg"),
    "true_x": ("position x of the peg in the true tube frame", "m", "peg"),
    "true_y": ("position y of the peg in the true tube frame", "m", "peg"),
}


def replay_run(result: "kr5.sim.InsertionResult") -> Run:
    """Postures over time, thinned out, with the phase that begins at each time, and the signals of the peg."""
    rows, n = result.rows, result.cell.robot.joints
    t, q = np.asarray(rows["t"]), np.column_stack([rows[f"q{i + 1}"] for i in range(n)])
    pegs = len(result.pegs) > 1
    notes = [
        [
            round(p["begin"] - t[0], 4),
            f"{'peg ' + str(p['peg']) + ', ' if pegs else ''}attempt {p['attempt']}: {p['phase']}",
        ]
        for p in ending_tables.phases(rows)
    ]
    signals = [signal_of(name, *meaning, t - t[0], rows[name]) for name, meaning in SIGNALS.items() if name in rows]
    run = Run("insertion", t - t[0], q=q, notes=notes, signals=signals, first=["fz", "true_z", "true_tilt"])
    return thinned_run(run, MOST_POSTURES)


def true_tube(result: "kr5.sim.InsertionResult") -> np.ndarray:
    """Pose of the tube in the base, where it really stands."""
    return np.asarray(np.array(result.cell.tube.T_base_tube) @ result.T_tube_actual)
