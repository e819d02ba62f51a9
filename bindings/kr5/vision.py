"""Targets, their detection, their poses, and camera calibration (ViSP, OpenCV, AprilTag)."""

from ._functions import as_python_functions as _as_python_functions
from ._kr5 import PlacedSolid, PlacedTarget, Solid, SolidKind
from ._kr5_vision import *  # noqa: F403

_as_python_functions(globals())
