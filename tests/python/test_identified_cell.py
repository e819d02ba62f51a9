"""An identified cell goes straight to the diagnosis: both name the same hidden effect, within their uncertainty."""

import json

import kr5.cell
import kr5.gap
import kr5.predict
import numpy as np
import pytest

from command_runner import run_command

OPTIONS = ("--no-smooth-torques", "--min-speed", "0.02")  # the arm of the cases pauses


@pytest.fixture(scope="module")
def healthy(reference, tmp_path_factory):
    """The cell as identified from the recording without an effect."""
    folder = tmp_path_factory.mktemp("healthy")
    words = ["identify", "dynamics", str(reference / "cases/case-006"), *OPTIONS, "--write-cell", "cell.yaml"]
    done = run_command(*words, cwd=folder)
    assert done.returncode == 0, done.stderr
    return kr5.cell.load_cell(folder / "cell.yaml")


def diagnosed(case, cell):
    """Causes that the motions of a case show beside this cell."""
    recording = kr5.cell.load_recording(case)
    motions = [e for e in recording.experiments if e.name in ("motion-1", "motion-3", "motion-4")]
    return kr5.gap.diagnose(kr5.cell.Recording(cell, motions), kr5.predict.FastSimulator())


def identified(folder, run_kr5, *words):
    done = run_kr5("identify", *words, *OPTIONS, "-o", "out.json")
    assert done.returncode == 0, done.stderr
    return {f["name"]: f for f in json.loads((folder / "out.json").read_text())["figures"]}


def test_the_tool_is_not_counted_twice(reference, healthy):
    believed = kr5.cell.load_cell(reference / "cases/case-006/cell.yaml")
    assert healthy.tool.mass == believed.tool.mass
    recording = kr5.cell.load_recording(reference / "cases/case-006")
    motion = next(e for e in recording.experiments if e.name == "motion-4")  # held out
    simulator = kr5.predict.FastSimulator()
    for joint in range(6):
        name = f"i{joint + 1}"
        off = [np.std(np.asarray(motion[name]) - simulator.predict(c, motion)[name]) for c in (healthy, believed)]
        assert off[0] < 1.05 * off[1], name


@pytest.mark.parametrize(
    ("number", "words", "figure", "effect", "target"),
    [(5, ("dynamics",), "fc6", "coulomb_friction", "joint6"), (1, ("payload",), "mass", "payload", "tool")],
)
def test_identification_and_diagnosis_name_the_same(
    reference, healthy, tmp_path, run_kr5, number, words, figure, effect, target
):
    case = reference / f"cases/case-{number:03d}"
    found = diagnosed(case, healthy)
    assert [(c.effect, c.target) for c in found.causes] == [(effect, target)]
    value, std = (float(x[0]) for x in (found.causes[0].parameters[0].value, found.causes[0].parameters[0].std))
    kr5.cell.save_cell(healthy, tmp_path / "cell.yaml")
    ours = identified(tmp_path, run_kr5, *words, case, "--cell", "cell.yaml")[figure]
    assert abs(ours["value"] - value) < 2.6 * np.hypot(ours["std"], std)
    labels = json.loads((reference / "cases/labels.json").read_text())[f"case-{number:03d}"]["effects"]
    truth = next(iter(labels[0]["parameters"].values()))
    assert abs(value - truth) < 3 * std and abs(ours["value"] - truth) < 3 * ours["std"]


def test_terms_that_a_cell_cannot_hold_are_named_and_not_mixed_into_the_others(reference, tmp_path, run_kr5):
    case = reference / "cases/case-007"
    words = ("dynamics", case, *OPTIONS, "--stribeck-velocity", "0.079", "--write-cell", "new.yaml")
    done = run_kr5("identify", *words)
    assert done.returncode == 0, done.stderr
    assert "without fs1, fs2, fs3, fs4, fs5, fs6, which it cannot hold" in " ".join(done.stderr.split())
    believed, new = (kr5.cell.load_cell(f).drives.friction.coulomb for f in (case / "cell.yaml", tmp_path / "new.yaml"))
    others = [0, 2, 3, 4, 5]
    assert np.asarray(new)[others] == pytest.approx(np.asarray(believed)[others], rel=0.02)
