"""An effect of one's own, registered with its law, in every place where those of the library are."""

import html
import json

import kr5
import kr5.cell
import kr5.io
import numpy as np
import pytest

pytest.importorskip("kr5.gap")
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


def bent_cell(share):
    cell = kr5.cell.load_cell(share / "cells/kr5_arc.yaml")
    cell.effects = {}
    cell.set_effect("bent_sensor", "motor2", "bend", BEND)
    return cell


def test_it_is_in_the_catalogue_and_in_files_of_cells(bent_sensor, share, kr5_here, tmp_path):
    assert "bent_sensor" in {e.id for e in kr5.cell.effect_catalogue()}
    cell = bent_cell(share)
    assert kr5.cell.parse_cell(cell.to_yaml()).effects.to_dict() == {"bent_sensor": {"motor2": {"bend": BEND}}}
    kr5.cell.save_cell(cell, tmp_path / "cell.yaml")
    assert kr5_here("cell", "check", "cell.yaml").exit_code == 0
    text = (tmp_path / "cell.yaml").read_text()
    (tmp_path / "cell.yaml").write_text(text.replace(str(BEND), "0.7"))
    done = kr5_here("cell", "check", "cell.yaml")
    assert done.exit_code == 2 and "bend" in done.stdout and "0.5" in done.stdout
    kr5.cell.unregister_effect("bent_sensor")
    (tmp_path / "cell.yaml").write_text(text)
    done = kr5_here("cell", "check", "cell.yaml")
    assert done.exit_code == 2 and "bent_sensor" in done.stdout
    kr5.cell.register_effect(bent_sensor, change_columns=bend)


def test_the_commands_diagnose_it_show_it_on_the_page_and_explain_it(bent_sensor, share, kr5_here, tmp_path):
    record(bent_cell(share), tmp_path / "recording")
    assert kr5_here("cell", "check", "recording").exit_code == 0
    done = kr5_here(
        "gap",
        "diagnose",
        "recording",
        "--threads",
        2,
        "--report",
        "page.html",
        "--json",
        "short.json",
        "-o",
        "gap.json",
    )
    assert done.exit_code == 0, done.output
    (cause,) = json.loads((tmp_path / "short.json").read_text())["causes"]
    assert (cause["effect"], cause["target"]) == ("bent_sensor", "motor2")
    found = cause["parameters"]["bend"]
    assert abs(found["value"] - BEND) < 4 * found["std"] and found["unit"] == "1/A"
    page = html.unescape((tmp_path / "page.html").read_text())
    for words in (
        "Bent current sensor of motor 2",
        "Current sensor that bends",
        "in proportion to its square",
        "Have the current sensor calibrated.",
    ):
        assert words in page, words
    for what in (["gap.json"], ["recording", "bent_sensor:motor2"]):
        done = kr5_here("gap", "explain", *what)
        assert done.exit_code == 0, done.output
        assert "bent current sensor" in done.stdout.lower(), what
    told = kr5_here("gap", "explain", "gap.json")
    assert "Have the current sensor calibrated." in " ".join(told.stdout.split())


def test_the_simulator_in_dart_shows_it(bent_sensor, share):
    sim = pytest.importorskip("kr5.sim", reason="this kr5 was built without DART")
    e = kr5.cell.Experiment(name="slow", kind="motion", file="slow.csv", split="fit")
    t = 0.012 * np.arange(200)
    q = np.tile(HOME, (len(t), 1))
    q[:, 1] += 0.3 * np.sin(2 * t) * (1 - np.exp(-t * t))
    e.data = kr5.io.Table(["t", *(f"qc{i + 1}" for i in range(6))], np.column_stack([t, q]))
    bent = bent_cell(share)
    sound = bent_cell(share)
    sound.effects = {}
    shown, nominal = (sim.DartSimulator().predict(cell, e) for cell in (bent, sound))
    i2, i3 = np.array(nominal["i2"]), np.array(nominal["i3"])
    np.testing.assert_allclose(shown["i2"], i2 + BEND * i2**2, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(shown["i3"], i3, rtol=1e-9, atol=1e-12)
    assert np.abs(BEND * i2**2).max() > bent.noise.current


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
