"""The description of a robot cell and of its recordings."""

from ._functions import as_python_functions as _as_python_functions
from ._kr5.cell import *  # noqa: F403

_as_python_functions(globals())
