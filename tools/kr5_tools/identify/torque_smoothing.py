"""Whether torques are fitted as they were logged, or low-passed as the positions are: as a part of the motion that is
left out is predicted better. Smoothing takes noise away, and rounds off the steps of dry friction."""

from dataclasses import replace

import kr5
import kr5.identification
import numpy as np
from kr5 import identification
from kr5.logs.joint_motion import merged_motion

from kr5_tools.identify.dynamics_parts import condition_parts
from kr5_tools.identify.motion_logs import MotionLogs, split_log

LEFT_OUT = 1 / 3  # of the motions that are fitted
MARGIN = 0.95  # share of the error with smoothing that torques as logged must stay below


def choose_smoothing(
    motions: MotionLogs,
    log: kr5.identification.ConditioningOptions,
    model: kr5.identification.DynamicsModel,
) -> str:
    """Switches the smoothing off where torques as logged predict better, and says so; else returns nothing.

    The parts that judge the result take no part in the choice.
    """
    halves = [split_log(one, LEFT_OUT) for one in motions.fit]
    tried = replace(motions, fit=[first for first, _ in halves], check=[last for _, last in halves])
    smoothed, logged = (_error(tried, log, model, smooth) for smooth in (True, False))
    log.smooth_torques = not logged < MARGIN * smoothed
    if log.smooth_torques:
        return ""
    return (
        "torques are fitted as logged (--no-smooth-torques): on a third of the motion left out their error is"
        f" {100 * logged:.3g} % instead of {100 * smoothed:.3g} %"
    )


def _error(
    motions: MotionLogs,
    log: kr5.identification.ConditioningOptions,
    model: kr5.identification.DynamicsModel,
    smooth: bool,
) -> float:
    """Of the torques of the part left out, as logged, over their size; infinite where there is no answer. By the usual
    estimator, whose choice of terms would take longer than the fit."""
    plain = identification.DynamicsOptions(held_out=0.0)
    log.smooth_torques = smooth
    try:
        fit, check = condition_parts(motions, log)
        result = identification.identify_dynamics(merged_motion([p.motion for p in fit.parts]), model, plain)
    except kr5.Error:
        return np.inf
    if not result.fit.usable:
        return np.inf
    predicted = np.asarray(identification.predict_torques(result, merged_motion([p.motion for p in check.parts])))
    return float(identification.torque_error(check.measured(), predicted).total)
