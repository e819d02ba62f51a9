"""The page about a diagnosis in a headless Chromium, and `kr5 gap explain`."""

import html
import json
import math
import subprocess
import sys
from pathlib import Path

import kr5
import kr5.cell
import kr5.gap
import kr5.io
import kr5.predict
import numpy as np
import pytest
import yaml

from kr5_tools.cli.numbers import format_percent
from kr5_tools.gap.terminal_report import cause_line
from kr5_tools.gap_report.clock_faults import clock_faults
from kr5_tools.gap_report.evidence import parameter_rows
from kr5_tools.gap_report.evidence_data import Evidence, gap_of, seen_noise
from kr5_tools.gap_report.messages import (
    column_text,
    dependence_text,
    display_unit,
    joint_name,
    next_steps,
    part_of,
    target_text,
    value_text,
    verdict_text,
    warning_notes,
)

PROTOCOL = {
    "format": "kr5-protocol/1",
    "home": [0.0, 0.02, -2.75, 0.0, -0.3, 1.571],
    "experiments": [
        {"name": "motion-1", "kind": "motion", "split": "fit", "signal": "fourier", "duration": 6.0},
        {"name": "motion-2", "kind": "motion", "split": "check", "signal": "way_points", "count": 2, "start": 10.0},
        {"name": "poses-1", "kind": "poses", "split": "fit", "count": 20},
        {"name": "poses-2", "kind": "poses", "split": "check", "count": 10},
        {"name": "press-1", "kind": "press", "split": "check", "speeds": [0.003]},
    ],
}
FRICTION = {"effect": "stribeck_friction", "target": "joint2", "values": {"stribeck": 25.0, "stribeck_velocity": 0.08}}
OFFSET = {"effect": "tool_offset", "target": "tool", "values": {"offset": [1e-3, 0.0, 2e-3]}}


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Recordings by name, as a simulated cell shows them that carries some effects; the nominal cell beside each."""
    folder = tmp_path_factory.mktemp("recordings")
    share = Path(__file__).resolve().parents[2] / "share"
    (folder / "protocol.yaml").write_text(yaml.safe_dump(PROTOCOL))
    for name, effects in (("worn", [FRICTION, OFFSET]), ("sound", [])):
        cell = kr5.cell.load_cell(share / "cells/kr5_arc.yaml")
        for e in effects:
            for parameter, value in e["values"].items():
                cell.set_effect(e["effect"], e["target"], parameter, value)
        kr5.cell.save_cell(cell, folder / f"{name}.yaml")
        done = subprocess.run(
            [
                sys.executable,
                "-m",
                "kr5_tools",
                "record",
                "--cell",
                f"{name}.yaml",
                "--protocol",
                "protocol.yaml",
                "-o",
                name,
                "--nominal",
            ],
            cwd=folder,
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
    return folder


def cause(truth, **changes):
    parameters = {
        name: {"value": value, "std": [1e-5] * 3 if isinstance(value, list) else 1e-3 * value, "unit": unit}
        for (name, value), unit in zip(
            truth["values"].items(), ("m",) if "offset" in truth["values"] else ("N.m", "rad/s")
        )
    }
    return {
        "effect": truth["effect"],
        "target": truth["target"],
        "probability": 0.97,
        "parameters": parameters,
        "gap_closed": 0.98,
        "tied_with": [],
        **changes,
    }


def place(group, gap, share=0.5, **depends):
    kind, column = group.split(".")
    return {
        "experiment": kind,
        "column": column,
        "target": "x",
        "gap": gap,
        "share": share,
        "depends_on": [depends] if depends else [],
    }


def diagnosis(folder, name, verdict, where=(), causes=(), unexplained=(), **more):
    data = {
        "format": "kr5-gap/1",
        "verdict": verdict,
        "where": list(where),
        "causes": list(causes),
        "unexplained": list(unexplained),
        "shrink": {
            "before": 9.4,
            "after": 1.02,
            "floor": 1.0,
            "before_ci": [9, 10],
            "after_ci": [1, 1.1],
            "columns": {f"{p['experiment']}.{p['column']}": [p["gap"], 1.0] for p in where},
        },
        "next_experiment": {"separates": [], "do": ""},
        "scatter": 0.0,
        "warnings": [],
        "input": {"recording": name},
        **more,
    }
    file = folder / f"{name}-{verdict}.json"
    file.write_text(json.dumps(data))
    return file


@pytest.fixture(scope="module")
def diagnoses(recorded):
    slow = place("motion.i2", 7.0, 0.6, variable="|qd2|", how="changes sign with qd2, below 0.1 rad/s", evidence=1.0)
    tool = place("poses.z", 12.0, 0.4, variable="q4", how="varies with it", evidence=1.0)
    tie = [{"effect": "coulomb_friction", "target": "joint2"}]
    warnings = [
        "22 samples are spikes and were left out",
        "noise of current is 1.10 +- 0.01 times what the cell declares; the measured noise is used",
    ]
    return {
        "explained": diagnosis(
            recorded,
            "worn",
            "explained",
            [slow, tool],
            [cause(FRICTION, tied_with=tie), cause(OFFSET)],
            warnings=warnings,
            next_experiment={
                "separates": ["stribeck_friction joint2", "coulomb_friction joint2"],
                "do": "run the motion faster",
            },
        ),
        "partly": diagnosis(recorded, "worn", "partly_explained", [slow, tool], [cause(FRICTION)], [tool]),
        "unknown": diagnosis(recorded, "worn", "unknown", [slow, tool], (), [slow, tool]),
        "healthy": diagnosis(recorded, "sound", "no_gap"),
    }


@pytest.fixture(scope="module")
def pages(diagnoses, recorded):
    for name, file in diagnoses.items():
        done = subprocess.run(
            [sys.executable, "-m", "kr5_tools", "report", str(file), "-o", f"{name}.html", "--png", f"{name}-png"],
            cwd=recorded,
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
    return recorded


@pytest.mark.parametrize("width", [1280, 390])
@pytest.mark.parametrize("name", ["explained", "partly", "unknown", "healthy"])
def test_a_page_opens_without_complaint_and_fits_the_width(pages, browser, name, width):
    browser.open_whole(pages / f"{name}.html", width)


def test_the_map_changes_its_colours_with_the_causes(pages, browser):
    browser.open(pages / "explained.html", 1280)
    picture = "document.getElementById('scene').toDataURL()"
    before = browser.evaluate(picture)
    browser.evaluate("document.querySelector('input[value=after]').click()")
    assert len(before) > 5000 and browser.evaluate(picture) != before
    assert browser.complaints() == []


def test_a_page_says_what_was_found_and_what_to_do(pages):
    page = (pages / "explained.html").read_text()
    for text in (
        "Explained.",
        "60 % of its excess sits in the current of joint 2",
        "Stribeck friction of joint 2",
        "25.000 ± 0.025 N m",
        "97 % probable",
        "falls to 1.02",
        "Coulomb friction of joint 2 would look the same",
        "run the motion faster",
        "22 samples are spikes",
        "current 1.10 ± 0.01",
        "Other effects in its place",
        "Next steps",
    ):
        assert text in page, text
    assert "structure remains in the residuals of the position z of the tool" in (pages / "partly.html").read_text()
    unknown = (pages / "unknown.html").read_text()
    assert "No effect of the catalogue explains it" in unknown and "What remains unexplained" in unknown
    healthy = (pages / "healthy.html").read_text()
    assert (
        "There is no gap" in healthy
        and "What noise looks like" in healthy
        and "What remains unexplained" not in healthy
    )


def test_every_plot_is_written_as_png(pages):
    names = {f.stem for f in (pages / "explained-png").glob("*.png")}
    assert {
        "map",
        "heat_before",
        "heat_after",
        "shrink",
        "rows_motion.i2",
        "against_motion.i2",
        "rows_poses.z",
        "against_poses.z",
    } <= names
    assert {f.stem for f in (pages / "healthy-png").glob("*.png")} >= {"map", "heat_before"}


def test_the_residuals_are_those_that_measure_counts_and_go_with_the_causes(recorded, diagnoses):
    recording = kr5.cell.load_recording(recorded / "worn")
    data = {**json.loads(diagnoses["explained"].read_text()), "warnings": []}
    evidence = Evidence(data, recording)
    measured = {
        (c.experiment, c.column): c.gap for c in kr5.gap.measure(recording, kr5.predict.FastSimulator()).columns
    }
    seen = {(c.experiment.name, c.name): gap_of(c.before) for c in evidence.columns}
    assert seen == pytest.approx(measured, rel=1e-9)
    assert evidence.gap("motion.i2") > 3 and evidence.gap("poses.z") > 3
    assert evidence.gap("motion.i2", "after") == pytest.approx(1, abs=0.1)
    assert evidence.gap("poses.z", without=0) == pytest.approx(evidence.gap("poses.z", "after"), rel=1e-6)
    assert evidence.gap("poses.z", without=1) == pytest.approx(evidence.gap("poses.z"), rel=1e-6)


def test_noise_is_counted_as_the_diagnosis_saw_it():
    seen = seen_noise(
        [
            "noise of current is 1.50 +- 0.01 times what the cell declares; the measured noise is used",
            "3 samples are spikes and were left out",
            "noise of force in press is 0.70 +- 0.02 times what the cell declares; the measured noise is used",
        ]
    )
    assert [(n.key, n.kind and str(n.kind), n.ratio) for n in seen] == [("current", None, 1.5), ("force", "press", 0.7)]
    warnings = ["noise of force in press is 0.70 +- 0.02 times what the cell declares; the measured noise is used"]
    said = warning_notes({"warnings": warnings})
    assert (
        "declared one by these factors: force in press 0.70 ± 0.02" in said[0][0] and "Correct the noise" in said[0][1]
    )
    (said,) = warning_notes({"warnings": warnings, "input": {"logs": ["a.csv"], "model": "arm.urdf"}})
    assert "neighbouring rows, and is taken so: force in press 0.70 ± 0.02" in said[0] and said[1] == ""


def test_an_effect_that_differs_is_told_with_or_without_what_it_differs_with():
    how = "coulomb_friction of joint3 differs with it"
    said = [dependence_text({"variable": variable, "how": how}) for variable in ("q3", "")]
    assert said[0].endswith("differs with the position of joint 3")
    assert said[1].endswith("Coulomb friction of joint 3 differs between columns or experiments")


def test_lengths_that_were_found_from_loads_alone_are_doubted():
    cause = {"effect": "link_length", "target": "joint2", "tied_with": [], "parameters": {}}
    data = {"verdict": "explained", "where": [{}], "causes": [cause], "unexplained": []}
    data |= {"next_experiment": {"do": "", "separates": []}, "scope": ["it has experiments of the kind motion only"]}
    assert "link length of joint 2: found from loads alone" in next_steps(data, "monday")[0].lower()
    assert "from loads alone" not in " ".join(next_steps({**data, "scope": []}, "monday"))


def test_an_experiment_that_the_diagnosis_does_not_know_is_planned_by_a_command_that_runs():
    planned = {"do": "kr5 gap plan searches for it", "separates": ["backlash joint1", "payload tool"]}
    data = {"verdict": "explained", "where": [{}], "causes": [], "unexplained": [], "next_experiment": planned}
    data["causes"] = [
        {"effect": "backlash", "target": "joint1", "tied_with": [{"effect": "payload", "target": "tool"}]}
    ]
    assert "`kr5 gap plan monday --separate backlash:joint1,payload:tool -o next.yaml`" in next_steps(data, "monday")[0]
    of_log = next_steps({**data, "input": {"logs": ["a.csv"]}}, "a.csv --model arm.urdf")[0]
    assert "`kr5 gap diagnose a.csv --model arm.urdf --write-recording made`, then `kr5 gap plan made" in of_log


def test_the_model_s_name_of_a_joint_is_left_out_only_where_it_has_the_same_number():
    assert joint_name({"target": "joint3", "joint": "joint3"}) == joint_name({"column": "tau3", "joint": "A3"}) == ""
    assert joint_name({"target": "joint3", "joint": "joint2"}) == "joint2"
    assert joint_name({"column": "tau3", "joint": "elbow"}) == "elbow"


def test_a_clock_fault_of_a_recording_is_told_with_the_entry_of_its_map():
    warning = "wrench of motion: logged 6.50 +- 0.25 ms early relative to the other columns; this is not an effect"
    (fault,) = clock_faults([warning, "3 samples are spikes and were left out"])
    assert fault.text == "the wrench of motion was logged 6.50 ± 0.25 ms early relative to the other columns"
    assert "columns.wrench: {delay: -0.0065} in the map" in fault.remedy("monday", of_logs=False)
    assert warning_notes({"warnings": [warning]}) == []


def test_explain_fits_an_effect_and_finds_its_size(recorded, run_kr5):
    done = run_kr5("gap", "explain", recorded / "worn", "tool_offset:tool", "--json", "-")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)["targets"][0]
    values = [float(p["value"]) for p in told["parameters"]]
    assert values == pytest.approx([1.0, 0.0, 2.0], abs=0.1)
    assert told["closed"] > 0.5 and any("position z of the tool" in text for text in told["for"])
    assert any("current of joint 2" in text for text in told["against"])


def test_explain_says_why_another_effect_is_not_blamed(recorded, diagnoses, run_kr5):
    done = run_kr5("gap", "explain", diagnoses["explained"], "coulomb_friction:joint2")
    assert done.returncode == 0, done.stderr
    text = " ".join(done.stdout.split())
    assert "in place of Stribeck friction of joint 2" in text and "Remaining gap: the current of joint 2" in text
    done = run_kr5("gap", "explain", diagnoses["explained"], "stribeck_friction:joint2", "--json", "-")
    told = json.loads(done.stdout)["targets"][0]
    assert told["closed"] > 0.9 and any("names it as a cause" in reason for reason in told["for"])


def test_explain_tells_the_verdict(diagnoses, run_kr5):
    done = run_kr5("gap", "explain", diagnoses["partly"])
    assert done.returncode == 0, done.stderr
    for text in ("The gap is 9.40 times the noise", "For it:", "Against it:", "Next steps"):
        assert text in done.stdout


def test_an_explained_verdict_has_a_page(diagnoses, run_kr5, browser, tmp_path):
    done = run_kr5("gap", "explain", diagnoses["partly"], "--json", "told.json")
    assert done.returncode == 0, done.stderr
    assert run_kr5("report", "told.json", "-o", "told.html").returncode == 0
    browser.open(tmp_path / "told.html", 1280)
    text = browser.evaluate("document.body.innerText")
    for words in (
        "Partly explained. The gap is 9.40 times the noise",
        f"told.json, of the recording {diagnoses['partly'].parent / 'worn'}",
        "Next steps",
        "Stribeck friction of joint 2, 97 % probable",
        "For it",
        "Against it",
    ):
        assert words in text, text
    data = json.loads((tmp_path / "told.json").read_text())
    for changes, words in (
        ({"effect": "stribeck_friction"}, "expected one of them"),
        ({"causes": [{**data["causes"][0], "for": "much"}]}, "causes[0].for: found 'much', expected a list"),
    ):
        (tmp_path / "bad.json").write_text(json.dumps({**data, **changes}))
        done = run_kr5("report", "bad.json")
        assert done.returncode == 2 and words in done.stderr, done.stderr


def test_an_explanation_is_not_written_over_its_diagnosis(diagnoses, run_kr5):
    done = run_kr5("gap", "explain", diagnoses["partly"], "--json", diagnoses["partly"])
    assert done.returncode == 2 and json.loads(diagnoses["partly"].read_text())["format"] == "kr5-gap/1"


def test_bad_input_is_refused(recorded, diagnoses, run_kr5, tmp_path):
    done = run_kr5("gap", "explain", diagnoses["explained"], "stribek")
    assert done.returncode == 2 and "stribeck_friction" in done.stderr
    done = run_kr5("gap", "explain", diagnoses["explained"], "payload:joint1")
    assert done.returncode == 2 and "expected one of tool" in done.stderr
    data = json.loads(diagnoses["explained"].read_text())
    for changes, words in (
        ({"verdict": "fine"}, "verdict: found 'fine'"),
        ({"causes": 3}, "causes: found 3, expected a list"),
        ({"where": [{}]}, "where[0].experiment: is missing"),
    ):
        (tmp_path / "bad.json").write_text(json.dumps({**data, **changes}))
        done = run_kr5("report", "bad.json")
        assert done.returncode == 2 and words in done.stderr and "bad.json" in done.stderr
    done = run_kr5("report", diagnoses["explained"], "--recording", tmp_path)
    assert done.returncode == 2 and "recording.yaml" in done.stderr
    assert not (tmp_path / "report.html").exists()


def test_without_its_recording_a_page_says_so(diagnoses, run_kr5, tmp_path):
    data = json.loads(diagnoses["explained"].read_text())
    (tmp_path / "alone.json").write_text(json.dumps({k: v for k, v in data.items() if k != "input"}))
    done = run_kr5("report", "alone.json")
    assert done.returncode == 0 and "--recording" in done.stderr
    page = (tmp_path / "report.html").read_text()
    assert "--recording FOLDER" in page and "Stribeck friction of joint 2" in page


def test_every_effect_of_the_catalogue_has_words():
    for effect in kr5.cell.effect_catalogue():
        assert effect.label and effect.shows_in and effect.remedy.endswith("."), effect.id


def test_a_mount_is_shown_as_its_difference_from_the_cell(share):
    cell = kr5.cell.load_cell(share / "cells/kr5_arc.yaml")
    T = (
        np.linalg.inv(cell.tool.T_flange_tool)
        @ cell.T_flange_camera()
        @ kr5.to_pose([0.002, 0, 0, 0, 0, math.radians(1)])
    )
    parameter = {"value": T.tolist(), "std": [1e-5] * 3 + [1e-4] * 3, "unit": "m, rad"}
    rows = parameter_rows({"effect": "hand_eye", "target": "camera", "parameters": {"T_E_C": parameter}}, cell)
    assert (rows[0]["name"], rows[0]["value"], rows[0]["unit"]) == ("shift along x", "2.000", "mm")
    assert float(rows[5]["value"]) == pytest.approx(1.0, abs=1e-3)


def test_a_vector_is_shown_beside_that_of_the_cell_component_by_component(share):
    cell = kr5.cell.load_cell(share / "cells/kr5_arc.yaml")
    links = cell.robot.links
    links[3].com = np.array([1e-18, -0.16, 0.004])  # what is left of a rotation
    robot = cell.robot
    robot.links = links
    cell.robot = robot
    parameter = {"value": [0.01, -0.15, 0.02], "std": [1e-3] * 3, "unit": "m"}
    cause = {"effect": "link_com", "target": "joint4", "parameters": {"com": parameter}}
    rows = parameter_rows(cause, cell)
    assert [row["name"] for row in rows] == ["com x", "com y", "com z"]
    assert [row["nominal"] for row in rows] == ["0", "-160", "4"]


def test_a_centre_of_mass_is_explained_and_drawn(recorded, run_kr5, tmp_path):
    done = run_kr5("gap", "explain", recorded / "sound", "link_com:joint2", "--json", "-")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)["targets"][0]
    assert [float(p["nominal"]) for p in told["parameters"]] == [-330.0, 10.0, 40.0]
    done = run_kr5("gap", "effects", "link_com", "--pictures", tmp_path / "pictures")
    assert done.returncode == 0 and (tmp_path / "pictures/link_com.png").is_file(), done.stderr


@pytest.mark.parametrize(
    "group, words, part",
    [
        ("motion.i3", "current of joint 3", "joint3"),
        ("motion.tz", "torque about z at the wrist", "sensor"),
        ("poses.rx", "orientation of the tool about x", "tool"),
        ("views.u", "image coordinate u of the board", "camera"),
        ("press.z", "height while pressing", "servo"),
        ("press.fz", "force z while pressing", "contact"),
        ("profile.z", "resting depth of the peg", "tube"),
        ("scan.z", "range of the scanner", "laser"),
    ],
)
def test_columns_have_words_and_parts(group, words, part):
    assert column_text(group) == words and part_of(group) == part


@pytest.mark.parametrize(
    "variable, how, words",
    [
        ("qd3", "below 0.1 rad/s", "is largest where the velocity of joint 3 is below 0.1 rad/s"),
        (
            "|qd3|",
            "changes sign with qd3, varies with it",
            "changes sign with the direction of motion and varies with the speed of joint 3",
        ),
        ("t", "grows with it", "grows with the time"),
        ("q4", "constant offset", "is a constant offset"),
        ("predicted i3", "grows with it", "grows with the simulated current of joint 3"),
        ("zcd", "grows with it", "grows with the commanded vertical speed"),
        ("cx", "grows with it", "grows with the place x of the peg"),
    ],
)
def test_dependences_have_words(variable, how, words):
    assert dependence_text({"variable": variable, "how": how}) == words


def test_targets_of_the_wrench_have_the_words_and_units_of_their_columns():
    assert [target_text(t) for t in ("fx", "tz", "joint3")] == ["force x", "torque about z", "joint 3"]
    assert [display_unit("N or N.m", [1.0], t)[1] for t in ("fx", "tz")] == ["N", "N m"]
    assert dependence_text({"variable": "predicted z", "how": "grows with it"}, "scan").endswith("range of the scanner")


def test_no_share_is_said_to_be_all_or_nothing():
    assert [format_percent(s) for s in (1.0, 0.997, 0.5, 0.001)] == [
        "more than 99.9 %",
        "more than 99 %",
        "50 %",
        "less than 1 %",
    ]
    assert "No correction is needed" in verdict_text({"verdict": "no_gap", "where": [], "causes": [], "shrink": {}})


LIMIT = "motion-1 commands no motion: it cannot show friction, inertia and servos"


def test_the_verdict_states_what_the_recording_cannot_show():
    limited = {"verdict": "no_gap", "where": [], "causes": [], "shrink": {}, "scope": [LIMIT]}
    text = verdict_text(limited)
    assert text.startswith("Within what the recording can show there is no gap") and text.endswith(f"M{LIMIT[1:]}.")
    assert "No correction is needed" not in text and "There is no gap:" not in text
    assert "before the cell is trusted there" in next_steps(limited, "monday")[0]
    assert "Use the cell as it is" in next_steps({**limited, "scope": []}, "monday")[0]


@pytest.mark.parametrize("rows", [800, 4])
def test_the_page_of_an_arm_at_rest_claims_no_more_than_it_shows(kr5_here, recorded, tmp_path, rows):
    recording = kr5.cell.load_recording(recorded / "sound")
    random = np.random.default_rng(6)
    experiments = []
    for e in recording.experiments:
        if str(e.kind) != "motion":
            continue
        t = np.asarray(e["t"])[:rows]
        given = ["t", *(f"qc{i + 1}" for i in range(6))]
        still = kr5.cell.Experiment(name=e.name, kind="motion", file=e.file, split=e.split)
        q = np.tile(PROTOCOL["home"], (len(t), 1))
        still.data = kr5.io.Table(given, np.column_stack([t, q]))
        currents = [f"i{i + 1}" for i in range(6)]
        shown = kr5.predict.FastSimulator().predict(recording.cell, still)
        noisy = [np.array(shown[c]) + random.normal(0, recording.cell.noise.current, len(t)) for c in currents]
        still.data = kr5.io.Table([*given, *currents], np.column_stack([t, q, *noisy]))
        experiments.append(still)
    kr5.cell.save_recording(kr5.cell.Recording(recording.cell, experiments), tmp_path / "still")
    done = kr5_here("gap", "diagnose", "still", "--report", "page.html", "--json", "gap.json")
    assert done.exit_code == 0, done.output
    data = json.loads((tmp_path / "gap.json").read_text())
    limit = "commands no motion" if rows > 10 else "has 4 rows"
    assert data["verdict"] == "no_gap" and any(limit in text for text in data["scope"])
    assert limit in done.output and "what the recording can show" in done.output
    page = html.unescape((tmp_path / "page.html").read_text())
    assert "No gap in what the recording can show" in page and limit in page
    assert "There is no gap:" not in page and "No correction is needed" not in page


def causes_of(count):
    parameters = {"viscous": {"value": 3.0, "std": 0.1, "unit": "N m s/rad"}}
    shared = {"probability": 0.99, "gap_closed": 0.0, "tied_with": [], "parameters": parameters}
    return [{"effect": "viscous_friction", "target": f"joint{k + 1}", **shared} for k in range(count)]


@pytest.mark.parametrize("count", [3, 6])
def test_a_verdict_names_at_most_three_causes(count):
    where = [place("motion.i2", 7.0, 0.6)]
    shrink = {"before": 7.0, "after": 1.0}
    data = {"verdict": "explained", "where": where, "causes": causes_of(count), "unexplained": [], "shrink": shrink}
    text = verdict_text(data)
    assert text.startswith("The gap is 7.00 times the noise in the column above the limit; ")
    assert text.count("viscous friction of joint") == 3
    assert ("and 3 more, below." in text) == (count == 6)


def test_one_remedy_is_told_once_for_all_joints():
    where = [place("motion.i2", 7.0, 0.6)]
    other = {**causes_of(1)[0], "effect": "ft_bias", "target": "fx"}
    data = {"verdict": "explained", "where": where, "causes": [*causes_of(4), other], "unexplained": []}
    steps = next_steps(data | {"next_experiment": {"do": "", "separates": []}}, "monday")
    remedy = kr5.cell.find_effect("viscous_friction").remedy
    assert [step for step in steps if remedy in step] == [f"Viscous friction of joints 1, 2, 3 and 4: {remedy}"]
    assert any(step.endswith(kr5.cell.find_effect("ft_bias").remedy) for step in steps)


@pytest.mark.parametrize(
    ("model", "effects", "words"),
    [
        ("a.urdf", ("viscous_friction",), ("--write-model tuned.urdf`. A gap", "--model tuned.urdf`")),
        ("a.yaml", ("stribeck_friction",), ("--write-model tuned.yaml`. A gap", "--model tuned.yaml`")),
        (
            "a.urdf",
            ("viscous_friction", "rotor_inertia"),
            (
                "--write-model tuned.urdf --write-cell tuned.yaml`. A URDF cannot hold rotor inertia of joint 2;",
                "--model tuned.yaml`",
            ),
        ),
        ("a.xml", ("viscous_friction", "rotor_inertia"), ("--write-model tuned.xml`. A gap", "--model tuned.xml`")),
        (
            "a.xml",
            ("stribeck_friction",),
            ("`kr5 gap diagnose log --write-cell tuned.yaml`. An MJCF cannot hold Stribeck friction of joint 2;",),
        ),
        (None, ("stribeck_friction",), ("log --write-cell tuned.yaml`. A gap", "--cell tuned.yaml`")),
    ],
)
def test_what_the_format_of_the_model_cannot_hold_is_put_into_a_cell(recorded, model, effects, words):
    values = {
        "viscous_friction": ("joint2", {"viscous": 40.0}),
        "stribeck_friction": ("joint2", {"stribeck": 9.0, "stribeck_velocity": 0.1}),
        "rotor_inertia": ("joint2", {"rotor_inertia": 3.0}),
    }
    cell = kr5.cell.load_recording(recorded / "sound").cell
    causes = []
    for effect in effects:
        target, parameters = values[effect]
        for name, value in parameters.items():
            cell.set_effect(effect, target, name, value)
        causes.append({"effect": effect, "target": target, "tied_with": []})
    data = {"verdict": "explained", "where": [place("motion.i2", 7.0)], "causes": causes, "unexplained": []}
    steps = next_steps(data | {"next_experiment": {"do": "", "separates": []}}, "log", model, cell)
    assert all(text in steps[-1] for text in words), steps[-1]


def test_a_cause_that_explains_nothing_measurable_is_not_said_to_explain_0_percent():
    assert "explains less than 1 % of the gap" in cause_line(causes_of(1)[0])
    assert [format_percent(share) for share in (-0.1, 0.0, 0.004, 0.5)] == [*["less than 1 %"] * 3, "50 %"]


def test_components_of_unlike_accuracy_have_their_own_uncertainty():
    parameter = {"value": [0.01, 0.02, 0.03], "std": [0.001, 0.001, 0.004], "unit": "m"}
    assert value_text(parameter, "joint3") == "10.0 ± 1.0, 20.0 ± 1.0, 30.0 ± 4.0 mm"
    assert value_text(parameter | {"std": [0.001] * 3}, "joint3") == "10.0, 20.0, 30.0 ± 1.0 mm"


def test_one_component_of_the_wrench_is_one_place():
    where = [place("press.fy", 15.1, 0.34), place("motion.fy", 15.0, 0.33), place("profile.fy", 15.0, 0.33)]
    text = verdict_text(
        {
            "verdict": "unknown",
            "where": where,
            "causes": [],
            "unexplained": where,
            "shrink": {"before": 15.1, "after": 15.1},
        }
    )
    assert "the force y at the wrist, in presses on the bench, free motion and rolls of the peg" in text


def test_an_effect_of_ones_own_has_a_page_without_curves_after(recorded, browser, run_kr5, tmp_path):
    own = {
        "effect": "my_fan",
        "target": "joint2",
        "probability": 0.9,
        "gap_closed": 0.9,
        "tied_with": [],
        "parameters": {"size": {"value": 3.0, "std": 0.1, "unit": "N m"}},
    }
    rest = place("poses.z", 3.0, 0.4, variable="q1", how="grows with it", evidence=1.0)
    file = diagnosis(recorded, "worn", "partly_explained", [place("motion.i2", 7.0, 0.6), rest], [own], [rest])
    done = run_kr5("report", file, "-o", "own.html")
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "own.html").read_text()
    assert "my_fan is not in the catalogue" in page and "its gap grows with the position of joint 1" in page
    browser.open(tmp_path / "own.html", 390)
    assert browser.complaints() == []
