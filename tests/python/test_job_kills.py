"""Jobs whose programs are killed at random instants: nothing is done twice, and no pellet is lost from the log."""

import gc
import random
import subprocess
import sys
import time

import pytest
from kr5 import job
from kr5.cell import load_cell

from conftest import ROOT

work = pytest.importorskip("kr5.work", reason="this kr5 was built without DART, ViSP, PCL or SQLite")

sys.path[:0] = [str(ROOT / "tools/benchmarks")]
import job_kills
from kr5_tools.work import job_cell


@pytest.fixture(scope="module")
def given(share):
    return load_cell(share / "cells/kr5_arc.yaml")


def test_jobs_killed_at_random_instants_do_nothing_twice_and_lose_nothing(given, tmp_path):
    trial = job_kills.kill_often(given, job_cell.JobSetup(1, 7, "nominal"), tmp_path, kills=8, seed=3)
    assert trial.kills == 8 and trial.problems == []
    assert trial.largest_first_step < 1e-9


def test_a_stop_is_still_latched_after_a_kill(given, tmp_path):
    setup, file = job_cell.JobSetup(1, 7, "nominal"), tmp_path / "job.db"
    cell = job_cell.make_cell(given, setup)
    options = job_cell.work_options(cell, setup)
    work.place_over_bin(cell, options)
    journal = job.Journal(file, "kills")
    runner = work.JobRunner(cell, options, journal, cell_file=str(job_cell.state_file(file)))
    runner.step(30)
    journal.append([job.JobRecord(number=journal.last_number + 1, kind="stop", stop="force")])
    del runner, journal
    job_cell.restore_cell(cell, file)
    trial = job_kills.KillTrial()
    assert job_kills.run_program(cell, setup, file, 10, trial) == job.RestartStatus.Latched
    assert trial.problems == []


def test_what_a_killed_process_leaves_lets_the_job_go_on(given, tmp_path):
    setup, file, trial = job_cell.JobSetup(1, 7, "usual"), tmp_path / "job.db", job_kills.KillTrial()
    words = [sys.executable, "-m", "kr5_tools", "run", "--pellets", "1", "--seed", "7", "--journal", str(file)]
    with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as program:
        end = time.monotonic() + 60
        while not job_cell.state_file(file).is_file() and program.poll() is None and time.monotonic() < end:
            time.sleep(0.01)
        time.sleep(random.Random(5).uniform(0, 1))
        program.kill()
    cell = job_cell.make_cell(given, setup)
    job_cell.restore_cell(cell, file)
    assert job_kills.run_program(cell, setup, file, job_kills.PROGRAM, trial) is None
    gc.collect()
    job_kills.judge(cell, file, 1, trial)
    assert trial.problems == []
