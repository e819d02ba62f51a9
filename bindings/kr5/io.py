"""Files of structs and numbers."""

from ._functions import as_python_functions as _as_python_functions
from ._kr5.io import *  # noqa: F403

_as_python_functions(globals())
