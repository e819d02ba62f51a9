"""Rows of the bench of jobs: what counts, and what is judged."""

import sys

import pytest
from kr5 import job

from conftest import ROOT

work = pytest.importorskip("kr5.work", reason="this kr5 was built without DART, ViSP, PCL or SQLite")

sys.path[:0] = [str(ROOT / "tools/benchmarks")]
import job as bench


def test_a_fault_that_did_harm_is_not_reached(monkeypatch):
    good = {"trials": 5, "continued": 2, "stopped": 3, "resumed": 3, "max_force": 21.5}
    rows = [work.FaultRow(fault="lost", **good), work.FaultRow(fault="clock_jump", over_limit=1, **good)]
    monkeypatch.setattr(bench, "run_faults", lambda cell, setup, trials: rows if trials == 5 else [])
    lost, jump = bench.fault_rows(5, 1)
    assert lost.reached and "2 went on, 3 stopped" in lost.ours and "21.5 N" in lost.ours
    assert not jump.reached and jump.what.startswith("fault clock jump, 5 insertions") and "1 above" in jump.ours


def test_attempts_are_counted_by_clearance_and_tilt(monkeypatch):
    asked = []

    def run_jobs(setups, what):
        asked.extend(setups)
        pellets = [
            job.PelletFigures(number=1, state="inserted", insertions=1, time=10),
            job.PelletFigures(number=2, state="inserted", insertions=2, time=20),
            job.PelletFigures(number=3, state="waiting", insertions=1),
            job.PelletFigures(number=4, state="waiting", insertions=0),
        ]
        done = bench.Done(1, job.JobState(), job.JobStatistics(pellets=pellets), work.JobTruth(), set(), 80.0)
        return [done for _ in setups]

    monkeypatch.setattr(bench, "run_jobs", run_jobs)
    rows = list(bench.task_rows(4, 100))
    assert [setup.seed for setup in asked] == [100 + k for k in range(len(bench.TASKS))]
    assert [round(1e3 * setup.clearance, 6) for setup in asked] == [clearance for clearance, _ in bench.TASKS]
    assert len({setup.tilt for setup in asked}) == 3
    assert rows[0].what == "job of 4, 0.05 mm, tilt 15°: in at the first attempt to insert"
    assert rows[0].ours == "1 of 3, 2 in; 15.0 s each"
