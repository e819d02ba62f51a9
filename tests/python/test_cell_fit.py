"""`kr5.fit`: a fit of one's own from Python."""

import kr5
import numpy as np
import pytest
from kr5 import cell, fit, kinematics
from kr5.files.paths import find_shipped_cell

TIP = np.array([0.1, -0.05, 0.15])
BASE = kr5.to_pose([1.0, -0.5, 0.3, 0.2, -0.1, 0.7])


@pytest.fixture(scope="module")
def nominal():
    return cell.load_cell(find_shipped_cell()).nominal_chain()


def bent(nominal):
    joints = nominal.joints
    joints[1].a += 8e-4
    joints[2].theta_offset += 2e-3
    return kinematics.DhChain(joints, nominal.T_base_0)


def tracked(nominal, noise):
    """The problem of the header's example, where only what was bent is free of the arm."""
    true, random = bent(nominal), np.random.default_rng(3)
    problem = fit.Problem()
    arm, base = problem.add_arm("arm", nominal), problem.add_pose("base", BASE @ kr5.to_pose([0.01] * 6))
    tip = problem.add_point("tool", np.zeros(3))
    for k in range(30):
        if k not in (7, 11):
            problem.hold(arm, k)
    seen = []
    for q in random.uniform(-1.2, 1.2, (40, 6)):
        T = BASE @ true.flange(q)
        place = T[:3, :3] @ TIP + T[:3, 3] + random.normal(0, noise, 3)
        seen.append(
            problem.add(
                fit.PositionMeasurement(fit.PoseChain().then(base).then_arm(arm, q), tip, place, max(noise, 1e-6))
            )
        )
    return problem, arm, base, tip, seen


def test_a_tracker_gives_arm_base_and_tip(nominal):
    problem, arm, base, tip, _ = tracked(nominal, 0.0)
    result = problem.solve()
    assert result.fit.usable and result.residuals == 120 and not result.unidentifiable
    assert result.coordinates[:2] == ["arm.joint2.a [m]", "arm.joint3.theta_offset [rad]"]
    assert np.allclose(problem.change(arm)[[7, 11]], [8e-4, 2e-3], atol=1e-9)
    assert problem.arm(arm).joints[1].a == pytest.approx(bent(nominal).joints[1].a, abs=1e-9)
    assert np.allclose(problem.pose(base), BASE, atol=1e-8) and np.allclose(problem.values(tip), TIP, atol=1e-8)


def test_the_covariance_is_that_of_the_noise_and_an_outlier_is_taken_out(nominal):
    problem, arm, _, _, seen = tracked(nominal, 1e-4)
    result = problem.solve(fit.SolveOptions(max_iterations=50))
    places = [p for p in result.places(arm) if p >= 0]
    off = problem.change(arm)[[7, 11]] - [8e-4, 2e-3]
    assert off @ np.linalg.solve(result.covariance[np.ix_(places, places)], off) < 13.8  # 99.9 % of two
    assert result.cost == pytest.approx(120 - 11, abs=5 * np.sqrt(2 * 109))
    # A row of its own: chi-square of three, and shares of redundancy that sum to all that is left over.
    agreements = [result.agreement(problem, o) for o in seen]
    assert all(a.dof == 3 for a in agreements) and max(a.squared_distance for a in agreements) < 30
    assert sum(a.redundancy.sum() for a in agreements) == pytest.approx(120 - 11, abs=1e-6)
    together = result.squared_residuals(problem, seen, 0, 3)
    assert together.rows == 120 and together.squares == pytest.approx(result.cost)
    assert np.allclose(np.linalg.inv(together.information), result.covariance, rtol=1e-5, atol=1e-14)
    problem.set_weight(seen[4], 0.0)
    assert problem.solve().residuals == 117


def test_pixels_give_a_camera_and_its_pose():
    lens = kr5.Pinhole(width=1280, height=960, fx=1000, fy=1010, cx=640, cy=470)
    random = np.random.default_rng(5)
    board = np.array([[x, y, 0.02 * ((x + y) % 2)] for x in range(6) for y in range(5)]).T * [[0.05], [0.05], [1.0]]
    start = kr5.Pinhole(width=1280, height=960, fx=980, fy=990, cx=645, cy=465)
    problem = fit.Problem()
    camera, mount = problem.add_camera("camera", start), problem.add_pose("mount", np.eye(4))
    for name in ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"):
        assert problem.hold(f"camera.{name}")
    assert not problem.hold("camera.focal")
    T_flange_camera = kr5.to_pose([0.05, -0.03, 0.1, 0.02, -0.03, 0.05])
    views = []
    for k in range(8):
        T = kr5.to_pose([-0.1, -0.1, 0.5 + 0.02 * k, *random.normal(0, 0.3, 3)])  # board in the camera
        pixels = lens.project(T[:3, :3] @ board + T[:3, 3:])
        known = T_flange_camera @ T  # board in the flange, known
        chain = fit.PoseChain().then_inverse(mount).then(known)
        views.append(problem.add(fit.PixelMeasurement(chain, camera, board, pixels, 0.1)))
    result = problem.solve()
    assert result.fit.usable and np.allclose(problem.pose(mount), T_flange_camera, atol=1e-7)
    found = problem.camera(camera)
    assert (found.fx, found.fy, found.cx, found.cy) == pytest.approx((1000, 1010, 640, 470), abs=1e-3)
    assert np.abs(problem.residuals(views[0])).max() < 1e-3
    sigmas = np.full(30, 0.1)
    sigmas[7] = np.inf
    problem.set_pixel_sigmas(views[0], sigmas)
    assert problem.residuals(views[0]).reshape(-1, 2)[7] == pytest.approx([0, 0])


def test_what_cannot_be_is_refused_in_words(nominal):
    problem = fit.Problem()
    arm, base = problem.add_arm("arm", nominal), problem.add_pose("base", np.eye(4))
    chain = fit.PoseChain().then(base)
    with pytest.raises(kr5.InvalidArgument, match="a point has three coordinates or is a FitBlock, found 2 numbers"):
        problem.add(fit.PositionMeasurement(chain, [0.0, 1.0], np.zeros(3), 1e-3))
    with pytest.raises(kr5.InvalidArgument, match=r"standard deviation \[m\] or a covariance, 3 x 3"):
        problem.add(fit.PositionMeasurement(chain, np.zeros(3), np.zeros(3), np.eye(2)))
    with pytest.raises(kr5.InvalidArgument, match="covariance must be positive definite"):
        problem.add(fit.PositionMeasurement(chain, np.zeros(3), np.zeros(3), -np.eye(3)))
    with pytest.raises(kr5.InvalidArgument, match="expected 6"):
        problem.add(fit.PositionMeasurement(fit.PoseChain().then_arm(arm, [0.0]), np.zeros(3), np.zeros(3), 1e-3))
    with pytest.raises(kr5.InvalidArgument, match="no parameter is free"):
        problem.solve()
    with pytest.raises(ValueError, match="4x4"):
        problem.add_pose("other", np.eye(3))
    assert not fit.FitBlock().exists() and base.exists() and not problem.any_free()


def test_poses_count_by_their_covariance_and_a_pose_may_begin_elsewhere():
    poses = fit.Problem()
    block = poses.add_pose("pose", np.eye(4))
    first, second = np.diag([1e-6] * 3 + [1e-4] * 3), np.diag([3e-6] * 3 + [1e-4] * 3)
    chain = fit.PoseChain().then(block)
    moved = np.eye(4)
    moved[0, 3] = 0.4
    poses.add(fit.PoseMeasurement(chain, np.eye(4), first))
    seen = poses.add(fit.PoseMeasurement(chain, moved, np.eye(6)))
    poses.set_covariance(seen, second)
    poses.begin_at(block, moved)
    result = poses.solve()
    assert poses.pose(block)[0, 3] == pytest.approx(0.1, abs=1e-9)
    assert result.covariance[0, 0] == pytest.approx(0.75e-6)
    with pytest.raises(kr5.InvalidArgument, match="positive definite"):
        poses.set_covariance(seen, np.zeros((6, 6)))
