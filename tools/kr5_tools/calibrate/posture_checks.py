"""Faults of measured postures that leave their mark on all rows together: a wrong unit, a mirrored axis, rows that are
one off or in another order, a device that moved, joints that hardly did."""

from dataclasses import dataclass
from typing import Any

import kr5
import kr5.calibration
import kr5.kinematics
import numpy as np

LITTLE = np.radians(5)  # turn of a joint below which its parameters are poorly determined
STANDING = 1e-3  # a joint whose values differ by less stood still [rad or m]
BETTER = 0.4  # part of the distance that is left where a fault explains it
WORTH = 2e-3  # distance below which nothing needs a further explanation [m]
ROUNDS = 60  # of the alternating fit of tool and device
NO_RELATION = 0.2  # nominal error over the scatter of the places from which on both have nothing to do with each other
IN_ORDER = 0.05  # the same for an order that was looked for, which explains something by chance
ORDERS = 20  # rounds of the search for the order
MATCHED = 500  # rows up to which an order is looked for
SHOWN = 8  # rows that are named of those in the wrong order
JUMP = 60.0  # chi-square of three degrees of freedom, the greatest over all rows, that no chance gives


def require_motion(postures: list[kr5.calibration.ArmPosture]) -> None:
    """Refuses postures that are all the same."""
    q = np.array([p.q for p in postures])
    if len(q) > 1 and (np.ptp(q, axis=0) < STANDING).all():
        raise kr5.InvalidArgument(
            f"no joint moved from {postures[0].name} to {postures[-1].name}: one posture contains no"
            " information about the arm"
        )


def posture_warnings(
    chain: kr5.kinematics.DhChain, postures: list[kr5.calibration.ArmPosture], result: kr5.calibration.KinematicsResult
) -> list[str]:
    """Everything that speaks against the measurements, in words, with the rows concerned."""
    return [
        *joint_warnings(chain, postures),
        *pairing_warnings(chain, postures),
        *moved_device_warnings(postures, result),
    ]


def joint_warnings(chain: kr5.kinematics.DhChain, postures: list[kr5.calibration.ArmPosture]) -> list[str]:
    """Joints that did not move, or hardly."""
    out = []
    for k, (joint, width) in enumerate(zip(chain.joints, np.ptp([p.q for p in postures], axis=0), strict=True)):
        if width < STANDING:
            out.append(f"joint {k + 1} did not move: what belongs to it is not determined")
        elif str(joint.type) == "revolute" and width < LITTLE:
            out.append(f"joint {k + 1} moved by {np.degrees(width):.2g} deg only: its parameters are poorly determined")
    return out


def pairing_warnings(chain: kr5.kinematics.DhChain, postures: list[kr5.calibration.ArmPosture]) -> list[str]:
    """A scale, a mirror or a shift of the rows with which the nominal arm agrees much better."""
    rows = [p for p in postures if _place(p) is not None]
    if len(rows) < 8:
        return []
    flanges = np.array([chain.flange(p.q) for p in rows])
    places = np.array([_place(p) for p in rows])
    plain, _ = _misfit(flanges, places)
    if plain < WORTH:
        return []
    scatter = float(np.sqrt(((places - np.median(places, axis=0)) ** 2).sum(axis=1).mean()))
    lost = f" (the nominal arm misses by {1e3 * plain:.1f} mm as measured"
    explained = []
    scaled, scale = _misfit(flanges, places, scaled=True)
    if abs(scale - 1) > 1e-3:
        explained.append((scaled, _scale_text(scale)))
    mirrored, scale = _misfit(flanges, places * [1.0, 1.0, -1.0], scaled=True)
    explained.append((mirrored, "the measured points are mirrored: an axis of the device is reversed, or two changed"))
    for shift, word in ((1, "before"), (-1, "after")):
        one, other = (flanges[:-1], places[1:]) if shift > 0 else (flanges[1:], places[:-1])
        explained.append(
            (
                _misfit(one, other)[0],
                f"the measurements belong to the joint values one row {word}, from {rows[0].name} to {rows[-1].name}:"
                " one of the two lists is shifted",
            )
        )
    best, text = min(explained)
    if best > BETTER * plain and plain > NO_RELATION * scatter and len(rows) <= MATCHED:
        order, matched = matched_order(flanges, places)
        if matched < IN_ORDER * plain:
            best, text = matched, _order_text([p.name for p in rows], order)
    if best <= BETTER * plain:
        return [f"{text}{lost}, by {1e3 * best:.1f} mm with that)"]
    if plain > NO_RELATION * scatter:
        return [
            "the measurements do not belong to these joint values, in any order: from"
            f" {rows[0].name} to {rows[-1].name} the places scatter by {1e3 * scatter:.0f} mm{lost});"
            " is it another arm, another recording, or are the joint values in another unit or order?"
        ]
    return []


def matched_order(flanges: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, float]:
    """The posture that each place belongs to, and the median distance with that [m]. Distances between places are those
    between flanges, but for the tool, whatever the device: their sorted rows tell a posture by itself. Device, tool and
    order are then found in turn."""
    from scipy.optimize import linear_sum_assignment
    from scipy.spatial.distance import cdist

    apart = [np.sort(cdist(x, x), axis=1) for x in (flanges[:, :3, 3], places)]
    order = linear_sum_assignment(cdist(apart[1], apart[0]))[1]
    found = _fit_device(flanges[order], places)
    for _ in range(ORDERS):
        model = flanges[:, :3, :3] @ found.tip + flanges[:, :3, 3]
        again = linear_sum_assignment(np.minimum(cdist(found.back, model), 3 * found.median + 0.1))[1]
        if (again == order).all():
            break
        order = again
        found = _fit_device(flanges[order], places)
    return order, found.median


def _order_text(names: list[str], order: np.ndarray) -> str:
    wrong = np.flatnonzero(order != np.arange(len(order)))
    shown = [f"{names[k]} belongs to {names[order[k]]}" for k in wrong[:SHOWN]]
    more = f" and {len(wrong) - SHOWN} more" if len(wrong) > SHOWN else ""
    return f"{len(wrong)} measurements stand beside the joint values of another row: that of {', '.join(shown)}{more}"


@dataclass
class Device:
    """A measuring device and the point of the flange that it sees, as well placed as can be."""

    tip: np.ndarray  # on the flange [m]
    back: np.ndarray  # measured places in the base, n x 3 [m]
    scale: float
    median: float  # distance [m]


def _scale_text(scale: float) -> str:
    for factor, unit in ((1e3, "millimetres"), (1e2, "centimetres"), (25.4e-3, "inches")):
        if abs(scale / factor - 1) < 0.05:
            return f"the measured points are {scale:.4g} times as far apart as the arm's: are they in {unit}?"
    return (
        f"the measured points are {scale:.4g} times as far apart as the arm's: the scale of the device is wrong, or the"
        " arm is another one"
    )


def _misfit(flanges: np.ndarray, places: np.ndarray, scaled: bool = False) -> tuple[float, float]:
    """Median distance of places from a point of the flange [m], and the scale of the device, 1 unless it is free."""
    found = _fit_device(flanges, places, scaled)
    return found.median, found.scale


def _fit_device(flanges: np.ndarray, places: np.ndarray, scaled: bool = False) -> Device:
    """Tool and device are fitted in turn; outliers count little."""
    R, t = flanges[:, :3, :3], flanges[:, :3, 3]
    tip, weights = np.zeros(3), np.ones(len(places))
    back, distance, scale = places, np.zeros(len(places)), 1.0
    for _ in range(ROUNDS):
        model = R @ tip + t
        total = weights.sum()
        a, b = weights @ model / total, weights @ places / total
        H = (model - a).T @ (weights[:, None] * (places - b))
        U, S, Vt = np.linalg.svd(H)
        D = np.diag([1.0, 1.0, np.sign(np.linalg.det(Vt.T @ U.T))])
        rotation = Vt.T @ D @ U.T
        if scaled:
            scale = float((S * np.diag(D)).sum() / max((weights[:, None] * (model - a) ** 2).sum(), 1e-300))
        back = (places - b) @ rotation / max(scale, 1e-12) + a
        tip = np.average(np.einsum("nji,nj->ni", R, back - t), axis=0, weights=weights)
        distance = np.linalg.norm(back - (R @ tip + t), axis=1)
        weights = 1 / (1 + (distance / max(float(np.median(distance)), 1e-12) / 3) ** 2)
    return Device(tip, back, scale, float(np.median(distance)))


def _place(posture: kr5.calibration.ArmPosture) -> np.ndarray | None:
    """Where the tool, or the first point that was seen, is."""
    if posture.T_world_tool is not None:
        return np.asarray(posture.T_world_tool)[:3, 3]
    points = np.asarray(posture.points)
    return points[:, 0] if points.shape[1] and np.isfinite(points[:, 0]).all() else None


def moved_device_warnings(
    postures: list[kr5.calibration.ArmPosture], result: kr5.calibration.KinematicsResult
) -> list[str]:
    """A row from which on all measured places are elsewhere."""
    rows, residuals = [], []
    for posture in postures:
        if (place := _place(posture)) is None:
            continue
        T = result.T_world_base @ result.flange(posture.q, *_torques(posture, result))
        tip = result.T_flange_tool[:3, 3] if posture.T_world_tool is not None else result.points[:, 0]
        rows.append(posture)
        residuals.append(place - (T[:3, :3] @ tip + T[:3, 3]))
    n = len(rows)
    if n < 12:
        return []
    r = np.array(residuals)
    r = np.clip(r - np.median(r, axis=0), *(np.array([[-6], [6]]) * _spread(r)))  # outliers count little
    best, at, jump = 0.0, 0, np.zeros(3)
    for k in range(4, n - 3):
        before, after = r[:k], r[k:]
        difference = after.mean(axis=0) - before.mean(axis=0)
        variance = (before.var(axis=0) * k + after.var(axis=0) * (n - k)) / (n - 2) * (1 / k + 1 / (n - k))
        chi_square = float((difference**2 / np.maximum(variance, 1e-24)).sum())
        if chi_square > best:
            best, at, jump = chi_square, k, difference
    if best < JUMP:
        return []
    return [
        f"from {rows[at].name} on the measured places are {1e3 * np.linalg.norm(jump):.2g} mm elsewhere than before:"
        " did the device or the base move?"
    ]


def _torques(posture: kr5.calibration.ArmPosture, result: kr5.calibration.KinematicsResult) -> tuple[Any, ...]:
    return (posture.torques,) if len(result.compliances) else ()


def _spread(r: np.ndarray) -> np.ndarray:
    return np.asarray(np.maximum(1.4826 * np.median(np.abs(r - np.median(r, axis=0)), axis=0), 1e-12))
