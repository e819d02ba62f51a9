"""FIGAROH's own calibration of an arm, with its parameters selected and estimated by the ways it offers.

It is called through its base class, with the cost function that its documentation gives for poses and points: position
errors in the frame of the measurement, rotation vectors, one weight for both. Its configuration is that of its
examples, brought to the format of version 1: the ridge of the old files was removed there, and `map` holds the
parameters by priors instead. `map_cv`, which chooses their size by cross-validation, is left out: it takes ten times as
long and was no better. Base and markers are unknown, as in its examples; it starts them in closed form.
"""

import contextlib
import functools
import importlib.metadata
import io
import logging
import tempfile
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml


@dataclass(frozen=True)
class Settings:
    """Which parameters are free, and how they are chosen and held ("structural" unless FIGAROH is told otherwise)."""

    level: str
    method: str

    @property
    def name(self) -> str:
        return f"{self.level} {self.method}"


LEVELS, METHODS = ("joint_offset", "full_params"), ("structural", "map")
SETTINGS = tuple(Settings(level, method) for level in LEVELS for method in METHODS)


@dataclass(frozen=True)
class Setup:
    """An arm, its measurements and what FIGAROH's example says of them."""

    urdf: Path
    data: Path
    tool_frame: str
    reference_joint: str
    markers: int  # points of a posture; 1 also for poses
    poses: bool  # whether orientations were measured
    outlier_threshold: float  # [m]
    example: Settings  # of FIGAROH's example of this arm


def configuration(setup: Setup, settings: Settings) -> dict[str, Any]:
    marker = {"reference_joint": setup.reference_joint, "measurable_dof": [True] * 3 + [setup.poses] * 3}
    return {
        "robot": {"name": setup.urdf.stem},
        "tasks": {
            "calibration": {
                "enabled": True,
                "type": "kinematic_calibration",
                "parameters": {
                    "calibration_level": settings.level,
                    "include_non_geometric": False,
                    "outlier_threshold": setup.outlier_threshold,
                    "estimation": {"method": settings.method},
                },
                "kinematics": {
                    "base_frame": "universe",
                    "tool_frame": setup.tool_frame,
                    "free_flying_base": False,
                },
                "measurements": {
                    "markers": [marker] * setup.markers,
                    "poses": {"base_pose": [0.0] * 6, "tool_pose": [0.0] * 6},
                },
                "data": {"source_file": str(setup.data), "number_of_samples": 1000},
            }
        },
    }


def version() -> str:
    return importlib.metadata.version("figaroh")


@functools.cache
def calibration_class() -> Any:
    from figaroh.calibration.base_calibration import BaseCalibration
    from figaroh.calibration.calibration_tools import calc_updated_fkm

    class Calibration(BaseCalibration):  # type: ignore[misc]
        def cost_function(self, var: np.ndarray) -> np.ndarray:
            found = calc_updated_fkm(self.model, self.data, var, self.q_measured, self.calib_config)
            return np.asarray(self._compute_logmap_residuals(self.PEE_measured, found))

    return Calibration


def fit(setup: Setup, settings: Settings, left_out: list[int]) -> Callable[[np.ndarray], np.ndarray]:
    """Calibrates on the rows that are not left out; x y z of every marker of a posture, or of the tool, 3 x n."""
    from figaroh.calibration.calibration_tools import calc_updated_fkm
    from pinocchio import RobotWrapper, buildModelFromUrdf

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "figaroh.yaml"
        file.write_text(yaml.safe_dump(configuration(setup, settings)))
        robot = RobotWrapper(buildModelFromUrdf(str(setup.urdf)))  # its own loader asks for the meshes
        calibration = calibration_class()(robot, str(file), del_list=left_out)
        calibration.calib_config.update(known_baseframe=False, known_tipframe=False)
        calibration.initialize()
        calibration.solve(enable_logging=False)
    found, config = calibration.LM_result.x, dict(calibration.calib_config, NbSample=1)

    def places(q: np.ndarray) -> np.ndarray:
        full = np.array(config["q0"], float)
        full[config["config_idx"]] = q
        out = calc_updated_fkm(calibration.model, calibration.data, found, full[None], config)
        return np.asarray(out).reshape(setup.markers, -1)[:, :3].T

    return places


@contextlib.contextmanager
def quiet() -> Any:
    """It prints a report of every fit."""
    logging.disable(logging.WARNING)
    try:
        with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logging.disable(logging.NOTSET)
