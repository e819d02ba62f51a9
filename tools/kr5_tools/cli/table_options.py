"""Options of commands that take tables, and what is told of how these were read."""

from collections.abc import Sequence
from typing import Annotated, Literal

import typer

from kr5_tools.cli.terminal import print_note

ColumnsOption = Annotated[
    str | None,
    typer.Option(
        metavar="NAMES",
        help=(
            "Columns of the table in their order, where it has no names or others: t,q{1-6},tau{1-6} \\[N mm],_,...;"
            " a minus turns a sign, _ is not used, ... are all that follow."
        ),
    ),
]
EpisodesOption = Annotated[
    str,
    typer.Option(
        "--episodes",
        metavar="NUMBERS",
        help="Recordings of a data set that has several (LeRobot, HDF5 of robomimic): 3,7-12; by default some of them.",
    ),
]
CheckOption = Annotated[
    str,
    typer.Option(
        "--check",
        metavar="NAMES",
        help="Of several logs or episodes, those kept to check the result: names of files, or numbers such as 7-9; by"
        " default the last ones.",
    ),
]
EpisodeOption = Annotated[
    str, typer.Option("--episodes", metavar="NUMBER", help="Recording of a data set that has several, such as 3.")
]
JointColumns = Annotated[
    str | None, typer.Option(help="Columns of the joints, e.g. j1,j2,j3 or joint_{}; by default q1, q2, …")
]
PositionColumns = Annotated[str | None, typer.Option(help="Columns of the measured points, three a point.")]
LengthUnit = Annotated[
    Literal["m", "mm"] | None,
    typer.Option("--length-unit", help="Unit of lengths; by default as names or numbers show, else m."),
]
AngleUnit = Annotated[
    Literal["rad", "deg"] | None,
    typer.Option("--angle-unit", help="Unit of angles; by default as names or numbers show, else rad."),
]
Convention = Annotated[
    str | None,
    typer.Option(
        help="quaternion | rotation_vector | rpy | kuka | quaternion_wxyz | matrix; by default from the names of the"
        " columns."
    ),
]
PoseLength = Annotated[
    Literal["m", "mm"] | None,
    typer.Option(
        "--length-unit", help="Unit of x y z; by default as names or numbers show, else mm for kuka, m for others."
    ),
]
PoseAngle = Annotated[
    Literal["rad", "deg"] | None,
    typer.Option(
        "--angle-unit", help="Unit of angles; by default as names or numbers show, else deg for kuka, rad for others."
    ),
]
RobotMeaning = Annotated[
    Literal["T_base_flange", "T_flange_base"] | None,
    typer.Option(help="Pairs: meaning of the robot poses; by default as the data show, else as the format states."),
]


CameraMeaning = Annotated[
    Literal["T_camera_target", "T_target_camera"] | None,
    typer.Option(help="Pairs: meaning of the camera poses; by default as the data show, else T_camera_target."),
]


def tell_notes(notes: Sequence[str]) -> None:
    """How tables were read, where that is not plain."""
    for note in notes:
        print_note(f"{note}{'' if note.endswith(('?', '.')) else '.'}")
