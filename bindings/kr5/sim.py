"""The cell in DART: arm, drives, sensors and contact stepped through time, and scenes that judge what comes of it."""

from ._functions import as_python_functions as _as_python_functions
from ._kr5_sim import *  # noqa: F403

_as_python_functions(globals())
