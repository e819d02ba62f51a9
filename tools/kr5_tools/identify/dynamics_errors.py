"""Torque errors of identified dynamics as the terminal and the page show them."""

from typing import Any


def error_rows(errors: dict[str, Any]) -> tuple[list[str], list[list[Any]]]:
    """Columns and rows of the table of errors by joint."""
    columns = ["joint"]
    rows: list[list[Any]] = [[f"{k + 1}"] for k in range(len(errors["fitted"]["rms"]))]
    for name, title in (("fitted", "fitted"), ("held_out", "held out")):
        if name not in errors:
            continue
        columns += [f"{title}, RMS [N m]", f"{title} [%]"]
        for row, rms, part in zip(rows, errors[name]["rms"], errors[name]["relative"], strict=True):
            row += [float(rms), 100 * float(part)]
    return columns, rows
