"""Ctrl-C ends a command also while the library computes, which does not hear it."""

import io
import signal
import subprocess
import sys

import kr5.cell
import kr5.gap
import kr5.io
import kr5.predict
import numpy as np
import pytest

from terminal_session import TerminalSession

# Calls that would take hours: one holds Python's own loop, the other is in C, with the interpreter let go as kr5
# does it.
LOOP = "while True: sum(range(1000))"
LIBRARY = "hashlib.pbkdf2_hmac('sha256', b'a', b'b', 2_000_000_000)"
# Python's own loop has as long as it takes to hear; on a busy computer that may be longer than usual.
PROGRAM = """
import hashlib
import sys
import threading
from kr5_tools.cli import interruption
from kr5_tools.cli.interruption import prompt_interruption
interruption.GRACE = {}
try:
    with prompt_interruption(lambda: print("gave up", flush=True)):
        threading.Timer(1.0, print, ["begun"], {{"flush": True}}).start()  # the call has begun by then
        {}
except KeyboardInterrupt:
    print("heard", flush=True)
    sys.exit(130)
"""


@pytest.mark.parametrize("call, grace, said", [(LOOP, 600.0, "heard"), (LIBRARY, 0.5, "gave up")])
def test_a_long_call_is_ended(call, grace, said):
    process = subprocess.Popen([sys.executable, "-c", PROGRAM.format(grace, call)], stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout.readline() == "begun\n"
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=120)  # the calls themselves take far longer
    finally:
        process.kill()
    assert out == f"{said}\n" and process.returncode == 130


def interrupted(source):
    """What a program says after Ctrl-C, which it gets once it has said that it has begun, and its exit code."""
    process = subprocess.Popen([sys.executable, "-c", source], stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout.readline() == "begun\n"
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=120)
    finally:
        process.kill()
    return out, process.returncode


CONCLUDING = """
import time
from kr5_tools.cli.interruption import GRACE, prompt_interruption, take_as_end
with prompt_interruption(lambda: print("gave up", flush=True)):
    try:
        print("begun", flush=True)
        time.sleep(600)
    except KeyboardInterrupt:
        take_as_end()
    time.sleep(3 * GRACE)  # as on a busy computer
    print("concluded", flush=True)
"""


def test_what_waits_for_ctrl_c_as_its_end_concludes_in_its_own_time():
    out, code = interrupted(CONCLUDING)
    assert (out, code) == ("concluded\n", 0)


def test_an_interrupted_recording_leaves_no_folder(tmp_path, share, monkeypatch):
    from typer.testing import CliRunner

    from kr5_tools.app import make_app
    from kr5_tools.simulation import record

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(record, "take_pictures", interrupted)
    (tmp_path / "protocol.yaml").write_text(
        "format: kr5-protocol/1\nhome: [0.0, 0.02, -2.75, 0.0, -0.3, 1.571]\n"
        "experiments:\n- {name: views-1, kind: views, split: fit, count: 2}\n"
    )
    cell = share / "cells" / "kr5_arc.yaml"
    words = ["record", "--cell", cell, "--protocol", tmp_path / "protocol.yaml", "-o", tmp_path / "new", "--images"]
    done = CliRunner().invoke(make_app(("record",)), [str(w) for w in words])
    assert done.exit_code == 130 and done.stderr == "stopped; nothing was written\n"
    assert [f.name for f in tmp_path.iterdir()] == ["protocol.yaml"]


def test_the_bar_of_an_interrupted_loop_is_gone_before_the_last_word(monkeypatch):
    from rich.console import Console

    from kr5_tools import app
    from kr5_tools.cli import terminal

    screen = io.StringIO()
    monkeypatch.setattr(terminal, "errors", Console(file=screen, force_terminal=True, width=80))
    monkeypatch.setattr(app, "_said_stopped", False)
    counted = terminal.track(range(3), "Counting")
    next(counted)
    app._say_stopped()
    assert "Counting" in screen.getvalue() and screen.getvalue().endswith("stopped; nothing was written\n")
    counted.close()
    assert screen.getvalue().endswith("stopped; nothing was written\n")


SHIELDED = """
import os
import signal
import sys
from pathlib import Path
from kr5_tools import app
from kr5_tools.cli.interruption import prompt_interruption
from kr5.files import writing
try:
    with prompt_interruption(lambda: print("gave up", flush=True)), app._held_back():  # as around every command
        for name in ("a", "b", "c"):
            writing.write_text(name, Path(name))
        put, calls = writing._put, []
        def interrupted(new, target):
            calls.append(target)
            os.kill(os.getpid(), signal.SIGINT)
            os.kill(os.getpid(), signal.SIGINT)  # of a person who is in a hurry
            sum(range(1000))
            put(new, target)
        writing._put = interrupted
except KeyboardInterrupt:
    print(len(calls), [str(f) for f in writing.written_files()])
    sys.exit(130)
"""


def test_files_appear_together_also_when_ctrl_c_comes_meanwhile(tmp_path):
    done = subprocess.run([sys.executable, "-c", SHIELDED], capture_output=True, text=True, cwd=tmp_path, timeout=120)
    assert done.returncode == 130 and done.stdout == "3 ['a', 'b', 'c']\n", done.stderr
    assert sorted(f.name for f in tmp_path.iterdir()) == ["a", "b", "c"]


SLOW_TO_END = """
import sys
import threading
import time
from kr5_tools.cli.interruption import prompt_interruption
try:
    with prompt_interruption(lambda: print("gave up", flush=True)):
        try:
            threading.Timer(1.0, print, ["begun"], {"flush": True}).start()
            while True: sum(range(1000))
        finally:
            time.sleep(600)  # as threads of the library that have not ended yet
except KeyboardInterrupt:
    print("heard", flush=True)
"""


def test_what_hears_ctrl_c_but_does_not_end_is_ended():
    out, code = interrupted(SLOW_TO_END)
    assert out == "gave up\n" and code == 130


@pytest.fixture
def session(tmp_path):
    """Starts commands on pseudo-terminals, and ends them."""
    begun = []

    def start(*args):
        begun.append(TerminalSession(*args, cwd=tmp_path))
        return begun[-1]

    yield start
    for one in begun:
        one.close()


@pytest.mark.parametrize(
    "words, begun",
    [
        (["gap", "diagnose", "{recording}", "-o", "gap.json", "--report", "gap.html"], "left"),
        (["calibrate", "camera", "{images}", "--target", "grid:36h11:5x7:0.03:0.01", "-o", "c.json"], "Fitting"),
        (["workspace", "{cell}", "--samples", "40000000", "-o", "w.json"], "Mapping"),
        (["record", "--cell", "{cell}", "--protocol", "{protocol}", "-o", "new", "--images"], "Rendering"),
        (["gap", "effects", "--pictures", "pictures"], "drawing the effects"),
        (["identify", "excitation", "{cell}", "--exchanges", "100000", "-o", "e.json"], "Designing"),
        (["calibrate", "laser-study", "--passes", "200", "-o", "s.json"], "by stand-off"),
    ],
    ids=lambda value: " ".join(value[:2]) if isinstance(value, list) else "",
)
def test_a_stopped_command_says_so_and_leaves_nothing(session, tmp_path, share, worn_recording, words, begun):
    places = {
        "recording": worn_recording,
        "images": share / "data/demo/images",
        "cell": share / "cells/kr5_arc.yaml",
        "protocol": share / "protocols/standard.yaml",
    }
    one = session(*(word.format(**places) for word in words))
    assert one.read_until(begun), one.text
    one.interrupt()
    assert one.wait() == 130, one.text
    assert one.text.rstrip().endswith("stopped; nothing was written"), one.text
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("workers", ["1", "2"])
def test_a_stopped_sweep_tells_how_many_trials_it_keeps(session, tmp_path, workers):
    grid = ["--tilts", "15", "--clearances", "0.5,1", "--trials", "50", "--workers", workers, "-o", "sweep"]
    one = session("sweep", "insertion", *grid)
    file = tmp_path / "sweep/trials.csv"
    while not file.exists() or len(file.read_text().splitlines()) < 3:
        one.read_until("stopped", 0.5)
        assert one.process.poll() is None, one.text
    one.interrupt()
    assert one.wait() == 130
    kept = len(file.read_text().splitlines()) - 1
    said = " ".join(one.text.split())
    assert said.endswith(f"stopped; {kept} trials are kept in sweep; the same command continues"), said
    assert "Traceback" not in said


def test_a_stopped_demo_stops_its_commands(session, tmp_path, share):
    one = session("demo", share / "data/demo", "-o", "out")
    assert one.read_until("kr5 calibrate hand-eye")
    one.interrupt()
    assert one.wait() == 130
    assert "stopped; the finished files are kept in out" in " ".join(one.text.split())
    assert not list(tmp_path.rglob(".kr5-*"))


class Stop(Exception):
    """What the handler of a signal raises."""


class Interrupting:
    """A simulator in which a signal comes with the third prediction; it counts those that begin afterwards."""

    def __init__(self):
        self.calls = 0
        self.simulator = kr5.predict.FastSimulator()

    def predict(self, cell, experiment):
        self.calls += 1
        if self.calls == 3:
            signal.raise_signal(signal.SIGUSR1)
        return self.simulator.predict(cell, experiment)


@pytest.fixture
def recording(share):
    cell = kr5.cell.load_cell(share / "cells" / "kr5_arc.yaml")
    t = 0.012 * np.arange(200)
    q = np.array([0.0, 0.02, -2.75, 0.0, -0.3, 1.571]) + 0.3 * (1 - np.cos(t[:, None] * np.arange(1, 7)))
    experiments = []
    for k in range(20):
        e = kr5.cell.Experiment(
            name=f"motion-{k}", kind="motion", file=f"motion-{k}.csv", split=("fit", "check")[k % 2]
        )
        e.data = kr5.io.Table(["t", *(f"qc{j + 1}" for j in range(6))], np.column_stack([t, q]))
        shown = kr5.predict.FastSimulator().predict(cell, e)
        e.data = kr5.io.Table(
            [*e.data.columns, *shown.columns], np.column_stack([t, q, *(shown[c] for c in shown.columns)])
        )
        experiments.append(e)
    return kr5.cell.Recording(cell, experiments)


@pytest.mark.parametrize("compute", [kr5.gap.measure, kr5.gap.diagnose], ids=["measure", "diagnose"])
def test_a_signal_ends_a_long_computation_of_the_library(recording, compute):
    def stop(*_):
        raise Stop

    simulator = Interrupting()
    before = signal.signal(signal.SIGUSR1, stop)
    try:
        with pytest.raises(Stop) as raised:
            compute(recording, simulator)
    finally:
        signal.signal(signal.SIGUSR1, before)
    # Raised by the call itself, and not in a prediction that happened to run in the main thread.
    assert not getattr(raised.value, "__notes__", [])


WHILE_THE_LIBRARY_LOADS = """
from kr5_tools import app


def interrupted(words):
    try:
        raise KeyboardInterrupt
    except KeyboardInterrupt as heard:
        raise ImportError("initialization failed") from heard


app._load_app = interrupted
app.main()
"""


WHILE_LOADING = """
import os
import signal
import sys


class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == "kr5_tools.app":
            os.kill(os.getpid(), signal.SIGINT)
            sum(range(1000))


sys.meta_path.insert(0, Finder())
from kr5_tools.start import main
main()
"""


@pytest.mark.parametrize("program", [WHILE_LOADING, WHILE_THE_LIBRARY_LOADS])
def test_ctrl_c_while_the_command_is_loaded_leaves_no_traceback(program):
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stderr) == (130, "stopped; nothing was written\n")
