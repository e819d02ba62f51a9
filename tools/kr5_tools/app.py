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

PACKAGE = "kr5_tools"
_said_stopped = False
# The module of each command and what `kr5 --help` says of it. A module has `app`, a typer.Typer: with one command and
# no callback it is that command, otherwise a group of commands.
Entry = tuple[str, str]
COMMANDS: dict[str, Entry | dict[str, Entry]] = {
    "demo": ("demo", "Demonstration of the main commands on data with known truth."),
    "cell": ("cell.command", "Cells and recordings: check, tables, drawings, URDF."),
    "dataset": ("dataset.command", "Description of a folder of images and robot poses."),
    "detect": ("targets.detect", "Detection of targets in images."),
    "target": ("targets.command", "Targets to print, and their points."),
    "render": ("targets.render", "Rendered image of targets with known truth."),
    "calibrate": {
        "camera": ("calibrate.camera", "Camera: lens and sensor, from images of a target."),
        "hand-eye": ("calibrate.hand_eye", "Hand-eye: pose of the camera on the flange or in the base."),
        "cell": ("calibrate.cell", "Camera, hand-eye, marker map, arm and line scanner in one solve."),
        "tool": ("calibrate.tool", "Tool centre point in the flange frame."),
        "kinematics": ("calibrate.kinematics", "Arm: DH parameters, from measured postures."),
        "postures": ("calibrate.posture_plan", "Postures to measure for a calibration of the arm."),
        "laser": ("calibrate.laser", "Line scanner on the flange, from profiles of a tip, spheres or planes."),
        "laser-study": ("calibrate.laser_study", "Error of a scanner against stand-off and scanning speed."),
        "map": ("calibrate.marker_map", "Marker map: poses of markers relative to each other."),
        "timed": ("calibrate.timed", "Hand-eye from pose streams with two clocks."),
    },
    "identify": {
        "axes": ("identify.axes", "Joint axes and DH parameters, from joints moved one at a time."),
        "gravity": ("identify.gravity", "Gravity model from slow motions; current limits of passive compliance."),
        "excitation": ("identify.excitation", "Exciting motion for the identification of an arm's dynamics."),
        "drives": ("identify.drives", "Structure matrix, gear ratios and couplings, from encoders and joint angles."),
        "elasticity": ("identify.elasticity", "Stiffness and play of the gears, from angles on both sides of them."),
        "dynamics": ("identify.dynamics", "Dynamic parameters and friction, from a motion with currents or torques."),
        "payload": ("identify.payload", "Load at the flange, from motions with it and without."),
        "study": ("identify.study", "Noise study of the identification of joint axes: devices, noises, arcs."),
        "servo": ("identify.servo", "Servo of the path correction or of joints, from a response."),
        "servos": ("identify.servos", "Torque servos, friction and inertias of all joints, from commands."),
        "contact": ("identify.contact", "Stiffness of a contact, and the force loop on it."),
        "force-torque": ("identify.force_torque", "Force sensor and the tool below it."),
    },
    "bin": {
        "empty": ("picking.empty", "Simulated bin emptied pick by pick, with a picture of every decision."),
        "simulate": ("picking.simulate", "Simulated bin of cylinders with scan, picture and truth."),
    },
    "repeatability": ("repeatability.command", "Pose repeatability and accuracy after ISO 9283."),
    "workspace": ("workspace.command", "Workspace of an arm: reach and manipulability."),
    "record": ("simulation.record", "Recording of a simulated cell."),
    "recording": ("recording.command", "Recordings from logs of a real cell."),
    "job": ("work.command", "Jobs from bin to tube: state machine, journal, release of a stop."),
    "insert": ("insertion.command", "Simulated insertion of a peg into a tube."),
    "sweep": {
        "insertion": ("sweep.command", "Insertions over tilts and clearances: success rates and times."),
    },
    "sensitivity": ("sensitivity.command", "Sensitivity of a model or an arm: Sobol's indices with intervals."),
    "uncertainty": ("uncertainty.command", "Uncertainty through chains of poses, of camera, scanner and both fused."),
    "pick": ("picking.pick", "Poses of the cylinders in a scanned bin, and the order to pick them."),
    "run": ("work.run", "The job from bin to tube in a simulated cell, with journal and restart."),
    "rsi": ("rsi.command", "KUKA controllers over the RobotSensorInterface."),
    "scene": ("simulation.scene", "Scenes in DART with expected results."),
    "gap": ("gap.command", "Gap between simulation and recording: measurement, causes, next experiment."),
    "replay": ("simulation.replay", "Page with a recording or a protocol in 3D and its signals."),
    "report": ("report.command", "Self-contained page of a result file."),
}
GROUP_HELP = {
    "bin": "Simulated bins of cylinders.",
    "calibrate": "Calibrations with uncertainty and verdict.",
    "identify": "Identification of an arm: axes, dynamics, drives, servos, sensors and contacts.",
    "sweep": "Many simulated runs over a grid of conditions.",
}


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


def _add(parent: typer.Typer, name: str, entry: Entry, load: bool) -> None:
    """Adds one command; unless it is to be loaded, a stand-in that has nothing but the help text."""
    module, text = entry
    if not load:
        parent.command(name, help=text)(lambda: None)
        return
    app = importlib.import_module(f"{PACKAGE}.{module}").app
    for command in app.registered_commands:
        command.help = join_lines(command.help or command.callback.__doc__ or "")
    if len(app.registered_commands) == 1 and app.registered_callback is None and not app.registered_groups:
        info = app.registered_commands[0]
        info.name = name
        parent.registered_commands.append(info)
    else:
        parent.add_typer(app, name=name, help=text, no_args_is_help=True)


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
        if isinstance(entry, tuple):
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
    """Entry point of the command `kr5`."""
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
