"""The command of the bench."""

import json as json_module
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from . import baselines as plain
from . import diagnosis_runs as runner
from .generate import draw_sealed_cell, join_seal, plan_cells, read_seal
from .job_pool import errors, run_jobs
from .score import load_scores, score_all
from .score_tables import draw_figures, print_tables

app = typer.Typer(
    help="Blind check of `kr5 gap diagnose`: draw cells, diagnose their recordings, open the seal and count.",
    no_args_is_help=True,
)

Folder = Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of the check: recordings, fresh, results.")]
Seal = Annotated[
    Path | None, typer.Option(help="Where the labels are sealed; default: beside the folder, with .seal at the end.")
]
Cells = Annotated[int, typer.Option(help="How many cells.")]
Seed = Annotated[int, typer.Option(help="Of all that is drawn.")]
Small = Annotated[bool, typer.Option("--small", help="Short recordings, for a quick look.")]
Faint = Annotated[bool, typer.Option("--faint", help="Single effects of 0.02 to 0.5 noise only: where detection ends.")]
Effects = Annotated[
    int, typer.Option(min=0, max=12, help="Effects on every cell, each of 1.5 noise or more; 0: mixed.")
]
Jobs = Annotated[int | None, typer.Option(help="Processes at a time; default: one a core.")]
Scheduler = Annotated[str | None, typer.Option(help="Address of a Dask scheduler that sees the same folders.")]
Command = Annotated[str, typer.Option(help="What diagnoses {recording} into {json} and writes the {cell}.")]
Measure = Annotated[str, typer.Option(help="What measures a {cell} on a {recording} into {json}; empty: nothing does.")]
Again = Annotated[bool, typer.Option("--again", help="Diagnose also what is diagnosed.")]
Limit = Annotated[float, typer.Option(help="Longest a diagnosis may take [s].")]
Baselines = Annotated[int, typer.Option(help="How many recordings the plain methods are tried on.")]
Json = Annotated[Path | None, typer.Option("--json", help="Write all figures here.")]


def seal_of(folder: Path, seal: Path | None) -> Path:
    return seal or folder.with_name(folder.name + ".seal")


def check_seal(seal: Path, cells: int, about: dict) -> None:
    """What is sealed already must be what is asked for."""
    old = {"faint": False, "effects": 0} | read_seal(seal)
    if {"cells": len(old["cells"])} | {k: old[k] for k in about} != {"cells": cells} | about:
        kind = f"small: {old['small']}, faint: {old['faint']}, effects: {old['effects']}"
        text = f"{seal} seals {len(old['cells'])} cells of seed {old['seed']}, {kind}; choose another folder"
        raise typer.BadParameter(text, param_hint="--seed")


@app.command()
def generate(
    folder: Folder,
    cells: Cells = 400,
    seed: Seed = 1,
    small: Small = False,
    faint: Faint = False,
    effects: Effects = 0,
    seal: Seal = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
) -> None:
    """Draws cells and records them; picks up where it stopped. Example: python -m blind_check generate /data/check
    --cells 400 --seed 7"""
    if faint and effects:
        raise typer.BadParameter("--faint draws single effects: leave out one of the two", param_hint="--effects")
    about = {"seed": seed, "small": small, "faint": faint, "effects": effects}
    at, planned = seal_of(folder, seal), plan_cells(cells, seed, small, faint, effects)
    if at.resolve().is_relative_to(folder.resolve()):
        raise typer.BadParameter(
            f"{at} lies inside {folder}, which the diagnosis may read; choose another place", param_hint="--seal"
        )
    if at.exists():
        check_seal(at, cells, about)
        return
    parts = at.with_name(
        at.name + f".{cells}-{seed}{'-small' * small}{'-faint' * faint}{f'-{effects}-effects' if effects else ''}"
    )  # labels of the cells that are done, until all are
    run_jobs(
        draw_sealed_cell,
        [(parts, folder.resolve(), *p) for p in planned if not (parts / p[0]).exists()],
        "recording",
        jobs,
        scheduler,
    )
    join_seal(parts, at, about)


@app.command()
def run(
    folder: Folder,
    command: Command = runner.DIAGNOSE,
    measure: Measure = runner.MEASURE,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    limit: Limit = 600.0,
    again: Again = False,
) -> None:
    """Diagnoses what is not diagnosed yet. Example: python -m blind_check run /data/check --jobs 2"""
    failed = runner.diagnose_all(
        folder.resolve(), folder.resolve() / "results" / "kr5", command, measure, jobs, scheduler, limit, again
    )
    if failed:
        errors.print(
            f"[yellow]{failed} diagnoses failed[/yellow]; what they said stands in {folder}/results/kr5/*/diagnose.log"
        )


@app.command()
def baselines(folder: Folder, count: Baselines = 100, jobs: Jobs = None, scheduler: Scheduler = None) -> None:
    """Tries the plain methods. Example: python -m blind_check baselines /data/check --count 100"""
    names = sorted(p for p in (folder / "recordings").iterdir())[:count]
    todo = [p for p in names if not (folder / "results" / "nearest" / p.name / runner.DONE).exists()]
    run_jobs(
        plain.diagnose_one,
        [(p.resolve(), folder.resolve() / "results") for p in todo],
        "plain methods",
        jobs,
        scheduler,
    )


@app.command("score")
def score_command(folder: Folder, seal: Seal = None, json: Json = None) -> None:
    """Opens the seal and counts. Example: python -m blind_check score /data/check --json figures.json"""
    judged, results = {}, folder / "results"
    methods = [m for m in ("kr5", *plain.METHODS) if (results / m).is_dir()]
    for method in methods:
        cells = load_scores(seal_of(folder, seal), results / method)
        judged[method] = [c for c in cells if c.seconds is not None]
        if len(judged[method]) < len(cells):
            errors.print(
                f"{method}: {len(cells) - len(judged[method])} of {len(cells)} recordings were not tried, and are not"
                " counted"
            )
    if not any(judged.values()):
        raise typer.BadParameter(f"{results}: nothing diagnosed there; run `python -m blind_check run {folder}` first")
    scores = {method: score_all(cells) for method, cells in judged.items() if cells}
    console = Console(highlight=False)
    print_tables(scores, console if console.is_terminal else Console(highlight=False, width=60 + 24 * len(scores)))
    for picture in draw_figures(scores, judged, folder / "score"):
        errors.print(f"written: {picture}")
    if json:
        json.write_text(json_module.dumps(scores, indent=1))


@app.command("all")
def run_all(
    folder: Folder,
    cells: Cells = 400,
    seed: Seed = 1,
    small: Small = False,
    faint: Faint = False,
    effects: Effects = 0,
    seal: Seal = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    command: Command = runner.DIAGNOSE,
    measure: Measure = runner.MEASURE,
    limit: Limit = 600.0,
    count: Annotated[
        int, typer.Option("--baselines", help="How many recordings the plain methods are tried on.")
    ] = 100,
    json: Json = None,
) -> None:
    """Draws, diagnoses, counts. Example: python -m blind_check all /data/check --cells 400 --seed 7"""
    generate(folder, cells, seed, small, faint, effects, seal, jobs, scheduler)
    run(folder, command, measure, jobs, scheduler, limit)
    if count:
        baselines(folder, count, jobs, scheduler)
    score_command(folder, seal, json)


def main() -> None:
    app()
