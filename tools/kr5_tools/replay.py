"""`kr5 replay`: one self-contained page in which a cell moves as it was recorded."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from . import common

app = typer.Typer()

Rerun = Annotated[Path | None, typer.Option("--rerun", metavar="FILE.rrd", help="Write a Rerun recording here: poses of links, columns "
                                            "over time. Needs pip install 'kr5[rerun]'.")]

HOLD = 0.8  # [s] from one static posture to the next


@app.command(epilog="Example: kr5 replay recordings/monday -o replay.html")
def replay(
    path: Annotated[Path, typer.Argument(metavar="PATH", help="The folder of a recording, or a cell file.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="The page.")] = Path("replay.html"),
    rows: Annotated[int, typer.Option(min=2, help="Most postures to keep of one experiment.")] = 800,
    rerun: Rerun = None,
    json_file: common.Json = None,
) -> None:
    """Shows the arm, its tool, peg, tube and board in 3D with a time slider; of a bare cell, each joint moving in turn."""
    import kr5.cell

    recording = kr5.cell.load_recording(path) if (path / "recording.yaml").is_file() else None
    if recording is None and path.is_dir():
        common.fail(f"{path}: is a folder without a recording.yaml; expected the folder of a recording or a cell file")
    cell = recording.cell if recording else kr5.cell.load_cell(path)
    runs = recorded_runs(recording, cell, rows) if recording else [joint_by_joint(cell)]
    if not runs:
        common.fail(f"{path}: no experiment has the joint columns q1..q{cell.robot.joints}; expected a recording with motion, "
                    "poses, views or scan")
    common.write_text(make_page(cell, runs, path), output)
    tables = [next(e.data for e in recording.experiments if r["name"] == f"{e.name} ({e.kind})") for r in runs] if recording else []
    write_rerun(rerun, cell, runs, tables, common.console(json_file))
    shown = [{"name": r["name"], "postures": len(r["q"]), "duration": r["t"][-1]} for r in runs]
    common.write_json({"replay": str(output), "runs": shown}, json_file)
    common.console(json_file).print(f"{output}: {len(runs)} to see, {sum(r['postures'] for r in shown)} postures. Open it in a browser.",
                                    soft_wrap=True, markup=False)


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
        keep = np.unique(np.linspace(0, len(q) - 1, min(len(q), most)).round().astype(int)) if len(q) else []
        if len(keep) < 2:
            continue
        t = np.asarray(experiment["t"])[keep] - experiment["t"][0] if moving else HOLD * np.arange(len(keep))
        if np.any(np.diff(t) <= 0):
            common.fail(f"{experiment.name}: t: found times that do not grow, expected each row later than the one before")
        runs.append({"name": f"{experiment.name} ({experiment.kind})", "t": t.round(4).tolist(), "q": q[keep].round(6).tolist(),
                     "still": None if moving else HOLD})
    return runs


def joint_by_joint(cell: Any) -> dict[str, Any]:
    """A tour from the rest posture: each joint to both sides, within its limits."""
    from .cell import rest_posture
    from .cell_frames import is_slide

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
    from .cell_frames import target_frames

    tube, peg, sphere, board = cell.tube, cell.peg, cell.laser and cell.laser.target, cell.board
    boards = [{"T": T, "rows": board.rows, "cols": board.cols, "marker": board.marker, "gap": board.gap}
              for name, T in target_frames(cell, "T_B_W").items() if board and name.endswith("board")]
    return common.plain({
        "T_B_0": cell.robot.T_B_0, "joints": [{**row.to_dict(), "type": str(row.type)} for row in cell.robot.dh],
        "T_F_E": cell.tool and cell.tool.T_F_E, "T_F_S": cell.tool and cell.tool.T_F_S, "T_F_C": cell.T_F_C(),
        "T_F_L": cell.T_F_L(), "boards": boards, "peg": peg and {"radius": peg.radius, "length": peg.length},
        "tube": tube and {"inner": tube.inner_radius, "outer": tube.outer_radius, "depth": tube.depth, "T": tube.T_B_T},
        "sphere": sphere and {"centre": sphere.sphere, "radius": sphere.radius},
    })


def make_page(cell: Any, runs: list[dict[str, Any]], source: Path, made_by: str = "kr5 replay", title: str = "",
              things: Sequence[Any] = (), T_B_tube: Any = None, template: str = "replay.html", **values: Any) -> str:
    """The HTML of the page. `things`: solids that stand in the cell beside its own. `T_B_tube`: where the tube really is, if not where
    the cell says. A template that extends replay.html gets `values`; of each run, `notes` may hold [time, what begins then]."""
    import kr5

    from .report_page import render, script_json

    text = f"{cell.robot.joints} joints, {len(runs)} {'motion' if len(runs) == 1 else 'experiments'}"
    data = {**cell_scene(cell), "runs": runs, "things": [_drawn(cell, thing, runs[0]["q"][0]) for thing in things]}
    if T_B_tube is not None:
        data["tube"]["T"] = common.plain(T_B_tube)
    return render(template, brand=made_by, title=title or cell.name or source.stem, text=text, runs=[r["name"] for r in runs],
                  data=script_json(data), version=kr5.__version__, source=source.name, **values)


def _drawn(cell: Any, thing: Any, q: list[float]) -> dict[str, Any]:
    """A thing as the page draws it; of a bench without end, the part below the tool."""
    out = common.plain({**thing.to_dict(), "T": thing.T_B_O})
    if thing.width > 1.0:
        tip = cell.T_B_E(q)
        out |= {"width": 0.5, "height": 0.5}
        for i in range(2):
            out["T"][i][3] = float(tip[i, 3])
    return out


def write_rerun(file: Path | None, cell: Any, runs: list[dict[str, Any]], tables: list[Any], to: Any) -> None:
    """The same as a Rerun recording, when a file is asked for."""
    if file is None:
        return
    from . import rerun_log

    rerun_log.write(rerun_log.entries(cell, runs, tables), file)
    to.print(f"{file}: open it with `rerun {file}`.", soft_wrap=True, markup=False)
