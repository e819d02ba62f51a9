"""What of a result other programs can use: poses of frames, and cameras."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from kr5.files.result_types import ResultData

LENS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")


@dataclass
class ExportPose:
    """A frame in another: T_parent_child [m]."""

    title: str  # in words, for people
    parent: str
    child: str
    T: np.ndarray
    main: bool = True  # whether the calibration is about it

    @property
    def name(self) -> str:
        """As a field is called, of letters, digits and underscores."""
        words = ("".join(c if c.isalnum() else "_" for c in word) for word in (self.parent, self.child))
        return f"T_{'_'.join(words)}"


@dataclass
class ExportCamera:
    """Lens and sensor of a camera."""

    title: str
    name: str
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    lens: tuple[float, ...]  # k1 k2 p1 p2 k3 k4 k5 k6

    @property
    def matrix(self) -> np.ndarray:
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])


@dataclass
class ExportItems:
    poses: list[ExportPose]
    cameras: list[ExportCamera]

    def main_poses(self) -> list[ExportPose]:
        return [pose for pose in self.poses if pose.main]


def items_of(data: ResultData) -> ExportItems:
    """The poses and cameras of a result file; none where it has none."""
    result = data.get("result") or {}
    if not (result.get("fit") or {"usable": True}).get("usable", True):
        return ExportItems([], [])
    poses = _POSES.get(data.get("format", ""), lambda _: [])(result)
    lens = result.get("camera") or data.get("camera") or (result.get("cell") or {}).get("camera")
    return ExportItems(poses, _cameras(lens))


def _cameras(lens: object) -> list[ExportCamera]:
    if not (isinstance(lens, dict) and all(lens.get(key) for key in ("width", "height", "fx", "fy"))):
        return []
    numbers = {key: float(lens[key]) for key in ("fx", "fy", "cx", "cy")}
    values = tuple(float(lens.get(key) or 0.0) for key in LENS)
    return [ExportCamera("Camera", "camera", int(lens["width"]), int(lens["height"]), **numbers, lens=values)]


def _pose(result: Mapping[str, object], key: str, title: str, main: bool = True) -> list[ExportPose]:
    """A pose of the result by its key T_parent_child, unless it was not estimated."""
    T = result.get(key)
    if T is None or (T := np.array(T, float)).shape != (4, 4) or np.array_equal(T, np.eye(4)):
        return []
    _, parent, child = key.split("_")
    return [ExportPose(title, parent, child, T, main)]


def _hand_eye_poses(result: Mapping[str, object]) -> list[ExportPose]:
    in_hand = result.get("mount", "eye_in_hand") == "eye_in_hand"
    mount, fixed = ("flange", "base") if in_hand else ("base", "flange")
    poses = _pose(result, "T_mount_camera", f"Camera on the {mount}" if in_hand else "Camera in the base")
    poses += _pose(result, "T_fixed_target", "Target in the base" if in_hand else "Target on the flange", main=False)
    for pose in poses:
        pose.parent = {"mount": mount, "fixed": fixed}[pose.parent]
    return poses


def _timed_poses(result: Mapping[str, object]) -> list[ExportPose]:
    camera = _pose(result, "T_hand_camera", "Camera on the hand")
    return camera + _pose(result, "T_base_world", "World of the camera in the base", main=False)


def _tool_poses(result: Mapping[str, Any]) -> list[ExportPose]:
    if result.get("tip") is None:
        return []
    T = np.eye(4)
    T[:3, 3] = result["tip"]
    return [ExportPose("Tool tip on the flange, with the axes of the flange", "flange", "tool", T)]


def _kinematics_poses(result: Mapping[str, object]) -> list[ExportPose]:
    return [
        *_pose(result, "T_world_base", "Base in the frame of the measuring device"),
        *_pose(result, "T_flange_tool", "Measured tool on the flange"),
        *_pose(result, "T_flange_camera", "Camera on the flange"),
        *_pose(result, "T_base_target", "Target in the base", main=False),
    ]


def _cell_poses(result: Mapping[str, object]) -> list[ExportPose]:
    return _hand_eye_poses(result) + _pose(result, "T_flange_scanner", "Line scanner on the flange")


def _laser_poses(result: Mapping[str, object]) -> list[ExportPose]:
    return _pose(result, "T_flange_scanner", "Line scanner on the flange")


def _map_poses(result: Mapping[str, Any]) -> list[ExportPose]:
    markers = (result.get("target") or {}).get("map") or []
    return [
        ExportPose(f"Marker {m['id']} in the map", "map", f"marker_{m['id']}", np.array(m["T_target_marker"], float))
        for m in markers
    ]


_POSES = {
    "kr5-hand-eye/1": _hand_eye_poses,
    "kr5-timed-hand-eye/1": _timed_poses,
    "kr5-tool/1": _tool_poses,
    "kr5-kinematics/1": _kinematics_poses,
    "kr5-cell-calibration/1": _cell_poses,
    "kr5-laser/1": _laser_poses,
    "kr5-marker-map/1": _map_poses,
}
