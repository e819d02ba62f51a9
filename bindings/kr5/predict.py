"""What the sensors of a cell would show, without a physics engine."""

from ._kr5.predict import *  # noqa: F403
