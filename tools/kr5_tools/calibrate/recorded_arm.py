"""What a recording and its cell tell a kinematic calibration besides poses: views of the board, torques of gravity; and
the cell with what was found."""

import warnings
from dataclasses import dataclass
from typing import Any

import kr5
import kr5.cell
import numpy as np
from kr5 import calibration, kinematics

TOOL_TOLERANCE = 5e-3  # of the tool's place on the flange [m]
CHANCE = 1e-3  # probability with which a right camera is not believed


def recorded_views(recording: kr5.cell.Recording, split: str, joints: int) -> list[Any]:
    """What the camera on the flange saw of the board, a posture a view."""
    cell = recording.cell
    if cell.camera is None or cell.board is None or cell.T_flange_camera() is None:
        return []
    points, ids = kr5.target_points(cell.board.target())
    place = {int(number): k for k, number in enumerate(ids)}
    out = []
    for experiment in recording.experiments:
        if str(experiment.kind) != "views" or str(experiment.split) != split:
            continue
        view = np.asarray(experiment["view"])
        q = np.column_stack([experiment[f"q{k + 1}"] for k in range(joints)])
        number = (4 * np.asarray(experiment["marker"]) + np.asarray(experiment["corner"])).astype(int)
        pixels = np.column_stack([experiment["u"], experiment["v"]])
        for one in dict.fromkeys(view):
            rows = np.flatnonzero((view == one) & np.isfinite(pixels).all(axis=1))
            if len(rows) < 3:
                continue
            out.append(
                calibration.ArmPosture(
                    name=f"{experiment.name}:{int(one)}",
                    q=q[rows[0]],
                    target_points=kr5.points_from_columns(points[:, [place[n] for n in number[rows]]]),
                    pixels=kr5.points_from_rows(pixels[rows]),
                )
            )
    return out


def use_recording(options: calibration.KinematicsOptions, cell: kr5.cell.Cell, views: bool, known_tool: bool) -> None:
    """The device of a recording reports in the base; the tool is turned as the cell says, and sits about where."""
    options.T_world_base = np.eye(4)
    if cell.tool is not None:
        options.T_flange_tool = cell.tool.T_flange_tool
        options.tolerance_tool = 0.0 if known_tool else options.tolerance_tool or TOOL_TOLERANCE
    if views:
        options.camera = cell.camera.pinhole()
        options.T_flange_camera = cell.T_flange_camera()
        options.T_base_target = cell.board.T_base_target


@dataclass
class CameraCheck:
    """Whether camera and board of the cell agree with what the postures alone say of them."""

    believed: bool
    squared_distance: float
    dof: int
    limit: float
    text: str


def believe_camera(
    chain: kinematics.DhChain,
    postures: list[calibration.ArmPosture],
    options: calibration.KinematicsOptions,
    free: calibration.KinematicsResult,
) -> tuple[calibration.KinematicsResult, CameraCheck | None]:
    """The result with camera and board where the cell says, unless that is farther from where poses and views put them
    than their covariance allows: then the given one, with both free. Where the first is taken, `options` hold them."""
    check = check_camera(free, options)
    if check is None or not check.believed:
        return free, check
    options.hold = [*options.hold, "camera", "target"]
    return calibration.calibrate_kinematics(chain, postures, options=options), check


def check_camera(free: calibration.KinematicsResult, options: calibration.KinematicsOptions) -> CameraCheck | None:
    """The comparison in words; None where camera and board were not estimated."""
    found = calibration.camera_agreement(free, options, CHANCE)
    if found is None:
        return None
    compared = (
        f"(chi-square {found.squared_distance:.3g}; a right cell stays below {found.limit:.3g} with probability"
        f" {1 - CHANCE:g})"
    )
    text = (
        f"camera and board were held where the cell says, with which the measurements agree {compared}"
        if found.believed
        else f"camera and board were estimated: the measurements contradict where the cell says they are {compared}"
    )
    return CameraCheck(found.believed, found.squared_distance, found.dof, found.limit, text)


def add_torques(postures: list[calibration.ArmPosture], cell: kr5.cell.Cell) -> None:
    """Torques that hold the arm and its tool against gravity, of each posture."""
    if len(cell.robot.links) != len(cell.robot.dh):
        raise kr5.InvalidArgument(
            "--elasticity: the cell has no masses of the links, from which the torques of gravity follow"
        )
    chain = cell.nominal_chain()
    dynamics = kinematics.Dynamics(chain, list(cell.robot.links), cell.robot.gravity)
    if cell.tool is not None and cell.tool.mass > 0:
        body = kinematics.Body(mass=cell.tool.mass, com=cell.tool.com, inertia=cell.tool.inertia)
        dynamics.add_body(len(chain.joints) - 1, body, cell.tool.T_flange_sensor)
    for posture in postures:
        posture.torques = dynamics.gravity_torques(posture.q)


def refined_cell(cell: kr5.cell.Cell, result: calibration.KinematicsResult, recorded: bool, views: bool) -> Any:
    """The cell with the identified arm; of a recording also with its tool, and with camera and board where views told
    of them. Camera and scanner stay where they are on the flange."""
    if len(result.compliances):
        warnings.warn(
            "the compliances of the joints are not written into the cell; effects of it may hold them",
            kr5.Caution,
            stacklevel=2,
        )
    T_flange_camera = cell.T_flange_camera() if cell.camera is not None else None
    T_flange_scanner = cell.T_flange_scanner() if cell.laser is not None else None
    cell.robot.dh = result.arm.joints
    if not recorded:
        return cell
    if cell.tool is not None:
        tool = cell.tool
        tool.T_flange_tool = result.T_flange_tool
        cell.tool = tool
    if views:
        T_flange_camera = result.T_flange_camera
        board = cell.board
        board.T_base_target = result.T_base_target
        cell.board = board
    T_tool_flange = np.linalg.inv(result.T_flange_tool) if cell.tool is not None else np.eye(4)
    if cell.camera is not None and T_flange_camera is not None:
        camera = cell.camera
        if camera.T_flange_camera is not None:
            camera.T_flange_camera = T_flange_camera
        else:
            camera.T_tool_camera = T_tool_flange @ T_flange_camera
        cell.camera = camera
    if cell.laser is not None and T_flange_scanner is not None and cell.laser.T_flange_scanner is None:
        laser = cell.laser
        laser.T_tool_scanner = T_tool_flange @ T_flange_scanner
        cell.laser = laser
    return cell
