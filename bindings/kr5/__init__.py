"""Calibrate, simulate and diagnose a robot cell.

Poses are 4x4 arrays, `T_a_b` is the pose of b in a, everything is in SI units; see CONVENTIONS.md.
`kr5.vision` (ViSP, OpenCV), `kr5.picking` (PCL) and `kr5.sim` (DART) are imported when they are first used.
"""

import importlib
import pkgutil
from pathlib import Path

from ._errors import Caution, Errors, FileError, Implausible
from ._functions import as_python_functions as _as_python_functions
from ._kr5 import *  # noqa: F403
from ._kr5 import __version__
from ._points import points_from_columns, points_from_rows
from ._pose_figures import xyzrpy_with_std
from ._share import share

_FOLDER = str(Path(__file__).parent)
_MODULES = sorted(module.name for module in pkgutil.iter_modules([_FOLDER]) if not module.name.startswith("_"))

for _name in _MODULES:
    globals().pop(_name, None)  # of the extension; __getattr__ imports the Python module of that name

_as_python_functions(globals())


def __getattr__(name: str):
    if name in _MODULES:
        try:
            return importlib.import_module(f"{__name__}.{name}")
        except ModuleNotFoundError as error:
            raise AttributeError(f"this kr5 was built without the module '{name}' ({error})") from error
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")


def __dir__():
    return sorted({*globals(), *_MODULES})
