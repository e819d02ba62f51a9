"""`kr5 scene`: scenes in DART."""

import os
from pathlib import Path
from typing import Annotated, Any, cast

import typer
from kr5.files import results, writing
from kr5.files.documents import read_yaml
from kr5.files.result_types import ResultData
from rich.markup import escape

from kr5_tools.cli import arguments, tables, terminal
from kr5_tools.cli.rerun_option import Rerun
from kr5_tools.cli.terminal import Console
from kr5_tools.replay.rerun_log import write_rerun
from kr5_tools.simulation import camera_images
from kr5_tools.simulation.scene_page import checks_table, scene_page, scene_result, scene_run, verdict_text

app = typer.Typer(no_args_is_help=True)


@app.callback()
def scene() -> None:
    """Scenes in DART: a cell, its controller, and the expected results (format kr5-scene/1)."""


@app.command(epilog="Example: kr5 scene run share/scenes/peg_insertion.yaml --csv rows.csv")
def run(
    file: Annotated[Path, typer.Argument(metavar="SCENE.yaml", help="The scene.")],
    csv: Annotated[
        Path | None, typer.Option("--csv", metavar="ROWS.csv", help="CSV with one row per controller cycle (SI).")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="PAGE.html", help="Page with a 3D replay."),
    ] = None,
    images: Annotated[
        Path | None,
        typer.Option(
            "--images",
            metavar="FOLDER",
            help="Folder for the camera images, as read by `kr5 calibrate hand-eye`; must not exist yet.",
        ),
    ] = None,
    scan: Annotated[
        Path | None, typer.Option("--scan", metavar="SCAN.csv", help="CSV of the profiles of the line scanner.")
    ] = None,
    window: Annotated[
        bool, typer.Option("--window", help="Display the scene in DART's window; needs a display.")
    ] = False,
    picture: Annotated[
        Path | None,
        typer.Option(
            "--picture", metavar="FILE.png", help="Save one frame of that window instead, from the middle of the scene."
        ),
    ] = None,
    rerun: Rerun = None,
    json_file: arguments.JsonOption = None,
) -> None:
    """Simulation of a scene, with the result of each expectation.

    Exit code 1 when an expectation is not met, 2 for bad input.
    """
    import kr5.io
    import kr5.sim

    if images:
        writing.check_new_folder(images)
    writing.check_writable(csv, output, scan, picture, rerun, json_file, inputs=[file])
    writing.check_page(output)
    shown = _window() if window or picture else None
    with terminal.spinner(f"running {file}"):
        result = kr5.sim.run_scene(file)
    if images and not result.pictures:
        terminal.fail(f"{file}: camera: is missing; with --images expected, such as camera: {{at: [1.0]}}")
    if scan and not len(result.profiles.columns):
        terminal.fail(f"{file}: scanner: is missing; with --scan expected, such as scanner: {{from: 0.0}}")
    to = terminal.console(json_file)
    data = scene_result(result, _title(file))
    print_checks(file, cast(ResultData, data), to)
    if csv:
        with writing.beside(csv) as new:
            kr5.io.save_csv(result.rows, new)
        to.print(f"{csv}: {len(result.rows.values)} rows.", soft_wrap=True)
    if scan:
        with writing.beside(scan) as new:
            kr5.io.save_csv(result.profiles, new)
        to.print(
            f"{scan}: {len(result.profiles.values)} points of {len(set(result.profiles['line']))} profiles.",
            soft_wrap=True,
        )
    if images and result.camera is not None:
        shots = [camera_images.Shot(p.q, p.T_base_flange, p.scene) for p in result.pictures]
        options = {k: v for k, v in result.camera.to_dict().items() if k != "at"}
        with writing.folder_beside(images) as new:
            files = camera_images.write_views(new, result.cell, shots, options)
        to.print(f"{images}: {len(files)} pictures.", soft_wrap=True)
    motion = scene_run(result) if output or rerun or shown else None
    if output and motion:
        writing.write_text(scene_page(result, cast(ResultData, data), motion, file), output)
        to.print(f"{output}: open it in a browser.", soft_wrap=True, markup=False)
    if rerun and motion:
        write_rerun(rerun, result.cell, [motion], to)
    if shown and motion and motion.q is not None:
        shown.show(result.cell, result.solids, motion.t.tolist(), motion.q.tolist(), str(picture or ""))
    results.write_result(json_file, "kr5-scene-result/1", **data)
    if not result.passed:
        raise typer.Exit(1)


def _window() -> Any:
    """The extension that opens windows; complains of what it lacks before the scene is run."""
    try:
        from kr5 import _kr5_window
    except ImportError:
        terminal.fail(
            "--window: this kr5 was built without DART's window (Debian: libdart-gui-osg-dev); -o PAGE.html shows the"
            " scene in a browser"
        )
    if not os.environ.get("DISPLAY"):
        terminal.fail("--window: there is no display (DISPLAY is not set); -o PAGE.html shows the scene in a browser")
    return _kr5_window


def _title(file: Path) -> str:
    return str(read_yaml(file).get("name") or file.stem)


def print_checks(file: Path, data: ResultData, to: Console) -> None:
    """Whether the scene passes, and each expectation with its time window, for people."""
    colour, word = ("green", "Passed") if data["passed"] else ("red", "Failed")
    text = f"{verdict_text(data).removesuffix('.')} in {file}."
    to.print(f"[bold {colour}]{word}:[/] {escape(text)}", soft_wrap=True, markup=True)
    table = checks_table(data)
    to.print()
    to.print(tables.make_table(table["title"], table["columns"], table["rows"], text=(1, 7, 8)))
