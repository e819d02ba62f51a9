"""The Python surface of kr5.robot: a loop of readings and commands over a loopback robot; the rest is tested in C++."""

import json

import kr5
import numpy as np
import pytest
from kr5 import cell, force, robot


def test_a_force_is_reached_over_a_loopback_robot():
    stiffness, wish = 23.38e3, 12.0
    loop = robot.LoopbackRobot(robot.LoopbackOptions(force_noise=0.05, seed=3))

    def press(T_base_tool):
        return [0.0, 0.0, max(0.0, -stiffness * T_base_tool[2, 3]), 0.0, 0.0, 0.0]

    loop.set_environment(press)
    control = force.AxisForceControl(force.AxisForceOptions(axis=[0, 0, -1], frame="base"))
    felt = []
    for _ in range(1000):
        reading = loop.read()
        command = control.step(reading, wish)
        loop.send(command)
        felt.append(control.measured(reading))
    assert np.mean(felt[-100:]) == pytest.approx(wish, abs=0.1)
    assert loop.T_base_tool[2, 3] == pytest.approx(-wish / stiffness, rel=0.02)
    assert reading.time == pytest.approx(999 * robot.usual_cycle)


def test_a_cell_says_how_its_sensors_become_a_reading(share):
    arc = cell.load_cell(share / "cells/kr5_arc.yaml")
    model = arc.sensor_model()
    q = np.array([0.2, 0.4, -2.2, 0.1, -0.9, 0.3])
    wrench = np.array([3.0, -4.0, 12.0, 0.2, 0.5, -0.1])
    sensor = robot.sensed_wrench(model, arc.flange(q), wrench)
    reading = robot.robot_reading(model, robot.SensorValues(joints=q, sensor=sensor, time=1.5))
    np.testing.assert_allclose(reading.wrench, wrench, atol=1e-12)
    np.testing.assert_allclose(reading.T_base_tool, arc.T_base_tool(q), atol=1e-14)
    np.testing.assert_array_equal(reading.joints, q)
    arm = robot.LoopbackRobot(model=model)
    arm.place_joints(q)
    np.testing.assert_allclose(arm.read().T_base_tool, arc.T_base_tool(q), atol=1e-14)


def test_readings_and_commands_are_plain_values():
    command = robot.RobotCommand(space="joints", mode="relative", joints=[0.1, 0.2], limits={"joint": 0.15})
    assert robot.RobotCommand.from_dict(json.loads(json.dumps(command.to_dict()))).to_dict() == command.to_dict()
    np.testing.assert_allclose(robot.commanded_joints(command, [1.0, 1.0]), [1.1, 1.15])
    with pytest.raises(kr5.InvalidArgument, match="joints"):
        robot.RobotReading(joints=np.zeros(robot.max_joints + 1))
