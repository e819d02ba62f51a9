"""A sign of life at a terminal while a command is silent: nobody should have to guess whether it hangs."""

import contextlib
import importlib.abc
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console

QUIET = 0.8  # [s] without a word, after which the sign appears
TEXT = "Working …"
PERIOD = 0.1  # [s]
# Modules that take so long to load, and hold Python meanwhile, that the sign appears before they do.
SLOW_MODULES = ("kr5._kr5_vision", "kr5._kr5_sim", "kr5._kr5_work", "matplotlib.pyplot", "distributed")


class SignOfLife:
    """Shows TEXT on a console when nothing was printed for QUIET, until something is. What else moves on the same
    line, as a bar does, holds it."""

    def __init__(self, console: "Console") -> None:
        self._console = console
        self._lock = threading.RLock()
        self._status: Any = None
        self._last = 0.0
        self._begun = False
        self._holders = 0
        self._finder = _SlowImports(self)

    def begin(self) -> None:
        """From here on; does nothing where nobody watches."""
        with self._lock:
            if self._begun or not self._console.is_terminal:
                return
            self._begun, self._last = True, time.monotonic()
        sys.meta_path.insert(0, self._finder)
        threading.Thread(target=self._watch, daemon=True).start()

    def end(self) -> None:
        with self._lock:
            if self._begun:
                sys.meta_path.remove(self._finder)
            self._begun = False
            self._hide()

    def show(self) -> None:
        """Now, unless something else moves."""
        with self._lock:
            if self._begun and self._status is None and not self._holders:
                self._status = self._console.status(TEXT)
                self._status.start()

    def note_output(self) -> None:
        """To be called before something is printed."""
        with self._lock:
            self._hide()
            self._last = time.monotonic()

    @contextlib.contextmanager
    def held(self) -> Iterator[None]:
        """Not shown inside."""
        with self._lock:
            self._holders += 1
            self._hide()
        try:
            yield
        finally:
            with self._lock:
                self._holders -= 1
                self._last = time.monotonic()

    def _hide(self) -> None:
        if self._status is not None:
            self._status.stop()
            self._status = None

    def _watch(self) -> None:
        while True:
            time.sleep(PERIOD)
            with self._lock:
                if not self._begun:
                    return
                if time.monotonic() - self._last > QUIET:
                    self.show()


class _SlowImports(importlib.abc.MetaPathFinder):
    """Finds nothing, but shows the sign when one of SLOW_MODULES is about to be loaded."""

    def __init__(self, sign: SignOfLife) -> None:
        self._sign = sign

    def find_spec(self, fullname: str, path: Sequence[str] | None, target: object = None) -> None:
        if fullname in SLOW_MODULES:
            self._sign.show()
