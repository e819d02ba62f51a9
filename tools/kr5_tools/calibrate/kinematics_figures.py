"""Which parameters of an arm differ from their nominal values, and in words how far the arm is as its cell says."""

from collections.abc import Iterable, Mapping
from typing import Any

from kr5_tools.cli.numbers import format_count, format_number, table_unit

SIGNIFICANT = 3.0  # standard deviations from the nominal value
PERIODIC = "joint_errors."


def is_periodic(coordinate: Mapping[str, Any]) -> bool:
    """Whether it is an error of a joint once or twice a turn."""
    name = str(coordinate["name"])
    return name.startswith(PERIODIC) and not name.endswith(".compliance")


def is_significant(coordinate: Mapping[str, Any]) -> bool:
    """Whether it differs from its nominal value by more than chance."""
    return bool(abs(coordinate["value"] - coordinate["nominal"]) > SIGNIFICANT * coordinate["std"])


def shown_name(coordinate: Mapping[str, Any]) -> str:
    """For tables, with a star where the measurements alone do not determine it."""
    name = str(coordinate["name"]).removeprefix("arm.")
    name = name.replace(PERIODIC, "error of " if is_periodic(coordinate) else "")
    return name + ("" if coordinate["identifiable"] else "*")


def change_text(coordinates: Iterable[Mapping[str, Any]]) -> str:
    """Part of a verdict: whether the arm is as its cell says."""
    arm = [c for c in coordinates if str(c["name"]).startswith("arm.")]
    changed = [c for c in arm if is_significant(c)]
    if not arm:
        return "No parameter of the arm was estimated"
    if not changed:
        return "The arm is as its cell says: no parameter differs significantly from its nominal value"
    largest = max(changed, key=lambda c: abs(c["value"] - c["nominal"]) / c["std"])
    name, (scale, unit) = str(largest["name"]).removeprefix("arm."), table_unit(largest["unit"])
    change, std = scale * (largest["value"] - largest["nominal"]), scale * largest["std"]
    return (
        f"{format_count(len(changed), 'parameter', ('differs', 'differ'))} from the cell, of {len(arm)} of the arm;"
        f" most clearly {name}, by {format_number(change, std)} ± {format_number(std, std)} {unit}"
    )


def left_out_notes(coordinates: Iterable[Mapping[str, Any]], unidentifiable: Iterable[Mapping[str, Any]]) -> list[str]:
    """What is said below a table of the parameters that differ from their nominal values."""
    every = list(coordinates)
    alike = [c for c in every if not is_significant(c)]
    notes = []
    if alike:
        subject = "1 parameter is" if len(alike) == 1 else f"{len(alike)} parameters are"
        notes.append(f"{subject} within {SIGNIFICANT:g} standard deviations of the nominal value and not listed.")
    together = [str(direction["text"]) for direction in unidentifiable]
    if together:
        notes.append(
            "* Not determined by the measurements alone; held near the nominal value: " + "; ".join(together) + "."
        )
    return notes


def figures_and_notes(data: Mapping[str, Any]) -> tuple[list[dict[str, Any]], list[str]]:
    """For the page of a `kr5-kinematics/1`: rows of the parameters that differ, and what is said below them."""
    result = data.get("result", {})
    coordinates = result.get("coordinates", [])
    rows = []
    for c in filter(is_significant, coordinates):
        scale, unit = table_unit(c["unit"])
        change = scale * (c["value"] - c["nominal"])
        rows.append({"name": f"{shown_name(c)}, change", "value": change, "std": scale * c["std"], "unit": unit})
    return rows, left_out_notes(coordinates, result.get("unidentifiable", []))
