"""`kr5 calibrate hand-eye`: where the camera sits on the arm, or beside it, how well that is known, and what is
wrong."""

import json
from pathlib import Path
from typing import Annotated, Any, Literal

import kr5
import numpy as np
import typer
from kr5 import calibration, vision

from kr5_tools.cli.arguments import JsonOption, ResultOption
from kr5_tools.cli.options import options_from
from kr5_tools.cli.tables import figure_row, make_table, pose_figures, print_result
from kr5_tools.cli.terminal import console, fail, print_note, spinner
from kr5_tools.files.camera import load_camera
from kr5_tools.files.images import MOST_CAMERA_VIEWS, thinned
from kr5_tools.files.results import write_if_usable, write_result
from kr5_tools.files.writing import check_writable
from kr5_tools.targets.command import Sightings, find_in_images, load_target

app = typer.Typer()


@app.command(epilog="Example:  kr5 calibrate hand-eye share/data/demo -o hand_eye.json")
@options_from(calibration.HandEyeOptions, skip=("mount", "max_iterations", "start"))
@options_from(calibration.HandEyeDiagnosisOptions, skip=("min_rotation", "seed"), argument="judging")
def hand_eye(
    folder: Annotated[Path, typer.Argument(help="Folder of images and robot poses, with a dataset.yaml in it.")],
    options: calibration.HandEyeOptions,
    judging: calibration.HandEyeDiagnosisOptions,
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
    output: ResultOption = None,
    json_file: JsonOption = None,
) -> None:
    """Hand-eye calibration from images and robot poses, with uncertainty, and the cause of a bad result.

    Exit code: 0 when the result is good or doubtful, 1 when it is unusable, 2 when there is no result or the input is
    invalid.
    """
    options.validate()
    judging.min_rotation = min(
        judging.min_rotation, options.min_rotation
    )  # what is enough to calibrate is enough to judge
    judging.validate()
    data = read_dataset(folder, dataset)
    tables = [f for f in folder.rglob("*") if f.suffix.lower() in (".csv", ".txt", ".yaml", ".yml")]
    check_writable(output, json_file, inputs=[*data.images, *tables, dataset, camera, target])
    data.mount = options.mount = mount or data.mount
    wanted = target_of(target or data.target, dataset or folder / "dataset.yaml")
    chosen = thinned(len(data.images), max_views)
    if len(chosen) < len(data.images):
        print_note(
            f"{folder}: {len(chosen)} of {len(data.images)} images are used, at even"
            " spacing; --max-views sets the number"
        )
    images = data.images
    seen = find_in_images([images[i] for i in chosen], wanted, least=3, points=4)
    seen.index = [chosen[i] for i in seen.index]
    lens, camera_source = camera_of(str(camera) if camera else data.camera, seen)
    keys, fit = solve_hand_eye(data, seen, lens, options, judging)
    keys["input"] = {
        "folder": str(folder),
        "images": len(data.images),
        "without_target": seen.lost,
        "camera": camera_source,
        "target": target or data.target,
        "mount": str(data.mount),
        "convention": data.convention.to_dict(),
    }
    _show(keys, console(json_file))
    write_if_usable(write_result(None, "kr5-hand-eye/1", **keys), fit, output, json_file)
    if keys["verdict"]["word"] == "unusable":
        raise typer.Exit(1)


def read_dataset(folder: Path, description: Path | None) -> Any:
    """The data set in a folder."""
    if not folder.is_dir():
        fail(f"{folder}: no such folder; expected one with images and robot poses")
    if not any(folder.iterdir()):
        fail(f"{folder}: the folder is empty; expected images and robot poses")
    file = description or folder / "dataset.yaml"
    if not file.exists():
        fail(
            f"{file}: no such file; write one, or let `kr5 dataset guess {folder} -o dataset.yaml` propose it, and name"
            " it with --dataset"
        )
    return calibration.load_dataset(str(file), str(folder))


def target_of(text: str, where: Path) -> Any:
    """A target from its short form or from the JSON of its fields."""
    if not text:
        fail(f"{where}: target: found nothing, expected e.g. 'chessboard:6x9:0.0236'; or give it with --target")
    return kr5.Target.from_dict(json.loads(text)) if text.startswith("{") else load_target(text)


def camera_of(text: str, seen: Sightings) -> tuple[Any, str]:
    """The camera named by a file or by its values; without either, calibrated from the same images."""
    if text.startswith("{"):
        values = {"width": seen.width, "height": seen.height, **json.loads(text)}
        return kr5.Pinhole.from_dict(values), "values of the data set"
    if text:
        return load_camera(text, seen.size), text
    views = [view for view in seen.views if view.pixels.shape[1] >= 6]
    if not views:
        fail(
            "camera: is missing, and views of fewer than 6 points cannot calibrate one;"
            " specify a camera file with --camera"
        )
    views = [views[i] for i in thinned(len(views), MOST_CAMERA_VIEWS)]
    with spinner("Calibrating the camera"):
        found = vision.calibrate_camera(
            views, seen.width, seen.height, vision.CameraOptions(correlation=max(seen.correlation))
        )
    if not found.fit.usable:
        fail(f"camera: is missing, and these images do not determine one: {found.fit.message}; name one with --camera")
    return found.camera, "calibrated from the same images"


def solve_hand_eye(data: Any, seen: Sightings, camera: Any, options: Any, judging: Any) -> tuple[dict[str, Any], Any]:
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
            held_out = calibration.evaluate_hand_eye(views, camera, options).to_dict()
    predicted = [predict_target(result, T) for T in poses]
    reports = [{**r.to_dict(), "image": str(Path(images[i]).resolve())} for r, i in zip(result.views, seen.index)]
    keys = {
        "verdict": {"word": str(diagnosis.verdict), "text": diagnosis.text},
        "causes": [c.to_dict() for c in diagnosis.causes],
        "figures": _figures(result, diagnosis, held_out),
        "image_size": [seen.width, seen.height],
        "views": reports,
        "residuals": [residuals_of(v, camera, T) for v, T in zip(seen.views, predicted)],
        "frames": flange_frames(result, poses, seen.views),
        **({"held_out": _held_out(held_out)} if held_out else {}),
        "diagnosis": diagnosis.to_dict(),
        "camera": camera.to_dict(),
        "result": result.to_dict(),
    }
    return keys, result.fit


def _held_out(judged: dict[str, Any]) -> dict[str, float]:
    """For people: mm and deg, by the end of the name."""
    return {
        f"{what}_{how}_{unit}": scale * judged[f"{what}_{how}"]
        for how in ("rms", "median")
        for what, scale, unit in (("position", 1e3, "mm"), ("rotation", 180 / np.pi, "deg"))
    }


def _in_hand(result: Any) -> bool:
    return str(result.mount) == "eye_in_hand"


def predict_target(result: Any, T_base_flange: np.ndarray) -> np.ndarray:
    """T_camera_target that the result gives for a pose of the robot."""
    T_mount_fixed = np.linalg.inv(T_base_flange) if _in_hand(result) else T_base_flange
    T: np.ndarray = np.linalg.inv(result.T_mount_camera) @ T_mount_fixed @ result.T_fixed_target
    return T


def residuals_of(view: Any, camera: Any, T: np.ndarray) -> dict[str, Any]:
    """Seen minus predicted pixels of a view whose target is at T in the camera."""
    points = T[:3, :3] @ view.points + T[:3, 3:]
    d = view.pixels - camera.project(points) if (points[2] > 0).all() else np.full_like(view.pixels, np.nan)
    return {"view": view.name, "u": view.pixels[0], "v": view.pixels[1], "du": d[0], "dv": d[1]}


def flange_frames(result: Any, poses: list[np.ndarray], views: list[Any]) -> list[dict[str, Any]]:
    """Base, flange, camera and target for the 3D scene of a page."""
    hand, base = ("camera", "target") if _in_hand(result) else ("target", "camera")
    placed = {"camera": result.T_mount_camera, "target": result.T_fixed_target}
    frames = [
        {"name": "base", "parent": None, "T": np.eye(4)},
        {"name": base, "parent": "base", "T": placed[base]},
        {"name": "flange", "parent": "base", "T": poses[0]},
        {"name": hand, "parent": "flange", "T": placed[hand]},
    ]
    kind = "station" if _in_hand(result) else "boards"
    return frames + [
        {"name": f"{hand} {v.name}", "kind": kind, "parent": "base", "T": T @ placed[hand]}
        for v, T in zip(views[1:], poses[1:])
    ]


def _figures(result: Any, diagnosis: Any, held_out: dict[str, Any]) -> list[dict[str, Any]]:
    if not result.fit.usable:
        return []
    where = ("camera on flange", "target in base") if _in_hand(result) else ("camera in base", "target on flange")
    rows = pose_figures(where[0], result.T_mount_camera, result.covariance)
    rows += pose_figures(where[1], result.T_fixed_target, result.covariance_target)
    at = f"{diagnosis.working_distance:.2g} m ahead"
    rows += [
        figure_row(f"expected error {at} (RMS)", 1e3 * diagnosis.tool_error, None, "mm"),
        figure_row(f"95 % of errors {at} below", 1e3 * diagnosis.tool_error_95, None, "mm"),
        figure_row("noise of a point per axis", result.sigma_pixel, None, "px"),
        figure_row("robot noise, position", 1e3 * result.sigma_robot_position, None, "mm"),
        figure_row("robot noise, rotation", np.degrees(result.sigma_robot_rotation), None, "deg"),
        figure_row("rotation of the wrist, major axis (RMS)", np.degrees(diagnosis.rotation_major), None, "deg"),
        figure_row("rotation of the wrist, second axis (RMS)", np.degrees(diagnosis.rotation_minor), None, "deg"),
    ]
    if held_out:
        rows += [
            figure_row("target in held-out views (RMS)", 1e3 * held_out["position_rms"], None, "mm"),
            figure_row("target in held-out views, rotation (RMS)", np.degrees(held_out["rotation_rms"]), None, "deg"),
        ]
    return rows


def _show(keys: dict[str, Any], out: Any) -> None:
    print_result({"verdict": keys["verdict"], "causes": keys["causes"]}, out)
    for cause in keys["causes"]:
        moves = f" Correcting it moves the tool by {1e3 * cause['consequence']:.3g} mm." if cause["consequence"] else ""
        out.print(
            f"    {cause['evidence']}{moves} Probability {cause['probability']:.2f}.", soft_wrap=True, markup=False
        )
    for lost in keys["input"]["without_target"]:
        out.print(f"  not used: {lost['name']}: {lost['message']}", soft_wrap=True, markup=False)
    out.print(
        make_table(
            "Views",
            ["view", "RMS [px]", "robot error [mm]", "robot error [deg]", "weight [-]", ""],
            (
                [
                    v["name"],
                    v["rms_px"],
                    1e3 * v["robot_position"],
                    float(np.degrees(v["robot_rotation"])),
                    v["weight"],
                    "outlier" if v["outlier"] else "",
                ]
                for v in keys["views"]
            ),
        )
    )
    print_result({"figures": keys["figures"]}, out)
