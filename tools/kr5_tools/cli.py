"""Puts the command `kr5` together. A command's file is imported when that command runs, so `kr5 --help` is quick."""

import importlib
import os
import sys

import typer
from typer.core import TyperGroup

# What `kr5 --help` says. Each file has `app`, a typer.Typer: with one command and no callback it is that command,
# otherwise a group of commands.
COMMANDS = {
    "demo": "The whole job on images whose truth is known.",
    "cell": "Check a cell or a recording, and show it.",
    "dataset": "Describe a folder of images and robot poses.",
    "detect": "Find targets in images and draw what was seen.",
    "target": "Make a target to print, and list its points.",
    "render": "A picture of targets with known truth.",
    "calibrate": {
        "camera": "Lens and sensor of a camera, from images of a target.",
        "hand-eye": "Where the camera sits on the arm, or beside it.",
        "tool": "Where the tool tip sits on the flange.",
        "map": "Where markers sit relative to each other, from images of them.",
        "timed": "Hand-eye with clocks: from time-stamped pose streams.",
    },
    "record": "Run a protocol in the simulator and write what its sensors show.",
    "recording": "Turn a log of a real cell into a recording.",
    "insert": "Let a peg feel its way into a tube, and see how.",
    "sweep": {
        "insertion": "Insert a peg over tilts and clearances: how often, how soon.",
    },
    "scene": "Run a scene in DART and judge what comes of it.",
    "gap": "How far a simulation is from what was recorded.",
    "replay": "A page in which a cell moves as it was recorded.",
    "report": "Turn a result file into one self-contained page.",
}
GROUP_HELP = {"calibrate": "Estimate where things are, how well that is known, and whether to trust it.",
              "sweep": "Run the simulated cell many times over a grid."}


class CleanErrors(TyperGroup):
    """Says in one line what the user can mend, with exit code 2; anything else is a bug and keeps its traceback."""

    def invoke(self, ctx):
        try:
            return super().invoke(ctx)
        except Exception as error:
            from .common import fail, is_users_to_mend

            if not is_users_to_mend(error):
                raise
            fail(str(error))


def _file(*path: str) -> str:
    return "kr5_tools." + "_".join(path).replace("-", "_")


def _add(parent: typer.Typer, path: tuple[str, ...], text: str, load: bool) -> None:
    """Adds one command; unless it is to be loaded, a stand-in that has nothing but the help text."""
    name = path[-1]
    if not load:
        parent.command(name, help=text)(lambda: None)
        return
    app = importlib.import_module(_file(*path)).app
    if len(app.registered_commands) == 1 and app.registered_callback is None and not app.registered_groups:
        info = app.registered_commands[0]
        info.name = name
        parent.registered_commands.append(info)
    else:
        parent.add_typer(app, name=name, help=text, no_args_is_help=True)


def make_app(wanted: tuple[str, ...] | None = None) -> typer.Typer:
    """The whole command, or with `wanted` (the words typed) only as much of it as that takes."""
    app = typer.Typer(
        cls=CleanErrors, name="kr5", help="Calibrate, check and diagnose a robot cell.", no_args_is_help=True,
        rich_markup_mode="rich", pretty_exceptions_show_locals=False,
    )
    app.callback()(_root)
    for name, entry in COMMANDS.items():
        if isinstance(entry, str):
            _add(app, (name,), entry, wanted is None or wanted[:1] == (name,))
            continue
        group = typer.Typer(help=GROUP_HELP[name], no_args_is_help=True)
        group.callback()(lambda: None)
        for child, text in entry.items():
            _add(group, (name, child), text, wanted is None or wanted[:2] == (name, child))
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


def __getattr__(name: str):
    if name == "app":
        return make_app()
    raise AttributeError(name)


def main() -> None:
    """Entry point of the command `kr5`."""
    completing = any(key.endswith("_COMPLETE") for key in os.environ)
    words = tuple(word for word in sys.argv[1:] if not word.startswith("-"))
    make_app(None if completing else words)(prog_name="kr5")
