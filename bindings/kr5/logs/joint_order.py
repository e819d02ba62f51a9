"""Whether loads that do not fit a simulation would fit it with the joints in another order, or counted another way."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

import kr5
import kr5.cell
import kr5.io
import kr5.predict

ALIKE = 0.9  # correlation of all loads together with the simulation, from which a reading fits
BETTER = 0.15  # by which the mean correlation of the joints must be above that of the columns as they are
CLEARER = 1.5  # logarithm by which a direction or zero must lessen what the joints leave, all of them together
LEAST_SHIFT = 0.1  # [m] by which another zero moves the centre of what a joint carries; less may be an error of it
OFFSETS = [sign * size for size in (0.2, 0.4, 0.6, 0.8, 1.0, 1.2) for sign in (1, -1)]  # [rad]
RIGHT_ANGLES = (0.0, np.pi / 2, np.pi, -np.pi / 2)  # by which conventions of zeros differ [rad]


@dataclass(frozen=True)
class Reading:
    """How the columns of a log are those of the joints of a model."""

    order: tuple[int, ...]  # joint (from 0) of each column
    sign: tuple[int, ...]  # of each joint: -1 where it is counted the other way
    zero: tuple[float, ...]  # of each joint: added after its sign [rad or m]


@dataclass
class Likeness:
    """How loads are like their simulation: their correlation, and the root mean square that each joint leaves, also
    with the loads of the other sign."""

    together: float = 0.0
    mean: float = 0.0  # of the joints
    left: np.ndarray | None = None
    left_negated: np.ndarray | None = None


def fitting_order(cell: Any, experiment: Any, stem: str) -> list[int] | None:
    """Joints (from 0) of the columns of a motion on measured positions in the order in which its loads fit; nothing
    where no order of those that people meet does, or the order of the columns fits as well."""
    own, plain = _plain_likeness(cell, experiment, stem)
    if own.mean + BETTER >= 1:
        return None
    orders = list(_orders(cell))
    found = [(_likeness(cell, experiment, stem, replace(plain, order=tuple(order))), order) for order in orders]
    best, order = max(found, key=lambda f: f[0].mean)
    return order if best.together > ALIKE and best.mean > own.mean + BETTER else None


def fitting_convention(cell: Any, experiment: Any, stem: str) -> Reading | None:
    """Directions and zeros, right angles apart, with which the loads of a motion on measured positions fit; nothing
    where none makes them fit far better. One that hardly shows in the loads is not looked for."""
    own, plain = _plain_likeness(cell, experiment, stem)
    if own.left is None or own.mean + BETTER >= 1:
        return None
    middle = np.array([np.median(experiment[f"qc{k + 1}"]) for k in range(cell.robot.joints)])
    arms = _lever_arms(cell, middle)
    best, reading = own, plain
    for _ in range(cell.robot.joints):
        found = [(_likeness(cell, experiment, stem, other), other) for other in _conventions(cell, reading)]
        likeness, other = max(found, key=lambda f: _gain(best.left, f[0].left))
        if not _gain(best.left, likeness.left) >= CLEARER or _least_shift(other, arms) < LEAST_SHIFT:
            break
        best, reading = likeness, other
    # All loads of the other sign are another mistake, which leaves as little.
    clear = min(_gain(own.left, best.left), _gain(own.left_negated, best.left)) > CLEARER
    if not clear or best.together <= ALIKE:
        return None
    # An offset of one joint, which is no convention, may do better.
    rivals = (_likeness(cell, experiment, stem, other) for other in _offsets(cell, plain))
    return reading if all(_gain(rival.left, best.left) > 0 for rival in rivals) else None


def _plain_likeness(cell: Any, experiment: Any, stem: str) -> tuple[Likeness, Reading]:
    n = cell.robot.joints
    plain = Reading(tuple(range(n)), (1,) * n, (0.0,) * n)
    if str(experiment.joint_reference) != "measured":
        return Likeness(mean=1.0), plain
    return _likeness(cell, experiment, stem, plain), plain


def _gain(before: np.ndarray | None, after: np.ndarray | None) -> float:
    """Logarithm by which a reading lessens what the joints leave, all of them together."""
    if before is None or after is None:
        return -np.inf
    return float(np.sum(np.log(before / after)))


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


def _lever_arms(cell: Any, q: np.ndarray) -> list[float]:
    """Distance of the centre of the links and the tool that each joint carries from its axis [m], in a posture."""
    chain = cell.nominal_chain()
    poses = [np.asarray(T) for T in chain.link_poses(q)]
    bodies = [(T, link.mass, link.com) for T, link in zip(poses, cell.robot.links)]
    if tool := cell.tool:
        T_base_sensor = cell.T_base_tool(q) @ np.linalg.inv(tool.T_flange_tool) @ tool.T_flange_sensor
        bodies.append((T_base_sensor, tool.mass, tool.com))
    masses = np.array([mass for _, mass, _ in bodies])
    centres = np.array([(T @ [*com, 1.0])[:3] for T, _, com in bodies])
    out = []
    for joint, before in enumerate([np.asarray(chain.T_base_0), *poses[:-1]]):
        mass = masses[joint:].sum()
        centre = masses[joint:] @ centres[joint:] / mass if mass > 0 else before[:3, 3]
        out.append(float(np.linalg.norm(np.cross(before[:3, 2], centre - before[:3, 3]))))
    return out


def _least_shift(reading: Reading, arms: list[float]) -> float:
    """The least by which one of the zeros of a reading moves the centre of what its joint carries [m]."""
    return min((2 * np.sin(abs(zero) / 2) * arm for zero, arm in zip(reading.zero, arms) if zero), default=np.inf)


def _conventions(cell: Any, reading: Reading) -> Iterator[Reading]:
    """One joint counted another way: the other direction, another zero, or both."""
    for joint, row in enumerate(cell.robot.dh):
        zeros = RIGHT_ANGLES if str(row.type) == "revolute" else RIGHT_ANGLES[:1]
        for sign in (1, -1):
            for zero in zeros:
                signs, all_zeros = list(reading.sign), list(reading.zero)
                signs[joint], all_zeros[joint] = sign, zero
                other = Reading(reading.order, tuple(signs), tuple(all_zeros))
                if other != reading:
                    yield other


def _offsets(cell: Any, plain: Reading) -> Iterator[Reading]:
    """One revolute joint read with an offset that is no right angle."""
    for joint, row in enumerate(cell.robot.dh):
        for offset in OFFSETS if str(row.type) == "revolute" else ():
            yield replace(plain, zero=tuple(offset if k == joint else 0.0 for k in plain.order))


def _likeness(cell: Any, experiment: Any, stem: str, reading: Reading) -> Likeness:
    """How the loads are like their simulation in a reading."""
    values = {name: np.asarray(experiment[name]) for name in experiment.data.columns}
    for column, joint in enumerate(reading.order):
        sign = reading.sign[joint]
        values[f"qc{joint + 1}"] = sign * np.asarray(experiment[f"qc{column + 1}"]) + reading.zero[joint]
        values[f"{stem}{joint + 1}"] = sign * np.asarray(experiment[f"{stem}{column + 1}"])
    moved = kr5.cell.Experiment(
        name=experiment.name, kind=experiment.kind, file=experiment.file, split=experiment.split
    )
    moved.joint_reference = experiment.joint_reference
    moved.data = kr5.io.Table(list(values), np.column_stack(list(values.values())))
    try:
        shown = kr5.predict.FastSimulator().predict(cell, moved)
    except kr5.Error:
        return Likeness()
    loads = [f"{stem}{k + 1}" for k in range(len(reading.order))]
    got, model = (np.column_stack([np.asarray(part[c]) for c in loads]) for part in (moved, shown))
    return Likeness(
        _correlation(got, model),
        float(np.mean([_correlation(a, b) for a, b in zip(got.T, model.T)])),
        _root_mean_square(got - model),
        _root_mean_square(got + model),
    )


def _root_mean_square(x: np.ndarray) -> np.ndarray:
    """Of each column, above 0."""
    return np.asarray(np.maximum(np.sqrt((x**2).mean(axis=0)), np.finfo(float).tiny))


def _correlation(a: np.ndarray, b: np.ndarray) -> float:
    return float((a * b).sum() / max(float(np.linalg.norm(a) * np.linalg.norm(b)), 1e-300))
