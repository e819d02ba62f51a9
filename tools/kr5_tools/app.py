"""Puts the command `kr5` together. A command's file is imported when that command runs, so `kr5 --help` is quick."""

import contextlib
import importlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn

import typer
from typer.core import TyperGroup

from kr5_tools.cli.interruption import (
    STOPPED,
    end_children,
    prompt_interruption,
    shielded,
    stop_text,
    tell_when_stopped,
)
from kr5_tools.command_table import COMMANDS, GROUP_HELP, CommandEntry

PACKAGE = "kr5_tools"
_said_stopped = False


class CleanErrors(TyperGroup):
    """Says in one line what the user can mend, with exit code 2; anything else is a bug and keeps its traceback.

    The files of a command appear once it has succeeded.
    """

    def invoke(self, ctx: Any) -> Any:
        if "--help" in (*ctx._protected_args, *ctx.args):  # without the library, which takes a moment to load
            return super().invoke(ctx)
        from kr5_tools.cli.terminal import cautions_printed, fail_with, is_user_error, sign_of_life

        end = None
        tell_when_stopped(None)
        sign_of_life.begin()
        try:
            with _held_back(), cautions_printed():
                try:
                    super().invoke(ctx)
                except typer.Exit as done:
                    if done.exit_code not in (0, 1):
                        raise
                    end = done
        except KeyboardInterrupt:
            _say_stopped()
            raise typer.Exit(STOPPED) from None
        except Exception as error:
            if not is_user_error(error):
                raise
            fail_with(error)
        finally:
            sign_of_life.end()
        if end:
            raise end
        return None


@contextlib.contextmanager
def _held_back() -> Iterator[None]:
    """Files of the command appear together at the end, which Ctrl-C does not break."""
    from kr5.files import writing

    from kr5_tools.cli.terminal import sign_of_life

    writing.surroundings = writing.Surroundings(shielded, sign_of_life.note_output)
    with writing.held_back():
        yield


def _written_files() -> list[Path]:
    """What this command has written so far; without the library, which takes a moment to load, there is nothing."""
    writing = sys.modules.get("kr5.files.writing")
    return writing.written_files() if writing else []


def _add(parent: typer.Typer, name: str, entry: CommandEntry, load: bool) -> None:
    """Adds one command; unless it is to be loaded, a stand-in that has nothing but the help text."""
    if not load:
        parent.command(name, help=entry.help)(lambda: None)
        return
    app = importlib.import_module(f"{PACKAGE}.{entry.module}").app
    for command in app.registered_commands:
        command.help = join_lines(command.help or command.callback.__doc__ or "")
    if len(app.registered_commands) == 1 and app.registered_callback is None and not app.registered_groups:
        info = app.registered_commands[0]
        info.name = name
        parent.registered_commands.append(info)
    else:
        parent.add_typer(app, name=name, help=entry.help, no_args_is_help=True)


def join_lines(text: str) -> str:
    """The paragraphs of a docstring, each on one line, which help breaks to the width of the terminal."""
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in text.split("\n\n"))


def make_app(wanted: tuple[str, ...] | None = None) -> typer.Typer:
    """The whole command, or with `wanted` (the words typed) only as much of it as that takes."""
    app = typer.Typer(
        cls=CleanErrors,
        name="kr5",
        help="Calibrate, check and diagnose a robot cell.",
        no_args_is_help=True,
        rich_markup_mode="rich",
        pretty_exceptions_show_locals=False,
    )
    app.callback()(_root)
    for name, entry in COMMANDS.items():
        if isinstance(entry, CommandEntry):
            _add(app, name, entry, wanted is None or wanted[:1] == (name,))
            continue
        if name not in GROUP_HELP:
            raise ValueError(f"the group of commands {name!r} has no entry in GROUP_HELP, which says what it is for")
        group = typer.Typer(help=GROUP_HELP[name], no_args_is_help=True)
        group.callback()(lambda: None)
        for child, child_entry in entry.items():
            _add(group, child, child_entry, wanted is None or wanted[:2] == (name, child))
        app.add_typer(group, name=name)
    return app


def _print_version(wanted: bool) -> None:
    if wanted:
        import kr5

        typer.echo(f"kr5 {kr5.__version__}")
        raise typer.Exit


def _root(
    version: bool = typer.Option(False, "--version", callback=_print_version, is_eager=True, help="Show the version."),
) -> None:
    pass


def __getattr__(name: str) -> Any:
    if name == "app":
        return make_app()
    raise AttributeError(name)


def main() -> None:
    """CommandEntry point of the command `kr5`."""
    completing = any(key.endswith("_COMPLETE") for key in os.environ)
    words = tuple(word for word in sys.argv[1:] if not word.startswith("-"))
    for stream in (sys.stdout, sys.stderr):  # names of files need not be UTF-8
        stream.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]
    with prompt_interruption(_give_up):
        try:
            app = _load_app(None if completing else words)
            app(prog_name="kr5")
        except KeyboardInterrupt:
            _exit_stopped()
        except ImportError as error:
            if not isinstance(error.__cause__, KeyboardInterrupt):
                raise
            _exit_stopped()  # heard by a library of C++ while it was loaded
        except SystemExit as end:
            if end.code == STOPPED:
                _exit_stopped()
            raise


def _exit_stopped() -> NoReturn:
    """At once, with this code: Python would end itself by the signal where that came inside exec()."""
    if not _said_stopped:  # the command had not begun
        _say_stopped()
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):
            stream.flush()
    os._exit(STOPPED)


def _load_app(words: tuple[str, ...] | None) -> typer.Typer:
    """The command, of which some parts take seconds to load on a slow disk."""
    from kr5_tools.cli.terminal import sign_of_life

    sign_of_life.begin()
    try:
        return make_app(words)
    finally:
        sign_of_life.end()


def _say_stopped() -> None:
    global _said_stopped
    _said_stopped = True
    from kr5_tools.cli.terminal import end_bars, errors

    end_bars()
    errors.print(stop_text(_written_files()), soft_wrap=True)


def _give_up() -> None:
    from kr5_tools.cli.terminal import errors

    end_children()
    if writing := sys.modules.get("kr5.files.writing"):
        writing.discard()
    moving = errors.is_terminal
    with os.fdopen(os.dup(2), "w", errors="backslashreplace") as last, open(os.devnull, "w") as nothing:
        os.dup2(nothing.fileno(), 2)  # the last word, also where another thread is drawing a bar
        if moving:
            last.write("\r\x1b[2K\x1b[?25h")  # its line is cleared, and the cursor shown
        last.write(f"{stop_text(_written_files())}\n")
