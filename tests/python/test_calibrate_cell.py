"""`kr5 calibrate cell`: camera, hand-eye and arm from one folder."""

import json

import kr5
import numpy as np
import pytest
import yaml
from kr5 import cell
from kr5.files.paths import find_shipped_cell

from kr5_tools.cli.cell_output import put_target
from test_laser_command import SCANNER, make_scans, write_poses, write_profiles


@pytest.fixture(scope="module")
def demo(share):
    return share / "data/demo"


@pytest.fixture(scope="module")
def truth(demo):
    return yaml.safe_load((demo / "truth.yaml").read_text())


@pytest.fixture
def joints(truth, tmp_path):
    """Joint values of the demo's stops, beside the cell with its arm."""
    cell.save_cell(cell.load_cell(find_shipped_cell()), tmp_path / "cell.yaml")
    return np.array(truth["joint_angles"])


def write_joints(file, q):
    file.write_text("q1,q2,q3,q4,q5,q6\n" + "\n".join(",".join(map(repr, map(float, row))) for row in q) + "\n")


def test_camera_and_hand_eye_of_the_demo_hold_the_truth(demo, truth, tmp_path, run_kr5):
    done = run_kr5("calibrate", "cell", demo, "-o", "cell.json")
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "cell.json").read_text())
    assert data["format"] == "kr5-cell-calibration/1" and truth["bumped"] in data["verdict"]["text"]
    assert [v["name"] for v in data["views"] if v["outlier"]] == [truth["bumped"]]
    result = data["result"]
    off = kr5.pose_difference(np.array(truth["T_flange_camera"]), np.array(result["T_mount_camera"]))
    squared = off @ np.linalg.solve(np.array(result["covariance"]), off)
    assert squared < 22.5  # 99.9 % of a chi-square of six
    std = {p["name"]: p["std"] for p in result["parameters"]}
    assert 0 < std["camera.fx"] < 5
    assert data["held_out"]["views"] == len(result["views"]) - 1  # without the bumped one
    assert run_kr5("report", "cell.json", "-o", "page.html", "--png", "plots").returncode == 0
    assert (tmp_path / "plots/parameter_changes.png").exists()


def test_joint_values_calibrate_the_arm_and_go_into_the_cell(demo, joints, tmp_path, run_kr5):
    write_joints(tmp_path / "joints.csv", joints)
    done = run_kr5(
        *("calibrate", "cell", demo, "--joint-values", "joints.csv", "--cell", "cell.yaml"),
        *("--write-cell", "calibrated.yaml", "--json", "out.json"),
    )
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "out.json").read_text())["result"]
    arm = [p for p in result["parameters"] if p["name"].startswith("arm.")]
    assert len(arm) == 25
    assert all(abs(p["value"] - p["nominal"]) < 5 * p["std"] for p in arm)  # the demo's arm is the nominal one
    written = cell.load_cell(tmp_path / "calibrated.yaml")
    assert abs(written.camera.fx - result["cell"]["camera"]["fx"]) < 1e-9
    T_flange_camera = written.tool.T_flange_tool @ written.camera.T_tool_camera
    assert np.allclose(T_flange_camera, result["T_mount_camera"])
    assert [j.a for j in written.robot.dh] == pytest.approx([j["a"] for j in result["cell"]["arm"]["joints"]])


def test_the_scanner_is_found_in_the_same_solve(demo, tmp_path, run_kr5):
    profiles, poses, targets = make_scans()
    (tmp_path / "scans").mkdir()
    write_profiles(tmp_path / "scans/profiles.csv", profiles, targets)
    write_poses(tmp_path / "scans/poses.csv", poses)
    done = run_kr5(
        *("calibrate", "cell", demo, "--scan", "scans", "--scan-target", "ball=sphere:0.02"),
        *("--scan-target", "table=plane", "--json", "out.json"),
    )
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "out.json").read_text())
    result = {key: np.array(data["result"][key]) for key in ("T_mount_camera", "T_flange_scanner", "T_camera_scanner")}
    off = kr5.pose_difference(SCANNER, result["T_flange_scanner"])
    assert off @ np.linalg.solve(np.array(data["result"]["covariance_scanner"]), off) < 22.5  # 99.9 %
    assert np.allclose(result["T_mount_camera"] @ result["T_camera_scanner"], result["T_flange_scanner"])
    assert any(figure["name"].startswith("scanner in camera") for figure in data["figures"])
    done = run_kr5("calibrate", "cell", demo, "--scan", "scans", "--scan-target", "ball=sphere:0.02")
    assert done.returncode == 2 and "table" in done.stderr


def test_everything_that_was_calibrated_goes_into_the_cell(demo, joints, tmp_path, run_kr5):
    profiles, poses, targets = make_scans()
    (tmp_path / "scans").mkdir()
    write_profiles(tmp_path / "scans/profiles.csv", profiles, targets)
    write_poses(tmp_path / "scans/poses.csv", poses)
    scan = ("--scan", "scans", "--scan-target", "ball=sphere:0.02", "--scan-target", "table=plane")
    put = ("--cell", "cell.yaml", "--write-cell", "calibrated.yaml", "--json", "out.json")
    done = run_kr5("calibrate", "cell", demo, *scan, *put)
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "out.json").read_text())["result"]
    written = cell.load_cell(tmp_path / "calibrated.yaml")
    assert np.allclose(written.T_flange_scanner(), result["T_flange_scanner"], atol=1e-12)
    assert written.laser.T_tool_scanner is not None  # in the form of the cell
    assert np.allclose(written.board.T_base_target, result["T_fixed_target"], atol=1e-12)
    assert "the places of the scanned targets are not written" in " ".join(done.stderr.split())


def test_a_calibrated_marker_map_goes_into_the_cell(demo, joints, tmp_path, run_kr5):
    markers = kr5.target_markers(kr5.parse_target("grid:36h11:5x7:0.03:0.01"))
    target = kr5.Target(kind="marker_map", family="36h11", map=markers)
    (tmp_path / "map.json").write_text(json.dumps(target.to_dict()))
    believed = cell.load_cell(tmp_path / "cell.yaml")
    believed.targets = [cell.Target.from_dict(target.to_dict() | {"name": "map", "T_base_target": np.eye(4)})]
    cell.save_cell(believed, tmp_path / "with_map.yaml")
    hold = [word for m in markers[3:] for word in ("--hold", f"marker{m.id}")]
    done = run_kr5(
        *("calibrate", "cell", demo, "--target", "map.json", "--cell", "with_map.yaml", *hold),
        *("--write-cell", "calibrated.yaml", "--json", "out.json"),
    )
    assert done.returncode == 0 and "not written" not in done.stderr, done.stderr
    result = json.loads((tmp_path / "out.json").read_text())["result"]
    (written,) = cell.load_cell(tmp_path / "calibrated.yaml").targets
    assert np.allclose(written.T_base_target, result["T_fixed_target"], atol=1e-12)
    for marker, found in zip(written.map, result["cell"]["markers"], strict=True):
        assert np.allclose(marker.T_target_marker, found["T_target_marker"], atol=1e-12)
    assert not np.allclose(written.map[1].T_target_marker, markers[1].T_target_marker, atol=1e-9)


def test_a_target_that_the_cell_does_not_have_is_not_put_into_it():
    believed = cell.load_cell(find_shipped_cell())
    board = believed.board.target()
    before = believed.to_yaml()
    other = kr5.parse_target("chessboard:6x9:0.0236")
    assert "the cell has 0 targets like that" in put_target(believed, other, "eye_in_hand", np.eye(4))
    assert "stands in the base" in put_target(believed, board, "eye_to_hand", np.eye(4))
    assert believed.to_yaml() == before
    believed.targets = [cell.Target.from_dict({**board.to_dict(), "T_base_target": np.eye(4)})]
    assert "the cell has 2 targets like that" in put_target(believed, board, "eye_in_hand", np.eye(4))


def test_joint_values_that_are_not_of_these_images_are_named(demo, joints, tmp_path, run_kr5):
    def said(*more, code=2):
        done = run_kr5("calibrate", "cell", demo, "--joint-values", "joints.csv", *more)
        assert done.returncode == code and "Traceback" not in done.stderr
        return " ".join(done.stderr.split())

    write_joints(tmp_path / "joints.csv", joints)
    assert "--cell" in said()
    write_joints(tmp_path / "joints.csv", np.roll(joints, 1, axis=0))
    assert "order of the rows" in said("--cell", "cell.yaml")
    write_joints(tmp_path / "joints.csv", np.degrees(joints))
    assert "is read in deg" in said("--cell", "cell.yaml", code=0)
    write_joints(tmp_path / "joints.csv", joints[:-1])
    assert "expected one for each" in said("--cell", "cell.yaml")
    write_joints(tmp_path / "joints.csv", np.where(np.arange(6) == 2, np.nan, joints))
    assert "q3" in said("--cell", "cell.yaml") or "finite" in said("--cell", "cell.yaml")


def test_wrong_names_and_folders_are_refused(demo, tmp_path, run_kr5):
    done = run_kr5("calibrate", "cell", demo, "--hold", "camera.f")
    assert done.returncode == 2 and "camera.f" in done.stderr
    done = run_kr5("calibrate", "cell", "nowhere")
    assert done.returncode == 2 and "nowhere" in done.stderr
    done = run_kr5("calibrate", "cell", demo, "--write-cell", "out.yaml")
    assert done.returncode == 2 and "--cell" in done.stderr
