"""Output for people: standard output and standard error, progress, and errors that end a command."""

import contextlib
import os
import webbrowser
from collections.abc import Callable, Iterable, Iterator
from contextvars import ContextVar
from pathlib import Path
from typing import Any, NoReturn

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import Progress, ProgressColumn

from kr5_tools.cli.sign_of_life import SignOfLife

# Text is printed as it is, since names of files may hold brackets; what is to be coloured says markup=True.
sign_of_life = SignOfLife(Console(stderr=True))
LONGEST = 2000  # letters of an error, which may quote a file of megabytes


class _Console(Console):
    """Takes the sign of life away before it prints; goes on in silence when nobody reads any more, as with `| head`:
    the files of the command are still to be written."""

    def print(self, *objects: Any, **options: Any) -> None:
        sign_of_life.note_output()
        super().print(*objects, **options)

    def on_broken_pipe(self) -> None:
        self.quiet = True
        with open(os.devnull, "w") as nothing:
            os.dup2(nothing.fileno(), self.file.fileno())


errors = _Console(stderr=True, highlight=False, emoji=False, markup=False)


def console(json_file: Path | None = None) -> Console:
    """Where people read. With `--json -` standard output belongs to the JSON, and people read standard error."""
    return errors if str(json_file) == "-" else _Console(highlight=False, emoji=False, markup=False)


_refused: ContextVar[list[str] | None] = ContextVar("refused", default=None)  # so far, where errors are raised


@contextlib.contextmanager
def raising() -> Iterator[None]:
    """Errors are raised for Python (kr5.InvalidArgument) in place of a text and the end of a command."""
    before = _refused.set([])
    try:
        yield
    finally:
        _refused.reset(before)


def fail(message: str) -> NoReturn:
    """Ends the command with an error of one line and exit code 2."""
    text = message if len(message) <= LONGEST else f"{message[:LONGEST]} …"
    if (refused := _refused.get()) is not None:
        import kr5

        raise kr5.InvalidArgument("\n".join([*refused, _printable(text)]))
    errors.print(f"[red]error:[/red] {escape(_printable(text))}", soft_wrap=True, markup=True)
    raise typer.Exit(2)


def print_note(message: str) -> None:
    """A word of caution, which does not end the command."""
    errors.print(f"[yellow]note:[/yellow] {escape(_printable(message))}", soft_wrap=True, markup=True)


def print_problem(message: str, refused: bool) -> None:
    """What speaks against an input, of which there may be several: an error where it is refused for them."""
    if (before := _refused.get()) is not None and refused:
        before.append(_printable(message))
        return
    word = "[red]error:[/red]" if refused else "[yellow]warning:[/yellow]"
    errors.print(f"{word} {escape(_printable(message))}", soft_wrap=True, markup=True)


def _printable(text: str) -> str:
    """Without characters that a terminal would obey, and on one line."""
    return "".join(c if c.isprintable() else " " if c.isspace() else repr(c)[1:-1] for c in text)


def describe_error(error: Exception) -> str:
    """What a user reads of an error: of the system's, the file and what is wrong with it."""
    if isinstance(error, OSError) and error.strerror:
        return f"{os.fsdecode(error.filename)}: {error.strerror}" if error.filename else error.strerror
    if isinstance(error, MemoryError):
        return "not enough memory; is a number of the input far too large?"
    if isinstance(error, UnicodeDecodeError):
        return f"found text that is not UTF-8: {error.object.decode('utf-8', errors='backslashreplace')}"
    return str(error)


def is_user_error(error: Exception) -> bool:
    """Bad input, not a bug: everything kr5 throws on purpose, files that cannot be read or written, and what the
    memory cannot hold.

    What kr5 says of bytes that are no text reaches Python as UnicodeDecodeError.
    """
    if isinstance(error, (OSError, MemoryError, UnicodeDecodeError)):
        return True
    import kr5

    return isinstance(error, kr5.Error)


def track(items: Iterable[Any], what: str) -> Iterable[Any]:
    """The items, with a progress bar for people at a terminal."""
    with progress_bar() as bar:
        yield from bar.track(items, description=escape(what))


_bars: list[Progress] = []  # those that are shown


def end_bars() -> None:
    """Takes away what still moves: the bar of a generator, such as `track`, outlives an exception in its loop."""
    for bar in _bars:
        bar.stop()


@contextlib.contextmanager
def progress_bar(*columns: ProgressColumn) -> Iterator[Progress]:
    """A progress bar for people at a terminal, which is gone at the end."""
    with (
        sign_of_life.held(),
        Progress(*columns, console=errors, transient=True, disable=not errors.is_terminal) as bar,
    ):
        _bars.append(bar)
        try:
            yield bar
        finally:
            _bars.remove(bar)


@contextlib.contextmanager
def share_bar(what: str) -> Iterator[Callable[[float], None]]:
    """A progress bar for one call that tells which share of its work is done, 0 to 1."""
    with progress_bar() as bar:
        task = bar.add_task(escape(what), total=1.0)
        yield lambda share: bar.update(task, completed=share)


@contextlib.contextmanager
def spinner(what: str) -> Iterator[None]:
    """A sign of life during one long call."""
    with sign_of_life.held(), errors.status(escape(what)) if errors.is_terminal else contextlib.nullcontext():
        yield


def open_page(page: Path | None) -> None:
    """In a browser, where there is a screen for one; where the page is was said already."""
    if page and page.is_file() and (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        webbrowser.open(page.resolve().as_uri())
