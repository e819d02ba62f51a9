"""Which target a few images of a set show: those that the texts beside them speak of, then tags, then usual boards."""

import itertools
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import kr5
import numpy as np
from kr5 import vision

from kr5_tools.cli.terminal import track

OPENCV_DICTIONARIES = {
    i: f"aruco_{n}x{n}_{count}" for i, (n, count) in enumerate(itertools.product((4, 5, 6, 7), (50, 100, 250, 1000)))
}
FAMILIES = ("36h11", "25h9", "16h5", "41h12", "aruco_4x4_50", "aruco_5x5_100", "aruco_6x6_250")
QUICK = vision.DetectOptions(explain=False)
NAMED, GUESSED = "named in a text of the folder", "its size is a guess; measure it"


@dataclass(frozen=True)
class TargetGuess:
    """Short form of a target, and why it is tried."""

    name: str
    why: str
    is_size_guessed: bool = False  # nothing tells it


def guess_target(text: str, keys: Mapping[str, object], images: dict[Path, np.ndarray]) -> TargetGuess:
    """The target that most of the images show."""
    if best := _best(_named(text, keys), images):
        return best
    shown = _shown(images.values())
    if best := _best(_tags(text, keys, shown), images) or _best(_usual(text, keys), images):  # tags look like dots
        return best
    if shown.ids:
        raise kr5.InvalidArgument(
            f"tags of {shown.family} are seen, but neither one of them nor a grid numbered row by row from 0: find"
            " their places with `kr5 calibrate map`, and name the map with --target"
        )
    raise kr5.InvalidArgument(f"no known target was found in {', '.join(map(str, images))}; name it with --target")


def _best(way: list[TargetGuess], images: dict[Path, np.ndarray]) -> TargetGuess | None:
    """The one that most of the images show; None when no image shows one."""
    best, most = None, 0
    for tried in track(way, "Trying targets"):
        target = kr5.parse_target(tried.name)
        count = sum(str(vision.find_target(image, target, QUICK).status) == "found" for image in images.values())
        if count > most:
            best, most = tried, count
        if count == len(images):
            break
    return best


def _shown(images: Iterable[np.ndarray]) -> vision.TagGrid:
    """The tags in the images, of the family that has most, and how they stand."""
    options = vision.TagOptions(families=list(FAMILIES))
    return vision.guess_tag_grid([vision.find_tags(image, options) for image in images])


def _size(text: str, keys: Mapping[str, object]) -> str | None:
    """The size [m] that the texts speak of."""
    spoken = re.findall(r"size[^\d]*([\d.]+)\s*m\b", text)
    for value in (keys.get("spacing"), keys.get("chessboard_dim"), *spoken[:1]):
        if (number := _number(value)) > 0:
            return f"{number:g}"
    return None


def _number(value: object) -> float:
    """0 for what is no finite number."""
    if not isinstance(value, (int, float, str)):
        return 0.0
    try:
        number = float(value)
    except ValueError:
        return 0.0
    return number if math.isfinite(number) else 0.0


def _named(text: str, keys: Mapping[str, object]) -> list[TargetGuess]:
    """Targets that the texts speak of."""
    out = []
    rows, cols, size = keys.get("rows"), keys.get("cols"), _size(text, keys)
    if not size:
        return []
    if rows and cols and "aruco_marker_dim" in keys:
        family = OPENCV_DICTIONARIES.get(int(_number(keys.get("dictionary", 10))), "aruco_6x6_250")
        out.append(TargetGuess(f"charuco:{family}:{rows}x{cols}:{size}:{keys['aruco_marker_dim']}", NAMED))
    elif rows and cols:
        out += [TargetGuess(f"{kind}:{rows}x{cols}:{size}", NAMED) for kind in ("circles", "chessboard")]
    if board := re.search(r"(\d+)\s*x\s*(\d+)", text):
        a, b = board.groups()
        out += [TargetGuess(f"chessboard:{r}x{c}:{size}", f"size {NAMED}") for r, c in ((b, a), (a, b))]
    return out


def _usual(text: str, keys: Mapping[str, object]) -> list[TargetGuess]:
    """Boards that many have."""
    boards = [(6, 9), (6, 8), (5, 8), (7, 9), (7, 10), (8, 11), (5, 7), (7, 7), (8, 8), (4, 6), (6, 7), (9, 14)]
    grids = [(10, 10), (4, 5), (7, 7), (5, 7), (6, 9)]
    size = _size(text, keys)
    names = [f"chessboard:{r}x{c}:{size or 0.025}" for r, c in boards]
    names += [f"circles:{r}x{c}:{size or 0.02}" for r, c in grids]
    return [TargetGuess(name, "found by trying", is_size_guessed=not size) for name in names]


def _tags(text: str, keys: Mapping[str, object], shown: vision.TagGrid) -> list[TargetGuess]:
    """The one tag, or the board of tags, that the images show, with why."""
    named = _size(text, keys)
    size, how = float(named or 0.05), f"; size {NAMED}" if named else ""
    if len(shown.ids) == 1:
        name = f"tag:{shown.family}:{shown.ids[0]}:{size:g}"
        return [TargetGuess(name, f"one tag of {shown.family} seen{how}", is_size_guessed=not named)]
    if not shown.fit.usable:
        return []
    name = f"grid:{shown.family}:{shown.rows}x{shown.cols}:{size:g}:{shown.gap * size:.3g}"
    seen = f"{len(shown.ids)} tags of {shown.family} seen in rows of {shown.cols}, with gaps of {shown.gap:.3f} sides"
    return [TargetGuess(name, seen + how, is_size_guessed=not named)]
