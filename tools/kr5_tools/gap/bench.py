"""`kr5 gap bench`: starts the blind check, a program of its own that never imports kr5."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import kr5
import typer


def find_bench() -> Path | None:
    """Folder that holds the package blind_check: beside this one, or in the checkout one stands in. It is not
    installed."""
    places = [Path(__file__).parents[2], *(p / "tools" for p in (Path.cwd(), *Path.cwd().parents))]
    return next((p for p in places if (p / "blind_check" / "__main__.py").exists()), None)


def bench(context: typer.Context) -> None:
    """Blind check: draws cells with known effects, diagnoses their recordings, and scores the diagnoses against the
    sealed truth.

    generate | run | baselines | score | all, each with --help.
    """
    place = find_bench()
    if place is None:
        raise kr5.InvalidArgument(
            "the blind check is not installed with kr5; run the command inside a checkout of"
            " the project, which has tools/blind_check"
        )
    if importlib.util.find_spec("pinocchio") is None:
        raise kr5.InvalidArgument("the blind check needs Pinocchio, which is not installed: pip install pin")
    path = os.pathsep.join(filter(None, (str(place), os.environ.get("PYTHONPATH"))))
    done = subprocess.run(
        [sys.executable, "-m", "blind_check", *(context.args or ["--help"])],
        check=False,
        env=os.environ | {"PYTHONPATH": path},
    )
    raise typer.Exit(done.returncode)


def add_to(app: typer.Typer) -> None:
    passed_on = {"allow_extra_args": True, "ignore_unknown_options": True, "help_option_names": []}
    example = "Example: kr5 gap bench all check --cells 400 --seed 7"
    app.command("bench", context_settings=passed_on, epilog=example)(bench)
