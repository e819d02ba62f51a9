"""A recording or a scene for the Rerun viewer: poses of links, tool and sensors, and every column over time."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from kr5_tools.cli import terminal

AXES = 0.05  # length at which a pose is drawn [m]


class Entry(NamedTuple):
    """One value of one path at one time: a pose (4x4, in the base) or a number."""

    path: str
    t: float | None  # [s]; None: always
    value: Any


def log_entries(cell: Any, runs: list[dict[str, Any]], tables: list[Any]) -> Iterator[Entry]:
    """Postures of the runs as poses; of each run's table, when there is one, every column but those of time and
    joints."""
    import numpy as np

    from kr5_tools.cell.frames import cell_frames, fixed_frames

    for name, T in fixed_frames(cell).items():
        yield Entry(_path("cell", name), None, np.asarray(T))
    moved = fixed_frames(cell).keys()
    for number, run in enumerate(runs):
        for t, q in zip(run["t"], run["q"]):
            for frame in cell_frames(cell, q):
                if frame["name"] not in moved:
                    yield Entry(_path(run["name"], frame["name"]), t, np.asarray(frame["T"]))
        if number < len(tables):
            yield from _columns(run, tables[number])


def _columns(run: dict[str, Any], table: Any) -> Iterator[Entry]:
    import numpy as np

    t = np.asarray(table["t"])
    for name in table.columns:
        if name == "t":
            continue
        for at, value in zip(t - t[0], table[name]):
            if np.isfinite(value):
                yield Entry(_path(run["name"], "columns", name), float(at), float(value))


def _path(*parts: str) -> str:
    return "/".join(part.replace("/", "_").replace(" ", "_") for part in parts)


def write_log(log: Iterator[Entry], file: Path, sdk: Any = None) -> None:
    """Saves the entries; `sdk` is the module rerun."""
    sdk = sdk or _sdk(file)
    recording = sdk.RecordingStream("kr5")
    recording.save(str(file))
    drawn = set()
    for entry in log:
        static = entry.t is None
        if not static:
            recording.set_time("time", duration=entry.t)
        recording.log(entry.path, _shape(sdk, entry.value), static=static)
        if not isinstance(entry.value, float) and entry.path not in drawn:
            drawn.add(entry.path)
            recording.log(entry.path, sdk.TransformAxes3D(AXES), static=True)
    recording.flush()


def _shape(sdk: Any, value: Any) -> Any:
    if isinstance(value, float):
        return sdk.Scalars(value)
    return sdk.Transform3D(translation=value[:3, 3], mat3x3=value[:3, :3])


def _sdk(file: Path) -> Any:
    try:
        import rerun
    except ImportError:
        terminal.fail(f"{file}: --rerun needs the Rerun SDK, which is not installed; run: pip install 'kr5[rerun]'")
    return rerun
