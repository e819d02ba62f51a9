"""Commands in forked processes answer as those that begin with the interpreter."""

import os
import signal
import subprocess
import sys

import pytest

import command_runner

# A program that shows what it was given, and what of it may have been left by another.
PROBE = """
import os
import sys
import threading
import warnings

import kr5
import numpy as np

words = sys.argv[1:]
match words[0]:
    case "state":
        print(__name__, __spec__.name, os.path.basename(sys.argv[0]), words, os.getcwd(), os.environ["COLUMNS"])
        print(sys.path[0] == os.getcwd(), "left" in vars(kr5), threading.active_count(), sys.stdin.read() == "")
        print(sys.stdout.encoding, sys.stdout.errors, sys.stderr.errors, os.environ.get("LEFT"))
        print("error" in [action for action, *_ in warnings.filters])
        kr5.left = os.environ["LEFT"] = "by this process"
        warnings.simplefilter("error")
    case "order":
        print("held back")
        os.write(1, b"at once\\n")
        print("line of an error", file=sys.stderr)
        os.write(2, b"after it\\n")
        print("é\\r\\n" * 3, end="")
    case "much":
        print("x" * 3_000_000)
        print("y" * 3_000_000, file=sys.stderr)
    case "exit":
        print("said")
        sys.exit(int(words[1]))
    case "text":
        sys.exit("a last word")
    case "interrupted":
        raise KeyboardInterrupt
    case "killed":
        print("lost in the buffer")
        os.kill(os.getpid(), int(words[1]))
    case "threads":
        a = np.random.default_rng(1).normal(size=(300, 300))
        print(float(np.linalg.norm(a @ np.linalg.inv(a) - np.eye(300))) < 1e-8)
        threading.Timer(0.2, print, ["a thread is waited for"]).start()
    case "closed":
        os.close(1)
        print("goes nowhere")
    case "warning":
        warnings.warn("old", DeprecationWarning)
        warnings.warn("old", ResourceWarning)
    case "wait":
        print("begun", flush=True)
        threading.Event().wait(600)
"""


@pytest.fixture
def probe(tmp_path, monkeypatch):
    monkeypatch.delenv("KR5_TEST_FORKS", raising=False)
    (tmp_path / "probe.py").write_text(PROBE)

    def run(*words, **how):
        environment = {**os.environ, "COLUMNS": "77"}
        return command_runner.run_module("probe", *words, cwd=tmp_path, environment=environment, **how)

    return run


@pytest.fixture
def both(probe, monkeypatch):
    """What a process of its own and two forked ones answered, in which none may find traces of the first."""

    def run(*words, **how):
        with monkeypatch.context() as beginning:
            beginning.setenv("KR5_TEST_FORKS", "0")
            own = probe(*words, **how)
        with monkeypatch.context() as forking:
            forking.setattr(subprocess, "run", None)
            forked = [probe(*words, **how), probe(*words, **how)]
        return [(done.args, done.returncode, done.stdout, done.stderr) for done in (own, *forked)]

    return run


@pytest.mark.parametrize(
    "words",
    [
        ("state", "a b", "é"),
        ("order",),
        ("much",),
        ("exit", 0),
        ("exit", 7),
        ("text",),
        ("killed", int(signal.SIGKILL)),
        ("killed", int(signal.SIGTERM)),
        ("threads",),
    ],
    ids=lambda words: f"{words[0]} {words[-1]}",
)
def test_a_forked_process_answers_as_one_from_the_beginning(both, words):
    own, first, second = both(*words)
    assert first == own and second == own


@pytest.mark.parametrize("words", [("interrupted",), ("closed",)], ids=lambda words: words[0])
def test_a_forked_process_fails_as_one_from_the_beginning(both, words):
    own, first, second = both(*words)
    assert first[:3] == second[:3] == own[:3]
    assert first[3].splitlines()[-1] == own[3].splitlines()[-1]  # the call stack is another one


def test_the_option_of_warnings_is_that_of_python(both):
    def told(answer):
        return [line for line in answer[3].splitlines() if "Warning: old" in line]

    for option, count in (("default", 2), ("ignore", 0), (None, 1)):
        answers = both("warning", warnings=option)
        assert told(answers[0]) == told(answers[1]) == told(answers[2]) and len(told(answers[0])) == count


def test_a_process_that_takes_too_long_is_ended(probe):
    with pytest.raises(subprocess.TimeoutExpired) as raised:
        probe("wait", timeout=3)
    assert raised.value.stdout == "begun\n"
    assert probe("exit", 3).returncode == 3


def test_what_begins_in_another_way_is_a_process_of_its_own(tmp_path, monkeypatch):
    def request(*words, **environment):
        return command_runner.Request("kr5_tools", list(words), str(tmp_path), {**os.environ, **environment}, None)

    monkeypatch.delenv("KR5_TEST_FORKS", raising=False)
    assert not command_runner.needs_own_process(request("report", COLUMNS="200"))
    assert command_runner.needs_own_process(request("report", PYTHONPATH="elsewhere"))
    assert command_runner.needs_own_process(request("rsi", "doctor"))
    monkeypatch.setenv("KR5_TEST_FORKS", "0")
    assert command_runner.needs_own_process(request("report"))


def test_nothing_of_the_command_is_there_before_it_runs(probe, tmp_path):
    """Its modules keep state, and read the environment when they are loaded."""
    (tmp_path / "probe.py").write_text("import sys; print([m for m in sys.modules if m.startswith('kr5_tools')])")
    assert probe("").stdout == "[]\n"
    assert sys.executable in probe("").args
