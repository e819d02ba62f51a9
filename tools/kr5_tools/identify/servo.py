"""`kr5 identify servo`: natural frequency, damping and delay of a path correction or of joints, from a response."""

from pathlib import Path
from typing import Annotated, Any

import kr5
import kr5.cell
import numpy as np
import typer
from kr5 import cell, identification
from kr5.files.results import write_result
from kr5.files.writing import check_writable, write_json
from kr5.tables.options import TableOptions
from kr5.tables.roles import RUN, TIME, Role

from kr5_tools.cli.arguments import JsonOption, ResultOption
from kr5_tools.cli.cell_output import write_cell_file
from kr5_tools.cli.log_options import CellFileOption, SourceArgument, WriteCellFileOption
from kr5_tools.cli.options import options_from
from kr5_tools.cli.table_options import AngleUnit, ColumnsOption, EpisodeOption, LengthUnit, tell_notes
from kr5_tools.cli.tables import figure_row, print_result
from kr5_tools.cli.terminal import console, fail, spinner
from kr5_tools.identify.sensor_logs import (
    believed_cell,
    is_recording,
    need_target_cell,
    thinned,
    verdict_of,
)
from kr5_tools.identify.servo_logs import PATH, recorded_logs

app = typer.Typer()
COMMANDS, RESPONSES = ("cmd", "setpoint", "zc"), ("measured", "actual", "z")  # further names of columns


@app.command(epilog="Example:  kr5 identify servo RECORDING --write-cell cell.yaml -o servo.json")
@options_from(identification.ServoOptions)
def servo(
    source: SourceArgument,
    options: identification.ServoOptions,
    joint: Annotated[
        list[int] | None,
        typer.Option(help="Joint, counted from 1, in place of the path correction; may be given several times."),
    ] = None,
    columns: ColumnsOption = None,
    episodes: EpisodeOption = "",
    length: LengthUnit = None,
    angle: AngleUnit = None,
    cell_file: CellFileOption = None,
    write_cell: WriteCellFileOption = None,
    output: ResultOption = None,
    json_file: JsonOption = None,
) -> None:
    """Servo H(s) = k wn² / (s² + 2 ζ wn s + wn²) with its delay, by least squares over the whole response.

    Of a recording: the path correction from its steps, or with --joint joints from its motions. Of a log: columns t,
    command, response (and run), or those of --columns; with --joint, the servo of that joint, of which a log may have
    the columns of all joints. Exit code: 0 when there
    is a result, 2 when there is none or the input is invalid.
    """
    options.validate()
    check_writable(output, json_file, write_cell, inputs=[f for f in (source, cell_file) if f])
    recording = cell.load_recording(source) if is_recording(source) else None
    believed = believed_cell(recording, cell_file)
    need_target_cell(believed, write_cell)
    if joint and believed is not None and (wrong := [j for j in joint if not 1 <= j <= len(believed.robot.dh)]):
        fail(f"--joint: found {wrong[0]}, the arm has the joints 1 to {len(believed.robot.dh)}")
    wanted = TableOptions(columns, length=length, angle=angle, episodes=episodes)
    logs = recorded_logs(recording, joint, options) if recording else {_name(joint): _table_log(source, joint, wanted)}
    tell_notes(wanted.notes)
    results = {}
    with spinner("Identifying the servo"):
        for name, log in logs.items():
            found = identification.identify_servo(log, options)
            if not found.fit.usable:
                fail(f"{source}: {name}: {found.fit.message}")
            results[name] = found
    keys = _keys(source, logs, results)
    print_result(keys, console(json_file))
    if write_cell:
        for name, found in results.items():
            put_servo(believed, name, found)
        write_cell_file(believed, write_cell)
    write_json(write_result(output, "kr5-servo/1", **keys), json_file)


def _name(joint: list[int] | None) -> str:
    if not joint:
        return PATH
    if len(joint) > 1:
        fail("--joint: a log holds one response; give one joint")
    return f"joint {joint[0]}"


def _table_log(file: Path, joint: list[int] | None, wanted: TableOptions) -> Any:
    """The response of a log; of a joint by columns of its own, or among those of all joints."""
    kind = "angle" if joint else "length"
    number = joint[0] if joint else 0
    one = [TIME, Role("command", "command", kind, COMMANDS), Role("response", "response", kind, RESPONSES), RUN]
    every = [
        TIME,
        Role("qc", "commands of the joints", kind, counted=True),
        Role("q", "positions of the joints", kind, counted=True),
        RUN,
    ]
    try:
        table = wanted.read(file, one)
        command, response = table["command"], table["response"]
    except kr5.IoError:
        if not joint:
            raise
        table = wanted.read(file, every)
        if not all(1 <= number <= table[name].shape[1] for name in ("q", "qc")):
            fail(f"--joint: found {number}, {file} has the joints 1 to {table['q'].shape[1]}")
        command, response = table["qc"][:, number - 1], table["q"][:, number - 1]
    return identification.ServoLog(t=table["t"], command=command, response=response, run_starts=table.run_starts())


def put_servo(believed: kr5.cell.Cell, name: str, found: identification.ServoResult) -> None:
    """The servo into a cell, which has no place for its gain."""
    if name == PATH:
        identification.set_path_servo(believed, found.servo, found.cycle)
    else:
        identification.set_joint_servo(believed, int(name.split()[1]) - 1, found.servo, found.cycle)


def figures_of(name: str, found: identification.ServoResult) -> list[dict[str, Any]]:
    std = np.sqrt(np.diag(found.covariance))
    unit, scale = ("mm", 1e3) if name == PATH else ("mrad", 1e3)
    rows = [
        figure_row(f"{name}: natural frequency", found.servo.natural_frequency, float(std[0]), "rad/s"),
        figure_row(f"{name}: damping ratio", found.servo.damping_ratio, float(std[1]), "-"),
        figure_row(f"{name}: delay", 1e3 * found.servo.delay, 1e3 * float(std[2]), "ms"),
        figure_row(f"{name}: delay in cycles", found.servo.delay / found.cycle, float(std[2]) / found.cycle, "-"),
        figure_row(f"{name}: gain", found.gain, float(std[3]), "-"),
        figure_row(f"{name}: noise", scale * found.noise, None, unit),
        figure_row(f"{name}: maximum speed", scale * found.max_speed, None, f"{unit}/s"),
    ]
    if (by := found.overshoot) is not None:
        rows += [
            figure_row(f"{name}: overshoot", scale * by.overshoot, scale * found.noise, unit),
            figure_row(f"{name}: damping ratio by the overshoot", by.damping_ratio, None, "-"),
            figure_row(f"{name}: natural frequency by the overshoot", by.natural_frequency, None, "rad/s"),
        ]
    return rows


def _keys(source: Path, logs: dict[str, Any], results: dict[str, Any]) -> dict[str, Any]:
    figures = [row for name, found in results.items() for row in figures_of(name, found)]
    warnings = [f"{name}: {text}" for name, found in results.items() for text in found.warnings]
    limits = [f"{name}: {text}" for name, found in results.items() for text in found.overshoot_limits]
    text = "; ".join([f"identified from {sum(len(log.t) for log in logs.values())} samples", *limits])
    responses = []
    for name, found in results.items():
        log, keep = logs[name], thinned(len(logs[name].t))
        responses.append(
            {
                "name": name,
                "unit": "mm" if name == PATH else "mrad",
                "t": log.t[keep],
                "command": 1e3 * log.command[keep],
                "measured": 1e3 * log.response[keep],
                "predicted": 1e3 * found.predicted[keep],
                "run_starts": list(np.searchsorted(keep, log.run_starts)),
            }
        )
    result = {name: {k: v for k, v in found.to_dict().items() if k != "predicted"} for name, found in results.items()}
    return {
        "input": {"source": str(source), "samples": sum(len(log.t) for log in logs.values())},
        "verdict": verdict_of(text, warnings),
        "figures": figures,
        "responses": responses,
        "result": result,
    }
