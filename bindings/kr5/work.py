"""The work from bin to tube in a simulated cell: what a supervisor asks for, and the job cycle by cycle."""

from ._kr5_work import *  # noqa: F403
