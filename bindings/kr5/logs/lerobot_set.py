"""Data sets of LeRobot, versions 2.0, 2.1 and 3: a folder with meta/info.json, or one Parquet file of it."""

import json
from pathlib import Path
from typing import Any

import numpy as np

import kr5
from kr5.files.documents import read_text
from kr5.logs.log import Log
from kr5.logs.parquet_file import EPISODE, fill_log, open_parquet, parquet_episodes

MAX_BYTES = 64 << 20  # of meta/info.json
INFO = Path("meta", "info.json")


def is_lerobot(path: Path) -> bool:
    """Whether a path is a data set of LeRobot, or a table of one."""
    if path.is_dir():
        return (path / INFO).is_file()
    return path.suffix.lower() == ".parquet" and path.is_file() and EPISODE in open_parquet(path).schema_arrow.names


def lerobot_episodes(path: Path) -> list[int]:
    if path.is_file():
        return parquet_episodes(path)
    by_name = {_number_of(file): file for file in _tables(path)}
    if None not in by_name:
        return sorted(number for number in by_name if number is not None)
    return sorted({number for file in _tables(path) for number in parquet_episodes(file)})


def read_lerobot(path: Path, episode: int) -> Log:
    """Actions and observations of an episode, their components by the names of meta/info.json."""
    home = path if path.is_dir() else _home_of(path)
    info = _info(home) if home else {}
    files = [path] if path.is_file() else [f for f in _tables(path) if _number_of(f) in (None, episode)]
    files = [f for f in files if _number_of(f) is not None or episode in _range_of(f)]
    log = Log(path)
    if not files:
        raise kr5.FileError(path, f"has no episode {episode}")
    fill_log(log, files, episode, _labels(info))
    _by_quantity(log)
    log.percent_likely = any(stem.endswith(".pos") for stem in log.arrays)  # as its drivers of servos name them
    if "timestamp" in log.columns:
        log.clocks[""] = "timestamp"
    elif fps := info.get("fps"):
        frames = log.columns.get("frame_index")
        rows = len(next(iter(log.columns.values())))
        log.add("timestamp", (np.arange(rows) if frames is None else frames - frames[0]) / float(fps), "")
        log.clocks[""] = "timestamp"
    return log


def _tables(folder: Path) -> list[Path]:
    found = sorted((folder / "data").glob("**/*.parquet"))
    if not found:
        raise kr5.FileError(
            folder, "is a data set of LeRobot without data/**/*.parquet; download the data, not the metadata alone"
        )
    return found


def _number_of(file: Path) -> int | None:
    """The episode of a file of version 2; nothing of version 3, whose files have several."""
    stem, number = file.stem.partition("_")[::2]
    return int(number) if stem == "episode" and number.isdigit() else None


def _range_of(file: Path) -> range:
    """The numbers between which the episodes of a table are, by the extremes that its row groups state."""
    metadata = open_parquet(file).metadata
    low, high = [], []
    for g in range(metadata.num_row_groups):
        group = metadata.row_group(g)
        for k in range(group.num_columns):
            column = group.column(k)
            if column.path_in_schema == EPISODE and column.statistics is not None and column.statistics.has_min_max:
                low.append(int(column.statistics.min))
                high.append(int(column.statistics.max))
    return range(min(low), max(high) + 1) if len(low) == metadata.num_row_groups and low else range(1 << 62)


def _home_of(file: Path) -> Path | None:
    """The data set that a table lies in."""
    return next((folder for folder in list(file.absolute().parents)[:4] if (folder / INFO).is_file()), None)


def _info(folder: Path) -> dict[str, Any]:
    file = folder / INFO
    try:
        data = json.loads(read_text(file, "the description of a LeRobot data set", MAX_BYTES))
    except ValueError as error:
        raise kr5.FileError(file, f"is no JSON: {error}") from error
    if not isinstance(data, dict):
        raise kr5.FileError(file, "found no object, expected the description of a LeRobot data set")
    return data


def _labels(info: dict[str, Any]) -> dict[str, list[str]]:
    """Names of the components of each vector: a list, or lists under words such as `motors`."""
    out: dict[str, list[str]] = {}
    features = info.get("features")
    for feature, entry in features.items() if isinstance(features, dict) else ():
        names = entry.get("names") if isinstance(entry, dict) else None
        if isinstance(names, dict):
            lists = [part for part in names.values() if isinstance(part, list)]
            names = [name for part in lists for name in part]
        if isinstance(names, list) and names and all(isinstance(name, str) for name in names):
            out[str(feature)] = names
    return out


# What the last part of a component's name tells of it (`shoulder_pan.pos`).
QUANTITIES = ("pos", "vel", "torque", "effort", "current", "position", "velocity")


def _by_quantity(log: Log) -> None:
    """Vectors whose components have different quantities (`joint.pos`, `joint.vel`) become one for each."""
    for name, columns in list(log.arrays.items()):
        parts: dict[str, list[str]] = {}
        for column in columns:
            joint, _, quantity = log.labels.get(column, "").rpartition(".")
            known = bool(joint) and quantity in QUANTITIES
            if known:
                log.labels[column] = joint
            parts.setdefault(quantity if known else "", []).append(column)
        if set(parts) - {""}:
            del log.arrays[name]
            log.arrays |= {f"{name}.{quantity}" if quantity else name: own for quantity, own in parts.items()}
