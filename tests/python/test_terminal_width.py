"""What the commands print in a terminal of 80 columns: the answer first, short tables, units in every head."""

import json
import math
import re
from collections import Counter

import pytest

WIDE = 300  # columns of a terminal in which every head of a table has a line of its own


def heads_of(text: str, title: str) -> str:
    """The first line below the title of a table, where the terminal is wide enough for heads of one line."""
    return " ".join(text.partition(title)[2].split("\n")[1].split())


def test_a_diagnosis_tells_the_verdict_first_and_then_the_causes(run_kr5, worn_recording):
    done = run_kr5("gap", "diagnose", worn_recording)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0].startswith("Explained. Cause: ") and "times the noise on experiments not used to fit" in lines[0]
    places = [done.stdout.index(word) for word in ("\nCauses", "\nWhere", "\nNext steps")]
    assert places == sorted(places)
    cause = next(line for line in lines if line.startswith("  - "))
    assert re.search(r"\((\w+):joint\d\): .*± \S+ N m.*; .* probable; explains .* of the gap\.$", cause)
    whole = run_kr5("gap", "diagnose", worn_recording, "--all", width=WIDE)
    assert heads_of(whole.stdout, "\nWhere").endswith("pattern of the gap") and "pattern" not in done.stdout


def test_only_columns_above_the_limit_are_measured_without_all(run_kr5, worn_recording, tmp_path):
    short = run_kr5("gap", "measure", worn_recording, "--json", "gap.json")
    whole = run_kr5("gap", "measure", worn_recording, "--all")
    columns = {line.split()[0] for line in whole.stdout.splitlines() if re.match(r" [\w-]+\.\w+ ", line)}
    listed = {line.split()[0] for line in short.stdout.splitlines() if re.match(r" [\w-]+\.\w+ ", line)}
    exceeding = {line.split()[0] for line in whole.stdout.splitlines() if line.rstrip().endswith("exceeds")}
    assert listed == exceeding and exceeding < columns and len(columns) > 50
    data = json.loads((tmp_path / "gap.json").read_text())
    above = [gap for name, gap in data["columns"].items() if gap > data["limits"][name]]
    rms = math.sqrt(sum(gap**2 for gap in above) / len(above))
    told = f"{rms:.3f} over the {len(exceeding)} above the limit of noise; {len(columns) - len(exceeding)} within it"
    assert len(above) == len(exceeding) and told in short.stdout
    assert "rad or m" not in whole.stdout


def test_a_plan_shows_no_number_that_nobody_can_read(run_kr5, worn_recording):
    pair = "coulomb_friction:joint3,stribeck_friction:joint3"
    done = run_kr5("gap", "plan", worn_recording, "--separate", pair, "-o", "next.yaml")
    assert done.returncode == 0, done.stderr
    assert "Coulomb friction of joint 3" in done.stdout and "coulomb_friction on joint3" not in done.stdout
    assert not re.search(r"e-\d\d", done.stdout)
    assert "rad at " in " ".join(done.stdout.split())
    wide = run_kr5("gap", "plan", worn_recording, "--separate", pair, "-o", "wide.yaml", width=WIDE)
    assert "duration [s]" in heads_of(wide.stdout, "best first")


@pytest.mark.parametrize(
    "words, told",
    [
        (["gap", "explain", "{recording}", "coulomb_friction"], ["explained [%]"]),
        (["cell", "show", "{recording}"], ["rotor [kg mm²]", "Ixx [g m²]", "b [mm]"]),
        (["scene", "run", "{share}/scenes/payload_drop.yaml"], ["3 of 3 expectations met", "from [s]", " N "]),
        (["detect", "{demo}/images/view_01.png", "--family", "36h11"], ["33 markers found", "side [px]"]),
        (
            ["detect", "{demo}/images/view_01.png", "--target", "grid:36h11:5x7:0.03:0.01", "--camera", "{camera}"],
            ["Target found in 1 of 1", "z [mm]", "yaw [deg]"],
        ),
        (["target", "points", "--target", "chessboard:3x4:0.025"], ["x [mm]"]),
        (["calibrate", "hand-eye", "{demo}"], ["At 0.4", "RMS (95 %: below", "your tolerance: 2 mm"]),
        (["calibrate", "tool", "{share}/data/touches"], ["Good: the tip is known", "x [mm]"]),
        (["calibrate", "postures", "--cell", "{cell}", "--count", "6", "--draw", "40"], ["unit"]),
        (["identify", "servo", "{recording}", "--joint", "1"], ["natural frequency", "rad/s"]),
        (["insert", "--clearance", "0.5"], ["Peg 1 inserted at attempt 1", "depth [mm]", "error [deg]"]),
        (["workspace", "{cell}", "--samples", "2000"], ["reach of the", "mm"]),
        (["uncertainty", "laser"], ["mm²"]),
    ],
)
def test_every_table_fits_with_units(run_kr5, share, worn_recording, words, told):
    demo = share / "data/demo"
    places = {
        "recording": worn_recording,
        "share": share,
        "demo": demo,
        "camera": demo / "camera.yaml",
        "cell": share / "cells/kr5_arc.yaml",
    }
    command = [word.format(**places) for word in words]
    narrow, wide = run_kr5(*command), run_kr5(*command, width=WIDE)  # which check the width of the tables
    assert narrow.returncode in (0, 1), narrow.stderr
    assert Counter(wide.stdout.split()) <= Counter(narrow.stdout.split())  # every word and number is there as a whole
    for word in told:
        assert word in " ".join(wide.stdout.split()), wide.stdout


def test_an_arm_of_seven_joints_is_readable(run_kr5, tmp_path, reference):
    robot = reference / "data/dyn_lbr_med7_kcl/med7dock.urdf"
    assert run_kr5("cell", "import", robot, "-o", "cell.yaml").returncode == 0
    done = run_kr5("cell", "show", "cell.yaml")
    assert not re.search(r"\d…|e-\d\d|(?<!\d)-0 ", done.stdout)
    assert all(f"S·{k}" in done.stdout for k in range(1, 8))


def test_the_kinds_of_what_was_checked_are_counted(run_kr5, worn_recording, share):
    assert run_kr5("cell", "check", worn_recording).stdout.endswith("no problem in 1 recording.\n")
    assert run_kr5("cell", "check", share / "cells/kr5_arc.yaml").stdout.endswith("no problem in 1 cell.\n")


def test_exchanged_rows_and_columns_are_named_and_not_calibrated(run_kr5, share, tmp_path):
    done = run_kr5("calibrate", "hand-eye", share / "data/demo", "--target", "grid:36h11:7x5:0.03:0.01", "-o", "r.json")
    assert done.returncode == 2 and "a grid of 5x7 (rows x columns), where 7x5 was expected" in done.stderr
    assert not (tmp_path / "r.json").exists()


def test_squares_in_millimetres_are_refused_where_no_image_shows_the_scale(run_kr5, share):
    images = share / "data/demo/images"
    done = run_kr5("calibrate", "camera", images, "--target", "chessboard:6x9:25")
    assert done.returncode == 2 and "for 25 mm give 0.025" in done.stderr
    done = run_kr5("calibrate", "map", images, "--camera", share / "data/demo/camera.yaml", "--size", "30")
    assert done.returncode == 2 and "--size: size 30 [m]" in done.stderr


def test_the_size_of_markers_must_be_given(run_kr5, share):
    done = run_kr5("calibrate", "map", share / "data/demo/images", "--camera", share / "data/demo/camera.yaml")
    assert done.returncode == 2 and "Missing option '--size'" in done.stderr


def test_a_corrected_answer_stands_beside_the_one_as_recorded(run_kr5, tmp_path, share):
    target = "grid:36h11:5x7:0.033:0.011"  # a tenth larger than it is
    done = run_kr5("calibrate", "hand-eye", share / "data/demo", "--target", target, "-o", "r.json")
    assert "corrected" in done.stdout and "Correcting this moves the result by" in done.stdout.splitlines()[0]
    figures = {f["name"]: f for f in json.loads((tmp_path / "r.json").read_text())["figures"]}
    truth = run_kr5("calibrate", "hand-eye", share / "data/demo", "-o", "t.json")
    assert truth.returncode == 0
    right = {f["name"]: f for f in json.loads((tmp_path / "t.json").read_text())["figures"]}
    for axis in "xyz":
        name = f"camera on flange {axis}"
        value, std = figures[name]["corrected"]
        assert abs(value - right[name]["value"]) < 4 * (std + right[name]["std"]) + 0.05
