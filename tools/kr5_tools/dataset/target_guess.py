"""Which target a few images of a set show: those that the texts beside them speak of, then tags, then usual boards."""

import itertools
import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import kr5
import numpy as np
from kr5 import vision

from kr5_tools.cli.terminal import track

OPENCV_DICTIONARIES = {
    i: f"aruco_{n}x{n}_{count}" for i, (n, count) in enumerate(itertools.product((4, 5, 6, 7), (50, 100, 250, 1000)))
}
FAMILIES = ("36h11", "25h9", "16h5", "41h12", "aruco_4x4_50", "aruco_5x5_100", "aruco_6x6_250")
QUICK = vision.DetectOptions(explain=False)
LATTICE = 0.25  # tags may stand by so much of their spacing beside the places of a grid; lenses bend it
NAMED, GUESSED = "named in a text of the folder", "its size is a guess; measure it"


def guess_target(text: str, keys: Mapping[str, object], images: dict[Path, np.ndarray]) -> tuple[str, str]:
    """Short form of the target that most of the images show, and why it was tried."""
    if best := _best(_named(text, keys), images):
        return best
    family, tags = _shown(images.values())
    if best := _best(_tags(text, keys, family, tags), images) or _best(
        _usual(text, keys), images
    ):  # tags look like dots
        return best
    if any(tags):
        raise kr5.InvalidArgument(
            f"tags of {family} are seen, but neither one of them nor a grid numbered row by row from 0: find their"
            " places with `kr5 calibrate map`, and name the map with --target"
        )
    raise kr5.InvalidArgument(f"no known target was found in {', '.join(map(str, images))}; name it with --target")


def _best(way: list[tuple[str, str]], images: dict[Path, np.ndarray]) -> tuple[str, str] | None:
    """The one, of targets with why they are tried, that most of the images show; None when no image shows one."""
    best, most = None, 0
    for name, why in track(way, "Trying targets"):
        target = kr5.parse_target(name)
        count = sum(str(vision.find_target(image, target, QUICK).status) == "found" for image in images.values())
        if count > most:
            best, most = (name, why), count
        if count == len(images):
            break
    return best


def _shown(images: Iterable[np.ndarray]) -> tuple[str, list[list[Any]]]:
    """The tags in each image, of the family that has most."""
    options = vision.TagOptions(families=list(FAMILIES))
    shown = [vision.find_tags(image, options) for image in images]
    counts = Counter(tag.family for tags in shown for tag in tags)
    family = max(counts, key=counts.__getitem__, default="")
    return family, [[tag for tag in tags if tag.family == family] for tags in shown]


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


def _named(text: str, keys: Mapping[str, object]) -> list[tuple[str, str]]:
    """Targets that the texts speak of."""
    out = []
    rows, cols, size = keys.get("rows"), keys.get("cols"), _size(text, keys)
    if not size:
        return []
    if rows and cols and "aruco_marker_dim" in keys:
        family = OPENCV_DICTIONARIES.get(int(_number(keys.get("dictionary", 10))), "aruco_6x6_250")
        out.append((f"charuco:{family}:{rows}x{cols}:{size}:{keys['aruco_marker_dim']}", NAMED))
    elif rows and cols:
        out += [(f"{kind}:{rows}x{cols}:{size}", NAMED) for kind in ("circles", "chessboard")]
    if board := re.search(r"(\d+)\s*x\s*(\d+)", text):
        a, b = board.groups()
        out += [(f"chessboard:{r}x{c}:{size}", f"size {NAMED}") for r, c in ((b, a), (a, b))]
    return out


def _usual(text: str, keys: Mapping[str, object]) -> list[tuple[str, str]]:
    """Boards that many have."""
    boards = [(6, 9), (6, 8), (5, 8), (7, 9), (7, 10), (8, 11), (5, 7), (7, 7), (8, 8), (4, 6), (6, 7), (9, 14)]
    grids = [(10, 10), (4, 5), (7, 7), (5, 7), (6, 9)]
    size = _size(text, keys)
    why = "found by trying" + ("" if size else f"; {GUESSED}")
    out = [(f"chessboard:{r}x{c}:{size or 0.025}", why) for r, c in boards]
    return out + [(f"circles:{r}x{c}:{size or 0.02}", why) for r, c in grids]


def _tags(
    text: str, keys: Mapping[str, object], family: str, shown: list[list[vision.TagDetection]]
) -> list[tuple[str, str]]:
    """The one tag, or the board of tags, that the images show, with why."""
    counts = Counter(tag.id for tags in shown for tag in tags)
    often = max(counts.values(), default=0)
    ids = {i for i, n in counts.items() if 2 * n > often}  # a wrong tag is seen now and then
    named = _size(text, keys)
    size, how = float(named or 0.05), f"size {NAMED}" if named else GUESSED
    if len(ids) == 1:
        return [(f"tag:{family}:{min(ids)}:{size:g}", f"one tag of {family} seen; {how}")]
    if grid := _grid([tag for tag in max(shown, key=len) if tag.id in ids]):
        cols, gap = grid
        name = f"grid:{family}:{max(ids) // cols + 1}x{cols}:{size:g}:{gap * size:.3g}"
        return [(name, f"{len(ids)} tags of {family} seen in rows of {cols}, with gaps of {gap:.3f} sides; {how}")]
    return []


def _grid(tags: list[vision.TagDetection]) -> tuple[int, float] | None:
    """Columns of a board whose tags are numbered row by row from 0, and its gaps as parts of a tag's side; None when
    the tags of one image do not show such a board.

    The first corners of its tags are a lattice. Of all numbers of columns the right one is that under which the lattice
    and the image differ by a homography."""
    ids, corners = np.array([tag.id for tag in tags], int), np.array([tag.corners for tag in tags], float)
    best, least = 0, LATTICE
    for cols in range(2, ids.max(initial=0) + 1):
        lattice = np.array([ids % cols, ids // cols], float)
        if len(ids) < 6 or min(len(set(row)) for row in lattice) < 2:
            continue
        H = _homography(corners[:, :, 0].T, lattice)
        off, second, fourth = (_through(H, corners[:, :, k].T) - lattice for k in (0, 1, 3))
        if (
            np.abs(off).max() < least and second[0].min() > 0 and fourth[1].min() > 0
        ):  # these are to the right, and below
            best, least = cols, np.abs(off).max()
    gap = _gap(dict(zip(ids, corners)), best) if best else None
    return (best, gap) if gap else None


def _gap(tags: dict[int, np.ndarray], cols: int) -> float | None:
    """Gap over side, from the cross-ratio of the corners of neighbours: neither slant nor, so near, the lens changes
    it."""
    sides = []
    for i, a in tags.items():
        for j, end in ((i + 1 if (i + 1) % cols else -1, 1), (i + cols, 3)):
            if (b := tags.get(j)) is not None:
                inner, outer = (np.linalg.norm(a[:, p] - b[:, q]) for p, q in ((end, 0), (0, end)))
                ratio = np.linalg.norm(a[:, end] - a[:, 0]) * np.linalg.norm(b[:, end] - b[:, 0]) / (inner * outer)
                sides.append(np.sqrt(ratio / (1 + ratio)))  # in pitches
    return float(1 / np.median(sides) - 1) if sides else None


def _homography(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The 3 x 3 matrix that takes points a to b (2 x n) with the least algebraic error."""
    centre, scale = a.mean(axis=1, keepdims=True), a.std()
    x, y = (a - centre) / scale
    one, none = np.ones_like(x), np.zeros_like(x)
    rows = [
        np.array([x, y, one, none, none, none, -b[0] * x, -b[0] * y, -b[0]]),
        np.array([none, none, none, x, y, one, -b[1] * x, -b[1] * y, -b[1]]),
    ]
    H = np.linalg.svd(np.hstack(rows).T)[2][-1].reshape(3, 3)
    return np.asarray(
        H @ np.array([[1 / scale, 0, -centre[0, 0] / scale], [0, 1 / scale, -centre[1, 0] / scale], [0, 0, 1]])
    )


def _through(H: np.ndarray, points: np.ndarray) -> np.ndarray:
    out = H[:, :2] @ points + H[:, 2:]
    with np.errstate(divide="ignore", invalid="ignore"):  # a matrix of points on one line
        return np.asarray(out[:2] / out[2])
