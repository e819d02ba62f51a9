"""The work from bin to tube in a simulated cell: what a supervisor asks for, and the job cycle by cycle."""

from ._functions import as_python_functions as _as_python_functions
from ._kr5_work import *  # noqa: F403

_as_python_functions(globals())
