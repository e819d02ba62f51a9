"""Chains of joints."""

from ._functions import as_python_functions as _as_python_functions
from ._kr5.kinematics import *  # noqa: F403

_as_python_functions(globals())
