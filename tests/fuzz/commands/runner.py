"""Runs commands of `kr5` in forks of one process that has them imported, and tells what became of each.

A fork costs a few milliseconds, and whatever happens in it (a signal, a hang, memory eaten up) stays in it.
"""

import contextlib
import importlib
import json
import os
import pkgutil
import re
import resource
import signal
import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

MEMORY = 4 * 1024**3  # [bytes] of address space; what was read is a fraction of a megabyte
SECONDS = 30  # of processor time of a run
PATIENCE = 4.0  # so many times of it on the wall, since others use the processors too
CRASHED = 70  # exit code of a run that ended in an exception
KEPT = b"kept\n"


@dataclass
class Outcome:
    """How a run ended. `problem` is empty when it ended as it should."""

    code: int
    problem: str
    text: str  # standard error


def import_commands() -> None:
    """Imports all that the commands need, without running any of it: threads would not live on in a fork."""
    os.environ.update(
        MPLBACKEND="Agg", OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", COLUMNS="200", NO_COLOR="1", TERM="dumb"
    )
    package = importlib.import_module("kr5_tools")
    for module in pkgutil.walk_packages(package.__path__, "kr5_tools."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    for name in (
        "kr5.sim",
        "kr5.predict",
        "kr5.gap",
        "kr5.picking",
        "kr5.vision",
        "kr5.calibration",
        "matplotlib.pyplot",
        "mpl_toolkits.mplot3d",
        "scipy.stats",
        "scipy.spatial.transform",
        "scipy.signal",
        "jinja2",
    ):
        importlib.import_module(name)
    for name in ("pypcd4", "mcap.reader", "mcap_ros2.decoder"):
        with contextlib.suppress(ImportError):
            importlib.import_module(name)


def run(folder: Path, words: list[str], seconds: float = SECONDS) -> Outcome:
    """Runs `kr5 WORDS` in a folder."""
    return forked(folder, lambda: _command(words), seconds)


def forked(folder: Path, call: Callable[[], None], seconds: float = SECONDS) -> Outcome:
    error_file = folder / ".stderr"
    child = os.fork()
    if child == 0:
        _child(folder, error_file, call, seconds)
    status = _wait(child, seconds)
    text = error_file.read_text(encoding="utf-8", errors="replace") if error_file.exists() else ""
    if status is None:
        return Outcome(-1, "hang", text)
    if os.WIFSIGNALED(status):
        number = os.WTERMSIG(status)
        return Outcome(-number, "hang" if number == signal.SIGXCPU else signal.Signals(number).name, text)
    code = os.WEXITSTATUS(status)
    return Outcome(code, _problem(code, text), text)


def _wait(child: int, seconds: float) -> int | None:
    """The status of a child; None when it had to be killed."""
    end, pause = time.monotonic() + PATIENCE * seconds, 0.002
    while time.monotonic() < end:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return status
        time.sleep(pause)
        pause = min(1.3 * pause, 0.05)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return None


def _child(folder: Path, error_file: Path, call: Callable[[], None], seconds: float) -> None:
    code = CRASHED
    try:
        os.chdir(folder)
        for number, file in ((0, os.devnull), (1, os.devnull), (2, error_file)):
            handle = os.open(file, os.O_RDWR | os.O_CREAT | os.O_TRUNC)
            os.dup2(handle, number)
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CPU, (int(seconds), int(seconds) + 2))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        signal.signal(signal.SIGXCPU, signal.SIG_DFL)
        call()
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
        if isinstance(end.code, str):
            sys.stderr.write(end.code)
    except BaseException:
        traceback.print_exc()
    with contextlib.suppress(Exception):
        sys.stderr.flush()
    os._exit(code)


def _command(words: list[str]) -> None:
    from kr5_tools.app import main

    sys.argv = ["kr5", *words]
    main()


def _problem(code: int, text: str) -> str:
    if code == CRASHED or "Traceback (most recent call last)" in text:
        return f"traceback: {_where(text)}"
    if code not in (0, 1, 2):
        return f"exit code {code}"
    return ""


def _where(text: str) -> str:
    """The last place of our own in a traceback, and what was raised there."""
    places = re.findall(r'File ".*?/(kr5_tools/[\w/]+\.py)", line (\d+), in (\S+)', text)
    what = next(
        (
            line
            for line in reversed(text.splitlines())
            if re.match(r"[\w.]+(Error|Exception|Interrupt|Killed|BadZipFile|Exit)?\b", line)
        ),
        "?",
    )
    place = f"{places[-1][0]}:{places[-1][2]}" if places else "?"
    return f"{what.split(':')[0]} at {place}"


def check_outputs(folder: Path, outputs: dict[str, bool], code: int) -> str:
    """What is wrong with the files a run left: one lost to a failure, or JSON with what is no number. `outputs`:
    was it there before?
    """
    for name, before in outputs.items():
        file = folder / name
        if before and code == 2 and (not file.is_file() or file.read_bytes() != KEPT):
            return f"output lost: {file.suffix}"
        if code in (0, 1) and file.suffix == ".json" and file.is_file() and file.read_bytes() != KEPT:
            try:
                json.loads(file.read_text(encoding="utf-8"), parse_constant=_no_number)
            except (ValueError, UnicodeDecodeError) as error:
                return f"bad JSON written: {str(error)[:40]}"
    return ""


def _no_number(text: str) -> None:
    raise ValueError(f"{text} is no number")
