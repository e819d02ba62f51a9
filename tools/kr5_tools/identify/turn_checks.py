"""Reasons to doubt turns of several joints together: what no single arc shows."""

import kr5.calibration
import kr5.kinematics
import numpy as np
from kr5 import kinematics

LONGEST, SHORTEST = 20.0, 1e-2  # sum of the lengths of an arm that a person can mean [m]
SURE = 8.0  # standard deviations
UNEVEN = 5.0  # noise of one joint over that of the others that no chance gives
OTHER_SCALE = 0.02  # relative difference of all lengths from the nominal ones that is no tolerance
NEAR_PARALLEL = 0.1  # sine of the angle between axes, as for kr5.kinematics.chain_from_axes


def near_parallel(joint: kr5.kinematics.DhJoint) -> bool:
    """Whether the axes before and behind a link are near-parallel, as chain_from_axes takes it."""
    across = np.hypot(np.sin(joint.beta), np.sin(joint.alpha) * np.cos(joint.beta))
    return bool(across < NEAR_PARALLEL)


def uneven_warnings(
    turns: list[list[kr5.calibration.JointSample]],
    labels: list[list[str]],
    results: list[kr5.calibration.JointAxisResult],
) -> list[str]:
    """Joints whose samples scatter much more than those of the others, and where that begins."""
    noise = np.array([r.sigma_position for r in results])
    if len(noise) < 3:
        return []
    out = []
    for k, result in enumerate(results):
        usual = float(np.median(np.delete(noise, k)))
        if noise[k] < UNEVEN * max(usual, 1e-9):
            continue
        at = _max_step(turns[k], result)
        where = f"; the greatest step is before {labels[k][at]}" if at else ""
        out.append(
            f"joint {k + 1} ({labels[k][0]} to {labels[k][-1]}): the samples are {1e3 * noise[k]:.2g} mm off their"
            f" circle, those of the other joints {1e3 * usual:.2g} mm: the device moved meanwhile, another joint moved,"
            f" or the sample is loose{where}"
        )
    return out


def _max_step(turn: list[kr5.calibration.JointSample], result: kr5.calibration.JointAxisResult) -> int:
    """Sample before which the places leave the course of those before most."""
    inverse = np.linalg.inv(result.T_world_axis)
    local = np.array([(inverse @ np.append(_place(s), 1))[:3] for s in turn])
    if not np.isfinite(local).all() or len(local) < 4:
        return 0
    course = np.column_stack([np.hypot(local[:, 0], local[:, 1]), local[:, 2]])
    steps = np.linalg.norm(np.diff(course, axis=0), axis=1)
    return int(np.argmax(steps)) + 1


def shift_warnings(labels: list[list[str]], results: list[kr5.calibration.JointAxisResult]) -> list[str]:
    """Joints of which each has its first, or each its last, sample wrong: the list of measurements is one row off."""
    if len(results) < 3:
        return []
    for last in (False, True):
        ends = [len(names) - 1 if last else 0 for names in labels]
        rows = [names[i] for names, r, i in zip(labels, results, ends, strict=True) if i in r.outliers]
        if len(rows) >= max(3, len(results) - 2):
            word = "last" if last else "first"
            return [
                f"of nearly every joint the {word} sample ({', '.join(rows)}) belongs to another joint's turn: the"
                " measurements are shifted by a row against the joint values"
            ]
    return []


def nominal_warnings(chain: kr5.kinematics.DhChain, nominal: kr5.kinematics.DhChain, home: np.ndarray) -> list[str]:
    """A mirrored or scaled measurement, by the nominal arm."""
    if len(nominal.joints) != len(chain.joints):
        return [f"{len(chain.joints)} axes were found, the cell's arm has {len(nominal.joints)} joints"]
    believed = kinematics.chain_from_axes(kinematics.axes_of(nominal, home), home, nominal.flange(home))
    found, expected = [], []
    for k, (f, b) in enumerate(zip(chain.joints[:-1], believed.joints[:-1], strict=True)):
        if near_parallel(b):
            continue  # the sign of what lies between parallel axes tells nothing
        found.append(f.a)
        expected.append(b.a)
        if k > 0:
            found.append(f.b)
            expected.append(b.b)
    square = float(np.dot(expected, expected))
    if square == 0.0:
        return []
    scale = float(np.dot(found, expected)) / square
    left = float(np.linalg.norm(np.subtract(found, np.multiply(scale, expected)))) / np.sqrt(square)
    if scale < 0:
        return ["the arm is the mirror image of the cell's: an axis of the device is reversed, or two changed places"]
    if abs(scale - 1) > max(OTHER_SCALE, 3 * left):
        return [
            f"every length is {scale:.4g} times the cell's: the scale of the device is wrong, or its unit"
            " (--length-unit)"
        ]
    return []


def home_point_warnings(
    turns: list[list[kr5.calibration.JointSample]],
    labels: list[list[str]],
    results: list[kr5.calibration.JointAxisResult],
    home: np.ndarray,
) -> list[str]:
    """Joints between which the device moved: by the turn of each joint, the point is elsewhere when all stand at home.

    Only for joints with known values: without them, nothing says where the others stood.
    """
    if any(s.q is None for turn in turns for s in turn):
        return []
    places, spreads = [], []
    for k, (turn, result) in enumerate(zip(turns, results, strict=True)):
        place, spread = _place_at_home(turn, result, float(home[k]))
        places.append(place)
        spreads.append(spread)
    out = []
    for k in range(1, len(places)):
        off = float(np.linalg.norm(places[k] - places[k - 1]))
        if off > SURE * max(np.hypot(spreads[k], spreads[k - 1]), 1e-9):
            out.append(
                f"between joint {k} (to {labels[k - 1][-1]}) and joint {k + 1} (from {labels[k][0]}) the measured point"
                f" at home jumps by {1e3 * off:.2f} mm: the device or the base moved, or another joint did"
            )
    return out


def _place_at_home(
    turn: list[kr5.calibration.JointSample], result: kr5.calibration.JointAxisResult, home: float
) -> tuple[np.ndarray, float]:
    """Where the first point, or the tool, is on the circle of a joint when the joint is at home, and about how well
    that is known [m]."""
    inverse = np.linalg.inv(result.T_world_axis)
    inside = [i for i in range(len(turn)) if i not in set(result.outliers)]
    inside = [i for i in inside if np.isfinite(_place(turn[i])).all()]
    back = []
    for i in inside:  # turned back about the axis by its own joint value
        angle = home - _joint_value(turn[i])
        c, s = np.cos(angle), np.sin(angle)
        back.append(np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ (inverse @ np.append(_place(turn[i]), 1))[:3])
    scatter = np.std(back, axis=0).max()
    # The axis is known less well than the points that it is of; beside the arc that does not matter.
    spread = max(scatter, result.sigma_position) / np.sqrt(max(1, len(back) - 5))
    lever = float(np.hypot(*np.mean(back, axis=0)[:2]))
    tilt = float(np.sqrt(np.trace(result.covariance[2:, 2:]))) * max(lever, result.arc * lever)
    reach = max((abs(_joint_value(turn[i]) - home) for i in inside), default=0.0)
    offset = float(np.sqrt(np.trace(result.covariance[:2, :2]))) * min(1.0, reach)
    return (np.asarray(result.T_world_axis) @ np.append(np.mean(back, axis=0), 1))[:3], float(
        np.sqrt(spread**2 + tilt**2 + offset**2)
    )


def _joint_value(sample: kr5.calibration.JointSample) -> float:
    """NaN where none was given."""
    return np.nan if sample.q is None else sample.q


def _place(sample: kr5.calibration.JointSample) -> np.ndarray:
    return np.asarray(sample.T_world_tool)[:3, 3] if sample.T_world_tool is not None else sample.points[:, 0]


def length_warnings(chain: kr5.kinematics.DhChain) -> list[str]:
    """A unit of lengths that no arm has."""
    size = sum(abs(j.a) + abs(j.b) for j in chain.joints)
    if size > LONGEST:
        return [f"the arm would be {size:.0f} m long: are the lengths in millimetres? (--length-unit mm)"]
    if size < SHORTEST:
        return [f"the arm would be {1e3 * size:.3g} mm long: are the lengths in metres? (--length-unit m)"]
    return []
