"""`kr5 insert`: one insertion of a peg into a tube in the simulated cell."""

from pathlib import Path
from typing import Annotated

import kr5.sim
import typer
from kr5.files import results, writing

from kr5_tools.cli import arguments, tables, terminal
from kr5_tools.cli.insertion_options import Cell
from kr5_tools.cli.options import options_from
from kr5_tools.cli.terminal import Console
from kr5_tools.insertion import directions, ending_tables, messages
from kr5_tools.insertion.task import load_cell, set_task

app = typer.Typer()

PAGE = Path("insertion.html")
SI_FIELDS = (
    "clearance",
    "tilt",
    "offset",
    "log",
    "pick_distance",
    "repeatability",
    "grip_error",
    "grip_tilt",
    "tube_tilt",
    "face_error",
    "lateral_stiffness",
    "angular_stiffness",
)  # the command line speaks mm and degrees


@app.command(epilog="Example: kr5 insert --clearance 0.05 --tilt 15 --offset 3 4 --view")
@options_from(kr5.sim.InsertionSetup, skip=SI_FIELDS, argument="setup")
def insert(
    setup: kr5.sim.InsertionSetup,
    cell_file: Cell = None,
    clearance: Annotated[
        float,
        typer.Option(
            metavar="MM",
            help="Clearance: radius of the bore less radius of the peg \\[mm]; the bore is set accordingly.",
        ),
    ] = 0.28,
    tilt: Annotated[float, typer.Option(metavar="DEG", help="Tilt of the peg during the turn \\[deg].")] = 15.0,
    offset: Annotated[
        tuple[float, float] | None,
        typer.Option(
            metavar="X Y",
            show_default=False,
            help=(
                "Offset of the true axis of the tube from the assumed one \\[mm]; by default random"
                " by the seed, within one radius of the peg."
            ),
        ),
    ] = None,
    view: Annotated[
        bool,
        typer.Option(
            "--view", help=f"Write the page ({PAGE} unless -o names another) and open it where there is a screen."
        ),
    ] = False,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="PAGE.html", help="Page with a 3D replay and plots."),
    ] = None,
    csv: Annotated[
        Path | None, typer.Option("--csv", metavar="ROWS.csv", help="CSV with one row per controller cycle (SI).")
    ] = None,
    png: arguments.PngOption = None,
    json_file: arguments.JsonOption = None,
) -> None:
    """Insertion of a peg into a tube in the simulated cell: tilted touch, one turn, slide, upright, push.

    Lengths are in mm and angles in degrees here; JSON and CSV are in SI. Exit code 1 when a peg is not inserted, 2
    for bad input.
    """
    output = output or (PAGE if view else None)
    writing.check_writable(output, csv, json_file, inputs=[cell_file])
    writing.check_page(output)
    cell, source = load_cell(cell_file)
    set_task(setup, clearance, tilt, offset, cell)
    with terminal.spinner("inserting"):
        result = kr5.sim.run_insertion(cell, setup)
    to = terminal.console(json_file)
    print_insertion(result, to)
    write_outputs(result, setup, source, to, output, csv, png)
    results.write_result(json_file, "kr5-insertion/1", **ending_tables.as_dict(result, setup))
    if view:
        writing.publish()
        terminal.open_page(output)
    if not result.inserted:
        raise typer.Exit(1)


def print_insertion(result: kr5.sim.InsertionResult, to: Console) -> None:
    """How each peg ended, then the figures."""
    for number, peg in enumerate(result.pegs, 1):
        to.print(messages.ending_sentence(number, peg), style="bold", soft_wrap=True, markup=False)
    x, y = (1e3 * v for v in result.T_tube_actual[:2, 3])
    to.print(tables.make_table("\nResult", ending_tables.PEG_COLUMNS, ending_tables.peg_rows(result)))
    to.print(
        f"{ending_tables.PEG_TEXT} The axis of the tube is assumed at (0, 0); its true position is ({x:.3f},"
        f" {y:.3f}) mm across it.",
        soft_wrap=True,
    )
    to.print(tables.make_table("\nPhases", ending_tables.PHASE_COLUMNS, ending_tables.phase_rows(result), text=(4,)))
    if turn := directions.table_rows(result):
        to.print(tables.make_table("\nDirection of the hole by the last turn", directions.COLUMNS, turn))


def write_outputs(
    result: kr5.sim.InsertionResult,
    setup: kr5.sim.InsertionSetup,
    source: Path,
    to: Console,
    output: Path | None,
    csv: Path | None,
    png: Path | None,
) -> None:
    """Rows, plots and page, where they are wanted."""
    if csv:
        import kr5.io

        with writing.beside(csv) as new:
            kr5.io.save_csv(result.rows, new)
        to.print(f"{csv}: {len(result.rows)} rows.", soft_wrap=True, markup=False)
    if not (output or png):
        return
    if len(result.rows) < 2:
        terminal.print_note("no motion, hence no page and no plot.")
        return
    from kr5_tools.insertion import page, plots
    from kr5_tools.pages import rendering
    from kr5_tools.pages.plot_style import plt

    with terminal.spinner("drawing"):
        drawn = plots.insertion_plots(result)
        if png:
            files = rendering.write_png(drawn, png)
            to.print(f"{png}: {len(files)} plots.", soft_wrap=True, markup=False)
        if output:
            writing.write_text(page.insertion_page(result, setup, drawn, source), output)
            to.print(f"{output}: open it in a browser.", soft_wrap=True, markup=False)
    for plot in drawn:
        plt.close(plot.figure)
