"""Targets: read, found in images, and `kr5 target`, which prints them and lists their points."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import typer

from kr5_tools.cli import arguments, tables, terminal
from kr5_tools.files import images, writing
from kr5_tools.files.documents import display_value, read_yaml
from kr5_tools.files.paths import library_path

app = typer.Typer(no_args_is_help=True)

Target = Annotated[
    str,
    typer.Option(
        "--target",
        "--board",
        metavar="TARGET",
        help=(
            "Short form, e.g. chessboard:6x9:0.025 (inner corners, rows first; lengths in"
            " m), or a file. --board is the same."
        ),
    ),
]
MM = 1000.0


def load_target(text: str) -> Any:
    """A target from its short form, from a YAML or JSON file with its fields, or from what `kr5 calibrate map`
    wrote."""
    import kr5

    if not text.endswith((".yaml", ".yml", ".json")):
        return kr5.parse_target(text)
    expected = "a file with the fields of a target, or a result of kr5 calibrate map"
    fields = read_yaml(text, expected)
    if isinstance(fields, dict) and str(fields.get("format", "")).startswith("kr5-marker-map/"):
        result = fields.get("result")
        fields = result.get("target") if isinstance(result, dict) else None
    if not isinstance(fields, dict):
        terminal.fail(f"{text}: found {display_value(fields)}, expected {expected}")
    try:
        return kr5.Target.from_dict(fields)
    except (KeyError, TypeError, ValueError) as error:
        terminal.fail(f"{text}: is not a target: {' '.join(str(error).split())}")


SMALLEST_TARGET, LARGEST_TARGET = 2e-4, 5.0  # of a square, a marker or the distance of dots [m]


def check_target_size(source: str, size: float) -> None:
    """Refuses a size that no target has, for what cannot find out: a camera sees no scale."""
    if not SMALLEST_TARGET <= size <= LARGEST_TARGET:
        hint = f"; for {size:g} mm give {size / MM:g}" if size > LARGEST_TARGET else ""
        terminal.fail(f"{source}: size {size:g} [m], expected {SMALLEST_TARGET:g} to {LARGEST_TARGET:g}{hint}")


@dataclass
class Sightings:
    """A target as it was seen in images of one size."""

    size: tuple[int, int] | None = None  # width, height [px]
    views: list[Any] = field(default_factory=list)  # named as `short_names` does
    index: list[int] = field(default_factory=list)  # place of each view's image in the list of files
    lost: list[dict[str, str]] = field(default_factory=list)  # name, status and message of the other images

    @property
    def width(self) -> int:
        """Of every image [px]."""
        return self.size[0] if self.size else 0

    @property
    def height(self) -> int:
        """Of every image [px]."""
        return self.size[1] if self.size else 0

    correlation: list[float] = field(default_factory=list)  # of the points of each view, as its detection says it [-]


def load_image(file: Path | str) -> Any:
    """Grey levels of an image, height x width."""
    import numpy as np
    from kr5 import vision

    return np.asarray(vision.load_image(library_path(file)))


def find_in_images(
    files: Sequence[Path | str],
    target: Any,
    least: int,
    points: int = 0,
    options: Any = None,
    load: Callable[[Path | str], Any] = load_image,
) -> Sightings:
    """The target in all images of one camera; complains when fewer than `least` show it with `points` or more, and of
    an image that cannot be read or is of another size than those before."""
    from kr5 import vision

    seen = Sightings()
    names = images.short_names(files)
    for i, file in terminal.track(list(enumerate(files)), "Looking for the target"):
        image = load(file)
        size = (image.shape[1], image.shape[0])
        seen.size = seen.size or size
        if size != seen.size:
            terminal.fail(
                f"{file}: {size[0]} x {size[1]} px, but {names[0]} is {seen.size[0]} x {seen.size[1]} px: images of one"
                " camera at one setting are needed"
            )
        found = vision.find_target(image, target, options or vision.DetectOptions())
        if str(found.status) != "found":
            seen.lost.append({"name": names[i], "status": str(found.status), "message": found.message})
        elif len(found.view.ids) < points:
            seen.lost.append({"name": names[i], "status": "few_points", "message": f"fewer than {points} points seen"})
        else:
            found.view.name = names[i]
            seen.views.append(found.view)
            seen.index.append(i)
            seen.correlation.append(found.correlation)
    if len(seen.views) < least:
        why = "; ".join(f"{item['name']}: {item['message']}" for item in seen.lost[:3]) or "Take more images."
        terminal.fail(
            f"the target was found in {len(seen.views)} of {len(files)} images, expected at least {least}. {why}"
        )
    return seen


@app.command("print", epilog="Example: kr5 target print --target chessboard:6x9:0.025 -o board.pdf")
def print_target(
    target: Target,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="PNG or PDF to write.")],
    dpi: Annotated[int, typer.Option(min=50, max=1200, help="Dots per inch.")] = 300,
    json_file: arguments.JsonOption = None,
) -> None:
    """Drawing of a target to scale, with a ruler of 100 mm to check the printer."""
    import kr5.vision
    import numpy as np

    if output.suffix.lower() not in (".png", ".pdf"):
        terminal.fail(f"{output}: found the ending '{output.suffix}', expected .png or .pdf")
    wanted = load_target(target)
    picture = kr5.vision.draw_target(wanted, dpi / 0.0254)
    size = [MM * float(v) for v in np.diff(kr5.vision.printed_area(wanted), axis=1).ravel()]
    _page(picture, size, target, dpi, output)
    writing.write_json({"file": str(output), "width_mm": size[0], "height_mm": size[1] + RULER, "dpi": dpi}, json_file)
    terminal.console(json_file).print(
        f"{output}: {size[0]:.1f} x {size[1] + RULER:.1f} mm at {dpi} dpi. Print at 100 % (no 'fit to page'), then"
        " measure the ruler.",
        soft_wrap=True,
    )


RULER = 16.0  # height of the strip below the target that holds ruler and text [mm]


def _page(picture: Any, size: list[float], target: str, dpi: int, output: Path) -> None:
    """One page as large as the target and its ruler."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    width, height = max(size[0], 20.0), size[1] + RULER
    figure = plt.figure(figsize=(width / 25.4, height / 25.4), dpi=dpi)
    try:
        sheet = figure.add_axes((0, RULER / height, size[0] / width, size[1] / height))
        sheet.imshow(picture, cmap="gray", vmin=0, vmax=255, interpolation="none", aspect="auto")
        sheet.set_axis_off()
        axes = figure.add_axes((0, 0, 1, RULER / height), xlim=(0, width), ylim=(0, RULER))
        axes.set_axis_off()
        length = min(100, 10 * math.floor((width - 6) / 10))
        for mm in range(length + 1):
            axes.plot(
                [3 + mm] * 2,
                [11, 11 - (3.5 if mm % 10 == 0 else 2 if mm % 5 == 0 else 1.2)],
                color="black",
                linewidth=0.4,
            )
        axes.plot([3, 3 + length], [11, 11], color="black", linewidth=0.4)
        text = f"{length} mm · {target} · lengths in metres" if len(target) < 80 else f"{length} mm"
        axes.text(3, 3, text, fontsize=max(3.0, min(7.0, 1.5 * width / len(text) / 0.3528)), va="center")
        writing.save_figure(figure, output, dpi=dpi)
    finally:
        plt.close(figure)


@app.command("points", epilog="Example: kr5 target points --target grid:36h11:5x7:0.03:0.01 --json -")
def points(target: Target, json_file: arguments.JsonOption = None) -> None:
    """List of the points of a target that detectors find, in the frame of the target."""
    import kr5

    where, ids = kr5.target_points(load_target(target))
    writing.write_json({"ids": ids, "points": where.T.tolist()}, json_file)
    rows = ([str(i), *(f"{MM * float(v):.3f}" for v in p)] for i, p in zip(ids, where.T))
    terminal.console(json_file).print(tables.make_table(target, ["point", "x [mm]", "y [mm]", "z [mm]"], rows))
