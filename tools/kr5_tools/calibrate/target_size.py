"""The size of a target of which nothing tells it, from the robot poses at which it was seen: a camera alone sees no
scale."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import kr5
from kr5 import calibration

from kr5_tools.cli.terminal import spinner
from kr5_tools.targets.sightings import Sightings

TRIED = 3  # readings of the poses, the best first: with a wrong size the true one may not be the first
LENGTHS = {"chessboard": 1, "circles": 1, "tag": 1, "grid": 2}  # that end the short form of a target


@dataclass
class SizedTarget:
    """A target with the size that the poses tell, its sightings, and the readings of the poses under it."""

    name: str
    seen: Sightings
    conventions: list[calibration.PoseConvention]


def rank(
    readings: list[calibration.PoseRows], seen: Sightings, camera: kr5.Pinhole
) -> list[calibration.PoseConvention]:
    """The readings of the poses, the one under which robot and camera agree best first."""
    views = [calibration.ViewOfPose(pose=i, view=v) for i, v in zip(seen.index, seen.views, strict=True)]
    return list(calibration.rank_conventions(readings, views, camera))


def size_from_poses(
    name: str,
    seen: Sightings,
    readings: list[calibration.PoseRows],
    camera: kr5.Pinhole,
    conventions: Sequence[calibration.PoseConvention],
) -> SizedTarget | None:
    """The target in the size with which robot and camera agree best; None when the poses tell no other size than that
    of `name`."""
    with spinner("Looking for the size of the target"):
        factors = (_factor(seen, readings, camera, found) for found in conventions[:TRIED])
        sized = [_scaled(name, seen, readings, camera, factor) for factor in factors if factor]
    better = [s for s in sized if s.conventions and s.conventions[0].error < conventions[0].error]
    return min(better, key=lambda s: s.conventions[0].error, default=None)


def _factor(
    seen: Sightings,
    readings: list[calibration.PoseRows],
    camera: kr5.Pinhole,
    convention: calibration.PoseConvention,
) -> float | None:
    """How many times as large as stated the target is under a reading of the poses."""
    form = convention.format
    rows = next(r.rows for r in readings if r.rotation == form.rotation)[seen.index]
    views = [
        calibration.HandEyeView(T_base_flange=T, view=v)
        for T, v in zip(calibration.to_poses(rows, form), seen.views, strict=True)
    ]
    result = calibration.calibrate_hand_eye(views, camera, calibration.HandEyeOptions(mount=convention.mount))
    diagnosis = calibration.diagnose_hand_eye(rows, form, seen.views, camera, convention.mount, result)
    wrong = calibration.HandEyeCause("target_size_wrong")
    return next((cause.value for cause in diagnosis.causes if cause.cause == wrong), None)


def _scaled(
    name: str, seen: Sightings, readings: list[calibration.PoseRows], camera: kr5.Pinhole, factor: float
) -> SizedTarget:
    parts = name.split(":")
    count = LENGTHS[parts[0]]
    size, *gap = (factor * float(part) for part in parts[-count:])
    named = ":".join([*parts[:-count], f"{size:.4g}", *(f"{g:.3g}" for g in gap)])
    views = [kr5.View.from_dict({**view.to_dict(), "points": (factor * view.points).tolist()}) for view in seen.views]
    resized = replace(seen, views=views)
    return SizedTarget(named, resized, rank(readings, resized, camera))
