"""From the log of a real arm and its model to a diagnosis."""

from ._kr5.arm_log import *  # noqa: F403
