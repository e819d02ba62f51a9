"""`kr5 calibrate hand-eye`: where the camera sits on the arm, or beside it, how well that is known, and what is wrong."""

import json
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import typer

import kr5
from kr5 import calibration, vision

from .camera import load_camera
from .common import Json, Output, console, fail, figure, keep, pose_figures, show_result, table, working, write_result
from .options import options_from
from .target import Sightings, find_in_images, load_target

app = typer.Typer()


@app.command(epilog="Example:  kr5 calibrate hand-eye share/data/demo -o hand_eye.json")
@options_from(calibration.HandEyeOptions, skip=("mount", "max_iterations", "start"))
@options_from(calibration.HandEyeDiagnosisOptions, skip=("min_rotation", "seed"), argument="judging")
def hand_eye(
    folder: Annotated[Path, typer.Argument(help="Folder of images and robot poses, with a dataset.yaml in it.")],
    options: calibration.HandEyeOptions,
    judging: calibration.HandEyeDiagnosisOptions,
    dataset: Annotated[Path | None, typer.Option(help="A dataset.yaml elsewhere; the files it names lie in FOLDER.")] = None,
    camera: Annotated[Path | None, typer.Option(help="Camera file; overrides that of the data set.")] = None,
    target: Annotated[str | None, typer.Option(help="Target, e.g. chessboard:6x9:0.0236, or map.json of kr5 calibrate map; overrides "
                                               "that of the data set.")] = None,
    mount: Annotated[Literal["eye_in_hand", "eye_to_hand"] | None, typer.Option(help="Overrides that of the data set.")] = None,
    output: Output = None,
    json_file: Json = None,
) -> None:
    """Finds the target in every image, calibrates, and says how good the answer is, and if bad, why.

    Exit code: 0 when the result is good or doubtful, 1 when it is unusable, 2 when there is none or the input is wrong.
    """
    options.validate()
    judging.min_rotation = min(judging.min_rotation, options.min_rotation)  # what is enough to calibrate is enough to judge
    judging.validate()
    data = read(folder, dataset)
    data.mount = options.mount = mount or data.mount
    wanted = target_of(target or data.target, dataset or folder / "dataset.yaml")
    seen = find_in_images(data.images, wanted, least=3, points=4)
    lens, note = camera_of(str(camera) if camera else data.camera, seen)
    keys, fit = solve(data, seen, lens, options, judging)
    keys["input"] = {"folder": str(folder), "images": len(data.images), "without_target": seen.lost, "camera": note,
                     "target": target or data.target, "mount": str(data.mount), "convention": data.convention.to_dict()}
    _show(keys, console(json_file))
    keep(write_result(None, "kr5-hand-eye/1", **keys), fit, output, json_file)
    if keys["verdict"]["word"] == "unusable":
        raise typer.Exit(1)


def read(folder: Path, description: Path | None) -> Any:
    """The data set in a folder."""
    if not folder.is_dir():
        fail(f"{folder}: no such folder; expected one with images and robot poses")
    if not any(folder.iterdir()):
        fail(f"{folder}: the folder is empty; expected images and robot poses")
    file = description or folder / "dataset.yaml"
    if not file.exists():
        fail(f"{file}: no such file; write one, or let `kr5 dataset guess {folder} -o dataset.yaml` propose it, and name it "
             "with --dataset")
    return calibration.load_dataset(str(file), str(folder))


def target_of(text: str, where: Path) -> Any:
    """A target from its short form or from the JSON of its fields."""
    if not text:
        fail(f"{where}: target: found nothing, expected e.g. 'chessboard:6x9:0.0236'; or give it with --target")
    return kr5.Target.from_dict(json.loads(text)) if text.startswith("{") else load_target(text)


def camera_of(text: str, seen: Sightings) -> tuple[Any, str]:
    """The camera named by a file or by its values; without either, calibrated from the same images."""
    if text.startswith("{"):
        values = {"width": seen.size[0], "height": seen.size[1], **json.loads(text)}
        return kr5.Pinhole.from_dict(values), "values of the data set"
    if text:
        return load_camera(text, seen.size), text
    views = [view for view in seen.views if view.pixels.shape[1] >= 6]
    if not views:
        fail("camera: none is given, and views of fewer than 6 points cannot calibrate one; name a camera file with --camera")
    with working("Calibrating the camera"):
        found = vision.calibrate_camera(views, *seen.size, vision.CameraOptions(correlation=max(seen.correlation)))
    if not found.fit.usable:
        fail(f"camera: none is given, and these images do not determine one: {found.fit.message}; name one with --camera")
    return found.camera, "calibrated from the same images"


def solve(data: Any, seen: Sightings, camera: Any, options: Any, judging: Any) -> tuple[dict[str, Any], Any]:
    """Calibrates and diagnoses; the keys of a result file, and how the fit ended."""
    poses = [data.poses()[i] for i in seen.index]
    views = [calibration.HandEyeView(T_base_flange=T, view=v, correlation=c)
             for T, v, c in zip(poses, seen.views, seen.correlation, strict=True)]
    rows = data.rows if data.T_flange_tool is None else np.array([calibration.to_row(T, data.convention) for T in data.poses()])
    times = [data.times[i] for i in seen.index] if len(data.times) else []
    with working("Calibrating"):
        result = calibration.calibrate_hand_eye(views, camera, options)
    with working("Looking for what may be wrong"):
        diagnosis = calibration.diagnose_hand_eye(rows[seen.index], data.convention, seen.views, camera, data.mount, result, times,
                                                  judging)
    held_out = {}
    if result.fit.usable and len(views) >= 4:
        with working("Judging on views left out"):
            held_out = calibration.evaluate_hand_eye(views, camera, options).to_dict()
    predicted = [_predict(result, T) for T in poses]
    reports = [{**r.to_dict(), "image": str(Path(data.images[i]).resolve())} for r, i in zip(result.views, seen.index)]
    keys = {
        "verdict": {"word": str(diagnosis.verdict), "text": diagnosis.text},
        "causes": [c.to_dict() for c in diagnosis.causes],
        "figures": _figures(result, diagnosis, held_out),
        "image_size": list(seen.size), "views": reports,
        "residuals": [_residuals(v, camera, T) for v, T in zip(seen.views, predicted)],
        "frames": _frames(result, poses, seen.views),
        **({"held_out": _held_out(held_out)} if held_out else {}),
        "diagnosis": diagnosis.to_dict(), "camera": camera.to_dict(), "result": result.to_dict(),
    }
    return keys, result.fit


def _held_out(judged: dict[str, Any]) -> dict[str, float]:
    """For people: mm and deg, by the end of the name."""
    return {f"{what}_{how}_{unit}": scale * judged[f"{what}_{how}"] for how in ("rms", "median")
            for what, scale, unit in (("position", 1e3, "mm"), ("rotation", 180 / np.pi, "deg"))}


def _in_hand(result: Any) -> bool:
    return str(result.mount) == "eye_in_hand"


def _predict(result: Any, T_base_flange: np.ndarray) -> np.ndarray:
    """T_camera_target that the result gives for a pose of the robot."""
    T_mount_fixed = np.linalg.inv(T_base_flange) if _in_hand(result) else T_base_flange
    return np.linalg.inv(result.T_mount_camera) @ T_mount_fixed @ result.T_fixed_target


def _residuals(view: Any, camera: Any, T: np.ndarray) -> dict[str, Any]:
    points = T[:3, :3] @ view.points + T[:3, 3:]
    d = view.pixels - camera.project(points) if (points[2] > 0).all() else np.full_like(view.pixels, np.nan)
    return {"view": view.name, "u": view.pixels[0], "v": view.pixels[1], "du": d[0], "dv": d[1]}


def _frames(result: Any, poses: list[np.ndarray], views: list[Any]) -> list[dict[str, Any]]:
    hand, base = ("camera", "target") if _in_hand(result) else ("target", "camera")
    placed = {"camera": result.T_mount_camera, "target": result.T_fixed_target}
    frames = [{"name": "base", "parent": None, "T": np.eye(4)}, {"name": base, "parent": "base", "T": placed[base]},
              {"name": "flange", "parent": "base", "T": poses[0]}, {"name": hand, "parent": "flange", "T": placed[hand]}]
    kind = "station" if _in_hand(result) else "boards"
    return frames + [{"name": f"{hand} {v.name}", "kind": kind, "parent": "base", "T": T @ placed[hand]}
                     for v, T in zip(views[1:], poses[1:])]


def _figures(result: Any, diagnosis: Any, held_out: dict[str, Any]) -> list[dict[str, Any]]:
    if not result.fit.usable:
        return []
    where = ("camera on flange", "target in base") if _in_hand(result) else ("camera in base", "target on flange")
    rows = pose_figures(where[0], result.T_mount_camera, result.covariance)
    rows += pose_figures(where[1], result.T_fixed_target, result.covariance_target)
    at = f"{diagnosis.working_distance:.2g} m ahead"
    rows += [figure(f"expected error {at} (RMS)", 1e3 * diagnosis.tool_error, None, "mm"),
             figure(f"95 % of errors {at} below", 1e3 * diagnosis.tool_error_95, None, "mm"),
             figure("noise of a point per axis", result.sigma_pixel, None, "px"),
             figure("robot noise, position", 1e3 * result.sigma_robot_position, None, "mm"),
             figure("robot noise, rotation", np.degrees(result.sigma_robot_rotation), None, "deg"),
             figure("turn of the wrist, major axis (RMS)", np.degrees(diagnosis.rotation_major), None, "deg"),
             figure("turn of the wrist, second axis (RMS)", np.degrees(diagnosis.rotation_minor), None, "deg")]
    if held_out:
        rows += [figure("target on views left out (RMS)", 1e3 * held_out["position_rms"], None, "mm"),
                 figure("the same, rotation", np.degrees(held_out["rotation_rms"]), None, "deg")]
    return rows


def _show(keys: dict[str, Any], out: Any) -> None:
    show_result({"verdict": keys["verdict"], "causes": keys["causes"]}, out)
    for cause in keys["causes"]:
        moves = f" Allowing for it moves the tool by {1e3 * cause['consequence']:.3g} mm." if cause["consequence"] else ""
        out.print(f"    {cause['evidence']}{moves} Probability {cause['probability']:.2f}.", soft_wrap=True, markup=False)
    for lost in keys["input"]["without_target"]:
        out.print(f"  not used: {lost['name']}: {lost['message']}", soft_wrap=True, markup=False)
    out.print(table("Views", ["view", "rms [px]", "robot off [mm]", "robot off [deg]", "weight [-]", ""], (
        [v["name"], v["rms_px"], 1e3 * v["robot_position"], float(np.degrees(v["robot_rotation"])), v["weight"],
         "outlier" if v["outlier"] else ""] for v in keys["views"])))
    show_result({"figures": keys["figures"]}, out)
