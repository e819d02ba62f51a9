"""`kr5 run`: the whole job from bin to tube in a simulated cell."""

import contextlib
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from kr5.files import writing

from kr5_tools.cli import arguments, tables, terminal
from kr5_tools.cli.interruption import tell_when_stopped

if TYPE_CHECKING:
    import kr5.cell
    import kr5.job
    import kr5.sim
    import kr5.work

    from kr5_tools.work.job_cell import JobSetup
    from kr5_tools.work.live_view import LiveView

app = typer.Typer()

PAGE = Path("job.html")


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
        Literal["nominal", "usual", "severe"],
        typer.Option(
            help="Cell as its controller is told, or off by errors that the controller does not know: the usual ones,"
            " or severe ones of servo, friction, radii and force sensor, too."
        ),
    ] = "usual",
    clearance: Annotated[
        float | None,
        typer.Option(
            metavar="MM",
            help="Clearance: radius of the bore less nominal radius of the pellets \\[mm].",
            show_default="0.28",
        ),
    ] = None,
    tilt: Annotated[
        float | None,
        typer.Option(
            metavar="DEG", help="Tilt of a pellet while it is rolled around the tube \\[deg].", show_default="15"
        ),
    ] = None,
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
        Literal["krc2", "krc4_rsi3", "krc4", "krc5", "iiqka"] | None,
        typer.Option(help="That controller.", show_default="krc4"),
    ] = None,
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
    view: Annotated[
        bool,
        typer.Option(
            "--view",
            help=f"Show the job as it runs, then its page ({PAGE} unless --report names another), where there is a"
            " screen.",
        ),
    ] = False,
    report: Annotated[
        Path | None,
        typer.Option(metavar="PAGE.html", help="Page with a 3D replay, time line, forces and attempts by pellet."),
    ] = None,
    log: Annotated[
        Path | None,
        typer.Option(
            "--log",
            metavar="FILE",
            help="Log of positions and currents of the joints, for `kr5 gap diagnose`: FILE.csv or FILE.mcap.",
        ),
    ] = None,
    png: arguments.PngOption = None,
    json_file: arguments.JsonOption = None,
) -> None:
    """The job from bin to tube in a simulated cell: scan, pick, put upright, regrip, find the tube, search, insert.

    The controller knows what its sensors tell; what really happened is judged at the end. Ctrl-C ends the program, not
    the job: with --journal the same command goes on where it was. A tube that is too shallow for all pellets is made
    deeper. Exit code 1 when a pellet is not inserted or the job has stopped, 2 for bad input.
    """
    import kr5.work
    from kr5.logs.row_log import check_ending

    from kr5_tools.insertion.task import load_cell
    from kr5_tools.work import direct_run, job_output, job_tables, linked_run
    from kr5_tools.work.job_cell import kept_cell, make_cell, make_setup, work_options

    _check_options(
        through_rsi,
        {"--controller": controller, "--port": port},
        faults,
        [journal_file, report, view or None, log, png, tilt],
    )
    report = report or (PAGE if view else None)
    writing.check_writable(report, log, json_file, inputs=[cell_file, journal_file])
    writing.check_writable(journal_file, inputs=[cell_file])
    writing.check_page(report)
    check_ending(log)
    given, source = load_cell(cell_file)
    setup = make_setup(pellets, seed, errors, clearance, tilt)
    if faults is not None:
        return _try_faults(given, setup, faults, json_file)
    with terminal.spinner("pouring"):
        cell = make_cell(given, setup)
    options = work_options(cell, setup)
    to = terminal.console(json_file)
    with _journal(journal_file, setup.job_id(given)) as (journal, file), _live(view, cell, pellets, source) as live:
        tell_when_stopped(lambda: _kept_text(journal, file))
        _place(cell, options, journal, file)
        seen, link = _seen(stand, in_tube), None
        if through_rsi:
            linked = linked_run.make_options(options, cell, controller or "krc4", port)
            linked_job = kr5.work.LinkedJob(cell, options, linked, journal, seen, kept_cell(file))
            tell_real_time(linked_job)
            _open(live if linked_job.runs else None, to)
            link = linked_run.work(linked_job, pellets, file, live)
            done = link.job
        else:
            runner = kr5.work.JobRunner(cell, options, journal, seen, kept_cell(file))
            _open(live if runner.runs else None, to)
            done = direct_run.work(runner, cell, pellets, file, live)
        truth, records = kr5.work.judge_job(cell), journal.records()
        good = done.done and truth.in_tube >= pellets
        if live:
            live.end("good" if good else "unusable", job_tables.ending_text(done, pellets, journal_file))
    job_output.print_job(done, truth, pellets, journal_file, to)
    if link is not None:
        linked_run.print_link(link, linked.layout, to)
    told: list[str] = []
    if len(done.rows) >= 2:
        told += [job_output.write_log(done, log)] if log else []
        told += [job_output.write_plots(done, records, link, png)] if png else []
        told += [job_output.write_page(done, truth, records, cell, setup, source, link, report)] if report else []
    elif report or log or png:
        terminal.print_note("no motion, hence neither page, log nor plots.")
    writing.write_json(job_tables.as_dict(setup.job_id(given), setup, done, truth, records, link), json_file)
    job_output.publish(told, to)
    terminal.open_page(report if view and told else None)
    if not good:
        raise typer.Exit(1)


def _check_options(through_rsi: bool, of_link: dict[str, object], faults: int | None, of_job: list[object]) -> None:
    """Complains of options that would do nothing."""
    if faults is not None and (not through_rsi or any(value is not None for value in of_job)):
        terminal.fail("--faults: needs --through-rsi, and has neither journal, report, view, log, plots nor tilt")
    for name in (name for name, value in of_link.items() if value is not None):
        if not through_rsi:
            terminal.fail(f"{name}: belongs to a link; add --through-rsi, or leave it out")
        if faults is not None:
            terminal.fail(f"{name}: faults are tried in lock step with a KR C4, without sockets; leave it out")


def tell_real_time(linked_job: "kr5.work.LinkedJob") -> None:
    """What the kernel did not give to the thread of the link, and how it is permitted."""
    from kr5 import rsi

    for remedy in rsi.real_time_remedies(linked_job.real_time):
        terminal.print_note(remedy)


@contextlib.contextmanager
def _live(wanted: bool, cell: "kr5.sim.WorkCell", pellets: int, source: Path) -> "Iterator[LiveView | None]":
    """The view of a job as it runs."""
    if not wanted:
        yield None
        return
    from kr5_tools.work.live_view import LiveView, live_page

    with terminal.spinner("drawing"):
        page = live_page(cell, pellets, source)
    with LiveView(page) as live:
        yield live


def _open(live: "LiveView | None", to: terminal.Console) -> None:
    """Tells where the view is, and opens it beside the job, which does not wait for a browser."""
    if live:
        to.print(f"The job as it runs: {live.address}", soft_wrap=True, markup=False)
        threading.Thread(target=terminal.open_address, args=(live.address,), daemon=True).start()


def _kept_text(journal: "kr5.job.Journal", file: Path | None) -> str:
    """What a job that Ctrl-C has ended leaves."""
    from kr5 import job

    from kr5_tools.work.remedies import release_command, words

    if file is None:
        return "the job is gone with the program: with --journal it goes on where it was"
    if (stop := journal.belief().stop) != job.StopReason.None_:
        return (
            f"the journal {file} keeps the stop by {words(stop)}. Release it with {release_command(file)}, and start"
            " the same command"
        )
    return f"the journal {file} keeps the job: the same command goes on where it was"


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
