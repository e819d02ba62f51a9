"""`kr5 gap diagnose`: why simulation and cell disagree."""

import json
from pathlib import Path
from typing import Annotated, Any

import kr5.gap
import typer

from kr5_tools.cli import arguments, terminal
from kr5_tools.cli.options import options_from
from kr5_tools.files import results, writing
from kr5_tools.gap.terminal_report import print_diagnosis

Folder = Annotated[Path, typer.Argument(metavar="RECORDING", help="The folder of a recording (recording.yaml).")]
Report = Annotated[
    Path | None,
    typer.Option(
        "--report",
        metavar="PAGE.html",
        help=(
            "Page of the diagnosis: map of the cell, causes with evidence for and against, residuals before and after."
        ),
    ),
]
WriteCell = Annotated[
    Path | None, typer.Option("--write-cell", metavar="CELL.yaml", help="Cell file with the causes added.")
]


def add_to(app: typer.Typer) -> None:
    app.command(
        "diagnose", epilog="Example: kr5 gap diagnose recordings/monday --report gap.html --write-cell tuned.yaml"
    )(diagnose)


@options_from(kr5.gap.DiagnoseOptions)
def diagnose(
    folder: Folder,
    options: kr5.gap.DiagnoseOptions,
    write_cell: WriteCell = None,
    report: Report = None,
    full: arguments.FullOption = False,
    everything: arguments.AllOption = False,
    json_file: arguments.JsonOption = None,
    output: arguments.ResultOption = None,
) -> None:
    """Diagnosis of a gap: where it lies, which effects cause it, how far they reduce it, and what remains unexplained.

    Effects are fitted on the `fit` experiments of the recording and evaluated on its `check` experiments.
    """
    import kr5.cell

    options.validate()
    writing.check_writable(
        write_cell, report, output, json_file, inputs=[folder / "recording.yaml", folder / "cell.yaml"]
    )
    recording = kr5.cell.load_recording(folder)
    found = run_diagnosis(recording, arguments.make_simulator(full), options)
    data = json.loads(found.to_json())
    keys = {key: value for key, value in data.items() if key != "format"}
    result = results.write_result(
        output, "kr5-gap/1", **keys, input={"recording": str(folder.resolve())}, seconds=found.seconds
    )
    writing.write_json(data, json_file)
    if write_cell:
        with writing.beside(write_cell) as new:
            kr5.cell.save_cell(found.cell, new)
    print_diagnosis(data, folder, terminal.console(json_file), everything)
    if report:
        from kr5_tools.gap_report.page import write_gap_report

        write_gap_report(result, output or folder, report)
        terminal.console(json_file).print(f"report: {report}", soft_wrap=True)


def run_diagnosis(recording: Any, simulator: Any, options: Any) -> Any:
    """The diagnosis, with a bar for people at a terminal."""
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    if not terminal.errors.is_terminal:
        return kr5.gap.diagnose(recording, simulator, options)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with terminal.progress_bar(*columns) as bars:
        bar = bars.add_task("reading", total=1.0)

        def progress(stage: str, fraction: float) -> None:
            bars.update(bar, description=stage, completed=fraction)

        return kr5.gap.diagnose(recording, simulator, options, progress)
