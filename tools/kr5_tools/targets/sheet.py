"""The sheet of a printed target: its size, where the target lies on it, and the ruler that checks the scale."""

import math
import re
from dataclasses import dataclass
from pathlib import Path

import kr5
import numpy as np
from matplotlib.figure import Figure

# Width and height, upright [mm].
PAPERS = {
    "a2": (420.0, 594.0),
    "a3": (297.0, 420.0),
    "a4": (210.0, 297.0),
    "a5": (148.0, 210.0),
    "letter": (215.9, 279.4),
    "legal": (215.9, 355.6),
    "tabloid": (279.4, 431.8),
}
RULER = 16.0  # height of the strip below the target that holds ruler and text [mm]
EDGE = 5.0  # that printers leave blank on each side [mm]
PROBE = 600  # dots along the longer side of the coarse picture that tells the border of the target
STEP = 0.5e-3  # to which a smaller length is rounded down [m]
INSTRUCTION = "Print at 100 % (no “fit to page”), then measure: this line is {} mm long."


@dataclass
class Extent:
    """A target with its white border [mm]."""

    width: float
    height: float
    border: tuple[float, float, float, float]  # white: left, top, right, bottom

    def scaled(self, factor: float) -> "Extent":
        left, top, right, bottom = self.border
        border = (factor * left, factor * top, factor * right, factor * bottom)
        return Extent(factor * self.width, factor * self.height, border)

    def needs(self) -> tuple[float, float]:
        """Width and height of the smallest sheet: no black where printers leave the edge blank, the ruler below."""
        left, top, right, _ = (max(0.0, EDGE - side) for side in self.border)
        return self.width + left + right, self.height + top + RULER + EDGE

    def fits(self, sheet: tuple[float, float]) -> bool:
        return all(need <= size + 1e-6 for need, size in zip(self.needs(), sheet))


def parse_paper(text: str) -> tuple[float, float]:
    """Width and height of a sheet, upright [mm]."""
    if text.lower() in PAPERS:
        return PAPERS[text.lower()]
    found = re.fullmatch(r"(\d+(?:\.\d+)?)x(\d+(?:\.\d+)?)", text)
    sizes = sorted(float(size) for size in found.groups()) if found else []
    if not sizes or sizes[0] < 40 or sizes[1] > 5000:
        raise kr5.InvalidArgument(
            f"--paper: found {text!r}, expected one of {', '.join(PAPERS)}, or WIDTHxHEIGHT such as 330x480, from 40 to"
            " 5000 mm"
        )
    return sizes[0], sizes[1]


def measure_extent(target: kr5.Target) -> Extent:
    """Size and border of a target, from a coarse picture."""
    import kr5.vision

    width, height = (1e3 * float(v) for v in np.diff(kr5.vision.printed_area(target), axis=1).ravel())
    dot = max(width, height) / PROBE
    dark = np.asarray(kr5.vision.draw_target(target, 1e3 / dot)) < 128
    rows, columns = (np.flatnonzero(dark.any(axis=axis)) for axis in (1, 0))
    left, top = dot * columns[0], dot * rows[0]
    return Extent(width, height, (left, top, width - dot * (columns[-1] + 1), height - dot * (rows[-1] + 1)))


def choose_sheet(target: str, parsed: kr5.Target, paper: str, orientation: str) -> tuple[float, float]:
    """Width and height of the sheet as it is printed [mm]; complains of one that is too small, and says what fits."""
    extent, (short, long) = measure_extent(parsed), parse_paper(paper)
    for sheet in allowed_sheets(short, long, orientation):
        if extent.fits(sheet):
            return sheet
    need = extent.needs()
    on = paper if orientation == "auto" else f"{paper} {orientation}"
    raise kr5.InvalidArgument(
        f"{target}: needs {need[0]:.0f} x {need[1]:.0f} mm with its ruler, more than {on} has;"
        f" {_remedy(target, extent, (short, long), orientation)}"
    )


def allowed_sheets(short: float, long: float, orientation: str) -> list[tuple[float, float]]:
    """Width and height of a paper as it may be laid [mm]."""
    sheets = {"portrait": (short, long), "landscape": (long, short)}
    return list(sheets.values()) if orientation == "auto" else [sheets[orientation]]


def _remedy(target: str, extent: Extent, paper: tuple[float, float], orientation: str) -> str:
    """The largest size of the target that fits, and the smallest paper that holds this one."""
    factor = max(largest_factor(extent, sheet) for sheet in allowed_sheets(*paper, orientation))
    smaller = scale_lengths(target, factor)
    share = math.floor(1000 * factor) / 10
    out = f"the largest that fits is {smaller}" if smaller else f"the largest that fits has {share:g} % of its lengths"
    larger = [name for name, size in PAPERS.items() if any(extent.fits(s) for s in allowed_sheets(*size, orientation))]
    if larger:
        out += f"; or --paper {min(larger, key=lambda name: math.prod(PAPERS[name]))}"
    return out


def largest_factor(extent: Extent, sheet: tuple[float, float]) -> float:
    """By which a target is scaled to fill a sheet."""
    low, high = 0.0, 1.0
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if extent.scaled(middle).fits(sheet) else (low, middle)
    return low


def scale_lengths(target: str, factor: float) -> str | None:
    """The short form with its lengths scaled by no more than this, the first of them rounded down; or None for a file
    and for a target of which nothing is left."""
    parts = target.split(":")
    lengths = [k for k, part in enumerate(parts) if k and re.fullmatch(r"\d*\.\d+", part)]
    if target.endswith((".yaml", ".yml", ".json")) or not lengths:
        return None
    first = float(parts[lengths[0]])
    rounded = STEP * math.floor(first * factor / STEP + 1e-9)
    if rounded <= 0:
        return None
    for k in lengths:
        parts[k] = f"{float(parts[k]) * rounded / first:.4g}"
    return ":".join(parts)


def draw_sheet(
    picture: np.ndarray, target: str, extent: tuple[float, float], sheet: tuple[float, float], dpi: int
) -> Figure:
    """The figure of a sheet: the target across the middle, below it the ruler. `extent`: of the target [mm]."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    width, height = sheet
    figure = plt.figure(figsize=(width / 25.4, height / 25.4), dpi=dpi)
    spare = max(0.0, height - extent[1] - RULER)
    left, below = (width - extent[0]) / 2, min(spare, max(EDGE, spare / 2))

    def dots(length: float) -> float:  # whole ones, so that the picture is not resampled
        return round(length / 25.4 * dpi) * 25.4 / dpi

    place = (dots(left) / width, dots(below + RULER) / height, extent[0] / width, extent[1] / height)
    axes = figure.add_axes(place)
    axes.imshow(picture, cmap="gray", vmin=0, vmax=255, interpolation="none", aspect="auto")
    axes.set_axis_off()
    _draw_ruler(figure, target, sheet, below)
    return figure


def _draw_ruler(figure: Figure, target: str, sheet: tuple[float, float], bottom: float) -> None:
    """A line with ticks each millimetre, what it is for, and the target in words."""
    width, height = sheet
    axes = figure.add_axes((0, bottom / height, 1, RULER / height), xlim=(0, width), ylim=(0, RULER))
    axes.set_axis_off()
    length = min(100, 10 * math.floor((width - 6) / 10))
    start = max(3.0, min((width - length) / 2, 20.0))
    for mm in range(length + 1):
        tick = 3.5 if mm % 10 == 0 else 2 if mm % 5 == 0 else 1.2
        axes.plot([start + mm] * 2, [13, 13 - tick], color="black", linewidth=0.4)
    axes.plot([start, start + length], [13, 13], color="black", linewidth=0.4)
    lines = [INSTRUCTION.format(length)]
    if len(target) < 80:
        lines.append(f"{target}, lengths in metres")
    room = width - start - 3
    for k, text in enumerate(lines):
        size = max(3.0, min(7.0, 1.7 * room / len(text) / 0.3528))
        axes.text(start, 6.5 - 3.4 * k, text, fontsize=size, va="center", color="black")


def save_sheet(figure: Figure, output: Path, dpi: int) -> None:
    import matplotlib.pyplot as plt
    from kr5.files import writing

    try:
        writing.save_figure(figure, output, dpi=dpi)
    finally:
        plt.close(figure)
