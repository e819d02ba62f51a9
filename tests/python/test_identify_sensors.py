"""`kr5 identify servo`, `contact` and `force-torque`: on recordings with known truth, on CSV, on bad input."""

import json

import numpy as np
import pytest
from kr5 import cell, force, identification
from kr5.files.paths import find_shipped_cell

BOOK = {"natural_frequency": 3.064, "damping_ratio": 0.7492, "delay": 0.024}
NOMINAL = {"mass": 2.4, "com": np.array([0.004, 0.002, 0.085])}


@pytest.fixture(scope="module")
def cases(reference):
    return reference / "cases"


def case(cases, number):
    labels = json.loads((cases / "labels.json").read_text())
    return cases / f"case-{number:03}", labels[f"case-{number:03}"]["effects"]


def identified(folder, run_kr5, *arguments):
    done = run_kr5("identify", *arguments, "-o", "out.json")
    assert done.returncode == 0, done.stderr
    return json.loads((folder / "out.json").read_text())


def refused(run_kr5, *arguments):
    done = run_kr5("identify", *arguments)
    assert done.returncode == 2 and "Traceback" not in done.stderr, done.stderr
    return done.stderr


def figure(data, name):
    return next(f for f in data["figures"] if f["name"] == name)


def write_csv(file, names, columns):
    rows = [",".join(repr(float(v)) for v in row) for row in np.column_stack(columns)]
    file.write_text("\n".join([",".join(names), *rows]) + "\n")


@pytest.mark.parametrize("number", [2, 6, 10])
def test_the_servo_of_a_case_agrees_with_its_label(tmp_path, cases, run_kr5, number):
    folder, effects = case(cases, number)
    truth = BOOK | next((e["parameters"] for e in effects if e["target"] == "servo"), {})
    data = identified(tmp_path, run_kr5, "servo", folder, "--write-cell", "new.yaml")
    found = data["result"]["path correction"]
    std = np.sqrt(np.diag(found["covariance"]))
    for k, (name, value) in enumerate(truth.items()):
        assert abs(found["servo"][name] - value) < 2.6 * std[k], name
    assert abs(found["gain"] - 1) < 2.6 * std[3]
    assert std[0] < 0.01 and std[2] < 1e-3
    assert cell.load_cell(tmp_path / "new.yaml").servo.tool.delay == found["servo"]["delay"]


def test_the_servo_of_a_joint_from_its_motion(tmp_path, cases, run_kr5):
    data = identified(tmp_path, run_kr5, "servo", cases / "case-006", "--joint", "2", "--joint", "5")
    for joint in ("joint 2", "joint 5"):
        found = data["result"][joint]
        std = np.sqrt(np.diag(found["covariance"]))
        for k, (name, value) in enumerate({"natural_frequency": 45.0, "damping_ratio": 0.85, "delay": 0.012}.items()):
            assert abs(found["servo"][name] - value) < 3 * std[k], (joint, name)


@pytest.mark.parametrize(("number", "truth"), [(10, 15396.525644442576), (6, 23380.0)])
def test_the_stiffness_of_a_case_agrees_with_its_label(tmp_path, cases, run_kr5, number, truth):
    folder, _ = case(cases, number)
    data = identified(tmp_path, run_kr5, "contact", folder, "--write-cell", "new.yaml")
    found = data["result"]
    std = np.sqrt(np.diag(found["covariance"]))
    assert abs(found["stiffness"] - truth) < 2.6 * std[0]
    assert std[0] < 0.01 * truth
    assert abs(found["position"]) < 3 * std[1]
    assert found["unloading_stiffness"] is None
    assert cell.load_cell(tmp_path / "new.yaml").contact.stiffness == found["stiffness"]


def test_a_force_loop_is_designed_on_what_the_recording_tells(tmp_path, cases, run_kr5):
    data = identified(tmp_path, run_kr5, "contact", cases / "case-006", "--design")
    point = data["design"]["nominal"]
    assert point["overshoot"] == pytest.approx(0.0446, abs=0.005)
    assert data["design"]["compensator"] == pytest.approx(9.554, rel=0.02)
    assert point["stable"] and len(data["design"]["range"]) == 9
    done = run_kr5("report", "out.json", "-o", "page.html", "--png", "plots")
    assert done.returncode == 0, done.stderr
    assert {f.name for f in (tmp_path / "plots").iterdir()} >= {"contact.png", "force_loop.png"}


@pytest.mark.parametrize("number", [1, 6, 13])
def test_bias_and_tool_of_a_case_agree_with_its_label(tmp_path, cases, run_kr5, number):
    folder, effects = case(cases, number)
    mass, moment, bias = NOMINAL["mass"], NOMINAL["mass"] * NOMINAL["com"], np.zeros(6)
    for effect in effects:
        if effect["effect"] == "payload":
            mass += effect["parameters"]["mass"]
            moment = moment + effect["parameters"]["mass"] * np.array(effect["parameters"]["com"])
        if effect["effect"] == "ft_bias":
            bias[["fx", "fy", "fz", "tx", "ty", "tz"].index(effect["target"])] = effect["parameters"]["bias"]
    data = identified(tmp_path, run_kr5, "force-torque", folder, "--write-cell", "new.yaml")
    truth = [*bias, mass, *(moment / mass)]
    for name, value in zip([f["name"] for f in data["figures"][:10]], truth, strict=True):
        shown = figure(data, name)
        assert abs(shown["value"] - value) < 3 * shown["std"], name
    assert figure(data, "tool.mass")["std"] < 0.01
    written = cell.load_cell(tmp_path / "new.yaml")
    assert written.tool.mass == pytest.approx(mass, rel=0.01)
    assert written.effects.get("ft_bias", "fy", "bias") == pytest.approx(bias[1], abs=0.1)


def test_logs_of_a_table_with_other_names_signs_and_units(tmp_path, run_kr5):
    t = 0.012 * np.arange(400)
    command = np.where(t > 0.2, 24.0, 0.0)
    response = identification.identify_servo(
        identification.ServoLog(t=t, command=command, response=24 * (1 - np.exp(-3 * np.maximum(t - 0.2, 0)))),
        identification.ServoOptions(accepted_std=10),
    ).predicted
    write_csv(tmp_path / "log.csv", ["s", "zd", "z"], [t, -command, -response])
    data = identified(tmp_path, run_kr5, "servo", "log.csv", "--columns=s,-zd,-z", "--length-unit", "mm")
    assert data["result"]["path correction"]["gain"] == pytest.approx(1.0, abs=0.01)
    found = identified(tmp_path, run_kr5, "servo", "log.csv", "--columns=s,-zd,-z")
    assert found["figures"] == data["figures"]  # 24 is too large for metres
    text = refused(run_kr5, "servo", "log.csv", "--columns", "s,zd,z", "--length-unit", "m")
    assert "in millimetres? (--length-unit mm)" in text

    depth = np.linspace(-0.25e-3, 0.65e-3, 10)
    pressed = 23380 * np.maximum(depth, 0) + np.random.default_rng(1).normal(0, 0.1, 10)
    write_csv(tmp_path / "press.csv", ["depth", "force"], [depth, pressed])
    data = identified(tmp_path, run_kr5, "contact", "press.csv")
    assert figure(data, "stiffness")["value"] == pytest.approx(23.38, abs=3 * figure(data, "stiffness")["std"])
    design = ("contact", "press.csv", "--design", "--cell", find_shipped_cell())
    assert figure(identified(tmp_path, run_kr5, *design), "force loop: compensator")["value"] > 5
    assert "--design: needs a servo" in refused(run_kr5, "contact", "press.csv", "--design")


def postures(count, seed=1):
    random = np.random.default_rng(seed)
    gravity = random.normal(size=(count, 3))
    gravity *= 9.81 / np.linalg.norm(gravity, axis=1)[:, None]
    wrench = np.hstack([2.4 * gravity, np.cross(2.4 * NOMINAL["com"], gravity)]) + np.array([1, 2, 3, 0.1, 0.2, 0.3])
    return gravity, wrench + random.normal(size=(count, 6)) * np.repeat([0.15, 0.008], 3)


def test_postures_of_a_table_and_what_they_do_not_tell(tmp_path, run_kr5):
    gravity, wrench = postures(40)
    names = ["gx", "gy", "gz", "fx", "fy", "fz", "tx", "ty", "tz"]
    write_csv(tmp_path / "p.csv", names, [*gravity.T, *wrench.T])
    data = identified(tmp_path, run_kr5, "force-torque", "p.csv")
    assert figure(data, "tool.mass")["value"] == pytest.approx(2.4, abs=3 * figure(data, "tool.mass")["std"])
    done = run_kr5("report", "out.json", "-o", "page.html", "--png", "plots")
    assert done.returncode == 0 and (tmp_path / "plots/wrench.png").exists(), done.stderr
    text = refused(run_kr5, "force-torque", "p.csv", "--gain", "diagonal")
    assert "gain.fx" in text and "known loads" in text
    upright = np.tile([0.0, 0.0, -9.81], (40, 1))
    write_csv(tmp_path / "up.csv", names, [*upright.T, *wrench.T])
    assert "do not determine" in refused(run_kr5, "force-torque", "up.csv")
    write_csv(tmp_path / "mm.csv", names, [*gravity.T, *wrench[:, :3].T, *(1e5 * wrench[:, 3:].T)])
    assert "are they in N mm?" in refused(run_kr5, "force-torque", "mm.csv")
    write_csv(tmp_path / "bare.csv", names[3:], wrench.T)
    assert "--cell is missing" in refused(run_kr5, "force-torque", "bare.csv")
    write_csv(tmp_path / "few.csv", names, [*gravity[:1].T, *wrench[:1].T])
    assert "do not determine" in refused(run_kr5, "force-torque", "few.csv")


def test_bad_logs_are_refused_with_the_reason(tmp_path, cases, run_kr5):
    assert "absent.csv" in refused(run_kr5, "servo", "absent.csv")
    t = 0.012 * np.arange(50)
    write_csv(tmp_path / "still.csv", ["t", "command", "response"], [t, 0 * t, 0 * t])
    assert "the command does not change" in refused(run_kr5, "servo", "still.csv")
    assert "missing: depth (depth of the tool; see --columns)" in refused(run_kr5, "contact", "still.csv")
    assert "found 1 names" in refused(run_kr5, "contact", "still.csv", "--columns", "t")
    assert "--cell is missing" in refused(run_kr5, "servo", "still.csv", "--write-cell", "new.yaml")
    assert "--joint: found 9" in refused(run_kr5, "servo", cases / "case-006", "--joint", "9")
    (tmp_path / "nan.csv").write_text("depth,force\n0,1\n0.1,nan\n")
    assert "nan.csv" in refused(run_kr5, "contact", "nan.csv")
    write_csv(tmp_path / "back.csv", ["depth", "force"], [np.linspace(0, 1e-3, 10), -np.linspace(0, 20, 10)])
    assert "force falls with depth" in refused(run_kr5, "contact", "back.csv")


def test_the_design_is_there_from_python():
    plant = identification.ForceLoopPlant()
    servo = cell.SecondOrder(**BOOK)
    plant.servo = servo
    loop = force.ForceLoopOptions()
    design = identification.design_force_loop(plant, loop)
    assert design.nominal.gain_limit == pytest.approx(0.714e-3, rel=0.005)
    matrix = identification.force_loop_matrix(plant, "start", design.nominal.gain_limit)
    assert np.abs(np.linalg.eigvals(matrix)).max() == pytest.approx(1.0, abs=1e-9)
    by_formula = identification.servo_from_overshoot(24.0, 0.7153, 3.096)
    assert by_formula.damping_ratio == pytest.approx(0.7454, abs=1e-4)


def test_identified_values_replace_the_effects_of_a_cell():
    believed = cell.load_cell(find_shipped_cell())
    believed.effects = cell.Effects(
        {
            "tool_delay": {"servo": {"delay": 0.06}},
            "joint_servo": {"joint3": {"natural_frequency": 30.0}},
            "contact_stiffness": {"contact": {"stiffness": 1e4}},
            "payload": {"tool": {"mass": 0.5, "com": [0.0, 0.0, 0.05]}},
            "ft_bias": {"fx": {"bias": 3.0}, "tz": {"bias": 0.2}},
            "coulomb_friction": {"joint1": {"coulomb": 20.0}},
        }
    )
    servo = cell.SecondOrder(**BOOK)
    identification.set_path_servo(believed, servo, 0.012)
    identification.set_joint_servo(believed, 1, servo, 0.012)
    identification.set_contact_stiffness(believed, 2e4)
    identification.set_tool_mass(believed, 2.9, [0.0, 0.0, 0.1])
    gain = np.eye(6)
    gain[0, 0], gain[0, 4], gain[0, 5] = 1.1, 0.3, 0.1
    bias = [0.0, 2.0, 0.0, 0.0, 0.0, 0.0]
    identification.set_wrench_sensor(believed, identification.ForceTorqueResult(bias=bias, gain=gain))
    assert believed.effects.to_dict() == {
        "coulomb_friction": {"joint1": {"coulomb": 20.0}},
        "ft_bias": {"fy": {"bias": 2.0}},
        "ft_gain": {"fx": {"gain": 1.1}},
        "ft_crosstalk": {"fx": {"source": 4, "gain": 0.3}},
    }
    assert believed.servo.tool.delay == BOOK["delay"] and believed.contact.stiffness == 2e4
    assert [j.natural_frequency for j in believed.servo.joint] == [45.0, 3.064, 30.0, 45.0, 45.0, 45.0]
    assert believed.tool.mass == 2.9
    with pytest.raises(ValueError, match="joint: found 6, expected 0 to 5"):
        identification.set_joint_servo(believed, 6, servo, 0.012)
