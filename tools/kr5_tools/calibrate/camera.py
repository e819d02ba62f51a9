"""`kr5 calibrate camera`: lens and sensor of a camera, from images of a target."""

from collections import Counter
from pathlib import Path
from typing import Annotated, Any, Literal

import kr5
import kr5.vision
import numpy as np
import typer
from kr5 import vision
from kr5.files.images import MOST_CAMERA_VIEWS, image_files, thinned
from kr5.files.results import write_if_usable, write_result
from kr5.files.writing import check_writable

from kr5_tools.cli.arguments import JsonOption, ResultOption, Target
from kr5_tools.cli.cell_output import CellOption, WriteCellOption, load_target_cell, put_intrinsics, write_cell_file
from kr5_tools.cli.numbers import format_count, format_number
from kr5_tools.cli.options import options_from
from kr5_tools.cli.tables import figure_row, make_table, print_result
from kr5_tools.cli.terminal import Console, console, fail, print_note, spinner
from kr5_tools.exports.command_line import Exports, export_options
from kr5_tools.targets.sightings import Sightings, check_target_size, find_in_images, load_target

app = typer.Typer()
LENSES = Literal["auto", "none", "k1", "k1k2", "brown4", "brown5", "radial6", "rational8"]
PARAMETERS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
UNCERTAIN_CAUSES = ("second_minimum", "uncertain", "noisy_corners", "coverage", "few_views", "views_lost")
REMEDIES = {
    "mirrored": "The image is mirrored: switch off mirroring in the camera driver.",
    "wrong_size": "Count the inner corners (squares less one), rows first, and correct --target.",
    "wrong_family": "Specify the printed marker family in --target.",
    "wrong_marker": "Specify the printed marker in --target.",
    "too_dark": "Lengthen the exposure.",
    "overexposed": "Shorten the exposure.",
    "blurred": "Keep camera and board still, focus, shorten the exposure.",
}
FEW = 8  # views; with fewer the held-out errors say little


@app.command(epilog="Example:  kr5 calibrate camera left*.jpg --target chessboard:6x9:0.025 -o camera.json")
@options_from(vision.CameraOptions, skip=("lens", "max_iterations", "correlation"))
@export_options("camera")
def camera(
    images: Annotated[list[Path], typer.Argument(help="Images of one camera, or folders of such images.")],
    target: Target,
    options: vision.CameraOptions,
    exports: Exports,
    model: Annotated[LENSES, typer.Option(help="Lens model; auto chooses it by the error on held-out views.")] = "auto",
    output: ResultOption = None,
    json_file: JsonOption = None,
    max_views: Annotated[
        int, typer.Option(min=3, help="Maximum number of images; from more, this number is selected at even spacing.")
    ] = MOST_CAMERA_VIEWS,
    cell_file: CellOption = None,
    write_cell: WriteCellOption = None,
) -> None:
    """Calibration of a camera: lens, sensor, uncertainty, and faults of the images."""
    wanted = load_target(target)
    check_target_size(f"--target {target}", wanted.size or max(m.size for m in wanted.map))
    if model != "auto":
        options.lens = model
    if str(options.method) == "visp" and model not in ("auto", "none", "k1"):
        fail(f"--model: found {model}, expected none or k1 with --method visp, which has no other lens model")
    options.validate()
    files = _files(images)
    check_writable(output, json_file, write_cell, *exports.files, inputs=[*files, target, cell_file])
    believed = load_target_cell(cell_file, write_cell)
    chosen = thinned(len(files), max_views)
    if len(chosen) < len(files):
        print_note(f"{len(chosen)} of {len(files)} images are used, at even spacing; --max-views sets the number")
    files = [files[i] for i in chosen]
    seen = find_in_images(files, wanted, least=1, points=6)
    _refuse_repeated(seen)
    options.correlation = max(seen.correlation)
    with spinner("Fitting and comparing lens models"):
        result = vision.calibrate_camera(seen.views, seen.width, seen.height, options)
    out = console(json_file)
    data = write_result(None, "kr5-camera/1", **_keys(result, [files[i] for i in seen.index], seen, target))
    _show(result, data, out)
    write_if_usable(data, result.fit, output, json_file)
    exports.write(data, out)
    if believed:
        put_intrinsics(believed, result.camera)
        write_cell_file(believed, write_cell)


def _files(given: list[Path]) -> list[Path]:
    files = image_files(given)
    if doubled := [str(f) for f, n in Counter(files).items() if n > 1]:
        fail(f"given twice: {', '.join(doubled)}; a duplicated view makes the uncertainty too small")
    return files


def _refuse_repeated(seen: Sightings) -> None:
    """Complains of views whose points are the same to the last digit: copies of one image, which say nothing new."""
    names: dict[bytes, list[str]] = {}
    for view in seen.views:
        names.setdefault(np.asarray(view.pixels).tobytes() + np.asarray(view.points).tobytes(), []).append(view.name)
    for same in names.values():
        if len(same) > 1:
            more = f" and {len(same) - 3} more" if len(same) > 3 else ""
            fail(
                f"the same image under several names: {', '.join(same[:3])}{more}; leave the copies out, for a view"
                " that counts twice makes the result look better known than it is"
            )


def _lost_causes(lost: list[dict[str, str]], total: int) -> list[dict[str, str]]:
    causes = []
    for status, count in Counter(item["status"] for item in lost).most_common():
        names = ", ".join(item["name"] for item in lost if item["status"] == status)
        cause = {"wrong_size": "wrong_board", "blurred": "blur"}.get(status, status)
        message = next(item["message"] for item in lost if item["status"] == status)
        causes.append(
            {
                "cause": cause,
                "text": f"{count} of {total} images gave no points ({names}): {message}",
                "remedy": REMEDIES.get(status, "Check these images with `kr5 detect`."),
                "evidence": f"{count} of {total}",
            }
        )
    return causes


def _verdict(result: kr5.vision.CameraCalibration, causes: list[dict[str, str]]) -> dict[str, str]:
    if not result.fit.usable:
        return {"word": "unusable", "text": result.fit.message}
    objections = [c["text"] for c in causes if c["cause"] in UNCERTAIN_CAUSES]
    left_out = sum(v.outlier for v in result.views)
    known = (
        f"Points of new images are predicted to {format_number(result.held_out_rms)} px." if result.held_out_rms else ""
    )
    verb = ("contradicts the others and was left out", "contradict the others and were left out")
    out = f" {format_count(left_out, 'view', verb)}." if left_out else ""
    if objections:
        return {"word": "doubtful", "text": f"{' '.join(objections)} {known}{out}".strip()}
    determined = (
        "The views determine the camera; its uncertainty is inflated, because they disagree by more than their noise."
        if any(c["cause"] == "views_disagree" for c in causes)
        else "The views agree and determine the camera."
    )
    return {"word": "good", "text": f"{determined} {known}{out}".strip()}


def _figures(result: kr5.vision.CameraCalibration) -> list[dict[str, Any]]:
    std = np.sqrt(np.diag(result.covariance))
    rows = []
    for i, name in enumerate(PARAMETERS):
        if name in result.free or (name == "fy" and result.square_pixels):
            rows.append(figure_row(name, getattr(result.camera, name), std[i], "px" if i < 4 else "-"))
    rows.append(figure_row("noise of a point per axis", result.sigma_pixel, None, "px"))
    rows.append(figure_row("RMS error, views used", result.rms_px, None, "px"))
    if result.held_out_rms:
        rows.append(figure_row("RMS error, views held out", result.held_out_rms, None, "px"))
    return rows


def _keys(result: kr5.vision.CameraCalibration, files: list[Path], seen: Sightings, target: str) -> dict[str, Any]:
    views, lost, total = seen.views, seen.lost, len(seen.views) + len(seen.lost)
    causes = [{k: v for k, v in f.to_dict().items() if k != "severe"} for f in result.findings]
    causes += _lost_causes(lost, total)
    if len(lost) > len(views):
        causes.append(
            {
                "cause": "views_lost",
                "text": "The target was found in less than half of the images.",
                "remedy": "Check --target, light and focus.",
                "evidence": f"{len(lost)} of {total}",
            }
        )
    if result.fit.usable and len(views) < FEW:
        causes.append(
            {
                "cause": "few_views",
                "text": f"Only {len(views)} views: the error on held-out views is uncertain.",
                "remedy": "Take 10 to 20 images.",
                "evidence": f"{len(views)} views",
            }
        )
    reports = [
        {
            **{
                k: getattr(v, k)
                for k in ("name", "rms_px", "noise_px", "weight", "outlier", "reason", "influence", "probability")
            },
            "tilt_deg": float(np.degrees(v.tilt)),
            "image": str(file.resolve()),
        }
        for v, file in zip(result.views, files)
    ]
    residuals = [
        {"view": v.name, "u": view.pixels[0], "v": view.pixels[1], "du": r.residuals[0], "dv": r.residuals[1]}
        for v, view, r in zip(result.views, views, result.views)
        if r.residuals.shape[1]
    ]
    frames = [{"name": "camera", "parent": None, "T": np.eye(4)}]
    frames += [{"name": v.name, "parent": "camera", "T": v.T_camera_target} for v in result.views]
    held_out = {
        "rms_px": result.held_out_rms,
        "folds": "by views; each point is predicted from the pose of the other points of its view",
    }
    return {
        "input": {"target": target, "images": [str(f) for f in files], "without_target": lost},
        "verdict": _verdict(result, causes),
        "causes": causes,
        "figures": _figures(result),
        "image_size": [seen.width, seen.height],
        "views": reports,
        "residuals": residuals,
        "frames": frames,
        **({"held_out": held_out} if result.held_out_rms else {}),
        "result": result.to_dict(),
    }


def _model_name(m: kr5.vision.CameraModelScore) -> str:
    return str(m.lens) + (", fx = fy" if m.square_pixels else "") + (", bent target" if m.bent_target else "")


def _show(result: kr5.vision.CameraCalibration, data: dict[str, Any], out: Console) -> None:
    print_result(data, out)
    out.print()
    out.print(
        make_table(
            "Views",
            ["view", "RMS [px]", "noise [px]", "weight [-]", "tilt [deg]", "influence [-]", ""],
            (
                [
                    v.name,
                    v.rms_px,
                    v.noise_px,
                    v.weight,
                    float(np.degrees(v.tilt)),
                    v.influence,
                    v.reason if v.outlier else "",
                ]
                for v in result.views
            ),
        )
    )
    if result.models:
        best = sorted(result.models, key=lambda m: m.held_out_rms)[:8]
        if not any(m.chosen for m in best):
            best += [m for m in result.models if m.chosen]
        out.print()
        out.print(
            make_table(
                "Models (best on held-out views first)",
                ["model", "free", "held out [px]", "fitted [px]", "excess ± std [px²]", ""],
                (
                    [
                        _model_name(m),
                        m.parameters,
                        f"{m.held_out_rms:.4f}",
                        f"{m.fitted_rms:.4f}",
                        f"{m.excess:.2g} ± {m.excess_std:.1g}",
                        "chosen" if m.chosen else "",
                    ]
                    for m in best
                ),
            )
        )
    c = result.coverage
    out.print(
        f"Coverage: {100 * c.cells_hit:.0f} % of the image's cells, largest empty rectangle {100 * c.largest_gap:.0f}"
        f" %; tilt {np.degrees(c.tilt_min):.0f} to {np.degrees(c.tilt_max):.0f} deg, farthest / nearest"
        f" {c.distance_ratio:.2f}"
    )
