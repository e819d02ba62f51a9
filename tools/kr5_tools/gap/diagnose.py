"""`kr5 gap diagnose`: why simulation and cell disagree."""

import contextlib
import json
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import kr5.gap
import typer

from kr5_tools.cli import arguments, tables, terminal
from kr5_tools.cli.options import options_from
from kr5_tools.files import results, writing
from kr5_tools.gap.source import (
    BaseOption,
    ComparedSource,
    ModelOption,
    SetOption,
    SourceArgument,
    SourceOptions,
    TipOption,
    TrustOption,
    input_files,
    open_source,
    print_source,
)
from kr5_tools.gap.terminal_report import print_diagnosis

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
WriteModel = Annotated[
    Path | None,
    typer.Option(
        "--write-model",
        metavar="MODEL",
        help="Model with the causes in it, in the format of its ending: .urdf, .xml (MJCF) or .sdf; the model given is"
        " changed where its format is the same.",
    ),
]
WriteRecording = Annotated[
    Path | None,
    typer.Option(
        "--write-recording",
        metavar="FOLDER",
        help="Recording made of the logs, for other commands; must not exist yet.",
    ),
]
MOST_EFFECTS = 16  # that are searched for in the log of a real arm


def add_to(app: typer.Typer) -> None:
    app.command(
        "diagnose",
        epilog="Examples: kr5 gap diagnose monday.csv --model robot.urdf --report gap.html --write-model tuned.urdf;"
        " kr5 gap diagnose recordings/monday --report gap.html --write-cell tuned.yaml",
    )(diagnose)


@options_from(kr5.gap.DiagnoseOptions)
def diagnose(
    source: SourceArgument,
    options: kr5.gap.DiagnoseOptions,
    model: ModelOption = None,
    base: BaseOption = "",
    tip: TipOption = "",
    every: arguments.EveryOption = None,
    overrides: SetOption = None,
    trust: TrustOption = False,
    write_cell: WriteCell = None,
    write_model: WriteModel = None,
    write_recording: WriteRecording = None,
    report: Report = None,
    full: arguments.FullOption = False,
    everything: arguments.AllOption = False,
    json_file: arguments.JsonOption = None,
    output: arguments.ResultOption = None,
) -> None:
    """Diagnosis of a gap: where it lies, which effects cause it, how far they reduce it, and what remains unexplained.

    Of a recording, or of logs of a robot with its model: columns are found by their names and numbers, measured angles
    stand for the motion where the model has no servo, the last part is kept to check. Effects are fitted on the `fit`
    experiments and evaluated on the `check` experiments.
    """
    import kr5.cell

    options.validate()
    reading = SourceOptions(model, base, tip, every, overrides or [], trust)
    writing.check_writable(write_cell, write_model, report, output, json_file, inputs=input_files(source, reading))
    if write_recording:
        writing.check_new_folder(write_recording)
    to = terminal.console(json_file)
    compared = open_source(source, reading)
    print_source(compared, to, everything)
    if compared.simulator_errors:
        search_widely(options, compared.recording.cell.robot.joints)
        options.simulator_errors = compared.simulator_errors
    found = run_diagnosis(compared.recording, arguments.make_simulator(full), options)
    data = json.loads(found.to_json())
    if write_recording:
        with writing.folder_beside(write_recording) as new:
            kr5.cell.save_recording(compared.recording, new)
        compared.inputs["recording"] = str(write_recording.resolve())
    keys = {key: value for key, value in data.items() if key != "format"}
    result = results.write_result(output, "kr5-gap/1", **keys, input=compared.inputs, seconds=found.seconds)
    writing.write_json(data, json_file)
    if write_cell:
        with writing.beside(write_cell) as new:
            kr5.cell.save_cell(found.cell, new)
    if write_model:
        write_tuned_model(found.cell, compared, write_model, reading, to)
    print_diagnosis(data, compared.command, to, everything)
    if report:
        from kr5_tools.gap_report.page import write_gap_report

        with on_disk(compared, write_recording) as folder:
            write_gap_report(result | {"input": {"recording": str(folder)}}, output or folder, report)
        to.print(f"report: {report}", soft_wrap=True)


def search_widely(options: Any, joints: int) -> None:
    """Settings for the log of a real arm, whose description states friction of no joint, or a placeholder for each:
    many effects at once, the best set of each size only. What was set by the user stays."""
    usual = kr5.gap.DiagnoseOptions()
    for name, value in (("max_effects", min(2 * joints + 2, MOST_EFFECTS)), ("beam", 1), ("refits", 4)):
        if getattr(options, name) == getattr(usual, name):
            setattr(options, name, value)


@contextlib.contextmanager
def on_disk(compared: ComparedSource, kept: Path | None) -> Iterator[Path]:
    """The folder of a recording, which of logs is made for the time being."""
    import kr5.cell

    if folder := compared.folder or kept:
        yield folder.resolve()
        return
    with tempfile.TemporaryDirectory() as made:
        new = Path(made) / "recording"
        kr5.cell.save_recording(compared.recording, new)
        yield new


def write_tuned_model(cell: Any, compared: ComparedSource, output: Path, reading: SourceOptions, to: Any) -> None:
    """Writes the model with the causes in it, and says what its format cannot hold."""
    from kr5_tools.model_files.kinds import kind_of_output
    from kr5_tools.model_files.writing import write_model

    model = compared.model
    original = model.file if model is not None and model.kind == kind_of_output(output) else None
    written = write_model(cell, output, original, reading.base if original else "", reading.tip if original else "")
    to.print(f"{output}: model with the causes in it.", soft_wrap=True, markup=False)
    if written.losses:
        rows = [[x.effect, x.target, x.reason] for x in written.losses]
        to.print(tables.make_table("Not in the model", ["effect", "target", "reason"], rows, text=(1, 2)))


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
