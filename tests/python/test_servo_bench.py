"""The drawn arms and the published models of the bench of servos: what they are made of does what it says."""

import json

import kr5.cell
import numpy as np
import pytest
from kr5.models.reading import read_model

from arm_logs import case_logs  # noqa: F401  puts the benches on the path

pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'kr5[mujoco]'")

import gap_command
import published_servo
import servo_forces
import servo_logs
import servos_public

RATE = 50.0


def drawn(seed):
    random = np.random.default_rng(seed)
    return random, servo_logs.drawn_arm(random, "zyy"), servo_logs.planned(random, 3, 12.0, RATE)


@pytest.mark.parametrize("kind", [*servo_logs.KINDS, *servo_logs.OUTSIDE])
def test_what_an_arm_has_shows_in_its_log(kind):
    random, arm, command = drawn(5)
    true, effect = servo_logs.with_effect(arm, kind, random, command, RATE)
    sound, log = (servo_logs.simulated_log(a.xml(), command, RATE, a.delay, a.forces) for a in (arm, true))
    assert effect.effect == kind
    assert np.sqrt(np.mean((log.q - sound.q) ** 2)) > 0.5 * servo_logs.NOISE
    assert (true.xml() != arm.xml()) == (kind in servo_logs.IN_MJCF and kind != "joint_delay")


@pytest.mark.parametrize(
    ("force", "tau"),
    [
        (servo_forces.quadratic_drag(1, 0.3), lambda q, v: -0.3 * abs(v) * v),
        (servo_forces.beating_torque(1, 0.2, 0.25), lambda q, v: 0.2),  # a quarter of its period
    ],
)
def test_forces_are_those_of_their_laws(force, tau):
    import mujoco

    _, arm, _ = drawn(6)
    model = mujoco.MjModel.from_xml_string(arm.xml())
    data = mujoco.MjData(model)
    data.time, data.qvel[1] = 1.0, -1.5
    servo_forces.step(model, data, model, [force])
    assert data.qfrc_applied[1] == pytest.approx(tau(0.0, -1.5))


def test_friction_that_depends_on_the_angle_is_never_below_none():
    import mujoco

    _, arm, _ = drawn(7)
    stated, model = (mujoco.MjModel.from_xml_string(arm.xml()) for _ in (0, 1))
    data = mujoco.MjData(model)
    dry, levels = stated.dof_frictionloss[1], []
    for angle in np.linspace(-np.pi, np.pi, 50):
        data.qpos[1] = angle
        servo_forces.step(model, data, stated, [servo_forces.angle_friction(1, 2 * dry, 3.0, 0.4)])
        levels.append((angle, model.dof_frictionloss[1]))
    found = np.array(levels)
    assert found[:, 1] == pytest.approx(np.maximum(dry + 2 * dry * np.sin(3 * found[:, 0] + 0.4), 0.0))
    assert found[:, 1].min() == 0.0 and stated.dof_frictionloss[1] == dry


def test_friction_that_grows_with_the_load_holds_a_share_of_what_the_gear_bears():
    _, arm, command = drawn(8)
    still = np.zeros_like(command)
    log = servo_logs.simulated_log(arm.xml(), still, RATE, forces=[servo_forces.load_friction(1, 0.3)])
    sound = servo_logs.simulated_log(arm.xml(), still, RATE)
    held, free = (one.torque[-1, 1] for one in (log, sound))
    assert abs(held) < abs(free)  # friction bears a part of the weight at rest


def test_the_published_models_of_a_servo_follow_its_logs(reference):
    folder = reference / servos_public.PENDULUM
    if not folder.is_dir():
        pytest.skip(f"no public data: {folder}")
    for servo in published_servo.XL330:
        errors = np.concatenate([published_servo.mean_errors(servo, file) for file in folder.glob("*.json")])
        assert errors.mean() < 0.0701  # what older parameters of both models leave, by the README of the data


def test_the_so101_is_diagnosed_from_two_models_that_disagree(reference, tmp_path):
    folder = reference / servos_public.SO101
    if not folder.is_dir():
        pytest.skip(f"no public data: {folder}")
    gains = []
    for text in servos_public.nominal_models(folder).values():
        (tmp_path / "arm.xml").write_text(text)
        gains.append(read_model(tmp_path / "arm.xml").cell.servo.torque_of(0).stiffness)
    assert gains == [998.22, 17.8]


def test_the_so101_is_judged_by_the_motions_that_were_kept(reference, monkeypatch):
    """A diagnosis that ends, from either model, at the one of 17.8 N m/rad with a softer servo."""
    folder = reference / servos_public.SO101
    if not folder.is_dir():
        pytest.skip(f"no public data: {folder}")
    asked = []

    def answered(command, place, *words):
        asked.append(words)
        text = servos_public.nominal_models(folder)["kp 17.8"]
        (place / "tuned.xml").write_text(text)
        kr5.cell.save_cell(read_model(place / "tuned.xml").cell, place / "tuned.yaml")
        named = ("servo_stiffness", "stiffness", 17.8), ("coulomb_friction", "coulomb", 0.052)
        causes = [
            {"effect": e, "target": "joint2", "parameters": {p: {"value": v, "std": 0.1 * v}}} for e, p, v in named
        ]
        return gap_command.Answer(0, {"verdict": "explained", "causes": causes}, "", 1.0, 0.5)

    monkeypatch.setattr(servos_public, "run_gap", answered)
    rows = servos_public.so101_rows(folder, 3)
    assert all(words[words.index("--check") + 1] == "backlash_detection,chirp_sweep" for words in asked)
    *errors, agreement = rows
    assert len(errors) == 4 and agreement.reached and agreement.ours == "12 of 12"
    for error, causes in zip(errors[::2], errors[1::2], strict=True):
        assert causes.reached and not error.reached  # no better than the better nominal model, which it is
        assert " 1.00 times lower" in error.ours


def test_motors_that_are_off_are_no_part_of_the_published_models(tmp_path):
    t = 0.005 * np.arange(200)
    entries = [{"timestamp": a, "position": 0.0, "goal_position": 0.0, "torque_enable": a < 0.5} for a in t.tolist()]
    log = {"mass": 0.49, "length": 0.1, "kp": 400, "vin": 7.4, "entries": entries}
    (tmp_path / "log.json").write_text(json.dumps(log))
    assert len(published_servo.mean_errors(published_servo.XL330[0], tmp_path / "log.json")) == 100
