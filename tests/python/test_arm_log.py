"""The engine of real arms is the library's: C++ functions, Python and the command give one answer."""

import json

import kr5
import kr5.cell
import kr5.gap
import numpy as np
import pytest
from kr5 import arm_log
from kr5.logs import diagnose_logs, read_logs
from kr5.logs.column_names import find_families
from kr5.logs.log import Log

LOG, MODEL = "data/arm_log/joint_states.csv", "data/arm_log/arm.urdf"


@pytest.fixture(scope="module")
def of_library():
    """What a C++ program gets of the log that ships: file, model, diagnosis."""
    model = kr5.cell.import_urdf(kr5.share(MODEL)).cell
    log = arm_log.read_log(kr5.share(LOG), model)
    return log, model, arm_log.diagnose_log(log, model)


def answer(diagnosis):
    """All that a diagnosis says, but how long it took."""
    data = json.loads(diagnosis if isinstance(diagnosis, str) else diagnosis.to_json())
    return {key: value for key, value in data.items() if not key.startswith("seconds")}


def assert_equal(a, b, where="answer"):
    """Equal but for the last digits of numbers."""
    assert type(a) is type(b) or {type(a), type(b)} <= {int, float}, where
    if isinstance(a, dict):
        assert a.keys() == b.keys(), where
        for key in a:
            assert_equal(a[key], b[key], f"{where}.{key}")
    elif isinstance(a, list):
        assert len(a) == len(b), where
        for k, (one, other) in enumerate(zip(a, b)):
            assert_equal(one, other, f"{where}[{k}]")
    elif isinstance(a, float):
        assert a == pytest.approx(b, rel=1e-9, abs=1e-12), where
    else:
        assert a == b, where


def test_the_log_that_ships_has_one_answer_in_library_python_and_command(of_library, run_kr5, tmp_path):
    _, _, found = of_library
    expected = answer(found.diagnosis)
    assert [(c["effect"], c["target"]) for c in expected["causes"]] == [("coulomb_friction", "joint3")]
    logs = [kr5.share(LOG)], kr5.share(MODEL)
    assert_equal(answer(diagnose_logs(*logs)), expected, "kr5.logs")
    assert_equal(answer(kr5.gap.diagnose(read_logs(*logs).recording)), expected, "kr5.gap")
    run_kr5("gap", "diagnose", logs[0][0], "--model", logs[1], "--json", tmp_path / "answer.json")
    assert_equal(answer((tmp_path / "answer.json").read_text()), expected, "command")


def test_a_recording_of_the_log_has_the_answer_of_the_log(of_library, run_kr5, tmp_path):
    _, _, found = of_library
    kr5.cell.save_recording(found.recording, tmp_path / "recording")
    assert_equal(answer(kr5.gap.diagnose(tmp_path / "recording")), answer(found.diagnosis))
    done = run_kr5("gap", "explain", "recording", "--json", "told.json")
    told = json.loads((tmp_path / "told.json").read_text())
    assert done.returncode == 0 and told["verdict"] == str(found.diagnosis.verdict), done.stderr
    assert [cause["name"] for cause in told["causes"]] == ["Coulomb friction of joint 3"]


HEADERS = {
    "joint states": "__time,/js/{}/position,/js/{}/effort,/js/{}/velocity",
    "counted": "t,q#,qc#,qd#,i#,tau#",
    "arrays": "timestamp_ms,position[#],torque[#],temperature[#]",
    "number inside": "time,joint#_pos,joint#_eff,joint#_vel",
    "commands of a controller": "stamp,/controller/target/{}/q,/controller/output/{}/q,/js/{}/position,/js/{}/tau",
    "topics": "header.stamp,/joint_states:position[#],/command:position[#],/joint_states:effort[#]",
    "German": "zeit,pos_soll_#,pos_ist_#,strom_ist_#,temperatur_#",
    "motor side": "t,motor_position_#,joint_position_#,motor_current_#,taum_#,tau_#",
    "units": "t [ms],q#_deg,cur#_mA,torque#_Nm",
    "joined": "t,qcmd#,qact#,qvel#,trq#",
}


@pytest.mark.parametrize("header", HEADERS.values(), ids=HEADERS)
def test_names_of_columns_mean_the_same_to_both_readers(header, tmp_path):
    model = kr5.cell.import_urdf(kr5.share(MODEL)).cell
    joints = list(model.robot.joint_names)
    names = []
    for stem in header.split(","):
        numbers = range(0 if "[#]" in stem else 1, model.robot.joints + ("[#]" not in stem))
        names += [stem.replace("#", str(k)) for k in numbers] if "#" in stem else []
        names += [stem.replace("{}", joint) for joint in joints] if "{}" in stem else []
        names += [stem] if not {"#", "{"} & {*stem} else []
    found = arm_log.find_columns(names, model)
    log = Log(tmp_path / "log.csv")
    for name in names:
        log.add(name, np.zeros(3), "log")
    families = find_families(log, joints, model.robot.joints)
    for family, columns in (("q", found.q), ("qc", found.command), ("tau", found.effort), ("i", found.current)):
        sides = [f for f in families.families.get(family, []) if not f.motor_side]  # which the library does not convert
        if family != "i" or not found.effort:  # it reads currents where there are no efforts
            assert (sides[0].columns if sides else []) == list(columns), family
    assert log.time_columns()[0] == found.time


def test_notes_and_problems_are_typed_and_told_with_their_numbers(of_library):
    log, model, found = of_library
    noise = next(note for note in found.notes if note.kind == arm_log.LogNoteKind.JointNoise)
    assert noise.name == "tau" and len(noise.values) == 6
    assert "noise of tau1 to tau6" in noise.text(found.recording.cell)
    assert found.problems == []
    turned = arm_log.ArmLog(t=log.t, q=log.q, effort=-np.asarray(log.effort))
    with pytest.raises(kr5.InvalidArgument, match="opposite sign"):
        arm_log.diagnose_log(turned, model)
    recording = found.recording
    fit = recording.experiments[0]
    data = fit.data
    values = np.array(data.values)
    values[:, [c.startswith("tau") for c in data.columns]] *= -1
    fit.data = kr5.io.Table(list(data.columns), values)
    (problem,) = arm_log.check_loads(recording.cell, fit)
    assert problem.kind == arm_log.LogProblemKind.OppositeSign and problem.remedy == arm_log.LogRemedy.Reverse


def test_a_delay_of_the_efforts_is_estimated(of_library):
    log, model, _ = of_library
    delay = 0.02
    late = np.column_stack([np.interp(log.t - delay, log.t, column) for column in np.asarray(log.effort).T])
    shifted = arm_log.ArmLog(t=log.t, q=log.q, effort=late)
    found = arm_log.diagnose_log(shifted, model, kr5.gap.DiagnoseOptions(max_effects=1, refits=1))
    assert found.best_arm.delay == pytest.approx(delay, abs=2e-3)
