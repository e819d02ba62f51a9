"""Errors of an identified arm on postures that took no part in the fit (`--check`), beside those of the nominal arm."""

from collections.abc import Mapping
from typing import Any

import kr5
import kr5.calibration
import kr5.kinematics
from kr5 import calibration


def require_placing(fitted: list[calibration.ArmPosture], further: list[calibration.ArmPosture]) -> None:
    """Refuses too few further postures to tell what the fit does not say of their device."""
    least = calibration.MIN_POSTURES_TO_PLACE
    if len(further) < least and calibration.need_placing(fitted, further):
        raise kr5.InvalidArgument(
            f"--check: found {len(further)} postures, expected at least {least}: the postures of the fit do"
            " not say where this device stands and what it measures on the flange, which takes that many"
        )


def judge(
    result: kr5.calibration.KinematicsResult,
    chain: kr5.kinematics.DhChain,
    fitted: list[calibration.ArmPosture],
    further: list[calibration.ArmPosture],
    known_distances: list[calibration.SocketDistance],
    options: kr5.calibration.KinematicsOptions,
) -> tuple[dict[str, Any], list[str]]:
    """Errors on the further postures [mm], or why they tell of none."""
    if not further:
        return {}, []
    found = calibration.evaluate_arm(result, chain, fitted, further, known_distances, options)
    if not found.fit.usable:
        return {}, [f"the further postures do not judge the arm: {found.fit.message}"]
    errors = {
        "postures": len(further),
        "placed_on_them": found.placed,
        "nominal_mean_mm": 1e3 * found.nominal_mean,
        "mean_mm": 1e3 * found.mean,
        "rms_mm": 1e3 * found.rms,
        "max_mm": 1e3 * found.max,
    }
    return errors, []


def held_out_text(held_out: Mapping[str, object]) -> str:
    """Part of a verdict."""
    where = ", on which device and measured point were placed," if held_out["placed_on_them"] else ""
    return (
        f"on {held_out['postures']} further postures{where} mean {held_out['nominal_mean_mm']:.3f} mm and"
        f" {held_out['mean_mm']:.3f} mm"
    )
