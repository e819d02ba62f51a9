"""`kr5 calibrate cell`: camera, hand-eye, marker map, arm and line scanner in one solve."""

from pathlib import Path
from typing import Annotated, Any, Literal

import kr5
import kr5.cell
import numpy as np
import typer
from kr5 import calibration, cell
from kr5.files.results import write_if_usable, write_result
from kr5.files.writing import check_writable
from kr5.tables.options import TableOptions

from kr5_tools.calibrate.dataset_proposal import read_or_propose
from kr5_tools.calibrate.datasets import camera_of, residuals_of, target_of
from kr5_tools.calibrate.hand_eye_result import frames_of, predict_target
from kr5_tools.calibrate.laser_data import read_scans
from kr5_tools.calibrate.laser_views import find_views, named_targets
from kr5_tools.calibrate.postures import read_joint_values
from kr5_tools.cli.arguments import JsonOption, ResultOption
from kr5_tools.cli.cell_output import (
    WriteCellOption,
    put_camera_pose,
    put_scanner_pose,
    put_target,
    write_cell_file,
)
from kr5_tools.cli.numbers import format_number, table_unit
from kr5_tools.cli.options import options_from
from kr5_tools.cli.table_options import AngleUnit, ColumnsOption, JointColumns, tell_notes
from kr5_tools.cli.tables import figure_row, make_table, pose_figures, print_result
from kr5_tools.cli.terminal import Console, console, fail, print_note, spinner
from kr5_tools.exports.command_line import Exports, export_options
from kr5_tools.targets.sightings import find_in_images

app = typer.Typer()
LEAST_TO_JUDGE = 6  # stops from which some can be left out


@app.command("cell", epilog="Example:  kr5 calibrate cell share/data/demo -o calibrated.json")
@options_from(calibration.CellCalibrationOptions, skip=("mount", "hold", "max_iterations"))
@export_options("poses", "camera")
def calibrate_cell(
    folder: Annotated[Path, typer.Argument(help="Folder of images and robot poses, with a dataset.yaml in it.")],
    options: calibration.CellCalibrationOptions,
    exports: Exports,
    dataset: Annotated[
        Path | None, typer.Option(help="A dataset.yaml outside the folder; its files are in FOLDER.")
    ] = None,
    camera: Annotated[
        Path | None,
        typer.Option(help="Camera file to begin with; by default that of the data set, else from the same images."),
    ] = None,
    target: Annotated[
        str | None,
        typer.Option(help="Target, e.g. chessboard:6x9:0.0236; the markers of a marker map are placed anew."),
    ] = None,
    mount: Annotated[
        Literal["eye_in_hand", "eye_to_hand"] | None,
        typer.Option(help="Where the camera is mounted; overrides the data set."),
    ] = None,
    arm: Annotated[
        Path | None,
        typer.Option(
            "--joint-values", metavar="TABLE", help="Joint values, one row per image; the arm is then also calibrated."
        ),
    ] = None,
    columns: ColumnsOption = None,
    joints: JointColumns = None,
    angle: AngleUnit = None,
    cell_file: Annotated[
        Path | None,
        typer.Option(
            "--cell", metavar="CELL.yaml", help="Cell with the nominal arm, and into which the result is put."
        ),
    ] = None,
    scan: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help=(
                "Line scanner to calibrate as well: folder with profiles.csv and poses.csv as for kr5 calibrate laser."
            ),
        ),
    ] = None,
    scan_target: Annotated[
        list[str] | None,
        typer.Option(metavar="[NAME=]KIND[:RADIUS]", help="What is scanned: tip, sphere:0.0125 or plane. Repeatable."),
    ] = None,
    hold: Annotated[
        list[str] | None,
        typer.Option(help="Parameters to hold: camera, markers, arm, or e.g. camera.k1 or arm.joint2.a. Repeatable."),
    ] = None,
    write_cell: WriteCellOption = None,
    output: ResultOption = None,
    json_file: JsonOption = None,
) -> None:
    """Calibration of camera, hand-eye, marker map, arm and line scanner together, each with its uncertainty.

    Exit code: 0 when there is a result, 2 when there is none or the input is invalid.
    """
    options.hold = hold or []
    options.validate()
    data = read_or_propose(folder, dataset, target, camera, mount)
    read = [*data.images, folder, dataset, camera, target, arm, cell_file, scan]
    check_writable(output, json_file, write_cell, *exports.files, inputs=read)
    if write_cell and not cell_file:
        fail("--write-cell: needs --cell, the cell into which the result is written")
    data.mount = options.mount = mount or data.mount
    wanted = target_of(target or data.target, dataset or folder / "dataset.yaml")
    believed: Any = cell.load_cell(cell_file) if cell_file else None
    tables = TableOptions(columns, joints, angle=angle)
    q = _joints(arm, believed, tables, data)
    seen = find_in_images(data.images, wanted, least=3, points=4)
    lens, camera_source = camera_of(str(camera) if camera else data.camera, seen)
    poses = data.poses()
    stops = [
        calibration.CellStop(
            view=calibration.HandEyeView(T_base_flange=poses[i], view=view, correlation=c),
            **({"q": q[i]} if q is not None else {}),
        )
        for i, view, c in zip(seen.index, seen.views, seen.correlation, strict=True)
    ]
    geometry = calibration.CellGeometry(
        camera=lens,
        markers=wanted.map if wanted.kind == kr5.TargetKind.MarkerMap else [],
        **({"arm": believed.nominal_chain()} if q is not None else {}),
    )
    of_scan = TableOptions(angle=angle)
    scanned = _scan(scan, scan_target or [], of_scan, q is not None)
    tell_notes([*tables.notes, *of_scan.notes])
    with spinner("Calibrating"):
        result = calibration.calibrate_cell(stops, geometry, options, scanned)
    judged = []
    if result.fit.usable and len(stops) >= LEAST_TO_JUDGE:
        with spinner("Evaluating held-out views"):
            judged = calibration.evaluate_cell(stops, geometry, options)
    keys = _keys(result, stops, geometry, judged, [data.images[i] for i in seen.index])
    keys["input"] = {
        "folder": str(folder),
        "images": len(data.images),
        "without_target": seen.lost,
        "camera": camera_source,
        "target": target or data.target,
        "mount": str(data.mount),
        "joints": str(arm or ""),
        "cell": str(cell_file or ""),
        "scan": str(scan or ""),
    }
    keys["image_size"] = [seen.width, seen.height]
    out = console(json_file)
    _show(result, keys, out)
    written = write_result(None, "kr5-cell-calibration/1", **keys)
    write_if_usable(written, result.fit, output, json_file)
    exports.write(written, out)
    if write_cell and result.fit.usable:
        _put_result(believed, result, wanted)
        write_cell_file(believed, write_cell)


def _put_result(believed: kr5.cell.Cell, result: calibration.CellCalibrationResult, target: kr5.Target) -> None:
    """Arm, camera, target and scanner into the cell; what it has no place for is told."""
    if result.cell.arm.joints:
        believed.robot.dh = result.cell.arm.joints
    put_camera_pose(believed, str(result.mount), result.T_mount_camera, result.cell.camera)
    if result.cell.markers:
        target.map = result.cell.markers
    if reason := put_target(believed, target, str(result.mount), result.T_fixed_target):
        what = "the marker map and its pose are" if result.cell.markers else "the pose of the target is"
        print_note(f"{what} not written into the cell: {reason}")
    if result.scanner_start.fit.usable:
        put_scanner_pose(believed, result.T_flange_scanner)
        print_note("the places of the scanned targets are not written into the cell")


def _joints(
    arm: Path | None, believed: kr5.cell.Cell, columns: TableOptions, data: calibration.Dataset
) -> np.ndarray | None:
    """Joint values of every image, checked against the robot poses."""
    if not arm:
        return None
    if believed is None:
        fail("--joint-values: needs --cell, a cell with the nominal arm (kr5 cell import makes one from a URDF)")
    chain = believed.nominal_chain()
    q = read_joint_values(arm, chain.joints, columns)
    if len(q) != len(data.images):
        fail(f"{arm}: found {len(q)} rows, expected one for each of the {len(data.images)} images, in their order")
    turns = calibration.compare_turns(chain, q, data.poses())
    if not turns.agrees:
        fail(
            f"{arm}: between two stops the arm turns by {np.degrees(turns.difference):.1f} deg (median) more or less"
            " than the robot poses say; check the order of the rows, the unit (--angle-unit) and the arm of --cell"
        )
    return q


def _scan(folder: Path | None, given: list[str], columns: TableOptions, with_arm: bool) -> Any:
    """What the scanner saw of its targets."""
    if not folder:
        return calibration.CellScan()
    data = read_scans([folder], columns, None, 0.0, 0.1)
    targets = named_targets(given, data)
    if with_arm and not data.q:
        fail(f"{folder}: found no joint values (columns q1 … of poses.csv), which --joint-values needs")
    with spinner("Searching the profiles"):
        views, _ = find_views(data, targets)
    return calibration.CellScan(views=views, targets=[t for t in targets if t.name in {v.target for v in views}])


def _keys(
    result: calibration.CellCalibrationResult,
    stops: list[calibration.CellStop],
    geometry: calibration.CellGeometry,
    judged: list[calibration.CellHeldOutView],
    images: list[str],
) -> dict[str, Any]:
    poses = [np.asarray(result.cell.arm.flange(s.q)) if result.cell.arm.joints else s.view.T_base_flange for s in stops]
    moved = {
        new.id: new.T_target_marker @ np.linalg.inv(old.T_target_marker)
        for new, old in zip(result.cell.markers, geometry.markers)
    }
    views = [_in_map(s.view.view, moved) for s in stops]
    held_out = {}
    outliers = {view.name for view in result.views if view.outlier}
    judged = [view for view in judged if view.name not in outliers]
    if judged:
        together = np.array([view.rms_px for view in judged])
        separate = np.array([view.separate_rms_px for view in judged])
        held_out = {
            "views": len(judged),
            "together_px": float(np.sqrt((together**2).mean())),
            "one_after_another_px": float(np.sqrt((separate**2).mean())),
        }
    residuals = [residuals_of(v, result.cell.camera, predict_target(result, T)) for v, T in zip(views, poses)]
    return {
        "verdict": _verdict(result, held_out),
        "figures": _figures(result),
        "views": [{**r.to_dict(), "image": str(Path(f).resolve())} for r, f in zip(result.views, images)],
        "residuals": residuals,
        "frames": frames_of(result, poses, views),
        **({"held_out": held_out} if held_out else {}),
        "camera": result.cell.camera.to_dict(),
        "result": result.to_dict(),
    }


def _in_map(view: kr5.View, moved: dict[int, np.ndarray]) -> kr5.View:
    """A view with its points where the calibrated map has them."""
    if not moved:
        return view
    points = np.array(view.points)
    for k, corner in enumerate(view.ids):
        T = moved[corner // 4]
        points[:, k] = T[:3, :3] @ points[:, k] + T[:3, 3]
    return kr5.View(name=view.name, points=points, pixels=view.pixels, ids=view.ids)


def _verdict(result: calibration.CellCalibrationResult, held_out: dict[str, float]) -> dict[str, str]:
    if not result.fit.usable:
        return {"word": "unusable", "text": result.fit.message}
    text = f"{len(result.parameters)} parameters from {len(result.views)} stops"
    objections = []
    if held_out:
        together, separate = held_out["together_px"], held_out["one_after_another_px"]
        text += (
            f"; held-out views are predicted to {together:.3f} px ({separate:.3f} px by the hand-eye calibration alone,"
            " with all else as it was)"
        )
        if together > 1.1 * separate:
            objections.append("the joint calibration predicts them worse: hold what is known, or take more views")
    if outliers := [v.name for v in result.views if v.outlier]:
        objections.append(f"left out because they contradict the others: {', '.join(outliers)}")
    if other := result.second:
        objections.append(
            f"another pose of the camera, {1e3 * other.position:.1f} mm and {np.degrees(other.rotation):.1f} deg away,"
            f" explains the views with {other.cost_ratio:.2f} times the squared residuals"
        )
    return {"word": "doubtful" if objections else "good", "text": "; ".join([text, *objections])}


def _figures(result: calibration.CellCalibrationResult) -> list[dict[str, Any]]:
    if not result.fit.usable:
        return []
    in_hand = str(result.mount) == "eye_in_hand"
    where = ("camera on flange", "target in base") if in_hand else ("camera in base", "target on flange")
    rows = pose_figures(where[0], result.T_mount_camera, result.covariance)
    rows += pose_figures(where[1], result.T_fixed_target, result.covariance_target)
    if result.scanner_start.fit.usable:
        rows += pose_figures("scanner on flange", result.T_flange_scanner, result.covariance_scanner)
        if in_hand:
            rows += pose_figures("scanner in camera", result.T_camera_scanner, result.covariance_camera_scanner)
    rows += [
        figure_row("noise of a point per axis", result.sigma_pixel, None, "px"),
        figure_row("robot noise, position", 1e3 * result.sigma_robot_position, None, "mm"),
        figure_row("robot noise, rotation", np.degrees(result.sigma_robot_rotation), None, "deg"),
    ]
    if result.cell.arm.joints:
        rows += [
            figure_row("spread of the arm's lengths about nominal", 1e3 * result.tolerance_length, None, "mm"),
            figure_row("spread of the arm's angles about nominal", np.degrees(result.tolerance_angle), None, "deg"),
        ]
    return rows


def _show(result: calibration.CellCalibrationResult, keys: dict[str, Any], out: Console) -> None:
    print_result(keys, out)
    rows = []
    for p in result.parameters:
        if not p.name.startswith(("camera.", "arm.", "marker")):
            continue
        scale, unit = table_unit(p.unit)
        mark = "" if p.identifiable else "*"
        value, before = (format_number(scale * x, scale * p.std) for x in (p.value, p.nominal))
        rows.append([p.name + mark, before, value, format_number(scale * p.std, scale * p.std), unit])
    if rows:
        out.print()
        out.print(make_table("Parameters", ["parameter", "before", "calibrated", "± std", "unit"], rows, text=(4,)))
    if any(not p.identifiable for p in result.parameters):
        out.print("* Not determined by the measurements alone; held near the nominal value.")
