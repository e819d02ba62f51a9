"""A MuJoCo arm with friction that its MJCF lacks: a CSV and the MJCF in, a tuned MJCF out, with which MuJoCo predicts
another motion to the noise."""

import re

import pytest
from scipy import stats

from arm_logs import QUICK, case_logs, causes

pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'kr5[mujoco]'")

import mujoco_logs

CHANCE = 1e-6  # with which noise alone exceeds the limit


@pytest.mark.parametrize(
    "effect",
    [
        mujoco_logs.Effect("coulomb_friction", 2, 4.0),
        mujoco_logs.Effect("rotor_inertia", 1, 0.8),
        mujoco_logs.Effect("link_mass", 2, 1.5),
        mujoco_logs.Effect("link_com", 1, 0.05),
    ],
    ids=lambda effect: effect.effect,
)
def test_a_tuned_mjcf_predicts_another_motion_to_the_noise(tmp_path, diagnose, effect):
    true = mujoco_logs.model_xml(effect)
    (tmp_path / "nominal.xml").write_text(mujoco_logs.model_xml())
    case_logs.write_csv(tmp_path / "log.csv", mujoco_logs.simulated_log(true, seed=21).columns(seed=21))
    code, said, data = diagnose("log.csv", "--model", "nominal.xml", "--write-model", "tuned.xml", *QUICK)
    assert code == 0, said
    target = f"joint{effect.joint + 1}"
    assert causes(data) == [(effect.effect, target)], said
    assert "match the motion best" not in said  # the clocks agree
    assert data["causes"][0]["joint"] == mujoco_logs.JOINTS[effect.joint]
    fresh = mujoco_logs.simulated_log(true, seed=22)
    limit = (stats.chi2.ppf(1 - CHANCE, fresh.torque.size) / fresh.torque.size) ** 0.5
    assert limit < 1.05
    assert mujoco_logs.prediction_gap(tmp_path / "tuned.xml", fresh) < limit
    assert mujoco_logs.prediction_gap(tmp_path / "nominal.xml", fresh) > 1.1


def logged(effect=None, late=0, still=None, offset=0.0, seed=31, rows=1500):
    """Columns of an arm with an effect: torques so many rows late, a joint that holds its place, with a constant torque
    beside what it bears."""
    log = mujoco_logs.simulated_log(mujoco_logs.model_xml(effect), seed, still=still)
    columns = log.columns(seed)
    if still is not None:
        columns[f"{mujoco_logs.JOINTS[still]}_torque"] += offset
    for name in columns:
        columns[name] = (
            columns[name][late:] if not name.endswith("_torque") else columns[name][: len(columns[name]) - late]
        )
    return {name: values[:rows] for name, values in columns.items()}


def test_torques_that_are_two_rows_late_are_told_behind_the_friction_beside_them(tmp_path, diagnose):
    effect = mujoco_logs.Effect("viscous_friction", 1, 6.0)
    (tmp_path / "nominal.xml").write_text(mujoco_logs.model_xml())
    case_logs.write_csv(tmp_path / "log.csv", logged(effect, late=2))
    code, said, data = diagnose("log.csv", "--model", "nominal.xml", *QUICK)
    assert code == 0, said
    assert causes(data) == [("viscous_friction", "joint2")], said
    step = mujoco_logs.STEP * mujoco_logs.LOGGED
    told = re.search(r"The joint torques were logged ([\d.]+) ± ([\d.]+) ms late", said)
    assert said.index("viscous friction of joint 2") < said.index("The joint torques were logged")
    # MuJoCo's torque of a step acts until the next one, which is another millisecond.
    assert told and abs(float(told[1]) / 1e3 - 2 * step) < step / 2, said
    assert f"--set columns.tau.delay={float(told[1]) / 1e3:.3g}" in said


def test_a_constant_torque_at_a_joint_at_rest_is_no_spring(tmp_path, diagnose):
    (tmp_path / "nominal.xml").write_text(mujoco_logs.model_xml())
    case_logs.write_csv(tmp_path / "log.csv", logged(still=2, offset=3.0))
    code, said, data = diagnose("log.csv", "--model", "nominal.xml", *QUICK)
    assert code == 0, said
    assert (data["verdict"], causes(data)) == ("unknown", []), said
    assert "constant offset" in said and "torque of joint 3" in said


def test_reversals_that_a_smoothed_motion_rounds_off_are_no_elasticity(tmp_path, diagnose):
    (tmp_path / "nominal.xml").write_text(mujoco_logs.model_xml())
    case_logs.write_csv(tmp_path / "log.csv", logged(mujoco_logs.Effect("coulomb_friction", 2, 4.0), seed=61))
    several = ["--max-effects", "2", "--refits", "4", "--beam", "1"]
    code, said, data = diagnose("log.csv", "--model", "nominal.xml", *several)
    assert code == 0, said
    assert causes(data) == [("coulomb_friction", "joint3")], said
