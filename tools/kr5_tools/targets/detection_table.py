"""What `kr5 detect` saw, as rows of a table: for the terminal and for the page."""

from typing import Any

import numpy as np

COLUMNS = ("image", "what", "corners [px]", "noise [px]", "RMS [px]")


def median_noise(items: list[dict[str, Any]]) -> float | None:
    """Median of the standard deviations of the points [px]; None where none is known."""
    sigma = np.hstack([np.asarray(item["sigma"], float) for item in items])
    return float(np.median(sigma[sigma > 0])) if (sigma > 0).any() else None


def seen_row(item: dict[str, Any]) -> list[Any]:
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


def pose_word(item: dict[str, Any]) -> str:
    """Whether the pose of an entry of `found` is known, and whether there are two."""
    pose = item.get("pose")
    if not pose:
        return item.get("pose_message") or "–"
    return f"ambiguous: the other pose has {100 * pose['second_probability']:.0f} %" if pose["ambiguous"] else "clear"


def seen_table(data: dict[str, Any]) -> list[list[str]]:
    """What was seen, under COLUMNS and the pose, in the order of the images; the image and why, where nothing was."""
    rows = [[*seen_row(item), pose_word(item)] for item in data.get("found", ())]
    order = {view["name"]: i for i, view in enumerate(data.get("views", ()))}
    rows += [[item["view"], item["message"]] for item in data.get("not_found", ())]
    return sorted(rows, key=lambda row: order.get(row[0], len(order)))
