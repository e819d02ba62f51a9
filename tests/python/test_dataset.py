"""`kr5 dataset guess` on four real sets, on rendered ones, and on folders that hold none."""

import json
import shutil

import kr5
import numpy as np
import pytest
import yaml
from kr5 import vision
from typer.testing import CliRunner

from kr5_tools.calibrate.target_guess import _size, _tags
from kr5_tools.dataset import command

EXPECTED = {
    "handeye_visp_franka/eye-in-hand": ("rotation_vector", "eye_in_hand", "chessboard:6x9:0.0236"),
    "handeye_visp_franka/eye-to-hand": ("rotation_vector", "eye_to_hand", "tag:36h11:10:0.048"),
    "handeye_industrial_calibration/test_set_10x10": ("quaternion_xyzw", "eye_in_hand", "circles:10x10:0.0254"),
    "handeye_industrial_calibration/test_set_charuco": (
        "quaternion_xyzw",
        "eye_to_hand",
        "charuco:aruco_6x6_250:7x5:0.036195:0.018256",
    ),
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


@pytest.fixture
def views(tmp_path, share):
    """Images and poses of the demo alone; the image in the middle does not show the board."""
    folder = tmp_path / "cell"
    (folder / "images").mkdir(parents=True)
    images = sorted((share / "data/demo/images").glob("*.png"))[:7]
    for image in images:
        shutil.copy(image, folder / "images")
    vision.save_image(np.full((720, 960), 128, np.uint8), str(folder / "images" / images[3].name))
    lines = (share / "data/demo/poses.csv").read_text().splitlines()
    (folder / "poses.csv").write_text("\n".join(lines[:8]) + "\n")
    shutil.copy(share / "data/demo/camera.yaml", folder)
    return folder


def test_a_board_of_tags_is_proposed_though_the_middle_image_does_not_show_it(views, monkeypatch):
    read, load = [], vision.load_image
    monkeypatch.setattr(vision, "load_image", lambda file: (read.append(file), load(file))[1])
    done = CliRunner().invoke(command.app, ["guess", str(views), "-o", str(views / "guessed.yaml")])
    assert done.exit_code == 0, done.output
    data = yaml.safe_load((views / "guessed.yaml").read_text())
    assert data["convention"]["rotation"] == "kuka_abc" and data["camera"] == "camera.yaml"
    target = kr5.parse_target(data["target"])
    assert (str(target.kind), target.rows, target.cols) == ("tag_grid", 5, 7)
    assert abs(target.gap / target.size - 1 / 3) < 0.005
    assert abs(target.size - 0.03) < 3e-5 and "size from the robot poses" in " ".join(done.output.split())
    assert len(read) == len(set(read)) == 7


def test_the_size_that_the_poses_tell_is_the_one_with_which_they_agree(run_kr5, views):
    done = run_kr5("dataset", "guess", views, "-o", views / "dataset.yaml", "--json", "guess.json", width=80)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split().count("item") == 1  # the table is not divided
    done = run_kr5("calibrate", "hand-eye", views, "--json", "hand_eye.json")
    causes = json.loads((views.parent / "hand_eye.json").read_text())["causes"]
    assert done.returncode == 0 and "target_size_wrong" not in [cause["cause"] for cause in causes]


def test_a_size_that_is_given_is_not_changed_by_the_poses(run_kr5, views):
    done = run_kr5("dataset", "guess", views, "--target", "grid:36h11:5x7:0.05:0.0167")
    assert done.returncode == 0 and "target: grid:36h11:5x7:0.05:0.0167" in done.stdout


def test_a_size_is_doubted_as_the_reading_of_four_poses_is(run_kr5, views):
    lines = (views / "poses.csv").read_text().splitlines()
    for image in sorted((views / "images").glob("*.png"))[5:]:
        image.unlink()
    (views / "poses.csv").write_text("\n".join(lines[:6]) + "\n")
    done = run_kr5("dataset", "guess", views, "--json", "guess.json")
    assert done.returncode == 0, done.stderr
    reasons = json.loads((views.parent / "guess.json").read_text())["reasons"]
    doubted = {reason["what"]: reason["confidence"] for reason in reasons}
    assert doubted["target"] == doubted["convention, mount"] == "low"


def test_a_size_with_its_unit_behind_it_is_left_and_said_to_be_guessed():
    assert _size("", {"spacing": "30mm"}) is None
    assert _size("tag size: 0.04 m", {"spacing": "30mm", "chessboard_dim": "nan"}) == "0.04"
    assert _size("", {"spacing": "30mm", "chessboard_dim": "0.03"}) == "0.03"


def test_one_wrong_tag_does_not_make_a_board_larger():
    board = tags({i: (1.25 * (i % 4), 1.25 * (i // 4)) for i in range(20)})
    wrong = tags({**{i: (1.25 * (i % 4), 1.25 * (i // 4)) for i in range(20)}, 587: (9, 9)})
    (guess,) = _tags("", {}, vision.guess_tag_grid([board, wrong, board]))
    assert guess.name == "grid:36h11:5x4:0.05:0.0125" and guess.is_size_guessed
    assert guess.why.startswith("20 tags of 36h11 seen in rows of 4, with gaps of 0.250 sides")


def test_one_tag_is_proposed_and_tags_on_one_line_are_not():
    (guess,) = _tags("tag size: 0.04 m", {}, vision.guess_tag_grid([tags({3: (0, 0)})]))
    assert guess.name == "tag:36h11:3:0.04" and not guess.is_size_guessed
    assert guess.why == "one tag of 36h11 seen; size named in a text of the folder"
    assert not _tags("", {}, vision.guess_tag_grid([tags({i: (1.25 * i, 0) for i in range(8)})]))


def test_a_set_without_a_known_target_is_refused(run_kr5, views):
    for image in (views / "images").glob("*.png"):
        vision.save_image(np.full((240, 320), 128, np.uint8), str(image))
    done = run_kr5("dataset", "guess", views)
    assert done.returncode == 2 and "no known target" in done.stderr and "--target" in done.stderr


def tags(places, side=1.0):
    """Tags whose first corners stand at `places` on a plane that is seen aslant."""
    H = np.array([[40, 3, 100], [-2, 38, 90], [0.01, -0.02, 1]])
    out = []
    for number, (x, y) in places.items():
        corners = H @ np.array([[x, x + side, x + side, x], [y, y, y + side, y + side], [1, 1, 1, 1]])
        out.append(vision.TagDetection(family="36h11", id=number, corners=corners[:2] / corners[2]))
    return out
