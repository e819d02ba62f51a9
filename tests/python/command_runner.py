"""Runs commands as `subprocess.run` does, in processes that are forked from one that has loaded what commands load,
which takes longer than most of them: numpy, matplotlib, the extensions of kr5 with their libraries.

Modules of kr5_tools are not among what is loaded: they keep state and read the environment, so each process loads its
own. Where the interpreter itself is to begin in another way (PYTHONPATH, locale), for links to controllers, which keep
a cycle, and with KR5_TEST_FORKS=0, a command is a process from its beginning.
"""

import atexit
import contextlib
import gc
import importlib
import io
import os
import pickle
import pkgutil
import runpy
import select
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
import warnings
from dataclasses import dataclass

COMMAND = "kr5_tools"
# What commands load, some of it when it is first used; and the modules of kr5.
LOADED = (
    "concurrent.futures",
    "jinja2",
    "matplotlib.backends.backend_agg",
    "matplotlib.backends.backend_svg",
    "matplotlib.pyplot",
    "mpl_toolkits.mplot3d",
    "multiprocessing.connection",
    "PIL.Image",
    "pydantic",
    "rich.live",
    "rich.markup",
    "rich.progress",
    "rich.table",
    "rich.traceback",
    "scipy.spatial.transform",
    "scipy.stats",
    "typer.core",
    "typer.rich_utils",
    "yaml",
)
AT_THE_START = ("PYTHON", "LD_PRELOAD", "LC_", "LANG", "OMP_", "OPENBLAS_", "MPL", "TERMINAL_", "FORCE_COLOR", "_TYPER")
IN_CYCLES = ("rsi", "run")  # commands that share a cycle with another end


@dataclass
class Request:
    """What a process is to run: `python -W<warnings> -m <module> <words>`."""

    module: str
    words: list[str]
    folder: str
    environment: dict[str, str]
    warnings: str | None


class CommandServer:
    """The process that forks, as its users see it; started on first use, it ends with them."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._socket: socket.socket | None = None

    def start(self, request: Request, streams: list[int]) -> int:
        """Starts a process with these files as its standard streams; a pipe that tells its id, then its exit code."""
        reading, writing = os.pipe()
        data = pickle.dumps(request)
        with self._lock:
            ours = self._socket or self._begin()
            socket.send_fds(ours, [struct.pack("!I", len(data))], [*streams, writing])
            ours.sendall(data)
        os.close(writing)
        return reading

    def _begin(self) -> socket.socket:
        ours, theirs = socket.socketpair()
        with theirs:
            command = [sys.executable, __file__, str(theirs.fileno())]
            how = {"pass_fds": [theirs.fileno()], "stdin": subprocess.DEVNULL, "env": _environment}
            process = subprocess.Popen(command, **how)
        self._socket = ours

        def end() -> None:
            ours.close()
            process.wait(60)

        atexit.register(end)
        return ours


_server = CommandServer()
_environment = dict(os.environ)  # of the server


def run_command(*words, cwd, timeout: float = 600, width: int | None = None, warnings: str | None = None):
    """`kr5 WORDS...` in a folder: exit code, standard output and standard error as text. `width` is that of the
    terminal; `warnings` the option -W of Python."""
    environment = dict(os.environ)
    if width is not None:
        environment["COLUMNS"] = str(width)
    return run_module(COMMAND, *words, cwd=cwd, timeout=timeout, environment=environment, warnings=warnings)


def run_module(
    module: str, *words, cwd, environment: dict[str, str], timeout: float = 600, warnings: str | None = None
):
    """`python -m MODULE WORDS...`, as `subprocess.run` with `capture_output` and `text`."""
    request = Request(module, [str(word) for word in words], os.fspath(cwd), environment, warnings)
    option = [] if warnings is None else ["-W", warnings]
    command = [sys.executable, *option, "-m", module, *request.words]
    if needs_own_process(request):
        how = {"cwd": cwd, "env": environment, "timeout": timeout}
        return subprocess.run(command, capture_output=True, text=True, check=False, **how)
    return _run_forked(command, request, timeout)


def needs_own_process(request: Request) -> bool:
    """Whether a fork would differ from a process that begins here."""

    def start(environment: dict[str, str]) -> dict[str, str]:
        return {key: value for key, value in environment.items() if key.startswith(AT_THE_START)}

    return (
        os.environ.get("KR5_TEST_FORKS") == "0"
        or start(request.environment) != start(_environment)
        or (request.module == COMMAND and request.words[:1] and request.words[0] in IN_CYCLES)
    )


def _run_forked(command: list[str], request: Request, timeout: float) -> subprocess.CompletedProcess[str]:
    (out, out_there), (error, error_there) = os.pipe(), os.pipe()
    result = _server.start(request, [0, out_there, error_there])
    os.close(out_there)
    os.close(error_there)
    said = {out: bytearray(), error: bytearray(), result: bytearray()}
    in_time = _read(said, time.monotonic() + timeout)
    if not in_time:
        with contextlib.suppress(ProcessLookupError):
            os.kill(int(said[result].split()[0]), signal.SIGKILL)
        _read(said, time.monotonic() + 60)
    for end in said:
        os.close(end)
    texts = [io.TextIOWrapper(io.BytesIO(said[end])).read() for end in (out, error)]
    if not in_time:
        raise subprocess.TimeoutExpired(command, timeout, *texts)
    words = said[result].split()
    if len(words) != 2:
        raise RuntimeError(f"the process that runs commands ended: {texts[1]}")
    return subprocess.CompletedProcess(command, int(words[1]), *texts)


def _read(said: dict[int, bytearray], end: float) -> bool:
    """Reads each to its end; whether that came in time."""
    open_ends = set(said)
    while open_ends:
        ready, _, _ = select.select(open_ends, [], [], max(end - time.monotonic(), 0.0))
        if not ready:
            return False
        for one in ready:
            data = os.read(one, 65536)
            said[one] += data
            if not data:
                open_ends.discard(one)
    return True


# --- in the process that forks


def load() -> None:
    """Everything but kr5_tools, of which each process loads its own."""
    import kr5

    for name in (*LOADED, *(module.name for module in pkgutil.walk_packages(kr5.__path__, "kr5."))):
        with contextlib.suppress(ImportError):  # of a module that was not built; a command that needs it says so
            importlib.import_module(name)
    gc.freeze()  # a fork copies no page for the sake of a count


def serve(ours: socket.socket) -> Request | None:
    """Forks for each request. In such a process it returns the request; when nobody is left to ask, nothing."""
    woken, wake = os.pipe()
    os.set_blocking(wake, False)
    signal.set_wakeup_fd(wake)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal sends it to this process, too
    results: dict[int, int] = {}
    while True:
        ready, _, _ = select.select([ours, woken], [], [])
        if woken in ready:
            os.read(woken, 1024)
            _tell_ends(results)
        if ours not in ready:
            continue
        asked = _receive(ours)
        if asked is None:
            return None
        request, streams, result = asked
        process = os.fork()
        if process == 0:
            signal.set_wakeup_fd(-1)
            for end in (woken, wake, result, *results.values()):
                os.close(end)
            ours.close()
            _take_streams(streams)
            return request
        for end in streams:
            os.close(end)
        results[process] = result
        os.write(result, f"{process} ".encode())


def _receive(ours: socket.socket) -> tuple[Request, list[int], int] | None:
    head, ends, _, _ = socket.recv_fds(ours, 4, 4)
    if not head:
        return None
    data, size = bytearray(), struct.unpack("!I", head)[0]
    while len(data) < size:
        data += ours.recv(size - len(data))
    return pickle.loads(data), ends[:3], ends[3]


def _tell_ends(results: dict[int, int]) -> None:
    """Tells the exit codes of processes that have ended."""
    while results:
        process, status = os.waitpid(-1, os.WNOHANG)
        if process == 0:
            return
        result = results.pop(process)
        with contextlib.suppress(BrokenPipeError):  # nobody waits for it any more
            os.write(result, str(os.waitstatus_to_exitcode(status)).encode())
        os.close(result)


def _take_streams(streams: list[int]) -> None:
    """Makes them the standard streams, buffered as at the start of Python."""
    for number, (name, given) in enumerate(zip(("stdin", "stdout", "stderr"), streams)):
        os.dup2(given, number)
        os.close(given)
        before = getattr(sys, name)
        at_once = before.write_through  # with PYTHONUNBUFFERED
        binary = open(number, "wb" if number else "rb", 0 if at_once else -1, closefd=False)  # noqa: SIM115
        how = {"encoding": before.encoding, "errors": before.errors, "newline": "\n" if number else None}
        lines = not at_once and (number == 2 or os.isatty(number))
        stream = io.TextIOWrapper(binary, line_buffering=lines, write_through=at_once, **how)
        setattr(sys, name, stream)
        setattr(sys, f"__{name}__", stream)


def run(request: Request) -> None:
    """As Python does with the option -m; what is raised ends this process as it ends Python."""
    for number in (signal.SIGCHLD, signal.SIGINT):
        signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)
    os.environ.clear()
    os.environ.update(request.environment)
    os.chdir(request.folder)
    sys.path[0] = os.getcwd()
    sys.argv = [request.module, *request.words]
    if request.warnings is not None:
        warnings.simplefilter(request.warnings)  # type: ignore[arg-type]
    runpy.run_module(request.module, run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    socket_of_tests = socket.socket(fileno=int(sys.argv[1]))
    load()
    todo = serve(socket_of_tests)
    if todo is not None:
        run(todo)
