"""Commands of a log beyond the range in which MuJoCo holds those of a model."""

from collections.abc import Mapping

import numpy as np

import kr5.cell

BEYOND = 1e-3  # [rad or m] over the end of a range


def clamped_commands(recording: kr5.cell.Recording, ranges: Mapping[int, tuple[float, float]]) -> list[str]:
    """A note on the joints whose commands leave their range (ctrlrange), which kr5 takes as they are. ranges: of
    joints from 0 [rad or m]."""
    if not recording.cell.has_torque_servos:
        return []
    told = [text for joint, span in sorted(ranges.items()) if (text := _clamped(recording, joint, *span))]
    if not told:
        return []
    return [
        f"MuJoCo clamps commands at the ctrlrange of the model, which those of the log leave: {', '.join(told)}; they"
        " are taken as they were logged. If the robot clamps them, too, cut them in the log; else widen the ctrlrange"
    ]


def _clamped(recording: kr5.cell.Recording, joint: int, low: float, high: float) -> str:
    name = f"qc{joint + 1}"
    sent = [
        np.asarray(e[name]) for e in recording.experiments if name in e.data and str(e.joint_reference) == "commanded"
    ]
    if not sent:
        return ""
    values = np.concatenate(sent)
    if values.min() >= low - BEYOND and values.max() <= high + BEYOND:
        return ""
    robot = recording.cell.robot
    unit = "m" if str(robot.dh[joint].type) == "prismatic" else "rad"
    which = robot.joint_names[joint] if robot.joint_names else f"joint {joint + 1}"
    return f"{which} from {values.min():.4g} to {values.max():.4g} {unit}, beside {low:.4g} to {high:.4g} {unit}"
