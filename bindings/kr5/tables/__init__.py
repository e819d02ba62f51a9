"""Tables of numbers, logs and lists of poses, read alike for every command.

`read_table` finds in a file what its roles ask for, brings it to SI and says in notes how; `read_pose_list` reads
poses. What is wrong with a file is raised as kr5.IoError or kr5.InvalidArgument, with line, column and remedy.
"""

from kr5.tables.options import TableOptions
from kr5.tables.pose_list import PoseList, read_pose_list
from kr5.tables.read_table import read_table
from kr5.tables.roles import PointsRole, PoseRole, Role, TextRole, Units, joints_role
from kr5.tables.table import Table

__all__ = [
    "PointsRole",
    "PoseList",
    "PoseRole",
    "Role",
    "Table",
    "TableOptions",
    "TextRole",
    "Units",
    "joints_role",
    "read_pose_list",
    "read_table",
]
