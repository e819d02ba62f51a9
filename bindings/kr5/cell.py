"""The description of a robot cell and of its recordings."""

from ._kr5.cell import *  # noqa: F403
