"""`kr5 scene`: scenes in DART."""

import os
from pathlib import Path
from typing import Annotated, Any

import typer
import yaml

from . import common, pictures
from .replay import Rerun, make_page, write_rerun

app = typer.Typer(no_args_is_help=True)


@app.callback()
def scene() -> None:
    """Scenes in DART: a cell, what drives it, and what must come of it (format kr5-scene/1)."""


@app.command(epilog="Example: kr5 scene run share/scenes/peg_insertion.yaml --csv rows.csv")
def run(
    file: Annotated[Path, typer.Argument(metavar="SCENE.yaml", help="The scene.")],
    csv: Annotated[Path | None, typer.Option("--csv", metavar="ROWS.csv", help="Write a row every controller cycle here.")] = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", metavar="PAGE.html", help="Write a page here on which it is seen in 3D.")] = None,
    images: Annotated[Path | None, typer.Option("--images", metavar="FOLDER", help="Write the pictures of its camera here, as `kr5 calibrate "
                                                "hand-eye` reads them; must not be there yet.")] = None,
    scan: Annotated[Path | None, typer.Option("--scan", metavar="SCAN.csv", help="Write the profiles of its line scanner here.")] = None,
    window: Annotated[bool, typer.Option("--window", help="Show it in DART's own window, which needs a display.")] = False,
    picture: Annotated[Path | None, typer.Option("--picture", metavar="FILE.png", help="Save one frame of that window instead, from the middle "
                                                 "of the scene.")] = None,
    rerun: Rerun = None,
    json_file: common.Json = None,
) -> None:
    """Runs a scene and says what came of each expectation. Exit code 1 when one did not come true, 2 for bad input."""
    import kr5.io
    import kr5.sim

    if images:
        pictures.refuse_full(images)
    shown = _window() if window or picture else None
    with common.working(f"running {file}"):
        result = kr5.sim.run_scene(file)
    if images and not result.pictures:
        common.fail(f"{file}: camera: is missing; with --images expected, such as camera: {{at: [1.0]}}")
    if scan and not len(result.profiles.columns):
        common.fail(f"{file}: scanner: is missing; with --scan expected, such as scanner: {{from: 0.0}}")
    to = common.console(json_file)
    to.print(common.table(str(file), ["column", "statistic", "came", "least", "most", "verdict"], [_row(c) for c in result.checks]))
    if csv:
        kr5.io.save_csv(result.rows, csv)
        to.print(f"{csv}: {len(result.rows.values)} rows.", soft_wrap=True)
    if scan:
        kr5.io.save_csv(result.profiles, scan)
        to.print(f"{scan}: {len(result.profiles.values)} points of {len(set(result.profiles['line']))} profiles.", soft_wrap=True)
    if images:
        shots = [pictures.Shot(p.q, p.T_B_F, p.sight) for p in result.pictures]
        files = pictures.write_views(images, result.cell, shots, {k: v for k, v in result.camera.to_dict().items() if k != "at"})
        to.print(f"{images}: {len(files)} pictures.", soft_wrap=True)
    if output:
        common.write_text(make_page(result.cell, [_run(result)], file, made_by="kr5 scene run", title=_title(file), things=result.things), output)
        to.print(f"{output}: open it in a browser.", soft_wrap=True, markup=False)
    if rerun:
        write_rerun(rerun, result.cell, [_run(result)], [result.rows], to)
    if shown:
        motion = _run(result)
        shown.show(result.cell, result.things, motion["t"], motion["q"], str(picture or ""))
    checks = [check.to_dict() for check in result.checks]
    common.write_json({"passed": result.passed, "steps": result.steps, "checks": checks}, json_file)
    if not result.passed:
        raise typer.Exit(1)


def _window() -> Any:
    """The extension that opens windows; complains of what it lacks before the scene is run."""
    try:
        from kr5 import _kr5_window
    except ImportError:
        common.fail("--window: this kr5 was built without DART's window (Debian: libdart-gui-osg-dev); -o PAGE.html shows the scene in a browser")
    if not os.environ.get("DISPLAY"):
        common.fail("--window: there is no display (DISPLAY is not set); -o PAGE.html shows the scene in a browser")
    return _kr5_window


def _title(file: Path) -> str:
    return str(yaml.safe_load(file.read_text(encoding="utf-8")).get("name") or file.stem)


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

    from .cell import rest_posture

    cell, rows = result.cell, result.rows
    limits = cell.robot.limits
    options = kr5.kinematics.InverseOptions(near=rest_posture(cell, None), **({"lower": limits.lower, "upper": limits.upper} if limits else {}))
    kept, q = [], []
    for k in np.unique(np.linspace(0, len(t) - 1, min(len(t), 150)).round().astype(int)):
        T_T_E = np.eye(4)
        tilt, alpha = rows["tilt"][k], rows["alpha"][k]
        z = -np.array([np.sin(tilt) * np.cos(alpha), np.sin(tilt) * np.sin(alpha), np.cos(tilt)])  # E looks out of the peg
        x = np.cross([0.0, 1.0, 0.0], z)
        x /= np.linalg.norm(x)
        T_T_E[:3, :3], T_T_E[:3, 3] = np.column_stack([x, np.cross(z, x), z]), [rows["x"][k], rows["y"][k], rows["z"][k]]
        found = kr5.kinematics.inverse(cell.chain(), cell.tube.T_B_T @ T_T_E @ np.linalg.inv(cell.tool.T_F_E), options)
        usable = [np.asarray(p.q) for p in found.postures if p.usable]
        if not usable:
            common.fail(f"{cell.name}: tube.T_B_T: the arm cannot hold the peg there, so there is nothing to show; leave out -o and --rerun")
        near = np.asarray(q[-1] if q else options.near)
        q.append(min(usable, key=lambda p: np.linalg.norm(p - near)))
        kept.append(k)
    return t[kept], np.array(q)


def _row(check) -> list[str]:
    e = check.expected
    bounds = ["" if bound is None else f"{bound:g}" for bound in (e.least, e.most)]
    return [e.column, str(e.statistic), f"{check.value:g}", *bounds, "ok" if check.passed else "[red]failed[/red]"]
