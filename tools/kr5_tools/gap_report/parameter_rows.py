"""The parameters of a cause in a table: value, uncertainty, unit, and what the cell states."""

from typing import Any

import kr5.cell
import kr5.gap
import numpy as np
import numpy.typing as npt
from kr5.gap import display_unit

from kr5_tools.cli.numbers import format_number
from kr5_tools.gap_report.messages import effect_row

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

    value = np.reshape(p.value, (4, 4))
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
