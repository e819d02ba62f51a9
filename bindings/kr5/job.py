"""The job from bin to tube: phases, stop, journal, restart, statistics."""

from ._kr5.job import *  # noqa: F403
