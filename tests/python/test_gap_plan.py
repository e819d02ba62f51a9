"""`kr5 gap plan` and kr5.gap.plan."""

import json

import kr5
import kr5.cell
import numpy as np
import pytest

gap = pytest.importorskip("kr5.gap")

SHORT = """format: kr5-protocol/1
home: [0.0, 0.02, -2.75, 0.0, -0.3, 1.571]
experiments:
- {name: motion-1, kind: motion, split: fit, signal: fourier, duration: 6.0, reach: 0.3, speed: 0.1}
"""
PAIR = "coulomb_friction:joint2,load_friction:joint2"


@pytest.fixture
def hasty(run_kr5, share, tmp_path):
    """A short motion of a cell with more friction in joint 2, and that cell."""
    cell = kr5.cell.load_cell(share / "cells/kr5_arc.yaml")
    cell.effects = {}
    cell.set_effect("coulomb_friction", "joint2", "coulomb", 43.0)
    kr5.cell.save_cell(cell, tmp_path / "worn.yaml")
    (tmp_path / "short.yaml").write_text(SHORT)
    done = run_kr5("record", "--cell", "worn.yaml", "--protocol", "short.yaml", "--nominal", "-o", "hasty")
    assert done.returncode == 0, done.stderr
    return tmp_path / "hasty"


def test_a_plan_becomes_a_protocol_that_is_recorded_and_decides(run_kr5, hasty, tmp_path):
    done = run_kr5("gap", "plan", hasty, "--separate", PAIR, "--load", "3", "-o", "next.yaml", "--json", "plan.json")
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "plan.json").read_text())
    best = data["experiments"][0]
    assert (
        not data["exact_tie"]
        and best["separation_repeated"] > 4
        and best["what"].lower() in " ".join(done.stdout.lower().split())
    )
    assert all(len(c["change"]) == 2 for c in best["columns"])
    recorded = run_kr5("record", "--cell", "worn.yaml", "--protocol", "next.yaml", "--nominal", "-o", "monday")
    assert recorded.returncode == 0, recorded.stderr
    again = kr5.cell.load_recording(tmp_path / "monday")
    assert np.all(np.abs(again.experiments[0]["qc2"]) < 2.8)
    decided = run_kr5("gap", "plan", hasty, "--separate", PAIR, "--done", "monday", "--json", "weighed.json")
    assert decided.returncode == 0, decided.stderr
    weighed = json.loads((tmp_path / "weighed.json").read_text())
    assert weighed["best"] == 0 and weighed["probability"][0] > 0.9
    page = run_kr5("report", "weighed.json", "-o", "weighed.html")
    assert page.returncode == 0, page.stderr
    shown = (tmp_path / "weighed.html").read_text()
    assert f"{weighed['text'][:1].upper()}{weighed['text'][1:]}." in shown and shown.count("% probable") >= 2


def test_a_protocol_hangs_a_known_weight_on_the_tool(run_kr5, hasty, tmp_path):
    (tmp_path / "heavy.yaml").write_text(SHORT.replace("experiments:", "load: 3.0\nexperiments:"))
    assert (
        run_kr5("record", "--cell", "worn.yaml", "--protocol", "heavy.yaml", "--nominal", "-o", "heavy").returncode == 0
    )
    heavy, light = kr5.cell.load_recording(tmp_path / "heavy"), kr5.cell.load_recording(hasty)
    assert heavy.cell.tool.mass == pytest.approx(light.cell.tool.mass + 3.0)
    assert np.mean(heavy.experiments[0]["fz"] - light.experiments[0]["fz"]) == pytest.approx(3.0 * 9.81, abs=3.0)
    (tmp_path / "bad.yaml").write_text(SHORT.replace("experiments:", "load: much\nexperiments:"))
    done = run_kr5("record", "--cell", "worn.yaml", "--protocol", "bad.yaml", "-o", "bad")
    assert done.returncode == 2 and "load" in done.stderr and "much" in done.stderr


@pytest.mark.parametrize(
    "given, word",
    [
        ("coulomb_friction", "EFFECT:TARGET"),
        ("coulomb_friction:joint2", "two"),
        ("coulomb_friction:joint2,coulomb_friction:elbow", "elbow"),
        ("coulomb_friction:joint2,friktion:joint2", "friktion"),
    ],
)
def test_what_cannot_be_separated_is_refused(run_kr5, hasty, given, word):
    done = run_kr5("gap", "plan", hasty, "--separate", given)
    assert done.returncode == 2 and word in done.stderr


def test_options_are_checked():
    with pytest.raises(kr5.InvalidArgument, match="separation"):
        gap.PlanOptions(separation=0.0).validate()
    with pytest.raises(kr5.InvalidArgument, match="speed"):
        gap.PlanOptions(speed=2.0).validate()
