"""Rows of the targets on which an effect was tried."""

from typing import Any

from kr5_tools.cli.numbers import NONE

TARGET_COLUMNS = ["target", "explained [%]", "values"]


def target_rows(targets: list[dict[str, Any]]) -> list[list[str]]:
    """Of each target: its name, the explained part in percent, and the fitted values."""
    return [
        [t["target"], NONE if t["closed"] is None else f"{min(max(100 * t['closed'], 0.0), 100.0):.1f}", _values(t)]
        for t in targets
    ]


def _values(trial: dict[str, Any]) -> str:
    """The values of a trial, where it does anything."""
    if trial["closed"] is None:
        return "changes no recorded column"
    if trial["closed"] < 0.005:
        return "no effect at the best fit"
    return "; ".join(f"{p['name']} {p['value']} {p['std']} {p['unit']}" for p in trial["parameters"])
