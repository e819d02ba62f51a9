"""`kr5 detect`: targets and markers in images, drawn where they were seen."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import kr5
import numpy as np
import typer
from kr5 import vision
from kr5.files import writing
from kr5.files.camera import load_camera
from kr5.files.images import image_files, short_names
from kr5.files.results import write_result
from kr5.files.writing import write_json

from kr5_tools.cli.arguments import JsonOption
from kr5_tools.cli.options import options_from
from kr5_tools.cli.tables import figure_row, pose_figures
from kr5_tools.cli.terminal import console, fail, track
from kr5_tools.targets.detection_table import median_noise, print_seen
from kr5_tools.targets.sightings import load_image, load_target

app = typer.Typer()


@app.command(epilog="Example:  kr5 detect photos/ --target tag:36h11:0:0.05 --camera camera.json -o seen/")
@options_from(vision.DetectOptions, skip=("explain",))
def detect(
    images: Annotated[list[Path], typer.Argument(help="Images, or folders of images.")],
    options: vision.DetectOptions,
    target: Annotated[
        str | None,
        typer.Option(
            help="Target to find, e.g. chessboard:6x9:0.025, tag:36h11:0:0.05, or map.json of kr5 calibrate map."
        ),
    ] = None,
    family: Annotated[
        list[str] | None,
        typer.Option(help="Marker family, to find every marker of it, e.g. 36h11, tag36h11 or aruco_4x4_50."),
    ] = None,
    camera: Annotated[Path | None, typer.Option(help="Camera file; with it the poses are estimated.")] = None,
    size: Annotated[
        float | None,
        typer.Option(help="Side of the markers of --family \\[m]; with --camera their poses are estimated."),
    ] = None,
    drawings: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FOLDER", help="Folder of PNG drawings of what was found.")
    ] = None,
    json_file: JsonOption = None,
) -> None:
    """Detection of a target, or of every marker of a family, with the reason where it is not found."""
    files = image_files(images)
    if (target is None) == (family is None):
        fail("give either --target or --family, e.g. --family 36h11")
    options.validate()
    wanted = load_target(target) if target else None
    for name in family or ():
        kr5.marker_family(name)
    if size is not None and not size > 0:
        fail(f"--size: found {size}, expected the side of the markers in metres, above 0")

    def look(image: np.ndarray, lens: kr5.Pinhole | None) -> tuple[list[Any], dict[str, Any] | None]:
        return (
            _in_target(image, wanted, lens, options) if wanted else _in_family(image, family or [], size, lens, options)
        )

    found, lost, views = [], [], []
    for file, name, drawing in track(list(zip(files, short_names(files), _drawing_names(files))), "Looking"):
        items, missed, drawn = _in_image(
            file, look, camera, drawings and drawings / drawing, alone=len(images) == 1 and not images[0].is_dir()
        )
        where = {"image": str(file), "view": name}
        found += [{**where, **item} for item in items]
        lost += [{**where, **missed}] if missed else []
        views.append(
            {
                "name": name,
                "image": str(file.resolve()),
                **drawn,
                **({"reason": missed["message"]} if missed else {}),
                **(_of_view(items) if items else {}),
            }
        )
    print_seen(found, lost, len(files), console(json_file))
    if not found:
        more = f" (and {len(lost) - 1} more images)" if len(lost) > 1 else ""
        fail(f"nothing was found: {lost[0]['image']}: {lost[0]['message']}{more}")
    keys = {"target": target, "families": family, "camera": camera and str(camera), "images": [str(i) for i in images]}
    figures = [
        figure_row("images in which something was seen", len(files) - len(lost), None, f"of {len(files)}"),
        *_figures(found),
    ]
    write_json(
        write_result(None, "kr5-detection/1", input=keys, figures=figures, views=views, found=found, not_found=lost),
        json_file,
    )


# what is seen in an image, and why nothing is
Look = Callable[[np.ndarray, kr5.Pinhole | None], tuple[list[dict[str, Any]], dict[str, Any] | None]]


def _in_image(
    file: Path, look: Look, camera: Path | None, drawing: Path | None, alone: bool
) -> tuple[list[Any], dict[str, Any] | None, dict[str, str]]:
    """What is seen in an image, or why nothing is, and where that is drawn."""
    try:
        image = load_image(file)
    except (kr5.Error, OSError) as error:
        if alone:
            raise
        return [], {"status": "unreadable", "message": str(error)}, {}  # one bad file does not spoil the others
    lens = load_camera(camera, image.shape[::-1], file) if camera else None
    items, missed = look(image, lens)
    if not items or not drawing:
        return items, missed, {}
    _draw(image, items, lens, drawing)
    return items, missed, {"drawing": str(drawing.resolve())}


def _drawing_names(files: list[Path]) -> list[str]:
    """Where each drawing goes in its folder; images of one name in two folders, or of two formats, are kept apart."""
    names = short_names(files)
    stems = [str(Path(name).with_suffix("")) for name in names]
    return [f"{name}_seen.png" for name in (stems if len(set(stems)) == len(set(names)) else names)]


def _of_view(items: list[dict[str, Any]]) -> dict[str, Any]:
    """What all that was seen in one image says of it."""
    rms = [item["rms_px"] for item in items if "rms_px" in item]
    return {
        "points": sum(len(item["ids"]) for item in items),
        "noise_px": median_noise(items),
        "rms_px": float(np.sqrt(np.mean(np.square(rms)))) if rms else None,
    }


def _pose_keys(pose: vision.TargetPose) -> dict[str, Any]:
    if not pose.fit.usable:
        return {"pose_message": pose.fit.message}
    return {"pose": pose.to_dict(), "rms_px": pose.rms_px}


def _in_target(
    image: np.ndarray, target: kr5.Target, lens: kr5.Pinhole | None, options: vision.DetectOptions
) -> tuple[list[Any], dict[str, Any] | None]:
    seen = vision.find_target(image, target, options)
    if str(seen.status) != "found":
        return [], {"status": str(seen.status), "message": seen.message}
    view = seen.view
    item = {
        "what": str(target.kind),
        "message": seen.message,
        "points": view.points,
        "pixels": view.pixels,
        "ids": view.ids,
        "sigma": seen.sigma,
        "size": target.size or max(m.size for m in target.map),
    }
    if lens:
        item |= _pose_keys(vision.estimate_target_pose(seen, lens))
    return [item], None


def _in_family(
    image: np.ndarray, families: list[str], size: float | None, lens: kr5.Pinhole | None, options: vision.DetectOptions
) -> tuple[list[Any], dict[str, Any] | None]:
    choice = vision.TagOptions(
        families=families, decimate=options.decimate, threads=options.threads, refine=options.refine
    )
    items = []
    for tag in vision.find_tags(image, choice):
        view = vision.tag_view(tag, size or 1.0)
        item: dict[str, Any] = {
            "what": tag.family,
            "id": tag.id,
            "points": view.points,
            "pixels": view.pixels,
            "ids": view.ids,
            "sigma": tag.sigma,
            "hamming": tag.hamming,
            "margin": tag.margin,
            "size": size,
        }
        if lens and size:
            item |= _pose_keys(vision.estimate_tag_pose(tag, size, lens))
        items.append(item)
    if items:
        return items, None
    why = vision.explain_no_tags(image, choice)
    return [], {"status": str(why.status), "message": why.message}


def _figures(found: list[dict[str, Any]]) -> list[dict[str, Any]]:
    rows = []
    for item in found:
        if pose := item.get("pose"):
            name = f"{item['view']} {item['what']} {item.get('id', '')}".strip()
            rows += pose_figures(name, np.array(pose["T_camera_target"]), np.array(pose["covariance"]))
        else:
            rows.append(figure_row(f"{item['view']} {item['what']} points", len(item["ids"]), None, "-"))
    return rows


def _draw(image: np.ndarray, items: list[dict[str, Any]], lens: kr5.Pinhole | None, file: Path) -> None:
    """The image with outlines, numbers and, when a pose is known, the axes X red, Y green, Z blue."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    height, width = image.shape
    fig = plt.figure(figsize=(max(width, 640) / 100, max(width, 640) / 100 * height / width), dpi=100)
    ax = fig.add_axes((0, 0, 1, 1))
    ax.imshow(image, cmap="gray", vmin=0, vmax=255)
    for item in items:
        p = np.asarray(item["pixels"])
        if "id" in item or p.shape[1] == 4:
            ax.plot(*np.c_[p, p[:, :1]], color="#0072B2", lw=1.5)
            ax.text(
                float(p[0].mean()),
                float(p[1].mean()),
                str(item.get("id", item["ids"][0] // 4)),
                color="#D55E00",
                ha="center",
                va="center",
                fontweight="bold",
            )
            ax.plot(*p[:, 0], "o", ms=4, color="#D55E00")
        else:
            ax.plot(*p, "+", ms=7, mew=1.2, color="#D55E00")
            ax.plot(*p, lw=0.5, color="#0072B2")
            for k in {0, p.shape[1] - 1}:
                ax.annotate(
                    str(item["ids"][k]),
                    (float(p[0, k]), float(p[1, k])),
                    xytext=(4, -4),
                    textcoords="offset points",
                    color="#0072B2",
                    fontweight="bold",
                )
        if lens and item.get("pose"):
            T = np.array(item["pose"]["T_camera_target"])
            length = float(item["size"]) * (1.0 if p.shape[1] == 4 else 2.0)
            origin = np.asarray(lens.project(T[:3, 3]))
            for axis, colour in enumerate(("#e41a1c", "#009E73", "#3b6fff")):
                tip = T[:3, 3] + length * T[:3, axis]
                if tip[2] > 0:
                    ax.plot(*np.c_[origin, np.asarray(lens.project(tip))], color=colour, lw=2.5)
    ax.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5))
    ax.axis("off")
    writing.make_folder(file.parent)
    writing.save_figure(fig, file)
    plt.close(fig)
