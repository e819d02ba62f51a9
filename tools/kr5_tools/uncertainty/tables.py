"""Tables of covariances, in mm and degrees."""

from typing import Any

import numpy as np

from kr5_tools.cli.numbers import format_number
from kr5_tools.cli.terminal import Console

AXES = "xyz"
MOST_PRINTED = 12  # rows of a table at a terminal


def matrix_rows(matrix: np.ndarray, scale: float = 1.0, digits: str = ".4g") -> list[list[str]]:
    return [[axis, *(f"{scale * value:{digits}}" for value in row)] for axis, row in zip(AXES, np.asarray(matrix))]


def matrix_table(title: str, matrix: np.ndarray, texts: tuple[str, ...] = ()) -> dict[str, Any]:
    """A covariance of a point [m^2], shown in mm^2."""
    return {"title": f"{title} [mm²]", "columns": ["", *AXES], "rows": matrix_rows(matrix, 1e6), "texts": list(texts)}


def ellipsoid_table(title: str, matrix: np.ndarray, confidence: float, unit: str, scale: float) -> dict[str, Any]:
    """Semi-axes and directions of the region that holds the error with a probability (eq. 3.14 and 3.15)."""
    from kr5.uncertainty import chi_square_quantile, confidence_ellipsoid

    axes, directions = confidence_ellipsoid(matrix, confidence)
    factor = float(np.sqrt(chi_square_quantile(confidence, len(matrix))))
    rows = [
        [f"{k + 1}", format_number(scale * float(length)), *(f"{x:+.3f}" for x in direction)]
        for k, (length, direction) in enumerate(zip(axes, directions.T))
    ]
    return {
        "title": title,
        "columns": ["axis", f"semi-axis [{unit}]", *AXES[: len(matrix)]],
        "rows": rows,
        "texts": [f"Holds the error with a probability of {100 * confidence:g} %: {factor:.4f} standard deviations."],
    }


def print_part(part: dict[str, Any], to: Console) -> None:
    from kr5_tools.cli.tables import make_table

    for table in part["tables"]:
        to.print(table["title"], soft_wrap=True, markup=False)
        to.print(make_table("", table["columns"], table["rows"][:MOST_PRINTED]))
        if len(table["rows"]) > MOST_PRINTED:
            to.print(f"{len(table['rows']) - MOST_PRINTED} more rows in the result and on the page.")
        for text in table["texts"]:
            to.print(text, soft_wrap=True, markup=False)
        to.print()
    for text in part["texts"]:
        to.print(text, soft_wrap=True, markup=False)
