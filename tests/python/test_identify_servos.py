"""`kr5 identify servos`: servos, friction and rotors of an arm from commands and positions, with gains of another scale
in its model."""

import json

import kr5
import kr5.arm_log
import numpy as np
import pytest
from kr5.models.reading import read_model

pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'kr5[mujoco]'")

from kr5.models.mujoco_check import MujocoCheck

import mujoco_servo_log
from kr5_tools.gap_report.mujoco_sentences import check_sentences


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A log of the true arm in rounded positions, and a model whose gains are fifty times too high."""
    out = tmp_path_factory.mktemp("servos")
    mujoco_servo_log.write_servo_log(out)
    return out


def test_servos_are_found_from_gains_of_another_scale(folder, run_kr5, tmp_path):
    files = (folder / "servos.json", folder / "tuned.xml")
    words = ("identify", "servos", folder / "log.csv", "--model", folder / "model.xml")
    done = run_kr5(*words, "-o", files[0], "--write-model", files[1])
    assert done.returncode == 0, done.stderr
    assert "held out" in done.stdout
    assert "joint 2 (elbow): stiffness of the servo" in done.stdout
    data = json.loads(files[0].read_text())
    assert data["format"] == "kr5-servos/1"
    values = {(e["effect"], e["target"]): e["parameters"][0] for e in data["result"]["effects"]}
    for joint in ("joint1", "joint2"):
        assert values["servo_stiffness", joint]["value"][0] == pytest.approx(mujoco_servo_log.TRUE["kp"], rel=0.15)
        assert values["coulomb_friction", joint]["value"][0] == pytest.approx(mujoco_servo_log.TRUE["dry"], rel=0.3)
    for column in data["result"]["columns"]:
        assert column["check_after"] < 2 * column["noise"] < column["check_before"]
    check = MujocoCheck.from_dict(data["mujoco"])
    assert " ".join(check_sentences(check)) in done.stdout
    left = [check.pooled(errors) for errors in (check.after, check.as_found, check.before)]
    assert check.checked and left == sorted(left)
    assert check.unstable == ["before"] and "MuJoCo loses the model as it was read" in done.stdout  # 900 N m/rad, 5 ms
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()
    tuned = read_model(files[1]).cell
    dry = [values["coulomb_friction", joint]["value"][0] for joint in ("joint1", "joint2")]
    assert tuned.drives.friction.coulomb == pytest.approx(check.friction.scale * np.array(dry), rel=1e-6)
    found = values["servo_stiffness", "joint1"]["value"][0]
    assert tuned.servo.torque_of(0).stiffness == pytest.approx(found, rel=1e-6)


def test_the_library_says_what_the_command_says(folder):
    from kr5.logs import read_logs

    compared = read_logs(folder / "log.csv", folder / "model.xml")
    assert kr5.arm_log.moves_by_torque_servos(compared.recording)
    told = []
    found = kr5.arm_log.identify_servos(compared.recording, progress=lambda stage, part: told.append((stage, part)))
    assert {e.effect for e in found.effects} == set(kr5.arm_log.servo_effects())
    assert told[-1] == ("fitting all joints", 1.0)
    assert np.all(np.linalg.eigvalsh(np.asarray(found.covariance)) > 0)
    assert found.cell.robot.joints == 2


def test_a_log_without_commands_is_refused(folder, run_kr5):
    rows = (folder / "log.csv").read_text().splitlines()
    (folder / "silent.csv").write_text("\n".join(",".join(row.split(",")[i] for i in (0, 3, 4)) for row in rows))
    done = run_kr5("identify", "servos", folder / "silent.csv", "--model", folder / "model.xml")
    assert done.returncode == 2
    assert "found no efforts or currents" in done.stderr
