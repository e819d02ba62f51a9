"""A target in the size that the robot poses tell."""

from dataclasses import replace

import kr5

from kr5_tools.targets.sightings import Sightings

LENGTHS = {"chessboard": 1, "circles": 1, "tag": 1, "grid": 2}  # that end the short form of a target


def resized_name(name: str, factor: float) -> str:
    """Short form of a target that is `factor` times as large."""
    parts = name.split(":")
    count = LENGTHS[parts[0]]
    size, *gap = (factor * float(part) for part in parts[-count:])
    return ":".join([*parts[:-count], f"{size:.4g}", *(f"{g:.3g}" for g in gap)])


def resized_sightings(seen: Sightings, factor: float) -> Sightings:
    """The sightings of that target."""
    views = [kr5.View.from_dict({**view.to_dict(), "points": (factor * view.points).tolist()}) for view in seen.views]
    return replace(seen, views=views)
