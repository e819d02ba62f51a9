"""The Python surface of kr5.cell and kr5.io, and `kr5 cell`."""

import json
import pickle
import re
import runpy
import sys

import kr5
import kr5.cell
import kr5.io
import numpy as np
import pytest
import yaml


@pytest.fixture
def arc(share):
    return kr5.cell.load_cell(share / "cells/kr5_arc.yaml")


@pytest.fixture
def motion(tmp_path, arc):
    """A recording of one short motion."""
    t = 0.012 * np.arange(30)
    q = np.array([0.2, 0.1, -2.6, 0.1, 0.2, 0.3]) + 0.01 * np.sin(t)[:, None]
    names = ["t", *(f"qc{i}" for i in range(1, 7)), *(f"q{i}" for i in range(1, 7))]
    experiment = kr5.cell.Experiment(name="motion-1", kind="motion", file="motion-1.csv", split="fit")
    experiment.data = kr5.io.Table(names, np.column_stack([t, q, q]))
    folder = tmp_path / "recording"
    kr5.cell.save_recording(kr5.cell.Recording(arc, [experiment]), folder)
    return folder


def test_parts_of_a_cell_are_structs_with_arrays(arc):
    assert arc.robot.joints == 6
    assert arc.robot.dh[3].b == 0.62
    assert arc.drives.structure.shape == (6, 6)
    assert arc.servo.of_joint(2).natural_frequency == 45.0
    assert arc.camera.pinhole().fx == 2328.556745
    assert arc.laser.T_flange_scanner is None
    assert arc.T_flange_camera().shape == (4, 4)
    assert np.allclose(arc.T_base_tool(np.zeros(6)), arc.flange(np.zeros(6)) @ arc.tool.T_flange_tool)
    assert str(arc.camera.mount) == "eye_in_hand"


def test_a_cell_goes_through_dict_and_pickle(arc):
    arc.set_effect("backlash", "joint5", "gap", 0.002)
    arc.set_effect("hand_eye", "camera", "T_E_C", kr5.from_xyzrpy([0.01, 0.02, 0.03, 0.1, 0.2, 0.3]))
    for copy in (kr5.cell.Cell.from_dict(arc.to_dict()), pickle.loads(pickle.dumps(arc))):
        assert copy.to_dict() == arc.to_dict()
        assert copy.effects.get("backlash", "joint5", "gap") == 0.002
    json.dumps(arc.to_dict())


def test_a_cell_is_written_as_it_was_read_and_for_any_yaml_reader(arc, share, tmp_path):
    kr5.cell.save_cell(arc, tmp_path / "cell.yaml")
    with open(tmp_path / "cell.yaml") as ours, open(share / "cells/kr5_arc.yaml") as theirs:
        assert yaml.safe_load(ours) == yaml.safe_load(theirs)


@pytest.mark.parametrize("name", ["kr5_arc", "gantry_rrp"])
def test_the_canonical_form_means_the_same_to_any_yaml_reader(share, name):
    cell = kr5.cell.load_cell(share / f"cells/{name}.yaml")
    text = kr5.cell.Cell.from_dict(cell.to_dict()).to_yaml()
    numbers = yaml.safe_load(text)["noise"]
    assert all(isinstance(v, float) for v in numbers.values())
    assert kr5.cell.parse_cell(text).to_dict() == cell.to_dict()


def test_effects_are_set_by_name_and_listed_with_units(arc):
    row = kr5.cell.find_effect("stribeck_friction")
    assert row.id in {effect.id for effect in kr5.cell.effect_catalogue()}
    assert [(p.name, p.unit, p.off) for p in row.parameters] == [
        ("stribeck", "N m", [0.0]),
        ("stribeck_velocity", "rad/s", [0.1]),
    ]
    assert arc.effect_targets("ft_bias") == ["fx", "fy", "fz", "tx", "ty", "tz"]
    arc.set_effect("payload", "tool", "com", [0.0, 0.01, 0.1])
    arc.set_effect("payload", "tool", "mass", 0.26)
    arc.set_effect("torque_ripple", "joint1", "cycles", 6)
    assert arc.effects.to_dict()["payload"] == {"tool": {"mass": 0.26, "com": [0.0, 0.01, 0.1]}}
    assert arc.effects.get("torque_ripple", "joint1", "cycles") == 6
    assert arc.effects.get("coulomb_friction", "joint1", "coulomb") is None
    assert len(arc.effects) == 2
    arc.set_effect("payload", "tool", "com", None)
    arc.set_effect("payload", "tool", "mass", None)
    assert "payload" not in arc.effects.to_dict()


def test_the_labels_of_the_reference_cases_can_be_set(arc, reference):
    labels = json.loads((reference / "cases/labels.json").read_text())
    count = 0
    for label in labels.values():
        for effect in label["effects"]:
            for name, value in effect["parameters"].items():
                arc.set_effect(effect["effect"], effect["target"], name, value)
                assert np.all(
                    np.asarray(arc.effects.get(effect["effect"], effect["target"], name)) == np.asarray(value)
                )
                count += 1
    assert count > 13
    assert kr5.cell.check(kr5.cell.parse_cell(arc.to_yaml())) == []


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda c: c.set_effect("backlsh", "joint1", "gap", 1), "did you mean 'backlash'"),
        (lambda c: c.set_effect("backlash", "joint9", "gap", 1), "no joint9"),
        (lambda c: c.set_effect("backlash", "joint1", "gap", [1, 2]), "is one number"),
        (lambda c: c.effects.get("backlash", "joint1", "width"), "there are gap"),
        (lambda c: kr5.cell.Effects({"backlash": {"joint1": {"gap": "wide"}}}), "found 'wide', expected a number"),
    ],
)
def test_effects_that_do_not_fit_are_refused_with_what_would(arc, call, text):
    with pytest.raises(kr5.InvalidArgument, match=text):
        call(arc)


def test_columns_of_a_recording_are_arrays(motion):
    recording = kr5.cell.load_recording(motion)
    q3 = recording["motion-1"]["q3"]
    assert q3.shape == (30,) and q3[0] == -2.6
    assert "i1" not in recording["motion-1"].data
    assert str(recording["motion-1"].split) == "fit"
    with pytest.raises(kr5.InvalidArgument, match="no experiment 'x'"):
        recording["x"]
    with pytest.raises(kr5.InvalidArgument, match="no column 'x'; there are t, qc1"):
        recording["motion-1"]["x"]
    columns = {c.name: c for c in kr5.cell.columns("motion", 6)}
    assert (columns["i3"].unit, columns["i3"].noise, str(columns["i3"].role)) == ("A", "current", "predicted")


def test_bad_files_raise_with_file_line_and_field(tmp_path):
    (tmp_path / "cell.yaml").write_text("format: kr5-cell/1\nrobot:\n  dh: [{b: fast}]\n")
    with pytest.raises(kr5.IoError, match=r"cell.yaml:3: robot.dh\[0\].b: found 'fast', expected a number"):
        kr5.cell.load_cell(tmp_path / "cell.yaml")
    (tmp_path / "log.csv").write_text("a,b\n1,2\n3\n")
    with pytest.raises(kr5.IoError, match="log.csv:3: found 1 value, expected 2"):
        kr5.io.load_csv(tmp_path / "log.csv")


def test_tables_go_through_csv_bit_for_bit(tmp_path):
    values = np.random.default_rng(1).normal(size=(50, 2)) * 1e-7
    kr5.io.save_csv(kr5.io.Table(["a", "b"], values), tmp_path / "x.csv")
    assert np.array_equal(kr5.io.load_csv(tmp_path / "x.csv").values, values)


def test_the_reference_program_runs_on_a_cell_that_we_wrote(reference, tmp_path, capsys, monkeypatch):
    pytest.importorskip("pinocchio")
    kr5.cell.save_recording(kr5.cell.load_recording(reference / "cases/case-006"), tmp_path)
    monkeypatch.setattr(sys, "argv", ["predict.py", str(tmp_path)])
    runpy.run_path(str(reference / "reference/predict.py"), run_name="__main__")
    gaps = [float(word.split("=")[1]) for word in capsys.readouterr().out.split() if "=" in word]
    assert len(gaps) > 100
    assert max(gaps) < 1.3  # the healthy case: every column at the noise floor


def test_check_says_clean_or_names_every_problem(run_kr5, share, tmp_path):
    clean = run_kr5("cell", "check", share / "cells")
    assert clean.returncode == 0
    count = len(list((share / "cells").glob("*.yaml")))
    assert f"no problem in {count} cells." in clean.stdout
    text = (share / "cells/kr5_arc.yaml").read_text().replace("mass: 38.0", "mass: -38.0").replace("b: 0.4", "b: 400")
    (tmp_path / "bad.yaml").write_text(text)
    bad = run_kr5("cell", "check", "bad.yaml", "--json", "problems.json")
    assert bad.returncode == 2
    assert "2 problems in 1 file" in bad.stdout
    problems = json.loads((tmp_path / "problems.json").read_text())["problems"]
    assert {(p["line"], p["field"], p["found"]) for p in problems} == {
        (5, "robot.dh[0].b", "400"),
        (19, "robot.links[0].mass", "-38.0"),
    }
    missing = run_kr5("cell", "check", "nowhere")
    assert (missing.returncode, missing.stdout) == (2, "")
    assert "nowhere: no such file or folder" in missing.stderr


def test_check_of_a_recording_names_line_and_column(run_kr5, motion):
    file = motion / "motion-1.csv"
    file.write_text(file.read_text() + "0.36,1,2\n")
    bad = run_kr5("cell", "check", motion, "--json", "-")
    assert bad.returncode == 2
    (problem,) = json.loads(bad.stdout)["problems"]
    assert (problem["line"], problem["found"]) == (32, "3 values")


def test_show_draws_the_arm_and_prints_tables(run_kr5, share, tmp_path):
    shown = run_kr5(
        "cell", "show", share / "cells/gantry_rrp.yaml", "-o", "arm.png", "--q", "10,20,30,100", "--json", "cell.json"
    )
    assert shown.returncode == 0, shown.stderr
    assert (tmp_path / "arm.png").read_bytes().startswith(b"\x89PNG")
    for word in (
        "joints",
        "Masses",
        "Drives",
        "Servo",
        "Frames",
        "Noise",
        "Effects",
        "stribeck_friction",
        "rational8",
    ):
        assert word in shown.stdout
    data = json.loads((tmp_path / "cell.json").read_text())
    assert data["q"][3] == pytest.approx(0.1)
    assert {f["name"].split()[0] for f in data["frames"]} >= {"F", "S", "E", "C", "L", "W1", "W3", "T"}


def test_show_gives_noise_of_each_joint_a_row(run_kr5, share, tmp_path):
    content = yaml.safe_load((share / "cells/gantry_rrp.yaml").read_text())
    noise = [0.123456, 1.5, 0.01, 25.0]
    content.setdefault("noise", {})["joint_torque"] = noise
    (tmp_path / "cell.yaml").write_text(yaml.safe_dump(content))
    joints = [joint["type"] for joint in content["robot"]["dh"]]
    done = run_kr5("cell", "show", "cell.yaml")
    assert done.returncode == 0, done.stderr
    for k, (kind, value) in enumerate(zip(joints, noise, strict=True)):
        unit = "N" if kind == "prismatic" else "N m"
        assert re.search(rf"^ joint_torque +{k + 1} +{value:.4g} +{unit}(  |$)", done.stdout, re.MULTILINE)
    assert done.stdout.count("Joint torque of each joint") == 1


def test_show_of_a_recording_lists_its_experiments(run_kr5, motion):
    shown = run_kr5("cell", "show", motion)
    assert shown.returncode == 0, shown.stderr
    assert "motion-1" in shown.stdout and "30" in shown.stdout


def test_show_refuses_what_it_cannot_draw_in_one_line(run_kr5, share, tmp_path):
    cell = share / "cells/kr5_arc.yaml"
    for arguments, text in [
        ((cell, "-o", "arm.png", "--q", "1,2"), "--q: found 2 values, expected 6"),
        ((cell, "-o", "arm.png", "--q", "a,b,c,d,e,f"), "expected numbers in degrees"),
        ((cell, "-o", "arm.txt"), "found the ending '.txt', expected .png"),
        ((tmp_path,), "is a folder without a recording.yaml"),
    ]:
        shown = run_kr5("cell", "show", *arguments)
        assert shown.returncode == 2
        assert text in shown.stderr
        assert not (tmp_path / "arm.png").exists()
