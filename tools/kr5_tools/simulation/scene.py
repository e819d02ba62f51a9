"""`kr5 scene`: scenes in DART."""

import os
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape

from kr5_tools.cell.frames import is_slide
from kr5_tools.cli import arguments, tables, terminal
from kr5_tools.files import writing
from kr5_tools.files.documents import read_yaml
from kr5_tools.replay.command import Rerun, make_page, write_rerun
from kr5_tools.simulation import camera_images

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
    shown = _window() if window or picture else None
    with terminal.spinner(f"running {file}"):
        result = kr5.sim.run_scene(file)
    if images and not result.pictures:
        terminal.fail(f"{file}: camera: is missing; with --images expected, such as camera: {{at: [1.0]}}")
    if scan and not len(result.profiles.columns):
        terminal.fail(f"{file}: scanner: is missing; with --scan expected, such as scanner: {{from: 0.0}}")
    to = terminal.console(json_file)
    print_checks(file, result, to)
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
    if output:
        writing.write_text(
            make_page(
                result.cell, [_run(result)], file, made_by="kr5 scene run", title=_title(file), solids=result.solids
            ),
            output,
        )
        to.print(f"{output}: open it in a browser.", soft_wrap=True, markup=False)
    if rerun:
        write_rerun(rerun, result.cell, [_run(result)], [result.rows], to)
    if shown:
        motion = _run(result)
        shown.show(result.cell, result.solids, motion["t"], motion["q"], str(picture or ""))
    checks = [check.to_dict() for check in result.checks]
    writing.write_json({"passed": result.passed, "steps": result.steps, "checks": checks}, json_file)
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


def _run(result: Any) -> dict[str, Any]:
    """Postures of the arm over the time of the scene."""
    import numpy as np

    n, t = result.cell.robot.joints, np.asarray(result.rows["t"])
    name = "push" if "push" in result.rows else "scene"
    if "link1" in result.rows:
        q = np.column_stack([result.rows[f"link{i + 1}"] for i in range(n)])
    else:
        t, q = _pushed(result, t)
    return {"name": name, "t": (t - t[0]).round(4).tolist(), "q": q.round(6).tolist(), "still": None}


def _pushed(result: Any, t: Any) -> tuple[Any, Any]:
    """A push knows the peg alone: postures of the arm that would hold it so."""
    import kr5.kinematics
    import numpy as np

    from kr5_tools.cell.command import rest_posture

    cell, rows = result.cell, result.rows
    limits = cell.robot.limits
    options = kr5.kinematics.InverseOptions(
        near=rest_posture(cell, None), **({"lower": limits.lower, "upper": limits.upper} if limits else {})
    )
    kept: list[Any] = []
    q: list[Any] = []
    for k in np.unique(np.linspace(0, len(t) - 1, min(len(t), 150)).round().astype(int)):
        T_tube_tool = np.eye(4)
        tilt, alpha = rows["tilt"][k], rows["alpha"][k]
        z = -np.array(
            [np.sin(tilt) * np.cos(alpha), np.sin(tilt) * np.sin(alpha), np.cos(tilt)]
        )  # E looks out of the peg
        x = np.cross([0.0, 1.0, 0.0], z)
        x /= np.linalg.norm(x)
        T_tube_tool[:3, :3], T_tube_tool[:3, 3] = (
            np.column_stack([x, np.cross(z, x), z]),
            [rows["x"][k], rows["y"][k], rows["z"][k]],
        )
        found = kr5.kinematics.inverse_kinematics(
            cell.nominal_chain(), cell.tube.T_base_tube @ T_tube_tool @ np.linalg.inv(cell.tool.T_flange_tool), options
        )
        usable = [np.asarray(p.q) for p in found.postures if p.usable]
        if not usable:
            terminal.fail(
                f"{cell.name}: tube.T_B_T: the arm cannot hold the peg at this pose, so that it cannot"
                " be displayed; leave out -o and --rerun"
            )
        near = np.asarray(q[-1] if q else options.near)
        q.append(min(usable, key=lambda p: np.linalg.norm(p - near)))
        kept.append(k)
    return t[kept], np.array(q)


# Unit of each column of a scene; a number that ends its name counts joints.
UNITS = {
    "t": "s",
    "i": "A",
    **dict.fromkeys(("fx", "fy", "fz", "push"), "N"),
    **dict.fromkeys(("tx", "ty", "tz"), "N m"),
    **dict.fromkeys(("x", "y", "z", "depth", "range"), "m"),
    **dict.fromkeys(("tilt", "alpha"), "rad"),
    "energy": "J",
    "limited": "-",
}


def column_unit(column: str, cell: Any) -> str:
    """Unit of a column of a scene; empty for one that no scene has."""
    name, number = column.rstrip("0123456789"), column[len(column.rstrip("0123456789")) :]
    if name in ("q", "link") and number:
        return "m" if is_slide(cell, int(number) - 1) else "rad"
    return UNITS.get(name, "")


def print_checks(file: Path, result: Any, to: Any) -> None:
    """Whether the scene passes, and each expectation with its time window, for people."""
    count, met = len(result.checks), sum(c.passed for c in result.checks)
    colour, word = ("green", "Passed") if result.passed else ("red", "Failed")
    text = f"{met} of {count} expectation{'' if count == 1 else 's'} met in {file}."
    to.print(f"[bold {colour}]{word}:[/] {escape(text)}", soft_wrap=True, markup=True)
    end = float(result.rows["t"][-1])
    rows = []
    for check in result.checks:
        e = check.expected
        bounds = ["" if bound is None else f"{bound:.6g}" for bound in (e.least, e.most)]
        window = [f"{e.begin:g}", f"{end if e.end is None else e.end:g}"]
        verdict = "met" if check.passed else "not met"
        rows.append(
            [
                e.column,
                str(e.statistic),
                *window,
                f"{check.value:.6g}",
                *bounds,
                column_unit(e.column, result.cell),
                verdict,
            ]
        )
    heads = ["column", "statistic", "from [s]", "to [s]", "value", "at least", "at most", "unit", "result"]
    to.print()
    to.print(tables.make_table("Expectations", heads, rows, text=(1, 7, 8)))
