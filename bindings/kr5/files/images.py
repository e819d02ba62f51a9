"""Image files that a command is given."""

import os
from collections.abc import Iterable
from pathlib import Path

import kr5

MOST_CAMERA_VIEWS = 100  # more make a camera hardly better known, and fits of several lens models slow and large
IMAGE_ENDINGS = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm")


def image_files(given: list[Path]) -> list[Path]:
    """The files given, and the images of the folders given; complains of what is not there."""
    files = []
    for path in given:
        if not path.exists():
            raise kr5.FileError(path, "no such file or folder")
        inside = sorted(f for f in path.iterdir() if f.suffix.lower() in IMAGE_ENDINGS) if path.is_dir() else [path]
        if not inside:
            raise kr5.FileError(path, f"the folder contains no image ({', '.join(IMAGE_ENDINGS)})")
        files += inside
    return files


def thinned(count: int, most: int) -> list[int]:
    """Numbers of at most so many of `count` things, spread evenly over them, the first and the last among them."""
    steps = min(count, most) - 1
    return [round(k * (count - 1) / steps) for k in range(steps + 1)] if steps > 0 else [0]


def short_names(files: Iterable[Path | str]) -> list[str]:
    """The name of each file, with as many of its folders as tell it from the others."""
    paths = [Path(os.path.abspath(file)).parts[1:] for file in files]
    depth = 1
    while len({path[-depth:] for path in paths}) < len(set(paths)):
        depth += 1
    return ["/".join(path[-depth:]) for path in paths]
