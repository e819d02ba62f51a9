"""Identification of an arm's dynamics, drives and sensors from its logs."""

from ._functions import as_python_functions as _as_python_functions
from ._kr5.identification import *  # noqa: F403

_as_python_functions(globals())
