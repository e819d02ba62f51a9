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
