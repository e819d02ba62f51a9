"""Hand-eye, tool and what can go wrong with them."""

from ._kr5.calibration import *  # noqa: F403
