"""Reads a recording folder, and what a diagnosis of it says."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml


@dataclass
class Experiment:
    name: str
    kind: str
    split: str
    columns: dict[str, np.ndarray]


def read_recording(folder: Path) -> tuple[dict, list[Experiment]]:
    listed = yaml.safe_load((folder / "recording.yaml").read_text())
    cell = yaml.safe_load((folder / listed["cell"]).read_text())
    out = []
    for e in listed["experiments"]:
        with (folder / e["file"]).open() as file:
            names = file.readline().strip().split(",")
            data = np.loadtxt(file, delimiter=",", ndmin=2)
        out.append(Experiment(e["name"], e["kind"], e["split"], dict(zip(names, data.T, strict=True))))
    return cell, out


def read_json(file: Path) -> dict | None:
    """None when there is none, or half of one."""
    try:
        return json.loads(file.read_text())
    except (OSError, ValueError):
        return None
