"""Motions of an arm in MuJoCo, under the commands of a log."""

import contextlib
import copy
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

import kr5
import kr5.cell
from kr5.models.mjcf_actuators import AS_FOUND, Actuator, DryFriction, position_servo
from kr5.models.mjcf_loading import load_mjcf

MOST_STEPS = 20000  # that are kept in memory at once


@dataclass
class CommandedMotion:
    """Commands of a log, and how they act."""

    t: np.ndarray  # rising [s]
    command: np.ndarray  # rows x joints [rad or m]
    start: np.ndarray  # joint values of the first row, at rest [rad or m]
    delays: list[float] = field(default_factory=list)  # of each joint [s]; empty: none
    straight: list[bool] = field(default_factory=list)  # whether it runs straight between its rows; empty: held


def mean_commands(motion: CommandedMotion, edges: np.ndarray) -> np.ndarray:
    """The means of the delayed commands between neighbouring edges [s], a row each."""
    out = np.empty((len(edges) - 1, motion.command.shape[1]))
    for j, values in enumerate(motion.command.T):
        delay = motion.delays[j] if motion.delays else 0.0
        straight = bool(motion.straight and motion.straight[j])
        out[:, j] = np.diff(_integral(motion.t, values, straight, edges - delay)) / np.diff(edges)
    return out


def _integral(t: np.ndarray, values: np.ndarray, straight: bool, at: np.ndarray) -> np.ndarray:
    """Integral of a command from its first row to other times; before and behind its rows it holds."""
    step = np.diff(t)
    slope = np.append(np.diff(values) / step, 0.0) if straight else np.zeros(len(t))
    sums = np.concatenate([[0.0], np.cumsum(values[:-1] * step + 0.5 * slope[:-1] * step**2)])
    row = np.clip(np.searchsorted(t, at, side="right") - 1, 0, len(t) - 1)
    s = at - t[row]
    return np.asarray(sums[row] + values[row] * s + 0.5 * np.where(s > 0.0, slope[row], 0.0) * s**2)


@contextlib.contextmanager
def _heard(mujoco: ModuleType) -> Iterator[list[str]]:
    """Warnings of MuJoCo, which it prints and writes to a file of the current folder otherwise."""
    before, out = mujoco.get_mju_user_warning(), list[str]()
    mujoco.set_mju_user_warning(out.append)
    try:
        yield out
    finally:
        mujoco.set_mju_user_warning(before)


class MujocoArm:
    """The arm of an MJCF whose joints have position servos. Other joints are held by servos of theirs, where they have
    some, as the model begins."""

    def __init__(self, file: Path, base: str = "", tip: str = "") -> None:
        arm = load_mjcf(file, base, tip)
        import mujoco
        from mujoco import rollout

        self.mujoco, self.roll = mujoco, rollout.rollout
        self.model, self.data, self.names = arm.model, arm.data, arm.names
        self.joints = arm.joints
        self.servos = [self._servo(file, joint) for joint in arm.joints]
        self.qpos = [int(arm.model.jnt_qposadr[joint]) for joint in arm.joints]
        self.dofs = [int(arm.model.jnt_dofadr[joint]) for joint in arm.joints]
        self.slides = [arm.slides(joint) for joint in arm.joints]
        self.unstable = False  # whether MuJoCo has warned that a motion grows beyond all bounds

    def _servo(self, file: Path, joint: int) -> Actuator:
        servo = position_servo(self.model, joint)
        if servo is None:
            name = self.model.joint(joint).name
            raise kr5.IoError(f"{file}: joint {name} has no position servo of its own, by which MuJoCo could move it")
        return servo

    @property
    def rubs(self) -> bool:
        """Whether a joint has dry friction."""
        return bool(np.any(self.model.dof_frictionloss[self.dofs]))

    @property
    def step(self) -> float:
        return float(self.model.opt.timestep)

    def positions(self, motion: CommandedMotion, frictions: Sequence[DryFriction] = (AS_FOUND,)) -> np.ndarray:
        """The joint values in the rows of a motion [rad or m]: frictions x rows x joints."""
        h = self.step
        steps = max(1, int(np.ceil((motion.t[-1] - motion.t[0]) / h - 1e-9)))
        edges = motion.t[0] + h * np.arange(steps + 1)
        control = self._controls(motion, edges)
        models = [self._changed(friction) for friction in frictions]
        state = np.repeat(self._initial_state(motion)[None, :], len(models), axis=0)
        data = [self.mujoco.MjData(self.model) for _ in range(min(len(models), os.cpu_count() or 1))]
        visited = [np.repeat(motion.start[None, None, :], len(models), axis=0)]
        for first in range(0, steps, MOST_STEPS):
            part = control[None, first : first + MOST_STEPS]
            with _heard(self.mujoco) as warnings:
                states, _ = self.roll(models, data, state, np.ascontiguousarray(part))
            self.unstable |= bool(warnings)
            state = np.ascontiguousarray(states[:, -1])
            visited.append(states[:, :, 1 + np.array(self.qpos)].copy())  # behind the time
        q = np.concatenate(visited, axis=1)
        return np.array([[np.interp(motion.t, edges, x) for x in one.T] for one in q]).transpose(0, 2, 1)

    def _controls(self, motion: CommandedMotion, edges: np.ndarray) -> np.ndarray:
        out = np.zeros((len(edges) - 1, self.model.nu))
        for joint in range(self.model.njnt):
            if joint not in self.joints and (servo := position_servo(self.model, joint)) is not None:
                out[:, servo.number] = servo.gear * self.model.qpos0[self.model.jnt_qposadr[joint]]
        means = mean_commands(motion, edges)
        for j, servo in enumerate(self.servos):
            out[:, servo.number] = servo.gear * means[:, j]
        return out

    def _initial_state(self, motion: CommandedMotion) -> np.ndarray:
        data, kind = self.mujoco.MjData(self.model), self.mujoco.mjtState.mjSTATE_FULLPHYSICS
        data.qpos[:] = self.data.qpos
        data.qpos[self.qpos] = motion.start
        state = np.empty(self.mujoco.mj_stateSize(self.model, kind))
        self.mujoco.mj_getState(self.model, data, state, kind)
        return state

    def _changed(self, friction: DryFriction) -> Any:
        if friction == AS_FOUND:
            return self.model
        out = copy.deepcopy(self.model)
        out.dof_frictionloss[self.dofs] *= friction.scale
        if friction.time_constant is not None:
            out.dof_solref[self.dofs] = [friction.time_constant, 1.0]
        if friction.impedance is not None:
            out.dof_solimp[self.dofs, :2] = friction.impedance
        return out


def commands_of(cell: kr5.cell.Cell, t: np.ndarray, command: np.ndarray, start: np.ndarray) -> CommandedMotion:
    """Commands as the torque servos of a cell get them, its effects apart."""
    servos = [cell.servo.torque_of(k) for k in range(cell.robot.joints)] if cell.servo is not None else []
    straight = [str(servo.hold) == "straight" for servo in servos]
    return CommandedMotion(t, command, start, [servo.delay for servo in servos], straight)
