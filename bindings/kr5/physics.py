"""The laws of a cell with the effects it carries, which every simulator shares."""

from ._functions import as_python_functions as _as_python_functions
from ._kr5.physics import *  # noqa: F403

_as_python_functions(globals())
