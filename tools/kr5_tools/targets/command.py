"""Targets: read, found in images, and `kr5 target`, which prints them and lists their points."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from kr5.files import images, writing
from kr5.files.documents import display_value, read_yaml
from kr5.files.paths import library_path

from kr5_tools.cli import arguments, tables, terminal
from kr5_tools.targets import sheet

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


@app.command("print", epilog="Example: kr5 target print --target chessboard:5x8:0.025 --paper a4 -o board.pdf")
def print_target(
    target: Target,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="PNG or PDF to write.")],
    paper: Annotated[
        str | None,
        typer.Option(
            metavar="PAPER",
            show_default=False,
            help=f"Paper: {', '.join(sheet.PAPERS)}, or WIDTHxHEIGHT \\[mm]; by default as large as target and ruler.",
        ),
    ] = None,
    orientation: Annotated[
        Literal["auto", "portrait", "landscape"],
        typer.Option(help="Orientation of the paper; auto: portrait where the target fits, else landscape."),
    ] = "auto",
    dpi: Annotated[int, typer.Option(min=50, max=1200, help="Dots per inch.")] = 300,
    json_file: arguments.JsonOption = None,
) -> None:
    """Drawing of a target to scale, with a ruler of 100 mm to check the printer.

    A target that does not fit on the paper is refused, with the largest one that does.
    """
    import kr5.vision

    if output.suffix.lower() not in (".png", ".pdf"):
        terminal.fail(f"{output}: found the ending '{output.suffix}', expected .png or .pdf")
    writing.check_writable(output, json_file)
    if orientation != "auto" and paper is None:
        terminal.fail(f"--orientation: found {orientation} without a paper; expected --paper too, such as --paper a4")
    wanted = load_target(target)
    with terminal.spinner("drawing the target"):
        area = kr5.vision.printed_area(wanted)
        extent = (MM * float(area[0, 1] - area[0, 0]), MM * float(area[1, 1] - area[1, 0]))
        size = (
            sheet.choose_sheet(target, wanted, paper, orientation)
            if paper
            else (max(extent[0], 20.0), extent[1] + sheet.RULER)
        )
        picture = kr5.vision.draw_target(wanted, dpi / 0.0254)
        sheet.save_sheet(sheet.draw_sheet(picture, target, extent, size, dpi), output, dpi)
    told = {"file": str(output), "width_mm": size[0], "height_mm": size[1], "dpi": dpi, "paper": paper}
    writing.write_json(told, json_file)
    on = f"{paper}, {'portrait' if size[0] <= size[1] else 'landscape'}, " if paper else ""
    terminal.console(json_file).print(
        f"{output}: {on}{size[0]:.1f} x {size[1]:.1f} mm at {dpi} dpi. Print at 100 % (no 'fit to page'), then"
        " measure the ruler.",
        soft_wrap=True,
    )


@app.command("points", epilog="Example: kr5 target points --target grid:36h11:5x7:0.03:0.01 --json -")
def points(target: Target, json_file: arguments.JsonOption = None) -> None:
    """List of the points of a target that detectors find, in the frame of the target."""
    import kr5

    where, ids = kr5.target_points(load_target(target))
    writing.write_json({"ids": ids, "points": where.T.tolist()}, json_file)
    rows = ([str(i), *(f"{MM * float(v):.3f}" for v in p)] for i, p in zip(ids, where.T))
    terminal.console(json_file).print(tables.make_table(target, ["point", "x [mm]", "y [mm]", "z [mm]"], rows))
