"""`kr5 replay`: one self-contained page in which a cell moves as it was recorded."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from kr5_tools.cli import arguments, terminal
from kr5_tools.files import writing

app = typer.Typer()

Rerun = Annotated[
    Path | None,
    typer.Option(
        "--rerun",
        metavar="FILE.rrd",
        help="Rerun recording to write: poses of links, columns over time. Needs pip install 'kr5\\[rerun]'.",
    ),
]

HOLD = 0.8  # [s] from one static posture to the next


@app.command(epilog="Example: kr5 replay recordings/monday -o replay.html")
def replay(
    path: Annotated[Path, typer.Argument(metavar="PATH", help="The folder of a recording, or a cell file.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="The page.")] = Path("replay.html"),
    rows: Annotated[int, typer.Option(min=2, help="Largest number of postures of one experiment.")] = 800,
    rerun: Rerun = None,
    json_file: arguments.JsonOption = None,
) -> None:
    """Page with the arm, its tool, peg, tube and board in 3D and a time slider; for a cell file, each joint moves
    in turn.
    """
    import kr5.cell

    writing.check_writable(output, rerun, json_file, inputs=[path])
    recording = kr5.cell.load_recording(path) if (path / "recording.yaml").is_file() else None
    if recording is None and path.is_dir():
        terminal.fail(
            f"{path}: is a folder without a recording.yaml; expected the folder of a recording or a cell file"
        )
    cell = recording.cell if recording else kr5.cell.load_cell(path)
    runs = recorded_runs(recording, cell, rows) if recording else [joint_by_joint(cell)]
    if not runs:
        terminal.fail(
            f"{path}: no experiment has the joint columns q1..q{cell.robot.joints}; expected a recording with motion, "
            "poses, views or scan"
        )
    writing.write_text(make_page(cell, runs, path), output)
    tables = (
        [next(e.data for e in recording.experiments if r["name"] == f"{e.name} ({e.kind})") for r in runs]
        if recording
        else []
    )
    write_rerun(rerun, cell, runs, tables, terminal.console(json_file))
    shown = [{"name": r["name"], "postures": len(r["q"]), "duration": r["t"][-1]} for r in runs]
    writing.write_json({"replay": str(output), "runs": shown}, json_file)
    terminal.console(json_file).print(
        f"{output}: {len(runs)} {'motion' if len(runs) == 1 else 'motions'}, {sum(r['postures'] for r in shown)}"
        " frames. Open it in a browser.",
        soft_wrap=True,
        markup=False,
    )


def recorded_runs(recording: Any, cell: Any, most: int) -> list[dict[str, Any]]:
    """Of each experiment with joint columns: postures over time, thinned out to `most`."""
    import numpy as np

    n, runs = cell.robot.joints, []
    for experiment in recording.experiments:
        if any(f"q{i + 1}" not in experiment.data for i in range(n)):
            continue
        q = np.column_stack([experiment[f"q{i + 1}"] for i in range(n)])
        q = q[np.all(np.isfinite(q), axis=1)]
        moving = str(experiment.kind) == "motion"
        if not moving and len(q):
            q = q[np.append(True, np.any(np.diff(q, axis=0) != 0, axis=1))]  # a posture has many rows
        rows = np.linspace(0, len(q) - 1, min(len(q), most)).round().astype(int) if len(q) else np.empty(0, int)
        keep = np.unique(rows)
        if len(keep) < 2:
            continue
        t = np.asarray(experiment["t"])[keep] - experiment["t"][0] if moving else HOLD * np.arange(len(keep))
        if np.any(np.diff(t) <= 0):
            terminal.fail(
                f"{experiment.name}: t: found times that do not increase, expected each row later than the previous one"
            )
        runs.append(
            {
                "name": f"{experiment.name} ({experiment.kind})",
                "t": t.round(4).tolist(),
                "q": q[keep].round(6).tolist(),
                "still": None if moving else HOLD,
            }
        )
    return runs


def joint_by_joint(cell: Any) -> dict[str, Any]:
    """A tour from the rest posture: each joint to both sides, within its limits."""
    from kr5_tools.cell.command import rest_posture
    from kr5_tools.cell.frames import is_slide

    rest, limits = rest_posture(cell, None), cell.robot.limits
    t, q = [], []
    for joint in range(cell.robot.joints):
        reach = 0.1 if is_slide(cell, joint) else math.radians(35)
        low = max(rest[joint] - reach, limits.lower[joint]) if limits else rest[joint] - reach
        high = min(rest[joint] + reach, limits.upper[joint]) if limits else rest[joint] + reach
        for k in range(40):
            swing = math.sin(2 * math.pi * k / 40)
            to = rest[joint] + swing * ((high - rest[joint]) if swing > 0 else (rest[joint] - low))
            t.append(round(3 * joint + 3 * k / 40, 4))
            q.append([round(to, 6) if i == joint else x for i, x in enumerate(rest)])
    return {"name": "each joint in turn", "t": [*t, 3.0 * cell.robot.joints], "q": [*q, rest], "still": None}


def cell_scene(cell: Any) -> dict[str, Any]:
    """What a page draws of a cell: the arm's rows, what it carries, what stands beside it."""
    from kr5_tools.cell.frames import target_frames

    tube, peg, sphere, board = cell.tube, cell.peg, cell.laser and cell.laser.target, cell.board
    boards = [
        {"T": T, "rows": board.rows, "cols": board.cols, "marker": board.marker, "gap": board.gap}
        for name, T in target_frames(cell, "T_base_target").items()
        if board and name.endswith("board")
    ]
    scene: dict[str, Any] = writing.to_plain(
        {
            "T_base_0": cell.robot.T_base_0,
            "joints": [{**row.to_dict(), "type": str(row.type)} for row in cell.robot.dh],
            "T_flange_tool": cell.tool and cell.tool.T_flange_tool,
            "T_flange_sensor": cell.tool and cell.tool.T_flange_sensor,
            "T_flange_camera": cell.T_flange_camera(),
            "T_flange_scanner": cell.T_flange_scanner(),
            "boards": boards,
            "peg": peg and {"radius": peg.radius, "length": peg.length},
            "tube": (
                tube
                and {"inner": tube.inner_radius, "outer": tube.outer_radius, "depth": tube.depth, "T": tube.T_base_tube}
            ),
            "sphere": sphere and {"centre": sphere.sphere, "radius": sphere.radius},
        }
    )
    return scene


def make_page(
    cell: Any,
    runs: list[dict[str, Any]],
    source: Path,
    made_by: str = "kr5 replay",
    title: str = "",
    solids: Sequence[Any] = (),
    T_base_actual: Any = None,
    template: str = "replay.html",
    **values: Any,
) -> str:
    """The HTML of the page. `solids`: solids that stand in the cell beside its own. `T_base_actual`: where the tube
    really is, if not where the cell says. A template that extends replay.html gets `values`; of each run, `notes` may
    hold [time, what begins then]."""
    import kr5

    from kr5_tools.pages.rendering import render_page, script_json

    text = f"{cell.robot.joints} joints, {len(runs)} {'motion' if len(runs) == 1 else 'experiments'}"
    data = {**cell_scene(cell), "runs": runs, "solids": [_drawn(cell, solid, runs[0]["q"][0]) for solid in solids]}
    if T_base_actual is not None:
        data["tube"]["T"] = writing.to_plain(T_base_actual)
    return render_page(
        template,
        brand=made_by,
        title=title or cell.name or source.stem,
        text=text,
        runs=[r["name"] for r in runs],
        data=script_json(data),
        version=kr5.__version__,
        source=source.name,
        **values,
    )


def _drawn(cell: Any, solid: Any, q: list[float]) -> dict[str, Any]:
    """A solid as the page draws it; of a bench without end, the part below the tool."""
    out: dict[str, Any] = writing.to_plain({**solid.to_dict(), "T": solid.T_base_object})
    if solid.width > 1.0:
        tip = cell.T_base_tool(q)
        out |= {"width": 0.5, "height": 0.5}
        for i in range(2):
            out["T"][i][3] = float(tip[i, 3])
    return out


def write_rerun(file: Path | None, cell: Any, runs: list[dict[str, Any]], tables: list[Any], to: Any) -> None:
    """The same as a Rerun recording, when a file is asked for."""
    if file is None:
        return
    from kr5_tools.replay import rerun_log

    rerun_log.write_log(rerun_log.log_entries(cell, runs, tables), file)
    to.print(f"{file}: open it with `rerun {file}`.", soft_wrap=True, markup=False)
