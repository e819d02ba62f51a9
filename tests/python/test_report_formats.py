"""`kr5 report` on a real result of every format: the page in light and dark, on a desk and a phone."""

import importlib
import json
from pathlib import Path

import pytest
from kr5.files import results
from kr5.files.paths import find_shipped_cell

from command_runner import run_command
from conftest import ROOT
from kr5_tools.command_table import result_titles
from test_tool import streams, write_stream

SHARE = ROOT / "share"
DEMO, RECORDING = SHARE / "data/demo", SHARE / "data/friction"
BOARD = "grid:36h11:5x7:0.03:0.01"
CELL = str(find_shipped_cell())


def kr5(*words, cwd, codes=(0, 1)):
    """Runs the command; a result that is unusable ends with 1, and has its page, too."""
    done = run_command(*words, cwd=cwd, width=200, warnings="default")
    assert done.returncode in codes, done.stderr
    return done


def camera(folder):
    few = [DEMO / f"images/view_{k:02}.png" for k in range(1, 9)]
    return "calibrate", "camera", *few, "--target", BOARD, "-o", "r.json"


def hand_eye(folder):
    return "calibrate", "hand-eye", DEMO, "-o", "r.json"


def timed(folder):
    th, hands, tc, cameras = streams(noise=3e-4)
    write_stream(folder / "hand.csv", th, hands)
    write_stream(folder / "camera.csv", tc, cameras)
    return "calibrate", "timed", "hand.csv", "camera.csv", "-o", "r.json"


def marker_map(folder):
    """Each marker of the demo's board for itself."""
    size = ("--size", "0.03", "--family", "36h11", "--camera", DEMO / "camera.yaml")
    images = [DEMO / f"images/view_0{k}.png" for k in (1, 2, 3)]
    return "calibrate", "map", *images, *size, "-o", "r.json"


def postures(folder):
    few = ("--count", "12", "--draw", "60")
    return "calibrate", "postures", "--cell", CELL, *few, "-o", "q.csv", "--json", "r.json"


def bin_of(folder):
    """A small bin of few cylinders."""
    (folder / "own.yaml").write_text("T_base_bin: [0.5, 0.2, 0.1, 0.02, -0.03, 0.4]\nsize: [0.12, 0.12, 0.08]\n")
    return "--bin", "own.yaml", "--pellets", "6", "--pitch", "0.001", "--seed", "2"


def pick(folder):
    kr5("bin", "simulate", "scan", *bin_of(folder), cwd=folder)
    return "pick", "scan/cloud.npz", "--bin", "scan/bin.yaml", "-o", "r.json"


def detection(folder):
    seen = [DEMO / f"images/view_0{k}.png" for k in (1, 2)]
    return "detect", *seen, "--target", BOARD, "--camera", DEMO / "camera.yaml", "--json", "r.json"


def sensitivity(folder):
    return "sensitivity", "--samples", "64", "--max-samples", "64", "-o", "out"


def sweep(folder):
    grid = ("--tilts", "15", "--clearances", "0.05,0.28", "--trials", "2", "--workers", "1")
    return "sweep", "insertion", *grid, "-o", "out"


def servos(folder):
    pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install 'kr5[mujoco]'")
    import mujoco_servo_log

    mujoco_servo_log.write_servo_log(folder)
    return "identify", "servos", "log.csv", "--model", "model.xml", "-o", "r.json"


def gap_plan(folder):
    return "gap", "plan", RECORDING, "--separate", "coulomb_friction:joint6,backlash:joint6", "--json", "r.json"


def old_diagnosis(folder):
    """No command writes it any more."""
    old = json.loads((Path(__file__).parent / "data/gap-1.json").read_text())
    (folder / "r.json").write_text(json.dumps({**old, "input": {"recording": str(SHARE / "data/recording")}}))
    return ("--version",)


def told_by_tests():
    """The RESULTS of the tests of commands: by format, what makes its inputs in a folder and returns the words."""
    files = [f for f in sorted(Path(__file__).parent.glob("test_*.py")) if "\nRESULTS = {" in f.read_text("utf-8")]
    return {name: make for f in files for name, make in importlib.import_module(f.stem).RESULTS.items()}


# The command that writes a result of each format; the file is r.json unless RESULT_FILES says another.
MAKERS = {
    **told_by_tests(),
    "kr5-camera/1": camera,
    "kr5-hand-eye/1": hand_eye,
    "kr5-tool/1": lambda _: ("calibrate", "tool", SHARE / "data/touches", "-o", "r.json"),
    "kr5-postures/1": postures,
    "kr5-cell-calibration/1": lambda _: ("calibrate", "cell", DEMO, "-o", "r.json"),
    "kr5-laser-study/1": lambda _: (
        *("calibrate", "laser-study", "--stand-offs", "0.16:0.22:0.03", "--speeds", "0.01,0.1", "--passes", 4),
        *("-o", "r.json"),
    ),
    "kr5-drives/1": lambda _: (
        *("identify", "drives", SHARE / "data/drives/kr5_table_b2.csv", "--angle-unit", "deg", "--common-zero"),
        *("-o", "r.json"),
    ),
    "kr5-dynamics/1": lambda _: ("identify", "dynamics", RECORDING, "-o", "r.json"),
    "kr5-workspace/1": lambda _: ("workspace", CELL, "--samples", "3000", "-o", "r.json"),
    "kr5-axes-study/1": lambda _: (
        *("identify", "study", "--trials", "2", "--device", "laser_tracker", "--arc", "20", "-o", "r.json"),
    ),
    "kr5-servo/1": lambda _: ("identify", "servo", RECORDING, "-o", "r.json"),
    "kr5-servos/1": servos,
    "kr5-contact/1": lambda _: ("identify", "contact", RECORDING, "--design", "-o", "r.json"),
    "kr5-force-torque/1": lambda _: ("identify", "force-torque", RECORDING, "-o", "r.json"),
    "kr5-timed-hand-eye/1": timed,
    "kr5-marker-map/1": marker_map,
    "kr5-detection/1": detection,
    "kr5-gap/2": lambda _: ("gap", "diagnose", RECORDING, "-o", "r.json"),
    "kr5-gap/1": old_diagnosis,
    "kr5-gap-measure/1": lambda _: ("gap", "measure", RECORDING, "--json", "r.json"),
    "kr5-gap-comparison/1": lambda _: ("gap", "compare", RECORDING, RECORDING, "--json", "r.json"),
    "kr5-gap-plan/1": gap_plan,
    "kr5-gap-explanation/1": lambda _: ("gap", "explain", RECORDING, "stribeck_friction", "--json", "r.json"),
    "kr5-insertion/1": lambda _: ("insert", "--clearance", "0.05", "--offset", "3", "4", "--json", "r.json"),
    "kr5-sweep/1": sweep,
    "kr5-scene-result/1": lambda _: ("scene", "run", SHARE / "scenes/peg_roll.yaml", "--json", "r.json"),
    "kr5-pick/1": pick,
    "kr5-bin-run/1": lambda folder: ("bin", "empty", *bin_of(folder), "--json", "r.json"),
    "kr5-sensitivity/1": sensitivity,
    "kr5-uncertainty/1": lambda _: ("uncertainty", "laser", "--json", "r.json"),
}
RESULT_FILES = {"kr5-sensitivity/1": "out/result.json", "kr5-sweep/1": "out/sweep.json"}


def test_every_format_of_the_project_is_tried():
    assert set(MAKERS) == set(result_titles())


def check_page(page, browser):
    for theme in ("light", "dark"):
        for width in (390, 1400):
            browser.open_whole(page, width, theme)
        assert browser.illegible() == []
        ground = browser.evaluate("getComputedStyle(document.body).backgroundColor")
        assert (sum(map(int, ground[4:-1].split(","))) < 200) == (theme == "dark")


@pytest.mark.parametrize("format", MAKERS)
def test_a_result_has_a_page(format, browser, tmp_path):
    kr5(*MAKERS[format](tmp_path), cwd=tmp_path)
    file = RESULT_FILES.get(format, "r.json")
    assert results.read_result(tmp_path / file, format)["format"] == format
    done = kr5("report", file, "-o", "page.html", "--png", "plots", cwd=tmp_path, codes=(0,))
    assert "Warning" not in done.stderr and "Traceback" not in done.stderr, done.stderr
    page = tmp_path / "page.html"
    assert page.stat().st_size < 4_000_000
    check_page(page, browser)


@pytest.mark.parametrize("name", sorted(p.name for p in (SHARE / "protocols").iterdir()))
def test_a_protocol_has_a_page(name, browser, tmp_path):
    done = kr5("report", SHARE / "protocols" / name, "-o", "page.html", cwd=tmp_path, codes=(0,))
    assert "Warning" not in done.stderr
    check_page(tmp_path / "page.html", browser)
    assert "kr5 replay" in (tmp_path / "page.html").read_text()


@pytest.mark.parametrize(
    "file,shown",
    [
        ("cells/kr5_arc.yaml", "kr5 cell show"),
        ("data/friction/recording.yaml", "kr5 replay"),
        ("data/demo/dataset.yaml", "kr5 calibrate hand-eye"),
        ("scenes/peg_roll.yaml", "kr5 scene run"),
    ],
)
def test_other_files_are_refused_with_the_command_that_shows_them(file, shown, tmp_path):
    done = kr5("report", SHARE / file, cwd=tmp_path, codes=(2,))
    assert shown in done.stderr and "format" in done.stderr and not (tmp_path / "report.html").exists()


def test_a_sweep_without_its_trials_is_refused(tmp_path):
    kr5(*sweep(tmp_path), cwd=tmp_path)
    text = (tmp_path / "out/trials.csv").read_bytes()
    (tmp_path / "out/trials.csv").write_bytes(text + b"vertical,profile")  # broken off while it was written
    kr5("report", "out/sweep.json", cwd=tmp_path, codes=(0,))
    assert (tmp_path / "out/trials.csv").read_bytes() == text + b"vertical,profile"
    (tmp_path / "out/trials.csv").write_bytes(text.splitlines(keepends=True)[0])
    done = kr5("report", "out/sweep.json", cwd=tmp_path, codes=(2,))
    assert "has no finished trial" in done.stderr
    (tmp_path / "out/trials.csv").unlink()
    done = kr5("report", "out/sweep.json", cwd=tmp_path, codes=(2,))
    assert "trials.csv" in done.stderr and "Traceback" not in done.stderr


def test_the_recording_that_the_demo_diagnoses_has_the_cause_that_its_readme_names(tmp_path):
    import yaml

    kr5("gap", "diagnose", RECORDING, "-o", "r.json", cwd=tmp_path, codes=(0,))
    (cause,) = json.loads((tmp_path / "r.json").read_text())["causes"]
    truth = yaml.safe_load((RECORDING / "truth.yaml").read_text())
    assert (cause["effect"], cause["target"]) == (truth["effect"], truth["target"])
    found = cause["parameters"]["coulomb"]
    assert abs(found["value"] - truth["parameters"]["coulomb"]) < 3 * found["std"]
