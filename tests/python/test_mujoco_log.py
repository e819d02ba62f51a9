"""A MuJoCo arm with friction that its MJCF lacks: a CSV and the MJCF in, a tuned MJCF out, with which MuJoCo predicts
another motion to the noise."""

import pytest
from scipy import stats

from arm_logs import QUICK, case_logs, causes

pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'kr5[mujoco]'")

import mujoco_logs

CHANCE = 1e-6  # with which noise alone exceeds the limit


@pytest.mark.parametrize(
    "effect",
    [mujoco_logs.Effect("coulomb_friction", 2, 4.0), mujoco_logs.Effect("rotor_inertia", 1, 0.8)],
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
    assert data["causes"][0]["joint"] == mujoco_logs.JOINTS[effect.joint]
    fresh = mujoco_logs.simulated_log(true, seed=22)
    limit = (stats.chi2.ppf(1 - CHANCE, fresh.torque.size) / fresh.torque.size) ** 0.5
    assert limit < 1.05
    assert mujoco_logs.prediction_gap(tmp_path / "tuned.xml", fresh) < limit
    assert mujoco_logs.prediction_gap(tmp_path / "nominal.xml", fresh) > 1.1
