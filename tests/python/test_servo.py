"""Visual servoing and bores from Python, and the bench that counts arrivals."""

import json
import os
import subprocess
import sys

import kr5
import numpy as np
import pytest
from kr5 import vision

from conftest import ROOT

CAMERA = kr5.Pinhole(width=320, height=240, fx=300.0, fy=300.0, cx=159.5, cy=119.5)
GOAL = np.diag([1.0, -1.0, -1.0, 1.0])
GOAL[2, 3] = 0.19


def tube_image():
    tube = vision.Solid(kind="tube", radius=0.0127, inner_radius=0.0097, depth=0.06)
    return vision.render(
        [], CAMERA, vision.RenderOptions(noise=1.0, blur=0.6), [vision.PlacedSolid(solid=tube, T_camera_solid=GOAL)]
    )


def test_a_bore_is_found_and_becomes_a_sight():
    hole = vision.find_hole(tube_image(), CAMERA, GOAL, vision.HoleOptions(radius=0.0097))
    assert hole.found and str(hole.status) == "found", hole.message
    assert hole.T_camera_hole[:3, 3] == pytest.approx([0, 0, 0.19], abs=1e-4)
    assert hole.radius == pytest.approx(0.0097, abs=1e-4)
    assert hole.covariance.shape == (3, 3) and hole.edges > 20
    sight = vision.observe_hole(hole)
    assert sight.seen and sight.rays.shape == (2, 4) and (sight.T_camera_target == hole.T_camera_hole).all()


def test_a_bore_that_is_not_there_says_so():
    hole = vision.find_hole(tube_image(), CAMERA, GOAL, vision.HoleOptions(radius=0.008))
    assert (
        not hole.found and str(hole.status) == "wrong_radius" and hole.other_radii[0] == pytest.approx(0.0097, abs=1e-4)
    )
    assert not vision.observe_hole(hole).seen
    with pytest.raises(kr5.InvalidArgument, match="radius"):
        vision.find_hole(tube_image(), CAMERA, GOAL, vision.HoleOptions())
    with pytest.raises(ValueError, match="grey"):
        vision.find_hole(np.zeros((2, 2, 3), np.uint8), CAMERA, GOAL, vision.HoleOptions(radius=0.01))


@pytest.mark.parametrize("by", ["position", "image"])
def test_a_camera_is_steered_from_python(by):
    servo = vision.VisualServo(GOAL, vision.VisualServoOptions(feature=by, latency=0.0))
    points = np.array([[-1, 1, 1, -1], [-1, -1, 1, 1], [0, 0, 0, 0]]) * 0.02
    T, time = GOAL.copy(), 0.0
    T[:3, 3] = 0.03, -0.02, 0.22
    while True:
        seen = T[:3, :3] @ points + T[:3, 3:]
        step = servo.step(
            vision.TargetObservation(seen=True, T_camera_target=T, points=points, rays=seen[:2] / seen[2]), time
        )
        if str(step.state) != "moving":
            break
        motion = np.eye(4)
        motion[:3, :3], motion[:3, 3] = kr5.exp_rotation(0.1 * step.twist[3:]), 0.1 * step.twist[:3]
        T, time = np.linalg.inv(motion) @ T, time + 0.1
    assert str(step.state) == "arrived", step.reason
    assert pytest.approx(GOAL, abs=2e-3) == T and T[:3, 3] == pytest.approx(GOAL[:3, 3], abs=2.1e-4)
    assert (step.twist == 0).all()


def test_a_gain_that_would_swing_is_refused():
    with pytest.raises(kr5.InvalidArgument, match="gain_near"):
        vision.VisualServo(GOAL, vision.VisualServoOptions(gain_near=10.0))
    with pytest.raises(kr5.InvalidArgument, match="time"):
        vision.VisualServo(GOAL).step(vision.TargetObservation(), float("nan"))


def test_the_bench_counts_starts_that_truly_end_over_the_tube(tmp_path):
    starts = 100 if os.environ.get("KR5_FULL") else 1
    done = subprocess.run(
        [
            sys.executable,
            ROOT / "tools/benchmarks/visual_servo.py",
            "--starts",
            str(starts),
            "--json",
            tmp_path / "f.json",
        ],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    runs = json.loads((tmp_path / "f.json").read_text())["runs"]
    assert len(runs) == 4 * starts and "NOT reached" not in done.stdout
    assert all(r["over_tube"] and r["position"] < 5e-4 and r["angle"] < np.radians(0.3) for r in runs), done.stdout
