"""Errors of an identified arm on postures that took no part in the fit (`--check`), beside those of the nominal arm."""

from collections.abc import Mapping
from typing import Any

import kr5
import kr5.calibration
import kr5.kinematics
import numpy as np
from kr5 import calibration

LEAST_TO_PLACE = 6  # postures by which a device and the measured point are placed
HELD = 1e-9  # standard deviation of parameters that stay [m or rad]


def need_placing(fitted: list[calibration.ArmPosture], further: list[calibration.ArmPosture]) -> bool:
    """Whether the fit does not say where the device, or the point that it measures, is: postures in sockets tell
    nothing of a device, and poses tell nothing of a point. Complains when there are too few postures to tell it."""
    known = {_kind(p) for p in fitted if _kind(p) is not None}
    unknown = [p for p in further if _kind(p) not in known]
    if unknown and len(further) < LEAST_TO_PLACE:
        raise kr5.InvalidArgument(
            f"--check: found {len(further)} postures, expected at least {LEAST_TO_PLACE}: the postures of the fit do"
            " not say where this device stands and what it measures on the flange, which takes that many"
        )
    return bool(unknown)


def judge(
    result: kr5.calibration.KinematicsResult,
    chain: kr5.kinematics.DhChain,
    fitted: list[calibration.ArmPosture],
    further: list[calibration.ArmPosture],
    known_distances: list[calibration.SocketDistance],
    options: kr5.calibration.KinematicsOptions,
) -> dict[str, Any]:
    """Errors on the further postures [mm]. Base and tool are those of the fit; the nominal arm gets its own from the
    same postures, distances and options. What the fit does not say of them, both take from the further postures."""
    if not further:
        return {}
    placed = need_placing(fitted, further)
    if placed:
        held = _arm_held(options, [])
        straight = [_corrected(result, p) for p in further]
        ours = _distances(calibration.calibrate_kinematics(result.arm, straight, options=held), straight)
        nominal = calibration.calibrate_kinematics(chain, further, options=held)
    else:
        ours = _distances(result, further)
        sound = [p for p, r in zip(fitted, result.postures, strict=True) if not r.outlier]
        kept = [name for name in options.hold if not name.startswith(("arm", "joint_errors"))]
        nominal = calibration.calibrate_kinematics(chain, sound, known_distances, _arm_held(options, kept))
    theirs = _distances(nominal, further)
    return {
        "postures": len(further),
        "placed_on_them": placed,
        "nominal_mean_mm": float(1e3 * theirs.mean()),
        "mean_mm": float(1e3 * ours.mean()),
        "rms_mm": float(1e3 * np.sqrt((ours**2).mean())),
        "max_mm": float(1e3 * ours.max()),
    }


def held_out_text(held_out: Mapping[str, object]) -> str:
    """Part of a verdict."""
    where = ", on which device and measured point were placed," if held_out["placed_on_them"] else ""
    return (
        f"on {held_out['postures']} further postures{where} mean {held_out['nominal_mean_mm']:.3f} mm and"
        f" {held_out['mean_mm']:.3f} mm"
    )


def _kind(posture: kr5.calibration.ArmPosture) -> int | None:
    """What a device measured of a posture: a pose (0), or how many points; None where no device did."""
    if posture.T_world_tool is not None:
        return 0
    return posture.points.shape[1] or None


def _arm_held(options: kr5.calibration.KinematicsOptions, hold: list[str]) -> Any:
    """The options of the fit, for an arm that stays as it is. Nothing is an outlier: that was decided in the fit."""
    fields = options.to_dict() | {
        "hold": hold,
        "tolerance_length": HELD,
        "tolerance_angle": HELD,
        "joint_errors": False,
        "elasticity": False,
        "outlier_false_alarm": 0.0,
    }
    return calibration.KinematicsOptions.from_dict(fields)


def _corrected(result: kr5.calibration.KinematicsResult, posture: kr5.calibration.ArmPosture) -> Any:
    """A posture with the joint values at which the identified arm stood."""
    torques = posture.torques if len(result.compliances) else np.zeros(0)
    return calibration.ArmPosture.from_dict(posture.to_dict() | {"q": result.corrected(posture.q, torques)})


def _distances(result: kr5.calibration.KinematicsResult, postures: list[kr5.calibration.ArmPosture]) -> np.ndarray:
    """Distance of each measured point from where the arm puts it [m]."""
    out = []
    for posture in postures:
        T = result.T_world_base @ result.flange(posture.q, posture.torques)
        if posture.T_world_tool is not None:
            out.append(np.linalg.norm((T @ result.T_flange_tool)[:3, 3] - posture.T_world_tool[:3, 3]))
        else:
            off = T[:3, :3] @ result.points + T[:3, 3:] - posture.points
            out.append(np.sqrt(np.nanmean((off**2).sum(0))))
    return np.array(out)
