"""What the sensors of a cell would show, without a physics engine."""

from ._functions import as_python_functions as _as_python_functions
from ._kr5.predict import *  # noqa: F403

_as_python_functions(globals())
