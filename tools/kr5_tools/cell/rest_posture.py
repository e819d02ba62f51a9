"""The posture in which an arm is drawn."""

import kr5.cell


def rest_posture(cell: kr5.cell.Cell, recording: kr5.cell.Recording | None) -> list[float]:
    """The first posture of a recording; else zero, or the nearest to it that the limits allow."""
    n = cell.robot.joints
    for experiment in recording.experiments if recording else ():
        if "q1" in experiment.data:
            return [float(experiment[f"q{i + 1}"][0]) for i in range(n)]
    limits = cell.robot.limits
    if limits is None:
        return [0.0] * n
    inside = [min(max(0.0, low), high) for low, high in zip(limits.lower, limits.upper)]
    middle = [(low + high) / 2 for low, high in zip(limits.lower, limits.upper)]
    return [float(z if z == 0.0 else m) for z, m in zip(inside, middle)]
