"""Arrays of points: a column a point, a row a point, or OpenCV's shape; and what may be read both ways."""

import pickle

import kr5
import numpy as np
import pytest
from kr5 import calibration, picking

CAMERA = kr5.Pinhole(width=640, height=480, fx=500.0, fy=510.0, cx=320.0, cy=240.0)
RANDOM = np.random.default_rng(1)


def points(n, size=3):
    """n x size, before the camera."""
    return RANDOM.uniform(0.1, 0.3, (n, size)) + np.eye(size)[-1]


@pytest.mark.parametrize("n", [0, 1, 2, 4, 5, 100])
def test_rows_columns_and_opencvs_shape_are_the_same_points(n):
    rows = points(n)
    expected = np.array([[500 * x / z + 320, 510 * y / z + 240] for x, y, z in rows]).reshape(n, 2).T
    for shaped in (rows, rows.T, rows[:, None], np.asfortranarray(rows), rows.tolist()):
        got = CAMERA.project(shaped)
        assert got.shape == (2, n)
        assert np.allclose(got, expected)


@pytest.mark.parametrize("n", [1, 3, 7])
def test_pixels_in_rows_are_the_same_pixels(n):
    pixels = 500 * points(n, 2)
    for shaped in (pixels, pixels.T, pixels[:, None]):
        assert np.allclose(CAMERA.project(CAMERA.rays(shaped).T[:, None]), pixels.T)


def test_one_point_may_be_a_vector():
    assert np.allclose(CAMERA.project([0.1, 0.2, 1.0]), [[370], [342]])


def test_every_second_point_is_read_in_place():
    rows = points(20)
    assert np.allclose(CAMERA.project(rows[::2]), CAMERA.project(np.ascontiguousarray(rows[::2])))
    assert np.allclose(CAMERA.project(rows[::-1]), CAMERA.project(rows)[:, ::-1])


def test_three_points_as_a_square_are_refused_with_the_remedy():
    rows = points(3)
    with pytest.raises(ValueError, match=r"shape \(3, 3\).*points_from_rows.*points_from_columns"):
        CAMERA.project(rows)
    with pytest.raises(ValueError, match=r"^View\.points: .*points_from_rows"):
        kr5.View(points=rows)
    with pytest.raises(ValueError, match=r"^View\.pixels: .*shape \(2, 2\)"):
        kr5.View(pixels=[[1, 2], [3, 4]])
    with pytest.raises(ValueError, match="points_from_columns"):
        picking.Cloud(points=rows)


def test_the_remedy_says_which():
    rows = points(3)
    expected = np.column_stack([CAMERA.project(point).ravel() for point in rows])
    assert np.allclose(CAMERA.project(kr5.points_from_rows(rows)), expected)
    assert np.allclose(CAMERA.project(kr5.points_from_columns(rows.T)), expected)
    view = kr5.View(points=kr5.points_from_rows(rows))
    assert np.array_equal(view.points, rows.T)
    with pytest.raises(ValueError, match="two dimensions"):
        kr5.points_from_rows(np.zeros(3))


def test_three_points_that_are_the_same_either_way_are_taken():
    assert np.array_equal(kr5.View(points=np.eye(3)).points, np.eye(3))
    symmetric = np.array([[1.0, 2, 3], [2, 5, 6], [3, 6, 9]])
    assert np.array_equal(kr5.View(points=symmetric).points, symmetric)


def test_three_points_survive_a_dict_and_a_pickle():
    view = kr5.View(points=kr5.points_from_rows(points(3)), pixels=kr5.points_from_rows(points(2, 2)))
    for copy in (kr5.View.from_dict(view.to_dict()), pickle.loads(pickle.dumps(view))):
        assert np.array_equal(copy.points, view.points) and np.array_equal(copy.pixels, view.pixels)
    stop = calibration.HandEyeView(view=view)
    assert np.array_equal(pickle.loads(pickle.dumps(stop)).view.points, view.points)
    assert np.array_equal(calibration.HandEyeView.from_dict(stop.to_dict()).view.points, view.points)
    with pytest.raises(ValueError, match=r"^HandEyeView\.view\.points: "):  # a dict of one's own is no written one
        calibration.HandEyeView(view=view.to_dict())


@pytest.mark.parametrize("wrong", [np.zeros((2, 4)), np.zeros((4, 4)), np.zeros(4), np.zeros((4, 2, 3)), "text", None])
def test_other_shapes_are_refused(wrong):
    with pytest.raises(TypeError):
        CAMERA.project(wrong)
    with pytest.raises(TypeError, match=r"View\.points: expected an array of numbers of shape \(3, n\) or \(n, 3\)"):
        kr5.View(points=wrong)


def test_the_shapes_stand_in_the_documentation():
    assert "points : numpy.ndarray of shape (3, n) or (n, 3)" in kr5.View.__doc__
    assert "T_mount_camera : numpy.ndarray of shape (4, 4)" in calibration.HandEyeResult.__doc__
    for function in (kr5.Pinhole.project, kr5.estimate_projection_matrix, picking.fit_cylinder):
        assert "n x 3" in function.__doc__


def test_a_hand_eye_takes_points_in_rows():
    target = np.array([[x, y, 0] for x in np.arange(5) for y in np.arange(4)]) * 0.03
    T_flange_camera = kr5.to_pose([0.02, 0.05, 0.1, 0.1, -0.05, 1.5])
    T_base_target = kr5.to_pose([0.6, 0.1, 0.1, 0, 0, 0.2])
    stops = []
    for k in range(12):
        turn = [0.4 * np.sin(1.7 * k), 0.4 * np.cos(2.3 * k), 0.5 * np.sin(k)]
        T_base_camera = T_base_target @ kr5.to_pose([0.05, 0.03, 0.5, np.pi, 0, 0]) @ kr5.to_pose([0, 0, 0, *turn])
        T_camera_target = np.linalg.inv(T_base_camera) @ T_base_target
        seen = target @ T_camera_target[:3, :3].T + T_camera_target[:3, 3]
        view = kr5.View(points=target, pixels=CAMERA.project(seen).T, ids=list(range(20)))
        pose = T_base_camera @ np.linalg.inv(T_flange_camera)
        stops.append(calibration.HandEyeView(T_base_flange=pose, view=view))
    result = calibration.calibrate_hand_eye(stops, CAMERA)
    assert result.fit.usable
    assert np.allclose(result.T_mount_camera, T_flange_camera, atol=1e-6)
