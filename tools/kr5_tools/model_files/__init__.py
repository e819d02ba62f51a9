"""Models of robots: URDF, MJCF (MuJoCo), SDF (Gazebo) and cell files, read and written."""

from kr5_tools.model_files.kinds import Kind
from kr5_tools.model_files.reading import Model, read_model
from kr5_tools.model_files.writing import FoldedParameter, Loss, WrittenModel, write_model

__all__ = ["FoldedParameter", "Kind", "Loss", "Model", "WrittenModel", "read_model", "write_model"]
