"""`kr5 sensitivity`: the right indices whatever runs it and however often it is killed, and what it refuses."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from kr5 import kinematics, uncertainty
from typer.testing import CliRunner

from kr5_tools.app import make_app
from kr5_tools.sensitivity.analysis import split_rows

SLOW = 120  # [s], after which an analysis hangs
FAST = ("--samples", 64, "--max-samples", 64)
MODEL = """\
import time
import numpy as np

def ishigami(x):
    if PAUSE:
        time.sleep(PAUSE)
    return {"y": np.sin(x[0]) + 7 * np.sin(x[1]) ** 2 + 0.1 * x[2] ** 4 * np.sin(x[0])}

def rows(x):
    return np.column_stack([x[:, 0], 2 * x[:, 0] + x[:, 1]])

def constant(x):
    return [x[0], 3.0]

def broken(x):
    return float("nan") if x[1] > 1 else 1.0

def raising(x):
    raise ZeroDivisionError("no lever")

def growing(x):
    return list(range(1 if x[0] < 0 else 2))

def word(x):
    return "wide"
"""
ANGLE = "distribution: uniform, low: -180, high: 180, unit: deg"
INPUTS = "inputs:\n" + "".join(f"- {{name: x{k}, {ANGLE}}}\n" for k in (1, 2, 3))


def write_model(folder, pause=0.0):
    (folder / "model.py").write_text(MODEL.replace("PAUSE", str(pause)))
    (folder / "inputs.yaml").write_text(INPUTS)


@pytest.fixture
def folder(tmp_path):
    write_model(tmp_path)
    return tmp_path


@pytest.fixture
def invoke(folder, monkeypatch):
    """The command in this process, which spares its start."""
    monkeypatch.chdir(folder)
    app = make_app(("sensitivity",))

    def run(*args):
        done = CliRunner().invoke(app, ["sensitivity", *map(str, args)])
        assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
        done.returncode = done.exit_code
        return done

    return run


def result(folder, name="out"):
    """What an analysis found, without when and how it was called."""
    data = json.loads((folder / name / "result.json").read_text())
    return data["result"]["analyses"]


def test_a_function_has_its_indices_and_a_page(folder, run_kr5, browser):
    done = run_kr5(
        "sensitivity",
        "model.py:ishigami",
        "--inputs",
        "inputs.yaml",
        "-o",
        "out",
        "--png",
        "plots",
        "--json",
        "out.json",
        "--samples",
        256,
        "--max-samples",
        4096,
        "--tolerance",
        0.06,
    )
    assert done.returncode == 0, done.stderr
    (found,) = result(folder)
    assert json.loads((folder / "out.json").read_text())["result"]["analyses"] == [found]
    # Ishigami and Homma 1990; every interval within the tolerance that stopped it.
    assert found["converged"] and 256 < found["samples"] <= 4096
    total, first = np.array(found["total"])[:, 0], np.array(found["first"])[:, 0]
    assert np.allclose(total, [0.5576, 0.4424, 0.2437], atol=0.12)
    assert np.allclose(first, [0.3139, 0.4424, 0.0], atol=0.12)
    assert found["outputs"][0]["name"] == "y" and found["inputs"][0]["unit"] == "deg"
    assert (folder / "plots/model_y.png").stat().st_size > 5000
    browser.open_whole(folder / "out/report.html", 1280)
    assert browser.evaluate("document.querySelectorAll('svg.plot').length") == 1
    assert run_kr5("report", "out/result.json", "-o", "again.html").returncode == 0
    assert "One at a time" in (folder / "again.html").read_text()


def test_the_arm_of_the_book_by_default(folder, invoke):
    done = invoke("--samples", 2048, "--max-samples", 2048, "-o", "out")
    assert done.returncode == 0, done.stderr
    every, lengths, angles = result(folder)
    names = [item["name"] for item in every["inputs"]]
    total = np.array(every["total"])
    assert len(names) == 24 and total[names.index("theta2"), 2] == pytest.approx(0.834, abs=0.05)
    assert total[names.index("theta3"), 0] == pytest.approx(0.724, abs=0.05)
    alone = every["one_at_a_time"]
    b1 = names.index("b1")
    assert np.allclose(alone["plus"][b1], [0, 0, 1e-3, 0, 0, 0], atol=1e-12)  # one at a time: Z alone, 1 mm
    assert np.subtract(alone["highest"], alone["lowest"])[b1][2] == pytest.approx(6e-3)
    assert len(lengths["inputs"]) == len(angles["inputs"]) == 12
    by_name = dict(zip([item["name"] for item in lengths["inputs"]], np.array(lengths["total"])))
    assert by_name["b1"][2] == pytest.approx(0.294, abs=0.05)
    assert lengths["variance"][3:] == [0, 0, 0] and "RX does not vary" in " ".join(lengths["notes"])


def test_over_the_workspace_the_joints_take_all_and_the_lengths_share_the_rest(folder, invoke):
    done = invoke(
        "--workspace",
        "--group",
        "all",
        "--group",
        "lengths",
        "--group",
        "b3,b2",
        "--samples",
        4096,
        "--max-samples",
        4096,
        "-o",
        "out",
    )
    assert done.returncode == 0, done.stderr
    every, lengths, both = result(folder)
    total = dict(zip([item["name"] for item in every["inputs"]], np.array(every["total"])))
    assert total["b1"][2] < 1e-4 < 0.3 < total["theta2"][2]
    for output in (0, 1):
        # 1 mm beside metres: the share is small, its relative error that of a mean of squares.
        assert total["b2"][output] == pytest.approx(total["b3"][output], rel=0.2)
    names = [item["name"] for item in lengths["inputs"]]
    assert len(names) == 12  # joint values are averaged over
    share = dict(zip(names, np.array(lengths["total"])))
    assert share["b1"][2] == pytest.approx(0.249, abs=0.02)
    assert np.allclose(share["b2"], share["b3"], atol=0.02)
    assert [item["name"] for item in both["inputs"]] == ["b2", "b3"] and both["name"] == "b2-b3"
    assert np.allclose(np.array(both["total"])[:, :2], 0.5, atol=0.03)


def test_the_number_of_workers_changes_nothing(folder, run_kr5):
    for name, workers in (("one", 1), ("two", 2)):
        done = run_kr5(
            "sensitivity", "model.py:ishigami", "--inputs", "inputs.yaml", *FAST, "--workers", workers, "-o", name
        )
        assert done.returncode == 0, done.stderr
    assert result(folder, "one") == result(folder, "two")


def rows_there(file):
    return file.stat().st_size // (8 + 4 + 5 * 8) if file.is_file() else 0


def test_a_killed_analysis_goes_on_to_the_same_result(folder, run_kr5):
    run = ("sensitivity", "model.py:ishigami", "--inputs", "inputs.yaml", *FAST, "--workers", 1)
    assert run_kr5(*run, "-o", "whole").returncode == 0
    write_model(folder, pause=0.05)  # a row takes a quarter of a second
    command = [sys.executable, "-m", "kr5_tools", *map(str, run), "-o", "killed"]
    process = subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL)
    data, begin = folder / "killed/model/outputs.bin", time.monotonic()
    while rows_there(data) < 3:
        assert process.poll() is None and time.monotonic() - begin < SLOW
        time.sleep(0.05)
    os.kill(process.pid, signal.SIGKILL)
    process.communicate()
    kept = rows_there(data)
    with data.open("ab") as file:
        file.write(b"half a record")
    write_model(folder)  # another text is another model
    done = run_kr5(*run, "-o", "killed")
    assert done.returncode == 2 and "model_sha256" in done.stderr and "another folder (-o)" in done.stderr
    description = folder / "killed/model/analysis.json"
    whole = json.loads((folder / "whole/model/analysis.json").read_text())
    text = description.read_text()
    description.write_text(text.replace(json.loads(text)["model_sha256"], whole["model_sha256"]))
    done = run_kr5(*run, "-o", "killed")
    assert done.returncode == 0, done.stderr
    assert f"{kept} rows are there" in done.stdout and "truncated or damaged" in done.stderr
    assert result(folder, "killed") == result(folder, "whole")


def test_a_damaged_row_is_evaluated_again(folder, invoke):
    run = ("model.py:ishigami", "--inputs", "inputs.yaml", *FAST, "-o", "out")
    assert invoke(*run).returncode == 0
    before, file = result(folder), folder / "out/model/outputs.bin"
    data = bytearray(file.read_bytes())
    data[100] ^= 1
    file.write_bytes(data)
    done = invoke(*run)
    assert done.returncode == 0 and "1 row was truncated or damaged" in done.stderr
    assert result(folder) == before
    done = invoke(*run, "--seed", 2)
    assert done.returncode == 2 and "seed: found 1, now it is 2" in done.stderr
    done = invoke(*run[:-4], "--samples", 128, "--max-samples", 128, "-o", "out")
    assert done.returncode == 0 and "64 rows are there" in done.stdout
    assert result(folder)[0]["samples"] == 128


def test_a_vectorized_model_and_an_output_that_is_constant(folder, invoke):
    model = ("model.py:rows", "--inputs", "inputs.yaml", "--vectorized", *FAST)
    assert invoke(*model, "-o", "rows").returncode == 0
    (found,) = result(folder, "rows")
    assert np.allclose(np.array(found["total"])[:, 1], [0.8, 0.2, 0], atol=0.15)
    done = invoke("model.py:constant", "--inputs", "inputs.yaml", *FAST, "-o", "constant")
    assert done.returncode == 0 and "output 2 does not vary: its indices are 0" in done.stdout
    done = invoke("model.py:rows", "--inputs", "inputs.yaml", "-o", "other")
    assert done.returncode == 2 and "too many indices" in done.stderr and "x1 = " in done.stderr


@pytest.mark.parametrize(
    "function, words",
    [
        ("broken", "output 1 is nan at x1 = "),
        ("raising", "raised ZeroDivisionError: no lever at x1 = "),
        ("growing", "outputs, then"),
        ("word", "expected numbers"),
        ("absent", "has no function 'absent'"),
    ],
)
def test_a_model_that_is_none_is_told_with_its_inputs(folder, invoke, function, words):
    done = invoke(f"model.py:{function}", "--inputs", "inputs.yaml", *FAST, "-o", "out")
    assert done.returncode == 2 and words in " ".join(done.stderr.split()), done.stderr
    assert not (folder / "out/result.json").exists() and "Traceback" not in done.stderr


@pytest.mark.parametrize(
    "entry, words",
    [
        ("distribution: normal, mean: 1, sigma: 0.1, unit: furlong", "found 'furlong', expected one of rad"),
        ("distribution: cauchy, low: 0, high: 1", "expected normal, truncated_normal or uniform"),
        ("distribution: uniform, low: 2, high: 1", "expected low below high"),
        ("distribution: normal, mean: 1, sigma: 0", "more than 0"),
        ("distribution: normal, mean: .nan, sigma: 1", "a finite number"),
        ("distribution: normal, mean: 1", "found no sigma"),
        ("distribution: truncated_normal, mean: 1, sigma: 1", "found no truncation"),
        ("distribution: uniform, low: 0, high: 1, sigma: 1", "found a sigma"),
        ("distribution: uniform, low: 0, high: 1, width: 3", "unknown key 'width'"),
    ],
)
def test_inputs_that_are_none_are_told_with_their_line(folder, invoke, entry, words):
    (folder / "inputs.yaml").write_text(f"inputs:\n- {{name: x1, {entry}}}\n")
    done = invoke("model.py:ishigami", "--inputs", "inputs.yaml", "-o", "out")
    assert done.returncode == 2 and "inputs.yaml:2: inputs[0]" in done.stderr, done.stderr
    assert words in " ".join(done.stderr.split())


@pytest.mark.parametrize(
    "text, words",
    [
        ("", "expected a map"),
        ("inputs: []\n", "at least 1"),
        ("inputs: [{name: a", "not valid YAML"),
        (INPUTS + INPUTS.split("\n")[1] + "\n", "two named 'x1'"),
    ],
)
def test_a_file_of_inputs_that_is_empty_or_broken_is_refused(folder, invoke, text, words):
    (folder / "inputs.yaml").write_text(text)
    done = invoke("model.py:ishigami", "--inputs", "inputs.yaml", "-o", "out")
    assert done.returncode == 2 and words in " ".join(done.stderr.split()), done.stderr


@pytest.mark.parametrize(
    "args, words",
    [
        (["model.py:ishigami"], "--inputs: is missing"),
        (["model.py", "--inputs", "inputs.yaml"], "expected MODULE:FUNCTION or FILE.py:FUNCTION"),
        (["gone.py:f", "--inputs", "inputs.yaml"], "gone.py: No such file"),
        (["no_such_module:f", "--inputs", "inputs.yaml"], "cannot be imported"),
        (["model.py:ishigami", "--inputs", "gone.yaml"], "gone.yaml: No such file"),
        (["model.py:ishigami", "--inputs", "inputs.yaml", "--workspace"], "--workspace: apply to an arm"),
        (["--inputs", "inputs.yaml"], "apply only with a MODEL"),
        (["--samples", 100], "samples must be a power of two, found 100"),
        (["--samples", 8], "at least two for each of the 16 replicates"),
        (["--samples", 64, "--max-samples", 32], "max_samples must be 0 or at least samples"),
        (["--tolerance", "-1"], "tolerance must not be negative"),
        (["--pose", "0,70"], "--pose: found 2 numbers, expected 6"),
        (["--pose", "0,a,0,0,0,0"], "--pose: found '0,a,0,0,0,0'"),
        (["--group", "b7"], "--group: found 'b7'"),
        (["--sigma-length", 0], "--sigma-length: found 0, expected more than 0"),
        (["--cell", "bare.yaml", "--workspace"], "robot.limits: is missing"),
        (["--cell", "gone.yaml"], "gone.yaml"),
        (["-o", "inputs.yaml"], "inputs.yaml: is a file"),
        (["-o", "."], "is a folder with other files"),
    ],
)
def test_options_that_make_no_sense_are_refused(folder, share, invoke, args, words):
    (folder / "bare.yaml").write_text((share / "cells/kr5_arc_printed.yaml").read_text())
    done = invoke(*args, *([] if "-o" in args else ["-o", "out"]))
    assert done.returncode == 2 and words in " ".join(done.stderr.split()), done.stderr
    assert "Traceback" not in done.stderr


def test_negative_estimates_are_explained_by_name(folder, invoke):
    (folder / "model.py").write_text("import numpy as np\n\ndef f(x):\n    return {'lever': float(np.prod(x))}\n")
    (folder / "inputs.yaml").write_text(
        "inputs:\n" + "".join(f"- {{name: arm{k}, distribution: normal, mean: 0, sigma: 1}}\n" for k in range(5))
    )
    done = invoke("model.py:f", "--inputs", "inputs.yaml", *FAST, "-o", "out")
    assert done.returncode == 0, done.stderr
    text = " ".join(done.stdout.split())
    assert "negative, the least -" in text and ", lever): no index is below zero" in text
    assert json.loads((folder / "out/result.json").read_text())["verdict"]["word"] == "doubtful"  # 64 rows are few


def test_batches_cover_the_missing_rows_once_each():
    missing = [0, 1, 2, 5, 6, 20, *range(30, 100)]
    for workers in (1, 3):
        for seconds in (1e-6, 1e-2, 10.0):
            parts = split_rows(missing, 5, workers, seconds)
            assert [row for first, count in parts for row in range(first, first + count)] == missing
    assert all(count == 1 for _, count in split_rows(missing, 5, 1, 10.0))


def test_python_has_the_design_the_estimate_and_one_at_a_time():
    inputs = [uncertainty.UncertainInput(name=n, law="uniform", low=0, high=1) for n in "ab"]
    options = uncertainty.SobolOptions(samples=1024)
    design = uncertainty.sobol_design(inputs, 0, 1024, options)
    assert design.shape == (4096, 2) and np.array_equal(design[1], [design[3][0], design[0][1]])
    found = uncertainty.sobol_estimate(design @ [[1.0], [2.0]], inputs, options)
    assert np.allclose(found.total[:, 0], [0.2, 0.8], atol=0.05) and uncertainty.intervals_within(found, 0.2)
    alone = uncertainty.one_at_a_time(lambda x: x @ [[1.0], [2.0]], inputs)
    assert np.allclose(alone.highest[:, 0], [0.5, 1.0])
    chain = kinematics.DhChain([kinematics.DhJoint(a=1.0)])
    arm = kinematics.DeviatedArm(nominal=chain, parameters=kinematics.joint_parameters(chain), q=[0.0])
    assert [p.label for p in arm.parameters] == ["b1", "theta1", "a1", "alpha1"]
    assert np.allclose(arm.errors(np.array([[0.1, 0.0, 0.2, 0.0]])), [[0.2, 0, 0.1, 0, 0, 0]])
