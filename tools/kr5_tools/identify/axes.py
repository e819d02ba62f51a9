"""`kr5 identify axes`: joint axes and Denavit-Hartenberg parameters from joints moved one at a time, without nominal
values."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from kr5 import calibration
from kr5.cell import load_cell
from kr5.files.results import write_result
from kr5.files.writing import check_writable, write_json
from kr5.tables.options import TableOptions
from kr5.tables.roles import joints_role
from kr5.tables.table import Table

from kr5_tools.calibrate.plot_files import write_plots
from kr5_tools.calibrate.postures import POINTS, POSE, measured
from kr5_tools.cli.arguments import JsonOption, PngOption, ResultOption
from kr5_tools.cli.options import options_from
from kr5_tools.cli.table_options import (
    AngleUnit,
    ColumnsOption,
    Convention,
    JointColumns,
    LengthUnit,
    PositionColumns,
    tell_notes,
)
from kr5_tools.cli.tables import figure_row, make_table, print_result
from kr5_tools.cli.terminal import Console, console, fail, spinner
from kr5_tools.identify.axis_sentences import axis_warnings, several_text, where
from kr5_tools.identify.image_turns import Mount, image_turn

app = typer.Typer()
# Parameters with the name in tables, and the scale and unit for people.
PARAMETERS = {
    "b": ("b", 1e3, "mm"),
    "theta": ("theta_offset", 180 / np.pi, "deg"),
    "a": ("a", 1e3, "mm"),
    "alpha": ("alpha", 180 / np.pi, "deg"),
    "beta": ("beta", 180 / np.pi, "deg"),
}


@app.command(epilog="Example:  kr5 identify axes turns.csv -o axes.json")
@options_from(calibration.JointAxisOptions)
def axes(
    files: Annotated[
        list[Path],
        typer.Argument(
            help=(
                "One table with joint values (q1, q2, …) and what was measured, in which one joint after the other"
                " moves and the others stand; or one table a joint, from the base, of what was measured while it moved;"
                " or one folder of images a joint, with --camera and --target."
            )
        ),
    ],
    options: calibration.JointAxisOptions,
    camera: Annotated[Path | None, typer.Option(help="Camera file, for folders of images.")] = None,
    target: Annotated[
        str | None,
        typer.Option(help="Target in the images, such as map.json of kr5 calibrate map, or grid:36h11:5x7:0.03:0.01."),
    ] = None,
    mount: Annotated[
        Mount,
        typer.Option(help="Camera on the arm before a fixed target, or fixed camera before a target on the arm."),
    ] = "eye_in_hand",
    upright: Annotated[
        Path | None,
        typer.Option(
            help=(
                "Table, or folder of images, in which joint 6 turns with the forearm along axis 1; in FILES it stands"
                " across. Lengths then also follow from distances of parallel axes."
            )
        ),
    ] = None,
    cell: Annotated[
        Path | None,
        typer.Option(help="Cell of this arm, only to detect mirrored and scaled measurements; nothing is fitted."),
    ] = None,
    columns: ColumnsOption = None,
    joints: JointColumns = None,
    position: PositionColumns = None,
    convention: Convention = None,
    length: LengthUnit = None,
    angle: AngleUnit = None,
    output: ResultOption = None,
    png: PngOption = None,
    json_file: JsonOption = None,
) -> None:
    """Circle-point analysis: each joint's axis from the arc it traces, with its quality and uncertainty, and the DH
    parameters of the arm by dual vectors, parallel and intersecting axes included. No nominal values are needed.

    Exit code: 0 when every axis was found, 2 when one was not or the input is invalid.
    """
    options.validate()
    check_writable(output, json_file, inputs=[f for f in (*files, camera, upright, cell) if f])
    wanted = TableOptions(columns, joints, position, convention, length, angle)
    turns = _image_turns(files, camera, target, mount) if files[0].is_dir() else _turns(files, wanted)
    tell_notes(wanted.notes)
    nominal = load_cell(cell).nominal_chain() if cell else None
    with spinner("Identifying the axes"):
        result = calibration.identify_arm_axes(
            turns.samples, turns.home, calibration.ArmAxesOptions(axis=options, nominal=nominal)
        )
    for k, axis in enumerate(result.axes):
        if not axis.fit.usable:
            fail(f"joint {k + 1}{where(turns.labels[k])}: {axis.fit.message}")
    keys = _keys(files, turns, result)
    if upright:
        _add_lengths(keys, result, _upright_axis(upright, wanted, camera, target, mount, options))
    out = console(json_file)
    _show(result.axes, keys, out)
    data = write_result(output, "kr5-axes/1", **keys)
    for file in write_plots(data, png):
        out.print(f"plot: {file}", soft_wrap=True)
    write_json(data, json_file)


@dataclass
class Turns:
    """Samples of each joint, what each is called in the input, and the joint values at which the others stood."""

    home: np.ndarray
    samples: list[list[Any]] = field(default_factory=list)
    labels: list[list[str]] = field(default_factory=list)


def _image_turns(folders: list[Path], camera: Path | None, target: str | None, mount: str) -> Turns:
    out = Turns(np.zeros(len(folders)))
    for folder in folders:
        samples, labels = image_turn(folder, camera, target, mount)
        out.samples.append(samples)
        out.labels.append(labels)
    return out


def _table_turn(file: Path, wanted: TableOptions) -> tuple[list[Any], list[str]]:
    """Samples of a table in which one joint turns, with its joint value where there is one that varies alone."""
    return _turn_of(wanted.read(file, [POSE, POINTS]), file)


def _turn_of(table: Table, file: Path) -> tuple[list[Any], list[str]]:
    rows = measured(table)
    labels = [f"{file.name} {table.row(i)}" for i in range(len(rows))]
    return [calibration.JointSample(**row) for row in rows], labels


def _turns(files: list[Path], wanted: TableOptions) -> Turns:
    if len(files) > 1:
        out = Turns(np.zeros(len(files)))
        for one in files:
            samples, labels = _table_turn(one, wanted)
            out.samples.append(samples)
            out.labels.append(labels)
        return out
    file = files[0]
    table = wanted.read(file, [joints_role(needed=False), POSE, POINTS])
    if "q" not in table:
        samples, labels = _turn_of(table, file)
        wanted.notes.append(f"{file}: without joint values it is read as the turn of one joint.")
        return Turns(np.zeros(1), [samples], [labels])
    q = np.asarray(table["q"])
    split = calibration.split_turns(q)
    if split.several:
        fail(f"{file}: {several_text(split, [table.row(one.row) for one in split.several])}")
    seen = measured(table)
    if split.still:
        fail(f"{file}: joint {split.still[0] + 1} did not move")
    turns = Turns(split.home)
    for k, rows in enumerate(split.rows):
        turns.samples.append([calibration.JointSample(q=float(q[i, k]), **seen[i]) for i in rows])
        turns.labels.append([table.row(i) for i in rows])
    return turns


def _upright_axis(
    source: Path,
    wanted: TableOptions,
    camera: Path | None,
    target: str | None,
    mount: str,
    options: calibration.JointAxisOptions,
) -> calibration.JointAxisResult:
    """Axis 6 with the forearm upright."""
    samples, labels = image_turn(source, camera, target, mount) if source.is_dir() else _table_turn(source, wanted)
    result = calibration.identify_joint_axis(samples, options)
    if not result.fit.usable:
        fail(f"{source}: joint 6{where(labels)}: {result.fit.message}")
    return result


def _add_lengths(
    keys: dict[str, Any], result: calibration.ArmAxesResult, sixth_upright: calibration.JointAxisResult
) -> None:
    """Lengths from distances of parallel axes, beside those from the common normals."""
    found = calibration.identify_upright_lengths(result, sixth_upright)
    lengths = found.lengths
    if not lengths.fit.usable:
        fail(f"--upright: {lengths.fit.message}")
    spread = 1e3 * np.sqrt(np.diag(lengths.covariance))
    for k, name in enumerate(("a1", "a2", "a3", "b4")):
        label = f"{name}, by parallel planes"
        keys["figures"].append(figure_row(label, 1e3 * getattr(lengths, name), float(spread[k]), "mm"))
    keys["result"] |= {"parallel_planes": lengths.to_dict(), "axis_distances": found.distances.to_dict()}


def _parameter_row(parameter: calibration.ArmParameter) -> dict[str, Any]:
    name, scale, unit = PARAMETERS[str(parameter.parameter)]
    return figure_row(f"joint{parameter.joint + 1}.{name}", scale * parameter.value, scale * parameter.std, unit)


def _keys(files: list[Path], turns: Turns, result: calibration.ArmAxesResult) -> dict[str, Any]:
    warnings = axis_warnings(result, turns.labels)
    worst = min(range(len(result.axes)), key=lambda k: result.axes[k].quality)
    text = (
        f"{len(result.axes)} axes; the least certain is that of joint {worst + 1}, whose singular values are"
        f" {result.axes[worst].quality:.0f} to 1"
    )
    frames = [{"name": "device", "parent": None, "T": np.eye(4)}]
    frames += [{"name": f"axis {k + 1}", "parent": "device", "T": r.T_world_axis} for k, r in enumerate(result.axes)]
    return {
        "input": {"files": [str(f) for f in files]},
        "verdict": {"word": "doubtful" if warnings else "good", "text": "; ".join([text, *warnings])},
        "figures": [_parameter_row(one) for one in result.parameters],
        "frames": frames,
        "result": result.to_dict(),
    }


def _show(results: list[calibration.JointAxisResult], data: dict[str, Any], out: Console) -> None:
    print_result(data, out)
    rows = []
    for k, r in enumerate(results):
        tilt = 180 / np.pi * float(np.sqrt(np.trace(r.covariance[2:, 2:])))
        offset = 1e3 * float(np.sqrt(np.trace(r.covariance[:2, :2])))
        rows.append([f"{k + 1}", f"{r.quality:.0f}", 180 / np.pi * r.arc, 1e3 * r.rms, offset, tilt, len(r.outliers)])
    names = ["joint", "s1/s3 [-]", "arc [deg]", "RMS [mm]", "± offset [mm]", "± tilt [deg]", "outliers"]
    out.print()
    out.print(make_table("Axes", names, rows))
