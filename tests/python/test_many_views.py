"""More images than a calibration can use, and copies of one image."""

import json
import os
import shutil

import kr5
import numpy as np
import pytest
from kr5 import vision
from kr5.files.images import MOST_CAMERA_VIEWS, thinned


@pytest.mark.parametrize(
    "count, most, chosen",
    [(3, 5, [0, 1, 2]), (5, 5, [0, 1, 2, 3, 4]), (9, 3, [0, 4, 8]), (100_000, 2, [0, 99_999]), (1, 5, [0])],
)
def test_views_are_spread_evenly(count, most, chosen):
    assert thinned(count, most) == chosen


@pytest.mark.parametrize("count", [1001, 1999, 100_000])
def test_as_many_as_allowed_are_used_each_once(count):
    found = thinned(count, 1000)
    assert len(found) == 1000 and found == sorted(set(found))


def test_fewer_views_keep_their_poses(run_kr5, share, tmp_path):
    done = run_kr5("calibrate", "hand-eye", share / "data" / "demo", "--max-views", 11, "--json", "out.json")
    assert done.returncode == 0 and "11 of 16 images are used" in done.stderr, done.stderr
    out = json.loads((tmp_path / "out.json").read_text())
    names = [view["name"] for view in out["views"]]
    assert len(names) == 11 and names[0] == "view_01.png" and names[-1] == "view_16.png"
    whole = run_kr5("calibrate", "hand-eye", share / "data" / "demo", "--json", "whole.json")
    assert whole.returncode == 0

    def place(data):
        return [f["value"] for f in data["figures"] if f["name"].startswith("camera on flange") and f["unit"] == "mm"]

    assert place(out) == pytest.approx(place(json.loads((tmp_path / "whole.json").read_text())), abs=3.0)  # [mm]


BOARD = "chessboard:4x5:0.03"
CAMERA = kr5.Pinhole(width=320, height=240, fx=300.0, fy=300.0, cx=159.5, cy=119.5)


def render_view(k, file):
    """A board that is seen from another direction for each number."""
    middle = kr5.from_xyzrpy([-0.06, -0.045, 0, 0, 0, 0])
    T = (
        kr5.from_xyzrpy([0.02 * np.sin(k), 0.0, 0.3 + 0.001 * k, 0.5 * np.sin(2.1 * k), 0.5 * np.cos(1.7 * k), 0.1])
        @ middle
    )
    placed = vision.PlacedTarget(target=kr5.parse_target(BOARD), T_camera_target=T)
    vision.save_image(vision.render([placed], CAMERA, vision.RenderOptions(noise=1.0, seed=int(10 * k) + 1)), str(file))


def test_a_camera_is_calibrated_from_no_more_of_a_thousand_images_than_it_needs(run_kr5, tmp_path):
    folder = tmp_path / "photos"
    folder.mkdir()
    render_view(0, folder / "0000.png")
    used = set(thinned(1000, MOST_CAMERA_VIEWS))
    for k in range(1, 1000):
        if k in used:
            render_view(0.1 * k, folder / f"{k:04d}.png")
        else:
            os.link(folder / "0000.png", folder / f"{k:04d}.png")
    done = run_kr5("calibrate", "camera", "photos", "--target", BOARD, "--model", "k1", "--json", "out.json")
    assert done.returncode == 0, done.stderr
    assert f"{MOST_CAMERA_VIEWS} of 1000 images are used" in done.stderr and "--max-views" in done.stderr
    data = json.loads((tmp_path / "out.json").read_text())
    assert len(data["views"]) + len(data["input"]["without_target"]) == MOST_CAMERA_VIEWS
    focal = next(f for f in data["figures"] if f["name"] == "fx")
    assert abs(focal["value"] - CAMERA.fx) < 5 * focal["std"]


def test_copies_of_one_image_are_refused_as_given_twice(run_kr5, tmp_path):
    render_view(1, tmp_path / "a.png")
    render_view(2, tmp_path / "b.png")
    for k in range(9):
        shutil.copy(tmp_path / "a.png", tmp_path / f"copy{k}.png")
    done = run_kr5("calibrate", "camera", *sorted(tmp_path.glob("*.png")), "--target", BOARD, "-o", "out.json")
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert "the same image under several names: a.png, copy0.png, copy1.png and 7 more" in " ".join(done.stderr.split())
    assert not (tmp_path / "out.json").exists()
