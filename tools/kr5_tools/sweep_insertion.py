"""`kr5 sweep insertion`: how often, and how soon, a peg goes in, over tilts and clearances."""

import math
import os
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from . import common
from .insert_task import Cell, load_cell
from .sweep_trials import Grid, make_setup, run_trial

app = typer.Typer()

MOST_VALUES = 1000  # of one axis; more is a step that was mistyped
WIDEST = 14  # of a count with its interval, in a table of 80 letters
BOTH = {"orientation": ("vertical", "horizontal"), "strategy": ("felt", "book")}


@app.command(epilog="Example: kr5 sweep insertion --tilts 10:20:5 --clearances 0.1,1 --trials 2 --workers 1 -o sweep")
def insertion(
    cell_file: Cell = None,
    tilts: Annotated[str, typer.Option(metavar="A:B:STEP", help="Of the peg while it feels round \\[deg]; or a list, as 5,15,25.")] = "15",
    clearances: Annotated[str, typer.Option(metavar="C,C,...", help="Radius of the bore less that of the peg \\[mm]; or a range as in "
                                              "--tilts.")] = "0.05,0.1,0.25,0.5,1",
    trials: Annotated[int, typer.Option(min=1, help="Of each tilt and clearance. A sweep may be given more of them later.")] = 10,
    orientation: Annotated[Literal["vertical", "horizontal", "both"], typer.Option(help="How the tube stands.")] = "vertical",
    strategy: Annotated[Literal["felt", "book", "both"], typer.Option(help="How the hole is found, as in kr5 insert.")] = "felt",
    insert_by: Annotated[Literal["arm", "gravity", "air"], typer.Option(help="What pushes the peg in.")] = "arm",
    seed: Annotated[int, typer.Option(min=0, help="Of all trials together.")] = 1,
    workers: Annotated[int | None, typer.Option(min=1, show_default=False, help="Processes on this machine; by default one for each core. 1 does "
                                                "without Dask.")] = None,
    scheduler: Annotated[str | None, typer.Option(metavar="ADDRESS", help="A Dask scheduler whose workers run the trials, as tcp://host:8786.")] = None,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FOLDER", help="Where sweep.json, trials.csv and report.html go; a sweep that was "
                                         "killed goes on there.")] = Path("insertion-sweep"),
    png: Annotated[Path | None, typer.Option("--png", metavar="DIR", help="Write every plot as PNG into this folder.")] = None,
    json_file: common.Json = None,
) -> None:
    """Inserts a peg many times over a grid of tilts and clearances: success at the first, second and third attempt, and times, with intervals.

    Every finished trial is on the disk at once: after a kill the same command goes on where it was. The same seed gives the same
    result, whatever the number of workers. Where the tube really is, is drawn within one radius of the peg from the seed of each trial.
    """
    import kr5.sim

    from . import sweep_file, sweep_run, sweep_table

    common.check_writable(json_file)
    cell, source = load_cell(cell_file)
    grid = Grid(values("--tilts", tilts), values("--clearances", clearances), chosen("orientation", orientation), chosen("strategy", strategy),
                insert_by, seed)
    keys = grid.keys(trials)
    for key in grid.keys(1):  # complains of what cannot be run before anything is
        kr5.sim.insertion_options(cell, make_setup(cell, key, insert_by, seed))
    to, text = common.console(json_file), sweep_file.cell_text(cell)
    with sweep_file.Folder(output, grid, text) as folder:
        missing = begin(folder, keys, to)
        compare(folder, cell, grid)
        try:
            sweep_run.run(text, missing, grid, min(workers or cores(), max(1, len(missing))), scheduler, folder.add)
        except KeyboardInterrupt:
            to.print(f"Stopped: {len(folder.trials)} trials are kept in {output}; the same command goes on.", soft_wrap=True, markup=False)
            raise typer.Exit(130) from None
        found = [folder.trials[key] for key in sorted(folder.trials)]
    tables = sweep_table.tables(found, grid)
    tell(tables, to)
    write(tables, grid, source, output, png, to)
    common.write_json({"grid": grid.__dict__, "tables": tables, "trials": [t.__dict__ for t in found]}, json_file)


def begin(folder: Any, keys: list[Any], to: Any) -> list[Any]:
    """What is left to do, and a word on what is done."""
    if folder.note:
        common.errors.print(f"[yellow]note:[/yellow] {folder.note}.", soft_wrap=True)
    missing = folder.missing(keys)
    if folder.trials:
        to.print(f"{folder.path}: {len(folder.trials)} trials are there, {len(missing)} are to be run.", soft_wrap=True, markup=False)
    return missing


def compare(folder: Any, cell: Any, grid: Grid) -> None:
    """Runs one finished trial again: a library that has changed under the same version, or another machine, would mix two results."""
    first = min(folder.trials.values(), default=None)
    if first and repr(run_trial(cell, first.key, grid.insert_by, grid.seed)) != repr(first):  # in words NaN equals NaN
        which = f"trial {first.number} at {first.tilt:g} deg and {first.clearance:g} mm"
        common.errors.print(f"[yellow]note:[/yellow] {which} gives other numbers now than when it was run: the library or the machine is another "
                            "one, and the tables mix both; another folder (-o) keeps them apart.", soft_wrap=True)


def cores() -> int:
    """Those that this process may use."""
    return len(os.sched_getaffinity(0))


def chosen(name: str, given: str) -> tuple[str, ...]:
    return BOTH[name] if given == "both" else (given,)


def values(option: str, text: str) -> tuple[float, ...]:
    """The numbers of A:B:STEP, both ends with it, or of a list."""
    expected = "numbers as 5,15,25 or A:B:STEP as 5:25:5"
    try:
        if ":" in text:
            first, last, step = (float(part) for part in text.split(":"))
            if not step > 0 or not first <= last < math.inf:
                common.fail(f"{option}: found {text!r}, expected A:B:STEP with A up to B and a STEP above 0, as 5:25:5")
            count = math.floor((last - first) / step + 1e-9) + 1
            found = [float(f"{first + k * step:.9g}") for k in range(min(count, MOST_VALUES + 1))]
        else:
            found = [float(part) for part in text.split(",")]
    except (ValueError, OverflowError):
        common.fail(f"{option}: found {text!r}, expected {expected}")
    if not all(0 < x < math.inf for x in found):
        common.fail(f"{option}: found {text!r}, expected numbers above 0")
    if len(found) > MOST_VALUES:
        common.fail(f"{option}: found {text!r}, more than {MOST_VALUES} values; expected {expected}")
    return tuple(sorted(set(found)))


def title(table: dict[str, Any]) -> str:
    return f"Tube {'standing' if table['orientation'] == 'vertical' else 'lying'}, strategy {table['strategy']}"


def tell(tables: list[dict[str, Any]], to: Any) -> None:
    from . import sweep_table

    for table in tables:
        columns = [name.replace(" [", "\n[").replace(" (", "\n(") for name in sweep_table.COLUMNS]
        rows = [[cell.replace(" (", "\n(") if len(cell) > WIDEST else cell for cell in row] for row in sweep_table.shown_rows(table)]
        shown = common.table(title(table), columns, rows)
        for column in shown.columns:
            column.no_wrap = True
        to.print(shown)
        for text in sweep_table.words(table):
            to.print(text, soft_wrap=True, markup=False)
        to.print()


def write(tables: list[dict[str, Any]], grid: Grid, source: Path, output: Path, png: Path | None, to: Any) -> None:
    """The page, and the plots where they are wanted."""
    import kr5

    from . import sweep_plots, sweep_table
    from .plot_style import plt
    from .report_page import embed, render, write_png

    with common.working("drawing"):
        drawn = sweep_plots.plots(tables, grid)
        files = write_png(drawn, png) if png else []
        shown = [{"title": title(t), "rows": sweep_table.shown_rows(t), "words": sweep_table.words(t)} for t in tables]
        page = render("sweep.html", title="Sweep of insertions", brand="kr5 sweep insertion", version=kr5.__version__, source=source.name, tables=shown,
                      text=f"Seed {grid.seed}, pushed in by {grid.insert_by}", columns=sweep_table.COLUMNS, plots=[embed(p) for p in drawn])
        common.write_text(page, output / "report.html")
    for plot in drawn:
        plt.close(plot.figure)
    if png:
        to.print(f"{png}: {len(files)} plots.", soft_wrap=True, markup=False)
    to.print(f"{output / 'report.html'}: open it in a browser.", soft_wrap=True, markup=False)
