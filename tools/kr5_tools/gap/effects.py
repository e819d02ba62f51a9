"""`kr5 gap effects`: the catalogue of effects, and a picture of what each does to a recording."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import kr5.cell
import typer
from kr5.files import writing
from kr5.files.paths import SHIPPED_CELL, find_shipped_cell

from kr5_tools.cli import arguments, tables, terminal
from kr5_tools.cli.numbers import NONE, format_count
from kr5_tools.cli.terminal import Console

Effect = Annotated[
    str | None, typer.Argument(metavar="EFFECT", help="Id of one effect, for its details; by default all are listed.")
]
CellFile = Annotated[
    Path | None,
    typer.Option(
        "--cell",
        metavar="CELL.yaml",
        help=f"Cell for targets, typical sizes and pictures; by default the KR5 Arc that kr5 ships ({SHIPPED_CELL}).",
    ),
]
Pictures = Annotated[
    Path | None,
    typer.Option(
        "--pictures",
        metavar="FOLDER",
        help="Folder for a picture of each effect: residuals of a simulated recording without and with it.",
    ),
]
PictureFormat = Annotated[
    Literal["png", "svg"], typer.Option("--format", metavar="png|svg", help="Format of the pictures.")
]


def add_to(app: typer.Typer) -> None:
    app.command("effects", epilog="Example: kr5 gap effects coulomb_friction --pictures effects --format svg")(effects)


def effects(
    effect: Effect = None,
    cell_file: CellFile = None,
    pictures: Pictures = None,
    picture_format: PictureFormat = "png",
    everything: arguments.AllOption = False,
    json_file: arguments.JsonOption = None,
) -> None:
    """List of the effects that a diagnosis tries: what each acts on, what differs, and where it shows; with --all also
    its parameters. Or the details of one effect."""
    writing.check_writable(json_file, inputs=[cell_file])
    rows = [kr5.cell.find_effect(effect)] if effect else kr5.cell.effect_catalogue()
    cell = load_cell(cell_file)
    found = [effect_dict(row, cell) for row in rows]
    to = terminal.console(json_file)
    if effect:
        print_effect(found[0], to)
    else:
        print_catalogue(found, to, everything)
    if pictures:
        from kr5_tools.gap.effect_pictures import write_effect_pictures

        writing.make_folder(pictures)
        files, unseen = write_effect_pictures([row.id for row in rows], cell, pictures, picture_format)
        to.print(f"\n{pictures}: {format_count(len(files), 'picture')}.", soft_wrap=True)
        if unseen:
            terminal.print_note(f"no picture of {', '.join(unseen)}: this cell cannot show it")
    writing.write_json(found if not effect else found[0], json_file)


def load_cell(file: Path | None) -> Any:
    """The cell that is named, else the shipped one, without its effects."""
    source = file or find_shipped_cell()
    if source is None:
        raise kr5.InvalidArgument(f"--cell: is missing, and there is no {SHIPPED_CELL} here; specify a cell")
    cell = kr5.cell.load_cell(source)
    cell.effects = {}
    return cell


def effect_dict(row: kr5.cell.Effect, cell: kr5.cell.Cell) -> dict[str, Any]:
    """A row of the catalogue, with the targets that the cell has for it and, on the first, typical values."""
    import kr5
    import kr5.gap

    targets = cell.effect_targets(row.id)
    typical: dict[str, Any] = {}
    if targets:
        try:
            changed = kr5.gap.with_typical_effect(cell, row.id, targets[0])
            typical = changed.effects.to_dict()[row.id][targets[0]]
        except kr5.InvalidArgument:  # the cell has the target, but not all that the effect acts on
            targets = []
    parameters = []
    for p in row.parameters:
        nominal = cell.nominal_value(row.id, targets[0], p.name, _choice(row, typical)) if targets else None
        parameters.append({**p.to_dict(), "nominal": nominal, "typical": typical.get(p.name)})
    keys = ("id", "label", "description", "shows_in", "remedy")
    return {
        **{key: getattr(row, key) for key in keys},
        "target": str(row.target),
        "targets": targets,
        "parameters": parameters,
    }


def _choice(row: kr5.cell.Effect, typical: dict[str, Any]) -> int:
    """The value of the parameter that is a discrete choice, in a typical effect."""
    name = next((p.name for p in row.parameters if str(p.coordinate) == "choice"), None)
    return int(typical.get(name, 0)) if name else 0


def print_catalogue(found: list[dict[str, Any]], to: Console, everything: bool = False) -> None:
    rows = []
    for e in found:
        row = [e["id"], e["target"].replace("_", " "), f"{e['description']}; shows in {e['shows_in']}"]
        if everything:
            row.append(", ".join(f"{p['name']} [{p['unit']}]" for p in e["parameters"]))
        rows.append(row)
    heads = ["effect", "on", "what differs, and where it shows", *(["parameters"] if everything else [])]
    to.print(tables.make_table(f"{len(found)} effects", heads, rows, text=range(len(heads))))
    to.print("\nkr5 gap effects EFFECT shows typical sizes, bounds and the remedy of one.", soft_wrap=True)


def print_effect(e: dict[str, Any], to: Console) -> None:
    from kr5_tools.gap_report.messages import capitalised

    to.print(f"{capitalised(e['label'])} ({e['id']})", style="bold", soft_wrap=True)
    to.print(f"  {capitalised(e['description'])}.", soft_wrap=True)
    to.print(f"  Shows in {e['shows_in']}.", soft_wrap=True)
    if e["remedy"]:
        to.print(f"  Remedy: {e['remedy'].replace('`', '')}", soft_wrap=True)
    targets = ", ".join(e["targets"])
    to.print(f"  Targets in this cell: {targets or 'none, because it lacks what the effect acts on'}.", soft_wrap=True)
    rows = [
        [
            p["name"],
            p["unit"],
            *(value_text(p["nominal" if p["nominal_when_off"] else "off"], p),),
            value_text(p["typical"], p),
            f"{p['lower']:g}",
            f"{p['upper']:g}",
            p["description"],
        ]
        for p in e["parameters"]
    ]
    heads = ["parameter", "unit", "without the effect", "typical", "at least", "at most", "meaning"]
    where = f", values of {e['targets'][0]}" if len(e["targets"]) > 1 else ""
    to.print()
    to.print(tables.make_table(f"Parameters{where}", heads, rows, text=(1, 6)))


def value_text(value: object, parameter: Mapping[str, object]) -> str:
    """A value of a parameter in a table; of a pose it is only said that it is one."""
    if value is None or (isinstance(value, list) and not value):
        return NONE
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list):
        if isinstance(value[0], list):
            return "pose"
        return f"{value[0]:.4g}" if len(value) == 1 else " ".join(f"{v:.4g}" for v in value)
    return f"{value:.4g}"
