"""What speaks against measured postures as a whole, in words: joints that hardly moved, a wrong unit, a mirrored axis,
rows that are one off or in another order, a device that moved. kr5.calibration finds it."""

import kr5
import kr5.calibration
import kr5.kinematics
import numpy as np
from kr5 import calibration
from kr5.calibration import DeviceUnit

SHOWN = 8  # rows that are named of those in the wrong order
UNITS = {DeviceUnit.Millimetre: "millimetres", DeviceUnit.Centimetre: "centimetres", DeviceUnit.Inch: "inches"}


def require_motion(chain: kr5.kinematics.DhChain, postures: list[kr5.calibration.ArmPosture]) -> None:
    """Refuses postures that are all the same."""
    still = [j for j in calibration.find_still_joints(chain, postures) if not j.moved]
    if len(postures) > 1 and len(still) == len(chain.joints):
        raise kr5.InvalidArgument(
            f"no joint moved from {postures[0].name} to {postures[-1].name}: one posture contains no"
            " information about the arm"
        )


def require_order(
    chain: kr5.kinematics.DhChain, postures: list[kr5.calibration.ArmPosture]
) -> kr5.calibration.PostureFindings:
    """Refuses measurements that stand beside the joint values of another row: no arm would explain them. Gives what
    else was found.
    """
    found = calibration.check_postures(chain, postures)
    if found.shifted or found.reordered:
        (text,) = _pairing_texts(found, [p.name for p in postures])
        raise kr5.InvalidArgument(f"{text}; put each measurement beside the joint values at which it was taken")
    return found


def posture_warnings(
    found: kr5.calibration.PostureFindings,
    postures: list[kr5.calibration.ArmPosture],
    result: kr5.calibration.KinematicsResult,
) -> list[str]:
    """Everything that speaks against the measurements, with the rows concerned."""
    names = [p.name for p in postures]
    moved = calibration.find_moved_device(result, postures)
    return [
        *map(_joint_text, found.still_joints),
        *_pairing_texts(found, names),
        *([_moved_text(moved, names)] if moved else []),
    ]


def _joint_text(joint: kr5.calibration.StillJoint) -> str:
    if not joint.moved:
        return f"joint {joint.joint + 1} did not move: what belongs to it is not determined"
    return (
        f"joint {joint.joint + 1} moved by {np.degrees(joint.range):.2g} deg only: its parameters are poorly determined"
    )


def _pairing_texts(found: kr5.calibration.PostureFindings, names: list[str]) -> list[str]:
    """How measured places and joint values belong together, where they do not as they stand."""
    lost = f" (the nominal arm misses by {1e3 * found.misfit:.1f} mm as measured"
    if unrelated := found.unrelated:
        return [
            "the measurements do not belong to these joint values, in any order: from"
            f" {names[unrelated.first]} to {names[unrelated.last]} the places scatter by"
            f" {1e3 * unrelated.spread:.0f} mm{lost});"
            " is it another arm, another recording, or are the joint values in another unit or order?"
        ]
    texts = []
    if found.scaled:
        texts.append((_scale_text(found.scaled), found.scaled.misfit))
    if found.mirrored:
        text = "the measured points are mirrored: an axis of the device is reversed, or two changed"
        texts.append((text, found.mirrored.misfit))
    if found.shifted:
        texts.append((_shift_text(found.shifted, names), found.shifted.misfit))
    if found.reordered:
        texts.append((_order_text(found.reordered, names), found.reordered.misfit))
    return [f"{text}{lost}, by {1e3 * misfit:.1f} mm with that)" for text, misfit in texts]


def _scale_text(scaled: kr5.calibration.ScaledPlaces) -> str:
    found = f"the measured points are {scaled.scale:.4g} times as far apart as the arm's"
    if unit := UNITS.get(scaled.unit):
        return f"{found}: are they in {unit}?"
    return f"{found}: the scale of the device is wrong, or the arm is another one"


def _shift_text(shifted: kr5.calibration.ShiftedPlaces, names: list[str]) -> str:
    return (
        f"the measurements belong to the joint values one row {'before' if shifted.shift > 0 else 'after'}, from"
        f" {names[shifted.first]} to {names[shifted.last]}: one of the two lists is shifted"
    )


def _order_text(reordered: kr5.calibration.ReorderedRows, names: list[str]) -> str:
    wrong = list(zip(reordered.rows, reordered.belongs_to, strict=True))
    shown = [f"{names[row]} belongs to {names[other]}" for row, other in wrong[:SHOWN]]
    more = f" and {len(wrong) - SHOWN} more" if len(wrong) > SHOWN else ""
    return f"{len(wrong)} measurements stand beside the joint values of another row: that of {', '.join(shown)}{more}"


def _moved_text(moved: kr5.calibration.MovedDevice, names: list[str]) -> str:
    return (
        f"from {names[moved.row]} on the measured places are {1e3 * np.linalg.norm(moved.jump):.2g} mm elsewhere than"
        " before: did the device or the base move?"
    )
