"""`kr5 identify servos`: torque servos, dry friction and inertias of all joints, from commands and positions."""

from pathlib import Path
from typing import Annotated, Any

import kr5.arm_log
import kr5.cell
import kr5.gap
import typer
from kr5.files.results import write_result
from kr5.files.writing import beside, check_writable, write_json
from kr5.logs.compared_source import SourceOptions, input_files
from kr5.models import writing as model_writing
from kr5.models.kinds import kind_of_output

from kr5_tools.cli import arguments
from kr5_tools.cli.arm_file import BaseOption, TipOption
from kr5_tools.cli.table_options import CheckOption, ColumnsOption, EpisodesOption
from kr5_tools.cli.tables import figure_row, make_table, print_result
from kr5_tools.cli.terminal import Console, console, spinner
from kr5_tools.gap.source import (
    ModelOption,
    SetOption,
    SourceArgument,
    TrustOption,
    overrides_of,
    print_source,
    read_source,
)
from kr5_tools.gap.written_model import confirmed_in_mujoco, print_left_out
from kr5_tools.gap_report.mujoco_sentences import check_sentences

app = typer.Typer()
OVERFIT = 1.5  # held-out error over fitted error that is a reason for a warning


@app.command(
    epilog="Example: kr5 identify servos monday.csv --model robot.xml --write-model tuned.xml -o servos.json",
)
def servos(
    source: SourceArgument,
    model: ModelOption = None,
    base: BaseOption = "",
    tip: TipOption = "",
    every: arguments.EveryOption = None,
    columns: ColumnsOption = None,
    episodes: EpisodesOption = "",
    check: CheckOption = "",
    overrides: SetOption = None,
    trust: TrustOption = False,
    write_cell: Annotated[
        Path | None, typer.Option("--write-cell", metavar="CELL.yaml", help="Cell file with the values found.")
    ] = None,
    write_model: Annotated[
        Path | None,
        typer.Option(
            "--write-model",
            metavar="MODEL",
            help="Model with the values found, in the format of its ending: .urdf, .xml (MJCF) or .sdf; where this is"
            " the format of --model, a copy of that file in which only what differs is changed. An MJCF is moved in"
            " MuJoCo, and states the dry friction that fits best there.",
        ),
    ] = None,
    everything: arguments.AllOption = False,
    output: arguments.ResultOption = None,
    json_file: arguments.JsonOption = None,
) -> None:
    """Stiffness and damping of torque servos, dry friction, rotor inertia and delay of the commands, of all joints
    together.

    The arm is simulated forward from its commands and compared with measured positions. Values of the model are no
    more than where the search begins; they may be wrong by a factor of a hundred. Part of the motion is held out and
    judges the result. No cause is named: kr5 gap diagnose does that. Exit code 2 when a log does not suffice.
    """
    reading = SourceOptions(model, base, tip, every, overrides_of(overrides, columns), trust, episodes, check)
    check_writable(write_cell, write_model, output, json_file, inputs=input_files(source, reading))
    if write_model:
        kind_of_output(write_model)
    compared = read_source(source, reading)
    if original := model_writing.original_of(compared.model, write_model):
        model_writing.check_editable(original.file, original.base, original.tip)
    with spinner("Fitting all joints"):
        found = kr5.arm_log.identify_servos(compared.recording)
    keys = result_keys(found, compared.inputs)
    out = console(json_file)
    print_source(compared, out, everything)
    print_result(keys, out)
    print_columns(found, out)
    if write_cell:
        with beside(write_cell) as new:
            kr5.cell.save_cell(found.cell, new)
    if write_model:
        arm = (original.file, base, tip) if original else (None, "", "")
        written = model_writing.write_model(found.cell, write_model, *arm)
        if check_found := confirmed_in_mujoco(written, found.cell, compared, reading):
            keys["mujoco"] = check_found.to_dict()
            out.print(" ".join(check_sentences(check_found)), soft_wrap=True)
        print_left_out(written, out)
    write_json(write_result(output, "kr5-servos/1", **keys), json_file)


def joint_text(cell: kr5.cell.Cell, target: str) -> str:
    """Name of a joint in the description of the robot, beside its number."""
    name = kr5.gap.joint_name(list(cell.robot.joint_names), target)
    number = target.removeprefix("joint")
    if target == number:
        return "all joints"
    return f"joint {number} ({name})" if name else f"joint {number}"


def result_keys(found: kr5.gap.JointFit, inputs: dict[str, Any]) -> dict[str, Any]:
    """What the result file holds beside its head."""
    catalogue = {effect.id: effect for effect in kr5.cell.effect_catalogue()}
    figures = []
    for effect in found.effects:
        value = effect.parameters[0]
        name = f"{joint_text(found.cell, effect.target)}: {catalogue[effect.effect].label}"
        unit = value.unit.replace(".", " ")
        figures.append(figure_row(name, value.value[0], value.std[0] if effect.determined else None, unit))
    return {
        "input": inputs,
        "verdict": verdict_of(found),
        "figures": figures,
        "result": found.to_dict(),
        "seconds": found.seconds,
    }


def verdict_of(found: kr5.gap.JointFit) -> dict[str, str]:
    """Good unless values are not determined, or the held-out part is predicted worse."""
    loose = [e for e in found.effects if not e.determined]
    checked = [c for c in found.columns if c.check_after > 0]
    warnings = []
    if loose:
        named = ", ".join(f"{e.effect} of {e.target}" for e in loose[:4])
        warnings.append(f"the motion does not tell {named}{' and others' if len(loose) > 4 else ''}")
    if worse := [c.column for c in checked if c.check_after > OVERFIT * max(c.after, c.noise)]:
        warnings.append(f"{', '.join(worse)}: predicted worse in the part that was held out")
    text = f"{len(found.effects)} values from {len(found.columns)} columns"
    return {"word": "doubtful" if warnings else "good", "text": "; ".join([text, *warnings])}


def print_columns(found: kr5.gap.JointFit, out: Console) -> None:
    rows = [
        [c.column, *(f"{1e3 * x:.3g}" for x in (c.noise, c.before, c.after, c.check_before, c.check_after))]
        for c in found.columns
    ]
    head = ["column", "noise", "fitted: model", "fitted: found", "held out: model", "held out: found"]
    out.print()
    out.print(make_table("Errors of the positions, RMS [mrad or mm]", head, rows))
