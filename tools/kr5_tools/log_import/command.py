"""`kr5 recording`: logs of a real cell, turned into recordings."""

from pathlib import Path
from typing import Annotated, Any

import typer

from kr5_tools.cli import arguments, tables, terminal
from kr5_tools.files import writing
from kr5_tools.log_import.map_file import EXAMPLE, KEYS

app = typer.Typer(no_args_is_help=True)

LogFile = Annotated[
    Path, typer.Argument(metavar="LOG", help="The log: CSV (also ; or tabs between columns), NPZ or MCAP.")
]


def _as_lines(text: str) -> str:
    """The lines of an example as help shows them: indented, and with brackets that are no markup."""
    return "\n".join(line.replace("  ", "\u00a0\u00a0").replace("[", "\\[") for line in text.splitlines())


EPILOG = (
    "Example: kr5 recording import monday.csv --map monday.yaml -o monday, where monday.yaml"
    f" says:\n\n{_as_lines(EXAMPLE)}\n\nAll keys:\n\n{_as_lines(KEYS)}"
)

REMEDIES = {
    "t": (
        "rows are spaced evenly with resample: {every: SECONDS} in the map; the cycle stands in servo.cycle of the cell"
    )
}


@app.callback()
def recording() -> None:
    """Recordings from logs of a real cell, for `kr5 gap` and `kr5 replay`."""


@app.command("import", epilog=EPILOG)
def import_log(
    log: LogFile,
    map_file: Annotated[
        Path, typer.Option("--map", metavar="MAP.yaml", help="Map of the columns of the log (kr5-map/1).")
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FOLDER", help="Folder of the recording; must not exist yet.")
    ],
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

    writing.check_new_folder(output)
    writing.check_writable(json_file, inputs=[log, map_file])
    found, notes, problems = import_recording(log, map_file)
    for problem in problems:
        terminal.print_problem(problem.text(), refused=not trust)
    if problems and not trust:
        terminal.errors.print(
            "Nothing was written. Correct the map, or write the recording as it is with --trust.", soft_wrap=True
        )
        raise typer.Exit(2)
    rows = [[e.name, str(e.kind), str(e.split), len(e.data)] for e in found.experiments]
    data = {
        "folder": str(output),
        "log": str(log),
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


def import_recording(log: Path, map_file: Path) -> tuple[Any, list[str], list[Any]]:
    """The recording, what was done to its numbers, and what speaks against them."""
    import kr5.cell

    from kr5_tools.log_import.importer import Importer
    from kr5_tools.log_import.log_checks import LogProblem, check_log
    from kr5_tools.log_import.map_file import load_map

    importer = Importer(load_map(map_file), log)
    with terminal.spinner(f"reading {log}"):
        experiments = [importer.experiment(e) for e in importer.map.experiments]
    recording = kr5.cell.Recording(importer.cell, experiments)
    with terminal.spinner("comparing with the cell"):
        found = [d for e in experiments for d in check_log(importer.cell, e)]
    if not found:
        found = [
            LogProblem(
                Path(p.file).stem,
                p.field or "table",
                p.found,
                p.expected,
                REMEDIES.get(p.field, "check this column in the map"),
            )
            for p in kr5.cell.check(recording)
        ]
    return recording, importer.notes, found


@app.command(epilog="Example: kr5 recording guess monday.csv --cell cell.yaml -o monday.yaml")
def guess(
    log: LogFile,
    cell: Annotated[Path, typer.Option("--cell", metavar="CELL.yaml", help="Cell file of the recorded cell.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="MAP.yaml", help="Map file to write.")
    ] = None,
    json_file: arguments.JsonOption = None,
) -> None:
    """Proposal of a map for a log, from the names of its columns and the size of their numbers; to be checked and
    corrected.
    """
    import yaml

    from kr5_tools.log_import.map_guess import guess_map

    writing.check_writable(output, json_file, inputs=[log, cell])
    found, reasons = guess_map(log, cell, output)
    text = yaml.safe_dump(found, sort_keys=False, width=110)
    to = terminal.console(json_file)
    to.print(tables.make_table(f"Proposal for {log}", ["item", "proposal", "reason"], reasons, text=(1, 2)))
    if output:
        writing.write_text(text, output)
    else:
        to.print(text, markup=False)
    writing.write_json(
        {"map": found, "reasons": [dict(zip(("what", "proposal", "because"), r)) for r in reasons]}, json_file
    )
