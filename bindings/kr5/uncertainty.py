"""What a covariance or a count allows one to say."""

from ._functions import as_python_functions as _as_python_functions
from ._kr5.uncertainty import *  # noqa: F403

_as_python_functions(globals())
