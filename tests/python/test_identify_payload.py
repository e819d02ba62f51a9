"""`kr5 identify payload`: the hidden load of a case, from two recordings and from one with an identified cell."""

import json

import kr5.cell
import numpy as np
import pytest

from conftest import ROOT


@pytest.fixture(scope="module")
def cases(reference):
    return reference / "cases"


@pytest.fixture(scope="module")
def truth(cases):
    """Mass and centre in the flange of the load of case 1; the label has it in the sensor."""
    effect = json.loads((cases / "labels.json").read_text())["case-001"]["effects"][0]["parameters"]
    T = np.asarray(kr5.cell.load_cell(cases / "case-001/cell.yaml").tool.T_flange_sensor)
    return effect["mass"], T[:3, :3] @ effect["com"] + T[:3, 3]


def identified(folder, run_kr5, *arguments):
    done = run_kr5("identify", "payload", *arguments, "-o", "out.json", "--page", "page.html")
    assert done.returncode == 0, done.stderr
    return json.loads((folder / "out.json").read_text())


def figures(data):
    rows = {f["name"]: f for f in data["figures"]}
    names = ("mass", "centre x", "centre y", "centre z")
    scale = np.array([1.0, 1e-3, 1e-3, 1e-3])
    return tuple(scale * [rows[name][key] for name in names] for key in ("value", "std"))


@pytest.mark.parametrize("without", [(), ("--without", "case-006")])
def test_the_load_of_a_case_agrees_with_its_label(tmp_path, cases, truth, run_kr5, without):
    words = [cases / w if w.startswith("case") else w for w in without]
    data = identified(tmp_path, run_kr5, cases / "case-001", *words, "--write-cell", "new.yaml")
    value, std = figures(data)
    mass, com = truth
    assert (np.abs(value - [mass, *com]) < 3 * std).all()
    assert std[0] < 0.05 * mass
    assert data["format"] == "kr5-payload/1"
    trusted = "masses and friction of the cell are trusted" in data["verdict"]["text"]
    assert trusted == (not without)
    before, after = (kr5.cell.load_cell(f).tool for f in (cases / "case-001/cell.yaml", tmp_path / "new.yaml"))
    assert after.mass - before.mass == pytest.approx(value[0])
    moment = after.mass * np.asarray(after.com) - before.mass * np.asarray(before.com)
    T = np.asarray(before.T_flange_sensor)
    assert T[:3, :3] @ moment / value[0] + T[:3, 3] == pytest.approx(value[1:], abs=1e-9)
    shown = run_kr5("report", "out.json", "-o", "again.html", "--png", "plots")
    assert shown.returncode == 0 and (tmp_path / "plots/payload_torque_6.png").exists(), shown.stderr
    assert "What the load adds" in (tmp_path / "page.html").read_text()


def test_no_load_is_told_from_a_load(tmp_path, cases, run_kr5):
    data = identified(tmp_path, run_kr5, cases / "case-006")
    value, std = figures(data)
    assert abs(value[0]) < 3 * std[0]
    assert data["verdict"]["word"] == "doubtful" and "not distinguishable from 0" in data["verdict"]["text"]


def test_what_does_not_tell_a_load_is_refused(tmp_path, cases, run_kr5):
    def refused(*arguments):
        done = run_kr5("identify", "payload", *arguments, "-o", "out.json")
        assert done.returncode == 2 and "Traceback" not in done.stderr, done.stderr
        assert not (tmp_path / "out.json").exists()
        return " ".join(done.stderr.split())

    bare = kr5.cell.load_cell(cases / "case-001/cell.yaml")
    robot = bare.robot
    robot.links = []
    bare.robot = robot
    kr5.cell.save_cell(bare, tmp_path / "bare.yaml")
    assert "the cell has no links" in refused(cases / "case-001", "--cell", "bare.yaml")
    assert "a log needs its arm" in refused(cases / "case-001/motion-1.csv")
    assert "nowhere" in refused(cases / "case-001", "--without", "nowhere")
    assert "estimator: a payload is estimated with" in refused(cases / "case-001", "--estimator", "consistent")
    (tmp_path / "rec").mkdir()
    for file in ("cell.yaml", "motion-1.csv"):
        (tmp_path / "rec" / file).write_text((cases / "case-001" / file).read_text())
    lines = (tmp_path / "rec/motion-1.csv").read_text().splitlines()
    still = [lines[1].split(",")] * (len(lines) - 1)
    rows = [",".join([f"{0.012 * k:.3f}", *row[1:]]) for k, row in enumerate(still)]
    (tmp_path / "rec/motion-1.csv").write_text("\n".join([lines[0], *rows]) + "\n")
    (tmp_path / "rec/recording.yaml").write_text(
        "format: kr5-recording/1\ncell: cell.yaml\nexperiments:\n"
        "- {name: motion-1, kind: motion, file: motion-1.csv, split: fit}\n"
    )
    assert "the motion does not determine" in refused("rec")


RESULTS = {"kr5-payload/1": lambda _: ("identify", "payload", ROOT / "share/data/friction", "-o", "r.json")}

DAMAGED = [
    (
        "identification",
        "identify payload recording -o out.json --write-cell new.yaml",
        "recording",
        ("recording/*",),
        ("out.json", "new.yaml"),
        2,
    )
]
