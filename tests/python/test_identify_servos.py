"""`kr5 identify servos`: servos, friction and rotors of an arm from commands and positions, with gains of another scale
in its model."""

import json

import kr5
import kr5.arm_log
import kr5.cell
import kr5.predict
import numpy as np
import pytest
from kr5.models.reading import read_model

pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'kr5[mujoco]'")

ARM = """<mujoco model="two links"><compiler angle="radian"/><option timestep="0.005"/>
  <worldbody><body name="upper" pos="0 0 0.1">
    <joint name="shoulder" axis="0 1 0" armature="{armature}" frictionloss="{dry}"/>
    <inertial pos="0.06 0 0" mass="0.2" diaginertia="1e-4 2e-4 2e-4"/>
    <body name="lower" pos="0.12 0 0">
      <joint name="elbow" axis="0 1 0" armature="{armature}" frictionloss="{dry}"/>
      <inertial pos="0.05 0 0" mass="0.1" diaginertia="1e-4 2e-4 2e-4"/></body></body></worldbody>
  <actuator><position name="a" joint="shoulder" kp="{kp}" kv="{kv}"/>
    <position name="b" joint="elbow" kp="{kp}" kv="{kv}"/></actuator>
</mujoco>
"""
TRUE = {"armature": 0.02, "dry": 0.05, "kp": 18.0, "kv": 0.8}
MODEL = {"armature": 0.001, "dry": 0.0, "kp": 900.0, "kv": 5.0}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A log of the true arm in rounded positions, and a model whose gains are fifty times too high."""
    out = tmp_path_factory.mktemp("servos")
    (out / "true.xml").write_text(ARM.format(**TRUE))
    (out / "model.xml").write_text(ARM.format(**MODEL))
    t = 0.02 * np.arange(1500)
    rise = np.clip(t - 1.0, 0.0, 2.0) / 2.0
    swing = [0.5 * np.sin(1.7 * t) + 0.15 * np.sin(6.1 * t), 0.6 * np.sin(1.1 * t + 1.0) + 0.15 * np.sin(7.3 * t)]
    command = np.column_stack([rise * s for s in swing])
    motion = kr5.cell.Experiment(name="m", kind="motion", file="m.csv", split="fit")
    motion.data = kr5.io.Table(["t", "qc1", "qc2"], np.column_stack([t, command]))
    shown = kr5.predict.FastSimulator().predict(read_model(out / "true.xml").cell, motion)
    tick = 2 * np.pi / 4096
    measured = np.column_stack([np.round(np.asarray(shown[f"q{k}"]) / tick) * tick for k in (1, 2)])
    head = "time,cmd_shoulder,cmd_elbow,position_shoulder,position_elbow"
    np.savetxt(out / "log.csv", np.column_stack([t, command, measured]), delimiter=",", header=head, comments="")
    return out


def test_servos_are_found_from_gains_of_another_scale(folder, run_kr5):
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
        assert values["servo_stiffness", joint]["value"][0] == pytest.approx(TRUE["kp"], rel=0.15)
        assert values["coulomb_friction", joint]["value"][0] == pytest.approx(TRUE["dry"], rel=0.3)
    for column in data["result"]["columns"]:
        assert column["check_after"] < 2 * column["noise"] < column["check_before"]
    tuned = read_model(files[1]).cell
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
    assert "command" in done.stderr
