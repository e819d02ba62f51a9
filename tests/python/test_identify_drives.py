"""`kr5 identify drives`, and the conditioning of logs from Python."""

import json

import numpy as np
import pytest
from kr5 import cell, identification
from kr5.files.paths import find_shipped_cell
from scipy import signal

GEARS = (125.04, 125.05, 86.98, 74.59, 42.00, 24.13)


@pytest.fixture
def book_table(share):
    return share / "data/drives/kr5_table_b2.csv"


def write(file, columns):
    rows = np.column_stack(list(columns.values()))
    file.write_text("\n".join([",".join(columns), *(",".join(f"{v:.9g}" for v in row) for row in rows)]) + "\n")


def test_the_books_table_gives_its_ratios_and_goes_into_a_cell(tmp_path, book_table, run_kr5):
    nominal = find_shipped_cell()
    words = ("identify", "drives", book_table, "--angle-unit", "deg", "--common-zero", "-o", "drives.json")
    done = run_kr5(*words, "--cell", nominal, "--write-cell", "cell.yaml")
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "drives.json").read_text())
    assert data["format"] == "kr5-drives/1"
    assert np.diag(data["result"]["structure"]) == pytest.approx(GEARS, rel=0.01)
    assert data["verdict"]["word"] == "doubtful"
    assert "motor 4, row 18: the joint angle is -0.2" in data["verdict"]["text"]
    assert cell.load_cell(tmp_path / "cell.yaml").drives.structure[2, 2] == pytest.approx(86.98, rel=0.01)
    shown = run_kr5("report", "drives.json", "-o", "page.html")
    assert shown.returncode == 0, shown.stderr


def test_couplings_are_found_and_written(tmp_path, run_kr5):
    S = np.diag([90.0, 60.0, 40.0])
    S[2, 1] = -2.0
    q = np.random.default_rng(1).uniform(-1, 1, (30, 3))
    counts = q @ S.T * 4096 / (2 * np.pi) + [7.0, 500.0, -90.0]
    columns = {f"q{k + 1}": q[:, k] for k in range(3)} | {f"c{k + 1}": counts[:, k].round() for k in range(3)}
    write(tmp_path / "readings.csv", columns)
    done = run_kr5("identify", "drives", "readings.csv", "--counts-per-turn", "4096", "-o", "drives.json")
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "drives.json").read_text())
    assert data["verdict"] == {"word": "good", "text": "1 couplings between joints and motors"}
    assert data["result"]["structure"] == pytest.approx(S, rel=1e-3)


@pytest.mark.parametrize(
    ("text", "words", "expected"),
    [
        ("a,b\n1,2\n", (), "missing: q1, q2, … (joint angles; see --columns)"),
        ("q1,q2\n1,2\n", (), "neither encoder counts c1 to c2 nor motor angles"),
        ("q1,q2,c1\n1,2,3\n", (), "missing: c2"),
        ("q1,c1\n1,2\n2,4\n3,6\n", (), "counts_per_turn: needed where no motor angles are given"),
        ("q1,c1\n1,2\n2,4\n3,6\n", ("--counts-per-turn", "x"), "--counts-per-turn: found 'x'"),
        ("q1,m1\n1,90\n", (), "motor 1: 1 readings do not determine its ratio"),
        ("q1,m1\n1,90\n2,180\n", ("--angle-unit", "grad"), "'grad' is not one of 'rad', 'deg'"),
    ],
)
def test_readings_that_tell_nothing_are_refused(tmp_path, run_kr5, text, words, expected):
    (tmp_path / "readings.csv").write_text(text)
    done = run_kr5("identify", "drives", "readings.csv", *words, "-o", "drives.json")
    assert done.returncode == 2
    assert expected in " ".join(done.stderr.replace("│", " ").split())
    assert not (tmp_path / "drives.json").exists()


def test_the_low_pass_is_scipys():
    x = np.random.default_rng(2).normal(size=(800, 2)).cumsum(axis=0)
    for order, cutoff in ((4, 6.0), (5, 2.0), (2, 30.0)):
        sections = signal.butter(order, cutoff, fs=100.0, output="sos")
        long = min(len(x) - 1, int(np.ceil(order / (cutoff * 0.01))))
        expected = signal.sosfiltfilt(sections, x, axis=0, padtype="odd", padlen=long)
        assert identification.zero_phase_low_pass(x, 0.01, cutoff, order) == pytest.approx(expected, abs=1e-9)


def test_a_faulty_log_gives_no_motion():
    t = 0.01 * np.arange(600)
    q = np.column_stack([np.sin(t), np.cos(1.7 * t)])
    tau = np.column_stack([5 * np.cos(q[:, 0]), 3 * q[:, 1]])
    tau[200:240, 1] = np.nan
    got = identification.condition_log(identification.JointLog(t=t, q=q, tau=tau, tau_names=["a", "Motor 2"]))
    assert not got.usable and got.motion.t.size == 0
    assert str(got.findings[0].fault) == "not_finite" and got.findings[0].column == "Motor 2"
    assert (got.findings[0].begin, got.findings[0].end) == pytest.approx((2.0, 2.39))


def test_a_high_cut_off_does_not_make_two_clocks_of_one(reference):
    columns = np.genfromtxt(reference / "data/dyn_panda_gaz2019/panda_excitation.csv", delimiter=",", names=True)
    late = columns["t"] > 13.5
    q, tau = (np.column_stack([columns[f"{stem}{k + 1}"][late] for k in range(7)]) for stem in ("q", "tau"))
    log = identification.JointLog(t=columns["t"][late], q=q, tau=tau)
    for cutoff in (0.0, 20.0, 40.0):
        found = identification.check_log(log, identification.ConditioningOptions(cutoff=cutoff))
        assert not [f.text for f in found if str(f.severity) == "error"], cutoff


DAMAGED = [
    (
        "identification",
        "identify drives readings.csv --angle-unit deg --common-zero -o out.json",
        "poses",
        ("readings.csv",),
        ("out.json",),
        2,
    )
]
