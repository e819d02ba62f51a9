"""How far a simulation is from what was recorded, and why."""

from ._functions import as_python_functions as _as_python_functions
from ._kr5.arm_log import diagnose as _diagnose
from ._kr5.gap import *  # noqa: F403

diagnose = _diagnose  # of recordings of any kind; that of the extension's own module knows no errors of an arm

_as_python_functions(globals())
