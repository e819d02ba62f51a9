"""Bin picking of featureless cylinders: clouds, cylinder fits, poses of pellets, grasps (PCL)."""

from ._functions import as_python_functions as _as_python_functions
from ._kr5_picking import *  # noqa: F403

_as_python_functions(globals())
