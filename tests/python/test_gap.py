"""kr5.predict, kr5.gap, `kr5 gap` and `kr5 record`."""

import json
import shutil

import kr5
import kr5.cell
import kr5.gap
import kr5.io
import kr5.predict
import numpy as np
import pytest
import yaml

SMALL = {
    "format": "kr5-protocol/1",
    "home": [0.0, 0.02, -2.75, 0.0, -0.3, 1.571],
    "experiments": [
        {"name": "motion-1", "kind": "motion", "split": "fit", "signal": "fourier", "duration": 6.0},
        {"name": "motion-2", "kind": "motion", "split": "check", "signal": "way_points", "count": 2, "start": 10.0},
        {"name": "motion-3", "kind": "motion", "split": "fit", "signal": "one_by_one", "swing": 2.0, "start": 30.0},
        {"name": "poses-1", "kind": "poses", "split": "fit", "count": 20},
        {"name": "views-1", "kind": "views", "split": "check", "count": 3},
        {"name": "scan-1", "kind": "scan", "split": "fit", "passes": 1, "lines": 7},
        {"name": "step-1", "kind": "step", "split": "fit"},
        {"name": "press-1", "kind": "press", "split": "check", "speeds": [0.003]},
        {"name": "profile-1", "kind": "profile", "split": "fit", "rows": 200},
    ],
}


@pytest.fixture
def arc(share):
    return kr5.cell.load_cell(share / "cells/kr5_arc.yaml")


@pytest.fixture
def protocol(tmp_path):
    def write(**changes):
        file = tmp_path / "protocol.yaml"
        file.write_text(yaml.safe_dump({**SMALL, **changes}))
        return file

    return write


@pytest.fixture
def recorded(run_kr5, tmp_path, share, protocol):
    done = run_kr5("record", "--cell", share / "cells/kr5_arc.yaml", "--protocol", protocol(), "-o", "recording")
    assert done.returncode == 0, done.stderr
    return tmp_path / "recording"


def test_a_simulator_predicts_a_table(arc):
    experiment = kr5.cell.Experiment(name="step-1", kind="step", file="step-1.csv", split="fit")
    t = 0.012 * np.arange(500)
    experiment.data = kr5.io.Table(["run", "t", "zc"], np.column_stack([0 * t, t, np.where(t < 1, 0.0, 0.01)]))
    z = kr5.predict.FastSimulator().predict(arc, experiment)["z"]
    assert z[0] == 0 and z[-1] == pytest.approx(0.01, rel=1e-3) and z.max() > 0.01
    arc.set_effect("tool_damping", "servo", "damping_ratio", 2.0)
    assert kr5.predict.FastSimulator().predict(arc, experiment)["z"].max() < 0.01


def test_what_is_missing_is_named(arc):
    experiment = kr5.cell.Experiment(name="press-1", kind="press", file="press-1.csv", split="fit")
    experiment.data = kr5.io.Table(["run", "t"], np.zeros((3, 2)))
    with pytest.raises(kr5.InvalidArgument, match="press-1.*has no column 'zc'"):
        kr5.predict.FastSimulator().predict(arc, experiment)
    experiment.data = kr5.io.Table(["run", "t", "zc"], np.full((3, 3), np.nan))
    with pytest.raises(kr5.InvalidArgument, match="column 'run', row 1: found nan, expected a finite number"):
        kr5.predict.FastSimulator().predict(arc, experiment)


def test_a_simulator_may_be_written_in_python(recorded):
    class Late(kr5.cell.Simulator):
        def predict(self, cell, experiment):
            shown = kr5.predict.FastSimulator().predict(cell, experiment)
            return kr5.io.Table(shown.columns, shown.values + 0.15)

    found = kr5.gap.measure(kr5.cell.load_recording(recorded), Late())
    fx = next(c for c in found.columns if c.experiment == "press-1" and c.column == "fx")
    assert fx.gap == pytest.approx(2**0.5, rel=0.05) and fx.exceeds


def test_a_recording_is_at_the_floor_of_its_own_cell(run_kr5, tmp_path, recorded):
    assert kr5.cell.check(recorded) == []
    done = run_kr5("gap", "measure", recorded, "--json", "gap.json", "--png", "gap.png")
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "gap.json").read_text())
    assert found["format"] == "kr5-gap-measure/1" and {"gap", "parts", "columns"} <= found.keys()
    assert found["limits"].keys() == found["columns"].keys() and min(found["limits"].values()) > 1
    assert "poses-1.rx" in found["columns"] and "motion-1.i6" in found["columns"]
    assert found["gap"] == pytest.approx(1.0, abs=0.05)
    assert (tmp_path / "gap.png").read_bytes().startswith(b"\x89PNG")
    measured = kr5.gap.measure(kr5.cell.load_recording(recorded), kr5.predict.FastSimulator())
    assert measured.exceeding <= 3  # one column in 1000 by chance


def test_the_same_seed_gives_the_same_recording(run_kr5, tmp_path, share, recorded, protocol):
    for name, seed in (("same", 1), ("other", 2)):
        assert (
            run_kr5(
                "record", "--cell", share / "cells/kr5_arc.yaml", "--protocol", protocol(), "-o", name, "--seed", seed
            ).returncode
            == 0
        )
    file = "views-1.csv"
    assert (
        (recorded / file).read_bytes()
        == (tmp_path / "same" / file).read_bytes()
        != (tmp_path / "other" / file).read_bytes()
    )


def test_an_effect_shows_as_a_gap_of_the_nominal_cell(run_kr5, tmp_path, arc, protocol):
    arc.set_effect("ft_bias", "fy", "bias", 1.5)
    kr5.cell.save_cell(arc, tmp_path / "biased.yaml")
    done = run_kr5("record", "--cell", "biased.yaml", "--protocol", protocol(), "-o", "biased", "--nominal")
    assert done.returncode == 0, done.stderr
    recording = kr5.cell.load_recording(tmp_path / "biased")
    assert len(recording.cell.effects) == 0
    exceeding = {c.column for c in kr5.gap.measure(recording, kr5.predict.FastSimulator()).columns if c.gap > 5}
    assert exceeding == {"fy"}
    done = run_kr5("gap", "measure", "biased", "--cell", "biased.yaml", "--json", "-")
    assert json.loads(done.stdout)["gap"] == pytest.approx(1.0, abs=0.05)


def test_what_the_simulator_refuses_is_left_out_with_a_word(run_kr5, tmp_path, share, recorded, protocol):
    cell = yaml.safe_load((share / "cells/kr5_arc.yaml").read_text())
    del cell["tube"]
    (tmp_path / "no_tube.yaml").write_text(yaml.safe_dump(cell))
    done = run_kr5("gap", "measure", recorded, "--cell", "no_tube.yaml", "--json", "gap.json")
    assert done.returncode == 0, done.stderr
    assert "note: profile-1 was not compared: " in done.stdout
    found = json.loads((tmp_path / "gap.json").read_text())
    assert {name.split(".")[0] for name in found["columns"]} == {e["name"] for e in SMALL["experiments"]} - {
        "profile-1"
    }
    assert found["gap"] == pytest.approx(1.0, abs=0.05)
    profile = [e for e in SMALL["experiments"] if e["kind"] == "profile"]
    assert (
        run_kr5(
            "record", "--cell", share / "cells/kr5_arc.yaml", "--protocol", protocol(experiments=profile), "-o", "alone"
        ).returncode
        == 0
    )
    done = run_kr5("gap", "measure", "alone", "--cell", "no_tube.yaml")
    assert done.returncode == 2 and "error: profile-1 was not compared: " in done.stderr


def test_the_standard_protocol_runs(run_kr5, tmp_path, share):
    done = run_kr5(
        "record",
        "--cell",
        share / "cells/kr5_arc.yaml",
        "--protocol",
        share / "protocols/standard.yaml",
        "-o",
        "standard",
    )
    assert done.returncode == 0, done.stderr
    assert len(kr5.cell.load_recording(tmp_path / "standard").experiments) == 17


def test_given_columns_may_come_from_a_file(run_kr5, tmp_path, share, recorded, protocol):
    shutil.copy(recorded / "step-1.csv", tmp_path / "steps.csv")
    columns = kr5.io.load_csv(tmp_path / "steps.csv")
    kr5.io.save_csv(kr5.io.Table(["run", "t", "zc"], columns.values[:, :3]), tmp_path / "steps.csv")
    file = protocol(experiments=[{"name": "mine", "kind": "step", "split": "check", "given": "steps.csv"}])
    assert run_kr5("record", "--cell", share / "cells/kr5_arc.yaml", "--protocol", file, "-o", "mine").returncode == 0
    assert len(kr5.cell.load_recording(tmp_path / "mine")["mine"].data) == len(columns)


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"format": "kr5-protocol/2"}, "format: found 'kr5-protocol/2', expected kr5-protocol/1"),
        ({"experiment": []}, "unknown key 'experiment'"),
        ({"home": [0, 0]}, "home: found [0.0, 0.0], expected 6 joint values"),
        ({"experiments": []}, "experiments: found 0 entries, expected at least 1"),
        (
            {"experiments": [{"name": "a", "kind": "dance", "split": "fit"}]},
            "kind: found 'dance', expected motion, poses, views, scan, step, press or profile",
        ),
        (
            {"experiments": [{"name": "a", "kind": "motion", "split": "fit", "signal": "noise"}]},
            "signal: found 'noise', expected one of fourier",
        ),
        (
            {"experiments": [{"name": "a", "kind": "poses", "split": "fit", "number": 3}]},
            "unknown key 'number', expected count",
        ),
        (
            {"experiments": [{"name": "a", "kind": "poses", "split": "fit", "count": "many"}]},
            "count: found 'many', expected a whole number",
        ),
        (
            {"experiments": [{"name": "a", "kind": "views", "split": "fit", "near": 3.0, "far": 3.1, "count": 1}]},
            "found 0 views of the board",
        ),
        ({"experiments": [{"name": "a", "kind": "step", "split": "fit", "given": "none.csv"}]}, "none.csv"),
    ],
)
def test_a_wrong_protocol_is_refused(run_kr5, share, protocol, changes, words):
    done = run_kr5("record", "--cell", share / "cells/kr5_arc.yaml", "--protocol", protocol(**changes), "-o", "out")
    assert done.returncode == 2, done.stderr
    assert words in done.stderr and "Traceback" not in done.stderr


def test_no_recording_is_overwritten(run_kr5, share, recorded, protocol):
    done = run_kr5("record", "--cell", share / "cells/kr5_arc.yaml", "--protocol", protocol(), "-o", recorded)
    assert done.returncode == 2 and "exists already" in done.stderr


def test_a_cell_of_another_robot_is_refused(run_kr5, share, recorded):
    done = run_kr5("gap", "measure", recorded, "--cell", share / "cells/gantry_rrp.yaml")
    assert done.returncode == 2 and "joints" in done.stderr


def test_the_cases_of_known_effects_are_at_the_floor(run_kr5, tmp_path, reference):
    done = run_kr5("gap", "cases", reference / "cases", "--json", "cases.json")
    assert done.returncode == 0, done.stdout + done.stderr
    found = json.loads((tmp_path / "cases.json").read_text())
    assert len(found) == 14
    for name, case in found.items():
        assert case["gap"] < 1.01, name
        assert len(case["columns"]) == 138
    # Chance lifts single columns above 1.05; a fault of the simulator would lift the same column of every case.
    for column in found["case-006"]["columns"]:
        of_all = np.array([case["columns"][column] for name, case in found.items() if name != "case-004"])
        if not column.startswith("poses"):
            assert np.sqrt(np.mean(of_all**2)) < 1.05, column


def test_labels_that_are_missing_are_named(run_kr5, tmp_path):
    done = run_kr5("gap", "cases", tmp_path)
    assert done.returncode == 2 and "labels.json" in done.stderr
