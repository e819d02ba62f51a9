"""`kr5 calibrate map`: where markers sit relative to each other, from images that show several at once."""

from pathlib import Path
from typing import Annotated, Any

import kr5
import kr5.vision
import numpy as np
import typer
from kr5 import vision
from kr5.files.camera import check_size, load_camera
from kr5.files.images import image_files, short_names
from kr5.files.results import write_result
from kr5.files.writing import check_writable, write_json

from kr5_tools.cli.arguments import JsonOption, ResultOption
from kr5_tools.cli.cell_output import CellOption, WriteCellOption, load_target_cell, put_marker_map, write_cell_file
from kr5_tools.cli.options import options_from
from kr5_tools.cli.tables import figure_row, make_table, pose_figures, print_result
from kr5_tools.cli.terminal import Console, console, fail, spinner, track
from kr5_tools.exports.command_line import Exports, export_options
from kr5_tools.targets.sightings import check_target_size, load_image

app = typer.Typer()


@app.command(
    "map", epilog="Example:  kr5 calibrate map photos/ --camera camera.json --family 36h11 --size 0.05 -o map.json"
)
@options_from(vision.MarkerMapOptions, skip=("max_iterations", "size"))
@export_options("poses")
def calibrate_map(
    images: Annotated[list[Path], typer.Argument(help="Images of the markers, or folders of such images.")],
    options: vision.MarkerMapOptions,
    exports: Exports,
    camera: Annotated[Path, typer.Option(help="Camera file.")],
    size: Annotated[float, typer.Option(help="Side of the black squares of the markers \\[m].")],
    family: Annotated[str, typer.Option(help="Family of the markers, e.g. 36h11 or aruco_4x4_50.")] = "36h11",
    cell_file: CellOption = None,
    write_cell: WriteCellOption = None,
    output: ResultOption = None,
    json_file: JsonOption = None,
) -> None:
    """Marker map: the pose of every marker in the frame of the reference marker, from all images together.

    Exit code: 0 when there is a map, 2 when the images determine none or the input is invalid.
    """
    check_target_size("--size", size)
    options.size = size
    options.validate()
    kr5.marker_count(family)
    files = image_files(images)
    check_writable(output, json_file, write_cell, *exports.files, inputs=[*files, camera, cell_file])
    believed = load_target_cell(cell_file, write_cell)
    sightings, lens, paths = _see(files, family, camera)
    with spinner("Fitting the map"):
        result = vision.estimate_marker_map(sightings, lens, options)
    if not result.fit.usable:
        fail(result.fit.message)
    said = {"camera": str(camera), "family": family, "size": options.size, "images": [str(f) for f in images]}
    data = write_result(output, "kr5-marker-map/1", input=said, **_keys(result, sightings, lens, paths))
    write_json(data, json_file)
    out = console(json_file)
    _show(result, data, out)
    exports.write(data, out)
    if believed:
        put_marker_map(believed, result.target)
        write_cell_file(believed, write_cell)


def _see(files: list[Path], family: str, camera: Path) -> tuple[list[Any], Any, dict[str, str]]:
    """The markers in each image, the camera, and the file of each image's name."""
    choice = vision.TagOptions(families=[family])
    sightings, lens, paths = [], None, {}
    for file, name in track(list(zip(files, short_names(files))), "Searching for markers"):
        image = load_image(file)
        height, width = image.shape
        lens = lens or load_camera(camera, (width, height), file)
        check_size(lens, camera, (width, height), file)
        sightings.append(vision.MarkerSighting(name=name, tags=vision.find_tags(image, choice)))
        paths[name] = str(file.resolve())
    if not any(s.tags for s in sightings):
        fail(f"no marker of {family} was found in {len(files)} images; check them with `kr5 detect --family {family}`")
    return sightings, lens, paths


def _keys(
    result: kr5.vision.MarkerMapResult, sightings: list[vision.MarkerSighting], lens: kr5.Pinhole, paths: dict[str, str]
) -> dict[str, Any]:
    by_name = {s.name: s for s in sightings}
    views, residuals = [], []
    for name, T, rms, outlier in zip(result.views, result.T_target_camera, result.view_rms_px, result.view_outlier):
        views.append({"name": name, "rms_px": rms, "outlier": outlier, "image": paths[name]})
        residuals.append(_residuals(by_name[name], T, result, lens))
    figures = [
        figure_row("markers", len(result.target.map), None, "-"),
        figure_row("noise of a corner per axis", result.sigma_pixel, None, "px"),
    ]
    frames = []
    for marker, covariance in zip(result.target.map, result.covariance):
        if np.any(covariance):
            figures += pose_figures(f"marker {marker.id}", marker.T_target_marker, covariance)
        frames.append(
            {"name": f"marker {marker.id}", "parent": None, "T": marker.T_target_marker, "size": [marker.size] * 2}
        )
    frames += [
        {"name": f"camera {name}", "kind": "station", "parent": None, "T": T}
        for name, T in zip(result.views, result.T_target_camera)
    ]
    return {
        "verdict": _verdict(result, views),
        "figures": figures,
        "image_size": [lens.width, lens.height],
        "views": views,
        "residuals": residuals,
        "frames": frames,
        "result": result.to_dict(),
    }


def _residuals(
    sighting: kr5.vision.MarkerSighting,
    T_target_camera: np.ndarray,
    result: kr5.vision.MarkerMapResult,
    lens: kr5.Pinhole,
) -> dict[str, Any]:
    """Seen minus predicted, of the corners that were used."""
    T_camera_target = np.linalg.inv(T_target_camera)
    ids = [tag.id for tag in sighting.tags]
    used = {m.id: m for m in result.target.map}
    seen, predicted = [], []
    for tag in sighting.tags:
        if tag.id not in used or ids.count(tag.id) > 1:
            continue
        marker = used[tag.id]
        corners = marker.size / 2 * np.array([[-1, 1, 1, -1], [-1, -1, 1, 1], [0, 0, 0, 0]], float)
        T = T_camera_target @ marker.T_target_marker
        predicted.append(lens.project(T[:3, :3] @ corners + T[:3, 3:]))
        seen.append(tag.corners)
    u = np.hstack(seen)
    d = u - np.hstack(predicted)
    return {"view": sighting.name, "u": u[0], "v": u[1], "du": d[0], "dv": d[1]}


def _verdict(result: kr5.vision.MarkerMapResult, views: list[dict[str, Any]]) -> dict[str, str]:
    worst = max((float(np.sqrt(np.trace(c[:3, :3]))) for c in map(np.asarray, result.covariance)), default=0.0)
    text = f"{len(result.target.map)} markers, each known to {1e3 * worst:.2g} mm or better (one standard deviation)."
    if other := result.second:
        text += (
            f" Another pose of marker {result.second_marker}, turned by {np.degrees(other.rotation):.0f} deg, has only"
            f" {other.cost_ratio:.2f} times the squared residuals: take images from nearer, more tilted, too."
        )
    if bad := [v["name"] for v in views if v["outlier"]]:
        verb = "disagrees" if len(bad) == 1 else "disagree"
        return {"word": "doubtful", "text": f"{text} {', '.join(bad)} {verb} with the others: did a marker move?"}
    if worst > 1e-3:
        return {
            "word": "doubtful",
            "text": f"{text} Take more images, from more directions, with several markers in each.",
        }
    return {"word": "doubtful" if result.second else "good", "text": text}


def _show(result: kr5.vision.MarkerMapResult, data: dict[str, Any], out: Console) -> None:
    print_result(data, out)
    counts = {r["view"]: len(r["u"]) // 4 for r in data["residuals"]}
    out.print()
    out.print(
        make_table(
            "Images",
            ["image", "markers", "RMS [px]", ""],
            ([v["name"], counts[v["name"]], v["rms_px"], "outlier" if v["outlier"] else ""] for v in data["views"]),
        )
    )
