"""A calibration's result put into a cell: `--cell CELL --write-cell OUT.yaml`."""

import warnings
from pathlib import Path
from typing import Annotated, Any

import kr5
import kr5.cell
import numpy as np
import typer
from kr5 import cell
from kr5.files.writing import beside

CellOption = Annotated[
    Path | None,
    typer.Option("--cell", metavar="CELL.yaml", help="Cell that receives the result; see --write-cell."),
]
WriteCellOption = Annotated[
    Path | None, typer.Option("--write-cell", metavar="OUT.yaml", help="Cell to write, with the result in it.")
]


def load_target_cell(cell_file: Path | None, write_cell: Path | None) -> Any:
    """The cell that a result goes into, or None; complains of one option without the other."""
    if write_cell and not cell_file:
        raise kr5.InvalidArgument("--write-cell: --cell is missing; name the cell into which the result is put")
    if cell_file and not write_cell:
        raise kr5.InvalidArgument("--cell: --write-cell is missing; name the file of the cell with the result")
    return cell.load_cell(cell_file) if cell_file else None


def write_cell_file(believed: kr5.cell.Cell, file: Path | None) -> None:
    """Writes a cell with a result in it, if a file is named. The format of cells has no place for a covariance, which
    is told."""
    if file is None:
        return
    with beside(file) as new:
        cell.save_cell(believed, new)
    warnings.warn(
        f"{file}: a cell holds values alone; their covariance stands in the result file (-o, --json)",
        kr5.Caution,
        stacklevel=2,
    )


def put_intrinsics(believed: kr5.cell.Cell, lens: kr5.Pinhole) -> None:
    """Lens and sensor; where the camera sits stays."""
    camera = believed.camera
    if camera is None:
        raise kr5.InvalidArgument(
            "--cell: the cell has no camera; calibrate hand-eye with --write-cell first, which says where it sits"
        )
    believed.camera = _with_lens(camera, lens)


def _with_lens(camera: cell.Camera, lens: kr5.Pinhole) -> cell.Camera:
    for key in ("width", "height", "fx", "fy", "cx", "cy"):
        setattr(camera, key, getattr(lens, key))
    values = [getattr(lens, key) for key in ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")]
    model = "rational8" if any(values[5:]) else "brown5" if any(values) else "none"
    camera.distortion = cell.Distortion(model=model, values={"rational8": values, "brown5": values[:5]}.get(model, []))
    return camera


def put_camera_pose(
    believed: kr5.cell.Cell, mount: str, T_mount_camera: np.ndarray, lens: kr5.Pinhole | None = None
) -> None:
    """Mount and pose of the camera, in the form in which the cell has the pose; `lens` for a cell without camera."""
    camera = believed.camera
    if camera is None and lens is None:
        raise kr5.InvalidArgument(
            "--cell: the cell has no camera, and pairs of poses contain no lens parameters; calibrate the"
            " camera into it first"
        )
    camera = camera or cell.Camera()
    if lens is not None:
        camera = _with_lens(camera, lens)
    by_tool = camera.T_tool_camera is not None and believed.tool is not None and mount == "eye_in_hand"
    camera.mount = mount
    camera.T_tool_camera = camera.T_flange_camera = camera.T_base_camera = None
    if mount == "eye_to_hand":
        camera.T_base_camera = T_mount_camera
    elif by_tool:
        camera.T_tool_camera = np.linalg.inv(believed.tool.T_flange_tool) @ T_mount_camera
    else:
        camera.T_flange_camera = T_mount_camera
    believed.camera = camera


def put_tool_tip(believed: kr5.cell.Cell, tip: np.ndarray) -> None:
    """Position of the tool tip on the flange; what the cell gives from the tip stays where it is on the flange."""
    tool = believed.tool or cell.Tool()
    before = np.array(tool.T_flange_tool)
    after = before.copy()
    after[:3, 3] = tip
    moved = np.linalg.inv(after) @ before
    tool.T_flange_tool = after
    believed.tool = tool
    if (camera := believed.camera) is not None and camera.T_tool_camera is not None:
        camera.T_tool_camera = moved @ camera.T_tool_camera
        believed.camera = camera
    if (scanner := believed.laser) is not None and scanner.T_tool_scanner is not None:
        scanner.T_tool_scanner = moved @ scanner.T_tool_scanner
        believed.laser = scanner


def put_marker_map(believed: kr5.cell.Cell, target: kr5.Target) -> None:
    """The map in place of the cell's marker map, which says where it stands."""
    maps = [k for k, t in enumerate(believed.targets) if str(t.kind) == str(target.kind)]
    if len(maps) != 1:
        raise kr5.InvalidArgument(
            f"--cell: the cell has {len(maps)} targets of the kind {target.kind}, expected one, with its pose"
            " (T_B_W or T_F_W): the images do not show where the map stands"
        )
    targets = list(believed.targets)
    targets[maps[0]].map = target.map
    believed.targets = targets


def put_scanner_pose(believed: kr5.cell.Cell, T_flange_scanner: np.ndarray) -> None:
    """Pose of the line scanner, in the form in which the cell has it."""
    laser = believed.laser or cell.LineScanner()
    if laser.T_tool_scanner is not None and believed.tool is not None:
        laser.T_tool_scanner = np.linalg.inv(believed.tool.T_flange_tool) @ T_flange_scanner
    else:
        laser.T_tool_scanner = None
        laser.T_flange_scanner = T_flange_scanner
    believed.laser = laser


def put_target(believed: kr5.cell.Cell, target: kr5.Target, mount: str, T_fixed_target: np.ndarray) -> str:
    """Pose, and of a marker map the markers, of the one target of the cell that is like this one. Says why when there
    is none."""
    wanted = _form_of(target)
    alike = [k for k, t in enumerate(believed.targets) if _form_of(t) == wanted]
    board = believed.board is not None and _form_of(believed.board.target()) == wanted
    if len(alike) + board != 1:
        return f"the cell has {len(alike) + board} targets like that of the images, expected one"
    if board:
        if mount == "eye_to_hand":
            return "the board of a cell stands in the base, that of the images is on the flange"
        own = believed.board
        own.T_base_target = T_fixed_target
        believed.board = own
        return ""
    targets = list(believed.targets)
    one = targets[alike[0]]
    one.map = target.map
    one.T_base_target = T_fixed_target if mount == "eye_in_hand" else None
    one.T_flange_target = T_fixed_target if mount == "eye_to_hand" else None
    believed.targets = targets
    return ""


def _form_of(target: kr5.Target) -> dict[str, Any]:
    """What a target is, apart from where it, and where each marker of a map, stands."""
    form = kr5.Target(**{name: getattr(target, name) for name in kr5.Target().to_dict()}).to_dict()
    return form | {"map": sorted(marker.id for marker in target.map)}
