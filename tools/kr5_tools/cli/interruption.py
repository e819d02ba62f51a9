"""Ctrl-C, which is to end a command soon, also one that is in a long call of the library and does not hear it."""

import contextlib
import os
import signal
import threading
from collections.abc import Callable, Iterator
from typing import Any

STOPPED = 130  # exit code of what Ctrl-C has ended, as of a shell
GRACE = 0.5  # [s] in which Python hears of Ctrl-C, unless it waits for the library


@contextlib.contextmanager
def prompt_interruption(give_up: Callable[[], None]) -> Iterator[None]:
    """Ctrl-C inside raises KeyboardInterrupt; where it is not raised within GRACE, `give_up` is called by a thread
    beside, and the
    process ends at once with STOPPED. For the main thread."""
    heard = threading.Event()

    def hear(number: int, frame: Any) -> None:
        heard.set()
        raise KeyboardInterrupt

    def watch() -> None:
        while data := os.read(reading, 1):
            if data[0] == signal.SIGINT and not heard.wait(GRACE):
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
        signal.set_wakeup_fd(wakeup)
        signal.signal(signal.SIGINT, handler)
        os.close(writing)  # the thread reads the end
        watcher.join(GRACE)
        os.close(reading)
