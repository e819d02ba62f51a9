"""What `kr5 cell export` tells: which effects the model holds, and which it cannot."""

from typing import Any

from kr5_tools.cli.numbers import format_values
from kr5_tools.cli.tables import make_table


def print_export(written: Any, to: Any) -> None:
    """Tables of a `model_files.WrittenModel`."""
    columns = ["effect", "target", "parameter", "value", "unit"]
    if written.folded:
        rows = [[*_cells(p), p.field or "set by its own law"] for p in written.folded]
        to.print(make_table("Effects in the model", [*columns, "held as"], rows, text=(1, 2, 4, 5)))
        to.print()
    if written.losses:
        rows = [[*_cells(p), p.reason] for p in written.losses]
        table = make_table("Effects that are lost", [*columns, "reason"], rows, text=(1, 2, 4, 5))
        table.columns[-1].overflow = "fold"
        to.print(table)
        to.print()
    if written.changes:
        to.print(f"Changed in the original: {'; '.join(written.changes)}.", soft_wrap=True)
    for note in written.notes:
        to.print(f"Note: {note}.", soft_wrap=True)
    to.print(f"{written.file}: {_summary(written)}.", soft_wrap=True)


def _cells(parameter: Any) -> list[str]:
    return [parameter.effect, parameter.target, parameter.parameter, format_values(parameter.value), parameter.unit]


def _summary(written: Any) -> str:
    held = {(p.effect, p.target) for p in written.folded}
    lost = {(p.effect, p.target) for p in written.losses}
    if not held and not lost:
        return "written; the cell carries no effects"
    return f"written with {len(held)} of {len(held | lost)} effects"
