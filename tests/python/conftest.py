"""Shared by the tests of the Python surface and of the command."""

import json
import os
import re
import signal
import subprocess
from pathlib import Path

import pytest

from command_runner import run_command
from headless import CHROMIUM, Browser

ROOT = Path(__file__).resolve().parents[2]
SECONDS_PER_TEST = 600


@pytest.fixture(scope="session")
def share() -> Path:
    """The data that ship with the project."""
    return ROOT / "share"


@pytest.fixture(scope="session")
def reference() -> Path:
    """Public data kept beside the checkout; absent data skip a test, except in CI."""
    folder = Path(os.environ.get("KR5_REFERENCE_DIR", ROOT.parent / "shared"))
    if not folder.is_dir():
        text = f"reference data are absent: no folder {folder} (name another one in KR5_REFERENCE_DIR)"
        if os.environ.get("CI"):
            pytest.fail(text)
        pytest.skip(text)
    return folder


@pytest.fixture(autouse=True)
def time_limit():
    """Ends a test that hangs, with the place where it hung."""

    def stop(*_) -> None:
        raise TimeoutError(f"the test took longer than {SECONDS_PER_TEST} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(SECONDS_PER_TEST)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.fixture(autouse=True, scope="module")
def environment():
    """What a module sets in the environment, as libraries do that begin workers, does not reach the next one."""
    before = dict(os.environ)
    yield
    for name in {*before, *os.environ} - {"PYTEST_CURRENT_TEST"}:
        if name in before:
            os.environ[name] = before[name]
        else:
            del os.environ[name]


WIDTH = 80  # of the terminal in which commands are tested


@pytest.fixture
def run_kr5(tmp_path):
    """Runs the command `kr5 ARGS...` in an empty folder; gives returncode, stdout and stderr. The tables that it prints
    must fit the width of a terminal, with nothing cut off."""

    def run(*args, cwd=tmp_path, timeout=600, width=WIDTH) -> subprocess.CompletedProcess:
        done = run_command(*args, cwd=cwd, timeout=timeout, width=width)
        for text in (done.stdout, done.stderr):
            check_tables(text, width)
        return done

    return run


def check_tables(text: str, width: int) -> None:
    """No line of a table, which begins with one space, is wider than the terminal or ends a cell in dots."""
    if text.startswith(("{", "[")):  # JSON for standard output
        return
    for line in text.splitlines():
        if line.startswith(" ") and not line.startswith("  "):
            assert len(line) <= width, line
            assert not re.search(r"[\w.]…(\s|$)", line), line


@pytest.fixture(scope="session")
def worn_recording(tmp_path_factory, share) -> Path:
    """A recording of the demo's worn cell, which believes to be the nominal one."""
    folder = tmp_path_factory.mktemp("worn") / "recording"
    data = share / "data/demo"
    words = ["record", "--cell", data / "worn_cell.yaml", "--protocol", data / "protocol.yaml", "--nominal"]
    done = run_command(*words, "-o", folder, cwd=folder.parent)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture
def kr5_here(tmp_path, monkeypatch):
    """Runs `kr5 ARGS...` in this process, in an empty folder: with the effects that are registered in it."""
    from typer.testing import CliRunner

    from kr5_tools.app import make_app

    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "300")

    def run(*args):
        words = [str(a) for a in args]
        return CliRunner().invoke(make_app(tuple(words)), words)

    return run


@pytest.fixture(scope="session")
def browser(tmp_path_factory):
    if CHROMIUM is None:
        if os.environ.get("CI"):
            pytest.fail("Chromium is not installed; the pages cannot be looked at")
        pytest.skip("Chromium is not installed, so the pages are not looked at")
    browser = Browser(tmp_path_factory.mktemp("chromium"))
    yield browser
    browser.close()


@pytest.fixture(scope="module")
def named_arm(share):
    """The arm as its URDF states it: bodies without rotors, friction or servo, with names of the joints."""
    import kr5.cell

    from arm_logs import case_logs

    cell = case_logs.named(kr5.cell.load_cell(share / "cells" / "kr5_arc.yaml"))
    out = kr5.cell.Cell(robot=cell.robot, name="arm")
    out.tool = cell.tool
    return out


@pytest.fixture(scope="module")
def named_urdf(named_arm, tmp_path_factory):
    import kr5.cell

    file = tmp_path_factory.mktemp("model") / "arm.urdf"
    kr5.cell.export_urdf(named_arm, file)
    return file


@pytest.fixture
def diagnose(tmp_path, monkeypatch):
    """Runs `kr5 gap diagnose` in this process; gives exit code, what it printed, and its JSON."""
    from typer.testing import CliRunner

    from kr5_tools.app import make_app

    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")

    def run(*words, command="diagnose"):
        app = make_app(("gap", command))
        done = CliRunner().invoke(app, ["gap", command, *map(str, words), "--json", "out.json"])
        file = tmp_path / "out.json"
        data = json.loads(file.read_text()) if done.exit_code == 0 else {}
        return done.exit_code, " ".join((done.stdout + done.stderr).split()), data

    return run


@pytest.fixture(scope="session")
def torque_servo_effects() -> set[str]:
    """Ids of the effects that only cells with torque servos carry."""
    return {
        "servo_stiffness",
        "servo_damping",
        "servo_integral",
        "servo_dead_band",
        "torque_limit",
        "torque_dead_band",
        "servo_voltage",
    }


@pytest.fixture
def ros():
    """Types of the messages of ROS 2."""
    pytest.importorskip("rosbags", reason="pip install 'kr5[bags]'")
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.ROS2_JAZZY)
