"""What a joint of a MuJoCo arm does beside what its MJCF holds, computed anew in every step of MuJoCo: dead band, drag
that grows with the square of the speed, dry friction that depends on angle or load, and what no effect describes."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

StepForce = Callable[[Any, Any, Any], None]  # changes model and data of MuJoCo before a step; last the model as stated


def step(model: Any, data: Any, stated: Any, forces: Sequence[StepForce]) -> None:
    """One step of MuJoCo under forces. stated: another copy of the model, which no force has changed."""
    import mujoco

    model.dof_frictionloss[:] = stated.dof_frictionloss
    data.qfrc_applied[:] = 0.0
    for force in forces:
        force(model, data, stated)
    mujoco.mj_step(model, data)


def dead_band(joint: int, width: float) -> StepForce:
    """A position servo that gives no torque for an error below `width` [rad]."""

    def act(model: Any, data: Any, stated: Any) -> None:
        error = data.ctrl[joint] - data.qpos[joint]
        data.ctrl[joint] = data.qpos[joint] + np.sign(error) * max(abs(error) - width, 0.0)

    return act


def quadratic_drag(joint: int, coefficient: float) -> StepForce:
    """Drag of `coefficient` [N m s^2/rad^2] times the square of the speed."""

    def act(model: Any, data: Any, stated: Any) -> None:
        data.qfrc_applied[joint] -= coefficient * abs(data.qvel[joint]) * data.qvel[joint]

    return act


def angle_friction(joint: int, amplitude: float, cycles: float, phase: float) -> StepForce:
    """Dry friction with a part that is periodic in the angle, of `amplitude` [N m]."""

    def act(model: Any, data: Any, stated: Any) -> None:
        level = model.dof_frictionloss[joint] + amplitude * np.sin(cycles * data.qpos[joint] + phase)
        model.dof_frictionloss[joint] = max(level, 0.0)

    return act


def load_friction(joint: int, coefficient: float) -> StepForce:
    """Dry friction with a part in proportion to the torque that the gear transmits to the link."""

    def act(model: Any, data: Any, stated: Any) -> None:
        motor = data.qfrc_actuator[joint] + data.qfrc_passive[joint] + data.qfrc_constraint[joint]
        transmitted = motor - model.dof_armature[joint] * data.qacc[joint]
        model.dof_frictionloss[joint] += coefficient * abs(transmitted)

    return act


# Outside the catalogue of effects


def fading_servo(joint: int, share: float, time: float) -> StepForce:
    """A servo that loses a share of its stiffness, with a time constant [s], as a supply runs down."""

    def act(model: Any, data: Any, stated: Any) -> None:
        now = stated.actuator_gainprm[joint, 0] * (1.0 - share * (1.0 - np.exp(-data.time / time)))
        model.actuator_gainprm[joint, 0], model.actuator_biasprm[joint, 1] = now, -now

    return act


def beating_torque(joint: int, torque: float, frequency: float) -> StepForce:
    """A torque [N m] that swings in time [Hz], wherever the joint stands: a resonance of what carries the arm."""

    def act(model: Any, data: Any, stated: Any) -> None:
        data.qfrc_applied[joint] += torque * np.sin(2 * np.pi * frequency * data.time)

    return act
