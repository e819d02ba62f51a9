"""`kr5 workspace`, and results put into cells by `--write-cell`."""

import json

import numpy as np
import pytest
from kr5 import cell, kinematics
from kr5.files.paths import find_shipped_cell


def planar(file, limits="limits: {lower: [-3, -2], upper: [3, 2]}"):
    file.write_text(f"format: kr5-cell/1\nrobot:\n  dh:\n  - {{a: 0.7}}\n  - {{a: 0.4}}\n  {limits}\n")


def run(run_kr5, tmp_path, *args):
    done = run_kr5("workspace", *args, "-o", "w.json")
    assert done.returncode == 0, done.stderr
    return done, json.loads((tmp_path / "w.json").read_text())


def test_the_kr5_reaches_what_its_dimensions_say(run_kr5, tmp_path):
    done, data = run(run_kr5, tmp_path, find_shipped_cell(), "--samples", "5000")
    lengths = 0.18 + 0.6 + np.hypot(0.12, 0.62)
    assert data["reach_without_limits"] == pytest.approx(lengths, abs=1e-6) and "1411.5 mm" in done.stdout
    # The limit of joint 3 keeps the arm from being stretched out: by the cosine rule.
    fore = np.hypot(0.12, 0.62)
    bent = np.sqrt(0.6**2 + fore**2 + 2 * 0.6 * fore * np.cos(-4.625122517784973 - np.arctan2(0.62, 0.12)))
    assert data["result"]["reach"] == pytest.approx(0.18 + bent, abs=1e-6)
    assert run_kr5("report", "w.json", "-o", "page.html", "--png", "plots").returncode == 0
    names = {f.stem for f in (tmp_path / "plots").iterdir()}
    assert names == {"reachable", "dexterity", "min_singular_value", "condition"}
    _, flange = run(run_kr5, tmp_path, find_shipped_cell(), "--point", "flange", "--samples", "5000")
    assert flange["result"]["reach"] > data["result"]["reach"]


def test_an_arm_of_two_joints_and_a_urdf_are_mapped(run_kr5, tmp_path):
    planar(tmp_path / "two.yaml")
    _, data = run(run_kr5, tmp_path, "two.yaml", "--samples", "2000", "--cells", "20")
    result = data["result"]
    assert result["reach"] == pytest.approx(1.1, abs=1e-9) and len(result["radius"]) == 20
    best = max(v for row in result["dexterity"] for v in row if v is not None)
    assert best == pytest.approx(0.28, rel=1e-3)  # l1 l2
    assert run_kr5("cell", "export", "two.yaml", "-o", "two.urdf").returncode == 0
    _, again = run(run_kr5, tmp_path, "two.urdf", "--samples", "2000")
    assert again["result"]["reach"] == pytest.approx(1.1, abs=1e-9)


def test_arms_without_limits_or_wrist_and_bad_input(run_kr5, tmp_path):
    planar(tmp_path / "free.yaml", "")
    done, _ = run(run_kr5, tmp_path, "free.yaml", "--samples", "500")
    assert "no joint limits" in done.stderr

    def refused(*args):
        done = run_kr5("workspace", *args, "-o", "no.json")
        assert done.returncode == 2 and "Traceback" not in done.stderr and not (tmp_path / "no.json").exists()
        return " ".join(done.stderr.split())

    assert "do not meet in one point" in refused("free.yaml", "--point", "wrist")
    assert "no tool" in refused("free.yaml", "--point", "tool")
    assert "samples" in refused("free.yaml", "--samples", "3")
    assert "none.yaml" in refused("none.yaml")
    (tmp_path / "slide.yaml").write_text("format: kr5-cell/1\nrobot:\n  dh:\n  - {type: prismatic}\n  - {a: 0.4}\n")
    assert "no limits" in refused("slide.yaml")


def test_python_has_map_and_wrist():
    chain = cell.load_cell(find_shipped_cell()).nominal_chain()
    wrist = kinematics.wrist_centre(chain)
    free = np.full(6, np.inf)
    found = kinematics.workspace_map(chain, -free, free, kinematics.WorkspaceOptions(point=wrist, samples=500))
    assert found.reach == pytest.approx(1.4115, abs=5e-5) and found.counts.sum() == 500


def test_a_tool_goes_into_a_cell_and_camera_and_scanner_stay_on_the_flange(run_kr5, tmp_path, share):
    believed = cell.load_cell(find_shipped_cell())
    cell.save_cell(believed, tmp_path / "cell.yaml")
    before = believed.T_flange_camera(), believed.T_flange_scanner()
    done = run_kr5(
        *("calibrate", "tool", share / "data/touches", "-o", "tool.json"),
        *("--cell", "cell.yaml", "--write-cell", "new.yaml"),
    )
    assert done.returncode == 0, done.stderr
    found = cell.load_cell(tmp_path / "new.yaml")
    tip = json.loads((tmp_path / "tool.json").read_text())["result"]["tip"]
    assert np.allclose(np.asarray(found.tool.T_flange_tool)[:3, 3], tip)
    for old, new in zip(before, (found.T_flange_camera(), found.T_flange_scanner()), strict=True):
        assert np.allclose(old, new, atol=1e-12)
    done = run_kr5("calibrate", "tool", share / "data/touches", "--cell", "cell.yaml")
    assert done.returncode == 2 and "--write-cell is missing" in done.stderr


def test_camera_and_hand_eye_of_images_go_into_a_cell(run_kr5, tmp_path, share):
    planar(tmp_path / "bare.yaml")
    folder, board = share / "data/demo", None
    for line in (folder / "dataset.yaml").read_text().splitlines():
        board = line.split(":", 1)[1].strip() if line.startswith("target:") else board
    put = ("--cell", "bare.yaml", "--write-cell", "new.yaml")
    done = run_kr5("calibrate", "camera", folder / "images", "--target", board, *put)
    assert done.returncode == 2 and "no camera" in done.stderr and not (tmp_path / "new.yaml").exists()
    done = run_kr5("calibrate", "hand-eye", folder, "-o", "r.json", *put)
    assert done.returncode == 0, done.stderr
    found = cell.load_cell(tmp_path / "new.yaml")
    data = json.loads((tmp_path / "r.json").read_text())
    assert np.allclose(found.camera.T_flange_camera, data["result"]["T_mount_camera"])
    assert found.camera.fx == data["camera"]["fx"] and found.camera.pinhole().k1 == data["camera"]["k1"]
    put = ("--cell", "new.yaml", "--write-cell", "newer.yaml", "--max-views", "6")
    done = run_kr5("calibrate", "camera", folder / "images", "--target", board, "-o", "c.json", *put)
    assert done.returncode == 0, done.stderr
    newer = cell.load_cell(tmp_path / "newer.yaml").camera
    lens = json.loads((tmp_path / "c.json").read_text())["result"]["camera"]
    assert newer.fx == lens["fx"] and newer.pinhole().k2 == lens["k2"]
    assert np.allclose(newer.T_flange_camera, found.camera.T_flange_camera)


DAMAGED = [("workspace", "workspace cell.yaml --samples 500 -o out.json", "poses", ("cell.yaml",), ("out.json",))]
