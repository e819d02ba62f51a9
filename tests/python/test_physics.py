"""The bindings of kr5.physics; its laws are tested in C++."""

import kr5
import kr5.cell
import kr5.physics
import numpy as np
import pytest


@pytest.fixture
def cell(share):
    return kr5.cell.load_cell(share / "cells/kr5_arc.yaml")


def test_the_effective_chain_is_the_nominal_one_without_effects_and_grows_with_them(cell):
    q = np.array([0.1, 0.2, -2.7, 0.0, -0.3, 1.5])
    assert np.array_equal(kr5.physics.effective_chain(cell).flange(q), cell.nominal_chain().flange(q))
    cell.effects = kr5.cell.Effects({"thermal_growth": {"links": {"growth": 2e-3, "time_constant": 10.0}}})
    grown = kr5.physics.effective_chain(cell, t=1e6).flange(q)[:3, 3]
    assert np.allclose(grown, 1.002 * cell.nominal_chain().flange(q)[:3, 3], atol=1e-12)


def test_friction_of_a_joint_takes_arrays(cell):
    speed = np.array([-0.5, 0.0, 0.5])
    friction = kr5.physics.joint_friction(cell, 1, speed, np.zeros(3), np.zeros(3))
    level = cell.drives.friction.coulomb[1] + 0.5 * cell.drives.friction.viscous[1]
    assert np.allclose(friction, [-level, 0.0, level])
    with pytest.raises(kr5.InvalidArgument, match="joint: expected 0 to 5, found 6"):
        kr5.physics.joint_friction(cell, 6, speed, speed, speed)


def test_friction_that_depends_on_the_angle_asks_for_positions(cell):
    speed = np.array([-0.5, 0.5])
    bare = kr5.physics.joint_friction(cell, 1, speed, np.zeros(2), np.zeros(2))
    cell.effects = {"angle_friction": {"joint2": {"amplitude": 3.0, "cycles": 2, "phase": 0.1}}}
    position = np.array([0.3, -0.9])
    friction = kr5.physics.joint_friction(cell, 1, speed, np.zeros(2), np.zeros(2), position=position)
    assert np.allclose(friction - bare, 3.0 * np.sin(2 * position + 0.1) * np.sign(speed), atol=1e-12)
    with pytest.raises(kr5.InvalidArgument, match="position: expected a value for each speed"):
        kr5.physics.joint_friction(cell, 1, speed, np.zeros(2), np.zeros(2))


def test_motor_currents_are_torques_over_gears_and_constants(cell):
    torque = np.zeros((2, 6))
    torque[:, 0] = 10.0
    current = kr5.physics.motor_currents(cell, np.zeros((2, 6)), torque)
    assert current.shape == (2, 6)
    assert current[0, 0] == pytest.approx(10.0 / cell.drives.structure[0, 0] / cell.drives.torque_constant[0])
    with pytest.raises(kr5.InvalidArgument, match="a column a joint"):
        kr5.physics.motor_currents(cell, np.zeros((2, 5)), np.zeros((2, 5)))


def test_weight_of_the_tool_and_transition_of_a_servo(cell):
    weight = kr5.physics.tool_weight(cell, rows=3)
    assert weight.shape == (3, 6)
    assert weight[2, 2] == pytest.approx(cell.tool.mass * np.linalg.norm(cell.robot.gravity))
    assert np.allclose(kr5.physics.servo_transition(cell.servo.tool, 0.0), np.eye(2))
