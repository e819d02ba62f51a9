"""The Python surface of kr5.calibration; the mathematics is tested in C++."""

import kr5
import numpy as np
import pytest
from kr5 import calibration


def cell(count: int = 10) -> tuple:
    rng = np.random.default_rng(3)
    camera = kr5.Pinhole(width=1280, height=960, fx=1100, fy=1100, cx=640, cy=480)
    points = np.zeros((3, 20))
    points[:2] = np.mgrid[0:5, 0:4].reshape(2, -1) * 0.03
    X = kr5.to_pose(np.array([0.05, -0.03, 0.08, 0.1, -0.1, 1.5]))
    Z = kr5.to_pose(np.array([0.7, 0.1, 0.0, 3.0, 0.1, 0.2]))
    views = []
    for i in range(count):
        M = kr5.to_pose(np.array([-0.06, -0.05, 0.6, *rng.normal(0, 0.35, 3)]))
        T = Z @ np.linalg.inv(M) @ np.linalg.inv(X)
        view = kr5.View(
            name=f"v{i}", points=points, pixels=camera.project(M[:3, :3] @ points + M[:3, 3:]), ids=list(range(20))
        )
        views.append(calibration.HandEyeView(T_base_flange=T, view=view))
    return views, camera, X


def test_hand_eye_takes_and_gives_numpy():
    views, camera, X = cell()
    result = calibration.calibrate_hand_eye(views, camera, calibration.HandEyeOptions(mount="eye_in_hand"))
    assert result.T_mount_camera.shape == (4, 4)
    np.testing.assert_allclose(result.T_mount_camera, X, atol=1e-6)
    assert result.covariance.shape == (6, 6)
    assert [v.name for v in result.views] == [f"v{i}" for i in range(10)]
    assert result.to_dict()["fit"]["status"] == "converged"


def test_bad_input_raises_with_the_view_named():
    views, camera, _ = cell()
    with pytest.raises(kr5.InvalidArgument, match="three views"):
        calibration.calibrate_hand_eye(views[:2], camera)
    pixels = views[4].view.pixels.copy()
    pixels[0, 0] = np.nan
    views[4] = calibration.HandEyeView(
        T_base_flange=views[4].T_base_flange, view=kr5.View(name="v4", points=views[4].view.points, pixels=pixels)
    )
    with pytest.raises(kr5.InvalidArgument, match="v4"):
        calibration.calibrate_hand_eye(views, camera)
    with pytest.raises(kr5.InvalidArgument, match="sigma_pixel"):
        calibration.calibrate_hand_eye(views[:4], camera, calibration.HandEyeOptions(sigma_pixel=-1))


def test_the_diagnosis_takes_the_views_of_the_calibration():
    views, camera, _ = cell()
    result = calibration.calibrate_hand_eye(views, camera)
    sound = calibration.diagnose_hand_eye(views, camera, result)
    assert str(sound.verdict) == "good" and not sound.causes
    faulty = [
        calibration.HandEyeView(T_base_flange=np.linalg.inv(view.T_base_flange), view=view.view) for view in views
    ]
    found = calibration.diagnose_hand_eye(faulty, camera, calibration.calibrate_hand_eye(faulty, camera))
    assert str(found.verdict) == "unusable" and str(found.causes[0].cause) == "poses_inverted"
    rows = np.array([calibration.to_row(view.T_base_flange, calibration.PoseFormat()) for view in views])
    written = calibration.diagnose_hand_eye(
        rows, calibration.PoseFormat(), [view.view for view in views], camera, "eye_in_hand", result
    )
    assert written.to_dict() == sound.to_dict()
    with pytest.raises(kr5.InvalidArgument, match="three views"):
        calibration.diagnose_hand_eye(views[:2], camera, result)
    with pytest.raises(kr5.InvalidArgument, match="2 time stamps"):
        calibration.diagnose_hand_eye(views, camera, result, times=[0.0, 1.0])


def test_the_diagnosis_takes_the_pairs_of_the_calibration():
    views, _, X = cell()
    T_base_target = kr5.to_pose([0.7, 0.1, 0.0, 3.0, 0.1, 0.2])
    pairs = [
        calibration.PosePair(
            name=view.view.name,
            T_base_flange=view.T_base_flange,
            T_camera_target=np.linalg.inv(view.T_base_flange @ X) @ T_base_target @ kr5.to_pose(1e-5 * np.sin([k] * 6)),
        )
        for k, view in enumerate(views)
    ]
    pairs[3].T_base_flange, pairs[4].T_base_flange = pairs[4].T_base_flange, pairs[3].T_base_flange
    found = calibration.diagnose_hand_eye_pairs(pairs, calibration.calibrate_hand_eye_pairs(pairs))
    assert str(found.causes[0].cause) == "out_of_order"
    assert sorted(found.causes[0].views) == [3, 4]


def test_a_method_of_ones_own_is_judged_like_ours():
    views, camera, X = cell()
    ours = calibration.evaluate_hand_eye(views, camera)
    own = calibration.evaluate_hand_eye_method(views, camera, lambda rest, targets: X)
    none = calibration.evaluate_hand_eye_method(views, camera, lambda rest, targets: None)
    assert len(ours.views) == len(own.views) == 10
    assert max(ours.position_rms, own.position_rms) < 1e-6
    assert none.unjudged == 10 and not none.views
