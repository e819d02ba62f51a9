"""`kr5 recording`: logs of a real cell, turned into recordings."""

from pathlib import Path
from typing import Annotated

import typer
from kr5.files import writing
from kr5.logs.column_list import names_in_order
from kr5.logs.importer import Readings, import_recording
from kr5.logs.log_file import LOG_FORMATS
from kr5.logs.map_file import EXAMPLE

from kr5_tools.cli import arguments, tables, terminal
from kr5_tools.cli.table_options import ColumnsOption, EpisodesOption

app = typer.Typer(no_args_is_help=True)

LogFile = Annotated[
    Path | None,
    typer.Argument(
        metavar="[LOG]", help=f"The log: {LOG_FORMATS}. Omitted where the map names the log of each experiment."
    ),
]


def _as_lines(text: str) -> str:
    """The lines of an example as help shows them, with brackets that are no markup."""
    return "\n".join(line.replace("[", "\\[") for line in text.splitlines())


EPILOG = (
    "Example: kr5 recording import monday.csv --map monday.yaml -o monday, where monday.yaml"
    f" says:\n\n{_as_lines(EXAMPLE)}\n\nAll keys: share/doc/formats/map.md of the guide."
)


@app.callback()
def recording() -> None:
    """Recordings from logs of a real cell, for `kr5 gap` and `kr5 replay`."""


@app.command("import", epilog=EPILOG)
def import_log(
    map_file: Annotated[
        Path, typer.Option("--map", metavar="MAP.yaml", help="Map of the columns of the log (kr5-map/1).")
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FOLDER", help="Folder of the recording; must not exist yet.")
    ],
    log: LogFile = None,
    columns: ColumnsOption = None,
    episodes: EpisodesOption = "",
    trust: Annotated[
        bool, typer.Option("--trust", help="Write the recording although some numbers are implausible.")
    ] = False,
    json_file: arguments.JsonOption = None,
) -> None:
    """Recording from a log: columns, units, frames and clock as the map defines them, checked against the cell.

    Logs with missing numbers, gaps or decreasing time are refused, unless the map says how to handle them. Numbers
    that are plausible only in another unit, on the other side of the gears or in another column are reported with a
    remedy; `--trust` writes the recording nevertheless.
    """
    import kr5.cell
    from kr5 import arm_log

    writing.check_new_folder(output)
    writing.check_writable(json_file, inputs=[*([log] if log else []), map_file])
    noise: list[str] = []

    def add_noise(recording: kr5.cell.Recording, readings: Readings) -> None:
        recording.cell, notes = arm_log.with_reading_noise(recording, readings)
        noise.extend(note.text(recording.cell) for note in notes)

    with terminal.spinner(f"Reading {log or map_file}"):
        found, notes, problems = import_recording(log, map_file, add_noise, columns=columns, episodes=episodes)
    if problems and not trust:
        remedy = "nothing was written; correct the map, or write the recording as it is with --trust"
        terminal.fail(*(problem.text() for problem in problems), remedy)
    for problem in problems:
        terminal.print_warning(problem.text())
    notes += noise
    rows = [[e.name, str(e.kind), str(e.split), len(e.data)] for e in found.experiments]
    data = {
        "folder": str(output),
        "log": str(log) if log else None,
        "map": str(map_file),
        "notes": notes,
        "problems": [vars(p) for p in problems],
        "experiments": [dict(zip(("name", "kind", "split", "rows"), r)) for r in rows],
    }
    with writing.folder_beside(output) as new:
        kr5.cell.save_recording(found, new)
        writing.write_json(data, new / "import.json")
    to = terminal.console(json_file)
    heads = ["experiment", "kind", "split", "rows"]
    to.print(tables.make_table(f"Recording {output}", heads, rows, text=(1, 2)))
    for note in notes:
        to.print(f"Note: {note}.", soft_wrap=True, markup=False)
    writing.write_json(data, json_file)


@app.command(epilog="Example: kr5 recording guess monday.csv --cell cell.yaml -o monday.yaml")
def guess(
    logs: Annotated[list[Path], typer.Argument(metavar="LOG...", help=f"Logs of the cell: {LOG_FORMATS}.")],
    cell: Annotated[Path, typer.Option("--cell", metavar="CELL.yaml", help="Cell file of the recorded cell.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="MAP.yaml", help="Map file to write.")
    ] = None,
    every: arguments.EveryOption = None,
    columns: ColumnsOption = None,
    episodes: EpisodesOption = "",
    json_file: arguments.JsonOption = None,
) -> None:
    """Proposal of a map for logs, from the names of their columns and the size of their numbers; to be checked and
    corrected.

    `kr5 gap diagnose LOG --model MODEL` makes and uses the same map without a file.
    """
    import kr5.cell
    import yaml
    from kr5.logs.map_guess import guess_map
    from kr5.logs.overrides import GivenEntries

    writing.check_writable(output, json_file, inputs=[*logs, cell])
    if cell.suffix.lower() in (".urdf", ".xml", ".mjcf", ".xacro"):
        terminal.fail(f"{cell}: found a description of a robot, expected a cell file; kr5 cell import {cell} makes one")
    header = names_in_order(columns) if columns else None
    given = GivenEntries(clock={"every": every} if every else {}, header=header, episodes=episodes)
    guessed = guess_map(logs, kr5.cell.load_cell(cell), cell, output, given)
    guessed.entry |= {"header": header} if header else {}
    text = yaml.safe_dump(guessed.entry, sort_keys=False, width=110)
    to = terminal.console(json_file)
    named = ", ".join(map(str, logs))
    to.print(tables.make_table(f"Proposal for {named}", ["item", "proposal", "reason"], guessed.told(), text=(1, 2)))
    for note in guessed.notes:
        to.print(f"Note: {note}.", soft_wrap=True, markup=False)
    if output:
        writing.write_text(text, output)
    else:
        to.print(text, markup=False)
    reasons = [dict(zip(("what", "proposal", "because"), r)) for r in guessed.told()]
    writing.write_json({"map": guessed.entry, "reasons": reasons, "notes": guessed.notes}, json_file)
