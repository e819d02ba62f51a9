"""Whether loads that do not fit a simulation would fit it with the joints in another order."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import kr5
import kr5.cell
import kr5.io
import kr5.predict
import numpy as np

ALIKE = 0.9  # correlation of all loads together with the simulation, from which an order fits
BETTER = 0.15  # by which the mean correlation of the joints must be above that of the order of the columns


@dataclass
class Likeness:
    """Correlation of loads with their simulation."""

    together: float
    mean: float  # of the joints


def fitting_order(cell: Any, experiment: Any, stem: str) -> list[int] | None:
    """Joints (from 0) of the columns of a motion on measured positions in the order in which its loads fit; nothing
    where no order of those that people meet does, or the order of the columns fits as well."""
    n = cell.robot.joints
    if str(experiment.joint_reference) != "measured":
        return None
    own = _likeness(cell, experiment, stem, list(range(n)))
    if own.mean + BETTER >= 1:
        return None
    found = [(_likeness(cell, experiment, stem, order), order) for order in _orders(cell)]
    best, order = max(found, key=lambda f: f[0].mean)
    return order if best.together > ALIKE and best.mean > own.mean + BETTER else None


def _orders(cell: Any) -> Iterator[list[int]]:
    """Two joints exchanged, all of them backwards, and the alphabetical order of their names."""
    n, names = cell.robot.joints, list(cell.robot.joint_names)
    for a, b in combinations(range(n), 2):
        order = list(range(n))
        order[a], order[b] = b, a
        yield order
    yield list(reversed(range(n)))
    if names:
        yield sorted(range(n), key=lambda k: names[k])


def _likeness(cell: Any, experiment: Any, stem: str, order: list[int]) -> Likeness:
    """How the loads are like their simulation, when column k is that of joint order[k]."""
    n = len(order)
    values = {name: np.asarray(experiment[name]) for name in experiment.data.columns}
    for column, joint in enumerate(order):
        for family in ("qc", stem):
            values[f"{family}{joint + 1}"] = np.asarray(experiment[f"{family}{column + 1}"])
    moved = kr5.cell.Experiment(
        name=experiment.name, kind=experiment.kind, file=experiment.file, split=experiment.split
    )
    moved.joint_reference = experiment.joint_reference
    moved.data = kr5.io.Table(list(values), np.column_stack(list(values.values())))
    try:
        shown = kr5.predict.FastSimulator().predict(cell, moved)
    except kr5.Error:
        return Likeness(0.0, 0.0)
    loads = [f"{stem}{k + 1}" for k in range(n)]
    got, model = (np.column_stack([np.asarray(part[c]) for c in loads]) for part in (moved, shown))
    return Likeness(_correlation(got, model), float(np.mean([_correlation(a, b) for a, b in zip(got.T, model.T)])))


def _correlation(a: np.ndarray, b: np.ndarray) -> float:
    return float((a * b).sum() / max(float(np.linalg.norm(a) * np.linalg.norm(b)), 1e-300))
