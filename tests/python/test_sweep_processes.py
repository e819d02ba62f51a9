"""Processes that work for a sweep: what they give, and what happens when one of them ends."""

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import kr5
import pytest

from kr5_tools.sweep import processes, runner, workers
from kr5_tools.sweep.processes import Processes, WorkerDied

LARGE = "x" * 1_000_000  # more than a pipe takes at once


def square(number, *_):
    return number * number


def fail(text):
    raise kr5.InvalidArgument(text)


def end_process(*_):
    os._exit(1)


def end_once(flag, number, _):
    """Ends the first process that runs it with number 1."""
    if number == 1 and not Path(flag).exists():
        Path(flag).touch()
        os._exit(1)
    return kr5.__version__, [number]


def numbered(number):
    return kr5.__version__, [number]


@pytest.fixture
def two():
    pool = Processes(2)
    yield pool
    pool.end()


def test_results_and_errors_come_back(two):
    found = [two.submit(square, number, LARGE) for number in range(20)]
    assert [f.result() for f in found] == [number * number for number in range(20)]
    with pytest.raises(kr5.InvalidArgument, match="tilt: found 95") as raised:
        two.submit(fail, "tilt: found 95").result()
    assert "in fail" in raised.value.__notes__[0]  # where it happened


def test_the_end_of_a_process_costs_its_call_alone(two):
    calls = [two.submit(end_process if number == 3 else square, number, LARGE) for number in range(8)]
    with pytest.raises(WorkerDied):
        calls[3].result()
    assert [c.result() for k, c in enumerate(calls) if k != 3] == [k * k for k in range(8) if k != 3]


def test_calls_that_run_are_ended():
    pool = Processes(2)
    calls = [pool.submit(time.sleep, 600) for _ in range(4)]
    begin = time.monotonic()
    pool.end()
    assert time.monotonic() - begin < 60
    assert all(call.cancelled() or isinstance(call.exception(), WorkerDied) for call in calls)
    assert not multiprocessing.active_children()


@pytest.mark.parametrize("wait", [0.0, 0.05, 0.2, 0.4])
def test_an_end_meets_calls_whose_processes_die(wait):
    pool = Processes(2)
    calls = [pool.submit(end_process) for _ in range(8)]
    time.sleep(wait)
    pool.end()
    assert not multiprocessing.active_children()
    assert all(call.cancelled() or isinstance(call.exception(), WorkerDied) for call in calls)


def job(function, *first):
    return runner.Job(function, lambda count: [(*first, k, LARGE) for k in range(10)], 10, "trying", "trials")


def test_a_batch_whose_worker_ended_is_run_again(tmp_path):
    kept = []
    runner.run_job(job(end_once, str(tmp_path / "flag")), 2, None, kept.extend)
    assert (tmp_path / "flag").exists() and sorted(kept) == list(range(10))


def test_a_batch_that_ends_every_worker_is_blamed():
    with pytest.raises(kr5.InvalidArgument, match="3 workers ended during the same trials; is there enough memory"):
        runner.run_job(job(end_process), 2, None, list)
    assert not multiprocessing.active_children()


@pytest.mark.parametrize("wait", [0.0, 0.02, 0.1, 0.3])
def test_processes_that_are_killed_while_they_start_are_replaced(monkeypatch, wait):
    killed = []

    class Killed(processes.Process):
        def __init__(self):
            super().__init__()
            if len(killed) < 3:  # of which two begin with the pool
                killed.append(self._process.pid)
                threading.Timer(wait, os.kill, (self._process.pid, signal.SIGKILL)).start()

    monkeypatch.setattr(processes, "Process", Killed)
    kept = []
    runner.run_job(
        runner.Job(numbered, lambda count: [(k,) for k in range(10)], 10, "trying", "trials"), 2, None, kept.extend
    )
    assert sorted(kept) == list(range(10)) and len(killed) >= 2
    assert not multiprocessing.active_children()


def test_processes_that_cannot_be_started_are_told(monkeypatch):
    begun = []

    class Refused(processes.Process):
        def __init__(self):
            if begun:
                raise BlockingIOError(11, "Resource temporarily unavailable")
            super().__init__()
            begun.append(self)

    monkeypatch.setattr(processes, "Process", Refused)
    with (
        pytest.raises(kr5.InvalidArgument, match="--workers 3: so many processes cannot be started"),
        workers.local_workers(3),
    ):
        pass
    assert begun and not begun[0].is_alive()


PROGRAM = """
import time
from kr5_tools.sweep.processes import Processes
if __name__ == "__main__":
    pool = Processes(2)
    print(*[pool.submit(abs, -1).result() for _ in range(2)], *[p._process.pid for p in pool._all], flush=True)
    time.sleep(600)
"""


def is_running(pid):
    file = Path(f"/proc/{pid}/stat")
    return file.exists() and file.read_text().rsplit(")", 1)[1].split()[0] != "Z"


def test_processes_end_with_a_parent_that_is_killed(tmp_path):
    (tmp_path / "program.py").write_text(PROGRAM)
    with subprocess.Popen([sys.executable, tmp_path / "program.py"], stdout=subprocess.PIPE, text=True) as parent:
        pids = parent.stdout.readline().split()[2:]
        assert len(pids) == 2 and all(map(is_running, pids))
        parent.send_signal(signal.SIGKILL)
    begin = time.monotonic()
    while any(map(is_running, pids)):
        assert time.monotonic() - begin < 60
        time.sleep(0.05)
