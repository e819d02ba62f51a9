"""Files of structs and numbers."""

from ._kr5.io import *  # noqa: F403
