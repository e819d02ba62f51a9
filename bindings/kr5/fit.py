"""Fit of a cell: parameters from any mixture of measurements."""

from ._functions import as_python_functions as _as_python_functions
from ._kr5.fit import *  # noqa: F403

_as_python_functions(globals())
