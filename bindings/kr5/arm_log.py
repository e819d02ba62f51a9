"""From the log of a real arm and its model to a diagnosis."""

from ._functions import as_python_functions as _as_python_functions
from ._kr5.arm_log import *  # noqa: F403

_as_python_functions(globals())
