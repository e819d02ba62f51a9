"""`kr5 job`: the state machine of the work from bin to tube, its journal, and the release of a stop."""

from pathlib import Path
from typing import Annotated, Literal

import typer
from kr5.files import writing

from kr5_tools.cli import arguments, tables, terminal

app = typer.Typer(no_args_is_help=True)

JournalFile = Annotated[Path, typer.Argument(metavar="JOURNAL", help="Journal of a job, which no program has open.")]


@app.callback()
def job_group() -> None:
    """Jobs from bin to tube: state machine, journal, release of a stop."""


@app.command(epilog="Example: kr5 job phases --form graphviz -o phases.dot")
def phases(
    form: Annotated[Literal["mermaid", "graphviz"], typer.Option(help="Form of the diagram.")] = "mermaid",
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="File to write; default: standard output.")
    ] = None,
    json_file: arguments.JsonOption = None,
) -> None:
    """Diagram of the state machine, from the table that the supervisor runs by: limits and exits of each phase."""
    from kr5 import job

    from kr5_tools.work.diagram import FORMS

    writing.check_writable(output, json_file)
    table = job.usual_phases()
    text = FORMS[form](table)
    if output:
        writing.write_text(text, output)
    else:
        terminal.console(json_file).print(text, end="", soft_wrap=True, markup=False)
    writing.write_json(table.to_dict(), json_file)


@app.command(epilog="Example: kr5 job show monday.db")
def show(file: JournalFile, json_file: arguments.JsonOption = None) -> None:
    """How a job stands by its journal: pellets, times by phase, success by attempt, stop."""
    from kr5 import job

    from kr5_tools.work import journal_tables

    writing.check_writable(json_file, inputs=[file])
    journal = job.Journal(file, job.journal_job(file))
    statistics = job.job_statistics(journal.records())
    to = terminal.console(json_file)
    to.print(journal_tables.standing(journal), style="bold", soft_wrap=True, markup=False)
    if statistics.pellets:
        rows = journal_tables.pellet_rows(statistics)
        to.print(tables.make_table("\nPellets", journal_tables.PELLET_COLUMNS, rows, text=(1,)))
    if statistics.phases:
        to.print(tables.make_table("\nPhases", journal_tables.PHASE_COLUMNS, journal_tables.phase_rows(statistics)))
    if statistics.attempts:
        rows = journal_tables.attempt_rows(statistics)
        to.print(tables.make_table("\nAttempts to insert", journal_tables.ATTEMPT_COLUMNS, rows))
    writing.write_json(journal_tables.as_dict(journal, statistics), json_file)


@app.command(epilog='Example: kr5 job release monday.db --person "Ada Lovelace"')
def release(
    file: JournalFile,
    person: Annotated[str, typer.Option(metavar="NAME", help="Who releases the stop, and has seen why it came.")],
) -> None:
    """Releases the stop of a job, so that it may go on; the journal keeps the name.

    Nothing moves by this: the job goes on when it is started again.
    """
    from kr5 import job

    journal = job.Journal(file, job.journal_job(file))
    stop = journal.belief().stop
    journal.release(person)
    terminal.console().print(f"{file}: the stop by {str(stop).replace('_', ' ')} is released.", markup=False)
