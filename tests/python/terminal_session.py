"""A command on a pseudo-terminal, as a person runs it: what it says, when, and how it answers Ctrl-C."""

import os
import pty
import re
import select
import signal
import subprocess
import sys
import time

ESCAPES = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")


class TerminalSession:
    """Runs `kr5 ARGS...` in a folder, in a terminal of 80 columns."""

    def __init__(self, *args, cwd) -> None:
        ours, theirs = pty.openpty()
        environment = {k: v for k, v in os.environ.items() if k not in ("CI", "NO_COLOR")}
        environment |= {"TERM": "xterm-256color", "COLUMNS": "80", "LINES": "40"}
        self.begin = time.monotonic()
        self.process = subprocess.Popen(
            [sys.executable, "-m", "kr5_tools", *map(str, args)],
            cwd=cwd,
            stdin=theirs,
            stdout=theirs,
            stderr=theirs,
            env=environment,
            start_new_session=True,
        )
        os.close(theirs)
        self._ours = ours
        self._raw = ""
        self.reads: list[float] = []  # when there was output [s] after the begin

    @property
    def longest_silence(self) -> float:
        """The longest time between two outputs, from the first to the last [s]."""
        return max((after - before for before, after in zip(self.reads, self.reads[1:])), default=0.0)

    @property
    def text(self) -> str:
        """Everything so far, without what moves the cursor."""
        return ESCAPES.sub("", self._raw).replace("\r", "\n")

    def read_until(self, text: str | None = None, seconds: float = 300.0) -> bool:
        """Reads until the output holds the text, to its end, or for so long; whether the text is there."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if text is not None and text in self.text:
                return True
            ready, _, _ = select.select([self._ours], [], [], 0.05)
            if not ready:
                continue
            try:
                data = os.read(self._ours, 65536)
            except OSError:  # the other side is closed
                data = b""
            if not data:
                return text is not None and text in self.text
            self.reads.append(time.monotonic() - self.begin)
            self._raw += data.decode(errors="replace")
        if text is None:
            raise TimeoutError(f"no end within {seconds} s of: {self.text[-2000:]}")
        return False

    def interrupt(self) -> None:
        """Ctrl-C, which a terminal sends to every process of the command."""
        os.killpg(self.process.pid, signal.SIGINT)

    def wait(self) -> int:
        """Reads to the end; the exit code."""
        self.read_until()
        return self.process.wait(60)

    def close(self) -> None:
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait(60)
        os.close(self._ours)
