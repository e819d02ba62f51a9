"""`kr5 gap diagnose`: why simulation and cell disagree."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import kr5
import kr5.cell
import kr5.gap
import typer
from kr5.files import results, writing
from kr5.logs.compared_source import ComparedSource, SourceOptions, input_files
from kr5.models.mujoco_check import MujocoCheck
from kr5.models.writing import WrittenModel

from kr5_tools.cli import arguments, terminal
from kr5_tools.cli.arm_file import BaseOption, TipOption
from kr5_tools.cli.options import options_from
from kr5_tools.cli.table_options import CheckOption, ColumnsOption, EpisodesOption
from kr5_tools.cli.terminal import Console
from kr5_tools.gap.diagnosis_run import run_diagnosis
from kr5_tools.gap.source import (
    ModelOption,
    SetOption,
    SourceArgument,
    TrustOption,
    overrides_of,
    read_source,
)
from kr5_tools.gap.terminal_report import print_diagnosis
from kr5_tools.gap.written_model import confirmed_in_mujoco, print_left_out
from kr5_tools.gap_report.diagnosis_file import DiagnosisFile, diagnosis_of

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
        help="Model with the causes in it, in the format of its ending: .urdf, .xml (MJCF), .sdf (Gazebo), .drake.sdf"
        " (Drake) or .py (actuators of Isaac Lab); where this is the format of --model, a copy of that file in which"
        " only what differs is changed.",
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
    columns: ColumnsOption = None,
    episodes: EpisodesOption = "",
    check: CheckOption = "",
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

    The source is a recording, or logs of a robot together with its model. In logs, columns are found by their names and
    numbers; measured angles replace the commands where none were logged or the model has no servo; the last part is
    kept to check the result. Effects are fitted on the `fit` experiments and evaluated on the `check` experiments.
    """
    options.validate()
    reading = SourceOptions(model, base, tip, every, overrides_of(overrides, columns), trust, episodes, check)
    outputs = DiagnoseOutputs(write_cell, write_model, write_recording, report, json_file, output)
    outputs.check(input_files(source, reading))
    to = terminal.console(json_file)
    compared = read_source(source, reading)
    outputs.check_model(compared)
    found = run_diagnosis(compared.recording, arguments.make_simulator(full), options)
    written, confirmed = None, None
    try:
        written = outputs.write_models(found.cell, compared, reading)
        confirmed = confirmed_in_mujoco(written, found.cell, compared, reading)
    finally:  # what was found is kept, even if a model cannot be written
        diagnosis = outputs.write_results(found, compared, confirmed, written)
    print_diagnosis(diagnosis, compared, to, everything, confirmed)
    if written is not None:
        print_model(written, found.cell if found.causes else None, compared.recording, to)
    outputs.write_report(diagnosis, compared, to)


@dataclass
class DiagnoseOutputs:
    """Files that a diagnosis writes."""

    cell: Path | None
    model: Path | None
    recording: Path | None
    report: Path | None
    json_file: Path | None
    result: Path | None

    def check(self, inputs: list[Path]) -> None:
        """Ends with an error where one of them cannot be written."""
        from kr5.models.kinds import kind_of_output

        writing.check_writable(self.cell, self.model, self.report, self.result, self.json_file, inputs=inputs)
        writing.check_page(self.report)
        if self.model:
            kind_of_output(self.model)
        if self.recording:
            writing.check_new_folder(self.recording)

    def check_model(self, compared: ComparedSource) -> None:
        """Ends with an error where the model that was read cannot be changed in place."""
        from kr5.models.writing import check_editable

        if original := self._original(compared):
            check_editable(original.file, original.base, original.tip)

    def write_results(
        self,
        found: kr5.gap.Diagnosis,
        compared: ComparedSource,
        check: MujocoCheck | None,
        written: WrittenModel | None,
    ) -> DiagnosisFile:
        """The recording and the result files; returns the result. `written`: the model, where it could be."""
        if self.recording:
            with writing.folder_beside(self.recording) as new:
                kr5.cell.save_recording(compared.recording, new)
            compared.inputs["recording"] = str(self.recording.resolve())
        data = json.loads(found.to_json())
        data |= {"mujoco": check.to_dict()} if check is not None else {}
        files = {"model": self.model if written else None, "cell": self.cell}
        if made := {kind: str(file) for kind, file in files.items() if file is not None}:
            data["written"] = made
        keys = {key: value for key, value in data.items() if key != "format"}
        result = results.write_result(self.result, data["format"], **keys, input=compared.inputs, seconds=found.seconds)
        writing.write_json(data, self.json_file)
        return diagnosis_of(found, result)

    def write_models(
        self, cell: kr5.cell.Cell, compared: ComparedSource, reading: SourceOptions
    ) -> WrittenModel | None:
        """The cell and the model with the causes in them; returns what became of the model, where one is asked for."""
        if self.cell:
            with writing.beside(self.cell) as new:
                kr5.cell.save_cell(cell, new)
        if not self.model:
            return None
        from kr5.models.writing import write_model

        original = self._original(compared)
        arm = (original.file, reading.base, reading.tip) if original else (None, "", "")
        return write_model(cell, self.model, *arm)

    def write_report(self, diagnosis: DiagnosisFile, compared: ComparedSource, to: Console) -> None:
        if not self.report:
            return
        from kr5_tools.gap_report.page import write_gap_report

        source = self.result or Path(compared.name)
        write_gap_report(diagnosis, source, self.report, recording=compared.recording)
        to.print(f"report: {self.report}", soft_wrap=True)

    def _original(self, compared: ComparedSource) -> Any:
        from kr5.models.writing import original_of

        return original_of(compared.model, self.model)


def print_model(written: WrittenModel, tuned: kr5.cell.Cell | None, recording: kr5.cell.Recording, to: Console) -> None:
    """Says where the model with the causes is, how far its gap is reduced, and what its format cannot hold. `tuned`:
    the cell with the causes; None: there is none."""
    if tuned is None:
        what = "model as it was read, since no cause is named"
    elif not written.folded:
        what = "model as it was read, which holds none of the causes"
    else:
        what = f"model with the causes in it{'' if written.losses else _reduction_text(recording, tuned)}"
    to.print(f"\n{written.file}: {what}.", soft_wrap=True, markup=False)
    print_left_out(written, to)


def _reduction_text(recording: kr5.cell.Recording, tuned: kr5.cell.Cell) -> str:
    """What a written model leaves in the whole recording, nothing fitted beside the causes."""
    simulator = arguments.make_simulator(False)
    before, after = (kr5.gap.measure(recording, simulator, cell).gap for cell in (recording.cell, tuned))
    return f"; over all columns of this log the gap falls from {before:.3g} to {after:.3g} times the noise"
