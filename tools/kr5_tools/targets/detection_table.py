"""What `kr5 detect` saw: a row an object for the terminal, and the rows of the page."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from kr5.files.result_types import ResultData

from kr5_tools.cli.numbers import NONE, format_count
from kr5_tools.cli.tables import make_table, pose_figures
from kr5_tools.cli.terminal import Console

COLUMNS = ("image", "what", "corners [px]", "noise [px]", "RMS [px]")


def median_noise(items: Sequence[Mapping[str, object]]) -> float | None:
    """Median of the standard deviations of the points [px]; None where none is known."""
    sigma = np.hstack([np.asarray(item["sigma"], float) for item in items])
    return float(np.median(sigma[sigma > 0])) if (sigma > 0).any() else None


def seen_row(item: Mapping[str, Any]) -> list[Any]:
    """One entry of `found`, under COLUMNS."""
    ids, spread = item["ids"], median_noise([item])
    corners = (
        " ".join(f"({u:.2f} {v:.2f})" for u, v in np.asarray(item["pixels"], float).T)
        if len(ids) <= 4
        else f"{len(ids)} points, numbers {min(ids)} to {max(ids)}"
    )
    return [
        item["view"],
        f"{item['what']} {item.get('id', '')}".strip(),
        corners,
        "–" if spread is None else f"{spread:.3f}",
        f"{item['rms_px']:.3f}" if item.get("rms_px") is not None else "–",
    ]


def pose_word(item: Mapping[str, Any]) -> str:
    """Whether the pose of an entry of `found` is known, and whether there are two."""
    pose = item.get("pose")
    if not pose:
        return item.get("pose_message") or "–"
    return f"ambiguous: the other pose has {100 * pose['second_probability']:.0f} %" if pose["ambiguous"] else "clear"


def seen_table(data: ResultData) -> list[list[str]]:
    """What was seen, under COLUMNS and the pose, in the order of the images; the image and why, where nothing was."""
    rows = [[*seen_row(item), pose_word(item)] for item in data.get("found", ())]
    order = {view["name"]: i for i, view in enumerate(data.get("views", ()))}
    rows += [[item["view"], item["message"]] for item in data.get("not_found", ())]
    return sorted(rows, key=lambda row: order.get(row[0], len(order)))


def print_seen(found: list[dict[str, Any]], lost: list[dict[str, Any]], images: int, to: Console) -> None:
    """For people: how much was found, a row for each object, the poses, and why nothing was found."""
    if found:
        markers = any("id" in item for item in found)
        what = f"{format_count(len(found), 'marker')} found" if markers else "Target found"
        to.print(f"{what} in {images - len(lost)} of {images} images.", style="bold", soft_wrap=True)
        names = _names(found, images)
        for table in (_place_table(found, names), _pose_table(found, names)):
            if table:
                to.print()
                to.print(table)
    if lost:
        rows = [[item["view"], item["status"].replace("_", " "), item["message"]] for item in lost]
        to.print()
        to.print(make_table("Not found", ["image", "status", "reason"], rows, text=(1, 2)))


def _names(found: list[dict[str, Any]], images: int) -> tuple[list[str], list[list[str]]]:
    """Heads and cells that name each object: its image, where there are several, and itself, where they differ."""
    heads = ["image"] if images > 1 else []
    cells = [[item["view"]] if heads else [] for item in found]
    if not heads or any("id" in item for item in found):
        heads = [*heads, "object"]
        cells = [[*cell, f"{item['what']} {item.get('id', '')}".strip()] for cell, item in zip(cells, found)]
    return heads, cells


def _place_table(found: list[dict[str, Any]], names: tuple[list[str], list[list[str]]]) -> Any:
    rows = []
    for name, item in zip(names[1], found):
        pixels = np.asarray(item["pixels"], float)
        u, v = pixels.mean(axis=1)
        square = pixels.shape[1] == 4
        side = np.linalg.norm(pixels - np.roll(pixels, 1, axis=1), axis=0).mean() if square else None
        noise, rms = median_noise([item]), item.get("rms_px")
        rows.append(
            [
                *name,
                NONE if square else str(len(item["ids"])),
                f"{u:.1f}",
                f"{v:.1f}",
                NONE if side is None else f"{side:.1f}",
                NONE if noise is None else f"{noise:.3f}",
                NONE if rms is None else f"{rms:.3f}",
            ]
        )
    heads = ["points", "centre u [px]", "centre v [px]", "side [px]", "noise [px]", "RMS [px]"]
    return make_table("In the image", [*names[0], *heads], rows, text=range(len(names[0])))


def _pose_table(found: list[dict[str, Any]], names: tuple[list[str], list[list[str]]]) -> Any:
    """The poses that were asked for; None where none was."""
    rows = []
    for name, item in zip(names[1], found):
        pose = item.get("pose")
        if not pose:
            if "pose_message" in item:
                rows.append([*name, *[NONE] * 8, item["pose_message"]])
            continue
        parts = pose_figures("", np.array(pose["T_camera_target"]), np.array(pose["covariance"]))
        position, rotation = parts[:3], parts[3:]
        rows.append(
            [
                *name,
                *(f"{p['value']:.1f}" for p in position),
                f"{max(p['std'] for p in position):.2g}",
                *(f"{p['value']:.1f}" for p in rotation),
                f"{max(p['std'] for p in rotation):.2g}",
                pose_word(item) if pose["ambiguous"] else "",
            ]
        )
    if not rows:
        return None
    heads = ["x [mm]", "y [mm]", "z [mm]", "± [mm]", "roll [deg]", "pitch [deg]", "yaw [deg]", "± [deg]", "note"]
    count = len(names[0])
    return make_table("Poses in the camera", [*names[0], *heads], rows, text=(*range(count), count + 8))
