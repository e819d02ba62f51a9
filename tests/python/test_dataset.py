"""`kr5 dataset guess` on four real sets, on rendered ones, and on folders that hold none."""

import shutil
from types import SimpleNamespace

import kr5
import numpy as np
import pytest
import yaml
from kr5 import vision
from typer.testing import CliRunner

from kr5_tools.dataset import command
from kr5_tools.dataset.target_guess import _grid, _size, _tags

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
    assert "its size is a guess" in " ".join(done.output.split())
    assert len(read) == len(set(read)) == 7


def test_a_size_with_its_unit_behind_it_is_left_and_said_to_be_guessed():
    assert _size("", {"spacing": "30mm"}) is None
    assert _size("tag size: 0.04 m", {"spacing": "30mm", "chessboard_dim": "nan"}) == "0.04"
    assert _size("", {"spacing": "30mm", "chessboard_dim": "0.03"}) == "0.03"


def test_one_wrong_tag_does_not_make_a_board_larger():
    board = tags({i: (1.25 * (i % 4), 1.25 * (i // 4)) for i in range(20)})
    wrong = tags({**{i: (1.25 * (i % 4), 1.25 * (i // 4)) for i in range(20)}, 587: (9, 9)})
    ((name, _),) = _tags("", {}, "36h11", [board, wrong, board])
    assert name == "grid:36h11:5x4:0.05:0.0125"


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
        out.append(SimpleNamespace(id=number, corners=corners[:2] / corners[2]))
    return out


def test_columns_and_gap_of_a_board_of_tags_are_told_from_some_of_its_tags():
    whole = {i: (1.25 * (i % 4), 1.25 * (i // 4)) for i in range(20)}
    some = {i: whole[i] for i in (1, 2, 5, 7, 9, 14, 18)}
    for seen in (whole, some):
        cols, gap = _grid(tags(seen))
        assert cols == 4 and gap == pytest.approx(0.25, abs=1e-6)


@pytest.mark.parametrize(
    "places",
    [
        {},
        {3: (0, 0)},
        {i: (1.25 * i, 0) for i in range(8)},  # too few, or on one line
        {i: (1.25 * (i % 4), -1.25 * (i // 4)) for i in range(20)},  # numbered from below
        {i: (1.25 * (7 * i % 20 % 4), 1.25 * (7 * i % 20 // 4)) for i in range(20)},  # numbered anyhow
        {
            i: (2.5 * (i % 3) + 1.25 * (i // 3 % 2), 1.25 * (i // 3)) for i in range(15)
        },  # in the white squares of a chessboard
    ],
    ids=["none", "one", "row", "upwards", "anyhow", "chessboard"],
)
def test_tags_that_are_no_such_board_are_not_taken_for_one(places):
    assert _grid(tags(places)) is None
