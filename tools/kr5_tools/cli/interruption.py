"""Ctrl-C, which is to end a command soon, also one that is in a long call of the library and does not hear it; and
what is then said to have been written."""

import contextlib
import os
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Iterator, Sequence

STOPPED = 130  # exit code of what Ctrl-C has ended, as of a shell
GRACE = 0.5  # [s] in which a command may end by itself, unless it waits for the library

_shields = 0  # sections that are being carried out which Ctrl-C must not break
_pending = False  # Ctrl-C came in such a section
_is_end = False  # Ctrl-C was the end that the command waits for
_kept: Callable[[], str] | None = None
_children: set[subprocess.Popen[str]] = set()


@contextlib.contextmanager
def prompt_interruption(give_up: Callable[[], None]) -> Iterator[None]:
    """Ctrl-C inside raises KeyboardInterrupt, once; where that has not ended the block within GRACE, `give_up` is
    called by a thread beside, and the process ends at once with STOPPED, unless the command took it as its end. For the
    main thread."""
    global _is_end
    _is_end = False
    over, heard = threading.Event(), threading.Event()

    def hear(number: int, frame: object) -> None:
        global _pending
        if heard.is_set():
            return
        heard.set()
        for child in list(_children):
            child.send_signal(signal.SIGINT)
        if _shields:
            _pending = True
            return
        raise KeyboardInterrupt

    def watch() -> None:
        while data := os.read(reading, 1):
            if data[0] == signal.SIGINT and not over.wait(GRACE):
                while (_shields or _is_end) and not over.is_set():
                    time.sleep(0.01)
                if not over.is_set():
                    give_up()
                    os._exit(STOPPED)

    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    handler, wakeup = signal.signal(signal.SIGINT, hear), signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    try:
        yield
    finally:
        over.set()
        signal.set_wakeup_fd(wakeup)
        signal.signal(signal.SIGINT, handler)
        os.close(writing)  # the thread reads the end
        watcher.join(GRACE)
        os.close(reading)


@contextlib.contextmanager
def shielded() -> Iterator[None]:
    """A short section that Ctrl-C does not break: it is raised at the end."""
    global _shields, _pending
    _shields += 1
    try:
        yield
    finally:
        _shields -= 1
        if _pending and not _shields:
            _pending = False
            raise KeyboardInterrupt


def take_as_end() -> None:
    """Ctrl-C was the end that the command waits for: it concludes in its own time, however busy the computer is."""
    global _is_end
    _is_end = True


def tell_when_stopped(text: Callable[[], str] | None) -> None:
    """From here on a command that is stopped says this of what it leaves, in place of the files that it wrote."""
    global _kept
    _kept = text


def stop_text(written: Sequence[object]) -> str:
    """What is said of a stopped command, which wrote these files."""
    if _kept:
        return f"stopped; {_kept()}"
    return f"stopped; written: {', '.join(map(str, written))}" if written else "stopped; nothing was written"


def run_child(command: list[str]) -> subprocess.CompletedProcess[str]:
    """Runs another command, which is stopped with this one."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as child:
        _children.add(child)
        try:
            out, error = child.communicate()
        finally:
            _children.discard(child)
    return subprocess.CompletedProcess(command, child.returncode, out, error)


def end_children() -> None:
    """Waits for the end of stopped children, and ends those that do not hear."""
    for child in list(_children):
        with contextlib.suppress(subprocess.TimeoutExpired):
            child.wait(GRACE)
        child.kill()
