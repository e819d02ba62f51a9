"""Fit of a cell: parameters from any mixture of measurements."""

from ._kr5.fit import *  # noqa: F403
