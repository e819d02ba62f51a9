"""`kr5 calibrate hand-eye`: where the camera sits on the arm, or beside it, how well that is known, and what is
wrong."""

from pathlib import Path
from typing import Annotated, Any, Literal

import kr5
import kr5.calibration
import numpy as np
import typer
from kr5 import calibration
from kr5.files.images import thinned
from kr5.files.writing import check_writable
from kr5.tables.options import TableOptions

from kr5_tools.calibrate.dataset_proposal import read_or_propose
from kr5_tools.calibrate.datasets import camera_of, residuals_of, target_of
from kr5_tools.calibrate.hand_eye_pairs import calibrate_pairs, refuse_image_options, refuse_pair_options
from kr5_tools.calibrate.hand_eye_result import (
    add_outlier_free,
    figures_of,
    frames_of,
    held_out_figures,
    predict_target,
    show_hand_eye,
    write_hand_eye,
)
from kr5_tools.cli.arguments import JsonOption, ResultOption
from kr5_tools.cli.cell_output import CellOption, WriteCellOption, load_target_cell
from kr5_tools.cli.options import options_from
from kr5_tools.cli.table_options import CameraMeaning, ColumnsOption, Convention, PoseAngle, PoseLength, RobotMeaning
from kr5_tools.cli.terminal import console, print_note, spinner
from kr5_tools.exports.command_line import Exports, export_options
from kr5_tools.targets.sightings import Sightings, find_in_images

app = typer.Typer()


@app.command(epilog="Example:  kr5 calibrate hand-eye share/data/demo -o hand_eye.json")
@options_from(calibration.HandEyeOptions, skip=("mount", "max_iterations", "start"))
@options_from(calibration.HandEyeDiagnosisOptions, skip=("min_rotation", "seed"), argument="judging")
@export_options("poses", "camera")
def hand_eye(
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="FOLDER|PAIRS",
            help=(
                "Folder of images and robot poses, with a dataset.yaml in it; or a file of pairs of poses: a table"
                " (robot_x …, camera_x …), samples of MoveIt (YAML, JSON) or of easy_handeye, or OpenCV's matrices."
            ),
        ),
    ],
    options: calibration.HandEyeOptions,
    judging: calibration.HandEyeDiagnosisOptions,
    exports: Exports,
    dataset: Annotated[
        Path | None, typer.Option(help="A dataset.yaml outside the folder; its files are in FOLDER.")
    ] = None,
    camera: Annotated[Path | None, typer.Option(help="Camera file; overrides the camera of the data set.")] = None,
    target: Annotated[
        str | None,
        typer.Option(
            help=(
                "Target, e.g. chessboard:6x9:0.0236, or map.json of kr5 calibrate map; overrides the target of the data"
                " set."
            )
        ),
    ] = None,
    mount: Annotated[
        Literal["eye_in_hand", "eye_to_hand"] | None,
        typer.Option(help="Where the camera is mounted; overrides the data set."),
    ] = None,
    max_views: Annotated[
        int,
        typer.Option(
            min=3, help="Largest number of images to use; from a larger set, this number is selected at even spacing."
        ),
    ] = 1000,
    camera_poses: Annotated[
        Path | None,
        typer.Option(help="Pairs: poses of the target in the camera, where PAIRS holds the robot's alone."),
    ] = None,
    robot_meaning: RobotMeaning = None,
    camera_meaning: CameraMeaning = None,
    columns: ColumnsOption = None,
    convention: Convention = None,
    length: PoseLength = None,
    angle: PoseAngle = None,
    sigma_camera_rotation: Annotated[
        float, typer.Option(help="Pairs: noise of a measured target orientation per axis \\[rad]; 0: estimated.")
    ] = 0.0,
    cell_file: CellOption = None,
    write_cell: WriteCellOption = None,
    output: ResultOption = None,
    json_file: JsonOption = None,
) -> None:
    """Hand-eye calibration from images and robot poses, or from pairs of poses, with uncertainty, and the cause of a
    bad result.

    Verdict: good when 95 % of errors stay below the tolerance and no cause moves the result by more than its error;
    unusable when there is no result, when poses are misread, when the error exceeds ten tolerances, or when a cause
    moves the result by more than five tolerances and more than its error; otherwise doubtful. Exit code: 0 when the
    result is good or doubtful, 1 when it is unusable, 2 when the data determine no result (verdict "unusable", too) or
    the input is invalid.
    """
    options.validate()
    judging.min_rotation = min(
        judging.min_rotation, options.min_rotation
    )  # what is enough to calibrate is enough to judge
    judging.validate()
    believed = load_target_cell(cell_file, write_cell)
    if folder.is_file() or (camera_poses and not folder.is_dir()):
        refuse_image_options(dataset, camera, target, options.sigma_pixel)
        usable = calibrate_pairs(
            folder,
            camera_poses,
            mount,
            (robot_meaning, camera_meaning),
            TableOptions(columns, convention=convention, length=length, angle=angle),
            options,
            sigma_camera_rotation,
            judging,
            output,
            json_file,
            believed,
            write_cell,
            exports,
        )
        if not usable:
            raise typer.Exit(1)
        return
    refuse_pair_options(
        *(camera_poses, robot_meaning, camera_meaning, columns, convention, length, angle, sigma_camera_rotation)
    )
    data = read_or_propose(folder, dataset, target, camera, mount)
    tables = [f for f in folder.rglob("*") if f.suffix.lower() in (".csv", ".txt", ".yaml", ".yml")]
    read = [*data.images, *tables, dataset, camera, target, cell_file]
    check_writable(output, json_file, write_cell, *exports.files, inputs=read)
    data.mount = options.mount = mount or data.mount
    data.target, data.camera = target or data.target, str(camera) if camera else data.camera
    keys, fit, lens = calibrate_folder(folder, data, dataset or folder / "dataset.yaml", max_views, options, judging)
    show_hand_eye(keys, console(json_file))
    if not write_hand_eye(keys, fit, output, json_file, exports, believed, write_cell, lens):
        raise typer.Exit(1)


def calibrate_folder(
    folder: Path,
    data: kr5.calibration.Dataset,
    description: Path,
    max_views: int,
    options: kr5.calibration.HandEyeOptions,
    judging: kr5.calibration.HandEyeDiagnosisOptions,
) -> tuple[dict[str, Any], Any, Any]:
    """Calibrates from images and robot poses: the keys of a result file, how the fit ended, and the camera."""
    wanted = target_of(data.target, description)
    images = data.images
    chosen = thinned(len(images), max_views)
    if len(chosen) < len(images):
        print_note(
            f"{folder}: {len(chosen)} of {len(images)} images are used, at even spacing; --max-views sets the number"
        )
    seen = find_in_images([images[i] for i in chosen], wanted, least=3, points=4)
    seen.index = [chosen[i] for i in seen.index]
    lens, camera_source = camera_of(data.camera, seen)
    keys, fit = solve_hand_eye(data, seen, lens, options, judging)
    keys["input"] = {
        "folder": str(folder),
        "images": len(images),
        "without_target": seen.lost,
        "camera": camera_source,
        "target": data.target,
        "mount": str(data.mount),
        "convention": data.convention.to_dict(),
    }
    return keys, fit, lens


def solve_hand_eye(
    data: kr5.calibration.Dataset,
    seen: Sightings,
    camera: kr5.Pinhole,
    options: kr5.calibration.HandEyeOptions,
    judging: kr5.calibration.HandEyeDiagnosisOptions,
) -> tuple[dict[str, Any], Any]:
    """Calibrates and diagnoses; the keys of a result file, and how the fit ended."""
    images, poses = data.images, data.poses()  # each a copy of all
    poses = [poses[i] for i in seen.index]
    views = [
        calibration.HandEyeView(T_base_flange=T, view=v, correlation=c)
        for T, v, c in zip(poses, seen.views, seen.correlation, strict=True)
    ]
    rows = (
        data.rows
        if data.T_flange_tool is None
        else np.array([calibration.to_row(T, data.convention) for T in data.poses()])
    )
    times = data.times
    times = [times[i] for i in seen.index] if len(times) else []
    with spinner("Calibrating"):
        result = calibration.calibrate_hand_eye(views, camera, options)
    with spinner("Searching for faults of the recording"):
        diagnosis = calibration.diagnose_hand_eye(
            rows[seen.index], data.convention, seen.views, camera, data.mount, result, times, judging
        )
    held_out = {}
    if result.fit.usable and len(views) >= 4:
        with spinner("Evaluating held-out views"):
            held_out = add_outlier_free(calibration.evaluate_hand_eye(views, camera, options).to_dict(), result)
    predicted = [predict_target(result, T) for T in poses]
    reports = [{**r.to_dict(), "image": str(Path(images[i]).resolve())} for r, i in zip(result.views, seen.index)]
    keys = {
        "verdict": {"word": str(diagnosis.verdict), "text": diagnosis.text},
        "causes": [c.to_dict() for c in diagnosis.causes],
        "figures": figures_of(result, diagnosis, held_out),
        "image_size": [seen.width, seen.height],
        "views": reports,
        "residuals": [residuals_of(v, camera, T) for v, T in zip(seen.views, predicted)],
        "frames": frames_of(result, poses, seen.views),
        **({"held_out": held_out_figures(held_out)} if held_out else {}),
        "diagnosis": diagnosis.to_dict(),
        "camera": camera.to_dict(),
        "result": result.to_dict(),
    }
    return keys, result.fit
