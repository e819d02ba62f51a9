"""Options of how poses are written in a table."""

from typing import Annotated, Literal

import typer

Convention = Annotated[
    str | None,
    typer.Option(help="quaternion | rotation_vector | rpy | kuka; by default from the names of the columns."),
]


PoseLength = Annotated[Literal["m", "mm"] | None, typer.Option(help="Unit of x y z; by default mm for kuka, else m.")]


PoseAngle = Annotated[
    Literal["rad", "deg"] | None, typer.Option(help="Unit of angles; by default deg for kuka, else rad.")
]


JointColumns = Annotated[
    str | None, typer.Option(help="Columns of the joints, e.g. j1,j2,j3 or joint_{}; by default q1, q2, …")
]


PositionColumns = Annotated[str | None, typer.Option(help="Columns of the measured points, three a point.")]


LengthUnit = Annotated[Literal["m", "mm"], typer.Option(help="Unit of lengths.")]


AngleUnit = Annotated[Literal["rad", "deg"], typer.Option(help="Unit of joint angles.")]


RobotMeaning = Annotated[
    Literal["T_base_flange", "T_flange_base"] | None,
    typer.Option(help="Pairs: meaning of the robot poses; by default as the data show, else as the format states."),
]


CameraMeaning = Annotated[
    Literal["T_camera_target", "T_target_camera"] | None,
    typer.Option(help="Pairs: meaning of the camera poses; by default as the data show, else T_camera_target."),
]
