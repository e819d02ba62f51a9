"""The Python surface of kr5.force; the geometry is tested in C++."""

import math

import kr5
import numpy as np
import pytest
from kr5 import force, robot

BOOK = force.PegTube(peg_radius=9.42e-3, inner_radius=9.7e-3, outer_radius=12.65e-3)
TILT = math.radians(7.5)


def test_heights_broadcast_and_are_those_of_the_single_call():
    alpha = np.linspace(0, 2 * np.pi, 5)
    heights = force.resting_heights(BOOK, TILT, alpha[:, None], np.array([-7.53e-3, 1.5e-3]), -7.2e-3)
    assert heights.shape == (5, 2)
    rest = force.rest_peg_on_tube(BOOK, TILT, alpha[1], [1.5e-3, -7.2e-3])
    assert heights[1, 1] == rest.height
    raised = force.resting_heights(
        BOOK, TILT, alpha, 0.008, 0.0, T_tube_actual=kr5.from_xyzrpy(np.array([0, 0, 0.1, 0, 0, 0]))
    )
    np.testing.assert_allclose(raised, force.resting_heights(BOOK, TILT, alpha, 0.008, 0.0) + 0.1, atol=1e-14)


def test_nothing_carries_a_peg_in_the_bore():
    assert str(force.rest_peg_on_tube(BOOK, 0.0, 0.0, [0, 0]).kind) == "none"
    assert math.isnan(force.resting_heights(BOOK, 0.0, 0.0, 0.0, 0.0))


def test_radii_that_cannot_be_are_named():
    with pytest.raises(kr5.InvalidArgument, match="outer_radius"):
        force.rest_peg_on_tube(force.PegTube(peg_radius=1, inner_radius=2, outer_radius=1), 0.1, 0, [0, 0])
    with pytest.raises(kr5.InvalidArgument, match="peg_length"):
        force.peg_tube_contacts(force.PegTubeShape(peg_radius=1), np.eye(4))


def test_contacts_give_a_wrench_and_keep_stiction():
    shape = force.PegTubeShape(
        peg_radius=9.42e-3, peg_length=0.05, inner_radius=9.7e-3, outer_radius=12.65e-3, tube_depth=0.06
    )
    T = np.eye(4)
    T[:3, 3] = [8e-3, 0, -1e-5]
    contacts = force.peg_tube_contacts(shape, T)
    stiction = force.Stiction()
    result = force.contact_wrench(contacts, force.ContactLaw(), T, [1e-3, 0, 0, 0, 0, 0], 1e-3, stiction)
    assert result.normal == pytest.approx(10)
    assert stiction.slip[0] == pytest.approx(1e-6)
    assert result.wrench[0] < 0
    bench = force.peg_bench_contacts(shape, T)
    assert len(bench) == 24 and bench[0].depth == pytest.approx(1e-5)


def test_minima_profile_and_direction_of_the_book():
    centre = [-7.53e-3, -7.2e-3]
    hole, outer = force.depth_minima(BOOK, TILT, centre)
    assert hole.cusp and not outer.cusp
    assert math.degrees(hole.azimuth) + 90 == pytest.approx(133.72, abs=0.005)
    assert force.critical_offset(BOOK, TILT) == pytest.approx(8.650e-3, abs=5e-7)
    azimuth = np.linspace(0, 2 * np.pi, 90, endpoint=False)
    fit = force.fit_tube(BOOK, TILT, azimuth, force.resting_heights(BOOK, TILT, azimuth, *centre))
    np.testing.assert_allclose(fit.centre, centre, atol=1e-8)
    assert str(fit.report.status) == "converged"
    rows = [force.TurnRow(azimuth=a, force=0.0) for a in azimuth]
    assert force.locate_by_moment(rows).report.to_dict()["status"] != "converged"


def test_control_loops_step_from_python():
    loop = force.ForceLoop(force.ForceLoopOptions(gain=5e-6))
    assert loop.step(20.0, 0.0) == pytest.approx(5e-6 * 20.0 * force.ForceLoopOptions(gain=5e-6).compensator())
    move = force.GuardedMove()
    assert move.step(0.1, 0.0) > 0 and move.step(0.1, 5.0) == 0 and move.touched
    twist = force.admittance_twist(np.array([10.0, 0, 0, 0, 0, 1.0]), np.zeros(6))
    assert twist[0] > 0 and twist[5] > 0
    stop = force.SafetyStop(force.SafetyLimits(current=[1.0, 1.0]))
    assert str(stop.step(np.ones(6), np.ones(6), [0.5, -1.5])) == "current"
    assert str(stop.step(np.ones(6), np.ones(6))) == "current"  # latched
    np.testing.assert_allclose(force.current_limits([2.0], [0.5]), [2.75])
    conditioner = force.WrenchConditioner(force.WrenchConditionerOptions(mass=2.0))
    np.testing.assert_allclose(conditioner.step(conditioner.weight(np.eye(3)), np.eye(3)), np.zeros(6), atol=1e-12)


def test_an_insertion_steps_from_python_and_says_what_stopped_it():
    insertion = force.Insertion(force.InsertionOptions(bodies=BOOK, tilt=0.26))
    pose = np.eye(4)
    pose[2, 3] = 0.02
    random = np.random.default_rng(1)
    for _ in range(30):
        noise = random.normal(0, 0.1, 6)
        reading = robot.RobotReading(T_base_tool=pose, sensor=noise, wrench=noise)
        command = insertion.step(reading)
        pose = np.array(command.tool)
    assert str(command.space) == "tool" and str(command.mode) == "absolute"
    assert str(insertion.state.phase) == "approach" and not command.stop and command.gripper.hold
    reading.status.gripped = False
    assert insertion.step(reading).stop
    assert (
        insertion.finished
        and str(insertion.state.reason) == "peg_lost"
        and str(insertion.state.stopped_in) == "approach"
    )
    assert insertion.profile == []
    insertion.restart()
    assert not insertion.finished
    with pytest.raises(kr5.InvalidArgument, match="tilt"):
        force.Insertion(force.InsertionOptions(bodies=BOOK, tilt=0.0))
    wide = force.Insertion(
        force.InsertionOptions(bodies=force.PegTube(peg_radius=9.8e-3, inner_radius=9.7e-3, outer_radius=12.65e-3))
    )
    assert wide.finished and str(wide.state.reason) == "peg_too_wide"
