"""The cell in DART: arm, drives, sensors and contact stepped through time, and scenes that judge what comes of it."""

from ._kr5_sim import *  # noqa: F403
