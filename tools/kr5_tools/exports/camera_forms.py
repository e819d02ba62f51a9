"""Cameras in the forms that ROS and OpenCV read."""

from collections.abc import Sequence

import numpy as np
from kr5.files.xml_text import number_text

from kr5_tools.exports.items import ExportCamera, ExportPose

PLUMB_BOB = 5  # coefficients of the usual lens model of ROS and OpenCV; the rational one has eight


def lens_model(camera: ExportCamera) -> tuple[str, list[float]]:
    """Name of the lens model of ROS, and its coefficients."""
    if any(camera.lens[PLUMB_BOB:]):
        return "rational_polynomial", list(camera.lens)
    return "plumb_bob", list(camera.lens[:PLUMB_BOB])


def _list(values: Sequence[float] | np.ndarray) -> str:
    return ", ".join(_float(v) for v in np.ravel(values))


def _float(value: float) -> str:
    """With a point, so that no reader takes it for a whole number."""
    text = number_text(value)
    return text if set(text) & set(".en") else f"{text}.0"


def _ros_matrix(name: str, values: np.ndarray) -> str:
    rows, cols = values.shape
    return f"{name}:\n  rows: {rows}\n  cols: {cols}\n  data: [{_list(values)}]\n"


def camera_info(camera: ExportCamera) -> str:
    """YAML of camera_info, as camera_calibration_parsers of ROS read it; rectified is as seen."""
    model, lens = lens_model(camera)
    projection = np.hstack([camera.matrix, np.zeros((3, 1))])
    return (
        f"image_width: {camera.width}\nimage_height: {camera.height}\ncamera_name: {camera.name}\n"
        + _ros_matrix("camera_matrix", camera.matrix)
        + f"distortion_model: {model}\n"
        + _ros_matrix("distortion_coefficients", np.array([lens]))
        + _ros_matrix("rectification_matrix", np.eye(3))
        + _ros_matrix("projection_matrix", projection)
    )


def _opencv_matrix(name: str, values: np.ndarray) -> str:
    rows, cols = values.shape
    return f"{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {cols}\n   dt: d\n   data: [ {_list(values)} ]\n"


def opencv(cameras: list[ExportCamera], poses: list[ExportPose]) -> str:
    """YAML that cv::FileStorage reads: camera_matrix, distortion_coefficients, and each pose as a 4x4 matrix [m]."""
    out = "%YAML:1.0\n---\n"
    for camera in cameras:
        out += f"image_width: {camera.width}\nimage_height: {camera.height}\n"
        out += _opencv_matrix("camera_matrix", camera.matrix)
        out += _opencv_matrix("distortion_coefficients", np.array([lens_model(camera)[1]]))
    return out + "".join(_opencv_matrix(pose.name, pose.T) for pose in poses)
