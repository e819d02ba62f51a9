"""The laws of a cell with the effects it carries, which every simulator shares."""

from ._kr5.physics import *  # noqa: F403
