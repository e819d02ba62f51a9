"""What MuJoCo leaves with a model that was written, in words."""

from kr5.models.mjcf_actuators import AS_FOUND
from kr5.models.mujoco_check import AGREES, MujocoCheck

UNITS = ((False, 1e3, "mrad"), (True, 1e3, "mm"))  # of joints that turn, and of those that slide

UNSTABLE = {
    "before": "At its time step, MuJoCo loses the model as it was read, whose servos are too stiff for it.",
    "after": "At its time step, MuJoCo loses the written model: choose a shorter one, or another integrator.",
}


def check_sentences(check: MujocoCheck) -> list[str]:
    """First the errors beside those of kr5 and those before, then how far both simulations disagree, and why."""
    parts = [
        f"{_number(check, check.after, slides)}, kr5 {_number(check, check.own, slides)}, before"
        f" {_number(check, check.before, slides)}"
        for slides, _, _ in UNITS
        if check.pooled(check.after, slides) is not None
    ]
    where = "on the rows to check" if check.checked else "on the rows that were fitted, for none are kept to check"
    out = [f"MuJoCo with the written model: {'; '.join(parts)} {where} (RMS of the positions)."]
    return [*out, *(UNSTABLE[name] for name in check.unstable), *_friction_sentences(check), *_disagreement(check)]


def _friction_sentences(check: MujocoCheck) -> list[str]:
    if check.friction == AS_FOUND:
        return []
    left = [text for slides, _, _ in UNITS if (text := _number(check, check.as_found, slides))]
    return [
        f"MuJoCo softens dry friction: stated as it was found, it leaves {' and '.join(left)}. The model states what"
        f" fits best there: frictionloss {check.friction.scale:.3g} times that found"
        + "".join(f", {name} {' '.join(f'{v:g}' for v in values)}" for name, values in check.friction.solver().items())
        + "."
    ]


def _disagreement(check: MujocoCheck) -> list[str]:
    """How much more MuJoCo leaves than kr5, in total."""
    ratios = [
        after / own
        for slides, _, _ in UNITS
        if (own := check.pooled(check.own, slides)) and (after := check.pooled(check.after, slides))
    ]
    worst = max(ratios, default=1.0)
    if worst <= AGREES:
        return []
    return [f"MuJoCo leaves {worst:.2f} times what kr5 leaves: its model of this arm is not the same."]


def _number(check: MujocoCheck, errors: list[float], slides: bool) -> str:
    pooled = check.pooled(errors, slides)
    factor, unit = next((f, u) for s, f, u in UNITS if s == slides)
    return "" if pooled is None else f"{factor * pooled:.3g} {unit}"


def check_rows(check: MujocoCheck) -> list[dict[str, str]]:
    """The errors of each joint, for a table."""
    rows = []
    for name, slides, *errors in zip(check.joints, check.slides, check.before, check.after, check.own):
        factor, unit = next((f, u) for s, f, u in UNITS if s == slides)
        before, after, own = (f"{factor * error:.3g}" for error in errors)
        rows.append({"joint": name, "before": before, "after": after, "own": own, "unit": unit})
    return rows
