"""`kr5 dataset guess` on four real sets."""

import pytest
import yaml

EXPECTED = {
    "handeye_visp_franka/eye-in-hand": ("rotation_vector", "eye_in_hand", "chessboard:6x9:0.0236"),
    "handeye_visp_franka/eye-to-hand": ("rotation_vector", "eye_to_hand", "tag:36h11:10:0.048"),
    "handeye_industrial_calibration/test_set_10x10": ("quaternion_xyzw", "eye_in_hand", "circles:10x10:0.0254"),
    "handeye_industrial_calibration/test_set_charuco": ("quaternion_xyzw", "eye_to_hand", "charuco:aruco_6x6_250:7x5:0.036195:0.018256"),
}


@pytest.mark.parametrize("name", EXPECTED)
def test_guess_finds_convention_mount_and_target(run_kr5, tmp_path, reference, name):
    done = run_kr5("dataset", "guess", reference / "data" / name, "-o", "dataset.yaml")
    assert done.returncode == 0, done.stderr
    data = yaml.safe_load((tmp_path / "dataset.yaml").read_text())
    rotation, mount, target = EXPECTED[name]
    assert (data["convention"]["rotation"], data["mount"], data["target"]) == (rotation, mount, target)
    assert data["convention"]["position"] == "m"
    other = {"eye_in_hand": "eye_to_hand", "eye_to_hand": "eye_in_hand"}[mount]
    assert "T_flange_base" in done.stdout and other in done.stdout  # the same equations: the other reading is told


def test_a_folder_without_images_or_poses_is_refused(run_kr5, tmp_path, share):
    (tmp_path / "empty").mkdir()
    done = run_kr5("dataset", "guess", tmp_path / "empty")
    assert done.returncode == 2 and "found no image" in done.stderr
