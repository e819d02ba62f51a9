"""What `kr5 cell export` tells: which effects the model holds, and which it cannot."""

from itertools import groupby

import numpy as np
from kr5.models.writing import FoldedParameter, Loss, WrittenModel

from kr5_tools.cli.numbers import Numbers, format_values
from kr5_tools.cli.tables import make_table
from kr5_tools.cli.terminal import Console

COLUMNS = ["effect", "target", "parameter", "value"]


def print_export(written: WrittenModel, to: Console) -> None:
    """Tables of a `kr5.models.WrittenModel`."""
    if written.folded:
        rows = [[*_cells(p), p.field or "set by its own law"] for p in written.folded]
        _print_table("Effects in the model", [*COLUMNS, "held as"], rows, to)
    if written.losses:
        _print_table("Effects that are lost", COLUMNS, [_cells(p) for p in written.losses], to)
        for (effect, target), found in groupby(written.losses, key=lambda p: (p.effect, p.target)):
            to.print(f"{effect} {target}: {next(found).reason}.", soft_wrap=True)
        to.print()
    if written.changes:
        to.print(f"Changed in the original: {'; '.join(written.changes)}.", soft_wrap=True)
    for note in written.notes:
        to.print(f"Note: {note}.", soft_wrap=True)
    to.print(f"{written.file}: {_summary(written)}.", soft_wrap=True)


def _print_table(title: str, columns: list[str], rows: list[list[str]], to: Console) -> None:
    to.print(make_table(title, columns, rows, text=range(len(columns)), keys=3))
    to.print()


def _cells(parameter: FoldedParameter | Loss) -> list[str]:
    return [parameter.effect, parameter.target, parameter.parameter, _value_text(parameter.value, parameter.unit)]


def _value_text(value: Numbers, unit: str) -> str:
    """A value with its unit; a pose as position and roll, pitch, yaw."""
    if np.ndim(value) == 2:
        import kr5

        x = [round(float(v), 9) + 0.0 for v in kr5.to_xyzrpy(np.array(value))]
        return f"{format_values(x[:3])} m, {format_values(x[3:])} rad"
    return format_values(value) if unit == "-" else f"{format_values(value)} {unit}"


def _summary(written: WrittenModel) -> str:
    held = {(p.effect, p.target) for p in written.folded}
    lost = {(p.effect, p.target) for p in written.losses}
    if not held and not lost:
        return "written; the cell carries no effects"
    return f"written with {len(held)} of {len(held | lost)} effects"
