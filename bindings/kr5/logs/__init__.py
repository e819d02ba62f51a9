"""Logs of a real robot, in the formats of many recorders, as recordings that the diagnosis takes.

`read_logs` reads logs with the model of their robot, `diagnose_logs` finds why the two disagree, `read_log` gives the
columns of one file as they are, `read_motion_log` times, commands and positions of the joints in SI, and
`import_recording` makes a recording after a map (kr5-map/1). What is wrong with a file is raised as kr5.FileError, with
the remedy; what is used with caution is warned of (kr5.Caution).
"""

from kr5.logs.compared_source import ComparedSource, SourceOptions, open_source
from kr5.logs.diagnosis import diagnose_logs, read_logs
from kr5.logs.importer import import_recording
from kr5.logs.log import Log
from kr5.logs.log_file import ENDINGS, read_log
from kr5.logs.motion_log import MotionLog, read_motion_log

__all__ = [
    "ENDINGS",
    "ComparedSource",
    "Log",
    "MotionLog",
    "SourceOptions",
    "diagnose_logs",
    "import_recording",
    "open_source",
    "read_log",
    "read_logs",
    "read_motion_log",
]
