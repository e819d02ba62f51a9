"""`kr5 run`: the whole job from bin to tube in a simulated cell."""

import contextlib
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from kr5.files import writing

from kr5_tools.cli import arguments, tables, terminal

if TYPE_CHECKING:
    import kr5.cell
    import kr5.job
    import kr5.sim
    import kr5.work
    from rich.console import Console

    from kr5_tools.work.job_cell import JobSetup

app = typer.Typer()

CYCLES = 20  # between two looks at a job: Ctrl-C is heard, and the state of the cell written where records are new


@app.command(epilog="Example: kr5 run --pellets 3 --seed 7 --journal monday.db --report run.html")
def run(
    cell_file: Annotated[
        Path | None,
        typer.Argument(
            metavar="[CELL.yaml]",
            show_default=False,
            help="The cell, with tool, tube, camera and servo; by default the KR5 Arc that kr5 ships.",
        ),
    ] = None,
    pellets: Annotated[int, typer.Option(min=1, max=64, help="Number of pellets in the bin, all to be inserted.")] = 35,
    seed: Annotated[int, typer.Option(min=1, help="Random seed of pile, noise and errors.")] = 1,
    errors: Annotated[
        Literal["nominal", "usual"],
        typer.Option(help="Cell as its controller is told, or off by the usual errors, which the controller ignores."),
    ] = "usual",
    journal_file: Annotated[
        Path | None,
        typer.Option(
            "--journal", metavar="FILE.db", help="Journal of the job; an unfinished one goes on where it was."
        ),
    ] = None,
    stand: Annotated[
        Literal["full", "empty"] | None,
        typer.Option(help="What a person sees on the stand, where a job that goes on asks for it.", show_default=False),
    ] = None,
    in_tube: Annotated[
        int | None,
        typer.Option(min=0, help="Number of pellets that a person counts in the tube, likewise.", show_default=False),
    ] = None,
    through_rsi: Annotated[
        bool,
        typer.Option(
            "--through-rsi",
            help="In real time through an RSI link to an emulated KUKA controller; Ctrl-C stops the arm for a person.",
        ),
    ] = False,
    controller: Annotated[
        Literal["krc2", "krc4_rsi3", "krc4", "krc5", "iiqka"], typer.Option(help="That controller.")
    ] = "krc4",
    port: Annotated[
        int | None,
        typer.Option(min=1, max=65535, help="Port of the link on this computer.", show_default="49152"),
    ] = None,
    faults: Annotated[
        int | None,
        typer.Option(
            min=1,
            metavar="N",
            show_default=False,
            help="Instead of a job, with --through-rsi: each fault of link and controller N times during an insertion.",
        ),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(metavar="PAGE.html", help="Page with a 3D replay, time line, forces and attempts by pellet."),
    ] = None,
    json_file: arguments.JsonOption = None,
) -> None:
    """The job from bin to tube in a simulated cell: scan, pick, put upright, regrip, find the tube, search, insert.

    The controller knows what its sensors tell; what really happened is judged at the end. Ctrl-C ends the program, not
    the job: with --journal the same command goes on where it was. A tube that is too shallow for all pellets is made
    deeper. Exit code 1 when a pellet is not inserted or the job has stopped, 2 for bad input.
    """
    import kr5.work

    from kr5_tools.insertion.task import load_cell
    from kr5_tools.work import job_tables, linked_run
    from kr5_tools.work.job_cell import JobSetup, make_cell

    writing.check_writable(report, json_file, inputs=[cell_file, journal_file])
    writing.check_writable(journal_file, inputs=[cell_file])
    writing.check_page(report)
    if faults is not None and (not through_rsi or journal_file or report):
        terminal.fail("--faults: needs --through-rsi, and has neither journal nor report")
    given, source = load_cell(cell_file)
    setup = JobSetup(pellets, seed, errors)
    if faults is not None:
        return _try_faults(given, setup, faults, json_file)
    with terminal.spinner("pouring"):
        cell = make_cell(given, setup)
    options = kr5.work.work_options(cell)
    options.job.pellets = pellets
    with _journal(journal_file, setup.job_id(given)) as (journal, file):
        _place(cell, options, journal, file)
        seen, link = _seen(stand, in_tube), None
        if through_rsi:
            linked = linked_run.make_options(options, cell, controller, port)
            link = linked_run.work(kr5.work.LinkedJob(cell, options, linked, journal, seen), cell, pellets, file)
            done = link.job
        else:
            runner = kr5.work.JobRunner(cell, options, journal, seen)
            if runner.runs:
                _work(runner, cell, pellets, journal, file)
            done = runner.result()
        truth, records = kr5.work.judge_job(cell), journal.records()
    to = terminal.console(json_file)
    _print(done, truth, pellets, journal_file, to)
    if link is not None:
        linked_run.print_link(link, linked.layout, to)
    if report:
        _write_page(done, truth, records, cell, setup, source, report, to)
    writing.write_json(job_tables.as_dict(setup.job_id(given), done, truth, link), json_file)
    if not done.done or truth.in_tube < pellets:
        raise typer.Exit(1)


def _seen(stand: str | None, in_tube: int | None) -> "kr5.job.RestartMeasurements":
    from kr5 import job

    seen = job.RestartMeasurements()
    if stand is not None:
        seen.station = stand == "full"
    if in_tube is not None:
        seen.tube = in_tube
    return seen


@contextlib.contextmanager
def _journal(file: Path | None, job_id: str) -> Iterator[tuple["kr5.job.Journal", Path | None]]:
    """The journal given, or one that is gone with the program."""
    from kr5 import job

    if file is not None:
        yield job.Journal(file, job_id), file
        return
    with tempfile.TemporaryDirectory(prefix="kr5-") as folder:
        yield job.Journal(Path(folder) / "job.db", job_id), None


def _try_faults(given: "kr5.cell.Cell", setup: "JobSetup", trials: int, json_file: Path | None) -> None:
    """What each fault does to an insertion; exit code 1 where one does harm."""
    from kr5_tools.work import linked_run

    rows = linked_run.run_faults(given, setup, trials)
    to = terminal.console(json_file)
    to.print(tables.make_table("Faults during an insertion", linked_run.FAULT_COLUMNS, linked_run.fault_rows(rows)))
    writing.write_json([row.to_dict() for row in rows], json_file)
    if not linked_run.sound(rows):
        raise typer.Exit(1)


def _place(
    cell: "kr5.sim.WorkCell", options: "kr5.work.WorkOptions", journal: "kr5.job.Journal", file: Path | None
) -> None:
    """The arm stands where a new job begins, or the cell is as the job left it."""
    import kr5.work

    from kr5_tools.work.job_cell import restore_cell

    if file is not None and journal.last_number > 0:
        restore_cell(cell, file)
    else:
        kr5.work.place_over_bin(cell, options)


def _work(
    runner: "kr5.work.JobRunner",
    cell: "kr5.sim.WorkCell",
    pellets: int,
    journal: "kr5.job.Journal",
    file: Path | None,
) -> None:
    """Until the job ends, or the program; the state of the cell is never older than the last record."""
    from kr5_tools.work.job_cell import state_file
    from kr5_tools.work.remedies import words

    written = -1
    with terminal.progress_bar() as bar:
        task = bar.add_task("", total=pellets)
        try:
            while not runner.finished:
                runner.step(CYCLES)
                state = runner.state
                bar.update(task, completed=state.inserted, description=f"{words(state.phase)}, pellet {state.pellet}")
                if file is not None and journal.last_number != written:
                    written = journal.last_number
                    cell.state().save(state_file(file))
        finally:
            if file is not None:
                cell.state().save(state_file(file))


def _print(done: "kr5.work.JobRun", truth: "kr5.work.JobTruth", pellets: int, file: Path | None, to: "Console") -> None:
    """How the job stands, then its figures, then what is so."""
    from kr5_tools.work import job_tables, journal_tables

    to.print(job_tables.ending_text(done, pellets, file), style="bold", soft_wrap=True, markup=False)
    s = done.statistics
    if s.pellets:
        to.print(tables.make_table("\nPellets", job_tables.PELLET_COLUMNS, job_tables.pellet_rows(s), text=(1,)))
    if s.phases:
        to.print(tables.make_table("\nPhases", journal_tables.PHASE_COLUMNS, journal_tables.phase_rows(s)))
    if s.attempts:
        rows = journal_tables.attempt_rows(s)
        to.print(tables.make_table("\nAttempts to insert", journal_tables.ATTEMPT_COLUMNS, rows))
    to.print(f"\n{job_tables.truth_text(truth)}", soft_wrap=True, markup=False)


def _write_page(
    done: "kr5.work.JobRun",
    truth: "kr5.work.JobTruth",
    records: "list[kr5.job.JobRecord]",
    cell: "kr5.sim.WorkCell",
    setup: "JobSetup",
    source: Path,
    report: Path,
    to: "Console",
) -> None:
    if len(done.rows) < 2:
        terminal.print_note("no motion, hence no page.")
        return
    from kr5_tools.work.run_page import job_page

    with terminal.spinner("drawing"):
        writing.write_text(job_page(done, truth, records, cell, setup, source), report)
    to.print(f"{report}: open it in a browser.", soft_wrap=True, markup=False)
