"""`kr5 calibrate laser`: where a line scanner sits on the flange, from profiles of tips, spheres and planes."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

import kr5
import kr5.calibration
import kr5.cell
import kr5.kinematics
import numpy as np
import typer
from kr5 import calibration, cell
from kr5.files.camera import load_camera
from kr5.files.results import read_result, write_if_usable, write_result
from kr5.files.writing import beside, check_writable
from kr5.tables.options import TableOptions

from kr5_tools.calibrate import laser_data, laser_overlay
from kr5_tools.calibrate.laser_cloud import check_cloud_ending, cloud_of, thinned_cloud, write_cloud
from kr5_tools.calibrate.laser_views import find_views, named_targets
from kr5_tools.cli.arguments import JsonOption, ResultOption
from kr5_tools.cli.cell_output import put_scanner_pose
from kr5_tools.cli.options import options_from
from kr5_tools.cli.table_options import AngleUnit, ColumnsOption, Convention, LengthUnit, tell_notes
from kr5_tools.cli.tables import figure_row, make_table, pose_figures, print_result
from kr5_tools.cli.terminal import Console, console, fail, print_note, spinner
from kr5_tools.exports.command_line import Exports, export_options

app = typer.Typer()
MOST_LISTED = 8


@app.command(epilog="Example:  kr5 calibrate laser FOLDER --target sphere:0.0125 --cell cell.yaml -o laser.json")
@options_from(calibration.ScannerOptions, skip=("max_iterations", "T_flange_scanner"))
@export_options("poses")
def calibrate_laser(
    options: calibration.ScannerOptions,
    exports: Exports,
    sources: Annotated[
        list[Path],
        typer.Argument(
            metavar="FOLDER|PROFILES.csv POSES.csv",
            help=(
                "Folder with profiles.csv (profile, x, z; also t, target) and poses.csv (a pose a profile, by a column"
                " profile, by the time t, or in the same order; also q1 …), these two files, or the folder of a"
                " recording with scans."
            ),
        ),
    ],
    target: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[NAME=]KIND[:RADIUS][@PLACE]",
            help=(
                "What is scanned: tip, sphere:0.0125 or plane, lengths in metres; with @X,Y,Z where its place in the"
                " base is known (plane: @X,Y,Z,NX,NY,NZ). Several times with names as in the column target."
            ),
        ),
    ] = None,
    cell_file: Annotated[
        Path | None,
        typer.Option("--cell", help="Cell with the arm and the nominal scanner; by default that of the recording."),
    ] = None,
    refine_arm: Annotated[
        bool, typer.Option("--refine-arm", help="Also estimate the arm's DH parameters; needs q1 … and a cell.")
    ] = False,
    columns: ColumnsOption = None,
    convention: Convention = None,
    length: LengthUnit = None,
    profile_length: Annotated[
        Literal["m", "mm"] | None,
        typer.Option(
            "--profile-length-unit",
            help="Unit of x and z of the profiles; by default as names or numbers show, else m.",
        ),
    ] = None,
    angle: AngleUnit = None,
    delay: Annotated[float, typer.Option(help="Time by which the stamps of the profiles are late \\[s].")] = 0.0,
    max_gap: Annotated[float, typer.Option(help="Longest time between two poses to interpolate across \\[s].")] = 0.1,
    overlay: Annotated[
        list[str] | None,
        typer.Option(metavar="IMAGE=PROFILE", help="Image of the laser line, taken at the pose of that profile."),
    ] = None,
    camera: Annotated[Path | None, typer.Option(help="Camera of these images; by default that of the cell.")] = None,
    hand_eye: Annotated[
        Path | None,
        typer.Option(
            metavar="RESULT.json",
            help="Pose of that camera, a result of kr5 calibrate hand-eye; by default that of the cell.",
        ),
    ] = None,
    overlay_folder: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the pictures.")] = Path(),
    cloud: Annotated[
        Path | None, typer.Option(metavar="OUT.ply", help="Cloud in the base to write: .ply, .npz or .csv.")
    ] = None,
    write_cell: Annotated[
        Path | None, typer.Option(metavar="OUT.yaml", help="Cell to write with the calibrated scanner.")
    ] = None,
    output: ResultOption = None,
    json_file: JsonOption = None,
) -> None:
    """Line scanner on the flange: its pose with uncertainty, from profiles of a tip, of spheres or of planes.

    No nominal pose is needed. Profiles that contradict the others are named and left out. Exit code: 0 when there is a
    result, 2 when there is none or the input is invalid.
    """
    options.validate()
    pictures = _overlay_files(overlay or [], overlay_folder)
    check_writable(output, json_file, cloud, write_cell, *exports.files, inputs=[*sources, cell_file])
    # Of a folder of scans no pictures are read but those that are drawn on.
    check_writable(*(out for _, _, out in pictures), inputs=[*(image for image, _, _ in pictures), cell_file])
    check_cloud_ending(cloud)
    if not (np.isfinite(delay) and max_gap > 0):
        fail(f"--delay, --max-gap: found {delay} and {max_gap}, expected times [s]")
    recording = cell.load_recording(sources[0]) if _is_recording(sources) else None
    believed = cell.load_cell(cell_file) if cell_file else recording.cell if recording else None
    if write_cell and believed is None:
        fail("--write-cell: --cell is missing; name the cell into which the result is put")
    if recording:
        data, targets = laser_data.recorded_scans(recording, "fit")
    else:
        wanted = TableOptions(columns, convention=convention, length=length, angle=angle)
        data = laser_data.read_scans(sources, wanted, profile_length, delay, max_gap)
        tell_notes(wanted.notes)
        targets = named_targets(target or [], data)
    if believed and believed.laser and believed.T_flange_scanner() is not None:
        options.T_flange_scanner = believed.T_flange_scanner()
    arm = _arm(refine_arm, believed, data)
    with spinner("Searching the profiles"):
        views, missed = find_views(data, targets)
    _check_direction(data, targets, len(views))
    if data.dropped:
        print_note(f"outside the times of the poses: profile {_listed(data.dropped)}")
    if len(views) < 4:
        reason = f" ({missed[0][1]})" if missed else ""
        fail(f"{len(views)} of {len(data.profiles)} profiles show their target, expected at least 4{reason}")
    with spinner("Calibrating"):
        shown = {view.target for view in views}
        result = calibration.calibrate_scanner(views, [t for t in targets if t.name in shown], options, arm)
    if not result.fit.usable:
        fail(result.fit.message)
    poses = [result.arm.flange(q) for q in data.q] if arm else data.poses
    points = cloud_of(data.profiles, poses, result.T_flange_scanner)
    overlays = _overlays(pictures, data, result, believed, camera, hand_eye)
    in_camera = _in_camera(result, _camera_pose(hand_eye, believed))
    keys = _keys(result, sources, missed, thinned_cloud(points), overlays, in_camera)
    out = console(json_file)
    _show(result, missed, keys, out)
    found = write_result(None, "kr5-laser/1", **keys)
    write_if_usable(found, result.fit, output, json_file)
    exports.write(found, out)
    if cloud:
        write_cloud(points, cloud)
    if write_cell and believed:
        _write_cell(believed, result, arm, write_cell)


def _is_recording(sources: list[Path]) -> bool:
    return len(sources) == 1 and sources[0].is_dir() and (sources[0] / "recording.yaml").exists()


def _listed(names: list[str]) -> str:
    more = len(names) - MOST_LISTED
    return ", ".join(names[:MOST_LISTED]) + (f" and {more} more" if more > 0 else "")


def _arm(refine: bool, believed: kr5.cell.Cell | None, data: laser_data.ScanData) -> kr5.kinematics.DhChain | None:
    if not refine:
        return None
    if believed is None:
        fail("--refine-arm: needs --cell with the nominal arm")
    chain = believed.nominal_chain()
    if not data.q:
        fail("--refine-arm: needs joint values, the columns q1 … of poses.csv, by profile")
    if len(data.q[0]) != len(chain.joints):
        fail(f"--refine-arm: found {len(data.q[0])} joint values, the arm of the cell has {len(chain.joints)} joints")
    return chain


def _check_direction(data: laser_data.ScanData, targets: list[calibration.ScanTarget], shown: int) -> None:
    """Refuses ranges that count towards the scanner. Those of a scanner that counts from its middle may be negative,
    too, but then a tip or a ball still stands out towards it."""
    z = np.concatenate([np.asarray(profile.z) for profile in data.profiles])
    if np.nanmedian(z) > 0:
        return
    turned = replace(data, profiles=[calibration.LineProfile(x=p.x, z=-np.asarray(p.z)) for p in data.profiles])
    found = len(find_views(turned, targets)[0])
    if found > shown:
        fail(
            f"z is negative, and {found} of {len(data.profiles)} profiles show their target only with its sign reversed"
            f" ({shown} as it is): it counts towards the scanner; expected ranges away from it"
        )


def _overlay_files(given: list[str], folder: Path) -> list[tuple[Path, str, Path]]:
    out = []
    for text in given:
        image, equals, profile = text.rpartition("=")
        if not (image and equals and profile):
            fail(f"--overlay: found {text!r}, expected IMAGE=PROFILE, e.g. line.png=12")
        out.append((Path(image), profile, folder / f"{Path(image).stem}_overlay.png"))
    return out


def _overlays(
    pictures: list[tuple[Path, str, Path]],
    data: laser_data.ScanData,
    result: kr5.calibration.ScannerResult,
    believed: kr5.cell.Cell | None,
    camera: Path | None,
    hand: Path | None,
) -> list[dict[str, Any]]:
    """Draws the pictures; what each shows."""
    out = []
    for file, profile, png in pictures:
        if profile not in data.names:
            fail(f"--overlay: there is no profile {profile}; found {_listed(data.names)}")
        image = laser_overlay.read_image(file)
        size = (image.shape[1], image.shape[0])
        camera_pose = _camera_pose(hand, believed)
        if camera_pose is None:
            fail("--overlay: needs --hand-eye, or --cell with a camera on the flange")
        shown = laser_overlay.overlay_profile(
            image,
            _camera(camera, believed, size, file),
            camera_pose,
            kr5.UncertainPose(T=result.T_flange_scanner, covariance=result.covariance),
            data.profiles[data.names.index(profile)],
        )
        laser_overlay.draw_overlay(image, shown, png)
        out.append({"name": file.name, "profile": profile, "drawing": str(png), **laser_overlay.overlay_figures(shown)})
    return out


def _camera(file: Path | None, believed: kr5.cell.Cell | None, size: tuple[int, int], image: Path) -> Any:
    if file:
        return load_camera(file, size, image)
    if believed is None or believed.camera is None:
        fail("--overlay: needs --camera, or --cell with a camera")
    return believed.camera.pinhole()


def _camera_pose(file: Path | None, believed: kr5.cell.Cell | None) -> Any:
    """Camera on the flange, with its covariance where a calibration states it; None without a camera."""
    if file:
        found = read_result(file, "kr5-hand-eye/1")["result"]
        if found.get("mount", "eye_in_hand") != "eye_in_hand":
            fail(f"{file}: is a camera in the base; expected one on the flange, as the scanner is")
        covariance = np.array(found["covariance"], float)[:6, :6]
        return kr5.UncertainPose(T=np.array(found["T_mount_camera"], float), covariance=covariance)
    T = believed.T_flange_camera() if believed is not None else None
    return None if T is None else kr5.UncertainPose(T=T)


def _in_camera(
    result: kr5.calibration.ScannerResult, camera_pose: kr5.UncertainPose | None
) -> kr5.UncertainPose | None:
    """Scanner in the camera."""
    if camera_pose is None:
        return None
    scanner = kr5.UncertainPose(T=result.T_flange_scanner, covariance=result.covariance)
    return calibration.camera_scanner(camera_pose, scanner)


def _write_cell(
    believed: kr5.cell.Cell, result: kr5.calibration.ScannerResult, arm: kr5.kinematics.DhChain | None, file: Path
) -> None:
    put_scanner_pose(believed, result.T_flange_scanner)
    if arm:
        believed.robot.dh = result.arm.joints
    with beside(file) as new:
        cell.save_cell(believed, new)


def _keys(
    result: kr5.calibration.ScannerResult,
    sources: list[Path],
    missed: list[tuple[str, str]],
    points: dict[str, Any],
    overlays: list[dict[str, Any]],
    in_camera: kr5.UncertainPose | None,
) -> dict[str, Any]:
    figures = pose_figures("scanner in the flange", result.T_flange_scanner, result.covariance)
    if in_camera is not None:
        figures += pose_figures("scanner in the camera", in_camera.T, in_camera.covariance)
    figures.append(figure_row("error of a profile", 1e3 * result.rms, None, "mm"))
    if result.held_out_rms > 0:
        figures.append(figure_row("error of a profile left out", 1e3 * result.held_out_rms, None, "mm"))
    for shown in overlays:
        if "rms_px" in shown:
            figures.append(figure_row(f"{shown['name']}: profile to laser line, RMS", shown["rms_px"], None, "px"))
            figures.append(figure_row(f"{shown['name']}: the same, expected", shown["expected_std_px"], None, "px"))
    views = [{"name": v.name, "position_error": v.distance, "outlier": True} for v in result.views if v.outlier]
    frames = [
        {"name": "flange", "parent": None, "T": np.eye(4)},
        {"name": "scanner", "parent": "flange", "T": result.T_flange_scanner},
    ]
    held_out = {"profiles": len(result.views), "rms_mm": 1e3 * result.held_out_rms} if result.held_out_rms > 0 else {}
    return {
        "input": {"sources": [str(s) for s in sources], "profiles": len(result.views) + len(missed)},
        "verdict": _verdict(result, missed, overlays),
        "causes": [c.to_dict() for c in result.causes],
        "figures": figures,
        "views": [*({"name": s["name"], "drawing": s["drawing"]} for s in overlays), *views],
        "frames": frames,
        **({"held_out": held_out} if held_out else {}),
        "cloud": points,
        "overlays": overlays,
        **({"camera_scanner": in_camera.to_dict()} if in_camera is not None else {}),
        "missed": [{"name": name, "message": message} for name, message in missed],
        "result": result.to_dict(),
    }


def _verdict(
    result: kr5.calibration.ScannerResult, missed: list[tuple[str, str]], overlays: list[dict[str, Any]]
) -> dict[str, str]:
    std = np.sqrt(np.diag(result.covariance))
    position, rotation = 1e3 * np.linalg.norm(std[:3]), 180 / np.pi * np.linalg.norm(std[3:])
    text = (
        f"the scanner is known to {position:.3f} mm and {rotation:.3f} deg (one standard deviation), from"
        f" {len(result.views)} profiles"
    )
    objections = []
    if outliers := [v.name for v in result.views if v.outlier]:
        objections.append(f"left out because they contradict the others: profile {_listed(outliers)}")
    if len(missed) > len(result.views):
        objections.append(f"{len(missed)} profiles show no target: {missed[0][1]}")
    if position > 1:
        objections.append("it is known to no better than 1 mm: add profiles from more, and more tilted, directions")
    if result.held_out_rms > 2 * max(result.rms, 1e-6):
        objections.append("profiles left out are predicted much worse than those of the fit: take more profiles")
    for shown in overlays:
        if shown.get("rms_px", 0.0) > 3 * shown["expected_std_px"] + 2:
            objections.append(f"{shown['name']}: the profile lies {shown['rms_px']:.1f} px from the laser line")
    if result.second:
        other = result.second
        objections.append(
            f"another pose, {1e3 * other.position:.1f} mm and {180 / np.pi * other.rotation:.1f} deg away, explains the"
            f" profiles with {other.cost_ratio:.2f} times the squared residuals"
        )
    objections += [c.text for c in result.causes]
    return {"word": "doubtful" if objections else "good", "text": "; ".join([text, *objections])}


def _show(
    result: kr5.calibration.ScannerResult, missed: list[tuple[str, str]], data: dict[str, Any], out: Console
) -> None:
    print_result(data, out)
    if missed:
        out.print(f"{len(missed)} profiles show no target: {_listed([name for name, _ in missed])}", soft_wrap=True)
    rows = []
    for name in dict.fromkeys(v.target for v in result.views):
        of_target = [v for v in result.views if v.target == name]
        used = np.array([v.distance for v in of_target if not v.outlier])
        rms = 1e3 * float(np.sqrt((used**2).mean())) if len(used) else float("nan")
        rows.append([name, len(of_target), len(of_target) - len(used), rms, 1e3 * float(used.max(initial=0.0))])
    out.print()
    out.print(make_table("Targets", ["target", "profiles", "outliers", "RMS [mm]", "largest [mm]"], rows))
    if any(c.name.startswith("arm.") for c in result.coordinates):
        out.print(
            f"The arm was refined: true lengths spread by {1e3 * result.tolerance_length:.3f} mm about the nominal"
            f" ones, angles by {180 / np.pi * result.tolerance_angle:.4f} deg."
        )
