"""MuJoCo confirms a model that a diagnosis wrote: commands and rounded positions of a MuJoCo arm in, an XML out that
MuJoCo moves as the arm moved."""

import json

import numpy as np
import pytest

from arm_logs import QUICK, case_logs, causes

pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'kr5[mujoco]'")

from kr5.models.mjcf_actuators import DryFriction
from kr5.models.mujoco_check import MujocoCheck

import servo_logs
from kr5_tools.gap_report.mujoco_sentences import check_rows, check_sentences


@pytest.fixture(scope="module")
def soft_servo(tmp_path_factory):
    """An arm one of whose servos is softer than its model says."""
    folder = tmp_path_factory.mktemp("servo")
    random = np.random.default_rng([41, 2])
    arm = servo_logs.drawn_arm(random, "zyy")
    (folder / "nominal.xml").write_text(arm.xml())
    arm.joints[1].stiffness *= 0.6
    (folder / "true.xml").write_text(arm.xml())
    log = servo_logs.simulated_log(arm.xml(), servo_logs.planned(random, 3, 30.0, 50.0), 50.0)
    case_logs.write_csv(folder / "log.csv", log.columns(random, efforts=False))
    return folder


def test_mujoco_confirms_the_written_model(soft_servo, tmp_path, run_kr5):
    words = ["gap", "diagnose", soft_servo / "log.csv", "--model", soft_servo / "nominal.xml", *QUICK]
    done = run_kr5(*words, "--write-model", "tuned.xml", "--json", "gap.json", "--report", "gap.html", "-o", "r.json")
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "gap.json").read_text())
    assert causes(data) == [("servo_stiffness", "joint2")], done.stdout
    check = MujocoCheck.from_dict(data["mujoco"])
    assert json.loads((tmp_path / "r.json").read_text())["mujoco"] == data["mujoco"]
    assert check.checked and check.rows > 100
    assert check.pooled(check.after) < 1.5 * servo_logs.NOISE < 5 * servo_logs.NOISE < check.pooled(check.before)
    sentence = check_sentences(check)[0]
    assert sentence.startswith("MuJoCo with the written model: ") and sentence in done.stdout.replace("\n", " ")
    assert "The written model in MuJoCo" in (tmp_path / "gap.html").read_text()
    again = run_kr5("report", "r.json", "-o", "again.html")
    assert again.returncode == 0, again.stderr
    assert sentence in (tmp_path / "again.html").read_text()


def test_without_mujoco_a_word_says_how_to_get_it(soft_servo, tmp_path, monkeypatch, kr5_here):
    import sys

    import kr5.cell
    from kr5.models import read_model

    kr5.cell.save_cell(read_model(soft_servo / "nominal.xml").cell, tmp_path / "nominal.yaml")
    monkeypatch.setitem(sys.modules, "mujoco", None)
    words = ["gap", "diagnose", soft_servo / "log.csv", "--model", "nominal.yaml", *QUICK]
    done = kr5_here(*words, "--write-model", "tuned.xml", "--json", "gap.json")
    assert done.exit_code == 0, done.output
    assert "pip install 'kr5[mujoco]'" in done.output
    assert "mujoco" not in json.loads((tmp_path / "gap.json").read_text())
    assert (tmp_path / "tuned.xml").is_file()


def test_sentences_say_what_each_simulation_leaves():
    check = MujocoCheck(
        ["a", "b"], [False, True], 50, True, [0.02, 0.004], [0.003, 1e-4], [0.0031, 2e-4], friction=DryFriction()
    )
    first, second = check_sentences(check)
    assert first == (
        "MuJoCo with the written model: 3.1 mrad, kr5 3 mrad, before 20 mrad; 0.2 mm, kr5 0.1 mm, before 4 mm on the"
        " rows to check (RMS of the positions)."
    )
    assert second.startswith("MuJoCo leaves 2.00 times what kr5 leaves")
    assert check_rows(check)[1] == {"joint": "b", "before": "4", "after": "0.2", "own": "0.1", "unit": "mm"}
    fitted = MujocoCheck(["a"], [False], 50, False, [0.02], [0.003], [0.003], [0.006], DryFriction(0.9, 0.005, 0.99))
    first, second = check_sentences(fitted)
    assert "for none are kept to check" in first
    assert "it leaves 6 mrad" in second and "frictionloss 0.9 times" in second
    assert "solreffriction 0.005 1, solimpfriction 0.99 0.99" in second
    assert MujocoCheck.from_dict(fitted.to_dict()) == fitted
