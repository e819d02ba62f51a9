"""kr5.sim and `kr5 scene`."""

import json

import numpy as np
import pytest

import kr5
import kr5.cell
import kr5.io
import kr5.predict

sim = pytest.importorskip("kr5.sim", reason="this kr5 was built without DART")


def test_a_scene_that_comes_true_and_one_that_does_not(run_kr5, share, tmp_path):
    file = share / "scenes/servo_step.yaml"
    done = run_kr5("scene", "run", file, "--json", tmp_path / "out.json", "--csv", tmp_path / "rows.csv")
    assert done.returncode == 0, done.stderr
    out = json.loads((tmp_path / "out.json").read_text())
    assert out["passed"] and len(out["checks"]) == 2
    assert (tmp_path / "rows.csv").read_text().startswith("t,q1,")
    text = file.read_text().replace("../cells", str(share / "cells")).replace("most: 0.1010", "most: 0.1000")
    (tmp_path / "worse.yaml").write_text(text.replace("least: 0.1005, ", ""))
    done = run_kr5("scene", "run", tmp_path / "worse.yaml")
    assert done.returncode == 1 and "failed" in done.stdout


def test_a_scene_that_is_wrong_is_refused_in_one_line(run_kr5, tmp_path):
    (tmp_path / "scene.yaml").write_text("format: kr5-scene/1\n")
    done = run_kr5("scene", "run", tmp_path / "scene.yaml")
    assert done.returncode == 2 and "duration" in done.stderr and "Traceback" not in done.stderr


def test_an_arm_is_stepped_from_python(share):
    cell = kr5.cell.load_cell(share / "cells/kr5_arc.yaml")
    arm = sim.DrivenArm(cell)
    q = np.array([0.0, 0.3, -2.6, 0.0, -0.5, 0.0])
    arm.reset(q)
    for _ in range(200):
        arm.follow(q + 0.01)
    now = arm.read()
    assert np.allclose(now.position, q + 0.01, atol=1e-4)
    assert now.wrench[2] > 0 and len(now.current) == 6
    with pytest.raises(kr5.InvalidArgument, match="current_limit"):
        sim.DrivenArm(cell, sim.DrivenArmOptions(current_limit=[1.0]))


def test_the_full_grade_is_a_simulator_like_any_other(share):
    cell = kr5.cell.load_cell(share / "cells/kr5_arc.yaml")
    columns = ["t", *(f"qc{i}" for i in range(1, 7))]
    t = 0.012 * np.arange(100)
    q = np.array([0.0, 0.3, -2.6, 0.0, -0.5, 0.0]) + 0.1 * (1 - np.cos(3 * t))[:, None]
    move = kr5.cell.Experiment(name="move", kind="motion", file="move.csv", split="fit")
    move.data = kr5.io.Table(columns, np.column_stack([t, q]))
    full = sim.DartSimulator().predict(cell, move)
    fast = kr5.predict.FastSimulator().predict(cell, move)
    assert full.columns == fast.columns
    assert np.abs(np.array(full.values) - np.array(fast.values)).max() < 0.02
