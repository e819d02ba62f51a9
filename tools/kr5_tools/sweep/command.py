"""`kr5 sweep insertion`: how often, and how soon, a peg goes in, over tilts and clearances."""

from pathlib import Path
from typing import Annotated, Any, Literal

import kr5.cell
import typer
from kr5.files import writing

from kr5_tools.cli import arguments, tables, terminal
from kr5_tools.cli.insertion_options import Cell
from kr5_tools.cli.interruption import tell_when_stopped
from kr5_tools.cli.terminal import Console
from kr5_tools.cli.value_list import parse_values
from kr5_tools.insertion.task import load_cell
from kr5_tools.sweep.page import table_title, write_sweep_page
from kr5_tools.sweep.runner import core_count
from kr5_tools.sweep.sweep_file import SweepFolder
from kr5_tools.sweep.trials import Grid, Key, make_setup, run_trial

app = typer.Typer()

WIDEST = 14  # of a count with its interval, in a table of 80 letters
BOTH = {"orientation": ("vertical", "horizontal"), "strategy": ("profile_fit", "hayat2022")}


@app.command(epilog="Example: kr5 sweep insertion --tilts 10:20:5 --clearances 0.1,1 --trials 2 --workers 1 -o sweep")
def insertion(
    cell_file: Cell = None,
    tilts: Annotated[
        str,
        typer.Option(
            metavar=("FROM:TO:STEP"),
            help="Tilt of the peg during the turn \\[deg]: FROM:TO:STEP, or a list such as 5,15,25.",
        ),
    ] = "15",
    clearances: Annotated[
        str,
        typer.Option(
            metavar="C,C,...",
            help="Clearances: radius of the bore less radius of the peg \\[mm]; a list, or a range as in --tilts.",
        ),
    ] = "0.05,0.1,0.25,0.5,1",
    trials: Annotated[
        int, typer.Option(min=1, help="Number of trials of each tilt and clearance; may be raised later.")
    ] = 10,
    orientation: Annotated[
        Literal["vertical", "horizontal", "both"], typer.Option(help="Orientation of the tube.")
    ] = "vertical",
    strategy: Annotated[
        Literal["profile_fit", "hayat2022", "both"],
        typer.Option(help="Strategy by which the hole is found, as in kr5 insert."),
    ] = "profile_fit",
    insert_by: Annotated[
        Literal["arm", "gravity", "air"], typer.Option(help="Drive of the insertion, as in kr5 insert.")
    ] = "arm",
    seed: Annotated[int, typer.Option(min=0, help="Random seed of the whole sweep.")] = 1,
    workers: Annotated[
        int | None,
        typer.Option(
            min=1,
            show_default=False,
            help="Number of processes on this machine; by default one per core.",
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS", help="Address of a Dask scheduler whose workers run the trials, e.g. tcp://host:8786."
        ),
    ] = None,
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            metavar="FOLDER",
            help="Folder of sweep.json, trials.csv and report.html; an interrupted sweep continues there.",
        ),
    ] = Path("insertion-sweep"),
    png: arguments.PngOption = None,
    json_file: arguments.JsonOption = None,
) -> None:
    """Insertions over a grid of tilts and clearances: success rates at the first, second and third attempt, and times,
    with their intervals.

    Every finished trial is written to disk at once: after an interruption the same command continues. The same seed
    gives the same result, for any number of workers. The true position of the tube is drawn within one radius of
    the peg from the seed of each trial.
    """
    import kr5.sim

    from kr5_tools.sweep import rate_table, runner, sweep_file

    writing.check_writable(json_file, inputs=[cell_file, output / "sweep.json", output / "trials.csv"])
    cell, source = load_cell(cell_file)
    grid = Grid(
        parse_values("--tilts", tilts),
        parse_values("--clearances", clearances),
        parse_choice("orientation", orientation),
        parse_choice("strategy", strategy),
        insert_by,
        seed,
    )
    keys = grid.keys(trials)
    for key in grid.keys(1):  # complains of what cannot be run before anything is
        kr5.sim.insertion_options(cell, make_setup(cell, key, insert_by, seed))
    to, text = terminal.console(json_file), sweep_file.cell_text(cell)
    with sweep_file.SweepFolder(output, grid, text) as folder:
        missing = begin_sweep(folder, keys, to)
        compare_first_trial(folder, cell, grid)
        tell_when_stopped(lambda: f"{len(folder.trials)} trials are kept in {output}; the same command continues")
        runner.run_trials(
            text, missing, grid, min(workers or core_count(), max(1, len(missing))), scheduler, folder.add
        )
        found = [folder.trials[key] for key in sorted(folder.trials)]
    found_tables = rate_table.rate_tables(found, grid)
    print_rates(found_tables, to)
    files = write_sweep_page(found_tables, grid, source.name, output / "report.html", png)
    if png:
        to.print(f"{png}: {len(files)} plots.", soft_wrap=True, markup=False)
    to.print(f"{output / 'report.html'}: open it in a browser.", soft_wrap=True, markup=False)
    writing.write_json(
        {"grid": grid.__dict__, "tables": found_tables, "trials": [t.__dict__ for t in found]}, json_file
    )


def begin_sweep(folder: SweepFolder, keys: list[Key], to: Console) -> list[Key]:
    """What is left to do, and a word on what is done."""
    if folder.note:
        terminal.print_note(f"{folder.note}.")
    missing = folder.missing(keys)
    if folder.trials:
        to.print(
            f"{folder.path}: {len(folder.trials)} trials are there, {len(missing)} to run.",
            soft_wrap=True,
            markup=False,
        )
    return list(missing)


def compare_first_trial(folder: SweepFolder, cell: kr5.cell.Cell, grid: Grid) -> None:
    """Runs one finished trial again: a library that has changed under the same version, or another machine, would mix
    two results."""
    first = min(folder.trials.values(), default=None)
    if first and repr(run_trial(cell, first.key, grid.insert_by, grid.seed)) != repr(first):  # in words NaN equals NaN
        which = f"trial {first.number} at {first.tilt:g} deg and {first.clearance:g} mm"
        terminal.print_note(
            f"{which} gives different numbers now: the library or the machine has changed, and the tables"
            " mix both; use another folder (-o) to separate them."
        )


def parse_choice(name: str, given: str) -> tuple[str, ...]:
    return BOTH[name] if given == "both" else (given,)


def print_rates(rate_tables: list[dict[str, Any]], to: Console) -> None:
    from kr5_tools.sweep import rate_table

    for table in rate_tables:
        columns = [name.replace(" [", "\n[").replace(" (", "\n(") for name in rate_table.COLUMNS]
        rows = [
            [cell.replace(" (", "\n(") if len(cell) > WIDEST else cell for cell in row]
            for row in rate_table.display_rows(table)
        ]
        to.print(tables.make_table(table_title(table), columns, rows))
        for text in rate_table.table_texts(table):
            to.print(text, soft_wrap=True, markup=False)
        to.print()
