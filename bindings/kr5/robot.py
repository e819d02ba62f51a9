"""Readings and commands of a robot, what turns sensors into readings, and a loopback robot for tests."""

from ._functions import as_python_functions as _as_python_functions
from ._kr5.robot import *  # noqa: F403

_as_python_functions(globals())
