"""`kr5 recording`: logs of a real cell, turned into recordings."""

from pathlib import Path
from typing import Annotated, Any

import typer

from . import common
from .recording_map import EXAMPLE, KEYS

app = typer.Typer(no_args_is_help=True)

LogFile = Annotated[Path, typer.Argument(metavar="LOG", help="The log: CSV (also ; or tabs between columns), NPZ or MCAP.")]


def _as_lines(text: str) -> str:
    """One paragraph a line, since help joins lines."""
    return "\n\n".join(line.replace("  ", "\u00a0\u00a0").replace("[", "\\[") for line in text.splitlines())


EPILOG = (f"Example: kr5 recording import monday.csv --map monday.yaml -o monday, where monday.yaml says:\n\n{_as_lines(EXAMPLE)}\n\n"
          f"All keys:\n\n{_as_lines(KEYS)}")

REMEDIES = {"t": "rows are spaced evenly with resample: {every: SECONDS} in the map; the cycle stands in servo.cycle of the cell"}


@app.callback()
def recording() -> None:
    """Turn a log of a real cell into a recording, which `kr5 gap` and `kr5 replay` read."""


@app.command("import", epilog=EPILOG)
def import_log(
    log: LogFile,
    map_file: Annotated[Path, typer.Option("--map", metavar="MAP.yaml", help="What the columns of the log mean (kr5-map/1).")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FOLDER", help="Where the recording goes; must not be there yet.")],
    trust: Annotated[bool, typer.Option("--trust", help="Write the recording although numbers look wrong.")] = False,
    json_file: common.Json = None,
) -> None:
    """Reads columns, units, frames and clock as the map names them, and holds the numbers against the cell.

    Refused are logs with missing numbers, gaps or time that goes back, unless the map says what to do about them. Numbers that only
    make sense in another unit, on the other side of the gears or in another column are named with the remedy; `--trust` writes the
    recording nevertheless.
    """
    import kr5.cell

    if output.exists() and (not output.is_dir() or any(output.iterdir())):
        common.fail(f"{output}: is there already; expected a new or empty folder, so that no recording is lost")
    found, notes, doubts = read(log, map_file)
    for doubt in doubts:
        common.errors.print(("[yellow]doubt:[/yellow] " if trust else "[red]error:[/red] ") + _plain(doubt.text()), soft_wrap=True)
    if doubts and not trust:
        common.errors.print("Nothing was written. Mend the map, or write the recording as it is with --trust.", soft_wrap=True)
        raise typer.Exit(2)
    kr5.cell.save_recording(found, output)
    rows = [[e.name, str(e.kind), str(e.split), len(e.data)] for e in found.experiments]
    data = {"folder": str(output), "log": str(log), "map": str(map_file), "notes": notes, "doubts": [vars(d) for d in doubts],
            "experiments": [dict(zip(("name", "kind", "split", "rows"), r)) for r in rows]}
    common.write_json(data, output / "import.json")
    to = common.console(json_file)
    table = common.table(f"Recording {output}", ["experiment", "kind", "split", "rows"], rows)
    for column in (1, 2):
        table.columns[column].justify = "left"
    to.print(table)
    for note in notes:
        to.print(f"Note: {note}.", soft_wrap=True, markup=False)
    common.write_json(data, json_file)


def read(log: Path, map_file: Path) -> tuple[Any, list[str], list[Any]]:
    """The recording, what was done to its numbers, and what speaks against them."""
    import kr5.cell

    from .recording_build import Importer
    from .recording_doubts import Doubt, doubts
    from .recording_map import load

    importer = Importer(load(map_file), log)
    with common.working(f"reading {log}"):
        experiments = [importer.experiment(e) for e in importer.map.experiments]
    recording = kr5.cell.Recording(importer.cell, experiments)
    with common.working("comparing with the cell"):
        found = [d for e in experiments for d in doubts(importer.cell, e)]
    if not found:
        found = [Doubt(Path(p.file).stem, p.field or "table", p.found, p.expected, REMEDIES.get(p.field, "look at this column in the map"))
                 for p in kr5.cell.check(recording)]
    return recording, importer.notes, found


@app.command(epilog="Example: kr5 recording guess monday.csv --cell cell.yaml -o monday.yaml")
def guess(
    log: LogFile,
    cell: Annotated[Path, typer.Option("--cell", metavar="CELL.yaml", help="The cell that was recorded.")],
    output: Annotated[Path | None, typer.Option("-o", "--output", metavar="MAP.yaml", help="Write the map here.")] = None,
    json_file: common.Json = None,
) -> None:
    """Proposes a map for a log, from the names of its columns and the size of their numbers, to be looked at and mended."""
    import yaml

    from .recording_guess import propose

    found, reasons = propose(log, cell, output)
    text = yaml.safe_dump(found, sort_keys=False, width=110)
    to = common.console(json_file)
    to.print(common.table(f"What {log} seems to hold", ["what", "proposal", "because"], reasons))
    if output:
        common.write_text(text, output)
    else:
        to.print(text, markup=False)
    common.write_json({"map": found, "reasons": [dict(zip(("what", "proposal", "because"), r)) for r in reasons]}, json_file)


def _plain(text: str) -> str:
    from rich.markup import escape

    return escape(text)
