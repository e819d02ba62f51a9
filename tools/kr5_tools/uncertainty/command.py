"""`kr5 uncertainty chain`, `camera-matrix`, `laser`, `fusion`."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, cast

import typer
from kr5.files import results, writing
from kr5.files.result_types import ResultData

from kr5_tools.cli import terminal
from kr5_tools.cli.arguments import JsonOption, PngOption, ResultOption
from kr5_tools.cli.tables import print_result
from kr5_tools.uncertainty import camera_matrix as camera_matrix_module
from kr5_tools.uncertainty import chain as chain_module
from kr5_tools.uncertainty import sensors
from kr5_tools.uncertainty.documents import BOOK
from kr5_tools.uncertainty.tables import print_part

app = typer.Typer(help="Uncertainty through chains of poses, of camera, scanner and both fused.", no_args_is_help=True)
FORMAT = "kr5-uncertainty/1"

PageOption = Annotated[Path | None, typer.Option("--report", metavar="PAGE.html", help="Page to write.")]
SigmaTranslation = Annotated[
    float | None,
    typer.Option(
        metavar="MM",
        show_default=False,
        help="Standard deviation of the position of every sensor, in place of that of the file \\[mm]. The book has"
        " 0.01; the repeatability of the arm suggests 0.033.",
    ),
]
SigmaRotation = Annotated[
    float | None,
    typer.Option(
        metavar="DEG",
        show_default=False,
        help="Standard deviation of the rotation of every sensor, in place of that of the file \\[deg]. The book leaves"
        " it out.",
    ),
]


@app.callback()
def _root() -> None:
    pass


@app.command(epilog="Example: kr5 uncertainty chain -o chain.json --report chain.html")
def chain(
    file: Annotated[
        Path | None,
        typer.Argument(
            metavar="[CHAIN.yaml]",
            show_default=False,
            help="Chain of poses with covariances or deviations by axis, and a point; by default robot and grid of"
            " Hayat et al. 2022, section 3.4.1.",
        ),
    ] = None,
    confidence: Annotated[
        float | None,
        typer.Option(show_default=False, help="Probability of the ellipsoids, in place of the file's \\[-]."),
    ] = None,
    output: ResultOption = None,
    report: PageOption = None,
    png: PngOption = None,
    json_file: JsonOption = None,
) -> None:
    """Covariance of a product of poses, to first order and by the unscented transform, with the ellipsoids that hold
    the error; of a point with and without the error of the rotation.

    Every covariance is checked; an invalid one is refused, with its negative eigenvalue.
    """
    writing.check_writable(output, report, json_file, inputs=[file])
    names, poses, point, stated, source = chain_module.read_chain(file)
    found = chain_module.chain_result(names, poses, point, _probability(confidence, stated))
    _write(found, source, output, report, png, json_file)


@app.command("camera-matrix", epilog="Example: kr5 uncertainty camera-matrix --draws 1000 --report camera.html")
def camera_matrix(
    file: Annotated[
        Path | None,
        typer.Argument(
            metavar="[SCENE.yaml]", show_default=False, help="Camera and board; by default those of the book."
        ),
    ] = None,
    distance: Annotated[
        float | None, typer.Option(show_default=False, help="Distance of the board, in place of the file's \\[mm].")
    ] = None,
    columns: Annotated[
        int | None, typer.Option(min=2, max=100, show_default=False, help="Corners across, in place of the file's.")
    ] = None,
    rows: Annotated[
        int | None, typer.Option(min=2, max=100, show_default=False, help="Corners up, in place of the file's.")
    ] = None,
    draws: Annotated[int, typer.Option(min=100, max=1000000, help="Draws of the simulation.")] = 4000,
    seed: Annotated[int, typer.Option(min=0, help="Random seed.")] = 1,
    noisy_pixel: Annotated[
        bool, typer.Option("--noisy-pixel", help="Also give noise to the pixel that is projected back.")
    ] = False,
    confidence: Annotated[float, typer.Option(help="Probability of the ellipses \\[-].")] = 0.95,
    output: ResultOption = None,
    report: PageOption = None,
    png: PngOption = None,
    json_file: JsonOption = None,
) -> None:
    """Uncertainty of points on a plane that are projected back by a camera matrix estimated from noisy corners of a
    board on two planes: by simulation, by the exact Jacobian, and by eq. 3.56 of Hayat et al. 2022, beside its
    Table 3.5."""
    writing.check_writable(output, report, json_file, inputs=[file])
    if distance is not None and not 0 < distance < math.inf:
        terminal.fail(f"--distance: found {distance:g}, expected more than 0 mm")
    scene = camera_matrix_module.load_scene(file, None if distance is None else 1e-3 * distance, columns, rows)
    with terminal.spinner("Simulating"):
        found = camera_matrix_module.camera_matrix_result(
            scene, draws, seed, noisy_pixel, _probability(confidence, 0.95)
        )
    _write(found, file or BOOK / "camera_matrix.yaml", output, report, png, json_file)


@app.command(epilog="Example: kr5 uncertainty laser --sigma-rotation 0.1 --report laser.html")
def laser(
    file: Annotated[
        Path | None,
        typer.Argument(metavar="[SENSORS.yaml]", show_default=False, help="Sensors; by default the book's scanner."),
    ] = None,
    sigma_translation: SigmaTranslation = None,
    sigma_rotation: SigmaRotation = None,
    output: ResultOption = None,
    report: PageOption = None,
    png: PngOption = None,
    json_file: JsonOption = None,
) -> None:
    """Covariance of what a line scanner measures, in the frame of the flange (Hayat et al. 2022, eq. 3.60 and 3.61),
    beside the printed one (eq. 3.68)."""
    _sensors(file or BOOK / "laser.yaml", sigma_translation, sigma_rotation, False, (output, report, png, json_file))


@app.command(epilog="Example: kr5 uncertainty fusion -o fusion.json --png plots")
def fusion(
    file: Annotated[
        Path | None,
        typer.Argument(
            metavar="[SENSORS.yaml]", show_default=False, help="Sensors; by default scanner and camera of the book."
        ),
    ] = None,
    sigma_translation: SigmaTranslation = None,
    sigma_rotation: SigmaRotation = None,
    output: ResultOption = None,
    report: PageOption = None,
    png: PngOption = None,
    json_file: JsonOption = None,
) -> None:
    """Covariance of a point that several sensors measure, each alone and all fused (Hayat et al. 2022, section 3.4.4).

    The printed result (eq. 3.69) is no covariance: the command explains why and computes the right one.
    """
    _sensors(file or BOOK / "fusion.yaml", sigma_translation, sigma_rotation, True, (output, report, png, json_file))


Outputs = tuple[Path | None, Path | None, Path | None, Path | None]


def _sensors(file: Path, translation: float | None, rotation: float | None, fused: bool, outputs: Outputs) -> None:
    output, report, png, json_file = outputs
    writing.check_writable(output, report, json_file, inputs=[file])
    for name, value in (("--sigma-translation", translation), ("--sigma-rotation", rotation)):
        if value is not None and not 0 <= value < math.inf:
            terminal.fail(f"{name}: found {value:g}, expected 0 or more")
    read = sensors.read_sensors(
        file, None if translation is None else 1e-3 * translation, None if rotation is None else math.radians(rotation)
    )
    _write(sensors.sensors_result(read, fused), file, output, report, png, json_file)


def _probability(given: float | None, stated: float) -> float:
    if given is not None and not 0 < given < 1:
        terminal.fail(f"--confidence: found {given:g}, expected a probability between 0 and 1")
    return stated if given is None else given


def _write(
    found: Mapping[str, object],
    source: Path,
    output: Path | None,
    report: Path | None,
    png: Path | None,
    json_file: Path | None,
) -> None:
    from kr5_tools.uncertainty.page import write_page

    data = results.write_result(output, FORMAT, input={"file": str(source)}, **found)
    to = terminal.console(json_file)
    print_result(data, to)
    for part in data["parts"]:
        print_part(part, to)
    writing.write_json(data, json_file)
    if report is None and png is None:
        return
    if report is not None:
        write_page(cast(ResultData, data), source.name, report, png)
        to.print(f"{report}: open it in a browser.", soft_wrap=True, markup=False)
        return
    _write_plots(data, png)


def _write_plots(data: dict[str, Any], png: Path | None) -> None:
    from kr5_tools.pages.plot_style import plt
    from kr5_tools.pages.rendering import write_png
    from kr5_tools.uncertainty.plots import part_plots

    drawn = [plot for part in data["parts"] for plot in part_plots(part)]
    if png is not None:
        write_png(drawn, png)
    for plot in drawn:
        plt.close(plot.figure)
