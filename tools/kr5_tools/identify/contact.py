"""`kr5 identify contact`: stiffness and position of a contact from force against depth, and the force loop on it."""

from pathlib import Path
from typing import Annotated, Any

import kr5.cell
import kr5.force
import kr5.identification
import numpy as np
import typer
from kr5 import cell, force, identification
from kr5.files.results import write_result
from kr5.files.writing import check_writable, write_json
from kr5.tables.options import TableOptions
from kr5.tables.roles import OPTIONAL_TIME, RUN, Role

from kr5_tools.cli.arguments import JsonOption, ResultOption
from kr5_tools.cli.cell_output import write_cell_file
from kr5_tools.cli.log_options import CellFileOption, SourceArgument, WriteCellFileOption
from kr5_tools.cli.options import options_from
from kr5_tools.cli.table_options import ColumnsOption, EpisodeOption, LengthUnit, tell_notes
from kr5_tools.cli.tables import figure_row, make_table, print_result
from kr5_tools.cli.terminal import console, fail, spinner
from kr5_tools.identify.sensor_logs import (
    believed_cell,
    experiments_of,
    is_recording,
    joined_runs,
    need_target_cell,
    thinned,
    verdict_of,
)
from kr5_tools.identify.servo_logs import PATH, recorded_logs

app = typer.Typer()
DEG = 180 / np.pi
DEPTH = Role("depth", "depth of the tool", "length")
FORCE = Role("force", "force of the contact", "force")


@app.command(epilog="Example:  kr5 identify contact RECORDING --design --write-cell cell.yaml -o contact.json")
@options_from(identification.ContactStiffnessOptions)
@options_from(identification.ForceLoopDesignOptions, argument="design_options")
@options_from(force.ForceLoopOptions, skip=("stiffness", "largest_step", "range"), argument="loop")
def contact(
    source: SourceArgument,
    options: identification.ContactStiffnessOptions,
    design_options: identification.ForceLoopDesignOptions,
    loop: force.ForceLoopOptions,
    design: Annotated[
        bool,
        typer.Option(
            "--design",
            help=(
                "Also design the force loop: compensator, errors, margins over a range of stiffness; with the"
                " servo from the steps of the recording, else that of the cell."
            ),
        ),
    ] = False,
    columns: ColumnsOption = None,
    episodes: EpisodeOption = "",
    length: LengthUnit = None,
    cell_file: CellFileOption = None,
    write_cell: WriteCellFileOption = None,
    output: ResultOption = None,
    json_file: JsonOption = None,
) -> None:
    """Stiffness and position of a contact from force against depth, with errors in both.

    Of a recording: its press experiments, with the noise of its cell and the damping. Of a log: columns depth and force
    (and t, run), both positive into the contact, or those of --columns. Exit code: 0 when there is a result, 2 when
    there is none or the input is invalid.
    """
    options.validate()
    design_options.validate()
    check_writable(output, json_file, write_cell, inputs=[f for f in (source, cell_file) if f])
    recording = cell.load_recording(source) if is_recording(source) else None
    believed = believed_cell(recording, cell_file)
    need_target_cell(believed, write_cell)
    log = (
        recorded_log(recording, options)
        if recording
        else _table_log(source, TableOptions(columns, length=length, episodes=episodes))
    )
    with spinner("Identifying the contact"):
        found = identification.identify_contact_stiffness(log, options)
    if not found.fit.usable:
        fail(f"{source}: {found.fit.message}")
    plan = _design(found, loop, design_options, recording, believed) if design else None
    keys = _keys(source, log, found, plan)
    out = console(json_file)
    print_result(keys, out)
    if plan is not None:
        out.print()
        out.print(_design_table(plan))
    if write_cell:
        put_contact(believed, found)
        write_cell_file(believed, write_cell)
    write_json(write_result(output, "kr5-contact/1", **keys), json_file)


def recorded_log(recording: kr5.cell.Recording, options: kr5.identification.ContactStiffnessOptions) -> Any:
    """The press experiments of a recording: the tool goes down along Z of the base, and contact takes from the weight
    that the sensor shows."""
    values, starts = joined_runs(experiments_of(recording, "press"), ["t", "z", "fz"])
    noise = recording.cell.noise
    options.position_noise = options.position_noise or noise.position
    options.force_noise = options.force_noise or noise.force
    options.fit_damping = True
    return identification.ContactLog(depth=-values[:, 1], force=-values[:, 2], t=values[:, 0], run_starts=starts)


def _table_log(file: Path, wanted: TableOptions) -> Any:
    table = wanted.read(file, [DEPTH, FORCE, OPTIONAL_TIME, RUN])
    tell_notes(wanted.notes)
    log = identification.ContactLog(depth=table["depth"], force=table["force"], run_starts=table.run_starts())
    if "t" in table:
        log.t = table["t"]
    return log


def put_contact(believed: kr5.cell.Cell, found: kr5.identification.ContactStiffnessResult) -> None:
    """Stiffness, and damping where it was estimated, into a cell."""
    identification.set_contact_stiffness(believed, found.stiffness)
    if found.covariance[3, 3] > 0:
        believed.contact.damping = max(found.damping, 0.0)


def _design(
    found: kr5.identification.ContactStiffnessResult,
    loop: kr5.force.ForceLoopOptions,
    options: kr5.identification.ForceLoopDesignOptions,
    recording: kr5.cell.Recording | None,
    believed: kr5.cell.Cell | None,
) -> Any:
    """The force loop on the identified contact."""
    plant = identification.ForceLoopPlant(stiffness=found.stiffness, damping=max(found.damping, 0.0))
    if recording is not None and any(str(e.kind) == "step" and str(e.split) == "fit" for e in recording.experiments):
        servo_options = identification.ServoOptions()
        steps = identification.identify_servo(recorded_logs(recording, None, servo_options)[PATH], servo_options)
        if not steps.fit.usable:
            fail(f"--design: the steps of the recording: {steps.fit.message}")
        plant.servo, plant.servo_gain = steps.servo, steps.gain
    elif believed is not None and believed.servo is not None and believed.servo.tool is not None:
        plant.servo = believed.servo.tool
    else:
        fail("--design: needs a servo: a recording with steps, or --cell with servo.tool (kr5 identify servo)")
    if believed is not None and believed.servo is not None:
        plant.cycle = believed.servo.cycle
    loop.stiffness = found.stiffness
    servo = plant.servo
    servo.delay = max(servo.delay, 0.0)
    plant.servo = servo
    return identification.design_force_loop(plant, loop, options)


def _figures(
    found: kr5.identification.ContactStiffnessResult, plan: kr5.identification.ForceLoopDesign | None
) -> list[dict[str, Any]]:
    std = np.sqrt(np.diag(found.covariance))
    rows = [
        figure_row("stiffness", 1e-3 * found.stiffness, 1e-3 * float(std[0]), "N/mm"),
        figure_row("position of contact", 1e3 * found.position, 1e3 * float(std[1]), "mm"),
        figure_row("force without contact", found.force_offset, float(std[2]), "N"),
    ]
    if std[3] > 0:
        rows.append(figure_row("damping", found.damping, float(std[3]), "N s/m"))
    if std[4] > 0:
        rows.append(figure_row("hardening", 1e-3 * found.hardening, 1e-3 * float(std[4]), "1/mm"))
    if found.unloading_stiffness is not None:
        both = float(np.sqrt(std[0] ** 2 + std[5] ** 2 + 2 * found.covariance[0, 5]))
        rows.append(figure_row("stiffness on the way out", 1e-3 * found.unloading_stiffness, 1e-3 * both, "N/mm"))
    rows.append(figure_row("noise of the force", found.noise, None, "N"))
    if plan is not None:
        point = plan.nominal
        rows += [
            figure_row("force loop: compensator", plan.compensator, None, "-"),
            figure_row("force loop: steady error without it", 100 * plan.uncompensated_error, None, "%"),
            figure_row("force loop: limit of the gain", 1e3 * point.gain_limit, None, "mm/N"),
            figure_row("force loop: gain margin", point.gain_margin, None, "-"),
            figure_row("force loop: overshoot", 100 * point.overshoot, None, "%"),
            figure_row("force loop: settling time", point.settling_time, None, "s"),
            figure_row("force loop: maximum contact speed", 1e3 * plan.contact_speed, None, "mm/s"),
            figure_row("force loop: recommended gain", 1e3 * plan.recommended_gain, None, "mm/N"),
        ]
    return rows


def _design_table(plan: kr5.identification.ForceLoopDesign) -> Any:
    names = [
        "stiffness [N/mm]",
        "stable",
        "gain limit [mm/N]",
        "gain margin [-]",
        "phase margin [deg]",
        "steady error [%]",
        "overshoot [%]",
        "settling [s]",
    ]
    rows = []
    for p in plan.range:
        margin = f"{DEG * p.phase_margin:.1f}" if p.phase_margin is not None else "–"
        responses = [100 * p.steady_error, 100 * p.overshoot, p.settling_time] if p.stable else ["–"] * 3
        stable = "yes" if p.stable else "no"
        rows.append([f"{1e-3 * p.stiffness:.3g}", stable, 1e3 * p.gain_limit, p.gain_margin, margin, *responses])
    return make_table("Force loop over the stiffness", names, rows, text=(1,))


def _keys(
    source: Path,
    log: kr5.identification.ContactLog,
    found: kr5.identification.ContactStiffnessResult,
    plan: kr5.identification.ForceLoopDesign | None,
) -> dict[str, Any]:
    warnings = list(found.warnings)
    if found.outliers:
        listed = ", ".join(str(i + 1) for i in found.outliers[:8])
        more = f" and {len(found.outliers) - 8} more" if len(found.outliers) > 8 else ""
        warnings.append(f"left out because they contradict the others: reading {listed}{more}")
    if plan is not None and not plan.nominal.stable:
        warnings.append("the force loop is not stable at this gain")
    text = f"{found.contact_readings} readings in contact, {found.free_readings} before it"
    keep = thinned(len(log.depth))
    result = {k: v for k, v in found.to_dict().items() if k != "predicted"}
    return {
        "input": {"source": str(source), "readings": len(log.depth)},
        "verdict": verdict_of(text, warnings),
        "figures": _figures(found, plan),
        "contact": {
            "depth": 1e3 * log.depth[keep],
            "measured": log.force[keep],
            "predicted": found.predicted[keep],
        },
        **({"design": plan.to_dict()} if plan is not None else {}),
        "result": result,
    }
