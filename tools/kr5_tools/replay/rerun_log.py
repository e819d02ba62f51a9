"""A recording or a scene for the Rerun viewer: poses of links, tool and sensors, and every signal over time."""

from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import kr5
import kr5.cell
import numpy as np

from kr5_tools.cli import terminal
from kr5_tools.cli.terminal import Console
from kr5_tools.replay.peg_rotation import peg_rotations
from kr5_tools.replay.runs import Run

AXES = 0.05  # length at which a pose is drawn [m]


class PosePath(NamedTuple):
    """A frame over time, or always."""

    path: str
    t: np.ndarray | None  # [s]
    poses: np.ndarray  # in the base, n x 4 x 4


class SignalPath(NamedTuple):
    """A curve of a signal over time, in SI; a residual in units of its noise."""

    path: str
    t: np.ndarray  # [s]
    values: np.ndarray


def write_rerun(file: Path | None, cell: kr5.cell.Cell, runs: list[Run], to: Console) -> None:
    """The recording for the Rerun viewer, when a file is asked for."""
    if file is None:
        return
    sdk = load_sdk(file)
    with terminal.spinner(f"writing {file}"):
        write_log(cell, runs, file, sdk)
    to.print(f"{file}: open it with `rerun {file}`.", soft_wrap=True, markup=False)


def pose_paths(cell: kr5.cell.Cell, runs: list[Run]) -> Iterator[PosePath]:
    """The frames that stand still, and of each run those that move with the arm, or the peg."""
    from kr5_tools.cell.frames import cell_frames, fixed_frames

    still = fixed_frames(cell)
    for name, T in still.items():
        yield PosePath(join_path("cell", name), None, np.asarray(T)[None])
    for run in runs:
        if run.peg is not None:
            yield PosePath(join_path(run.name, "peg"), run.t, peg_poses(cell, run))
        if run.q is None:
            continue
        moved: dict[str, list[Any]] = {}
        for q in run.q:
            for frame in cell_frames(cell, list(q)):
                if frame["name"] not in still:
                    moved.setdefault(frame["name"], []).append(np.asarray(frame["T"]))
        for name, poses in moved.items():
            yield PosePath(join_path(run.name, name), run.t, np.array(poses))


def peg_poses(cell: kr5.cell.Cell, run: Run) -> np.ndarray:
    """Poses of the peg: of a run at the tube in the base, of others in the frame of the bench."""
    assert run.peg is not None
    x, y, z, tilt, azimuth = run.peg.T
    poses = np.tile(np.eye(4), (len(run.t), 1, 1))
    poses[:, :3, :3] = peg_rotations(tilt, azimuth)
    poses[:, :3, 3] = np.column_stack([x, y, z])
    return np.asarray(cell.tube.T_base_tube) @ poses if run.stand == "tube" and cell.tube else poses


def signal_paths(runs: list[Run]) -> Iterator[SignalPath]:
    """Recorded, simulated and residual of every signal, row by row."""
    for run in runs:
        for signal in run.signals:
            for curve, values in signal.curves.items():
                good = np.isfinite(values)
                yield SignalPath(join_path(run.name, "signals", signal.name, curve), signal.x[good], values[good])


def join_path(*parts: str) -> str:
    return "/".join(part.replace("/", "_").replace(" ", "_") for part in parts)


def write_log(cell: kr5.cell.Cell, runs: list[Run], file: Path, sdk: ModuleType) -> None:
    """Saves poses and signals; `sdk` is the module rerun."""
    recording = sdk.RecordingStream("kr5")
    recording.save(str(file))
    for path, t, poses in pose_paths(cell, runs):
        recording.log(path, sdk.TransformAxes3D(AXES), static=True)
        if t is None:
            recording.log(path, sdk.Transform3D(translation=poses[0, :3, 3], mat3x3=poses[0, :3, :3]), static=True)
            continue
        columns = sdk.Transform3D.columns(translation=poses[:, :3, 3], mat3x3=poses[:, :3, :3])
        recording.send_columns(path, [sdk.TimeColumn("time", duration=t)], columns)
    for path, t, values in signal_paths(runs):
        recording.send_columns(path, [sdk.TimeColumn("time", duration=t)], sdk.Scalars.columns(scalars=values))
    recording.flush()


def load_sdk(file: Path) -> Any:
    try:
        import rerun
    except ImportError:
        raise kr5.FileError(
            file, "--rerun needs the Rerun SDK, which is not installed", remedy="run: pip install 'kr5[rerun]'"
        ) from None
    return rerun
