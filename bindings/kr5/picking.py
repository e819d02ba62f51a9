"""Bin picking of featureless cylinders: clouds, cylinder fits, poses of pellets, grasps (PCL)."""

from ._kr5_picking import *  # noqa: F403
