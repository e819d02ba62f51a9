"""Chains of joints."""

from ._kr5.kinematics import *  # noqa: F403
