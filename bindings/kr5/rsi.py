"""KUKA's RobotSensorInterface: telegrams, files for the controller, the link, an emulated controller, results
between computers."""

from ._functions import as_python_functions as _as_python_functions
from ._kr5.rsi import *  # noqa: F403

_as_python_functions(globals())
