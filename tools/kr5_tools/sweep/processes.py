"""Processes of this machine that run functions. One that is killed is replaced, and only its call is lost; Python's own
pool loses all calls then, and can hang."""

import contextlib
import multiprocessing
import queue
import signal
import threading
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from typing import Any

SPAWN = multiprocessing.get_context("spawn")


class WorkerDied(Exception):
    """The process ended during a call."""


class Process:
    """One that runs a call at a time."""

    def __init__(self) -> None:
        self._connection, theirs = SPAWN.Pipe()
        self._process = SPAWN.Process(target=_serve, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()  # so that the end of the process is the end of the pipe
        self._ending = threading.Lock()

    def call(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        try:
            self._connection.send((function, arguments))
            result, error = self._connection.recv()
        except (EOFError, OSError):
            self.end()  # the pipe may end a moment before the process
            raise WorkerDied from None
        if error is not None:
            raise error
        return result

    def is_alive(self) -> bool:
        return self._process.is_alive()

    def end(self) -> None:
        """Ends the process, from any thread; a call that runs then raises WorkerDied."""
        with self._ending:
            self._process.terminate()
            self._process.join()

    def close(self) -> None:
        """Closes the pipe of a process that has ended, once no call uses it."""
        self._connection.close()


class Processes:
    """As many calls at once as there are processes."""

    def __init__(self, count: int) -> None:
        self._idle: queue.SimpleQueue[Process] = queue.SimpleQueue()
        self._all: list[Process] = []
        self._changing = threading.Lock()
        self._ended = False
        self._threads = ThreadPoolExecutor(count)
        try:
            with _ignore_sigint():
                for _ in range(count):
                    self._idle.put(self._begin())
        except OSError:
            self.end()
            raise

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """The call gives what the function gives, or raises WorkerDied."""
        return self._threads.submit(self._call, function, arguments)

    def end(self) -> None:
        """Ends all processes, also in the middle of a call."""
        with self._changing:
            self._ended = True  # from here on no call begins another process
        self._threads.shutdown(wait=False, cancel_futures=True)
        for process in self._all:
            process.end()
        self._threads.shutdown()
        for process in self._all:
            process.close()

    def _begin(self) -> Process:
        with self._changing:
            if self._ended:
                raise WorkerDied
            process = Process()
            self._all.append(process)
            return process

    def _replace(self, process: Process) -> Process:
        successor = self._begin()
        with self._changing:
            if not self._ended:  # otherwise end() closes it
                self._all.remove(process)
                process.close()
        return successor

    def _call(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        process = self._idle.get()
        try:
            if not process.is_alive():
                process = self._replace(process)
            return process.call(function, arguments)
        finally:
            self._idle.put(process)


def _serve(connection: Connection) -> None:
    """Runs what is asked for until the pipe ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with contextlib.suppress(EOFError, OSError):
        while True:
            function, arguments = connection.recv()
            result, problem = None, None
            try:
                result = function(*arguments)
            except (Exception, SystemExit) as error:  # raised again by the process that asked
                error.add_note(traceback.format_exc())
                problem = error
            try:
                message = ForkingPickler.dumps((result, problem))
            except Exception as error:  # of a result or an error that is local to this process
                text = f"{type(problem or error).__name__}: {problem or error}"
                message = ForkingPickler.dumps((None, RuntimeError(text)))
            connection.send_bytes(message)


@contextlib.contextmanager
def _ignore_sigint() -> Iterator[None]:
    """Processes that are started inside do not hear Ctrl-C, which a terminal sends to all of them: this one ends
    them."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
