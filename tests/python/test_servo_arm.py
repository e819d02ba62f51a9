"""Arms under torque servos: kr5 beside MuJoCo, whose steps are halved to show what of the difference is theirs."""

import numpy as np
import pytest

from arm_logs import ROOT  # noqa: F401  puts the benches on the path

pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'kr5[mujoco]'")

import kr5.cell
import kr5.io
import kr5.predict
from kr5.models import read_model
from kr5.models.mujoco_motion import CommandedMotion, MujocoArm, mean_commands

import servo_logs

RATE = 100.0  # [1/s] of the commands
DURATION = 6.0  # [s]
ARMS = {21: "zy", 22: "zyyx", 23: "zyyxyx"}  # axes by seed


def drawn(seed, friction):
    random = np.random.default_rng([31, seed])
    arm = servo_logs.drawn_arm(random, ARMS[seed])
    for joint in arm.joints:
        joint.coulomb *= friction
    return arm, servo_logs.planned(random, len(arm.joints), DURATION, RATE)


def in_mujoco(folder, arm, command, step, solver=""):
    file = folder / "arm.xml"
    file.write_text(arm.xml(step=step, solver=solver))
    t = np.arange(len(command)) / RATE
    return MujocoArm(file).positions(CommandedMotion(t, command, command[0]))[0]


def in_kr5(folder, arm, command):
    file = folder / "arm.xml"
    file.write_text(arm.xml())
    n = command.shape[1]
    e = kr5.cell.Experiment(name="m", kind="motion", file="m.csv", split="fit")
    t = np.arange(len(command)) / RATE
    e.data = kr5.io.Table(["t", *(f"qc{k + 1}" for k in range(n))], np.column_stack([t, command]))
    shown = kr5.predict.FastSimulator().predict(read_model(file).cell, e)
    return np.column_stack([shown[f"q{k + 1}"] for k in range(n)])


def greatest(difference):
    return float(np.abs(difference).max())


def rms(difference):
    return float(np.sqrt(np.mean(difference**2)))


@pytest.mark.parametrize("seed", ARMS)
def test_without_dry_friction_the_difference_to_mujoco_is_that_of_its_steps(tmp_path, seed):
    arm, command = drawn(seed, 0.0)
    ours = in_kr5(tmp_path, arm, command)
    coarse, fine = (in_mujoco(tmp_path, arm, command, step) for step in (5e-4, 2.5e-4))
    # MuJoCo's steps are of first order: half the step is half the error, and both together tell where it ends.
    assert greatest(coarse - ours) / greatest(fine - ours) == pytest.approx(2.0, abs=0.3)
    assert greatest(2 * fine - coarse - ours) < 1e-4


@pytest.mark.parametrize("seed", ARMS)
def test_dry_friction_of_mujoco_is_that_of_kr5_once_it_is_made_stiff(tmp_path, seed):
    arm, command = drawn(seed, 1.0)
    ours = in_kr5(tmp_path, arm, command)
    stiff = ' solreffriction="0.002 1" solimpfriction="0.999 0.999"'
    soft, hard = (rms(in_mujoco(tmp_path, arm, command, 2.5e-4, solver) - ours) for solver in ("", stiff))
    assert hard < servo_logs.NOISE < 1e-3  # of an encoder
    assert soft > 2 * hard


@pytest.mark.parametrize("straight", [False, True])
def test_means_of_commands_are_those_of_a_fine_sum(straight):
    random = np.random.default_rng(5)
    t, command = np.cumsum(random.uniform(0.01, 0.03, 40)), random.uniform(-1, 1, (40, 2))
    motion = CommandedMotion(t, command, command[0], [0.0, 0.0137], [straight, straight])
    edges = np.linspace(t[0] - 0.05, t[-1] + 0.05, 61)
    means = mean_commands(motion, edges)
    for j, delay in enumerate(motion.delays):
        for k in range(60):
            at = np.linspace(edges[k], edges[k + 1], 20001)[:-1] + (edges[1] - edges[0]) / 40000 - delay
            rows = np.clip(np.searchsorted(t, at, side="right") - 1, 0, 39)
            values = np.interp(at, t, command[:, j]) if straight else command[rows, j]
            assert means[k, j] == pytest.approx(values.mean(), abs=1e-3 if not straight else 1e-6)
