"""`kr5 insert`: one insertion of a peg into a tube in the simulated cell."""

import math
import os
import webbrowser
from pathlib import Path
from typing import Annotated, Any

import typer

import kr5.sim

from . import common, insert_directions, insert_words
from .insert_task import Cell, load_cell, set_task
from .options import options_from

app = typer.Typer()

PAGE = Path("insertion.html")
SI_FIELDS = ("clearance", "tilt", "offset", "log", "pick_distance", "repeatability", "grip_error", "grip_tilt", "tube_tilt", "face_error",
             "lateral_stiffness", "angular_stiffness")  # the command line speaks mm and degrees


@app.command(epilog="Example: kr5 insert --clearance 0.05 --tilt 15 --offset 3 4 --view")
@options_from(kr5.sim.InsertionSetup, skip=SI_FIELDS, argument="setup")
def insert(
    setup: kr5.sim.InsertionSetup,
    cell_file: Cell = None,
    clearance: Annotated[float, typer.Option(metavar="MM", help="Radius of the bore less that of the peg \\[mm]; the bore is made to it.")] = 0.28,
    tilt: Annotated[float, typer.Option(metavar="DEG", help="Of the peg while it feels round \\[deg].")] = 15.0,
    offset: Annotated[tuple[float, float] | None, typer.Option(metavar="X Y", show_default=False, help="Of the tube's real axis from where "
                      "it is believed \\[mm]; by default drawn from the seed, anywhere within one radius of the peg.")] = None,
    view: Annotated[bool, typer.Option("--view", help=f"Write the page ({PAGE} unless -o names another) and open it where there is a screen.")] = False,
    output: Annotated[Path | None, typer.Option("-o", "--output", metavar="PAGE.html", help="Write a page here: replay in 3D, and plots.")] = None,
    csv: Annotated[Path | None, typer.Option("--csv", metavar="ROWS.csv", help="Write a row every controller cycle here (SI).")] = None,
    png: Annotated[Path | None, typer.Option("--png", metavar="DIR", help="Write every plot as PNG into this folder.")] = None,
    json_file: common.Json = None,
) -> None:
    """Lets a peg feel its way into a tube in the simulated cell: tilted touch, once round, slide, upright, push.

    Lengths are in mm and angles in degrees here; JSON and CSV are in SI. Exit code 1 when a peg is not inserted, 2 for bad input.
    """
    output = output or (PAGE if view else None)
    common.check_writable(output, csv, json_file)
    cell, source = load_cell(cell_file)
    set_task(setup, clearance, tilt, offset, cell)
    with common.working("inserting"):
        result = kr5.sim.run_insertion(cell, setup)
    to = common.console(json_file)
    tell(result, to)
    write(result, setup, source, to, output, csv, png)
    common.write_json(as_dict(result, setup), json_file)
    if view:
        show(output)
    if not result.inserted:
        raise typer.Exit(1)


def phases(rows: Any) -> list[dict[str, Any]]:
    """What was done when: peg, attempt, phase, begin and duration [s]."""
    import kr5.force
    import numpy as np

    if not len(rows):
        return []
    t = np.asarray(rows["t"])
    key = np.column_stack([rows[name] for name in ("peg", "attempt", "phase")]).astype(int)
    starts = np.append(0, np.flatnonzero(np.any(np.diff(key, axis=0) != 0, axis=1)) + 1)
    ends = np.append(t[starts[1:]], t[-1])
    return [{"peg": int(key[k, 0]), "attempt": int(key[k, 1]), "phase": str(kr5.force.Phase(int(key[k, 2]))), "begin": float(t[k]),
             "duration": float(end - t[k])} for k, end in zip(starts, ends)]


def as_dict(result: Any, setup: Any) -> dict[str, Any]:
    """All of it but the rows, in SI."""
    profile = {name: result.profile[name] for name in result.profile.columns} if len(result.profile) else {}
    return {"inserted": result.inserted, "time": result.time, "setup": setup.to_dict(), "pegs": [p.to_dict() for p in result.pegs],
            "phases": phases(result.rows), "profile": profile, "directions": insert_directions.directions(result),
            "tube": result.cell.tube.to_dict(), "peg": result.cell.peg.to_dict()}


def phase_rows(result: Any) -> list[list[Any]]:
    """Of each attempt: its phases with their durations, and where in time it began."""
    found: dict[tuple[int, int], list[dict[str, Any]]] = {}
    for p in phases(result.rows):
        found.setdefault((p["peg"], p["attempt"]), []).append(p)
    return [[f"{peg}", attempt, f"{each[0]['begin']:.2f}", f"{sum(p['duration'] for p in each):.2f}",
             ", ".join(f"{p['phase']} {p['duration']:.2f}" for p in each if p["duration"] > 0)] for (peg, attempt), each in found.items()]


def peg_rows(result: Any) -> list[list[Any]]:
    """How each peg fared, in mm."""
    off = 1e3 * math.hypot(*result.T_T_tube[:2, 3])
    return [[f"{k}", "yes" if p.inserted else "no", p.attempts, f"{p.time:.2f}", f"{1e3 * p.depth:.2f}", f"{p.greatest_force:.1f}", f"{off:.3f}",
             "–" if math.isnan(p.hole_error) else f"{1e3 * p.hole_error:.3f}"] for k, p in enumerate(result.pegs, 1)]


PEG_COLUMNS = ["peg", "in", "attempts", "time [s]", "depth [mm]", "force [N]", "off [mm]", "felt [mm]"]
PEG_TEXT = "Force: the greatest on the peg. Off: the true axis of the tube from the believed one, before; felt: the same after the fit, – without one."
PHASE_COLUMNS = ["peg", "attempt", "begin [s]", "took [s]", "phases [s]"]


def tell(result: Any, to: Any) -> None:
    x, y = (1e3 * v for v in result.T_T_tube[:2, 3])
    to.print(common.table("What was done", PHASE_COLUMNS, phase_rows(result), text=(4,)))
    if turn := insert_directions.table_rows(result):
        to.print(common.table("\nWhere the last turn says the hole is", insert_directions.COLUMNS, turn))
    to.print(common.table("\nHow it ended", PEG_COLUMNS, peg_rows(result)))
    to.print(f"{PEG_TEXT}\n\nThe tube's axis is believed at (0, 0) and really is at ({x:.3f}, {y:.3f}) mm across it.", soft_wrap=True)
    for number, peg in enumerate(result.pegs, 1):
        word, text = insert_words.ending(peg)
        to.print(f"Peg {number} is {word}, {text}", soft_wrap=True, markup=False)


def write(result: Any, setup: Any, source: Path, to: Any, output: Path | None, csv: Path | None, png: Path | None) -> None:
    """Rows, plots and page, where they are wanted."""
    if csv:
        import kr5.io

        kr5.io.save_csv(result.rows, csv)
        to.print(f"{csv}: {len(result.rows)} rows.", soft_wrap=True, markup=False)
    if not (output or png):
        return
    if len(result.rows) < 2:
        common.errors.print("[yellow]note:[/yellow] nothing moved, so there is no page and no plot.")
        return
    from . import insert_page, insert_plots, report_page
    from .plot_style import plt

    with common.working("drawing"):
        drawn = insert_plots.plots(result)
        if png:
            files = report_page.write_png(drawn, png)
            to.print(f"{png}: {len(files)} plots.", soft_wrap=True, markup=False)
        if output:
            common.write_text(insert_page.make(result, setup, drawn, source), output)
            to.print(f"{output}: open it in a browser.", soft_wrap=True, markup=False)
    for plot in drawn:
        plt.close(plot.figure)


def show(page: Path | None) -> None:
    """In a browser, where there is a screen for one; where the page is was said already."""
    if page and page.is_file() and (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        webbrowser.open(page.resolve().as_uri())
