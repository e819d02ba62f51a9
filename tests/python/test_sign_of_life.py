"""Nobody should have to guess whether a command hangs: at a terminal it moves within two seconds."""

import shutil
import time

import pytest
from rich.console import Console

from kr5_tools.cli import sign_of_life
from terminal_session import TerminalSession

SECONDS = 2.0  # of silence


@pytest.fixture
def start_up(tmp_path):
    """Time [s] to the first word of a command that does nothing, on this machine as busy as it is now."""
    one = TerminalSession("--version", cwd=tmp_path)
    assert one.wait() == 0
    one.close()
    return one.reads[0]


@pytest.mark.parametrize(
    "words",
    [
        ["calibrate", "camera", "{images}", "--target", "grid:36h11:5x7:0.03:0.01"],
        ["calibrate", "hand-eye", "{demo}"],
        ["target", "print", "--target", "chessboard:6x9:0.025", "-o", "board.pdf"],
        ["gap", "diagnose", "{recording}", "--report", "gap.html"],
        ["gap", "explain", "{recording}"],
        ["gap", "plan", "{recording}", "--separate", "coulomb_friction:joint3,stribeck_friction:joint3"],
        ["scene", "run", "{share}/scenes/scan_tube.yaml", "-o", "page.html"],
        ["replay", "{recording}", "-o", "replay.html"],
        ["identify", "servo", "{recording}", "--joint", "1"],
        ["calibrate", "postures", "--cell", "{cell}"],
        ["insert", "-o", "page.html"],
    ],
    ids=lambda words: " ".join(words[:2]),
)
def test_a_slow_command_moves_before_two_seconds(tmp_path, share, worn_recording, start_up, words):
    demo = share / "data/demo"
    places = {
        "images": some_images(demo / "images", tmp_path / "images"),
        "demo": demo,
        "share": share,
        "recording": worn_recording,
        "cell": share / "cells/kr5_arc.yaml",
    }
    one = TerminalSession(*(word.format(**places) for word in words), cwd=tmp_path)
    try:
        assert one.wait() in (0, 1), one.text
        assert one.reads[0] < SECONDS + 2 * start_up
        assert one.longest_silence < SECONDS + start_up, one.text
        assert one.text.rstrip().splitlines()[-1] != sign_of_life.TEXT  # it is gone at the end
    finally:
        one.close()


def some_images(source, folder):
    """As many as ViSP is silent with for seconds; with all of them it takes minutes."""
    folder.mkdir()
    for file in sorted(source.glob("*.png"))[:6]:
        shutil.copy(file, folder)
    return folder


def test_the_sign_appears_in_silence_and_goes_with_the_next_word(monkeypatch):
    monkeypatch.setattr(sign_of_life, "QUIET", 0.3)
    console = Console(force_terminal=True, file=open("/dev/null", "w"))  # noqa: SIM115
    sign = sign_of_life.SignOfLife(console)
    sign.begin()
    wait_for(lambda: sign._status is not None)
    sign.note_output()
    assert sign._status is None
    with sign.held():
        time.sleep(0.6)
        assert sign._status is None
    wait_for(lambda: sign._status is not None)
    sign.end()
    assert sign._status is None


def wait_for(condition, seconds=20):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_nothing_moves_where_nobody_watches(run_kr5, worn_recording):
    done = run_kr5("gap", "diagnose", worn_recording)
    assert done.stderr == "" and "\x1b" not in done.stdout
