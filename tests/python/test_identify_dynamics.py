"""`kr5 identify dynamics` on the simulated KR5, on a raw log with a URDF, and on faulty logs."""

import json

import kr5.cell
import kr5.io
import numpy as np
import pytest
import yaml

from kr5_tools.identify.dynamics_page import torque_plot
from kr5_tools.pages.plot_style import plt


@pytest.fixture(scope="module")
def case(reference):
    """The recording of the KR5 that no effect has changed."""
    return reference / "cases/case-006"


def test_a_recording_gives_52_base_parameters_and_predicts_what_was_left_out(tmp_path, case, run_kr5):
    done = run_kr5(
        "identify", "dynamics", case, "-o", "dynamics.json", "--page", "page.html", "--write-cell", "new.yaml"
    )
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "dynamics.json").read_text())
    assert data["format"] == "kr5-dynamics/1"
    result = data["result"]
    assert len(result["values"]) == 52
    table_4_4 = (0.116, 0.1436, 0.122, 0.2187, 0.3187, 0.378)
    assert (np.array(result["errors"]["held_out"]["relative"]) < table_4_4).all()
    believed = kr5.cell.load_cell(case / "cell.yaml").drives.friction
    row = {f["name"]: f for f in data["figures"]}
    for k in range(6):
        name = f"fc{k + 1}"
        assert abs(row[name]["value"] - believed.coulomb[k]) < 4 * row[name]["std"] + 0.03 * believed.coulomb[k]
    page = (tmp_path / "page.html").read_text()
    assert "Torques by joint" in page and "held out" in page and "Joint 6" in page
    assert kr5.cell.load_cell(tmp_path / "new.yaml").drives.friction.coulomb == pytest.approx(believed.coulomb, rel=0.1)
    shown = run_kr5("report", "dynamics.json", "-o", "again.html", "--png", "plots")
    assert shown.returncode == 0, shown.stderr
    assert (tmp_path / "plots/torque_6.png").exists()


def test_the_data_choose_whether_torques_are_smoothed(tmp_path, share, run_kr5):
    """The dry friction of the shipped log is as its truth says, without an option; smoothing rounds off its steps."""
    truth = yaml.safe_load((share / "data/arm_log/truth.yaml").read_text())
    true = truth["coulomb_friction"]["joint3"]["coulomb"]
    words = ["identify", "dynamics", share / "data/arm_log/joint_states.csv", "--cell", share / "data/arm_log/arm.urdf"]
    found = {}
    for options in ((), ("--smooth-torques",), ("--no-smooth-torques",)):
        done = run_kr5(*words, *options, "-o", "dynamics.json")
        assert done.returncode == 0 and ("fitted as logged" in done.stderr) == (not options), done.stderr
        figures = json.loads((tmp_path / "dynamics.json").read_text())["figures"]
        found[options] = next((f["value"], f["std"]) for f in figures if f["name"] == "fc3")
    value, std = found[()]
    assert abs(value - true) < 3 * std < 0.1 and found[()] == found["--no-smooth-torques",]
    assert abs(found["--smooth-torques",][0] - true) > 0.3


def test_a_measured_torque_is_seen_behind_the_one_that_the_model_predicts():
    t = np.linspace(0, 1, 50)
    torque = np.sin(6 * t)[:, None]
    figure = torque_plot({"fitted": {"t": t, "measured": torque, "predicted": torque}}, 0)
    measured, predicted = figure.axes[0].get_lines()
    assert (measured.get_label(), predicted.get_label()) == ("measured", "predicted")
    assert measured.get_linewidth() > 3 * predicted.get_linewidth()
    legend, axes = (part.get_window_extent() for part in (figure.legends[0], figure.axes[0]))
    assert not legend.overlaps(axes)  # the legend hides no curve
    plt.close(figure)


def test_plots_of_joints_fill_their_cards(tmp_path, case, run_kr5, browser):
    assert run_kr5("identify", "dynamics", case, "--page", "page.html").returncode == 0
    browser.open_whole(tmp_path / "page.html", 1200)
    widths = browser.evaluate(
        "[...document.querySelectorAll('figure.whole')].map(f => f.querySelector('svg').clientWidth / f.clientWidth)"
    )
    assert len(widths) == 6 and min(widths) > 0.9


def raw_log(folder, case, change=None):
    """The first motion as a log of torques on the joint side."""
    cell = kr5.cell.load_cell(case / "cell.yaml")
    table = kr5.io.load_csv(case / "motion-1.csv")
    q = np.column_stack([table[f"q{k + 1}"] for k in range(6)])
    i = np.column_stack([table[f"i{k + 1}"] for k in range(6)])
    tau = (i * cell.drives.torque_constant) @ cell.drives.structure
    columns = {"t": np.asarray(table["t"])} | {f"q{k + 1}": q[:, k] for k in range(6)}
    columns |= {f"tau{k + 1}": tau[:, k] for k in range(6)}
    if change:
        change(columns)
    rows = np.column_stack(list(columns.values()))
    text = "\n".join([",".join(columns), *(",".join(f"{v:.9g}" for v in row) for row in rows)]) + "\n"
    (folder / "log.csv").write_text(text)
    return case / "cell.yaml"


def test_a_raw_log_and_a_urdf_are_enough(tmp_path, case, run_kr5):
    cell = raw_log(tmp_path, case)
    kr5.cell.export_urdf(kr5.cell.load_cell(cell), tmp_path / "arm.urdf")
    done = run_kr5("identify", "dynamics", "log.csv", "--cell", "arm.urdf", "--json", "out.json")
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "out.json").read_text())
    assert data["held_out"]["total"] < 0.15
    assert any(note.startswith("tau: tau1 to tau6") for note in data["input"]["notes"])


def test_terms_and_estimate_are_chosen_and_told(tmp_path, case, run_kr5):
    cell = raw_log(tmp_path, case)
    command = ("identify", "dynamics", "log.csv", "--cell", cell, "--json")
    assert run_kr5(*command, "plain.json").returncode == 0
    done = run_kr5(*command, "chosen.json", "--choose-terms", "--choose-estimate")
    assert done.returncode == 0, done.stderr
    plain, chosen = (json.loads((tmp_path / f"{name}.json").read_text()) for name in ("plain", "chosen"))
    assert plain["result"]["estimate"]["estimator"] == "weighted" and plain["result"]["estimate"]["min_speed"] == 0
    # The bodies of the cell are those of the simulated arm, so they help.
    assert chosen["result"]["estimate"]["estimator"] == "consistent"
    assert chosen["held_out"]["total"] < plain["held_out"]["total"]
    refused = run_kr5(*command, "out.json", "--choose-estimate", "--estimator", "robust")
    assert refused.returncode == 2 and "choose_estimate" in refused.stderr


def fast_speed(columns):
    for k in range(6):
        columns[f"qd{k + 1}"] = (3 if k == 0 else 1) * np.gradient(columns[f"q{k + 1}"], columns["t"])


def missing(columns):
    columns["tau1"][50] = np.nan


def saturated(columns):
    columns["tau2"] = np.minimum(columns["tau2"], 0.5 * columns["tau2"].max())


def frozen(columns):
    columns["tau3"][300:420] = columns["tau3"][300]


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (saturated, "tau2: flat at its extreme"),
        (frozen, "tau3: does not change although the arm moves from 3.6 to 5.0"),
        (fast_speed, "qd1: 3"),
        (missing, "tau1: no number in 1 of"),
    ],
)
def test_faulty_logs_are_refused_with_column_and_span(tmp_path, case, run_kr5, change, expected):
    cell = raw_log(tmp_path, case, change)
    done = run_kr5("identify", "dynamics", "log.csv", "--cell", cell, "-o", "out.json")
    assert done.returncode == 2
    text = " ".join(done.stderr.split())
    assert "the log cannot be used" in text and expected in text
    assert not (tmp_path / "out.json").exists()


def test_a_log_needs_its_arm(tmp_path, case, run_kr5):
    raw_log(tmp_path, case)
    done = run_kr5("identify", "dynamics", "log.csv")
    assert done.returncode == 2 and "a log needs its arm: --cell" in " ".join(done.stderr.split())
    done = run_kr5("identify", "dynamics", tmp_path)
    assert done.returncode == 2


UNBLURRED = ("--no-smooth-torques", "--min-speed", "0.02")  # friction at its reversals, as the guide has it


def warming(columns):
    """Dry friction of joint 3 that falls by 0.3 N m a degree, with the temperatures of all motors in K."""
    t = columns["t"]
    for k in range(6):
        columns[f"motor_temp_{k + 1}_K"] = 293 + k + 1.5 * t + 8 * np.sin(0.9 * t + k)
    v = np.gradient(columns["q3"], t)
    columns["tau3"] = columns["tau3"] - 0.3 * (columns["motor_temp_3_K"] - 293.15) * np.tanh(v / 0.01)


def cabinet(columns):
    """The same law with one temperature for all, in deg C, of a slow sensor."""
    warming(columns)
    third = columns["motor_temp_3_K"] - 273.15
    for k in range(6):
        del columns[f"motor_temp_{k + 1}_K"]
    third[np.arange(len(third)) % 5 != 0] = np.nan
    columns["temperature"] = third


@pytest.mark.parametrize(
    ("change", "note"),
    [
        (warming, "temperatures: motor_temp_1_K to motor_temp_6_K [K, from the name]"),
        (cabinet, "temperatures: temperature to temperature [deg C, from the size]"),
    ],
)
def test_friction_that_follows_a_logged_temperature_is_chosen(tmp_path, case, run_kr5, change, note):
    cell = raw_log(tmp_path, case, change)
    done = run_kr5("identify", "dynamics", "log.csv", "--cell", cell, "--choose-terms", *UNBLURRED, "-o", "out.json")
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "out.json").read_text())
    assert any(n.startswith(note) for n in data["input"]["notes"])
    assert [t["temperature"] for t in data["result"]["terms"]] == [False, False, True, False, False, False]
    row = next(f for f in data["figures"] if f["name"].startswith("fcT3"))
    assert abs(row["value"] + 0.3) < 4 * row["std"] and row["std"] < 0.03


def absurd(columns):
    columns["motor_temp_c"] = np.full(len(columns["t"]), 999.0)


def test_temperatures_of_no_drive_are_refused_unless_accepted(tmp_path, case, run_kr5):
    cell = raw_log(tmp_path, case, absurd)
    words = ("identify", "dynamics", "log.csv", "--cell", cell, "-o", "out.json")
    done = run_kr5(*words)
    assert done.returncode == 2
    assert "motor_temp_c: 999 to 999, expected -40 to 200 deg C" in " ".join(done.stderr.split())
    assert run_kr5(*words, "--accept", "temperature_range").returncode == 0


DAMAGED = [
    ("identification", "identify dynamics recording -o out.json", "recording", ("recording/*",), ("out.json",), 2)
]
