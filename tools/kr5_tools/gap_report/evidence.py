"""What a recording says for and against a cause, in sentences with numbers."""

from typing import Any

import kr5.cell
import kr5.gap
import numpy as np
import numpy.typing as npt
from kr5.gap import column_text, dependence_text, display_unit, effect_text

from kr5_tools.cli.numbers import format_number, format_percent
from kr5_tools.gap_report.evidence_data import Evidence, shaped_value
from kr5_tools.gap_report.messages import capitalised, effect_row, group_of, join_list

DEG = 57.29577951308232


def nominal_value(cell: kr5.cell.Cell, cause: kr5.gap.Cause | kr5.gap.EffectFit, parameter: str) -> Any:
    """What the cell says of a parameter that an effect replaces; None for one that is an addition."""
    row = effect_row(cause.effect)
    if row is None:
        return None
    choice = next((p.name for p in row.parameters if str(p.coordinate) == "choice"), None)
    chosen = next((int(p.value[0]) for p in cause.parameters if p.name == choice), 0)
    return cell.nominal_value(cause.effect, cause.target, parameter, chosen)


def is_pose(parameter: kr5.gap.ParameterEstimate) -> bool:
    return len(parameter.value) == 16


def parameter_rows(cause: kr5.gap.Cause | kr5.gap.EffectFit, cell: kr5.cell.Cell | None) -> list[dict[str, str]]:
    """Name, value, uncertainty, unit and cell value, one row per number; a pose as its difference from the cell's.
    `cause`: anything with effect, target and parameters."""
    out = []
    for p in cause.parameters:
        before = nominal_value(cell, cause, p.name) if cell else None
        if is_pose(p):
            out += _pose_rows(p, before)
            continue
        values, std = list(p.value), list(p.std)
        factor, unit = display_unit(p.unit, values, cause.target)
        nominal = [""] * len(values) if before is None else [f"{factor * b:.6g}" for b in without_rounding(before)]
        for axis, value, error, stated in zip("xyz" if len(values) > 1 else [""], values, std, nominal):
            exact = not error  # a choice, such as the number of cycles
            out.append(
                {
                    "name": f"{p.name.replace('_', ' ')} {axis}".strip(),
                    "unit": unit,
                    "value": f"{factor * value:g}" if exact else format_number(factor * value, factor * error),
                    "std": "" if exact else f"± {format_number(factor * error, factor * error)}",
                    "nominal": stated,
                }
            )
    return out


def without_rounding(value: npt.ArrayLike) -> np.ndarray:
    """The numbers of a value; 0 what rounding left beside the others."""
    numbers = np.atleast_1d(np.asarray(value, float))
    return np.where(np.abs(numbers) < 1e-12 * np.abs(numbers).max(), 0.0, numbers)


def _pose_rows(p: kr5.gap.ParameterEstimate, before: np.ndarray | None) -> list[dict[str, str]]:
    from scipy.spatial.transform import Rotation

    value = np.asarray(shaped_value(p.value), float)
    moved = np.linalg.inv(before) @ value if before is not None else value
    numbers = [*(1e3 * moved[:3, 3]), *(DEG * Rotation.from_matrix(moved[:3, :3]).as_rotvec())]
    std = [*(1e3 * np.asarray(p.std[:3])), *(DEG * np.asarray(p.std[3:]))]
    names = [f"{what} {axis}" for what in ("shift along", "turn about") for axis in "xyz"]
    return [
        {
            "name": n,
            "value": format_number(v, s),
            "std": f"± {format_number(s, s)}",
            "unit": u,
            "nominal": "0" if before is not None else "",
        }
        for n, v, s, u in zip(names, numbers, std, ["mm"] * 3 + ["°"] * 3)
    ]


def _deviations(cause: kr5.gap.Cause, cell: kr5.cell.Cell) -> float | None:
    """By how many standard deviations a cause is from off; None for one that the catalogue does not name."""
    if effect_row(cause.effect) is None:
        return None
    return kr5.gap.deviations_from_off(
        cell, kr5.gap.EffectName(effect=cause.effect, target=cause.target), cause.parameters
    )


def evidence_for(found: kr5.gap.Diagnosis, k: int, evidence: Evidence | None) -> list[str]:
    """What speaks for a cause of a diagnosis."""
    cause = found.causes[k]
    others = " not explained by the other causes" if len(found.causes) > 1 else ""
    out = [
        f"It explains {format_percent(cause.explained_fraction)} of the excess{others}, on"
        " experiments that were not used for the fit."
    ]
    if evidence and evidence.explained:
        explains = evidence.of_causes[k]
        top = [c for c in explains.columns if c.share > 0.01 and c.without > c.limit][:4]
        if top:
            out.append(
                "It explains "
                + join_list([f"the {column_text(c.column)} ({c.without:.2f} → {c.with_all:.2f})" for c in top])
                + f"{', all with the same values' if len(top) > 1 else ''}."
            )
        closed = [e.closed for e in explains.experiments]
        if len(closed) > 1 and min(closed) > 0.5:
            out.append(
                f"It is consistent in each of the {len(closed)} experiments in which it stands out: in the worst "
                f"{format_percent(min(closed))} of its excess goes."
            )
        away = _deviations(cause, evidence.recording.cell)
        if away and away >= 3:
            out.append(
                f"Its size differs from zero by {f'{away:.0f}' if away < 1000 else 'more than 1000'} standard"
                " deviations."
            )
    return out


def alternatives_to(trials: list[kr5.gap.EffectFit], evidence: Evidence) -> list[str]:
    """What other effects do in the place of a cause, fitted anew."""
    out = []
    for trial in trials:
        if trial.explained_fraction < 0.01:
            continue
        group, left = max(((c.column, c.after) for c in trial.columns), key=lambda row: row[1], default=("", 1.0))
        rest = (
            "leaves no column above the floor"
            if left <= 1.02 * evidence.limit(group)
            else f"leaves the {column_text(group)} at {left:.2f}"
        )
        name = capitalised(effect_text(trial.effect, trial.target))
        out.append(f"{name} explains {format_percent(trial.explained_fraction)} and {rest}.")
    return out or ["No other effect explains more than 1 % of the part that it explains."]


def evidence_against(found: kr5.gap.Diagnosis, k: int, evidence: Evidence | None) -> list[str]:
    """What speaks against a cause; says so when nothing does."""
    cause, out = found.causes[k], []
    for tied in cause.tied_with:
        out.append(f"{capitalised(effect_text(tied.effect, tied.target))} would look the same in this recording.")
    if cause.probability < 0.99:
        out.append(f"{format_percent(1 - cause.probability)} of the probability lies with other explanations.")
    if evidence and evidence.explained:
        explains = evidence.of_causes[k]
        explained = {c.column for c in explains.columns if c.share > 0.01}
        for place in found.unexplained:
            group = group_of(place)
            if group in explained:
                depends = f", and {dependence_text(place.depends_on[0], place.experiment)}" if place.depends_on else ""
                out.append(f"In the {column_text(group)} a gap of {place.gap:.2f} stays{depends}.")
        worse = [c for c in explains.columns if c.with_all > c.limit and c.with_all > 1.02 * c.without]
        out += [f"It makes the {column_text(c.column)} worse ({c.without:.2f} → {c.with_all:.2f})." for c in worse[:3]]
        out += [
            f"In {e.experiment} it explains {format_percent(e.closed)} of the excess."
            for e in explains.experiments
            if e.closed <= 0.5
        ]
        away = _deviations(cause, evidence.recording.cell)
        if away is not None and away < 3:
            out.append(f"Its size differs from zero by only {away:.1f} standard deviations.")
    if not out:
        out.append(
            "No evidence against it: no column gets worse, and no structure remains in those that it explains."
            if evidence
            else "The file contains no evidence against it."
        )
    return out
