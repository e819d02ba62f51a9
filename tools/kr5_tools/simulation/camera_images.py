"""Pictures that a simulated cell takes, as the folder that `kr5 calibrate hand-eye` reads."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import kr5.cell
import numpy as np
import yaml
from kr5.files import writing
from kr5.files.paths import library_path

from kr5_tools.cli import terminal

CONVENTION = {"position": "m", "rotation": "quaternion_xyzw", "angle": "rad", "meaning": "T_base_flange"}


class Shot(NamedTuple):
    """A picture to be taken: readings of the joints, where the flange really is, what the camera has before it."""

    q: Any
    T_base_flange: Any
    scene: Any


def write_views(folder: Path, cell: kr5.cell.Cell, shots: list[Shot], options: dict[str, Any]) -> list[Path]:
    """Images, and with them what a person would have: poses the controller tells (encoder noise and all), the camera
    and the target as the cell believes they are. `truth.yaml` holds how they really were.

    `options` are those of the renderer; each image has a seed of its own.
    """
    import kr5.vision

    (folder / "images").mkdir(parents=True, exist_ok=True)
    random, files, rows = np.random.default_rng(options.get("seed", 1)), [], []
    for number, shot in enumerate(terminal.track(shots, "Rendering"), start=1):
        seen = kr5.vision.RenderOptions(**{**options, "seed": options.get("seed", 1) + number})
        files.append(folder / "images" / f"view_{number:02d}.png")
        kr5.vision.save_image(
            kr5.vision.render(shot.scene.targets, shot.scene.lens, seen, solids=shot.scene.solids),
            library_path(files[-1]),
        )
        rows.append(_pose_row(cell.flange(np.asarray(shot.q) + random.normal(0.0, cell.noise.position, len(shot.q)))))
    header = "x,y,z,qx,qy,qz,qw"
    writing.write_text(
        "\n".join([header, *(",".join(f"{v:.12g}" for v in row) for row in rows)]) + "\n", folder / "poses.csv"
    )
    _write(folder / "camera.yaml", cell.camera.pinhole().to_dict())
    _write(folder / "truth.yaml", _truth(cell, shots[0]))
    if target := _target(cell):
        mount = str(cell.camera.mount)
        _write(
            folder / "dataset.yaml",
            {
                "format": "kr5-dataset/1",
                "images": "images/*.png",
                "poses": "poses.csv",
                "pairing": "order",
                "convention": CONVENTION,
                "mount": mount,
                "target": target,
                "camera": "camera.yaml",
            },
        )
    return files


def shots_of(simulator: kr5.cell.Simulator, cell: kr5.cell.Cell, postures: np.ndarray, times: np.ndarray) -> list[Shot]:
    """A picture in each posture of the arm at rest, as it really is."""
    import kr5
    import kr5.io
    import kr5.predict

    n = cell.robot.joints
    poses = kr5.cell.Experiment(name="pictures", kind="poses", file="pictures.csv", split="check")
    poses.data = kr5.io.Table(
        ["pose", "t", *(f"q{i + 1}" for i in range(n))],
        np.column_stack([np.arange(len(times)), times, np.asarray(postures)]),
    )
    shown = simulator.predict(cell, poses)
    T_tool_flange = np.linalg.inv(kr5.predict.T_flange_tool(cell))  # the tip may be off; camera and flange do not care
    rows = np.column_stack([shown[c] for c in ("x", "y", "z", "qx", "qy", "qz", "qw")])
    flanges = [_pose(row) @ T_tool_flange for row in rows]
    return [
        Shot(q, T_base_flange, kr5.predict.camera_scene(cell, T_base_flange))
        for q, T_base_flange in zip(postures, flanges)
    ]


def _pose(row: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    T = np.eye(4)
    T[:3, 3] = row[:3]
    T[:3, :3] = Rotation.from_quat(row[3:]).as_matrix()
    return T


def _pose_row(T: np.ndarray) -> list[float]:
    from scipy.spatial.transform import Rotation

    return [*np.asarray(T)[:3, 3], *Rotation.from_matrix(np.asarray(T)[:3, :3]).as_quat()]


def _target(cell: kr5.cell.Cell) -> dict[str, Any] | None:
    import kr5

    target = cell.board.target() if cell.board else next(iter(cell.targets), None)
    if target is None:
        return None
    return {name: value for name, value in target.to_dict().items() if name in kr5.Target().to_dict()}


def _truth(cell: kr5.cell.Cell, shot: Shot) -> dict[str, Any]:
    T_base_flange, T_base_camera = np.asarray(shot.T_base_flange), np.asarray(shot.scene.T_base_camera)
    fixed = str(cell.camera.mount) == "eye_to_hand"
    out = {
        "camera": shot.scene.lens,
        **(
            {"T_base_camera": T_base_camera}
            if fixed
            else {"T_flange_camera": np.linalg.inv(T_base_flange) @ T_base_camera}
        ),
    }
    for placed in shot.scene.targets[:1]:
        T_base_target = T_base_camera @ placed.T_camera_target
        out |= (
            {"T_flange_target": np.linalg.inv(T_base_flange) @ T_base_target}
            if fixed
            else {"T_base_target": T_base_target}
        )
    return out


def _write(file: Path, data: Mapping[str, object]) -> None:
    plain = writing.to_plain(data)
    nested = any(
        isinstance(value, (dict, list)) for value in plain.values()
    )  # a flat map in one line would look like JSON
    writing.write_text(
        yaml.safe_dump(plain, sort_keys=False, default_flow_style=None if nested else False, width=120), file
    )
