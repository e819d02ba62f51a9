"""Causes larger than the usual errors of a model, which may be that of another robot."""

from pathlib import Path

import kr5.cell
import kr5.gap
import numpy as np
from kr5.gap import effect_text, joint_name

from kr5_tools.cli.numbers import format_number
from kr5_tools.gap_report.messages import capitalised, join_list

LENGTHS = {"m": (1e3, "mm"), "rad": (180 / np.pi, "degrees")}  # factor and unit for people


def model_warnings(found: kr5.gap.Diagnosis, cell: kr5.cell.Cell, model: str | None) -> list[str]:
    """Sentences that doubt the model of a diagnosis, or the zeros of its log. `cell`: without the causes; `model`: file
    of the model that was given beside a log or a recording."""
    names = found.joint_names
    doubts = kr5.gap.model_doubts(found, cell)
    turned = [doubt for doubt in doubts if doubt.kind == kr5.gap.ModelDoubtKind.Zero]
    far = [
        _far_text(doubt, joint_name(names, doubt.target))
        for doubt in doubts
        if doubt.kind != kr5.gap.ModelDoubtKind.Zero
    ]
    out = []
    if far:
        described = Path(model).name if model else "the cell"
        out.append(
            f"Does {described} describe this robot and its payload? {capitalised(join_list(far))}"
            f" {'differ' if len(far) > 1 else 'differs'} by more than is usual."
        )
    if turned:
        joints = join_list([joint_name(names, doubt.target) or doubt.target for doubt in turned])
        sizes = join_list([f"{doubt.value:+.3g} rad" for doubt in turned])
        out.append(
            f"Does the log measure {joints} from the same zero as the model? An encoder offset of this size is unusual;"
            f" columns.q.offset corrects the log, by {sizes}."
        )
    return out


def _far_text(doubt: kr5.gap.ModelDoubt, joint: str) -> str:
    """What of a cause is far from the model's value. `joint`: its name in the model."""
    name = effect_text(doubt.effect, doubt.target)
    begin = f"{name} ({joint}; " if joint else f"{name} ("
    if doubt.kind == kr5.gap.ModelDoubtKind.Mass:
        return f"{begin}{doubt.value:.2g} times that of the model)"
    factor, unit = LENGTHS[doubt.unit]
    return f"{begin}{format_number(factor * doubt.value, factor * doubt.std)} {unit} from that of the model)"
