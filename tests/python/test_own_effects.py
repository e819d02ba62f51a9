"""Effects and simulators of one's own, from Python."""

import threading

import kr5
import kr5.cell
import kr5.io
import numpy as np
import pytest

gap = pytest.importorskip("kr5.gap")
predict = pytest.importorskip("kr5.predict")

HOME = np.array([0.0, 0.02, -2.75, 0.0, -0.3, 1.571])
BEND = 0.02  # [1/A]


def motion(cell, name, split, rate, simulator, change=lambda columns: columns, rows=700):
    """A motion of joints 2 and 3 and their currents with noise, changed."""
    random = np.random.default_rng([7, int(100 * rate)])
    e = kr5.cell.Experiment(name=name, kind="motion", file=f"{name}.csv", split=split)
    t = 0.012 * np.arange(rows)
    q = np.tile(HOME, (rows, 1))
    for joint, part in ((1, 1.0), (2, 1.7)):
        q[:, joint] += 0.4 * np.sin(part * rate * t) * (1 - np.exp(-t * t))
    given = ["t", *(f"qc{i + 1}" for i in range(6))]
    e.data = kr5.io.Table(given, np.column_stack([t, q]))
    shown = simulator.predict(cell, e)
    columns = change({k: np.array(shown[k]) for k in ("i2", "i3")})
    noisy = [v + random.normal(0.0, cell.noise.current, rows) for v in columns.values()]
    e.data = kr5.io.Table([*given, *columns], np.column_stack([t, q, *noisy]))
    return e


def recording(cell, simulator, change=lambda columns: columns):
    rates = (("slow", "fit", 0.9), ("fast", "fit", 2.3), ("other", "check", 1.6))
    return kr5.cell.Recording(cell, [motion(cell, name, split, rate, simulator, change) for name, split, rate in rates])


@pytest.fixture
def cell(share):
    out = kr5.cell.load_cell(share / "cells/kr5_arc.yaml")
    out.effects = {}
    return out


def bend(columns, experiment, x):
    columns["i2"] = columns["i2"] + x[0] * columns["i2"] ** 2


def with_own(**kw):
    options = gap.DiagnoseOptions(threads=2)
    given = {
        "effect": "bent_sensor",
        "target": "i2",
        "coordinates": [gap.Coordinate(name="bend", unit="1/A", size=0.01)],
    } | kw
    options.own_hypotheses = [gap.Hypothesis(**given)]
    return options


def test_an_own_effect_that_changes_columns_is_named_with_its_size(cell):
    def bent(columns):
        return columns | {"i2": columns["i2"] + BEND * columns["i2"] ** 2}

    threads = set()

    def seen(columns, experiment, x):
        threads.add(threading.get_ident())
        assert str(experiment.kind) == "motion" and len(columns["i2"]) == len(experiment.data) and x.shape == (1,)
        return bend(columns, experiment, x)

    found = gap.diagnose(recording(cell, predict.FastSimulator(), bent), predict.FastSimulator(), with_own(change=seen))
    assert str(found.verdict) == "explained"
    assert [(c.effect, c.target) for c in found.causes] == [("bent_sensor", "i2")]
    (p,) = found.causes[0].parameters
    assert p.name == "bend" and p.unit == "1/A" and abs(p.value[0] - BEND) < 5 * p.std[0]
    assert threads


def test_an_own_effect_that_changes_the_cell_is_named(cell):
    def heavier(c, x):
        c.robot.gravity = np.asarray(c.robot.gravity) * (1 + x[0])
        return c

    truth = kr5.cell.parse_cell(cell.to_yaml())
    truth.robot.gravity = np.asarray(cell.robot.gravity) * 1.05
    r = recording(truth, predict.FastSimulator())
    r.cell = cell
    options = with_own(
        effect="heavy_world",
        target="gravity",
        apply=heavier,
        coordinates=[gap.Coordinate(name="part", unit="-", size=0.02)],
    )
    found = gap.diagnose(r, predict.FastSimulator(), options)
    assert [(c.effect, c.target) for c in found.causes] == [("heavy_world", "gravity")]
    assert abs(found.causes[0].parameters[0].value[0] - 0.05) < 5 * found.causes[0].parameters[0].std[0]
    assert found.cell.robot.gravity[2] == pytest.approx(truth.robot.gravity[2], rel=0.01)


def test_what_an_own_effect_raises_ends_the_diagnosis_and_says_where(cell):
    def broken(columns, experiment, x):
        raise KeyError("no such sensor")

    r = recording(cell, predict.FastSimulator())
    with pytest.raises(KeyError, match="no such sensor") as raised:
        gap.diagnose(r, predict.FastSimulator(), with_own(change=broken))
    assert "bent_sensor on i2" in raised.value.__notes__[0]
    with pytest.raises(TypeError, match="apply of custom effect"):
        gap.diagnose(r, predict.FastSimulator(), with_own(apply=lambda c, x: 3))
    with pytest.raises(ValueError, match="'i9' is none"):
        gap.diagnose(r, predict.FastSimulator(), with_own(change=lambda columns, e, x: {"i9": columns["i2"]}))
    with pytest.raises(ValueError, match="expected 80|expected 700"):
        gap.diagnose(r, predict.FastSimulator(), with_own(change=lambda columns, e, x: {"i2": columns["i2"][:3]}))


def test_an_own_effect_that_makes_no_sense_is_refused():
    with pytest.raises(kr5.InvalidArgument, match="apply"):
        with_own()
    with pytest.raises(kr5.InvalidArgument, match="coordinate"):
        with_own(change=bend, coordinates=[])
    with pytest.raises(kr5.InvalidArgument, match="size"):
        with_own(change=bend, coordinates=[gap.Coordinate(name="bend", size=-1.0)])


class Mine:
    """A simulator that is no class of kr5: currents that it takes from elsewhere, as a dict."""

    def __init__(self):
        self.inner, self.calls = predict.FastSimulator(), 0

    def predict(self, cell, experiment):
        self.calls += 1
        shown = self.inner.predict(cell, experiment)
        return {name: np.asarray(shown[name]) for name in ("i2", "i3")}


class Inherited(kr5.cell.Simulator):
    def __init__(self):
        super().__init__()
        self.inner = predict.FastSimulator()

    def predict(self, cell, experiment):
        return self.inner.predict(cell, experiment)


@pytest.mark.parametrize("make", [Mine, Inherited])
def test_a_simulator_of_python_is_diagnosed_like_ours(cell, make):
    truth = kr5.cell.parse_cell(cell.to_yaml())
    truth.set_effect("coulomb_friction", "joint2", "coulomb", 50.0)
    r = recording(truth, predict.FastSimulator())
    r.cell = cell
    own, ours = gap.diagnose(r, make()), gap.diagnose(r, predict.FastSimulator())
    assert (
        [(c.effect, c.target) for c in own.causes]
        == [("coulomb_friction", "joint2")]
        == [(c.effect, c.target) for c in ours.causes]
    )
    assert own.causes[0].parameters[0].value == pytest.approx(ours.causes[0].parameters[0].value)
    assert gap.measure(r, make()).gap == pytest.approx(gap.measure(r, predict.FastSimulator()).gap)


def test_what_a_simulator_of_python_does_wrong_is_said(cell):
    class Short(Mine):
        def predict(self, cell, experiment):
            return {name: values[:5] for name, values in super().predict(cell, experiment).items()}

    class Raising(Mine):
        def predict(self, cell, experiment):
            raise RuntimeError("licence expired")

    class Text(Mine):
        def predict(self, cell, experiment):
            return "currents"

    r = recording(cell, predict.FastSimulator())
    with pytest.raises(ValueError, match="one for each row of experiment slow"):
        gap.measure(r, Short())
    with pytest.raises(RuntimeError, match="licence expired"):
        gap.diagnose(r, Raising())
    with pytest.raises(TypeError, match="dict of columns"):
        gap.measure(r, Text())
    with pytest.raises(TypeError, match="predict"):
        gap.measure(r, 3)


def test_options_keep_their_fields(cell):
    options = with_own(change=bend)
    assert options.threads == 2 and [str(h.effect) for h in options.own_hypotheses] == ["bent_sensor"]
    assert "bent_sensor on i2" in repr(options.own_hypotheses[0])
