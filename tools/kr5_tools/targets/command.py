"""`kr5 target`: prints targets and lists their points."""

from pathlib import Path
from typing import Annotated, Literal

import typer
from kr5.files import writing

from kr5_tools.cli import arguments, tables, terminal
from kr5_tools.cli.arguments import Target
from kr5_tools.targets import sheet
from kr5_tools.targets.sightings import MM, load_target

app = typer.Typer(no_args_is_help=True)


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
