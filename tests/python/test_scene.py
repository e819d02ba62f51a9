"""kr5.sim and `kr5 scene`."""

import json

import kr5
import kr5.cell
import kr5.io
import kr5.predict
import kr5.uncertainty
import numpy as np
import pytest
import yaml

sim = pytest.importorskip("kr5.sim", reason="this kr5 was built without DART")


def test_a_scene_that_comes_true_and_one_that_does_not(run_kr5, share, tmp_path):
    file = share / "scenes/servo_step.yaml"
    done = run_kr5("scene", "run", file, "--json", tmp_path / "out.json", "--csv", tmp_path / "rows.csv")
    assert done.returncode == 0, done.stderr
    out = json.loads((tmp_path / "out.json").read_text())
    assert out["passed"] and len(out["checks"]) == 2
    assert (tmp_path / "rows.csv").read_text().startswith("t,q1,")
    text = file.read_text().replace("../cells", str(share / "cells")).replace("max: 0.1010", "max: 0.1000")
    (tmp_path / "worse.yaml").write_text(text.replace("min: 0.1005, ", ""))
    done = run_kr5("scene", "run", tmp_path / "worse.yaml")
    assert done.returncode == 1 and "Failed: 1 of 2 expectations met" in done.stdout


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


MOUNT = [0.013, 0.061, -0.056, 0.03, -0.02, 1.56]  # x y z roll pitch yaw of the camera in the tool tip


@pytest.fixture
def few_views(share, tmp_path):
    """The shipped scene of camera views with another mount, a smaller camera and fewer places, so that it is quick."""
    cell = yaml.safe_load((share / "cells/kr5_arc.yaml").read_text())
    for key in ("width", "height", "fx", "fy", "cx", "cy"):
        cell["camera"][key] = cell["camera"][key] * 0.4 if key[0] in "fc" else int(cell["camera"][key] * 0.4)
    (tmp_path / "cell.yaml").write_text(yaml.safe_dump(cell))
    scene = yaml.safe_load((share / "scenes/camera_views.yaml").read_text())
    scene |= {"cell": "cell.yaml", "effects": {"hand_eye": {"camera": {"T_E_C": MOUNT}}}}
    (tmp_path / "scene.yaml").write_text(yaml.safe_dump(scene))
    return tmp_path / "scene.yaml"


def test_pictures_of_a_scene_give_back_where_its_camera_sits(few_views, run_kr5, tmp_path):
    pytest.importorskip("kr5.vision", reason="this kr5 was built without vision")
    done = run_kr5("scene", "run", few_views, "--images", tmp_path / "views")
    assert done.returncode == 0, done.stderr
    assert len(list((tmp_path / "views/images").glob("*.png"))) == 14
    done = run_kr5("calibrate", "hand-eye", tmp_path / "views", "-o", "hand_eye.json")
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "hand_eye.json").read_text())
    truth = yaml.safe_load((tmp_path / "views/truth.yaml").read_text())
    cell = kr5.cell.load_cell(tmp_path / "cell.yaml")
    moved = np.asarray(cell.tool.T_flange_tool) @ kr5.from_xyzrpy(MOUNT)
    np.testing.assert_allclose(truth["T_flange_camera"], moved, atol=1e-12)
    away = kr5.pose_difference(data["result"]["T_mount_camera"], moved)
    assert np.linalg.norm(away[:3]) < 1e-3 < np.linalg.norm(kr5.pose_difference(cell.T_flange_camera(), moved)[:3])
    distance = away @ np.linalg.solve(np.array(data["result"]["covariance"]), away)
    assert distance < kr5.uncertainty.chi_square_quantile(0.999, 6)
    done = run_kr5("scene", "run", few_views, "--images", tmp_path / "views")
    assert done.returncode == 2 and "exists already" in done.stderr


def test_a_scene_is_seen_in_3d_and_its_profiles_are_written(run_kr5, share, browser, tmp_path):
    done = run_kr5("scene", "run", share / "scenes/scan_tube.yaml", "-o", "page.html", "--scan", "scan.csv")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "scan.csv").read_text().startswith("line,t,speed,q1,")
    browser.open(tmp_path / "page.html", 1280)
    assert browser.complaints() == []
    assert "of 6.00 s" in browser.evaluate("document.getElementById('told').textContent")
    assert "kr5 scene run" in browser.evaluate("document.body.textContent")


def test_a_push_is_shown_with_an_arm_that_holds_the_peg(run_kr5, share, tmp_path):
    done = run_kr5("scene", "run", share / "scenes/peg_roll.yaml", "-o", "page.html")
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "page.html").read_text()
    run = json.loads(text.split('id="replay-data" type="application/json">')[1].split("</script>")[0])["runs"][0]
    cell = kr5.cell.load_cell(share / "cells/kr5_arc.yaml")
    T_tube_tool = np.linalg.inv(cell.tube.T_base_tube) @ cell.T_base_tool(run["q"][-1])
    assert np.linalg.norm(T_tube_tool[:2, 3] - [0.001, 0.0]) < 1e-5 and abs(T_tube_tool[2, 3]) < 0.002
    assert np.degrees(np.arccos(-T_tube_tool[2, 2])) == pytest.approx(7.5, abs=0.01)


@pytest.mark.parametrize("flag", ["--images", "--scan"])
def test_what_a_scene_does_not_have_cannot_be_written(run_kr5, share, tmp_path, flag):
    done = run_kr5("scene", "run", share / "scenes/servo_step.yaml", flag, tmp_path / "out")
    assert done.returncode == 2 and "is missing; with " + flag in done.stderr and "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()


def test_a_window_without_a_display_is_refused_with_another_way(run_kr5, share, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    done = run_kr5("scene", "run", share / "scenes/servo_step.yaml", "--window")
    assert done.returncode == 2 and "-o PAGE.html shows the scene" in done.stderr and "Traceback" not in done.stderr


def test_a_recording_has_pictures_of_its_views_from_where_the_arm_really_was(few_views, run_kr5, tmp_path):
    pytest.importorskip("kr5.vision", reason="this kr5 was built without vision")
    protocol = {
        "format": "kr5-protocol/1",
        "home": [0.0, 0.02, -2.75, 0.0, -0.3, 1.571],
        "experiments": [{"name": "views-1", "kind": "views", "split": "fit", "count": 2}],
    }
    (tmp_path / "protocol.yaml").write_text(yaml.safe_dump(protocol))
    cell = yaml.safe_load((tmp_path / "cell.yaml").read_text())
    cell["effects"] = {
        "encoder_offset": {"joint2": {"offset": 0.01}},
        "tool_offset": {"tool": {"offset": [0.01, 0.0, 0.0]}},
    }
    (tmp_path / "cell.yaml").write_text(yaml.safe_dump(cell))
    done = run_kr5("record", "--cell", "cell.yaml", "--protocol", "protocol.yaml", "-o", "monday", "--images")
    assert done.returncode == 0, done.stderr
    views = kr5.cell.load_recording(tmp_path / "monday")["views-1"]
    folder = tmp_path / "monday/views-1"
    images = sorted((folder / "images").glob("*.png"))
    assert len(images) == 2
    cell = kr5.cell.load_cell(tmp_path / "cell.yaml")
    truth = yaml.safe_load((folder / "truth.yaml").read_text())
    np.testing.assert_allclose(
        truth["T_flange_camera"], cell.T_flange_camera(), atol=1e-9
    )  # neither effect moves it on the flange
    found = kr5.vision.find_target(kr5.vision.load_image(str(images[0])), cell.board.target())
    first = np.asarray(views["view"]) == views["view"][0]
    predicted = {
        4 * int(m) + int(c): (u, v)
        for m, c, u, v in zip(*(np.asarray(views[n])[first] for n in ("marker", "corner", "u", "v")))
    }
    seen = {i: p for i, p in zip(found.view.ids, np.asarray(found.view.pixels).T) if i in predicted}
    assert len(seen) > 60
    apart = np.array([seen[i] - predicted[i] for i in seen])
    assert np.sqrt((apart**2).mean()) < 0.3  # noise of the columns 0.1 px; the joint alone would be off by 20 px
