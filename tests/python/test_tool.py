"""`kr5 calibrate tool` and `kr5 calibrate timed`, and their Python surface."""

import json

import kr5
import numpy as np
import pytest
from kr5 import calibration, cell
from kr5.files.paths import find_shipped_cell

TIP = np.array([0.01, -0.02, 0.15])


def touches(count=8, noise=1e-4, axis=None, seed=1):
    random = np.random.default_rng(seed)
    poses = []
    for _ in range(count):
        direction = random.normal(size=3) if axis is None else np.array(axis, dtype=float)
        w = direction / np.linalg.norm(direction) * random.uniform(0.3, 0.9)
        T = kr5.to_pose(np.concatenate([np.zeros(3), w]))
        T[:3, 3] = np.array([0.5, 0.1, 0.3]) - T[:3, :3] @ TIP + noise * random.normal(size=3)
        poses.append(T)
    return poses


def write_kuka(file, poses, scale=1e3, turn=180 / np.pi):
    rows = ["x,y,z,a,b,c"]
    for T in poses:
        x, y, z, roll, pitch, yaw = kr5.to_xyzrpy(T)
        rows.append(
            ",".join(map(repr, map(float, [scale * x, scale * y, scale * z, turn * yaw, turn * pitch, turn * roll])))
        )
    file.write_text("\n".join(rows) + "\n")


def write_stream(file, t, poses):
    rows = ["t,x,y,z,qx,qy,qz,qw"]
    form = calibration.PoseFormat()
    rows += [",".join(map(repr, [float(s), *map(float, calibration.to_row(T, form))])) for s, T in zip(t, poses)]
    file.write_text("\n".join(rows) + "\n")


def streams(offset=0.123, noise=0.0):
    """Motion of a hand and of the camera on it, each by its own clock; noise is that of the camera's poses [m, rad]."""
    random = np.random.default_rng(3)
    X, Z = kr5.to_pose([0.05, 0.02, 0.1, 0.1, 0.2, 1.5]), kr5.to_pose([1, 0.3, 0.2, 1, 2, 0.5])

    def hand(t):
        return kr5.to_pose(
            [
                0.2 * np.sin(t),
                0.2 * np.cos(1.3 * t),
                0.1 * np.sin(0.7 * t),
                0.5 * np.sin(1.7 * t),
                0.4 * np.cos(1.1 * t),
                0.3 * np.sin(2.3 * t),
            ]
        )

    th, tc = np.arange(0, 20, 0.02), np.arange(1, 19, 1 / 30)
    seen = [np.linalg.inv(Z) @ hand(t) @ X @ kr5.to_pose(noise * random.normal(size=6)) for t in tc]
    return th, [hand(t) for t in th], tc + offset, seen


def test_tool_in_python_gives_tip_covariance_and_residuals():
    result = calibration.calibrate_tool(touches(), calibration.ToolOptions(height_at_calibration=0.05, height_now=0.07))
    assert np.linalg.norm(result.tip - TIP) < 1e-3
    assert result.covariance.shape == (3, 3) and len(result.poses) == 8
    assert "height" in result.warnings[0]
    with pytest.raises(kr5.InvalidArgument, match="at least 4"):
        calibration.calibrate_tool(touches(3))


def test_tool_command_reads_kuka_poses_and_writes_a_result(tmp_path, run_kr5):
    write_kuka(tmp_path / "touches.csv", touches())
    done = run_kr5("calibrate", "tool", "touches.csv", "-o", "tool.json")
    assert done.returncode == 0, done.stderr
    assert "mm" in done.stdout
    data = json.loads((tmp_path / "tool.json").read_text())
    assert data["format"] == "kr5-tool/1" and data["verdict"]["word"] == "good"
    assert np.linalg.norm(np.array(data["result"]["tip"]) - TIP) < 1e-3
    assert [f["unit"] for f in data["figures"]] == ["mm"] * 3


def test_tool_command_notices_metres_for_millimetres_and_radians_for_degrees(tmp_path, run_kr5):
    write_kuka(tmp_path / "touches.csv", touches(), scale=1e3)
    done = run_kr5("calibrate", "tool", "touches.csv", "--length-unit", "m", "-o", "tool.json")
    assert done.returncode == 2 and "--length-unit" in done.stderr
    assert not (tmp_path / "tool.json").exists()
    done = run_kr5("calibrate", "tool", "touches.csv", "--angle-unit", "rad")
    assert done.returncode == 2 and "--angle-unit" in done.stderr


def test_tool_command_says_which_motion_is_missing(tmp_path, run_kr5):
    write_kuka(tmp_path / "touches.csv", touches(axis=(0, 0, 1)))
    (tmp_path / "keep.json").write_text("old")
    done = run_kr5("calibrate", "tool", "touches.csv", "-o", "keep.json")
    assert done.returncode == 2 and "one axis" in done.stderr
    assert (tmp_path / "keep.json").read_text() == "old"


def test_tool_command_refuses_columns_it_does_not_know(tmp_path, run_kr5):
    (tmp_path / "touches.csv").write_text("x,y,z\n1,2,3\n")
    done = run_kr5("calibrate", "tool", "touches.csv")
    assert done.returncode == 2 and "touches.csv: found the columns x, y, z; missing: " in done.stderr
    assert "qx qy qz qw" in done.stderr and "--convention" in done.stderr


def test_timed_command_finds_the_offset_and_draws_it(tmp_path, run_kr5):
    th, hands, tc, cameras = streams()
    write_stream(tmp_path / "hand.csv", th, hands)
    write_stream(tmp_path / "camera.csv", tc, cameras)
    done = run_kr5("calibrate", "timed", "hand.csv", "camera.csv", "-o", "timed.json", "--png", "a.png")
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "timed.json").read_text())
    assert data["format"] == "kr5-timed-hand-eye/1"
    assert abs(data["result"]["offset"] - 0.123) < 1e-4
    assert data["figures"][0]["unit"] == "ms"
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


def test_the_camera_of_two_clocks_goes_into_a_cell(tmp_path, run_kr5):
    believed = cell.load_cell(find_shipped_cell())
    cell.save_cell(believed, tmp_path / "cell.yaml")
    th, hands, tc, cameras = streams()
    write_stream(tmp_path / "hand.csv", th, hands)
    write_stream(tmp_path / "camera.csv", tc, cameras)
    command = ("calibrate", "timed", "hand.csv", "camera.csv", "--cell", "cell.yaml")
    done = run_kr5(*command, "--write-cell", "new.yaml")
    assert done.returncode == 0, done.stderr
    found = cell.load_cell(tmp_path / "new.yaml")
    true = kr5.to_pose([0.05, 0.02, 0.1, 0.1, 0.2, 1.5])  # of `streams`, on the hand
    assert np.linalg.norm(kr5.pose_difference(true, found.T_flange_camera())) < 1e-3
    assert found.camera.fx == believed.camera.fx and found.camera.width == believed.camera.width
    assert np.allclose(found.tool.T_flange_tool, believed.tool.T_flange_tool)
    assert np.linalg.norm(kr5.pose_difference(true, believed.T_flange_camera())) > 0.01
    done = run_kr5(*command)
    assert done.returncode == 2 and "--write-cell is missing" in done.stderr


def test_timed_command_names_streams_that_do_not_overlap_and_quaternions_that_are_none(tmp_path, run_kr5):
    th, hands, tc, cameras = streams()
    write_stream(tmp_path / "hand.csv", th, hands)
    write_stream(tmp_path / "camera.csv", tc + 100, cameras)
    (tmp_path / "keep.json").write_text("old")
    done = run_kr5("calibrate", "timed", "hand.csv", "camera.csv", "-o", "keep.json")
    assert done.returncode == 2 and "overlap" in done.stderr
    assert (tmp_path / "keep.json").read_text() == "old"
    (tmp_path / "camera.csv").write_text("t,x,y,z,qx,qy,qz,qw\n0,0,0,0,1,1,0,0\n")
    done = run_kr5("calibrate", "timed", "hand.csv", "camera.csv")
    assert done.returncode == 2 and "camera.csv: line 2: " in done.stderr and "quaternion of length 1.41" in done.stderr


def test_tool_command_takes_a_folder_whose_dataset_names_poses_and_convention(tmp_path, run_kr5):
    folder = tmp_path / "touched"
    folder.mkdir()
    write_kuka(folder / "touches.csv", touches())
    (folder / "dataset.yaml").write_text(
        "format: kr5-dataset/1\nposes: touches.csv\nconvention: {position: mm, rotation: kuka_abc, angle: deg}\n"
    )
    done = run_kr5("calibrate", "tool", "touched", "-o", "folder.json")
    assert done.returncode == 0, done.stderr
    assert run_kr5("calibrate", "tool", "touched/touches.csv", "-o", "file.json").returncode == 0
    from_folder, from_file = (json.loads((tmp_path / f).read_text()) for f in ("folder.json", "file.json"))
    assert from_folder["result"] == from_file["result"]


def test_tool_command_says_what_a_folder_lacks(tmp_path, run_kr5):
    folder = tmp_path / "touched"
    folder.mkdir()
    done = run_kr5("calibrate", "tool", "touched")
    assert done.returncode == 2 and "dataset.yaml" in done.stderr
    write_kuka(folder / "touches.csv", touches())
    (folder / "dataset.yaml").write_text(
        "poses: touches.csv\nconvention: {position: m, rotation: kuka_abc, angle: deg}\n"
    )
    done = run_kr5("calibrate", "tool", "touched")
    assert done.returncode == 2 and "correct the convention" in " ".join(done.stderr.split())
    done = run_kr5("calibrate", "tool", "touched", "--length-unit", "mm")
    assert done.returncode == 2 and "--length-unit" in done.stderr and "dataset.yaml" in done.stderr
