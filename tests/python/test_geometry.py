"""`kr5.calibrate_single_image`: the camera in the hand from one rendered image of a grid on two planes."""

import kr5
import numpy as np
import pytest
from kr5 import vision

CAMERA = kr5.Pinhole(width=1280, height=960, fx=1100, fy=1100, cx=639.5, cy=479.5)


def planes():
    """Two sheets of markers at a right angle, as targets and as poses in the flange frame."""
    sheets = [kr5.parse_target("grid:36h11:3x3:0.03:0.01"), kr5.parse_target("grid:25h9:3x3:0.03:0.01")]
    left = kr5.to_pose([-0.12, -0.055, 0.5, 0, 0.7, 0])
    right = kr5.to_pose([0.02, -0.055, 0.58, 0, -0.8, 0])
    return sheets, [left, right]


def seen(image, sheets, T_flange_sheet):
    """Views of both sheets whose points are given in the flange frame, and by how much their corners err together."""
    views, correlation = [], 1.0
    for sheet, T in zip(sheets, T_flange_sheet):
        found = vision.find_target(np.asarray(image), sheet)
        assert found.found, found.message
        points = T[:3, :3] @ found.view.points + T[:3, 3:]
        views.append(kr5.View(points=points, pixels=found.view.pixels, ids=found.view.ids))
        correlation = max(correlation, found.correlation)
    return views, correlation


def test_one_image_of_two_planes_gives_the_camera():
    sheets, T_flange_sheet = planes()
    truth = kr5.to_pose([0.02, -0.03, 0.05, 0.05, -0.08, 0.2])
    placed = [
        vision.PlacedTarget(target=s, T_camera_target=np.linalg.inv(truth) @ T) for s, T in zip(sheets, T_flange_sheet)
    ]
    image = vision.render(placed, CAMERA, vision.RenderOptions(blur=0.8, noise=3, seed=3))
    views, correlation = seen(image, sheets, T_flange_sheet)
    assert 1.3 < correlation < 3  # four corners from one fit
    result = kr5.calibrate_single_image(views, CAMERA, kr5.SingleImageOptions(correlation=correlation))
    assert result.fit.usable, result.fit.message
    d = kr5.pose_difference(result.T_flange_camera, truth)
    assert (
        np.linalg.norm(d[:3]) < 0.1 / CAMERA.fx * 0.5 and np.linalg.norm(d[3:]) < 0.1 / CAMERA.fx
    )  # 0.1 px at half a metre
    assert d @ np.linalg.solve(result.covariance, d) < kr5.uncertainty.chi_square_quantile(0.9999, 6)
    assert result.covariance.shape == (6, 6) and result.sigma_pixel < 0.2 and result.depth_ratio > 0.05
    alone = kr5.calibrate_single_image(views[:1], CAMERA)
    assert alone.depth_ratio < 1e-6 < result.depth_ratio


def test_too_few_points_are_refused():
    view = kr5.View(points=np.zeros((3, 4)), pixels=np.zeros((2, 4)), ids=[0, 1, 2, 3])
    with pytest.raises(kr5.InvalidArgument):
        kr5.calibrate_single_image([view], CAMERA)
    with pytest.raises(kr5.InvalidArgument, match="correlation"):
        kr5.calibrate_single_image([view], CAMERA, kr5.SingleImageOptions(correlation=0.5))
