"""How far a simulation is from what was recorded, and why."""

from ._kr5.gap import *  # noqa: F403
