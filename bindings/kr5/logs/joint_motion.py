"""Motions of an arm as identification takes them, and the arm whose parameters are to be found."""

from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from kr5 import identification
from kr5.logs.values import joint_torques

GRAVITY = (0.0, 0.0, -9.81)


def arm_model(cell: Any, terms: list[Any]) -> Any:
    """The arm of a cell, whose parameters are to be found."""
    gravity = np.asarray(cell.robot.gravity) if cell.robot.gravity is not None else np.array(GRAVITY)
    structure = {} if cell.drives is None else {"structure": np.asarray(cell.drives.structure)}
    return identification.DynamicsModel(chain=cell.nominal_chain(), gravity=gravity, terms=terms, **structure)


def merged_motion(motions: list[Any]) -> Any:
    """Motions one after the other, each of them at least one run."""
    starts, at = [], 0
    for m in motions:
        starts += [at + s for s in (m.run_starts or [0])]
        at += len(m.t)
    names = ["q", "qd", "qdd", "tau"]
    if all(np.asarray(m.temperature).size for m in motions):
        names.append("temperature")
    stacked = {name: np.concatenate([np.asarray(getattr(m, name)) for m in motions]) for name in names}
    t = np.concatenate([np.asarray(m.t) for m in motions])
    return identification.JointMotion(t=t, run_starts=starts, **stacked)


def motion_of(cell: Any, experiment: Any, delay: float = 0.0) -> Any:
    """The motion of an experiment on measured positions, with its torques on the joint side.

    delay: by which the torques were logged later than the positions [s]. Rows whose shifted time lies outside the log
    are left out.
    """
    n, t = cell.robot.joints, np.asarray(experiment["t"])
    course = CubicSpline(t, np.column_stack([experiment[f"qc{k + 1}"] for k in range(n)]))
    family = "tau" if "tau1" in experiment.data else "i"
    loads = np.column_stack([experiment[f"{family}{k + 1}"] for k in range(n)])
    tau = joint_torques(cell.drives, loads) if family == "i" else loads
    shown = (t - delay >= t[0]) & (t - delay <= t[-1])
    t, at = t[shown], t[shown] - delay
    return identification.JointMotion(t=t, q=course(at), qd=course(at, 1), qdd=course(at, 2), tau=tau[shown])
