"""`kr5 identify force-torque`: sensor and tool from readings in postures or in motion."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import kr5.cell
import numpy as np
import typer
from kr5 import cell, identification
from kr5.files.results import write_result
from kr5.files.writing import check_writable, write_json
from kr5.tables.options import TableOptions
from kr5.tables.roles import OPTIONAL_TIME, Role, joints_role
from kr5.tables.table import Table

from kr5_tools.cli.arguments import JsonOption, ResultOption
from kr5_tools.cli.cell_output import write_cell_file
from kr5_tools.cli.log_options import CellFileOption, SourceArgument, WriteCellFileOption
from kr5_tools.cli.options import options_from
from kr5_tools.cli.table_options import AngleUnit, ColumnsOption, EpisodeOption, JointColumns, tell_notes
from kr5_tools.cli.tables import figure_row, print_result
from kr5_tools.cli.terminal import console, fail, spinner
from kr5_tools.identify.sensor_logs import (
    believed_cell,
    experiments_of,
    is_recording,
    need_target_cell,
    thinned,
    verdict_of,
)

app = typer.Typer()
WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
FORCES = [Role(f"f{axis}", "force", "force", (f"force_{axis}", f"force.{axis}")) for axis in "xyz"]
TORQUES = [
    Role(f"t{axis}", "torque", "torque", (f"m{axis}", f"torque_{axis}", f"torque.{axis}"), largest=math.inf)
    for axis in "xyz"
]
GRAVITY = [Role(f"g{axis}", "gravity in the flange", needed=False) for axis in "xyz"]
LOADS = [
    Role("load_mass", "mass of the load", needed=False),
    *(Role(f"load_{axis}", "centre of the load", "length", needed=False) for axis in "xyz"),
]
LARGEST_TORQUE = 5e3  # no wrist sensor reads more [N m]


@app.command("force-torque", epilog="Example:  kr5 identify force-torque postures.csv --cell cell.yaml -o sensor.json")
@options_from(identification.ForceTorqueOptions, skip=("T_flange_sensor", "inertia"))
def force_torque(
    source: SourceArgument,
    options: identification.ForceTorqueOptions,
    columns: ColumnsOption = None,
    episodes: EpisodeOption = "",
    joints: JointColumns = None,
    angle: AngleUnit = None,
    cell_file: CellFileOption = None,
    write_cell: WriteCellFileOption = None,
    output: ResultOption = None,
    json_file: JsonOption = None,
) -> None:
    """Bias of a force/torque sensor, mass and centre of the tool below it; with options its drift, its orientation on
    the flange, gain and crosstalk.

    Of a recording: its motions, whose accelerations the joint servos of its cell give. Of a table: postures at rest,
    with fx fy fz tx ty tz in N and N m and q1 … (which needs --cell), or gx gy gz, gravity in the axes of the flange;
    and may have t, and load_mass, load_x, load_y, load_z of known loads (kg, m in the sensor). Exit code: 0 when there
    is a result, 2 when the readings do not determine it or the input is invalid.
    """
    options.validate()
    check_writable(output, json_file, write_cell, inputs=[f for f in (source, cell_file) if f])
    recording = cell.load_recording(source) if is_recording(source) else None
    believed = believed_cell(recording, cell_file)
    need_target_cell(believed, write_cell)
    if believed is not None and believed.tool is not None:
        options.T_flange_sensor = believed.tool.T_flange_sensor
        options.inertia = believed.tool.inertia
    wanted = TableOptions(columns, joints, angle=angle, episodes=episodes)
    with spinner("Reading the wrenches"):
        readings = _motion_readings(recording, believed) if recording else _table_readings(source, believed, wanted)
    tell_notes(wanted.notes)
    with spinner("Identifying sensor and tool"):
        found = identification.identify_force_torque(readings, options)
    if not found.fit.usable:
        fail(f"{source}: {found.fit.message}")
    keys = _keys(source, readings, found)
    print_result(keys, console(json_file))
    if write_cell:
        put_sensor(believed, found)
        write_cell_file(believed, write_cell)
    write_json(write_result(output, "kr5-force-torque/1", **keys), json_file)


def _motion_readings(recording: kr5.cell.Recording, believed: kr5.cell.Cell) -> list[Any]:
    readings = []
    for experiment in experiments_of(recording, "motion"):
        if "fx" not in experiment.data.columns:
            fail(f"{recording.folder}: {experiment.name}: has no wrench, the columns {', '.join(WRENCH)}")
        command = np.column_stack([experiment[f"qc{k + 1}"] for k in range(len(believed.robot.dh))])
        wrench = np.column_stack([experiment[name] for name in WRENCH])
        readings += identification.motion_readings(believed, experiment["t"], command, wrench)
    return readings


def _table_readings(file: Path, believed: kr5.cell.Cell, wanted: TableOptions) -> list[Any]:
    joints = None if believed is None else believed.nominal_chain().joints
    roles = [*FORCES, *TORQUES, OPTIONAL_TIME, *GRAVITY, *LOADS]
    table = wanted.read(file, [*roles, joints_role(joints, needed=False)], None if joints is None else len(joints))
    wrench = _stacked(table, WRENCH)
    if (most := float(np.abs(wrench[:, 3:]).max())) > LARGEST_TORQUE:
        fail(f"{file}: tx, ty, tz: torques of up to {most:.0f} N m; are they in N mm?")
    t = table["t"] if "t" in table else np.zeros(len(wrench))
    if all(axis in table for axis in ("gx", "gy", "gz")):
        gravity = _stacked(table, ("gx", "gy", "gz"))
        readings = [identification.ForceTorqueReading(wrench=w, gravity=g, t=s) for w, g, s in zip(wrench, gravity, t)]
    elif believed is None:
        fail(f"{file}: has no gravity (gx, gy, gz), and --cell is missing, from whose arm it follows with q1, q2, …")
    elif "q" not in table:
        raise table.lacks("q1, q2, …", "joint values", "--joints")
    else:
        readings = identification.posture_readings(believed, table["q"], wrench, t)
    if "load_mass" in table:
        for role in LOADS:
            if role.name not in table:
                raise table.lacks(role.name, role.what)
        for reading, load in zip(readings, _stacked(table, [role.name for role in LOADS])):
            reading.load_mass, reading.load_com = float(load[0]), load[1:]
    return readings


def _stacked(table: Table, roles: Sequence[str]) -> np.ndarray:
    return np.column_stack([table[role] for role in roles])


def put_sensor(believed: kr5.cell.Cell, found: identification.ForceTorqueResult) -> None:
    """Tool, sensor and its orientation into a cell."""
    identification.set_tool_mass(believed, found.mass, found.com)
    believed.tool.T_flange_sensor = found.T_flange_sensor
    identification.set_wrench_sensor(believed, found)


def _keys(
    source: Path, readings: list[identification.ForceTorqueReading], found: identification.ForceTorqueResult
) -> dict[str, Any]:
    warnings = list(found.warnings)
    if found.outliers:
        listed = ", ".join(str(i + 1) for i in found.outliers[:8])
        more = f" and {len(found.outliers) - 8} more" if len(found.outliers) > 8 else ""
        warnings.append(f"left out because they contradict the others: reading {listed}{more}")
    figures = [figure_row(p.name, p.value, p.std, p.unit) for p in found.parameters]
    figures.append(figure_row("noise of a force", found.force_noise, None, "N"))
    figures.append(figure_row("noise of a torque", found.torque_noise, None, "N m"))
    keep = thinned(len(readings))
    measured = np.array([readings[i].wrench for i in keep])
    result = {k: v for k, v in found.to_dict().items() if k != "predicted"}
    return {
        "input": {"source": str(source), "readings": len(readings)},
        "verdict": verdict_of(f"identified from {len(readings)} readings", warnings),
        "figures": figures,
        "wrenches": {"reading": keep + 1, "measured": measured.T, "predicted": found.predicted[keep].T},
        "result": result,
    }
