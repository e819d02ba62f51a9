"""Picking from one scan in Python: arrays, keywords, errors. The mathematics is tested in C++."""

import kr5
import numpy as np
import pytest

picking = pytest.importorskip("kr5.picking", reason="this kr5 was built without PCL")

POSE = [[1.0, 0, 0, 0.4], [0, -1.0, 0, 0.1], [0, 0, -1.0, 0.05], [0, 0, 0, 1.0]]


def camera():
    return kr5.Pinhole(width=64, height=48, fx=100.0, fy=100.0, cx=31.5, cy=23.5)


def images(count, seed=0):
    rng = np.random.default_rng(seed)
    scene = 40 + 30 * (np.add.outer(np.arange(48) // 8, np.arange(64) // 8) % 2)
    return [np.uint8(np.clip(np.rint(scene + rng.normal(0, 2, scene.shape)), 0, 255)) for _ in range(count)]


def pellet(**fields):
    frame = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    return picking.Pellet(
        **{
            "centre": [0.0, 0.0, 0.25],
            "axis": frame[:, 2],
            "frame": frame,
            "radius": 0.008,
            "height": 0.015,
            "covariance": 1e-8 * np.eye(7),
            **fields,
        }
    )


def test_what_moved_is_taken_out_of_the_cloud():
    noise = picking.learn_image_noise(images(8))
    assert noise.fit.usable
    assert noise.spread.shape == (48, 64)
    before, after = images(2, seed=1)
    after[16:32, 24:40] += 30
    change = picking.find_changes(before, after, noise, picking.ChangeOptions(min_region=9))
    assert change.usable
    assert change.finding == picking.ChangeFinding.Changed
    assert change.changed.dtype == bool
    assert change.changed.shape == (48, 64)
    points = np.array([[0.0, 0.2, 0.05], [0, 0.1, 0], [0.5, 0.5, 0.5]])
    cloud = picking.Cloud(points=kr5.points_from_columns(points))
    pruned = picking.remove_changed(cloud, change.changed, camera(), np.eye(4))
    assert pruned.removed == 1
    assert np.isnan(pruned.cloud.points[:, 0]).all()
    assert picking.disturbed_pellets([pellet()], change.changed, camera(), np.eye(4)) == [0]


def test_images_that_are_none_are_refused():
    with pytest.raises(ValueError, match="uint8 of shape"):
        picking.learn_image_noise([np.zeros((4, 4, 3), np.uint8)])
    with pytest.raises(TypeError):
        picking.find_changes(np.zeros((4, 4)), np.zeros((4, 4)), picking.learn_image_noise(images(3)))
    with pytest.raises(kr5.InvalidArgument, match="changed: the mask"):
        picking.remove_changed(picking.Cloud(points=np.zeros((3, 1))), np.zeros((2, 2), bool), camera(), np.eye(4))


def test_a_cycle_is_decided_with_its_reason():
    decision = picking.decide_cycle(picking.CycleState(segmented=10, graspable=4, picked=2, disturbed=2))
    assert decision.action == picking.CycleAction.Shake
    assert "20 %" in decision.reason
    with pytest.raises(kr5.InvalidArgument, match="graspable"):
        picking.decide_cycle(picking.CycleState(segmented=1, graspable=2))


def test_a_pellet_is_held_placed_and_made_to_stand():
    held = picking.hold(pellet(), POSE)
    assert held.T_tool_pellet.covariance[0, 0] == pytest.approx(1e-8)
    seats = picking.plan_stack(np.eye(4), picking.StackOptions(rows=2, columns=3, layers=2, posture="lying"))
    assert len(seats) == 9
    placement = picking.place(held, seats[0].T_base_seat, "lying")
    assert placement.possible
    plan = picking.stand_up_steps(held, np.eye(4), np.eye(4))
    assert plan.possible
    assert [step.gripper for step in plan.steps][:4] == [picking.Gripper.Suction] * 3 + [picking.Gripper.Fingers]
    assert picking.regrip_steps(held, np.eye(4), "lying").steps[1].action == picking.GripperAction.Release
    with pytest.raises(kr5.InvalidArgument, match="grip_covariance"):
        picking.hold(pellet(), POSE, grip_covariance=-np.eye(6))


def test_a_refinement_without_edges_returns_the_pellet_as_it_was():
    blank = np.full((48, 64), 40, np.uint8)
    T_camera_base = kr5.UncertainPose(T=np.eye(4), covariance=np.zeros((6, 6)))
    result = picking.refine_pellet(blank, camera(), T_camera_base, pellet(centre=[0, 0, 0.1]))
    assert not result.refined
    assert not result.fit.usable
    assert np.array_equal(result.pellet.centre, [0, 0, 0.1])
    with pytest.raises(kr5.InvalidArgument, match="must have the size"):
        picking.refine_pellet(blank[:20], camera(), T_camera_base, pellet())
