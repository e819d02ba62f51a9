"""Causes larger than the usual errors of a model, which may be that of another robot."""

from pathlib import Path

import kr5.cell
import kr5.gap


def model_warnings(found: kr5.gap.Diagnosis, cell: kr5.cell.Cell, model: str | None) -> list[str]:
    """Sentences that doubt the model of a diagnosis, or the zeros of its log. `cell`: without the causes; `model`: file
    of the model that was given beside a log or a recording."""
    described = Path(model).name if model else "the cell"
    return kr5.gap.model_warning_texts(kr5.gap.model_warnings(found, cell), found.joint_names, described)
