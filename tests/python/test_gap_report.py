"""The page about a diagnosis in a headless Chromium, and `kr5 gap explain`."""

import html
import json
import math
from pathlib import Path

import kr5
import kr5.cell
import kr5.gap
import kr5.io
import kr5.predict
import numpy as np
import pytest
import yaml
from kr5.gap import Cause, ColumnExcess, Dependence, Diagnosis, EffectName, ParameterEstimate

from command_runner import run_command
from kr5_tools.cli.numbers import format_number, format_percent
from kr5_tools.gap.terminal_report import cause_line
from kr5_tools.gap_report.clock_faults import clock_remedy
from kr5_tools.gap_report.diagnosis_file import DiagnosisFile, read_diagnosis
from kr5_tools.gap_report.evidence_data import Evidence, display_variable
from kr5_tools.gap_report.messages import next_steps
from kr5_tools.gap_report.page import parts_of
from kr5_tools.gap_report.parameter_rows import parameter_rows

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
        words = ["record", "--cell", f"{name}.yaml", "--protocol", "protocol.yaml", "-o", name, "--nominal"]
        done = run_command(*words, cwd=folder)
        assert done.returncode == 0, done.stderr
    return folder


def cause(truth, **changes):
    parameters = [
        ParameterEstimate(
            name=name,
            value=np.atleast_1d(value).tolist(),
            std=[1e-5] * 3 if isinstance(value, list) else [1e-3 * value],
            unit=unit,
        )
        for (name, value), unit in zip(
            truth["values"].items(), ("m",) if "offset" in truth["values"] else ("N.m", "rad/s")
        )
    ]
    values = {"probability": 0.97, "explained_fraction": 0.98, **changes}
    return Cause(effect=truth["effect"], target=truth["target"], parameters=parameters, **values)


def place(group, gap, share=0.5, depends_on=()):
    kind, column = group.split(".")
    target = kr5.cell.find_column(kind, column).target
    return ColumnExcess(experiment=kind, column=column, target=target, gap=gap, share=share, depends_on=depends_on)


def depends(symbol, shape, **values):
    return Dependence(variable=kr5.gap.find_variable(symbol), shape=shape, evidence=1.0, **values)


def diagnosed(verdict, where=(), causes=(), unexplained=(), **more):
    return Diagnosis(
        verdict=verdict,
        where=where,
        causes=causes,
        unexplained=unexplained,
        reduction={
            "before": 9.4 if where else 1.0,
            "after": 1.02,
            "before_ci": {"low": 9, "high": 10},
            "after_ci": {"low": 1, "high": 1.1},
            "columns": [{"column": f"{p.experiment}.{p.column}", "before": p.gap, "after": 1.0} for p in where],
        },
        **more,
    )


def diagnosis(folder, name, verdict, where=(), causes=(), unexplained=(), **more):
    data = json.loads(diagnosed(verdict, where, causes, unexplained, **more).to_json())
    file = folder / f"{name}-{verdict}.json"
    file.write_text(json.dumps({**data, "input": {"recording": name}}))
    return file


@pytest.fixture(scope="module")
def diagnoses(recorded):
    slow = place("motion.i2", 7.0, 0.6, [depends("|qd2|", "below", sign_joint=2, upper=0.1, unit="rad/s")])
    tool = place("poses.z", 12.0, 0.4, [depends("q4", "varies")])
    tie = [EffectName(effect="coulomb_friction", target="joint2")]
    return {
        "explained": diagnosis(
            recorded,
            "worn",
            "explained",
            [slow, tool],
            [cause(FRICTION, tied_with=tie), cause(OFFSET)],
            spikes=22,
            noise=[kr5.gap.NoiseRatio(key="current", ratio=1.1, std=0.01)],
            next_experiment={
                "separates": [EffectName(effect="stribeck_friction", target="joint2"), *tie],
                "kind": "motion",
                "what": "run the motion faster",
                "separation": 4.4,
            },
        ),
        "partly": diagnosis(recorded, "worn", "partly_explained", [slow, tool], [cause(FRICTION)], [tool]),
        "unknown": diagnosis(recorded, "worn", "unknown", [slow, tool], (), [slow, tool]),
        "healthy": diagnosis(recorded, "sound", "no_gap"),
    }


@pytest.fixture(scope="module")
def pages(diagnoses, recorded):
    for name, file in diagnoses.items():
        done = run_command("report", file, "-o", f"{name}.html", "--png", f"{name}-png", cwd=recorded)
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
        "60 % of the excess sits in the current of joint 2 (7.00 times the noise)",
        "Stribeck friction of joint 2",
        "25.000 ± 0.025 N m",
        "97 % probable",
        "falls from 9.40 to 1.02",
        "Coulomb friction of joint 2 would look the same",
        "run the motion faster (4.4 standard deviations expected",
        "22 samples are spikes",
        "current 1.10 ± 0.01",
        "Other effects in its place",
        "Next steps",
    ):
        assert text in page, text
    assert "structure remains in the residuals of the position z of the tool" in (pages / "partly.html").read_text()
    unknown = (pages / "unknown.html").read_text()
    assert "No effect of the catalogue explains the gap of 9.40 times the noise" in unknown
    assert "What remains unexplained" in unknown
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
    found = read_diagnosis(diagnoses["explained"]).found
    found.noise = []
    evidence = Evidence(found, recording)
    measured = {
        (c.experiment, c.column): c.gap for c in kr5.gap.measure(recording, kr5.predict.FastSimulator()).columns
    }
    seen = {(c.experiment.name, c.name): kr5.gap.residual_gap(c.before) for c in evidence.columns}
    assert seen == pytest.approx(measured, rel=1e-9)
    assert evidence.gap("motion.i2") > 3 and evidence.gap("poses.z") > 3
    assert evidence.gap("motion.i2", "after") == pytest.approx(1, abs=0.1)
    assert evidence.gap("poses.z", without=0) == pytest.approx(evidence.gap("poses.z", "after"), rel=1e-6)
    assert evidence.gap("poses.z", without=1) == pytest.approx(evidence.gap("poses.z"), rel=1e-6)


def test_before_and_after_of_a_part_are_those_of_one_column(recorded, diagnoses):
    found = read_diagnosis(diagnoses["explained"]).found
    evidence = Evidence(found, kr5.cell.load_recording(recorded / "worn"))
    for part in parts_of(evidence, found):
        assert part["after"]["group"] == part["before"]["group"]
        assert part["after"]["gap"] == pytest.approx(float(evidence.gap(part["before"]["group"], "after")))
    found = read_diagnosis(diagnoses["partly"]).found  # where a column is left above the floor, it is the one
    left = {p["id"]: p["after"]["group"] for p in parts_of(Evidence(found, evidence.recording), found)}
    assert "poses.z" in left.values()


def test_noise_is_counted_as_the_diagnosis_measured_it(recorded):
    ratio = 1 + 1 / 3
    found = diagnosed("no_gap", noise=[{"key": "current", "ratio": ratio, "std": 0.01}])
    (seen,) = kr5.gap.measured_noise(kr5.gap.diagnosis_from_json(found.to_json()))
    assert (seen.key, seen.kind, seen.ratio) == ("current", None, ratio)  # no digit is lost on the way
    recording = kr5.cell.load_recording(recorded / "sound")
    plain, scaled = Evidence(diagnosed("no_gap"), recording), Evidence(found, recording)
    assert scaled.gap("motion.i3") == pytest.approx(plain.gap("motion.i3") / ratio, rel=1e-9)
    assert scaled.gap("poses.z") == pytest.approx(plain.gap("poses.z"), rel=1e-9)


def test_a_description_of_a_robot_declares_no_noise():
    found = diagnosed("no_gap", noise=[{"key": "force", "kind": "press", "ratio": 0.7, "std": 0.02}])
    for model, words, meaning in (
        ("cell.yaml", "declared one by these factors: force in press 0.70 ± 0.02", "Correct the noise"),
        ("arm.urdf", "neighbouring rows, and is taken so: force in press 0.70 ± 0.02", ""),
    ):
        file = DiagnosisFile(found, {"logs": ["a.csv"], "model": model})
        (note,) = kr5.gap.notes(found, file.noise_declared)
        assert words in note.text and meaning in note.meaning and bool(meaning) == bool(note.meaning)


@pytest.mark.parametrize(
    ("symbol", "more", "shown"),
    [
        ("q2", {}, lambda q, v, a: q),
        ("qd2", {}, lambda q, v, a: v),
        ("|qd2|", {"sign_joint": 2}, lambda q, v, a: np.abs(v)),
        ("qdd2", {}, lambda q, v, a: a),
        ("t", {}, None),
    ],
)
def test_a_residual_is_drawn_over_what_it_depends_on(recorded, symbol, more, shown):
    evidence = Evidence(diagnosed("no_gap"), kr5.cell.load_recording(recorded / "sound"))
    column = next(c for c in evidence.columns if c.group == "motion.i2")
    values, sign, unit = display_variable(column, depends(symbol, "varies", **more))
    t, q = (np.asarray(column.experiment[name]) for name in ("t", "qc2"))
    step = (t[-1] - t[0]) / (len(t) - 1)
    speed = np.gradient(q, step)
    expected = t if shown is None else shown(q, speed, np.gradient(speed, step))
    assert values == pytest.approx(expected, abs=1e-12) and unit.startswith("[")
    moving = np.abs(speed) > 1e-4  # [rad/s], below which a joint has no direction
    assert sign == pytest.approx(np.where(moving, np.sign(speed), 0.0) if more else np.ones(len(q)))


def test_lengths_that_were_found_from_loads_alone_are_doubted():
    causes = [Cause(effect="link_length", target="joint2")]
    where = [place("motion.i2", 7.0)]
    for scope, doubted in (([{"reason": "one_kind", "kind": "motion"}], True), ([], False)):
        steps = next_steps(DiagnosisFile(diagnosed("explained", where, causes, scope=scope)), "monday")
        assert any("link length of joint 2: found from loads alone" in step.lower() for step in steps) == doubted


def test_an_experiment_that_the_diagnosis_does_not_know_is_planned_by_a_command_that_runs():
    names = [EffectName(effect="backlash", target="joint1"), EffectName(effect="payload", target="tool")]
    causes = [Cause(effect="backlash", target="joint1", tied_with=names[1:])]
    found = diagnosed("explained", [place("motion.i2", 7.0)], causes, next_experiment={"separates": names})
    steps = next_steps(DiagnosisFile(found), "monday")
    assert "`kr5 gap plan monday --separate backlash:joint1,payload:tool -o next.yaml`" in steps[0]
    of_log = next_steps(DiagnosisFile(found, {"logs": ["a.csv"]}), "a.csv --model arm.urdf")[0]
    assert "`kr5 gap diagnose a.csv --model arm.urdf --write-recording made`, then `kr5 gap plan made" in of_log


def test_a_clock_fault_is_told_with_the_entry_of_its_map():
    fault = kr5.gap.ClockFault(group="wrench", kinds=["motion"], delay=-0.0065, std=0.00025)
    assert fault.text == "the wrench of motion was logged 6.50 ± 0.25 ms early relative to the other columns"
    assert "columns.wrench: {delay: -0.0065} in the map" in clock_remedy(fault, "monday", of_logs=False)
    fault = kr5.gap.ClockFault(group="torques", kinds=["motion"], delay=0.0316, std=0.0002)
    assert "`kr5 gap diagnose a.csv --set columns.tau.delay=0.0316`" in clock_remedy(fault, "a.csv", of_logs=True)


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
    for text in ("the gap falls from 9.40 to 1.02 times the noise", "For it:", "Against it:", "Next steps"):
        assert text in done.stdout


def test_an_explained_verdict_has_a_page(diagnoses, run_kr5, browser, tmp_path):
    done = run_kr5("gap", "explain", diagnoses["partly"], "--json", "told.json")
    assert done.returncode == 0, done.stderr
    assert run_kr5("report", "told.json", "-o", "told.html").returncode == 0
    browser.open(tmp_path / "told.html", 1280)
    text = browser.evaluate("document.body.innerText")
    for words in (
        "Partly explained. Cause: Stribeck friction of joint 2 (25.000 ± 0.025 N m, 97 % probable). With it the gap",
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
    assert done.returncode == 2 and json.loads(diagnoses["partly"].read_text())["format"] == "kr5-gap/2"


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
        (
            {"clock_faults": [{"group": "wrench", "delay": "late"}]},
            "clock_faults[0].delay: found the quoted text 'late'",
        ),
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
    std = [1e-5] * 3 + [1e-4] * 3
    parameter = ParameterEstimate(name="T_E_C", value=T.ravel().tolist(), std=std, unit="m, rad")
    rows = parameter_rows(Cause(effect="hand_eye", target="camera", parameters=[parameter]), cell)
    assert (rows[0]["name"], rows[0]["value"], rows[0]["unit"]) == ("shift along x", "2.000", "mm")
    assert float(rows[5]["value"]) == pytest.approx(1.0, abs=1e-3)


def test_a_vector_is_shown_beside_that_of_the_cell_component_by_component(share):
    cell = kr5.cell.load_cell(share / "cells/kr5_arc.yaml")
    links = cell.robot.links
    links[3].com = np.array([1e-18, -0.16, 0.004])  # what is left of a rotation
    robot = cell.robot
    robot.links = links
    cell.robot = robot
    parameter = ParameterEstimate(name="com", value=[0.01, -0.15, 0.02], std=[1e-3] * 3, unit="m")
    rows = parameter_rows(Cause(effect="link_com", target="joint4", parameters=[parameter]), cell)
    assert [row["name"] for row in rows] == ["com x", "com y", "com z"]
    assert [row["nominal"] for row in rows] == ["0", "-160", "4"]


def test_a_centre_of_mass_is_explained_and_drawn(recorded, run_kr5, tmp_path):
    done = run_kr5("gap", "explain", recorded / "sound", "link_com:joint2", "--json", "-")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)["targets"][0]
    assert [float(p["nominal"]) for p in told["parameters"]] == [-330.0, 10.0, 40.0]
    done = run_kr5("gap", "effects", "link_com", "--pictures", tmp_path / "pictures")
    assert done.returncode == 0 and (tmp_path / "pictures/link_com.png").is_file(), done.stderr


def test_numbers_in_sentences_are_those_of_tables():
    random = np.random.default_rng(3)
    for value, std in zip(random.normal(0, 100, 50), 10 ** random.uniform(-6, 3, 50)):
        parameter = ParameterEstimate(name="x", value=[value], std=[std], unit="kg")
        expected = f"{format_number(value, std)} ± {format_number(std, std)} kg"
        assert kr5.gap.value_text(parameter, "joint3") == expected


@pytest.mark.parametrize("share", [1.0, 0.9996, 0.997, 0.9949, 0.5, 0.0051, 0.001, -0.1])
def test_no_share_is_said_to_be_all_or_nothing(share):
    text = kr5.gap.cause_text(Cause(effect="backlash", target="joint1", probability=share))
    assert text == f"backlash of joint 1 ({format_percent(share)} probable)"
    assert "100 %" not in text and " 0 %" not in text


def test_what_the_recording_cannot_show_is_recorded_next():
    limit = {"reason": "at_rest", "kind": "motion", "experiment": "motion-1", "rows": 500}
    steps = next_steps(DiagnosisFile(Diagnosis(scope=[limit])), "monday")
    assert "before the cell is trusted there" in steps[0]
    assert "Use the cell as it is" in next_steps(DiagnosisFile(Diagnosis()), "monday")[0]


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
    assert data["verdict"] == "no_gap" and any(limit in one["text"] for one in data["scope"])
    assert limit in done.output and "what the recording can show" in done.output
    page = html.unescape((tmp_path / "page.html").read_text())
    assert "No gap in what the recording can show" in page and limit in page
    assert "There is no gap:" not in page and "No correction is needed" not in page


def causes_of(count):
    parameters = [ParameterEstimate(name="viscous", value=[3.0], std=[0.1], unit="N m s/rad")]
    return [
        Cause(effect="viscous_friction", target=f"joint{k + 1}", probability=0.99, parameters=parameters)
        for k in range(count)
    ]


def test_one_remedy_is_told_once_for_all_joints():
    causes = [*causes_of(4), Cause(effect="ft_bias", target="fx")]
    steps = next_steps(DiagnosisFile(diagnosed("explained", [place("motion.i2", 7.0, 0.6)], causes)), "monday")
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
        causes.append(Cause(effect=effect, target=target))
    found = diagnosed("explained", [place("motion.i2", 7.0)], causes)
    steps = next_steps(DiagnosisFile(found), "log", model, cell)
    assert all(text in steps[-1] for text in words), steps[-1]
    in_model = model and "cannot hold" not in steps[-1]
    kind, file = ("model", f"mine{Path(model).suffix}") if in_model else ("cell", "mine.yaml")
    steps = next_steps(DiagnosisFile(found, written={kind: file}), "log", model, cell)
    assert steps[-1].startswith(f"{file} is written with these causes; check it on another recording")
    assert f"`kr5 gap measure OTHER --{'model' if model else 'cell'} {file}`" in steps[-1]


def test_a_cause_that_explains_nothing_measurable_is_not_said_to_explain_0_percent():
    assert "explains less than 1 % of the gap" in cause_line(causes_of(1)[0], [])
    assert [format_percent(share) for share in (-0.1, 0.0, 0.004, 0.5)] == [*["less than 1 %"] * 3, "50 %"]


def test_an_effect_of_ones_own_has_a_page_without_curves_after(recorded, browser, run_kr5, tmp_path):
    size = ParameterEstimate(name="size", value=[3.0], std=[0.1], unit="N m")
    own = Cause(effect="my_fan", target="joint2", probability=0.9, explained_fraction=0.9, parameters=[size])
    rest = place("poses.z", 3.0, 0.4, [depends("q1", "grows")])
    file = diagnosis(recorded, "worn", "partly_explained", [place("motion.i2", 7.0, 0.6), rest], [own], [rest])
    done = run_kr5("report", file, "-o", "own.html")
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "own.html").read_text()
    assert "my_fan is not in the catalogue" in page and "its gap grows with the position of joint 1" in page
    browser.open(tmp_path / "own.html", 390)
    assert browser.complaints() == []


OLD = Path(__file__).parent / "data/gap-1.json"  # as version 0.2.0 wrote it of share/data/recording


def test_a_file_of_the_format_before_is_read_and_its_sentences_are_kept_as_they_stand():
    old, found = json.loads(OLD.read_text()), read_diagnosis(OLD).found
    assert str(found.verdict) == old["verdict"] == "explained"
    assert [(p.experiment, p.column, p.target, p.gap, p.share) for p in found.where] == [
        tuple(p[key] for key in ("experiment", "column", "target", "gap", "share")) for p in old["where"]
    ]
    for cause, before in zip(found.causes, old["causes"], strict=True):
        assert (cause.effect, cause.target, cause.probability) == tuple(
            before[key] for key in ("effect", "target", "probability")
        )
        for p in cause.parameters:
            assert list(p.value) == np.ravel(before["parameters"][p.name]["value"]).tolist()
            assert list(p.std) == np.ravel(before["parameters"][p.name]["std"]).tolist()
    assert {c.column: [c.before, c.after] for c in found.reduction.columns} == old["shrink"]["columns"]
    depends = [d for p in found.where for d in p.depends_on]
    assert [d.note for d in depends] == [d["how"] for p in old["where"] for d in p["depends_on"]]
    assert all(str(d.shape) == "described" and not d.sign_joint for d in depends)
    assert found.not_tried[0].text == old["not_tried"][0]["reason"]
    assert "Causes: Stribeck friction of joint 2 (29.40 ± 0.15 N m, more than 99.9 % probable)" in found.text


def test_a_file_of_the_format_before_has_a_page(kr5_here, share, tmp_path):
    (tmp_path / "old.json").write_text(OLD.read_text())
    done = kr5_here("report", "old.json", "-o", "old.html", "--recording", share / "data/recording")
    assert done.exit_code == 0, done.output
    page = html.unescape((tmp_path / "old.html").read_text())
    assert "Causes: Stribeck friction of joint 2" in page
    assert "depends on the speed of joint 2 (changes sign with qd2, varies with it)" in page.lower()


def test_warnings_and_limits_of_the_format_before_are_shown_and_not_used(tmp_path):
    warnings = ["noise of current is 1.10 +- 0.01 times what the cell declares; the measured noise is used"]
    scope = ["motion-1 commands no motion: it cannot show friction, inertia and servos"]
    data = {**json.loads(OLD.read_text()), "verdict": "no_gap", "where": [], "causes": [], "warnings": warnings}
    (tmp_path / "old.json").write_text(
        json.dumps({**data, "scope": scope, "shrink": {**data["shrink"], "before": 1.0}})
    )
    found = read_diagnosis(tmp_path / "old.json").found
    assert found.noise == [] and list(found.warnings) == [f"{warnings[0]}."]
    assert found.text.startswith("Within what the recording can show there is no gap") and scope[0][1:] in found.text
