"""Hand-eye folders of more images than a calibration can use."""

import json

import pytest

from kr5_tools.calibrate.hand_eye import thinned


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
