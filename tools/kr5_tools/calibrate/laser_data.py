"""Profiles of a line scanner with the poses at which they were taken: from two CSV files, a folder with both, or a
recording with scans."""

import csv
import math
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import kr5
import numpy as np
from kr5 import calibration

from kr5_tools.calibrate.postures import LENGTHS, Columns, orientation_of

FORMS = (
    "a folder with profiles.csv and poses.csv, these two files, or the folder of a recording with experiments of the"
    " kind scan"
)
LEAST_RANGE = 2e-3  # below, a range in metres was divided by a thousand twice [m]


@dataclass
class ScanData:
    """Profiles, a pose of the flange for each, and what is scanned."""

    names: list[str] = field(default_factory=list)
    profiles: list[Any] = field(default_factory=list)
    poses: list[Any] = field(default_factory=list)
    targets: list[str] = field(default_factory=list)  # names of targets, one a profile; "" where there is but one
    q: list[np.ndarray] = field(default_factory=list)  # joint values, where there are any
    dropped: list[str] = field(default_factory=list)  # profiles outside the times of the poses


class TextTable:
    """A CSV with a header whose fields may be text or empty, with the line of each row."""

    def __init__(self, file: Path) -> None:
        self.file = file
        try:
            with file.open(newline="", encoding="utf-8") as stream:
                rows = [(k, row) for k, row in enumerate(csv.reader(stream), 1) if any(f.strip() for f in row)]
        except csv.Error as error:
            raise kr5.FileError(file, f"cannot be read ({error})") from error
        if not rows:
            raise kr5.FileError(file, "is empty; expected a header line and rows")
        self.columns = [name.strip() for name in rows[0][1]]
        if len(set(self.columns)) != len(self.columns) or "" in self.columns:
            raise kr5.FileError(file, f"line 1: found the columns {', '.join(self.columns)}, expected different names")
        self.lines = [number for number, _ in rows[1:]]
        for number, row in rows[1:]:
            if len(row) != len(self.columns):
                raise kr5.FileError(file, f"line {number}: found {len(row)} values, expected {len(self.columns)}")
        self.text = {name: [row[k].strip() for _, row in rows[1:]] for k, name in enumerate(self.columns)}
        if not self.lines:
            raise kr5.FileError(file, "has a header, but no rows")

    def numbers(self, name: str, missing: bool = False) -> np.ndarray:
        """A column of numbers; with `missing` a field may be empty or nan, which is NaN."""
        if name not in self.text:
            raise kr5.FileError(self.file, f"found the columns {', '.join(self.columns)}; missing: {name}")
        out = np.empty(len(self.lines))
        for k, word in enumerate(self.text[name]):
            try:
                out[k] = float(word) if word else math.nan
            except ValueError:
                out[k] = math.inf
            if math.isinf(out[k]) or (math.isnan(out[k]) and not missing):
                raise kr5.FileError(self.file, f"line {self.lines[k]}: {name}: found {word!r}, expected a number")
        return out


def read_scans(sources: list[Path], wanted: Columns, profile_length: str, delay: float, max_gap: float) -> ScanData:
    """Profiles and poses of CSV files, or of the folder with both."""
    if len(sources) == 1 and sources[0].is_dir():
        sources = [sources[0] / "profiles.csv", sources[0] / "poses.csv"]
    for file in sources:
        if not file.exists():
            raise kr5.FileError(file, f"no such file; expected {FORMS}")
    if len(sources) != 2:
        raise kr5.InvalidArgument(f"found {', '.join(map(str, sources))}; expected {FORMS}")
    points, poses = TextTable(sources[0]), TextTable(sources[1])
    data = ScanData()
    keys, times = _read_profiles(points, profile_length, data)
    _add_poses(poses, keys, times, wanted, delay, max_gap, data)
    return data


def _read_profiles(table: TextTable, length: str, data: ScanData) -> tuple[list[str], np.ndarray | None]:
    """Fills in the profiles; their keys, in the order of the file, and their times."""
    missing = [name for name in ("profile", "x", "z") if name not in table.text]
    if missing:
        raise kr5.FileError(
            table.file,
            f"found the columns {', '.join(table.columns)}; missing: {', '.join(missing)}"
            " (a row a point: profile, x, z)",
        )
    x, z = (LENGTHS[length] * table.numbers(name, missing=True) for name in ("x", "z"))
    _check_coordinates(table.file, x, z, length)
    t = table.numbers("t") if "t" in table.text else None
    rows: dict[str, list[int]] = {}
    for k, key in enumerate(table.text["profile"]):
        rows.setdefault(key, []).append(k)
    for key, of_profile in rows.items():
        data.names.append(key)
        data.profiles.append(calibration.LineProfile(x=x[of_profile], z=z[of_profile]))
        data.targets.append(table.text["target"][of_profile[0]] if "target" in table.text else "")
    return list(rows), None if t is None else np.array([t[of_profile[0]] for of_profile in rows.values()])


def _check_coordinates(file: Path, x: np.ndarray, z: np.ndarray, length: str) -> None:
    seen = np.isfinite(x) & np.isfinite(z)
    if not seen.any():
        raise kr5.FileError(file, "no point has both x and z")
    x, z = x[seen], z[seen]
    other = "mm" if length == "m" else "m"
    if max(np.abs(x).max(), np.abs(z).max()) > 5:
        raise kr5.FileError(
            file, f"coordinates of up to {max(np.abs(x).max(), np.abs(z).max()):.0f} m; --profile-length {other}?"
        )
    if np.median(np.abs(z)) < LEAST_RANGE and np.median(np.abs(x)) < LEAST_RANGE:
        raise kr5.FileError(file, f"ranges of {1e3 * np.median(np.abs(z)):.3f} mm; --profile-length {other}?")
    if x.min() > 0 and z.min() < 0 < z.max():
        raise kr5.FileError(file, "x is always positive and z is not: are the columns x and z swapped?")


def _add_poses(
    table: TextTable,
    keys: list[str],
    times: np.ndarray | None,
    wanted: Columns,
    delay: float,
    max_gap: float,
    data: ScanData,
) -> None:
    """The pose of each profile: by its key, by its time, or in the same order."""
    T = _poses_of(table, wanted)
    q = _joints_of(table, wanted)
    if "target" in table.text and not any(data.targets):
        if "profile" not in table.text:
            raise kr5.FileError(table.file, "target: needs a column profile, which says whose target it is")
        of_key = dict(zip(table.text["profile"], table.text["target"], strict=True))
        data.targets = [of_key.get(key, "") for key in keys]
    if "profile" in table.text:
        row = {key: k for k, key in enumerate(table.text["profile"])}
        if len(row) != len(T):
            raise kr5.FileError(table.file, "a profile has several poses")
        if lost := [key for key in keys if key not in row]:
            raise kr5.FileError(table.file, f"there is no pose of profile {', '.join(lost[:5])}")
        order = [row[key] for key in keys]
    elif times is not None and "t" in table.text:
        _interpolate(table, T, times - delay, max_gap, data)
        return
    elif len(T) == len(keys):
        order = list(range(len(keys)))
    else:
        raise kr5.FileError(
            table.file,
            f"found {len(T)} poses for {len(keys)} profiles; expected a column profile, a column t in"
            " both files, or as many poses as profiles",
        )
    data.poses = [T[k] for k in order]
    data.q = [q[k] for k in order] if q is not None else []


def _interpolate(table: TextTable, T: list[Any], times: np.ndarray, max_gap: float, data: ScanData) -> None:
    poses, inside = calibration.interpolate_poses(list(table.numbers("t")), T, list(times), max_gap)
    kept = [k for k, known in enumerate(inside) if known]
    data.dropped = [name for name, known in zip(data.names, inside, strict=True) if not known]
    if not kept:
        raise kr5.FileError(
            table.file,
            f"no profile was taken between two poses at most {max_gap} s apart",
            remedy="see --delay, --max-gap",
        )
    data.names = [data.names[k] for k in kept]
    data.profiles = [data.profiles[k] for k in kept]
    data.targets = [data.targets[k] for k in kept]
    data.poses = [poses[k] for k in kept]


def _poses_of(table: TextTable, wanted: Columns) -> list[Any]:
    names = [name for name in table.columns if name not in ("profile", "target")]
    numbers = SimpleNamespace(columns=names, values=np.column_stack([table.numbers(name) for name in names]))
    if lost := [name for name in "xyz" if name not in names]:
        raise kr5.FileError(table.file, f"found the columns {', '.join(table.columns)}; missing: {', '.join(lost)}")
    T = orientation_of(table.file, numbers, [["x", "y", "z"]], wanted)
    if T is None:
        raise kr5.FileError(
            table.file,
            f"found the columns {', '.join(table.columns)}; expected an orientation beside x y z: qx qy"
            " qz qw, rx ry rz, roll pitch yaw or a b c (see --convention)",
        )
    if (most := max(np.abs(pose[:3, 3]).max() for pose in T)) > 100:
        raise kr5.FileError(table.file, f"positions of up to {most:.0f} m; --length mm?")
    return T


def _joints_of(table: TextTable, wanted: Columns) -> np.ndarray | None:
    count = 0
    while f"q{count + 1}" in table.text:
        count += 1
    if not count:
        return None
    scale = np.pi / 180 if wanted.angle == "deg" else 1.0
    return np.column_stack([scale * table.numbers(f"q{k + 1}") for k in range(count)])


def recorded_scans(recording: Any, split: str) -> tuple[ScanData, list[Any]]:
    """Profiles of a recording's scans, and its targets: the points on the sphere and those on the plane apart."""
    believed, data = recording.cell, ScanData()
    if believed.laser is None or believed.laser.target is None:
        raise kr5.InvalidArgument("the cell of the recording has no laser with a target")
    chain, joints = believed.nominal_chain(), believed.robot.joints
    for experiment in recording.experiments:
        if str(experiment.kind) != "scan" or str(experiment.split) != split:
            continue
        line = np.asarray(experiment["line"])
        q = np.column_stack([experiment[f"q{k + 1}"] for k in range(joints)])
        x, z, sphere = (np.asarray(experiment[name]) for name in ("x", "z", "sphere"))
        for number in np.unique(line):
            for name, on_sphere in (("sphere", 1), ("plane", 0)):
                points = (line == number) & (sphere == on_sphere)
                if points.sum() < 8:
                    continue
                data.names.append(f"{experiment.name}:{number:.0f}:{name}")
                data.profiles.append(calibration.LineProfile(x=x[points], z=z[points]))
                data.targets.append(name)
                data.q.append(q[points][0])
                data.poses.append(chain.flange(q[points][0]))
    targets = [
        calibration.ScanTarget(name="sphere", kind="sphere", radius=believed.laser.target.radius),
        calibration.ScanTarget(name="plane", kind="plane"),
    ]
    return data, [target for target in targets if target.name in data.targets]


def parse_target(text: str, number: int) -> Any:
    """A target of the command line: [NAME=]KIND[:RADIUS][@X,Y,Z[,NX,NY,NZ]]."""
    expected = "[NAME=]tip, sphere[:RADIUS] or plane, and [@X,Y,Z[,NX,NY,NZ]] where the place is known"
    name, equals, rest = text.rpartition("=")
    what, _, place = rest.partition("@")
    kind, _, radius = what.partition(":")
    try:
        numbers = [float(v) for v in place.split(",")] if place else []
        size = float(radius) if radius else 0.0
    except ValueError:
        raise kr5.InvalidArgument(f"--target: found {text!r}, expected {expected}") from None
    known = len(numbers) in ((6,) if kind == "plane" else (3,))
    if kind not in ("tip", "sphere", "plane") or (numbers and not known) or (radius and kind != "sphere"):
        raise kr5.InvalidArgument(f"--target: found {text!r}, expected {expected}")
    target = calibration.ScanTarget(name=name if equals else f"{kind}{number or ''}", kind=kind, radius=size)
    if numbers:
        target.position = np.array(numbers[:3])
    if len(numbers) == 6:
        target.normal = np.array(numbers[3:]) / np.linalg.norm(numbers[3:])
    return target
