"""Contact of peg, tube and bench."""

from ._functions import as_python_functions as _as_python_functions
from ._kr5.force import *  # noqa: F403

_as_python_functions(globals())
