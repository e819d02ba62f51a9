"""Output for people: standard output and standard error, progress, and errors that end a command."""

import contextlib
import os
import warnings
import webbrowser
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, NoReturn

import typer
from rich.console import Console as Console  # for those who print
from rich.markup import escape
from rich.progress import Progress, ProgressColumn

from kr5_tools.cli.sign_of_life import SignOfLife

# Text is printed as it is, since names of files may hold brackets; what is to be coloured says markup=True.
sign_of_life = SignOfLife(Console(stderr=True))
LONGEST = 2000  # letters of an error, which may quote a file of megabytes


class _Console(Console):
    """Takes the sign of life away before it prints; goes on in silence when nobody reads any more, as with `| head`:
    the files of the command are still to be written."""

    def print(self, *objects: object, **options: Any) -> None:
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


def fail(*messages: str) -> NoReturn:
    """Ends the command with errors of one line each and exit code 2. For commands: everything else raises kr5.Error."""
    for message in messages:
        _print_marked("error", "red", message)
    raise typer.Exit(2)


def print_note(message: str) -> None:
    """A word of caution, which does not end the command."""
    _print_marked("note", "yellow", message)


def print_warning(message: str) -> None:
    """What speaks against an input that is used all the same."""
    _print_marked("warning", "yellow", message)


def _print_marked(word: str, colour: str, message: str) -> None:
    text = message if len(message) <= LONGEST else f"{message[:LONGEST]} …"
    errors.print(f"[{colour}]{word}:[/{colour}] {escape(_printable(text))}", soft_wrap=True, markup=True)


@contextlib.contextmanager
def cautions_printed() -> Iterator[None]:
    """What libraries warn of with kr5.Caution is printed: as a warning where it speaks against the input, else as a
    note."""
    import kr5

    with warnings.catch_warnings():
        warnings.simplefilter("always", kr5.Caution)
        other = warnings.showwarning

        def show(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
            if issubclass(category, kr5.Implausible):
                print_warning(str(message))
            elif issubclass(category, kr5.Caution):
                print_note(str(message))
            else:
                other(message, category, *place, **more)

        warnings.showwarning = show
        yield


def _printable(text: str) -> str:
    """Without characters that a terminal would obey, and on one line."""
    return "".join(c if c.isprintable() else " " if c.isspace() else repr(c)[1:-1] for c in text)


def fail_with(error: Exception) -> NoReturn:
    """Ends the command with what a user can mend."""
    import kr5

    fail(*(error.messages if isinstance(error, kr5.Errors) else [describe_error(error)]))


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
    if page and page.is_file():
        open_address(page.resolve().as_uri())


def open_address(address: str) -> None:
    """The same of an address."""
    if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        webbrowser.open(address)
