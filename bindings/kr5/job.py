"""The job from bin to tube: phases, stop, journal, restart, statistics."""

from ._functions import as_python_functions as _as_python_functions
from ._kr5.job import *  # noqa: F403

_as_python_functions(globals())
