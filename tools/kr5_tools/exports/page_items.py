"""What the page of a result offers to copy."""

from typing import Any

from kr5.files.result_types import ResultData

from kr5_tools.exports import camera_forms, pose_forms
from kr5_tools.exports.items import ExportCamera, ExportPose, items_of

MOST = 12  # items on a page; files of --export hold them all


def page_items(data: ResultData) -> list[dict[str, Any]]:
    """Each pose and camera of a result with its texts: title, and forms of title and text."""
    found = items_of(data)
    items = [_pose_item(pose) for pose in found.poses[:MOST]] + [_camera_item(camera) for camera in found.cameras]
    return [{"title": title, "forms": [{"title": t, "text": x} for t, x in forms]} for title, forms in items]


def _pose_item(pose: ExportPose) -> tuple[str, list[tuple[str, str]]]:
    one = [pose]
    return pose.title, [
        ("ROS 2 command", pose_forms.ros_command(one)),
        ("URDF joint", pose_forms.urdf_joint(pose)),
        ("ROS 2 launch file (XML)", pose_forms.launch_xml(one)),
        ("4×4 matrix", pose_forms.matrix_text(one)),
        ("OpenCV YAML", camera_forms.opencv([], one)),
        ("JSON", pose_forms.json_text(one)),
    ]


def _camera_item(camera: ExportCamera) -> tuple[str, list[tuple[str, str]]]:
    return camera.title, [
        ("ROS camera_info", camera_forms.camera_info(camera)),
        ("OpenCV YAML", camera_forms.opencv([camera], [])),
    ]
