"""`kr5 sweep insertion`: the same result whatever runs it and however often it is killed. Whether pegs go in is the
library's."""

import csv
import fcntl
import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import kr5
import numpy as np
import pytest
from scipy import stats
from typer.testing import CliRunner

pytest.importorskip("kr5.sim", reason="this kr5 was built without DART")

from kr5_tools.app import make_app
from kr5_tools.cli.value_list import parse_values
from kr5_tools.sweep import rate_table, runner, workers
from kr5_tools.sweep.trials import HEADER, Grid, Key, Trial, seed_of

GRID = ("--tilts", 15, "--clearances", 0.5, "--seed", 5)
COUNT = 12
SLOW = 120  # [s], after which a sweep hangs


@pytest.fixture
def dask():
    pytest.importorskip("distributed", reason="pip install 'kr5[cluster]'")


def sweep(folder, *args, trials=COUNT, workers=1):
    command = [
        sys.executable,
        "-m",
        "kr5_tools",
        "sweep",
        "insertion",
        *GRID,
        "--trials",
        trials,
        *(["--workers", workers] if workers else []),
        "-o",
        "sweep",
        *args,
    ]
    return [str(word) for word in command], {
        "cwd": folder,
        "text": True,
        "stdout": subprocess.PIPE,
        "stderr": subprocess.PIPE,
    }


def run_sweep(folder, *args, **more):
    command, how = sweep(folder, *args, **more)
    return subprocess.run(command, timeout=SLOW, check=False, **how)


def invoke(folder, *args, trials=COUNT):
    """A sweep in this process, which spares its start; for what Dask has no part in."""
    words = [*GRID, "--trials", trials, "--workers", 1, "-o", folder, *args]
    return CliRunner().invoke(make_app(("sweep", "insertion")), ["sweep", "insertion", *map(str, words)])


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """A sweep that nothing happened to: its folder and its JSON."""
    folder = tmp_path_factory.mktemp("undisturbed")
    done = run_sweep(folder, "--json", "out.json")
    assert done.returncode == 0, done.stderr
    return folder / "sweep", json.loads((folder / "out.json").read_text())


def lines(folder):
    """The finished lines of the file: a last one without an end is not finished."""
    file = folder / "trials.csv"
    return file.read_bytes().split(b"\n")[:-1] if file.is_file() else []


def wait_for_trials(process, folder, count):
    begin = time.monotonic()
    while len(lines(folder)) < 1 + count:
        assert process.poll() is None and time.monotonic() - begin < SLOW, process.communicate()[1]
        time.sleep(0.02)


def is_as_undisturbed(folder, out, undisturbed):
    """The same trials, each of them once, and the same tables."""
    assert Counter(lines(folder)) == Counter(lines(undisturbed[0]))
    assert out == undisturbed[1]


def test_the_tables_are_those_of_the_file(undisturbed):
    folder, out = undisturbed
    rows = list(csv.DictReader((folder / "trials.csv").open()))
    assert len(rows) == len(out["trials"]) == COUNT and {r["tilt_deg"] for r in rows} == {"15.0"}
    (table,), (place,) = out["tables"], out["tables"][0]["rows"]
    for k, by in enumerate(place["by_attempt"], 1):
        assert by["count"] == sum(r["inserted"] == "1" and int(r["attempts"]) <= k for r in rows)
    times = [float(r["time"]) for r in rows if r["inserted"] == "1"]
    assert place["time"]["median"] == (pytest.approx(np.median(times)) if times else None)
    assert sum(table["pooled"]["failures"].values()) == COUNT - len(times)
    assert all(np.hypot(float(r["offset_x"]), float(r["offset_y"])) <= 0.00942 for r in rows)
    assert len({r["seed"] for r in rows}) == COUNT


def test_a_trial_is_run_again_by_its_seed(undisturbed, run_kr5):
    trial = undisturbed[1]["trials"][3]
    done = run_kr5(
        "insert", "--clearance", trial["clearance"], "--tilt", trial["tilt"], "--seed", trial["seed"], "--json", "-"
    )
    out = json.loads(done.stdout)
    assert out["setup"]["offset"] == [trial["offset_x"], trial["offset_y"]]
    assert [out["pegs"][0][name] for name in ("time", "depth", "attempts")] == [
        trial[name] for name in ("time", "depth", "attempts")
    ]


@pytest.mark.parametrize("workers", [2, None])
def test_processes_of_this_machine_give_the_same_without_dask(undisturbed, tmp_path, monkeypatch, workers):
    for name in ("dask", "distributed"):
        (tmp_path / f"{name}.py").write_text("raise ImportError('is not to be loaded')")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]))
    done = run_sweep(tmp_path, "--json", "out.json", workers=workers)
    assert done.returncode == 0, done.stderr
    is_as_undisturbed(tmp_path / "sweep", json.loads((tmp_path / "out.json").read_text()), undisturbed)


def test_workers_of_a_scheduler_give_the_same(undisturbed, dask, tmp_path):
    from dask.distributed import LocalCluster

    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        done = run_sweep(tmp_path, "--scheduler", cluster.scheduler_address, "--json", "out.json")
    assert done.returncode == 0, done.stderr
    is_as_undisturbed(tmp_path / "sweep", json.loads((tmp_path / "out.json").read_text()), undisturbed)


@pytest.mark.parametrize("workers", [1, 2])
def test_a_killed_sweep_goes_on_and_runs_nothing_twice(undisturbed, tmp_path, workers):
    command, how = sweep(tmp_path, workers=workers)
    with subprocess.Popen(command, **how) as process:
        wait_for_trials(process, tmp_path / "sweep", 3)
        process.send_signal(signal.SIGKILL)
    before = lines(tmp_path / "sweep")
    assert len(before) >= 4
    done = run_sweep(tmp_path, "--json", "out.json", workers=workers)
    assert done.returncode == 0, done.stderr
    assert lines(tmp_path / "sweep")[: len(before)] == before
    is_as_undisturbed(tmp_path / "sweep", json.loads((tmp_path / "out.json").read_text()), undisturbed)


def workers_of(pid):
    """Processes of workers, by the process that started them."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            parent = int((folder / "stat").read_text().rsplit(")", 1)[1].split()[1])
            if parent == pid and b"spawn_main" in (folder / "cmdline").read_bytes():
                found.append(int(folder.name))
        except OSError:
            continue  # it ended meanwhile
    return found


def test_a_killed_worker_is_replaced(undisturbed, tmp_path):
    command, how = sweep(tmp_path, "--json", "out.json", workers=2)
    with subprocess.Popen(command, **how) as process:
        wait_for_trials(process, tmp_path / "sweep", 1)
        victims = workers_of(process.pid)
        assert len(victims) == 2
        os.kill(victims[0], signal.SIGKILL)
        stderr = process.communicate(timeout=SLOW)[1]
    assert process.returncode == 0, stderr
    is_as_undisturbed(tmp_path / "sweep", json.loads((tmp_path / "out.json").read_text()), undisturbed)


@pytest.fixture
def copy(undisturbed, tmp_path):
    shutil.copytree(undisturbed[0], tmp_path / "sweep")
    return tmp_path


def test_a_line_cut_short_is_run_again(undisturbed, copy):
    file = copy / "sweep/trials.csv"
    file.write_bytes(file.read_bytes()[:-40])
    done = invoke(copy / "sweep", "--json", copy / "out.json")
    assert (
        done.exit_code == 0 and "truncated" in done.stderr and f"{COUNT - 1} trials are there, 1 to run" in done.stdout
    )
    is_as_undisturbed(copy / "sweep", json.loads((copy / "out.json").read_text()), undisturbed)


def test_more_trials_are_added_to_those_that_are_there(undisturbed, copy):
    before = lines(copy / "sweep")
    done = invoke(copy / "sweep", trials=COUNT + 1)
    assert done.exit_code == 0 and f"{COUNT} trials are there, 1 to run" in done.stdout
    assert lines(copy / "sweep")[:-1] == before


@pytest.mark.parametrize(
    "args, field",
    [
        (["--seed", 6], "seed: found 5, now it is 6"),
        (["--clearances", "0.5,1"], "clearances: found [0.5], now it is [0.5, 1.0]"),
        (["--strategy", "hayat2022"], "strategies"),
        (["--orientation", "both"], "orientations"),
        (["--cell", "OTHER"], "cell_sha256"),
    ],
)
def test_another_sweep_does_not_go_on_in_the_same_folder(copy, share, args, field):
    text = (share / "cells/kr5_arc.yaml").read_text()
    (copy / "other.yaml").write_text(text.replace("friction: 0.18", "friction: 0.19"))
    done = invoke(copy / "sweep", *(copy / "other.yaml" if word == "OTHER" else word for word in args))
    assert done.exit_code == 2 and field in done.stderr and "another folder (-o)" in done.stderr


def test_trials_of_another_library_are_not_mixed_without_a_word(copy):
    assert "gives different numbers now" not in invoke(copy / "sweep").stderr
    file = copy / "sweep/trials.csv"
    rows = list(csv.reader(file.open()))
    first = min(rows[1:], key=lambda row: int(row[4]))
    first[-1] = repr(float(first[-1]) + 1e-9)
    file.write_text("".join(",".join(row) + "\n" for row in rows))
    done = invoke(copy / "sweep")
    assert done.exit_code == 0 and "gives different numbers now" in done.stderr


def test_two_sweeps_do_not_write_in_one_folder(copy):
    with open(copy / "sweep/trials.csv", "ab") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        done = invoke(copy / "sweep")
    assert done.exit_code == 2 and "another sweep is using this folder" in done.stderr


def test_a_folder_of_other_things_and_a_spoiled_line_are_refused(copy):
    file = copy / "sweep/trials.csv"
    file.write_bytes(file.read_bytes().replace(b",15.0,", b",tilted,", 1))
    done = invoke(copy / "sweep")
    assert done.exit_code == 2 and "trials.csv:2: is not a trial" in done.stderr
    (copy / "sweep/sweep.json").unlink()
    done = invoke(copy / "sweep")
    assert done.exit_code == 2 and "with other files and without sweep.json" in done.stderr


@pytest.mark.parametrize(
    "text, words",
    [
        ("5:25", "as 5:25:5"),
        ("5:25:0", "STEP above 0"),
        ("25:5:5", "FROM up to TO"),
        ("five", "as 5,15,25"),
        ("", "as 5,15,25"),
        ("5,-1", "above 0"),
        ("5,nan", "above 0"),
        ("1:89:0.001", "more than 1000"),
        ("5:inf:1", "FROM up to TO"),
    ],
)
def test_axes_that_are_none_are_refused(text, words):
    with pytest.raises(kr5.InvalidArgument, match="--tilts: found") as caught:
        parse_values("--tilts", text)
    assert words in str(caught.value)


def test_axes():
    assert parse_values("--tilts", "5:25:5") == (5, 10, 15, 20, 25)
    assert parse_values("--tilts", "0.1:0.3:0.1") == (0.1, 0.2, 0.3)
    assert parse_values("--tilts", "25,5,5") == (5, 25)


def test_a_tilt_that_no_peg_can_have_is_refused_before_anything_runs(tmp_path):
    done = invoke(tmp_path / "sweep", "--tilts", "15,95")
    assert done.exit_code == 2 and "tilt: found 95" in done.stderr and not (tmp_path / "sweep").exists()


def test_a_scheduler_without_dask_is_refused_with_the_remedy(tmp_path, monkeypatch):
    monkeypatch.setattr(workers.importlib.util, "find_spec", lambda name: None)
    done = invoke(tmp_path / "sweep", "--scheduler", "tcp://127.0.0.1:8786")
    assert done.exit_code == 2 and "pip install 'kr5[cluster]'" in done.stderr


def test_a_scheduler_that_is_not_there_is_refused(dask, tmp_path):
    done = invoke(tmp_path / "sweep", "--scheduler", "nonsense://nowhere:1")
    assert done.exit_code == 2 and "--scheduler nonsense://nowhere:1: there is no scheduler" in done.stderr


def test_a_scheduler_without_workers_is_refused_after_a_while(dask, tmp_path, monkeypatch):
    from dask.distributed import LocalCluster

    for module in (runner, workers):
        monkeypatch.setattr(module, "PATIENCE", 0.5)
    with LocalCluster(n_workers=0, dashboard_address=None, processes=False) as cluster:
        address = cluster.scheduler_address
        done = invoke(tmp_path / "sweep", "--scheduler", address)
    assert done.exit_code == 2 and f"start one with: dask worker {address}" in " ".join(done.stderr.split())
    assert lines(tmp_path / "sweep") == [",".join(HEADER).encode()]


def test_the_example_of_the_help_runs_and_its_page_is_whole(run_kr5, browser, tmp_path):
    command = " ".join(run_kr5("sweep", "insertion", "--help").stdout.split("Example: kr5 ")[1].split())
    done = run_kr5(*shlex.split(command), "--png", "plots")
    assert done.returncode == 0 and "Tube standing, strategy profile_fit" in done.stdout, done.stderr
    assert {f.name for f in (tmp_path / "plots").iterdir()} == {"over_clearance.png", "over_tilt.png"}
    for width in (1280, 390):
        browser.open_whole(tmp_path / "sweep/report.html", width)
    assert browser.evaluate("document.querySelectorAll('svg.plot').length") == 2


def test_the_seed_of_a_trial_stays_what_it_is():
    key = Key("vertical", "profile_fit", 15.0, 0.05, 3)
    assert seed_of(key, 1) == 4378381778781342310
    assert (
        len(
            {
                seed_of(k, s)
                for s in (1, 2)
                for k in Grid(
                    (5.0, 15.0), (0.05, 1.0), ("vertical", "horizontal"), ("profile_fit", "hayat2022"), "arm", s
                ).keys(5)
            }
        )
        == 160
    )


def trial(number, inserted=True, attempts=1, t=10.0, clearance=1.0):
    return Trial(
        "vertical",
        "profile_fit",
        15.0,
        clearance,
        number,
        1,
        0.0,
        0.0,
        int(inserted),
        attempts,
        "push",
        "inserted" if inserted else "blocked",
        t,
        0.03,
        1e-4,
        20.0,
    )


def test_intervals_are_exact_and_what_falls_short_is_named():
    grid = Grid((15.0,), (0.5, 1.0), ("vertical",), ("profile_fit",), "arm", 1)
    good = [trial(k, t=10.0 + k) for k in range(20)]
    bad = [trial(k, inserted=k >= 8, attempts=1 + k % 2, clearance=0.5) for k in range(20)]
    (table,) = rate_table.rate_tables(good + bad, grid)
    first, second = (by for by in table["rows"][0]["by_attempt"][:2])
    assert (first["count"], second["count"]) == (6, 12)
    assert first["low"] == pytest.approx(stats.beta.ppf(0.025, 6, 15)) and first["high"] == pytest.approx(
        stats.beta.ppf(0.975, 7, 14)
    )
    assert table["pooled"]["by_attempt"][0]["min_rate"] == pytest.approx(stats.beta.ppf(0.05, 26, 15))
    assert [row["below"] for row in table["rows"]] == [True, False]
    assert (
        table["rows"][0]["p_below"] == pytest.approx(2 * stats.binom.cdf(6, 20, 0.95))
        and table["rows"][1]["p_below"] == 1
    )
    time = table["rows"][1]["time"]
    assert time["median"] == 19.5 and (time["low"], time["high"]) == (15, 24)  # the 6th from below and from above
    assert any("0.5 mm" in text and "Holm" in text for text in rate_table.table_texts(table))
    assert table["pooled"]["failures"] == {"push: blocked": 8}


def test_few_trials_of_a_place_are_no_reassurance():
    grid = Grid((15.0,), (0.5, 1.0), ("vertical",), ("profile_fit",), "arm", 1)

    def texts(few, many):
        trials = [trial(k, clearance=0.5) for k in range(few)] + [trial(k) for k in range(many)]
        (table,) = rate_table.rate_tables(trials, grid)
        return " ".join(rate_table.table_texts(table))

    bound = 100 * 0.05 ** (1 / 6)  # of six successes
    assert (
        f"6 trials of a place cannot show that the rate is 95 % or more: if all succeed, it is at least {bound:.0f} %"
        in (texts(6, 80))
    )
    assert "cannot show" in texts(58, 80) and "cannot show" not in texts(59, 80)
    assert "significantly less often" in texts(59, 80)


def test_a_cell_in_which_no_insertion_fits_is_refused_before_anything_is_written(share, run_kr5, tmp_path):
    text = (share / "cells/kr5_arc.yaml").read_text()
    tool = "tool: {natural_frequency: 3.064, damping_ratio: 0.7492, delay: 0.024}"
    assert tool in text
    (tmp_path / "cell.yaml").write_text(text.replace(tool, tool + "\n  correction: {mode: absolute, total: 0.03}"))
    done = run_kr5("sweep", "insertion", *GRID, "--cell", "cell.yaml", "--trials", 1, "--workers", 1, "-o", "folder")
    assert done.returncode == 2 and "servo.correction.total" in done.stderr and "raise the limit" in done.stderr
    assert not (tmp_path / "folder").exists()
