"""Models of robots: URDF, MJCF (MuJoCo), SDF (Gazebo) and cell files, read and written."""

from kr5.models.kinds import Kind
from kr5.models.mujoco_check import MujocoCheck, confirm_written
from kr5.models.reading import Model, read_model
from kr5.models.writing import FoldedParameter, Loss, WrittenModel, write_model

__all__ = [
    "FoldedParameter",
    "Kind",
    "Loss",
    "Model",
    "MujocoCheck",
    "WrittenModel",
    "confirm_written",
    "read_model",
    "write_model",
]
