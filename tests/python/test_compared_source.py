"""What `kr5 gap` compares: logs with a model, a recording with another model; and what its results say of both."""

import json
import re
import shlex

import kr5.cell
import numpy as np
import pytest

from arm_logs import NAMES, QUICK, carrying, case_logs, causes, joint_states, moved, refused


@pytest.fixture
def broken_log(named_arm, tmp_path):
    """A log of the arm with friction in joint 3; the name has a space in it."""
    broken = carrying(named_arm, "coulomb_friction", "joint3", coulomb=9.0)
    case_logs.write_csv(tmp_path / "my log.csv", joint_states(*moved(broken)))
    return "my log.csv"


def test_the_verdict_and_its_causes_stand_before_how_the_log_was_read(diagnose, broken_log, named_urdf):
    code, said, _ = diagnose(broken_log, "--model", named_urdf, *QUICK)
    assert code == 0, said
    words = ["Explained.", "Causes", "How the logs were read", "Next steps"]
    places = [said.index(word) for word in words]
    assert places == sorted(places), said
    assert said.startswith("Explained.")
    code, said, _ = diagnose(broken_log, "--model", named_urdf, command="measure")
    assert code == 0 and said.startswith("RMS gap") and "How the logs were read" in said


def test_a_cause_bears_the_name_that_the_model_gives_its_joint(diagnose, broken_log, named_urdf, tmp_path):
    code, said, _ = diagnose(broken_log, "--model", named_urdf, "--report", "gap.html", *QUICK)
    assert code == 0, said
    assert f"Coulomb friction of joint 3 ({NAMES[2]}; " in said, said
    assert f"({NAMES[2]}; coulomb_friction:joint3)" in said, said
    assert f"coulomb_friction on joint3 ({NAMES[2]})" in (tmp_path / "gap.html").read_text()


def test_as_many_causes_as_are_searched_for_are_told(diagnose, broken_log, named_urdf):
    code, said, data = diagnose(broken_log, "--model", named_urdf, "--max-effects", "1")
    assert code == 0 and len(data["causes"]) == 1, said
    assert data["effects_limit"] == 1
    assert "As many causes were found as are searched for (max_effects: 1)" in said


def test_a_recording_written_of_a_log_is_diagnosed_as_the_log(diagnose, broken_log, named_urdf, tmp_path):
    code, said, first = diagnose(broken_log, "--model", named_urdf, "--write-recording", "made", *QUICK)
    assert code == 0, said
    code, said, second = diagnose("made", *QUICK)
    assert code == 0, said
    assert causes(first) == causes(second) == [("coulomb_friction", "joint3")]
    assert second["causes"][0]["parameters"] == first["causes"][0]["parameters"]
    assert first["verdict"] == second["verdict"] == "explained"
    assert second["excused"] == first["excused"]


def test_the_command_of_the_next_steps_can_be_pasted(diagnose, broken_log, named_urdf, tmp_path):
    model = tmp_path / "my model.urdf"
    model.write_text(named_urdf.read_text())
    given = ["--model", model.name, "--set", "columns.tau.unit=N m", "--trust"]
    code, said, _ = diagnose(broken_log, *given, *QUICK)
    assert code == 0, said
    command = re.search(r"kr5 (gap diagnose .*? --write-model tuned\.urdf)\.", said)[1]
    words = shlex.split(command)
    assert words == ["gap", "diagnose", broken_log, *given, "--write-model", "tuned.urdf"]
    code, said, _ = diagnose(*words[2:], *QUICK)
    assert code == 0 and "model with the causes in it" in said


def test_a_cell_is_written_where_the_model_cannot_hold_the_cause(diagnose, named_arm, named_urdf, tmp_path):
    broken = carrying(named_arm, "stribeck_friction", "joint3", stribeck=12.0, stribeck_velocity=0.05)
    case_logs.write_csv(tmp_path / "log.csv", joint_states(*moved(broken)))
    code, said, data = diagnose("log.csv", "--model", named_urdf, "--report", "gap.html", *QUICK)
    assert code == 0 and causes(data) == [("stribeck_friction", "joint3")], said
    assert "A URDF cannot hold Stribeck friction of joint 3; the cell tuned.yaml holds every cause." in said
    assert "--write-model" not in said and "--write-cell tuned.yaml" in (tmp_path / "gap.html").read_text()
    words = shlex.split(re.search(r"kr5 gap (diagnose .*? --write-cell tuned\.yaml)\.", said)[1])
    code, said, _ = diagnose(*words[1:], *QUICK)
    assert code == 0, said
    case_logs.write_csv(tmp_path / "other.csv", joint_states(*moved(broken, seed=2)))
    code, said, measured = diagnose("other.csv", "--model", "tuned.yaml", command="measure")
    assert code == 0 and measured["gap"] < 1.05, said


def test_the_result_of_a_log_is_explained_and_reported_from_the_log(
    diagnose, broken_log, named_urdf, kr5_here, tmp_path
):
    given = ["--model", named_urdf, "--set", "columns.tau.unit=N m", "--trust"]
    code, said, _ = diagnose(broken_log, *given, "-o", "gap.json", *QUICK)
    assert code == 0, said
    inputs = json.loads((tmp_path / "gap.json").read_text())["input"]
    assert inputs == {
        "logs": [str(tmp_path / broken_log)],
        "model": str(named_urdf),
        "set": ["columns.tau.unit=N m"],
        "trust": True,
    }
    done = kr5_here("gap", "explain", "gap.json", "coulomb_friction:joint3", "--json", "told.json")
    assert done.exit_code == 0, done.output
    told = json.loads((tmp_path / "told.json").read_text())
    assert told["targets"][0]["target"] == "joint3"
    done = kr5_here("report", "gap.json", "-o", "page.html")
    assert done.exit_code == 0 and "not found" not in done.output, done.output
    page = (tmp_path / "page.html").read_text()
    assert f"Log <code>{broken_log}</code>" in page and "No curves" not in page
    assert "kr5 gap diagnose &#39;" in page and "--write-model tuned.urdf" in page
    (tmp_path / broken_log).unlink()
    done = kr5_here("report", "gap.json", "-o", "page.html")
    assert done.exit_code == 0 and "the logs and their model were not found" in " ".join(done.output.split())


@pytest.fixture
def worn_with_a_sound_model(named_arm, tmp_path, diagnose, named_urdf):
    """A recording whose own cell has the friction that it shows, and the model without it."""
    broken = carrying(named_arm, "coulomb_friction", "joint3", coulomb=9.0)
    case_logs.write_csv(tmp_path / "log.csv", joint_states(*moved(broken)))
    code, said, _ = diagnose(
        "log.csv", "--model", named_urdf, "--write-recording", "made", "--write-cell", "tuned.yaml", *QUICK
    )
    assert code == 0, said
    recording = kr5.cell.load_recording(tmp_path / "made")
    recording.cell = kr5.cell.load_cell(tmp_path / "tuned.yaml")
    kr5.cell.save_recording(recording, tmp_path / "known")
    return "known"


def test_page_and_explanation_show_the_model_that_was_compared(
    diagnose, worn_with_a_sound_model, named_urdf, kr5_here, tmp_path
):
    code, said, data = diagnose(worn_with_a_sound_model, *QUICK)
    assert code == 0 and data["verdict"] == "no_gap", said
    code, said, data = diagnose(
        worn_with_a_sound_model, "--model", named_urdf, "-o", "gap.json", "--report", "page.html", *QUICK
    )
    assert code == 0 and causes(data) == [("coulomb_friction", "joint3")], said
    from kr5_tools.gap_report.evidence_data import find_recording

    result = tmp_path / "gap.json"
    found = find_recording(json.loads(result.read_text())["input"], result, None)
    assert not found.cell.effects.to_dict()
    done = kr5_here("report", "gap.json", "-o", "again.html")
    assert done.exit_code == 0, done.output
    gaps = [
        [float(x) for x in re.findall(r"<td>([\d.]+)</td>", (tmp_path / page).read_text())]
        for page in ("page.html", "again.html")
    ]
    assert gaps[0] == gaps[1] and max(gaps[0]) > 1.5


# A description in the place of the recording's cell


def test_a_urdf_with_a_recording_keeps_noise_and_parts_of_the_recording(diagnose, share, tmp_path, run_kr5):
    cell = case_logs.named(kr5.cell.load_cell(share / "cells" / "kr5_arc.yaml"))
    t, q, tau = moved(cell, rows=600)
    currents = tau @ np.linalg.inv(np.asarray(cell.drives.structure)) / np.asarray(cell.drives.torque_constant)
    experiment = kr5.cell.Experiment(name="m", kind="motion", file="m.csv", split="fit")
    experiment.joint_reference = kr5.cell.JointReference("measured")
    names = ["t", *(f"qc{k + 1}" for k in range(6)), *(f"i{k + 1}" for k in range(6))]
    experiment.data = kr5.io.Table(names, np.column_stack([t, q, currents]))
    kr5.cell.save_recording(kr5.cell.Recording(cell, [experiment]), tmp_path / "recording")
    kr5.cell.export_urdf(cell, tmp_path / "arm.urdf")
    code, said, own = diagnose("recording", command="measure")
    assert code == 0, said
    code, said, data = diagnose("recording", "--model", "arm.urdf", command="measure")
    assert code == 0 and "does not state noise" not in said, said
    assert data["columns"].keys() == own["columns"].keys()
    for name, gap in own["columns"].items():
        assert data["columns"][name] == pytest.approx(gap, rel=0.02), name


def test_the_description_of_another_robot_beside_a_recording_is_refused(
    diagnose, broken_log, named_urdf, named_arm, tmp_path
):
    code, said, _ = diagnose(broken_log, "--model", named_urdf, "--write-recording", "made", *QUICK)
    assert code == 0, said
    other = kr5.cell.parse_cell(named_arm.to_yaml())
    robot = other.robot
    robot.joint_names = [*NAMES[:5], "spin"]
    other.robot = robot
    kr5.cell.export_urdf(other, tmp_path / "other.urdf")
    refused(diagnose, "made", "--model", "other.urdf", text=("found the joints", "spin", "expected", NAMES[5]))
    short = re.sub(rf'(<joint name="{NAMES[5]}" type=)"revolute"', r'\1"fixed"', named_urdf.read_text())
    short = re.sub(rf'(<joint name="{NAMES[5]}" type=)"continuous"', r'\1"fixed"', short)
    (tmp_path / "short.urdf").write_text(short)
    refused(diagnose, "made", "--model", "short.urdf", text="found 5 joints, expected 6")


# Models to be written


def test_a_cell_as_the_model_is_written_anew(diagnose, broken_log, named_arm, tmp_path):
    cell = kr5.cell.parse_cell(named_arm.to_yaml())
    cell.drives = kr5.cell.Drives(
        structure=np.eye(6),
        rotor_inertia=np.zeros(6),
        torque_constant=np.ones(6),
        friction=kr5.cell.Friction(coulomb=np.zeros(6), viscous=np.zeros(6)),
    )
    kr5.cell.save_cell(cell, tmp_path / "robot.yaml")
    (tmp_path / "log.csv").write_bytes((tmp_path / broken_log).read_bytes())
    code, said, _ = diagnose("log.csv", "--model", "robot.yaml", "--write-model", "tuned.yaml", *QUICK)
    assert code == 0, said
    tuned = kr5.cell.load_cell(tmp_path / "tuned.yaml")
    assert np.asarray(tuned.drives.friction.coulomb)[2] == pytest.approx(9.0, abs=0.5)


@pytest.fixture
def never_diagnosed(monkeypatch):
    def fail(*_):
        raise AssertionError("the diagnosis was run")

    monkeypatch.setattr("kr5_tools.gap.diagnose.run_diagnosis", fail)


def test_the_ending_of_a_model_is_refused_before_the_diagnosis(diagnose, broken_log, named_urdf, never_diagnosed):
    words = [broken_log, "--model", named_urdf, "--write-model", "tuned.foo"]
    refused(diagnose, *words, text=("tuned.foo: found the ending '.foo'", ".urdf"))


def test_an_mjcf_that_computes_its_masses_is_refused_before_the_diagnosis(
    diagnose, broken_log, named_arm, tmp_path, never_diagnosed
):
    mujoco = pytest.importorskip("mujoco", reason="pip install 'kr5[mujoco]'")
    from kr5.models.writing import write_model

    write_model(named_arm, tmp_path / "arm.xml")
    text = (tmp_path / "arm.xml").read_text()
    mass = mujoco.MjModel.from_xml_string(text).body_mass.sum()
    assert "<compiler" in text
    (tmp_path / "arm.xml").write_text(text.replace("<compiler", f'<compiler settotalmass="{mass:.9g}"', 1))
    words = [broken_log, "--model", "arm.xml", "--write-model", "tuned.xml"]
    refused(diagnose, *words, text="the compiler setting settotalmass computes masses anew")


# What is not there


@pytest.mark.parametrize("command", ["diagnose", "measure"])
def test_a_source_that_is_not_there_is_told_first(diagnose, named_urdf, command):
    for words in (["nope"], ["nope", "--model", named_urdf]):
        code, said, _ = diagnose(*words, command=command)
        assert code == 2 and "nope: no such file or folder" in said and "--model" not in said


def test_errors_name_the_log_and_entries_that_can_be_typed(diagnose, broken_log, named_urdf, tmp_path):
    for words, text in (
        (["--set", "columns.tau.unit=furlong"], f"{broken_log}: columns.tau: unit: found 'furlong'"),
        (["--set", "columns.torque.scale=2"], f"{broken_log}: columns: unknown key 'torque'"),
        (["--set", "cell.nosuch=1"], "--set cell.nosuch: nosuch: found an unknown key"),
        (["--set", "cell.drives.torque_constant=[1]"], "--set cell.drives.torque_constant:"),
    ):
        said = refused(diagnose, broken_log, "--model", named_urdf, *words, text=text)
        assert "map.yaml" not in said and "/tmp/" not in said.replace(str(tmp_path), "") and "in the map" not in said


def test_a_problem_of_both_parts_of_a_log_is_told_once(diagnose, named_arm, named_urdf, tmp_path):
    t, q, tau = moved(named_arm)
    case_logs.write_csv(tmp_path / "log.csv", joint_states(t, q, -tau))
    said = refused(diagnose, "log.csv", "--model", named_urdf, text="--set columns.tau.scale=-1")
    assert said.count("the opposite sign to the simulation") == 1 and "(also in motion-2)" in said
    assert "in the map" not in said
    code, said, data = diagnose("log.csv", "--model", named_urdf, "--set", "columns.tau.scale=-1", *QUICK)
    assert code == 0 and data["verdict"] == "no_gap", said


def test_a_text_without_names_is_read_with_the_header_that_is_asked_for(diagnose, named_arm, named_urdf, tmp_path):
    t, q, tau = moved(named_arm)
    rows = np.column_stack([t, q, tau])
    (tmp_path / "log.csv").write_text("\n".join(",".join(f"{v:.10g}" for v in row) for row in rows) + "\n")
    refused(diagnose, "log.csv", "--model", named_urdf, text="names of its 13 columns")
    refused(diagnose, "log.csv", "--model", named_urdf, text="--columns 't,q{1-6},tau{1-6}'")
    names = ["time", *(f"q{k + 1}" for k in range(6)), *(f"tau{k + 1}" for k in range(6))]
    header = f"header=[{', '.join(names)}]"
    code, said, data = diagnose("log.csv", "--model", named_urdf, "--set", header, *QUICK)
    assert code == 0 and data["verdict"] == "no_gap", said
    listed = ("--columns", "time,q{1-6},tau{1-6}")
    code, said, other = diagnose("log.csv", "--model", named_urdf, *listed, *QUICK)
    assert code == 0 and other["shrink"] == data["shrink"], said
