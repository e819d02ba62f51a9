"""Profiles of a line scanner on a moving arm, as files hold them."""

import zipfile
from pathlib import Path

import kr5
import numpy as np
from kr5 import picking

NEEDED = {
    "profile_x": "places along each profile, profiles x samples [m]",
    "profile_z": "distances from the scanner, profiles x samples [m]; NaN where nothing was measured",
    "times": "time of each profile [s]",
    "T_base_flange": "pose of the flange, poses x 4 x 4",
    "T_flange_scanner": "pose of the scanner on the flange, 4 x 4",
}


def read_profiles(file: Path, delay: float | None) -> tuple[np.ndarray, np.ndarray] | None:
    """Points and the origins of their rays, n x 3 in the base [m]; nothing where the file holds a finished cloud, whose
    delay nobody changes, or no profiles."""
    try:
        with np.load(file, allow_pickle=False) as data:
            names = set(data.files)
            if "profile_x" not in names and "profile_z" not in names:
                return None
            if delay is None and names & {"points", "xyz", "cloud", "pts"}:
                return None
            arrays = {name: np.asarray(data[name]) for name in (*NEEDED, "pose_times", "delay", "lag") if name in names}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise kr5.FileError(file, f"is damaged or no NPZ file: {' '.join(str(error).split())[:200]}") from error
    for name, meaning in NEEDED.items():
        if name not in arrays:
            raise kr5.FileError(file, f"{name} is missing: {meaning}")
        if arrays[name].dtype.kind not in "fiu":
            raise kr5.FileError(
                file, f"found values of type {arrays[name].dtype}, expected numbers: {meaning}", field=name
            )
    poses = arrays["T_base_flange"]
    if poses.ndim != 3 or poses.shape[1:] != (4, 4):
        shape = " x ".join(str(n) for n in poses.shape)
        raise kr5.FileError(
            file, f"found an array of {shape}, expected {NEEDED['T_base_flange']}", field="T_base_flange"
        )
    times = arrays["times"].astype(float)
    pose_times = arrays.get("pose_times", times).astype(float)
    if len(pose_times) != len(poses):
        raise kr5.FileError(
            file,
            f"found {len(poses)} poses, expected one a time of pose_times, {len(pose_times)}",
            field="T_base_flange",
        )
    if arrays["profile_x"].shape != arrays["profile_z"].shape or arrays["profile_x"].ndim != 2:
        raise kr5.FileError(file, "profile_x and profile_z: expected arrays of the same profiles x samples [m]")
    try:
        cloud = picking.cloud_from_profiles(
            picking.ProfileScan(
                x=arrays["profile_x"].astype(float),
                z=arrays["profile_z"].astype(float),
                times=times,
                T_base_flange=list(poses.astype(float)),
                pose_times=pose_times,
                T_flange_scanner=arrays["T_flange_scanner"].astype(float),
                delay=float(arrays.get("delay", arrays.get("lag", 0.0))) if delay is None else delay,
            )
        )
    except (kr5.Error, ValueError) as error:
        raise kr5.FileError(file, str(error)) from error
    return np.asarray(cloud.points).T, np.asarray(cloud.origins).T
