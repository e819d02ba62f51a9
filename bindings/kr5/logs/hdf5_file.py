"""HDF5: vectors of numbers by their paths, as ALOHA, robomimic and DROID write them; images are not read."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

import kr5
from kr5 import arm_log
from kr5.logs.log import Log
from kr5.logs.row_chunks import WIDEST, cut_note, kept_rows, needed_columns
from kr5.logs.units import unit_factor

INSTALL = "pip install 'kr5[hdf5]'"
DEMO = re.compile(r"(?:demo|episode|traj|trajectory)_?(\d+)")  # a group that is one recording
TIMES = re.compile(r"(^|[/_.])(time|timestamps?|stamps?)([/_.]|$)")  # in the path of a time
STEADIEST = ("control", "robot_state", "time")  # parts of the path of a time that is preferred, best first
Result = TypeVar("Result")


def is_hdf5_set(path: Path) -> bool:
    """Whether a file has several recordings, each in a group of its own (`data/demo_0`)."""
    return path.suffix.lower() in (".h5", ".hdf5") and path.is_file() and bool(_opened(path, _groups))


def hdf5_episodes(path: Path) -> list[int]:
    return sorted(_opened(path, _groups))


def read_hdf5(file: Path) -> Log:
    """Every vector of numbers, such as `observations/qpos[0]`. Those of one length are one stream."""
    return _opened(file, lambda opened: _read_group(file, opened, opened))


def read_hdf5_episode(file: Path, episode: int) -> Log:
    """The same of one of several recordings."""

    def read(opened: Any) -> Log:
        groups = _groups(opened)
        if episode not in groups:
            raise kr5.FileError(file, f"has no episode {episode}")
        return _read_group(file, opened, opened[groups[episode]])

    return _opened(file, read)


def _opened(file: Path, use: Callable[[Any], Result]) -> Result:
    try:
        import h5py
    except ImportError:
        raise kr5.FileError(file, f"to read HDF5, the package h5py is needed: {INSTALL}") from None
    try:
        with h5py.File(file, "r") as opened:
            return use(opened)
    except kr5.Error:
        raise
    except Exception as error:  # what the library raises at damaged bytes is no closed list
        why = str(error).split("\n")[0][:200] or type(error).__name__
        raise kr5.FileError(
            file, f"cannot be read as HDF5: {why}; was the recording ended properly? Copy the file again"
        ) from error


def _groups(opened: Any) -> dict[int, str]:
    """Paths of the recordings of a file by their numbers."""
    import h5py

    out: dict[int, str] = {}
    for home in [opened, *(opened[name] for name in opened if isinstance(opened.get(name), h5py.Group))]:
        for name in home:
            match = DEMO.fullmatch(name)
            if match and isinstance(home.get(name), h5py.Group):
                out.setdefault(int(match[1]), f"{home.name.rstrip('/')}/{name}")
    return out


def _read_group(file: Path, opened: Any, group: Any) -> Log:
    found = _vectors(group)
    log = Log(file)
    if not found:
        raise kr5.FileError(file, "contains no array of numbers with a row an instant; expected positions of joints")
    longest = max(len(values) for values in found.values())
    widths = [1 if values.ndim == 1 else values.shape[1] for values in found.values()]
    names = needed_columns(list(found), widths, longest)
    room = kept_rows(longest, sum(w for name, w in zip(found, widths) if name in names))
    if room < longest:
        log.notes.append(cut_note(file.name, room, longest))
    for name in names:
        log.add_vector(name, found[name][:room], f"{len(found[name])} rows")
    _add_clocks(log, opened)
    log.join_stamps()
    return log


def _vectors(group: Any) -> dict[str, Any]:
    """The data sets of numbers with a row an instant, by their paths."""
    import h5py

    out: dict[str, Any] = {}

    def visit(name: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or item.dtype.kind not in "fiub" or not item.ndim or not len(item):
            return
        if item.ndim == 1 or (item.ndim == 2 and item.shape[1] <= WIDEST):
            out[name] = item

    group.visititems(visit)
    return {name: item for name, item in out.items() if len(item) > 1 or len(out) == 1}


def _add_clocks(log: Log, opened: Any) -> None:
    """The time of each stream: a column that says so by its path and rises, in seconds; else even steps where the file
    states its rate."""
    for stream in dict.fromkeys(log.streams.values()):
        own = [name for name in log.columns if log.streams[name] == stream]
        if any(arm_log.names_time(name) for name in own):
            continue
        clocks = [name for name in own if TIMES.search(name.lower()) and _rises(log.columns[name])]
        if clocks:
            name = min(clocks, key=_clock_rank)
            unit = arm_log.guess_time_unit(log.columns[name])
            seconds = log.columns[name] * unit_factor(str(unit), ("time",), "clock")[0]
        elif rate := _stated_rate(opened):
            name, seconds = f"time at {rate:g} Hz", np.arange(len(log.columns[own[0]])) / rate
            log.notes.append(f"{log.file.name} has no times; its rows are {rate:g} a second, as it states")
        else:
            continue
        log.add(name, seconds, stream)
        log.clocks[stream] = name


def _rises(values: np.ndarray) -> bool:
    return bool(np.isfinite(values).all() and (np.diff(values) > 0).all())


def _clock_rank(name: str) -> tuple[int, int]:
    parts = re.split(r"[/_.]", name.lower())
    return next((k for k, word in enumerate(STEADIEST) if word in name.lower()), len(STEADIEST)), len(parts)


def _stated_rate(opened: Any) -> float | None:
    """Rows a second: an attribute of the file, or that of the environment of robomimic."""
    for home in (opened, opened.get("data")):
        if home is None:
            continue
        for key in ("fps", "frequency", "control_freq", "control_frequency"):
            if (rate := _positive(home.attrs.get(key))) is not None:
                return rate
        text = home.attrs.get("env_args")
        try:
            keys = json.loads(text).get("env_kwargs", {}) if isinstance(text, (str, bytes)) else {}
        except (ValueError, AttributeError):
            continue
        if isinstance(keys, dict) and (rate := _positive(keys.get("control_freq"))) is not None:
            return rate
    return None


def _positive(value: Any) -> float | None:
    try:
        number = float(value)
    except (TypeError, ValueError):
        return None
    return number if 0 < number < np.inf else None
