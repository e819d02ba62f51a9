"""Profiles of a line scanner with the poses at which they were taken: from two tables, a folder with both, or a
recording with scans."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import kr5
import kr5.cell
import numpy as np
from kr5 import calibration
from kr5.tables.options import TableOptions
from kr5.tables.read_table import read_table
from kr5.tables.roles import OPTIONAL_TIME, PoseRole, Role, TextRole, Units, joints_role
from kr5.tables.table import Table

FORMS = (
    "a folder with profiles.csv and poses.csv, these two files, or the folder of a recording with experiments of the"
    " kind scan"
)
PROFILE = TextRole("profile", "the name of a profile")
PROFILE_OF_POSE = TextRole("profile", "the name of a profile", needed=False)
TARGET = TextRole("target", "the name of a target", needed=False)
COORDINATES = [
    Role(axis, "points of a profile", "length", may_lack=True, unit_option="--profile-length-unit", largest=5.0)
    for axis in "xz"
]
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


def read_scans(
    sources: list[Path], wanted: TableOptions, profile_length: str | None, delay: float, max_gap: float
) -> ScanData:
    """Profiles and poses of two tables, or of the folder with both."""
    if len(sources) == 1 and sources[0].is_dir():
        sources = [sources[0] / "profiles.csv", sources[0] / "poses.csv"]
    for file in sources:
        if not file.exists():
            raise kr5.FileError(file, f"no such file; expected {FORMS}")
    if len(sources) != 2:
        raise kr5.InvalidArgument(f"found {', '.join(map(str, sources))}; expected {FORMS}")
    data = ScanData()
    keys, times = _read_profiles(sources[0], wanted, profile_length, data)
    poses = wanted.read(sources[1], [PROFILE_OF_POSE, TARGET, OPTIONAL_TIME, PoseRole(), joints_role(needed=False)])
    _add_poses(poses, keys, times, delay, max_gap, data)
    return data


def _read_profiles(
    file: Path, wanted: TableOptions, length: str | None, data: ScanData
) -> tuple[list[str], np.ndarray | None]:
    """Fills in the profiles; their keys, in the order of the file, and their times."""
    table = read_table(file, [PROFILE, *COORDINATES, OPTIONAL_TIME, TARGET], Units(length))
    wanted.tell(table.notes)
    x, z = table["x"], table["z"]
    _check_coordinates(file, x, z)
    rows: dict[str, list[int]] = {}
    for k, key in enumerate(table.words["profile"]):
        rows.setdefault(key, []).append(k)
    for key, of_profile in rows.items():
        data.names.append(key)
        data.profiles.append(calibration.LineProfile(x=x[of_profile], z=z[of_profile]))
        data.targets.append(table.words["target"][of_profile[0]] if "target" in table else "")
    return list(rows), None if "t" not in table else np.array([table["t"][k[0]] for k in rows.values()])


def _check_coordinates(file: Path, x: np.ndarray, z: np.ndarray) -> None:
    seen = np.isfinite(x) & np.isfinite(z)
    if not seen.any():
        raise kr5.FileError(file, "no point has both x and z")
    x, z = x[seen], z[seen]
    if np.median(np.abs(z)) < LEAST_RANGE and np.median(np.abs(x)) < LEAST_RANGE:
        raise kr5.FileError(
            file,
            f"found ranges of {1e3 * np.median(np.abs(z)):.3f} mm, expected metres, or millimetres with"
            " --profile-length-unit mm",
        )
    if x.min() > 0 and z.min() < 0 < z.max():
        raise kr5.FileError(file, "x is always positive and z is not: are the columns x and z swapped?")


def _add_poses(
    table: Table, keys: list[str], times: np.ndarray | None, delay: float, max_gap: float, data: ScanData
) -> None:
    """The pose of each profile: by its key, by its time, or in the same order."""
    T, q = table.poses["pose"], table.get("q")
    profiles = table.words.get("profile")
    if "target" in table and not any(data.targets):
        if profiles is None:
            raise kr5.FileError(table.file, "target: needs a column profile, which says whose target it is")
        of_key = dict(zip(profiles, table.words["target"], strict=True))
        data.targets = [of_key.get(key, "") for key in keys]
    if profiles is not None:
        row = {key: k for k, key in enumerate(profiles)}
        if len(row) != len(T):
            raise kr5.FileError(table.file, "a profile has several poses")
        if lost := [key for key in keys if key not in row]:
            raise kr5.FileError(table.file, f"there is no pose of profile {', '.join(lost[:5])}")
        order = [row[key] for key in keys]
    elif times is not None and "t" in table:
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


def _interpolate(table: Table, T: list[np.ndarray], times: np.ndarray, max_gap: float, data: ScanData) -> None:
    poses, inside = calibration.interpolate_poses(list(table["t"]), T, list(times), max_gap)
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


def recorded_scans(recording: kr5.cell.Recording, split: str) -> tuple[ScanData, list[Any]]:
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
