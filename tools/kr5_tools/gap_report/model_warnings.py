"""Causes larger than the usual errors of a model, which may be that of another robot."""

from pathlib import Path

import kr5.cell
import kr5.gap
import numpy as np
from kr5.gap import effect_text, joint_name

from kr5_tools.cli.numbers import format_number
from kr5_tools.gap_report.evidence import nominal_value
from kr5_tools.gap_report.messages import capitalised, effect_row, join_list, moves_tool

SURELY = 2.0  # standard deviations by which a size must be beyond what is usual
USUAL_FACTOR = 1.5  # of a mass
USUAL_CENTRE = 0.1  # [m], of a centre of mass
USUAL = {"m": (0.01, 1e3, "mm"), "rad": (0.05, 180 / np.pi, "degrees")}  # of a link; factor and unit for people
USUAL_ZERO = 0.1  # [rad]


def model_warnings(found: kr5.gap.Diagnosis, cell: kr5.cell.Cell, model: str | None) -> list[str]:
    """Sentences that doubt the model of a diagnosis, or the zeros of its log. `cell`: without the causes; `model`: file
    of the model that was given beside a log or a recording."""
    names = found.joint_names
    far = [text for cause in found.causes if (text := _far_text(cause, cell, joint_name(names, cause.target)))]
    out = []
    if far:
        described = Path(model).name if model else "the cell"
        out.append(
            f"Does {described} describe this robot and its payload? {capitalised(join_list(far))}"
            f" {'differ' if len(far) > 1 else 'differs'} by more than is usual."
        )
    turned = [cause for cause in found.causes if _is_far_zero(cause)]
    if turned:
        joints = join_list([joint_name(names, cause.target) or cause.target for cause in turned])
        sizes = join_list([f"{cause.parameters[0].value[0]:+.3g} rad" for cause in turned])
        out.append(
            f"Does the log measure {joints} from the same zero as the model? An encoder offset of this size is unusual;"
            f" columns.q.offset corrects the log, by {sizes}."
        )
    return out


def _far_text(cause: kr5.gap.Cause, cell: kr5.cell.Cell, joint: str) -> str:
    """What of a cause is far from the cell's value; empty where nothing is. `joint`: its name in the model."""
    name = effect_text(cause.effect, cause.target)
    begin = f"{name} ({joint}; " if joint else f"{name} ("
    if not cause.target.startswith("joint"):
        return ""
    for p in cause.parameters:
        before = nominal_value(cell, cause, p.name)
        if before is None:
            continue
        value, std, stated = (np.atleast_1d(np.asarray(x, float)) for x in (p.value, p.std, before))
        if p.unit == "kg" and stated[0] > 0:
            least, most = stated[0] / USUAL_FACTOR, stated[0] * USUAL_FACTOR
            if value[0] + SURELY * std[0] < least or value[0] - SURELY * std[0] > most:
                return f"{begin}{value[0] / stated[0]:.2g} times that of the model)"
        elif usual := USUAL.get(p.unit):
            limit, factor, unit = usual
            off, error = float(np.linalg.norm(value - stated)), float(np.linalg.norm(std))
            if off - SURELY * error > (USUAL_CENTRE if len(value) == 3 else limit):
                return f"{begin}{format_number(factor * off, factor * error)} {unit} from that of the model)"
    return ""


def _is_far_zero(cause: kr5.gap.Cause) -> bool:
    """Whether a cause is the zero of a joint, an angle by which everything beyond it is moved, and far off."""
    if not moves_tool(cause.effect) or len(cause.parameters) != 1 or not cause.target.startswith("joint"):
        return False
    row, zero = effect_row(cause.effect), cause.parameters[0]
    if zero.unit != "rad" or row.parameters[0].nominal_when_off:
        return False
    return bool(abs(zero.value[0]) - SURELY * zero.std[0] > USUAL_ZERO)
