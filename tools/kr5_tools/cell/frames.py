"""The frames of a cell, by name."""

from typing import Any

import kr5.cell

DEG = 57.29577951308232


def joint_unit(cell: kr5.cell.Cell, joint: int, unit: str) -> str:
    """The unit of a joint's quantity, of "rad or m" or the like, by its kind of joint."""
    rotary, _, linear = unit.partition(" or ")
    return linear if linear and joint >= 0 and is_slide(cell, joint) else rotary


def is_slide(cell: kr5.cell.Cell, joint: int) -> bool:
    return str(cell.robot.dh[joint].type) == "prismatic"


def cell_frames(cell: kr5.cell.Cell, q: list[float]) -> list[dict[str, Any]]:
    """Every frame of the cell in the base, as in result files."""
    links = {f"link {i + 1}": T for i, T in enumerate(cell.link_poses(q))}
    return [
        {"name": name, "parent": None, "T": T}
        for name, T in {**links, **fixed_frames(cell), **carried_frames(cell, q)}.items()
    ]


def target_frames(cell: kr5.cell.Cell, key: str) -> dict[str, Any]:
    """Poses of board and targets that have `key`, T_base_target or T_flange_target; numbered when there are several."""
    boards: list[tuple[str, kr5.cell.Board | kr5.cell.Target]] = [("board", cell.board)] if cell.board else []
    boards += [(t.name or str(t.kind), t) for t in cell.targets]
    letters = ["W"] if len(boards) == 1 else [f"W{i + 1}" for i in range(len(boards))]
    poses = {f"{letter} {name}": getattr(board, key, None) for letter, (name, board) in zip(letters, boards)}
    return {name: T for name, T in poses.items() if T is not None}


def fixed_frames(cell: kr5.cell.Cell) -> dict[str, Any]:
    """Pose in the base of each frame that stands still."""
    out = target_frames(cell, "T_base_target")
    if cell.camera and cell.camera.T_base_camera is not None:
        out["C camera"] = cell.camera.T_base_camera
    if cell.tube:
        out["T tube"] = cell.tube.T_base_tube
    return out


def carried_frames(cell: kr5.cell.Cell, q: list[float]) -> dict[str, Any]:
    """Pose in the base of each frame that the flange carries."""
    T_base_flange = cell.flange(q)
    return {"F flange": T_base_flange, **{name: T_base_flange @ T for name, T in flange_frames(cell).items()}}


def flange_frames(cell: kr5.cell.Cell) -> dict[str, Any]:
    """The same in the flange."""
    out = {
        "S force sensor": cell.tool and cell.tool.T_flange_sensor,
        "E tool tip": cell.tool and cell.tool.T_flange_tool,
        "C camera": cell.T_flange_camera(),
        "L scanner": cell.T_flange_scanner(),
        **target_frames(cell, "T_flange_target"),
    }
    return {name: T for name, T in out.items() if T is not None}
