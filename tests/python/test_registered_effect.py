"""An effect of one's own, registered with its law, in every place where those of the library are."""

import json

import kr5
import kr5.cell
import kr5.io
import numpy as np
import pytest

gap = pytest.importorskip("kr5.gap")
predict = pytest.importorskip("kr5.predict")

HOME = np.array([0.0, 0.02, -2.75, 0.0, -0.3, 1.571])
BEND = 0.03  # [1/A]


def bend(columns, experiment, target, values):
    name = f"i{target.removeprefix('motor')}"
    if name in columns:
        columns[name] = columns[name] + values["bend"] * columns[name] ** 2


@pytest.fixture
def bent_sensor():
    parameter = kr5.cell.EffectParameter(name="bend", unit="1/A", lower=-0.5, upper=0.5, usual_size=0.01)
    effect = kr5.cell.Effect(
        id="bent_sensor",
        target="motor",
        label="bent current sensor",
        description="current sensor that bends",
        shows_in="the current of its motor: in proportion to its square",
        remedy="Have the current sensor calibrated.",
        parameters=[parameter],
    )
    kr5.cell.register_effect(effect, change_columns=bend)
    yield effect
    kr5.cell.unregister_effect("bent_sensor")


def record(cell, folder):
    """Two motions to fit and one to check by, of a cell that carries what `cell` says."""
    random = np.random.default_rng(5)
    experiments = []
    for name, split, rate in (("slow", "fit", 0.9), ("fast", "fit", 2.3), ("other", "check", 1.6)):
        e = kr5.cell.Experiment(name=name, kind="motion", file=f"{name}.csv", split=split)
        t = 0.012 * np.arange(700)
        q = np.tile(HOME, (len(t), 1))
        for joint, part in ((1, 1.0), (2, 1.7)):
            q[:, joint] += 0.4 * np.sin(part * rate * t) * (1 - np.exp(-t * t))
        given = ["t", *(f"qc{i + 1}" for i in range(6))]
        e.data = kr5.io.Table(given, np.column_stack([t, q]))
        shown = predict.FastSimulator().predict(cell, e)
        noisy = [np.array(shown[c]) + random.normal(0.0, cell.noise.current, len(t)) for c in ("i2", "i3")]
        e.data = kr5.io.Table([*given, "i2", "i3"], np.column_stack([t, q, *noisy]))
        experiments.append(e)
    cell.set_effect("bent_sensor", "motor2", "bend", None)
    kr5.cell.save_recording(kr5.cell.Recording(cell, experiments), folder)
    return kr5.cell.load_recording(folder)


def test_it_is_in_the_catalogue_the_file_the_diagnosis_the_explanation_and_the_page(bent_sensor, share, tmp_path):
    from kr5_tools.gap.explain import explain_effect
    from kr5_tools.gap_report.evidence_data import Evidence
    from kr5_tools.gap_report.page import cause_rows

    assert "bent_sensor" in {e.id for e in kr5.cell.effect_catalogue()}
    cell = kr5.cell.load_cell(share / "cells/kr5_arc.yaml")
    cell.effects = {}
    cell.set_effect("bent_sensor", "motor2", "bend", BEND)
    assert kr5.cell.parse_cell(cell.to_yaml()).effects.to_dict() == {"bent_sensor": {"motor2": {"bend": BEND}}}
    assert not kr5.cell.check(cell)

    recording = record(cell, tmp_path / "recording")
    found = gap.diagnose(recording, predict.FastSimulator(), gap.DiagnoseOptions(threads=2))
    assert [(c.effect, c.target) for c in found.causes] == [("bent_sensor", "motor2")]
    assert abs(found.causes[0].parameters[0].value[0] - BEND) < 4 * found.causes[0].parameters[0].std[0]

    data = json.loads(found.to_json())
    evidence = Evidence(data, recording, predict.FastSimulator())
    told = explain_effect(kr5.cell.find_effect("bent_sensor"), "motor2", data, evidence)
    assert told["name"] == "bent current sensor" and told["targets"]
    (row,) = cause_rows(data, evidence)
    assert row["name"].startswith("Bent current sensor") and row["remedy"] == "Have the current sensor calibrated."
    assert row["what"] == "Current sensor that bends" and "in proportion to its square" in row["shows"]


def test_what_a_law_raises_ends_the_call_with_that_exception(bent_sensor, share, tmp_path):
    kr5.cell.unregister_effect("bent_sensor")

    def broken(columns, experiment, target, values):
        raise KeyError("no such column")

    kr5.cell.register_effect(bent_sensor, change_columns=broken)
    cell = kr5.cell.load_cell(share / "cells/kr5_arc.yaml")
    cell.effects = {"bent_sensor": {"motor2": {"bend": BEND}}}
    with pytest.raises(KeyError, match="no such column"):
        record(cell, tmp_path / "recording")


def test_a_row_without_law_is_refused(share):
    with pytest.raises(kr5.InvalidArgument, match="change_cell"):
        kr5.cell.register_effect(kr5.cell.Effect(id="nothing", target="joint"))
    with pytest.raises(kr5.InvalidArgument, match="built into the library"):
        kr5.cell.unregister_effect("backlash")
