"""Rows of the bench of jobs: what counts, and what is judged."""

import sys

import pytest
from kr5 import job

from conftest import ROOT

work = pytest.importorskip("kr5.work", reason="this kr5 was built without DART, ViSP, PCL or SQLite")

sys.path[:0] = [str(ROOT / "tools/benchmarks")]
import job as bench


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
