"""Valid inputs of every command of `kr5`, small enough that a run takes a fraction of a second, and the commands
that read them.
"""

import ast
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import log_inputs
import numpy as np
import yaml
from fuzz_job import Job

ROOT = Path(__file__).resolve().parents[3]
SHARE = ROOT / "share"

PROTOCOL = """\
format: kr5-protocol/1
name: short
home: [0.0, 0.02, -2.75, 0.0, -0.3, 1.571]
load: 0.5
experiments:
- {name: motion-1, kind: motion, split: fit, signal: fourier, start: 0.0, duration: 3.0, reach: 0.7, speed: 0.2}
- {name: motion-2, kind: motion, split: check, signal: way_points, start: 10.0, count: 2, reach: 0.5, speed: 0.45,
pause: 0.1}
- {name: motion-3, kind: motion, split: check, signal: one_by_one, start: 20.0, reach: 0.48, swing: 1.0}
- {name: poses-1, kind: poses, split: fit, count: 10, start: 0.0, interval: 30.0, reach: 1.0}
- {name: views-1, kind: views, split: fit, count: 4, start: 0.0, interval: 20.0, near: 0.35, far: 0.6, tilt: 0.5}
- {name: scan-1, kind: scan, split: fit, passes: 1, lines: 3, points: 11, speeds: [0.01, 0.03]}
- {name: step-1, kind: step, split: fit, heights: [0.01], rest: 1.0, duration: 2.0}
- {name: press-1, kind: press, split: fit, speeds: [0.003], depth: 0.006}
- {name: profile-1, kind: profile, split: fit, tilts: [0.1745], cx: [0.007], cy: [-0.005], forces: [10.0], rows: 60}
"""
MAP = """\
format: kr5-map/1
cell: cell.yaml
clock: {column: time, unit: ms}
columns:
  qc: {from: "cmd_{}", unit: deg}
  q: {from: "pos_{}", unit: deg, scale: 1.0, offset: 0.0}
  i: {from: "cur_{}", unit: mA}
  wrench: {from: [Fx, Fy, Fz, Mx, My, Mz], unit: [N, N m], frame: [0, 0, 0, 0, 0, 0]}
resample: {every: 0.012, low_pass: 30}
experiments:
- {name: motion-1, kind: motion, split: fit, to: 3.5}
- {name: motion-2, kind: motion, split: check, from: 3.5}
"""
ARRAY_MAP = (
    MAP.replace("column: time", "column: t")
    .replace("cmd_{}", "qc[{0}]")
    .replace("pos_{}", "q[{0}]")
    .replace("cur_{}", "i[{0}]")
    .replace("from: [Fx, Fy, Fz, Mx, My, Mz]", 'from: ["w[0]", "w[1]", "w[2]", "w[3]", "w[4]", "w[5]"]')
)
MCAP_MAP = (
    MAP.replace("clock: {column: time, unit: ms}\n", "")
    .replace("cmd_{}", "/joints:qc.a{}")
    .replace("pos_{}", "/joints:q.a{}")
    .replace("cur_{}", "/joints:i.a{}")
    .replace(
        "from: [Fx, Fy, Fz, Mx, My, Mz]",
        'from: ["/wrench:w[0]", "/wrench:w[1]", "/wrench:w[2]", "/wrench:w[3]", "/wrench:w[4]", "/wrench:w[5]"]',
    )
)
RENDER = """\
camera: {width: 160, height: 120, fx: 150, fy: 150, cx: 79.5, cy: 59.5, k1: -0.1}
targets:
- {target: "chessboard:3x4:0.03", T_camera_target: [-0.04, -0.03, 0.4, 0.2, 0.1, 0.1]}
- {target: {kind: chessboard, rows: 3, cols: 4, size: 0.02}, T_camera_target: [0.04, 0.03, 0.4, 0.2, 0.1, 0.1]}
options: {blur: 0.7, noise: 2, seed: 4}
"""
BOARD = "chessboard:4x5:0.03"
TAGS = "grid:36h11:2x3:0.03:0.01"
CAMERA = {"width": 320, "height": 240, "fx": 300.0, "fy": 300.0, "cx": 159.5, "cy": 119.5}
VIEWS = 6


def _result(group: str, name: str, weight: float = 1.0) -> Job:
    return Job(
        group,
        f"report {name}.json -o page.html --json page.json",
        "results",
        (f"{name}.json",),
        ("page.html", "page.json"),
        weight,
    )


def _told_by_tests() -> list[Job]:
    """The DAMAGED of the tests of commands, of which each row is a job. They are read, not imported: tests need more
    than this."""
    jobs = []
    for file in sorted((ROOT / "tests/python").glob("test_*.py")):
        text = file.read_text("utf-8")
        if "\nDAMAGED = " not in text:
            continue
        (value,) = (
            node.value
            for node in ast.parse(text, file).body
            if isinstance(node, ast.Assign) and [t.id for t in node.targets if isinstance(t, ast.Name)] == ["DAMAGED"]
        )
        jobs += [Job(*row) for row in ast.literal_eval(value)]
    return jobs


JOBS = [
    *_told_by_tests(),
    Job(
        "NPZ logs",
        "recording import log.npz --map array_map.yaml -o new --json out.json",
        "logs",
        ("log.npz",),
        ("out.json",),
        3,
    ),
    Job("NPZ logs", "recording guess log.npz --cell cell.yaml -o guess.yaml", "logs", ("log.npz",), ("guess.yaml",)),
    Job("MCAP logs", "recording import log.mcap --map mcap_map.yaml -o new", "logs", ("log.mcap",), (), 3),
    Job("MCAP logs", "recording guess log.mcap --cell cell.yaml -o guess.yaml", "logs", ("log.mcap",), ("guess.yaml",)),
    Job(
        "CSV logs",
        "recording import log.csv --map map.yaml -o new --json out.json",
        "logs",
        ("log.csv",),
        ("out.json",),
        2,
    ),
    Job("CSV logs", "recording guess log.csv --cell cell.yaml -o guess.yaml", "logs", ("log.csv",), ("guess.yaml",)),
    Job("maps of logs", "recording import log.csv --map map.yaml -o new", "logs", ("map.yaml",), (), 3),
    Job(
        "protocols",
        "record --cell cell.yaml --protocol protocol.yaml -o new --json out.json",
        "cell",
        ("protocol.yaml",),
        ("out.json",),
        4,
    ),
    Job(
        "protocols", "record --cell cell.yaml --protocol given.yaml -o new", "cell", ("given.yaml", "given.csv"), (), 2
    ),
    Job(
        "bins",
        "bin simulate new --bin bin.yaml --pellets 2 --points 20 --pitch 0.01 --json out.json",
        "cell",
        ("bin.yaml",),
        ("out.json",),
    ),
    Job(
        "clouds",
        "pick cloud.csv --bin pick.yaml --json out.json -o picks.json",
        "cell",
        ("cloud.csv", "pick.yaml"),
        ("out.json", "picks.json"),
        2,
    ),
    Job(
        "clouds",
        "pick cloud.ply --bin pick.yaml --frame 0,0,0.5,3.14159265,0,0 --json out.json",
        "cell",
        ("cloud.ply",),
        ("out.json",),
    ),
    Job(
        "clouds",
        "pick binary.ply --bin pick.yaml --json out.json",
        "cell",
        ("binary.ply",),
        ("out.json",),
    ),
    Job("clouds", "pick cloud.npz --bin pick.yaml --json out.json", "cell", ("cloud.npz",), ("out.json",)),
    Job("clouds", "pick cloud.pcd --bin pick.yaml --json out.json", "cell", ("cloud.pcd",), ("out.json",)),
    Job("clouds", "pick binary.pcd --bin pick.yaml --json out.json", "cell", ("binary.pcd",), ("out.json",)),
    Job("clouds", "pick compressed.pcd --bin pick.yaml --json out.json", "cell", ("compressed.pcd",), ("out.json",)),
    Job(
        "bins",
        "bin empty --bin pick.yaml --pellets 1 --pitch 0.0012 --json out.json",
        "cell",
        ("pick.yaml",),
        ("out.json",),
    ),
    Job(
        "render scenes",
        "render render.yaml -o view.png --truth view.json --json out.json",
        "cell",
        ("render.yaml",),
        ("view.png", "view.json"),
        4,
    ),
    Job(
        "sweep folders",
        "sweep insertion --cell cell.yaml --clearances 1 --trials 1 --workers 1 -o sweep --json out.json",
        "sweep",
        ("sweep/sweep.json", "sweep/trials.csv"),
        ("out.json",),
        2,
    ),
    Job("diagnosis JSON", "report gap.json -o page.html", "diagnosis", ("gap.json",), ("page.html",), 2),
    Job(
        "diagnosis JSON",
        "gap explain gap.json --recording recording --json out.json",
        "diagnosis",
        ("gap.json",),
        ("out.json",),
        2,
    ),
    Job("recordings", "cell check recording --json out.json", "recording", ("recording/*",), (), 3),
    Job("recordings", "cell show recording --json out.json", "recording", ("recording/*",), ("out.json",)),
    Job(
        "recordings",
        "replay recording -o page.html --json out.json",
        "recording",
        ("recording/*",),
        ("page.html", "out.json"),
        2,
    ),
    Job(
        "protocols",
        "replay protocol.yaml --cell cell.yaml -o page.html --json out.json",
        "cell",
        ("protocol.yaml",),
        ("page.html", "out.json"),
        2,
    ),
    Job("recordings", "gap measure recording --json out.json", "recording", ("recording/*",), ("out.json",), 2),
    Job(
        "gap diagnose, plan",
        "gap diagnose recording -o out.json --json short.json --write-cell tuned.yaml",
        "recording",
        ("recording/*",),
        ("out.json", "short.json", "tuned.yaml"),
        2,
    ),
    Job(
        "gap diagnose, plan",
        "gap diagnose recording --report page.html",
        "recording",
        ("recording/*",),
        ("page.html",),
        0.3,
    ),
    Job(
        "gap diagnose, plan",
        "gap plan recording --separate coulomb_friction:joint3,viscous_friction:joint3 -o next.yaml --json out.json",
        "recording",
        ("recording/*",),
        ("next.yaml", "out.json"),
        0.5,
    ),
    Job(
        "gap diagnose, plan", "gap explain recording --json out.json", "recording", ("recording/*",), ("out.json",), 0.5
    ),
    Job(
        "gap diagnose, plan",
        "gap compare recording recording --json out.json",
        "recording",
        ("recording/*",),
        ("out.json",),
        0.3,
    ),
    Job("gap cases", "gap cases cases --json out.json", "cases", ("cases/labels.json",), ("out.json",)),
    Job(
        "camera and map JSON",
        "target points --target markers.json --json out.json",
        "images",
        ("markers.json",),
        ("out.json",),
    ),
    Job(
        "camera and map JSON",
        "target print --target board.yaml --dpi 50 -o board.png --json out.json",
        "images",
        ("board.yaml",),
        ("board.png", "out.json"),
    ),
    Job(
        "camera and map JSON",
        "detect images/view_1.png --target chessboard:4x5:0.03 --camera camera.json --json out.json",
        "images",
        ("camera.json",),
        ("out.json",),
        2,
    ),
    Job(
        "camera and map JSON",
        "detect images/view_1.png --target chessboard:4x5:0.03 --camera camera.yaml --json out.json",
        "images",
        ("camera.yaml",),
        ("out.json",),
        2,
    ),
    Job(
        "links",
        "rsi doctor link.xml --for 0.5 --listen 127.0.0.1 --cell cell.yaml --json out.json",
        "cell",
        ("link.xml",),
        ("out.json",),
        0.5,
        1,  # nobody sends
    ),
    Job(
        "links",
        "rsi monitor link.xml --for 0.1 --listen 127.0.0.1 --log log.csv --json out.json",
        "cell",
        ("link.xml",),
        ("log.csv", "out.json"),
        0.5,
        1,
    ),
    Job("links", "rsi files link.xml -o new --json out.json", "cell", ("link.xml",), ("out.json",), 1),
    Job("cell files", "cell check cell.yaml --json out.json", "cell", ("cell.yaml",), (), 3),
    Job("cell files", "cell show cell.yaml --json out.json", "cell", ("cell.yaml",), ("out.json",)),
    Job("cell files", "gap effects --cell cell.yaml --json out.json", "cell", ("cell.yaml",), ("out.json",)),
    Job(
        "cell files",
        "cell export cell.yaml -o robot.urdf --json out.json",
        "cell",
        ("cell.yaml",),
        ("robot.urdf", "out.json"),
    ),
    Job("cells in use", "insert --cell cell.yaml --clearance 1 --json out.json", "cell", ("cell.yaml",), ("out.json",)),
    Job("cells in use", "record --cell cell.yaml --protocol brief.yaml -o new", "cell", ("cell.yaml",), (), 2),
    Job("cells in use", "record --full --cell cell.yaml --protocol brief.yaml -o new", "cell", ("cell.yaml",)),
    Job(
        "cells in use",
        "rsi emulate cell.yaml --strict --timeout 5 --for 1 --json out.json",
        "cell",
        ("cell.yaml",),
        ("out.json",),
        code=1,  # nobody answers
    ),
    Job("cells in use", "replay cell.yaml -o page.html", "cell", ("cell.yaml",), ("page.html",), 2),
    Job("cells in use", "scene run scene.yaml --json out.json", "cell", ("cell.yaml",), ("out.json",), 2),
    Job(
        "cells in use",
        "gap measure recording --cell cell.yaml --json out.json",
        "recording",
        ("cell.yaml",),
        ("out.json",),
        2,
    ),
    Job("cells in use", "gap diagnose recording --json out.json", "recording", ("recording/cell.yaml",), ("out.json",)),
    Job(
        "results to report",
        "report tool.json -o page.html --json page.json",
        "results",
        ("tool.json",),
        ("page.html", "page.json"),
        2,
    ),
    _result("results to report", "camera"),
    _result("results to report", "hand_eye"),
    _result("results to report", "timed"),
    _result("results to report", "markers"),
    _result("results to report", "seen"),
    _result("results to report", "insertion"),
    _result("results to report", "scene"),
    _result("results to report", "gap"),
    Job("results to report", "report protocol.yaml -o page.html", "cell", ("protocol.yaml",), ("page.html",)),
    Job(
        "results to report",
        "report sweep/sweep.json -o page.html",
        "sweep",
        ("sweep/sweep.json", "sweep/trials.csv"),
        ("page.html",),
    ),
    Job("timed", "calibrate timed hand.csv eye.csv -o out.json", "poses", ("hand.csv", "eye.csv"), ("out.json",), 4),
    Job(
        "scenes",
        "scene run scene.yaml --json out.json --csv rows.csv",
        "cell",
        ("scene.yaml",),
        ("out.json", "rows.csv"),
        4,
    ),
    Job("scenes", "scene run push.yaml --json out.json", "cell", ("push.yaml",), ("out.json",), 2),
    Job(
        "tool", "calibrate tool touches.csv --convention kuka -o out.json", "poses", ("touches.csv",), ("out.json",), 3
    ),
    Job(
        "tool",
        "calibrate tool touches -o out.json",
        "poses",
        ("touches/dataset.yaml", "touches/touches.csv"),
        ("out.json",),
        2,
    ),
    Job(
        "sensitivity",
        "sensitivity --cell cell.yaml --group lengths --samples 64 --max-samples 64 -o new --json out.json",
        "poses",
        ("cell.yaml",),
        ("out.json",),
    ),
    Job(
        "sensitivity",
        "sensitivity model.py:f --inputs inputs.yaml --samples 64 --max-samples 64 -o new --json out.json",
        "uncertainty",
        ("inputs.yaml",),
        ("out.json",),
        3,
    ),
    Job(
        "sensitivity",
        "sensitivity model.py:f --inputs inputs.yaml --samples 64 --max-samples 64 -o run --json out.json",
        "uncertainty",
        ("run/model/analysis.json", "run/model/outputs.bin"),
        ("out.json",),
        2,
    ),
    Job("sensitivity", "report run/result.json -o page.html", "uncertainty", ("run/result.json",), ("page.html",), 2),
    Job("uncertainty", "uncertainty chain grid.yaml --json out.json", "uncertainty", ("grid.yaml",), ("out.json",), 2),
    Job("uncertainty", "uncertainty laser laser.yaml --json out.json", "uncertainty", ("laser.yaml",), ("out.json",)),
    Job(
        "uncertainty",
        "uncertainty fusion fusion.yaml -o out.json --report page.html",
        "uncertainty",
        ("fusion.yaml",),
        ("out.json", "page.html"),
        2,
    ),
    Job(
        "uncertainty",
        "uncertainty camera-matrix camera_matrix.yaml --draws 100 --json out.json",
        "uncertainty",
        ("camera_matrix.yaml",),
        ("out.json",),
        2,
    ),
    Job("uncertainty", "report fusion.json -o page.html", "uncertainty", ("fusion.json",), ("page.html",), 2),
    Job("kinematics", "identify axes turns.csv -o out.json", "poses", ("turns.csv",), ("out.json",), 2),
    Job("sensors", "identify servo step.csv -o out.json", "poses", ("step.csv",), ("out.json",), 2),
    Job(
        "sensors",
        "identify contact press.csv --design --cell cell.yaml --write-cell new.yaml -o out.json",
        "poses",
        ("press.csv", "cell.yaml"),
        ("out.json", "new.yaml"),
        2,
    ),
    Job(
        "sensors",
        "identify force-torque wrench.csv --cell cell.yaml --write-cell new.yaml -o out.json",
        "poses",
        ("wrench.csv", "cell.yaml"),
        ("out.json", "new.yaml"),
        2,
    ),
    Job(
        "kinematics",
        "identify study --cell cell.yaml --device laser_tracker --arc 20 --noise 1 --samples 8 --trials 2 -o out.json",
        "poses",
        ("cell.yaml",),
        ("out.json",),
    ),
    Job(
        "kinematics",
        "calibrate kinematics postures.csv --cell cell.yaml -o out.json",
        "poses",
        ("postures.csv", "cell.yaml"),
        ("out.json",),
        3,
    ),
    Job(
        "pairs of poses",
        "calibrate hand-eye pairs.csv --mount eye_in_hand -o out.json",
        "poses",
        ("pairs.csv",),
        ("out.json",),
        2,
    ),
    Job(
        "pairs of poses",
        "calibrate hand-eye samples.yaml --mount eye_in_hand -o out.json",
        "poses",
        ("samples.yaml",),
        ("out.json",),
        2,
    ),
    Job(
        "pairs of poses",
        "calibrate hand-eye moveit.json --mount eye_in_hand -o out.json",
        "poses",
        ("moveit.json",),
        ("out.json",),
    ),
    Job(
        "gravity",
        "identify gravity cell.yaml slow.csv --max-speed 1 -o out.json",
        "poses",
        ("slow.csv", "cell.yaml"),
        ("out.json",),
        2,
    ),
    Job(
        "excitation",
        "identify excitation cell.yaml --duration 6 --starts 1 --exchanges 2 --keep-out zones.yaml --csv out.csv"
        " -o out.json",
        "poses",
        ("cell.yaml", "zones.yaml"),
        ("out.csv", "out.json"),
    ),
    Job(
        "kinematics",
        "calibrate postures --cell cell.yaml --count 8 --draw 40 -o out.csv",
        "poses",
        ("cell.yaml",),
        ("out.csv",),
    ),
    Job(
        "laser",
        "calibrate laser-study --cell cell.yaml --stand-offs 0.19 --speeds 0.02,0.06 --passes 2 -o out.json",
        "poses",
        ("cell.yaml",),
        ("out.json",),
    ),
    Job(
        "laser",
        "calibrate laser scan --target sphere:0.02 -o out.json --cloud out.ply",
        "poses",
        ("scan/profiles.csv", "scan/poses.csv"),
        ("out.json", "out.ply"),
        3,
    ),
    Job(
        "hand-eye folders",
        "calibrate hand-eye . -o out.json",
        "images",
        ("dataset.yaml", "poses.csv", "camera.yaml", "images/*"),
        ("out.json",),
        3,
    ),
    Job(
        "hand-eye folders",
        "calibrate cell . -o out.json",
        "images",
        ("dataset.yaml", "poses.csv", "camera.yaml", "images/*"),
        ("out.json",),
        2,
    ),
    Job(
        "hand-eye folders",
        "dataset guess . --target chessboard:4x5:0.03 -o guess.yaml",
        "images",
        ("poses.csv", "camera.yaml"),
        ("guess.yaml",),
        0.3,
    ),
    Job(
        "URDF",
        "cell import robot.urdf -o out.yaml --json out.json",
        "cell",
        ("robot.urdf",),
        ("out.yaml", "out.json"),
        3,
    ),
    Job(
        "URDF",
        "cell export cell.yaml --original robot.urdf -o out.urdf --json out.json",
        "cell",
        ("robot.urdf", "cell.yaml"),
        ("out.urdf", "out.json"),
        2,
    ),
    Job("MJCF", "cell import robot.xml -o out.yaml", "cell", ("robot.xml",), ("out.yaml",)),
    Job(
        "MJCF",
        "cell export cell.yaml --original robot.xml --tip tool_tip -o out.xml",
        "cell",
        ("robot.xml", "cell.yaml"),
        ("out.xml",),
    ),
    Job(
        "images",
        "detect images/view_1.png images/view_2.png --target chessboard:4x5:0.03 --json out.json",
        "images",
        ("images/view_[12].png",),
        ("out.json",),
    ),
    Job(
        "images",
        "calibrate camera images --target chessboard:4x5:0.03 -o out.json",
        "images",
        ("images/view_3.png",),
        ("out.json",),
    ),
    Job(
        "images",
        "calibrate map markers --camera camera.yaml --size 0.03 -o out.json",
        "images",
        ("markers/*",),
        ("out.json",),
        0.5,
    ),
    *log_inputs.JOBS,
]

# Commands without a job, and why.
WITHOUT_JOB = {
    ("demo",): "runs commands that have jobs of their own, in processes of their own, for a minute",
    ("identify", "servos"): "reads its logs and model as `kr5 gap diagnose` does, which is attacked",
    ("gap", "bench"): "starts tools/blind_check, a program of developers that is not installed",
    ("job", "phases"): "reads no file",
    ("job", "show"): "its database is damaged by the tests of the journal",
    ("job", "release"): "its database is damaged by the tests of the journal",
    ("run",): "reads its cell as `kr5 insert` does, which is attacked; a job that succeeds takes half a minute",
}

# Commands given a cell of which one number is not what it should be.
CELL_JOBS = [job for job in JOBS if job.files in (("cell.yaml",), ("recording/cell.yaml",))]


def prepare(folder: Path, run: Callable[..., None]) -> None:
    """Writes the inputs. `run` runs a command of kr5 in a folder, which must succeed."""
    cell = SHARE / "cells" / "kr5_arc.yaml"
    for name in (
        "cell",
        "logs",
        "recording",
        "cases",
        "diagnosis",
        "sweep",
        "results",
        "poses",
        "images",
        "uncertainty",
    ):
        (folder / name).mkdir(parents=True)
        shutil.copy(cell, folder / name / "cell.yaml")
    _prepare_cells(folder / "cell", run)
    _prepare_recordings(folder, run)
    _prepare_logs(folder / "logs", folder / "recording" / "recording")
    log_inputs.prepare(folder / "arm_logs", run)
    _prepare_poses(folder / "poses")
    _prepare_images(folder / "images")
    _prepare_uncertainty(folder / "uncertainty", run)
    run(folder / "sweep", "sweep insertion --cell cell.yaml --clearances 1 --trials 1 --workers 1 -o sweep")
    (folder / "sweep" / "sweep" / "report.html").unlink()
    run(folder / "cell", "insert --cell cell.yaml --clearance 1 --json ../results/insertion.json")
    run(folder / "cell", "scene run scene.yaml --json ../results/scene.json")
    run(folder / "recording", "gap measure recording --json ../results/gap.json")
    run(folder / "poses", "calibrate tool touches -o ../results/tool.json")
    run(folder / "poses", "calibrate timed hand.csv eye.csv -o ../results/timed.json")
    run(folder / "images", "calibrate camera images --target chessboard:4x5:0.03 -o camera.json")
    run(folder / "images", "calibrate hand-eye . -o ../results/hand_eye.json")
    run(
        folder / "images",
        "detect images/view_1.png --target chessboard:4x5:0.03 --camera camera.yaml --json ../results/seen.json",
    )
    _prepare_markers(folder / "images" / "markers.json")
    shutil.copy(folder / "images" / "markers.json", folder / "results" / "markers.json")
    shutil.copy(folder / "images" / "camera.json", folder / "results" / "camera.json")


def _prepare_cells(folder: Path, run: Callable[..., None]) -> None:
    import kr5.rsi

    (folder / "protocol.yaml").write_text(PROTOCOL)
    _prepare_cloud(folder)
    brief = yaml.safe_load(PROTOCOL)
    brief["experiments"] = [
        {**brief["experiments"][0], "duration": 1.0},
        brief["experiments"][3],
        brief["experiments"][7],
    ]
    (folder / "brief.yaml").write_text(yaml.safe_dump(brief, sort_keys=False))
    (folder / "render.yaml").write_text(RENDER)
    (folder / "bin.yaml").write_text("T_base_bin: [0.6, 0.0, 0.1, 0.0, 0.0, 0.3]\nsize: [0.1, 0.1, 0.08]\n")
    for source, name, column in (("servo_step", "scene", "q6"), ("peg_against_wall", "push", "z")):
        scene = yaml.safe_load((SHARE / "scenes" / f"{source}.yaml").read_text(encoding="utf-8"))
        expected = {"column": column, "statistic": "max", "min": -10.0}  # of so short a run
        scene.update(cell="cell.yaml", duration=0.1, expect=[expected])
        (folder / f"{name}.yaml").write_text(yaml.safe_dump(scene, sort_keys=False))
    t = np.arange(100) * 0.012
    q = np.array([0.0, 0.02, -2.75, 0.0, -0.3, 1.571]) + 0.2 * (1 - np.cos(t))[:, None]
    _write_csv(folder / "given.csv", ["t", *(f"qc{k + 1}" for k in range(6))], np.column_stack([t, q]))
    (folder / "given.yaml").write_text(
        "format: kr5-protocol/1\nexperiments:\n- {name: motion-1, kind: motion, split: fit, given: given.csv}\n"
    )
    (folder / "link.xml").write_text(kr5.rsi.layout_xml(kr5.rsi.usual_layout("krc4")))
    run(folder, "cell export cell.yaml -o robot.urdf")
    run(folder, "cell export cell.yaml -o robot.xml")


def _prepare_cloud(folder: Path) -> None:
    """One lying cylinder in a small bin, in each of the formats."""
    from pypcd4 import Encoding, PointCloud

    x, y = (a.ravel() for a in np.meshgrid(np.arange(-0.02, 0.02, 0.0008), np.arange(-0.02, 0.02, 0.0008)))
    lying = (np.abs(x) < 0.008) & (np.abs(y) < 0.0075)
    z = np.where(lying, 0.008 + np.sqrt(np.maximum(0.008**2 - x**2, 0)), 0.0)
    points = np.column_stack([x, y, z])
    np.savez(folder / "cloud.npz", points=points)
    np.savetxt(folder / "cloud.csv", points, delimiter=",", header="x,y,z", comments="", fmt="%.5f")

    def text(points: np.ndarray) -> str:
        return "\n".join(f"{a:.5f} {b:.5f} {c:.5f}" for a, b, c in points)

    seen = points * [1, -1, -1] + [0, 0, 0.5]  # by a scanner that looks down from a height of half a metre
    axes = "".join(f"property float {axis}\n" for axis in "xyz")
    (folder / "cloud.ply").write_text(
        f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n{axes}end_header\n{text(seen)}\n"
    )
    faces = b"".join(bytes([3]) + np.array(corners, ">i4").tobytes() for corners in ((0, 1, 2), (1, 2, 3)))
    (folder / "binary.ply").write_bytes(
        b"ply\nformat binary_big_endian 1.0\nelement face 2\nproperty list uchar int vertex_indices\n"
        + f"element vertex {len(points)}\n{axes}end_header\n".encode()
        + faces
        + points.astype(">f4").tobytes()
    )
    (folder / "cloud.pcd").write_text(
        "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH {len(points)}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(points)}\nDATA ascii\n{text(points)}\n"
    )
    for name, encoding in (("binary", Encoding.BINARY), ("compressed", Encoding.BINARY_COMPRESSED)):
        PointCloud.from_xyz_points(points.astype(np.float32)).save(folder / f"{name}.pcd", encoding=encoding)
    (folder / "pick.yaml").write_text("T_base_bin: [0, 0, 0, 0, 0, 0]\nsize: [0.06, 0.06, 0.05]\n")


def _prepare_recordings(folder: Path, run: Callable[..., None]) -> None:
    run(folder / "recording", "record --cell cell.yaml --protocol ../cell/protocol.yaml -o recording")
    shutil.copytree(folder / "recording" / "recording", folder / "diagnosis" / "recording")
    effect = {"effect": "coulomb_friction", "target": "joint3", "parameters": {"coulomb": 60.0}}
    (folder / "cases" / "cases").mkdir()
    (folder / "cases" / "cases" / "labels.json").write_text(json.dumps({"case-000": {"effects": [effect]}}))
    # A worn cell, so that there are causes to tell of.
    worn = (folder / "cell" / "cell.yaml").read_text(
        encoding="utf-8"
    ) + "\neffects:\n  coulomb_friction: {joint3: {coulomb: 60.0}}\n"
    (folder / "diagnosis" / "worn.yaml").write_text(worn, encoding="utf-8")
    shutil.rmtree(folder / "diagnosis" / "recording")
    run(folder / "diagnosis", "record --nominal --cell worn.yaml --protocol ../cell/protocol.yaml -o recording")
    run(folder / "diagnosis", "gap diagnose recording -o gap.json")
    shutil.copytree(folder / "diagnosis" / "recording", folder / "cases" / "cases" / "case-000")


def _prepare_logs(folder: Path, recording: Path) -> None:
    once = np.genfromtxt(recording / "motion-1.csv", delimiter=",", names=True)
    rows = np.concatenate([once, np.repeat(once[-1:], 80), once])  # a rest between, where a log may be cut
    rows["t"] = 0.012 * np.arange(len(rows))
    degrees = 180 / np.pi
    wrench = np.column_stack([rows[c] for c in ("fx", "fy", "fz", "tx", "ty", "tz")])
    joints = {
        stem: np.column_stack([rows[f"{stem}{k + 1}"] for k in range(6)]) * factor
        for stem, factor in (("qc", degrees), ("q", degrees), ("i", 1e3))
    }
    names = [
        "time",
        *(f"{word}_{k + 1}" for word in ("cmd", "pos", "cur") for k in range(6)),
        "Fx",
        "Fy",
        "Fz",
        "Mx",
        "My",
        "Mz",
    ]
    time = 1e3 * rows["t"] + 5000
    _write_csv(folder / "log.csv", names, np.column_stack([time, *joints.values(), wrench]))
    np.savez(folder / "log.npz", t=time, w=wrench, **joints)
    (folder / "map.yaml").write_text(MAP)
    (folder / "array_map.yaml").write_text(ARRAY_MAP)
    (folder / "mcap_map.yaml").write_text(MCAP_MAP)
    _write_mcap(folder / "log.mcap", rows["t"], joints, wrench)


def _write_mcap(file: Path, t: np.ndarray, joints: dict[str, np.ndarray], wrench: np.ndarray) -> None:
    from mcap.writer import CompressionType, Writer

    with file.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.ZSTD, chunk_size=20000)
        writer.start()
        schema = writer.register_schema(name="any", encoding="jsonschema", data=b"{}")
        channels = {
            topic: writer.register_channel(schema_id=schema, topic=topic, message_encoding="json")
            for topic in ("/joints", "/wrench")
        }
        for k, at in enumerate(t):
            stamp = int(1e9 * at) + 1_700_000_000_000_000_000
            values = {
                "name": [f"a{j + 1}" for j in range(6)],
                **{stem: found[k].tolist() for stem, found in joints.items()},
            }
            for topic, message in (("/joints", values), ("/wrench", {"w": wrench[k].tolist()})):
                writer.add_message(
                    channels[topic], log_time=stamp, publish_time=stamp, data=json.dumps(message).encode()
                )
        writer.finish()


def _prepare_poses(folder: Path) -> None:
    import kr5
    import kr5.cell
    from scipy.spatial.transform import Rotation

    shutil.copytree(SHARE / "data" / "touches", folder / "touches")
    shutil.copy(SHARE / "data" / "touches" / "touches.csv", folder / "touches.csv")
    X, Z = kr5.from_xyzrpy([0.02, 0.01, 0.1, 0.1, 0.2, 0.3]), kr5.from_xyzrpy([0.5, 0.1, 0.0, 0.0, 0.1, 0.4])
    random = np.random.default_rng(3)
    t = np.arange(0.0, 12.0, 0.05)
    hand, eye = [], []
    for at in t:
        angles = 0.5 * np.sin(np.array([0.9, 1.3, 1.7]) * at)
        T = kr5.from_xyzrpy([0.4 + 0.1 * np.sin(at), 0.1 * np.cos(at), 0.5, *angles])
        for rows, pose in ((hand, T), (eye, np.linalg.inv(Z) @ T @ X)):
            turn = Rotation.from_matrix(pose[:3, :3]) * Rotation.from_rotvec(random.normal(0, 1e-3, 3))
            rows.append([at, *pose[:3, 3] + random.normal(0, 1e-4, 3), *turn.as_quat()])
    names = ["t", "x", "y", "z", "qx", "qy", "qz", "qw"]
    cell = kr5.cell.load_cell(folder / "cell.yaml")
    chain, limits = cell.nominal_chain(), cell.robot.limits
    q = random.normal(size=(12, len(chain.joints)))
    places = [(chain.flange(row) @ [0.1, 0, 0.1, 1])[:3] + random.normal(0, 1e-4, 3) for row in q]
    joints = [f"q{k + 1}" for k in range(len(chain.joints))]
    turns = np.tile([0.1, -0.5, 0.6, 0.3, 0.7, 0.2], (48, 1))
    for i, row in enumerate(turns):
        row[i // 8] += 0.1 * (i % 8)
    seen = [(chain.flange(row) @ [0.1, 0.05, 0.1, 1])[:3] + random.normal(0, 1e-5, 3) for row in turns]
    _write_csv(folder / "turns.csv", [*joints, "x", "y", "z"], np.hstack([turns, seen]))
    shutil.copy(SHARE / "data/drives/kr5_table_b2.csv", folder / "readings.csv")
    _write_csv(folder / "postures.csv", [*joints, "x", "y", "z"], np.hstack([q, places]))
    _write_scan(folder / "scan")
    _write_slow_motion(folder / "slow.csv", (np.array(limits.lower) + limits.upper) / 2)
    tau = random.uniform(-50, 50, (60, 2))
    angles = random.uniform(-1, 1, (60, 2))
    springs = np.hstack([angles, angles + tau / 2e4, tau])
    _write_csv(folder / "springs.csv", ["q1", "q2", "m1", "m2", "tau1", "tau2"], springs)
    (folder / "zones.yaml").write_text(
        "keep_out:\n- {name: table, kind: box, T_B_O: [0.9, 0, 0.1, 0, 0, 0], size: [0.6, 1.2, 0.2]}\n"
        "- {name: lamp, kind: ball, T_B_O: [0, 0.8, 1.5, 0, 0, 0], radius: 0.2}\n- {name: ground, kind: floor}\n"
    )
    _write_sensor_logs(folder, chain, joints)
    _write_csv(folder / "hand.csv", names, np.array(hand))
    _write_csv(folder / "eye.csv", names, np.array(eye))
    _prepare_pairs(folder, np.array(hand)[::24, 1:], np.array(eye)[::24, 1:])


def _write_slow_motion(file: Path, middle: np.ndarray) -> None:
    """Joints to and fro, with torques that are friction and some harmonic."""
    t = np.arange(0.0, 30.0, 0.2)
    rates = 0.4 + 0.05 * np.arange(len(middle))
    phase = np.outer(t, rates)
    names = ["t", *(f"{kind}{k + 1}" for kind in ("q", "qd", "tau") for k in range(len(middle)))]
    torques = 20 * np.sin(phase) + np.sign(np.cos(phase))
    _write_csv(file, names, np.column_stack([t, middle + np.sin(phase), rates * np.cos(phase), torques]))


def _write_sensor_logs(folder: Path, chain: Any, joints: list[str]) -> None:
    """A step, a press and wrenches in postures."""
    random = np.random.default_rng(4)
    t = 0.012 * np.arange(200)
    since = np.maximum(t - 0.3, 0.0)
    z = 0.02 * (1 - (1 + 8 * since) * np.exp(-8 * since)) + random.normal(0, 2e-5, 200)
    _write_csv(folder / "step.csv", ["t", "command", "response"], np.column_stack([t, 0.02 * (t > 0.28), z]))
    depth = np.linspace(-3e-4, 1e-3, 20)
    pressed = 23e3 * np.maximum(depth, 0.0) + random.normal(0, 0.15, 20)
    _write_csv(folder / "press.csv", ["depth", "force"], np.column_stack([depth, pressed]))
    q = random.normal(size=(20, len(joints)))
    gravity = np.array([chain.flange(row)[:3, :3].T @ [0, 0, -9.81] for row in q])
    wrench = np.hstack([2.4 * gravity, np.cross([0.01, 0.0, 0.2], gravity)]) + random.normal(0, 0.01, (20, 6))
    _write_csv(folder / "wrench.csv", [*joints, "fx", "fy", "fz", "tx", "ty", "tz"], np.hstack([q, wrench]))


def _prepare_pairs(folder: Path, hand: np.ndarray, eye: np.ndarray) -> None:
    """Pairs of poses in three forms, and returns to two points."""
    from scipy.spatial.transform import Rotation

    def matrix(row: np.ndarray) -> np.ndarray:
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = Rotation.from_quat(row[3:]).as_matrix(), row[:3]
        return T

    robot, seen = [matrix(row) for row in hand], [np.linalg.inv(matrix(row)) for row in eye]
    marks = np.array([[*T[:3, 3], *Rotation.from_matrix(T[:3, :3]).as_quat()] for T in seen])
    names = ("x", "y", "z", "qx", "qy", "qz", "qw")
    header = [prefix + name for prefix in ("robot_", "camera_") for name in names]
    _write_csv(folder / "pairs.csv", header, np.hstack([hand, marks]))
    (folder / "moveit.json").write_text(json.dumps([[T.tolist(), M.tolist()] for T, M in zip(robot, seen)]))
    keys = (("translation", "xyz"), ("rotation", "xyzw"))

    def transform(row: np.ndarray) -> dict[str, dict[str, float]]:
        parts = {"translation": row[:3], "rotation": row[3:]}
        return {key: dict(zip(axes, map(float, parts[key]))) for key, axes in keys}

    samples = [{"robot": transform(T), "tracking": transform(M)} for T, M in zip(hand, marks)]
    (folder / "samples.yaml").write_text(yaml.safe_dump({"samples": samples}, sort_keys=False))
    random = np.random.default_rng(8)
    lines = ["point,x,y,z,a,b,c"]
    for k in range(12):
        row = np.array([800.0 + 50 * (k % 2), 100, 400, 10, 80, 170]) + random.normal(0, 0.01, 6)
        lines.append(",".join([f"P{k % 2}", *(f"{v:.12g}" for v in row)]))
    (folder / "returns.csv").write_text("\n".join(lines) + "\n")


def _prepare_uncertainty(folder: Path, run: Callable[..., None]) -> None:
    for file in (ROOT / "tools/kr5_tools/uncertainty/book").glob("*.yaml"):
        shutil.copy(file, folder / file.name)
    (folder / "model.py").write_text("def f(x):\n    return [x[0] + x[1], x[1] ** 2]\n")
    (folder / "inputs.yaml").write_text(
        "inputs:\n- {name: a, distribution: uniform, low: 0, high: 10, unit: mm}\n"
        "- {name: b, distribution: truncated_normal, mean: 1, sigma: 0.1, truncation: 2}\n"
        "outputs: [{name: sum, unit: mm}, {name: square}]\n"
    )
    run(folder, "sensitivity model.py:f --inputs inputs.yaml --samples 64 --max-samples 64 -o run")
    run(folder, "uncertainty fusion fusion.yaml -o fusion.json")


def _write_scan(folder: Path) -> None:
    """Profiles of a ball, and poses by their number."""
    import kr5

    folder.mkdir()
    mount, points, poses = kr5.to_pose([0.11, 0.05, 0.3, 3.0, 0.2, -0.4]), [], []
    for k in range(14):
        x, y, z = 0.015 * np.sin(k), 0.008 * np.cos(2 * k), 0.19 + 0.015 * np.cos(k)
        section = np.sqrt(0.02**2 - y**2)
        along = x + section * np.linspace(-0.9, 0.9, 31)
        points += [[k, a, z - np.sqrt(section**2 - (a - x) ** 2)] for a in along]
        T = kr5.to_pose([0, 0, 0, 0.3 * np.sin(k), 3 + 0.3 * np.cos(3 * k), 0.5 * k])
        place = np.array([0.7, 0.05, 0.2]) - T[:3, :3] @ [x, y, z]
        poses.append([k, *kr5.to_vector(kr5.to_pose([*place, *kr5.to_vector(T)[3:]]) @ np.linalg.inv(mount))])
    _write_csv(folder / "profiles.csv", ["profile", "x", "z"], np.array(points))
    _write_csv(folder / "poses.csv", ["profile", "x", "y", "z", "rx", "ry", "rz"], np.array(poses))


def _prepare_images(folder: Path) -> None:
    import kr5
    import kr5.vision

    (folder / "images").mkdir()
    (folder / "markers").mkdir()
    target, camera = kr5.parse_target(BOARD), kr5.Pinhole(**CAMERA)
    X, W = kr5.from_xyzrpy([0.03, 0.0, 0.05, 0.0, 0.0, 0.1]), kr5.from_xyzrpy([0.5, 0.0, 0.0, 0.0, 0.0, 0.0])
    middle, rows = kr5.from_xyzrpy([-0.06, -0.045, 0, 0, 0, 0]), []
    for k in range(VIEWS):
        T = (
            kr5.from_xyzrpy([0.0, 0.0, 0.3 + 0.01 * k, 0.5 * np.sin(2.1 * k), 0.5 * np.cos(1.7 * k), 0.2 * k - 0.5])
            @ middle
        )
        placed = kr5.vision.PlacedTarget(target=target, T_camera_target=T)
        image = kr5.vision.render([placed], camera, kr5.vision.RenderOptions(blur=0.6, noise=1.0, seed=k + 1))
        kr5.vision.save_image(image, str(folder / "images" / f"view_{k + 1}.png"))
        rows.append(kr5.to_xyzrpy(W @ np.linalg.inv(T) @ np.linalg.inv(X)))
        tags = kr5.vision.PlacedTarget(target=kr5.parse_target(TAGS), T_camera_target=T)
        image = kr5.vision.render([tags], camera, kr5.vision.RenderOptions(blur=0.6, noise=1.0, seed=k + 1))
        kr5.vision.save_image(image, str(folder / "markers" / f"view_{k + 1}.png"))
    _write_csv(folder / "poses.csv", ["x", "y", "z", "roll", "pitch", "yaw"], np.array(rows))
    (folder / "board.yaml").write_text("{kind: chessboard, rows: 4, cols: 5, size: 0.03}\n")
    (folder / "camera.yaml").write_text(yaml.safe_dump(CAMERA))
    (folder / "dataset.yaml").write_text(
        yaml.safe_dump(
            {
                "format": "kr5-dataset/1",
                "images": "images/*.png",
                "poses": "poses.csv",
                "pairing": "order",
                "mount": "eye_in_hand",
                "target": BOARD,
                "convention": {"position": "m", "rotation": "rpy", "angle": "rad", "meaning": "T_base_flange"},
                "camera": "camera.yaml",
            },
            sort_keys=False,
        )
    )


def _prepare_markers(file: Path) -> None:
    """A marker map as `kr5 calibrate map` writes it."""
    import kr5

    target = kr5.Target.from_dict(
        {
            "kind": "marker_map",
            "family": "36h11",
            "map": [
                {"id": k, "size": 0.05, "T_target_marker": kr5.from_xyzrpy([0.1 * k, 0, 0, 0, 0, 0]).tolist()}
                for k in range(2)
            ],
        }
    )
    frames = [{"name": f"marker {k}", "parent": None, "T": np.eye(4).tolist(), "size": [0.05, 0.05]} for k in range(2)]
    file.write_text(
        json.dumps(
            {
                "format": "kr5-marker-map/1",
                "version": "0",
                "created": "",
                "command": "kr5 calibrate map",
                "input": {},
                "verdict": {"word": "good", "text": "2 markers."},
                "figures": [{"name": "markers", "value": 2, "std": None, "unit": "-"}],
                "views": [{"name": "a.png", "rms_px": 0.1, "outlier": False}],
                "frames": frames,
                "residuals": [{"view": "a.png", "u": [1.0, 2.0], "v": [1.0, 2.0], "du": [0.1, 0.1], "dv": [0.1, -0.1]}],
                "image_size": [320, 240],
                "result": {"target": target.to_dict()},
            },
            default=str,
        )
    )


def _write_csv(file: Path, names: list[str], values: np.ndarray) -> None:
    file.write_text("\n".join([",".join(names), *(",".join(f"{v:.12g}" for v in row) for row in values)]) + "\n")
