"""Clouds of points from profiles: made, and written as PLY, NPZ or CSV."""

from pathlib import Path
from typing import Any

import kr5
import kr5.calibration
import numpy as np
from kr5 import calibration
from kr5.files.writing import beside

MOST_SHOWN = 3000  # points in a result file, for its page


def cloud_of(
    profiles: list[calibration.LineProfile], poses: list[np.ndarray], T_flange_scanner: np.ndarray
) -> calibration.ProfileCloud:
    """Points of profiles in the base."""
    return calibration.profiles_to_cloud(profiles, poses, T_flange_scanner)


def thinned_cloud(cloud: kr5.calibration.ProfileCloud) -> dict[str, Any]:
    """Part of a cloud, spread evenly over it [m]."""
    points = np.asarray(cloud.points)
    step = max(1, -(-points.shape[1] // MOST_SHOWN))
    return {"count": points.shape[1], "points": np.round(points[:, ::step], 6)}


def check_cloud_ending(file: Path | None) -> None:
    """Complains of a file whose ending names no format."""
    if file and file.suffix.lower() not in (".ply", ".npz", ".csv"):
        raise kr5.FileError(file, f"found the ending {file.suffix or 'none'}, expected .ply, .npz or .csv")


def write_cloud(cloud: kr5.calibration.ProfileCloud, file: Path) -> None:
    """x y z [m] with the number of the profile and the place along it, by the ending of the file."""
    points = np.asarray(cloud.points).T
    profile, x = np.asarray(cloud.profile), np.asarray(cloud.x)
    check_cloud_ending(file)
    with beside(file) as new:
        if file.suffix.lower() == ".npz":
            with new.open("wb") as stream:
                np.savez_compressed(stream, points=points, profile=profile, x=x)
        elif file.suffix.lower() == ".csv":
            np.savetxt(
                new, np.column_stack([points, profile, x]), delimiter=",", header="x,y,z,profile,along", comments=""
            )
        else:
            rows = np.empty(len(points), [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("profile", "<i4")])
            rows["x"], rows["y"], rows["z"], rows["profile"] = *points.T, profile
            fields = "".join(f"property float {a}\n" for a in "xyz") + "property int profile\n"
            head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n{fields}end_header\n"
            new.write_bytes(head.encode() + rows.tobytes())
