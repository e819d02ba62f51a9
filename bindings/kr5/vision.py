"""Targets, their detection, their poses, and camera calibration (ViSP, OpenCV, AprilTag)."""

from ._kr5 import PlacedSolid, PlacedTarget, Solid, SolidKind
from ._kr5_vision import *  # noqa: F403
