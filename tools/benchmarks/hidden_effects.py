"""Geometric effects hidden in recordings, as `kr5 calibrate kinematics` finds them.

    python tools/benchmarks/hidden_effects.py [--reference FOLDER]

Every recording of the folder `cases` whose labels name an encoder offset, a link length or a tool offset is calibrated;
the parameter found must lie within two standard deviations of the hidden one, and these be below 2 % of the effect.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from kr5 import cell

import arguments
import comparison

EFFECTS = ("encoder_offset", "link_length", "tool_offset")


def hidden(effect: dict[str, Any], model: Any) -> dict[str, float]:
    """What the calibration ought to find: change of each coordinate [m or rad]. A link length replaces that of the
    cell, an offset is added."""
    target = effect["target"]
    ((which, value),) = effect["parameters"].items()
    if effect["effect"] == "tool_offset":
        return {f"tool.{axis}": float(v) for axis, v in zip("xyz", value, strict=True)}
    if effect["effect"] == "encoder_offset":
        return {f"arm.{target}.theta_offset": float(value)}
    row = model.robot.dh[int(target.removeprefix("joint")) - 1]
    return {f"arm.{target}.{which}": float(value) - float(getattr(row, which))}


def calibrate(recording: Path) -> dict[str, Any]:
    """Coordinates of the result of the command, by name."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "kinematics.json"
        command = [sys.executable, "-m", "kr5_tools", "calibrate", "kinematics", str(recording), "-o", str(file)]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            raise SystemExit(f"error: {' '.join(command)}: {done.stderr}")
        coordinates = json.loads(file.read_text())["result"]["coordinates"]
    return {c["name"]: c for c in coordinates}


def compare(recording: Path, effect: dict[str, Any]) -> comparison.Row:
    true = hidden(effect, cell.load_recording(recording).cell)
    found = calibrate(recording)
    change = np.array([found[name]["value"] - found[name]["nominal"] for name in true])
    std = np.array([found[name]["std"] for name in true])
    value = np.array(list(true.values()))
    off = np.abs(change - value) / std
    share = std / np.linalg.norm(value)
    scale, unit = (1e3, "mm") if effect["effect"] != "encoder_offset" else (180 / np.pi, "deg")
    show = lambda numbers: ", ".join(f"{scale * n:.4f}" for n in numbers)
    return comparison.Row(
        f"{recording.name}, {effect['effect']} of {effect['target']}: {show(value)} {unit} hidden",
        f"{show(change)} {unit}: {off.max():.1f} sigma off, sigma {100 * share.max():.2f} %",
        "2 sigma, sigma below 2 %",
        bool((off <= 2).all() and (share < 0.02).all()),
        interval=f"± {show(1.96 * std)} {unit}",
        figure="hidden effects",
    )


def main() -> None:
    given = arguments.parser(__doc__, reference=True).parse_args()
    folder = given.reference / "cases"
    labels = json.loads((folder / "labels.json").read_text(encoding="utf-8"))
    wanted = [
        (folder / name, effect)
        for name, label in labels.items()
        for effect in label["effects"]
        if effect["effect"] in EFFECTS
    ]
    rows = [compare(*one) for one in comparison.progress(wanted, "Recordings")]
    comparison.print_comparisons(rows, "Hidden geometric effects")


if __name__ == "__main__":
    main()
