"""Targets found in images, and targets read from a short form or a file."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import kr5
from kr5.files import images
from kr5.files.documents import display_value, read_yaml
from kr5.files.paths import library_path

from kr5_tools.cli import terminal

if TYPE_CHECKING:
    import kr5.vision
    import numpy as np

MM = 1000.0


def load_target(text: str) -> kr5.Target:
    """A target from its short form, from a YAML or JSON file with its fields, or from what `kr5 calibrate map`
    wrote."""
    if not text.endswith((".yaml", ".yml", ".json")):
        return kr5.parse_target(text)
    expected = "a file with the fields of a target, or a result of kr5 calibrate map"
    fields = read_yaml(text, expected)
    if isinstance(fields, dict) and str(fields.get("format", "")).startswith("kr5-marker-map/"):
        result = fields.get("result")
        fields = result.get("target") if isinstance(result, dict) else None
    if not isinstance(fields, dict):
        raise kr5.FileError(text, f"found {display_value(fields)}, expected {expected}")
    try:
        return kr5.Target.from_dict(fields)
    except (KeyError, TypeError, ValueError) as error:
        raise kr5.FileError(text, f"is not a target: {' '.join(str(error).split())}") from error


SMALLEST_TARGET, LARGEST_TARGET = 2e-4, 5.0  # of a square, a marker or the distance of dots [m]


def check_target_size(source: str, size: float) -> None:
    """Refuses a size that no target has, for what cannot find out: a camera sees no scale."""
    if not SMALLEST_TARGET <= size <= LARGEST_TARGET:
        hint = f"; for {size:g} mm give {size / MM:g}" if size > LARGEST_TARGET else ""
        raise kr5.FileError(source, f"size {size:g} [m], expected {SMALLEST_TARGET:g} to {LARGEST_TARGET:g}{hint}")


@dataclass
class Sightings:
    """A target as it was seen in images of one size."""

    size: tuple[int, int] | None = None  # width, height [px]
    views: list[Any] = field(default_factory=list)  # named as `short_names` does
    index: list[int] = field(default_factory=list)  # place of each view's image in the list of files
    lost: list[dict[str, str]] = field(default_factory=list)  # name, status and message of the other images

    @property
    def width(self) -> int:
        """Of every image [px]."""
        return self.size[0] if self.size else 0

    @property
    def height(self) -> int:
        """Of every image [px]."""
        return self.size[1] if self.size else 0

    correlation: list[float] = field(default_factory=list)  # of the points of each view, as its detection says it [-]


def load_image(file: Path | str) -> Any:
    """Grey levels of an image, height x width."""
    import numpy as np
    from kr5 import vision

    return np.asarray(vision.load_image(library_path(file)))


def find_in_images(
    files: Sequence[Path | str],
    target: kr5.Target,
    least: int,
    points: int = 0,
    options: "kr5.vision.DetectOptions | None" = None,
    load: "Callable[[Path | str], np.ndarray]" = load_image,
) -> Sightings:
    """The target in all images of one camera; complains when fewer than `least` show it with `points` or more, and of
    an image that cannot be read or is of another size than those before."""
    from kr5 import vision

    seen = Sightings()
    names = images.short_names(files)
    for i, file in terminal.track(list(enumerate(files)), "Looking for the target"):
        image = load(file)
        size = (image.shape[1], image.shape[0])
        seen.size = seen.size or size
        if size != seen.size:
            raise kr5.FileError(
                file,
                f"{size[0]} x {size[1]} px, but {names[0]} is {seen.size[0]} x {seen.size[1]} px: images of one"
                " camera at one setting are needed",
            )
        found = vision.find_target(image, target, options or vision.DetectOptions())
        if str(found.status) != "found":
            seen.lost.append({"name": names[i], "status": str(found.status), "message": found.message})
        elif len(found.view.ids) < points:
            seen.lost.append({"name": names[i], "status": "few_points", "message": f"fewer than {points} points seen"})
        else:
            found.view.name = names[i]
            seen.views.append(found.view)
            seen.index.append(i)
            seen.correlation.append(found.correlation)
    if len(seen.views) < least:
        why = "; ".join(f"{item['name']}: {item['message']}" for item in seen.lost[:3]) or "Take more images."
        raise kr5.InvalidArgument(
            f"the target was found in {len(seen.views)} of {len(files)} images, expected at least {least}. {why}"
        )
    return seen
