"""`kr5 insert`: what it says of an insertion, and its page in a headless Chromium. Whether a peg goes in is the
library's."""

import html
import json
import math
import re
import shlex
from types import SimpleNamespace

import kr5.cell
import kr5.force
import kr5.io
import numpy as np
import pytest

sim = pytest.importorskip("kr5.sim", reason="this kr5 was built without DART")

from kr5_tools.insertion import (
    directions,
    ending_tables,
    messages,
)
from kr5_tools.insertion.task import offset_in_disc

EASY = ("--clearance", 1, "--offset", 3, 4, "--seed", 3)


@pytest.fixture(scope="module")
def result(share):
    setup = sim.InsertionSetup(clearance=1e-3, tilt=math.radians(15), offset=[1e-3 * 3, 1e-3 * 4], seed=3)
    return sim.run_insertion(kr5.cell.load_cell(share / "cells/kr5_arc.yaml"), setup), setup


def test_what_is_written_is_what_the_library_says(result, run_kr5, tmp_path):
    expected, _setup = result
    done = run_kr5("insert", *EASY, "--json", "out.json", "--csv", "rows.csv", "--png", "plots")
    assert done.returncode == (0 if expected.inserted else 1), done.stderr
    out = json.loads((tmp_path / "out.json").read_text())
    assert out["inserted"] == expected.inserted and out["time"] == expected.time and len(out["pegs"]) == 1
    assert out["setup"]["clearance"] == pytest.approx(1e-3) and out["setup"]["tilt"] == pytest.approx(np.radians(15))
    assert out["pegs"][0]["depth"] == pytest.approx(expected.pegs[0].depth, rel=1e-6, abs=1e-6)
    rows = kr5.io.load_csv(tmp_path / "rows.csv")
    assert rows.columns == expected.rows.columns
    np.testing.assert_allclose(rows["true_z"], expected.rows["true_z"], atol=1e-9)
    assert {f.name for f in (tmp_path / "plots").iterdir()} >= {"forces.png", "height.png", "path.png"}
    for words in ("Phases", "roll", "depth [mm]", "(3.000, 4.000) mm"):
        assert words in done.stdout


@pytest.mark.parametrize("seed", [3, 4, 5, 6, 7, 9])
def test_directions_to_the_hole_are_those_of_the_turn_beside_the_real_one(share, seed):
    cell = kr5.cell.load_cell(share / "cells/kr5_arc.yaml")
    inserted = sim.run_insertion(cell, sim.InsertionSetup(offset=[4e-3, 4e-3], seed=seed))
    found = directions.directions(inserted)
    assert list(found) == ["fit", "moment", "least depth", "true"]
    assert found["moment"]["std"] is None  # its error is not noise
    turn = inserted.profile
    really = found["true"]["azimuth"]
    assert really == pytest.approx(math.atan2(4e-3 - np.mean(turn["y"]), 4e-3 - np.mean(turn["x"])))
    # Four standard deviations: one in 16000 is further off.
    assert abs(math.remainder(found["fit"]["azimuth"] - really, math.tau)) < 4 * found["fit"]["std"] < math.radians(10)
    shown = directions.table_rows(inserted)
    assert [row[0] for row in shown] == list(found) and shown[-1][2:] == ["–", "–"]
    assert float(shown[0][3]) == pytest.approx(
        math.degrees(math.remainder(found["fit"]["azimuth"] - really, math.tau)), abs=0.051
    )


def test_without_a_turn_there_are_no_directions(share):
    cell = kr5.cell.load_cell(share / "cells/kr5_arc.yaml")
    nothing = sim.run_insertion(cell, sim.InsertionSetup(clearance=-1e-4))
    assert directions.directions(nothing) == {} and directions.table_rows(nothing) == []


def test_phases_follow_each_other_without_a_gap(result):
    found = ending_tables.phases(result[0].rows)
    t = np.asarray(result[0].rows["t"])
    assert found[0]["begin"] == t[0] and [p["phase"] for p in found][:2] == ["tare", "approach"]
    for before, after in zip(found, found[1:]):
        assert before["begin"] + before["duration"] == pytest.approx(after["begin"])
    assert sum(p["duration"] for p in found) == pytest.approx(t[-1] - t[0])


@pytest.mark.parametrize("width", [1280, 390])
def test_the_page_replays_the_cell_and_the_tube_from_close_by(run_kr5, browser, tmp_path, width):
    run_kr5("insert", *EASY, "-o", "page.html")
    browser.open_whole(tmp_path / "page.html", width)
    pictures = "['scene', 'close'].map((id) => document.getElementById(id).toDataURL())"
    before = browser.evaluate(pictures)
    browser.evaluate("(s => { s.value = 3.0; s.dispatchEvent(new Event('input')); })(document.getElementById('time'))")
    assert all(a != b for a, b in zip(before, browser.evaluate(pictures)))
    assert "attempt 1: roll" in browser.evaluate("document.getElementById('told').textContent")
    assert browser.evaluate("document.querySelectorAll('svg.plot').length") == 4
    assert browser.complaints() == []


def test_the_example_of_the_help_runs(run_kr5, tmp_path):
    command = run_kr5("insert", "--help").stdout.split("Example: kr5 ")[1].splitlines()[0]
    done = run_kr5(*shlex.split(command))
    assert done.returncode in (0, 1) and "insertion.html: open it in a browser" in done.stdout, done.stderr
    assert (tmp_path / "insertion.html").is_file()


@pytest.mark.parametrize(
    "args, sentence",
    [
        (["--clearance", 0.5], r"Peg 1 inserted at attempt 1, [\d.]+ mm deep, after [\d.]+ s\."),
        (["--offset", 40, 0], r"Peg 1 not inserted: [a-z].* Possible remedy: .*\."),
    ],
)
def test_the_page_of_a_result_says_how_a_peg_ended_as_the_terminal_does(run_kr5, tmp_path, args, sentence):
    done = run_kr5("insert", *args, "--json", "r.json")
    (told,) = [line for line in done.stdout.splitlines() if line.startswith("Peg 1 ")]
    assert re.fullmatch(sentence, told)
    assert run_kr5("report", "r.json", "-o", "page.html").returncode == 0
    assert told in html.unescape((tmp_path / "page.html").read_text())


def test_the_offset_is_drawn_from_the_seed_within_one_radius(run_kr5):
    drawn = np.array([offset_in_disc(2.0, seed) for seed in range(2000)])
    r = np.hypot(*drawn.T)
    assert r.max() <= 2 and np.mean(r < np.sqrt(2)) == pytest.approx(
        0.5, abs=0.05
    )  # half of the area, half of the draws
    assert np.abs(drawn.mean(axis=0)).max() < 0.1
    out = [json.loads(run_kr5("insert", "--clearance", 2, "--seed", seed, "--json", "-").stdout) for seed in (7, 7, 8)]
    for data in out:
        assert data.pop("format") == "kr5-insertion/1" and data.pop("created")
    assert out[0] == out[1] and out[0]["setup"]["offset"] != out[2]["setup"]["offset"]
    np.testing.assert_allclose(out[0]["setup"]["offset"], offset_in_disc(0.00942, 7))


@pytest.mark.parametrize(
    "args, words",
    [
        (["--clearance", 0], "clearance: found 0, expected more than 0 mm"),
        (["--tilt", 95], "tilt: found 95"),
        (["--pegs", 0], "pegs"),
        (["--cell", "none.yaml"], "none.yaml"),
        (["-o", "nowhere/page.html"], "no such folder nowhere"),
        (["--strategy", "luck"], "profile_fit"),
    ],
)
def test_bad_input_is_refused_before_anything_moves(run_kr5, args, words):
    done = run_kr5("insert", *args)
    assert done.returncode == 2 and words in done.stderr and "Traceback" not in done.stderr


def test_a_cell_without_a_peg_is_refused_by_name(run_kr5, share, tmp_path):
    text = (share / "cells/kr5_arc.yaml").read_text().replace("peg: {radius: 0.00942, length: 0.05}\n", "")
    (tmp_path / "cell.yaml").write_text(text)
    done = run_kr5("insert", "--cell", "cell.yaml")
    assert done.returncode == 2 and "peg: is missing" in done.stderr


def test_a_peg_that_is_not_in_is_told_with_what_may_help(run_kr5):
    done = run_kr5("insert", "--offset", 60, 0, "--json", "-")
    assert done.returncode == 1 and json.loads(done.stdout)["inserted"] is False
    assert "Peg 1 not inserted: " in done.stderr and "Possible remedy" in done.stderr


def test_every_reason_of_the_library_has_words():
    names = [str(reason) for reason in kr5.force.Reason.__members__.values()]
    assert set(messages.REASONS) == set(names) - {"inserted"}
    for name in names:
        peg = SimpleNamespace(inserted=False, phase="push", reason=name, attempts=2, depth=0.01, time=3.0)
        assert messages.ending_text(peg)[0] == "not inserted"
