"""Motions of an arm as identification takes them, and the arm whose parameters are to be found."""

from typing import Any

import numpy as np

import kr5.cell
from kr5 import identification

GRAVITY = (0.0, 0.0, -9.81)


def arm_model(cell: kr5.cell.Cell, terms: list[identification.JointTerms]) -> identification.DynamicsModel:
    """The arm of a cell, whose parameters are to be found."""
    gravity = np.asarray(cell.robot.gravity) if cell.robot.gravity is not None else np.array(GRAVITY)
    structure = {} if cell.drives is None else {"structure": np.asarray(cell.drives.structure)}
    return identification.DynamicsModel(chain=cell.nominal_chain(), gravity=gravity, terms=terms, **structure)


def merged_motion(motions: list[identification.JointMotion]) -> identification.JointMotion:
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
