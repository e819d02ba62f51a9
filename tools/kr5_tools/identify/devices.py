"""Simulated measuring devices that watch an arm whose joints turn one at a time: a tracker of one reflector, or a
camera on the flange before a map of markers."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import kr5
import kr5.cell
import numpy as np
from kr5 import calibration, vision

REFLECTOR = np.array([0.25, 0.0, 0.15, 1.0])  # on the flange: beside its axis, so that the last joint moves it [m]
TRACKER = (3.0, 1.0, 0.5, 0.1, 0.2, -2.0)  # the device in the base; it does not matter where
# The book's boards: several, not in one plane, over whatever the camera looks at during the widest turn.
BOARDS, SPACING, DEPTH, TILT = 3, 0.5, 0.1, np.radians(20)  # boards to each side of the middle, apart, near and far [m]
MARKERS, SIDE, PITCH = 3, 0.08, 0.1  # in a row of a board; side, distance [m]
DISTANCE = 1.0  # of the boards from the camera in the home posture [m]
MARGIN = 5.0  # of an image in which no corner is found [px]

Turn = list[tuple[float, np.ndarray]]  # joint value and T_base_flange of each sample


@dataclass
class Device:
    """A measuring device with its usual noise, in the unit of `unit`, and how often it measures during a turn."""

    name: str
    label: str
    noise: float
    unit: str
    samples: int
    measure: Callable[[Turn, float, np.random.Generator], list[Any]]
    begin: Callable[[np.random.Generator], None] = lambda random: None  # before each identification


def make_devices(cell: kr5.cell.Cell, home_flange: np.ndarray, map_error: float, seed: int) -> dict[str, Device]:
    """The devices of Hayat et al. 2022, section 4.4.1, by name. A total station is aimed by hand, a laser tracker
    follows the reflector while the joint turns slowly."""
    camera = MarkerCamera(cell, home_flange, map_error, seed)
    return {
        d.name: d
        for d in (
            Device("total_station", "total station", 1.0, "mm", 20, track_reflector),
            Device("laser_tracker", "laser tracker", 0.01, "mm", 200, track_reflector),
            Device("camera", "camera", 0.2, "px", 40, camera.measure, camera.measure_map),
        )
    }


def track_reflector(turn: Turn, noise: float, random: np.random.Generator) -> list[Any]:
    """Places of the reflector, with a noise in millimetres."""
    T_device_base = kr5.to_pose(TRACKER)
    return [
        calibration.JointSample(
            points=((T_device_base @ T @ REFLECTOR)[:3] + random.normal(0, 1e-3 * noise, 3))[:, None], q=q
        )
        for q, T in turn
    ]


class MarkerCamera:
    """The camera of a cell on its flange, before boards of markers whose map is known with an error."""

    def __init__(self, cell: kr5.cell.Cell, home_flange: np.ndarray, map_error: float, seed: int) -> None:
        c = cell.camera
        k1, k2, p1, p2, k3 = (list(c.distortion.values) + [0.0] * 5)[:5]
        self.lens = kr5.Pinhole(
            width=c.width, height=c.height, fx=c.fx, fy=c.fy, cx=c.cx, cy=c.cy, k1=k1, k2=k2, p1=p1, p2=p2, k3=k3
        )
        self.T_flange_camera = (
            cell.tool.T_flange_tool @ c.T_tool_camera if c.T_flange_camera is None else c.T_flange_camera
        )
        self.corners = (
            home_flange @ self.T_flange_camera @ _boards(np.random.default_rng(seed))
        )  # of 4 columns a marker, in the base
        self.map_error = map_error
        self.offsets = np.zeros((3, self.corners.shape[1]))

    def measure_map(self, random: np.random.Generator) -> None:
        """Another map of the markers, as it would be measured: each marker off by the error of the map."""
        markers = self.corners.shape[1] // 4
        self.offsets = np.repeat(random.normal(0, self.map_error, (3, markers)), 4, axis=1)

    def view(self, T_base_flange: np.ndarray, noise: float, random: np.random.Generator) -> Any:
        """What the camera sees: corners of markers that are in the image as a whole."""
        T = np.linalg.inv(T_base_flange @ self.T_flange_camera)
        p = (T @ self.corners)[:3]
        limit = 1.1 * np.tan(self._half_angles())
        ahead = (p[2] > 0.1) & (np.abs(p[0]) < limit[0] * p[2]) & (np.abs(p[1]) < limit[1] * p[2])
        places = np.flatnonzero(np.repeat(ahead.reshape(-1, 4).all(axis=1), 4))
        pixels = self.lens.project(p[:, places])
        size = np.array([[self.lens.width], [self.lens.height]])
        inside = ((pixels > MARGIN) & (pixels < size - MARGIN)).all(axis=0)
        seen = np.repeat(inside.reshape(-1, 4).all(axis=1), 4)
        return kr5.View(
            points=self.corners[:3, places[seen]] + self.offsets[:, places[seen]],
            pixels=pixels[:, seen] + random.normal(0, noise, (2, int(seen.sum()))),
        )

    def measure(self, turn: Turn, noise: float, random: np.random.Generator) -> list[Any]:
        """Poses of the camera before the map, from its noisy pixels, as the library estimates them."""
        out = []
        for q, T in turn:
            pose = vision.estimate_target_pose(self.view(T, noise, random), self.lens)
            if pose.fit.usable:
                out.append(calibration.JointSample(T_world_tool=np.linalg.inv(pose.T_camera_target), q=q))
        return out

    def _half_angles(self) -> np.ndarray:
        lens = self.lens
        return np.arctan([max(lens.cx, lens.width - lens.cx) / lens.fx, max(lens.cy, lens.height - lens.cy) / lens.fy])


def _boards(random: np.random.Generator) -> np.ndarray:
    """Corners of every marker before the camera, 4 x n with ones, four columns a marker."""
    start = -0.5 * ((MARKERS - 1) * PITCH + SIDE)
    square = SIDE * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    on_board = np.vstack([square + start + PITCH * np.array([i, j]) for i in range(MARKERS) for j in range(MARKERS)])
    flat = np.column_stack([on_board, np.zeros(len(on_board)), np.ones(len(on_board))]).T
    out = []
    for i in range(-BOARDS, BOARDS + 1):
        for j in range(-BOARDS, BOARDS + 1):
            depth = DISTANCE + (DEPTH if (i + j) % 2 else -DEPTH)
            tilt = random.uniform(-TILT, TILT, 2)
            out.append(kr5.to_pose([SPACING * i, SPACING * j, depth, tilt[0], tilt[1], 0.0]) @ flat)
    return np.hstack(out)
