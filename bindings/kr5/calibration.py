"""Hand-eye, tool and what can go wrong with them."""

from ._functions import as_python_functions as _as_python_functions
from ._kr5.calibration import *  # noqa: F403

_as_python_functions(globals())
