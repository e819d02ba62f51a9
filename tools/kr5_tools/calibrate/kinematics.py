"""`kr5 calibrate kinematics`: the arm's true Denavit-Hartenberg parameters from measured postures."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import kr5.cell
import kr5.kinematics
import numpy as np
import typer
from kr5 import calibration, cell
from kr5.files.results import write_if_usable, write_result
from kr5.files.writing import check_writable
from kr5.tables.options import TableOptions

from kr5_tools.calibrate.further_postures import held_out_text, judge, require_placing
from kr5_tools.calibrate.kinematics_figures import change_text, is_significant, left_out_notes, shown_name
from kr5_tools.calibrate.plot_files import write_plots
from kr5_tools.calibrate.posture_checks import posture_warnings, require_motion, require_order
from kr5_tools.calibrate.postures import read_postures, read_socket, recorded_postures
from kr5_tools.calibrate.recorded_arm import (
    CameraCheck,
    add_torques,
    believe_camera,
    recorded_views,
    refined_cell,
    use_recording,
)
from kr5_tools.cli.arguments import JsonOption, PngOption, ResultOption
from kr5_tools.cli.cell_output import write_cell_file
from kr5_tools.cli.numbers import table_unit
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
from kr5_tools.cli.terminal import Console, console, fail, print_note, spinner
from kr5_tools.exports.command_line import Exports, export_options

app = typer.Typer()


@app.command(epilog="Example:  kr5 calibrate kinematics postures.csv --cell cell.yaml -o kinematics.json")
@options_from(
    calibration.KinematicsOptions,
    skip=(
        *("max_iterations", "T_world_base", "T_flange_tool", "hold", "joint_errors", "elasticity"),
        *("camera", "T_flange_camera", "T_base_target"),
    ),
)
@export_options("poses")
def calibrate_kinematics(
    options: calibration.KinematicsOptions,
    exports: Exports,
    postures: Annotated[
        Path | None,
        typer.Argument(
            help=(
                "Table of joint values and what was measured: one point (x y z), several (x1 y1 z1 x2 …) or a pose (x y"
                " z and an orientation); or the folder of a recording with poses, and views of the board by the camera."
            )
        ),
    ] = None,
    cell_file: Annotated[
        Path | None, typer.Option("--cell", help="Cell with the nominal arm; by default that of the recording.")
    ] = None,
    socket: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=FILE", help="Joint values with the tip in a fixed socket; may be given several times."
        ),
    ] = None,
    distance: Annotated[
        list[str] | None,
        typer.Option(metavar="A,B,METRES", help="Known distance of two sockets; may be given several times."),
    ] = None,
    check: Annotated[Path | None, typer.Option(help="Table of further postures, for validation only.")] = None,
    columns: ColumnsOption = None,
    joints: JointColumns = None,
    position: PositionColumns = None,
    convention: Convention = None,
    length: LengthUnit = None,
    angle: AngleUnit = None,
    known_base: Annotated[
        bool, typer.Option("--known-base", help="The measuring device reports in the base of the arm.")
    ] = False,
    known_tool: Annotated[
        bool, typer.Option("--known-tool", help="The measured tool is that of the cell, exactly.")
    ] = False,
    joint_errors: Annotated[
        bool, typer.Option(help="Also estimate errors of the joints once and twice a turn.")
    ] = True,
    elasticity: Annotated[
        bool,
        typer.Option("--elasticity", help="Estimate the compliance of each joint under gravity by the cell's masses."),
    ] = False,
    hold: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help=(
                "Parameter to keep at its nominal value: arm.joint2.a (or b, theta_offset, alpha, beta), tool.x, or all"
                " of base, tool, camera or target; may be given several times."
            ),
        ),
    ] = None,
    write_cell: Annotated[
        Path | None,
        typer.Option(
            metavar="OUT.yaml",
            help="Cell to write with the identified arm; from a recording also with tool, camera and board.",
        ),
    ] = None,
    output: ResultOption = None,
    png: PngOption = None,
    json_file: JsonOption = None,
) -> None:
    """Kinematic calibration: the arm's true DH parameters with their uncertainty, from postures measured by a tracker,
    a camera or any other device, or from postures whose tip rested in sockets.

    Exit code: 0 when there is a result, 2 when there is none or the input is invalid.
    """
    read = [f for f in (postures, cell_file, check) if f]
    check_writable(output, json_file, write_cell, *exports.files, inputs=read)
    recording = cell.load_recording(postures) if postures and postures.is_dir() else None
    believed = _cell(cell_file, recording)
    chain = believed.nominal_chain()
    wanted = TableOptions(columns, joints, position, convention, length, angle)
    seen = _fit_postures(postures, recording, chain, wanted)
    views = recorded_views(recording, "fit", len(chain.joints)) if recording else []
    if recording:
        use_recording(options, believed, bool(views), known_tool)
    _complete(options, believed, known_base, known_tool, joint_errors, hold, write_cell)
    seen += views
    for entry in socket or []:
        name, equals, file = entry.partition("=")
        if not (name and equals and file):
            fail(f"--socket: found {entry!r}, expected NAME=FILE, e.g. left=left.csv")
        seen += read_socket(name, Path(file), chain.joints, wanted)
    if not seen:
        fail("there are no postures; specify a table, the folder of a recording, or --socket")
    if elasticity:
        options.elasticity = True
        add_torques(seen, believed)
    require_motion(chain, seen)
    distances = [_distance(text) for text in distance or []]
    further = _check_postures(recording, check, chain, wanted)
    tell_notes(wanted.notes)
    require_placing(seen, further)
    camera_check = None
    with spinner("Comparing the rows"):
        found = require_order(chain, seen)
        require_order(chain, further)
    with spinner("Calibrating"):
        result = calibration.calibrate_kinematics(chain, seen, distances, options)
        if views:
            result, camera_check = believe_camera(chain, seen, options, result)
    if elasticity:
        add_torques(further, believed)
    held_out, unjudged = judge(result, chain, seen, further, distances, options) if result.fit.usable else ({}, [])
    warnings = [*posture_warnings(found, seen, result), *unjudged]
    if not result.fit.usable:
        result.fit.message = "; ".join([*warnings, result.fit.message])  # what is wrong with the rows comes first
    keys = _keys(result, warnings, held_out, camera_check, postures, cell_file)
    out = console(json_file)
    _show(result, keys, out)
    written = write_result(None, "kr5-kinematics/1", **keys)
    write_if_usable(written, result.fit, output, json_file)
    exports.write(written, out)
    for plot in write_plots(written, png):
        out.print(f"plot: {plot}", soft_wrap=True)
    if write_cell and result.fit.usable:
        write_cell_file(refined_cell(believed, result, recording is not None, bool(views)), write_cell)


def _cell(cell_file: Path | None, recording: kr5.cell.Recording | None) -> Any:
    if cell_file:
        return cell.load_cell(cell_file)
    if recording:
        return recording.cell
    fail("--cell: is missing; name the cell with the nominal arm (kr5 cell import makes one from a URDF)")


def _complete(
    options: calibration.KinematicsOptions,
    believed: kr5.cell.Cell,
    known_base: bool,
    known_tool: bool,
    joint_errors: bool,
    hold: list[str] | None,
    write_cell: Path | None,
) -> None:
    """Options that are not fields of the struct."""
    options.joint_errors = joint_errors and not write_cell
    if joint_errors and write_cell:
        print_note("a cell holds no joint errors once and twice a turn: they are not estimated")
    if known_base:
        options.T_world_base = np.eye(4)
    if known_tool:
        if believed.tool is None:
            fail("--known-tool: the cell has no tool")
        options.T_flange_tool = believed.tool.T_flange_tool
    options.hold = [f"arm.{name}" if name.startswith("joint") else name for name in hold or []]
    options.validate()


def _distance(text: str) -> Any:
    parts = text.split(",")
    try:
        return calibration.SocketDistance(first=parts[0], second=parts[1], distance=float(parts[2]))
    except (IndexError, ValueError):
        fail(f"--distance: found {text!r}, expected A,B,METRES, e.g. left,right,0.05")


def _fit_postures(
    postures: Path | None, recording: kr5.cell.Recording | None, chain: kr5.kinematics.DhChain, wanted: TableOptions
) -> list[calibration.ArmPosture]:
    if not postures:
        return []
    if not recording:
        return read_postures(postures, chain.joints, wanted)
    if found := recorded_postures(recording, "fit", len(chain.joints)):
        return found
    fail(f"{postures}: there are no poses with the split fit; expected an experiment of the kind poses")


def _check_postures(
    recording: kr5.cell.Recording | None, check: Path | None, chain: kr5.kinematics.DhChain, wanted: TableOptions
) -> list[calibration.ArmPosture]:
    if check:
        return _fit_postures(check, cell.load_recording(check) if check.is_dir() else None, chain, wanted)
    return recorded_postures(recording, "check", len(chain.joints)) if recording else []


def _keys(
    result: calibration.KinematicsResult,
    warnings: list[str],
    held_out: Mapping[str, object],
    camera_check: CameraCheck | None,
    postures: Path | None,
    cell_file: Path | None,
) -> dict[str, Any]:
    figures = []
    for c in result.coordinates:
        if not c.name.startswith("joint_errors.") or c.name.endswith(".compliance"):
            scale, unit = table_unit(c.unit)
            name = f"{c.name.removeprefix('arm.').removeprefix('joint_errors.')}, change"
            figures.append(figure_row(name, scale * (c.value - c.nominal), scale * c.std, unit))
    views = [
        {"name": p.name, "position_error": p.position_error, "outlier": True} for p in result.postures if p.outlier
    ]
    links = result.arm.link_poses(np.zeros(len(result.arm.joints)))
    frames = [{"name": "base", "parent": None, "T": np.eye(4)}]
    for k, T in enumerate(links):
        before = links[k - 1] if k else np.eye(4)
        parent = f"link {k}" if k else "base"
        frames.append({"name": f"link {k + 1}", "parent": parent, "T": np.linalg.inv(before) @ T})
    return {
        "input": {"postures": str(postures or ""), "cell": str(cell_file or "")},
        "verdict": _verdict(result, warnings, held_out, camera_check),
        "figures": figures,
        "views": views,
        "frames": frames,
        **({"held_out": held_out} if held_out else {}),
        **({"camera_check": asdict(camera_check)} if camera_check else {}),
        "result": result.to_dict(),
    }


def _verdict(
    result: calibration.KinematicsResult,
    warnings: list[str],
    held_out: Mapping[str, object],
    camera_check: CameraCheck | None,
) -> dict[str, str]:
    if not result.fit.usable:
        return {"word": "unusable", "text": result.fit.message}
    sound = [p for p in result.postures if not p.outlier and p.position_error > 0]
    before = 1e3 * np.sqrt(np.mean([p.nominal_error**2 for p in sound]))
    after = 1e3 * np.sqrt(np.mean([p.position_error**2 for p in sound]))
    text = change_text(c.to_dict() for c in result.coordinates)
    text += f"; RMS error {before:.3f} mm with the nominal arm, {after:.3f} mm with the identified one"
    if views := [p.pixel_error for p in result.postures if not p.outlier and p.pixel_error > 0]:
        text += f", {np.sqrt(np.mean(np.square(views))):.3f} px in {len(views)} views"
    if held_out:
        text += f"; {held_out_text(held_out)}"
    if camera_check:
        text += f"; {camera_check.text}"
    objections = list(warnings)
    if outliers := [p.name for p in result.postures if p.outlier]:
        objections.append(f"left out because they contradict the others: {', '.join(outliers)}")
    if held_out and held_out["mean_mm"] > 3 * max(after, 1e-6):
        objections.append("the further postures are fitted much worse: measure more postures, farther apart")
    return {"word": "doubtful" if objections else "good", "text": "; ".join([text, *objections])}


def _show(result: calibration.KinematicsResult, data: Mapping[str, object], out: Console) -> None:
    print_result({**data, "figures": []}, out)
    coordinates = [c.to_dict() for c in result.coordinates]
    rows = []
    for c in filter(is_significant, coordinates):
        scale, unit = table_unit(c["unit"])
        change = scale * (c["value"] - c["nominal"])
        rows.append([shown_name(c), scale * c["nominal"], scale * c["value"], change, scale * c["std"], unit])
    out.print()
    if rows:
        names = ["parameter", "nominal", "identified", "change", "± std", "unit"]
        out.print(make_table("Parameters that differ from their nominal values", names, rows, text=(5,)))
    for note in left_out_notes(coordinates, [direction.to_dict() for direction in result.unidentifiable]):
        out.print(note, soft_wrap=True)
