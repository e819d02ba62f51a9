"""Contact of peg, tube and bench."""

from ._kr5.force import *  # noqa: F403
