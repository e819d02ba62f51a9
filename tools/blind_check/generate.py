"""Draws cells, records them, and seals what is wrong with them.

Folders: `recordings/NAME` is all a diagnosis gets, `fresh/NAME` a second recording of the same cell to judge by. Names
tell nothing: what a cell carries is drawn apart from its number, and stands in the seal alone.
"""

import copy
import json
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from .catalogue import BY_ID, CATALOGUE, log_uniform
from .cells import draw_cell
from .off_catalogue import OFF_CATALOGUE, OFF_CATALOGUE_BY_ID
from .protocol import CASES, SMALL, Size, draw_protocol
from .simulate import QUATERNION, effect_sizes, noise_sigma, simulate, with_noise
from .truth import WRENCH, Truth

SEAL = "kr5-bench-seal/1"
LEAST_WRITTEN = 0.15  # smaller sizes are left out of the labels
FAINT = (0.02, 0.5)  # sizes that tell where detection ends
JITTER = {"mass": 0.004, "torque_constant": 0.004, "friction": 0.008}

# Share of each sort of cell. Conditions are those a recording must survive beside one effect.
MIX = {
    "healthy": 0.12,
    "single": 0.43,
    "pair": 0.13,
    "unknown": 0.12,
    "scatter": 0.08,
    "scatter_healthy": 0.02,
    "noise": 0.03,
    "clock": 0.02,
    "missing": 0.03,
    "outliers": 0.02,
}


@dataclass
class Drawn:
    """One effect on one cell."""

    effect: str
    target: str
    parameters: dict
    catalogued: bool
    seed: int = 0

    def apply(self, truth: Truth) -> None:
        if self.catalogued:
            BY_ID[self.effect].apply(truth, self.target, self.parameters)
        else:
            kind = OFF_CATALOGUE_BY_ID[self.effect]
            kind.bend(truth, self.target, self.parameters["magnitude"], np.random.default_rng(self.seed))


def draw_sorts(cells: int, rng: np.random.Generator) -> list[str]:
    """The sort of each cell: shares as in MIX, order at random."""
    names, share = list(MIX), np.array(list(MIX.values()))
    edges = (np.arange(cells) + 0.5) / cells
    return [names[k] for k in rng.permutation(np.searchsorted(np.cumsum(share / share.sum()), edges))]


def scale_to_size(make, span, wanted: float, size_of):
    """The magnitude at which the effect adds `wanted`, as near as its span allows: a secant in logarithms."""
    low, high = np.log(span)
    x = (low + high) / 2
    best: tuple = ()
    slope, last = 1.0, None
    for _ in range(6):
        drawn = make(float(np.exp(x)))
        y = np.log(max(size_of(drawn), 1e-6) / wanted)
        if not best or abs(y) < best[0]:
            best = (abs(y), drawn)
        if abs(y) < 0.1:
            break
        if last and abs(x - last[0]) > 1e-9:
            slope = float(np.clip((y - last[1]) / (x - last[0]), 0.3, 4.0))
        last = (x, y)
        x = float(np.clip(x - y / slope, low, high))
    return best[1]


class Scene:
    """A nominal cell with its protocol, and what it would show without any effect."""

    def __init__(self, cell: dict, protocol: list):
        self.cell, self.protocol = cell, protocol
        self.healthy = [simulate(Truth.of(cell), kind, given) for _, kind, _, given in protocol]

    def size(self, drawn: Drawn, kinds: tuple[str, ...], first_only: bool = False) -> dict[str, float]:
        """What an effect adds to each column; with `first_only`, to the first experiment of each kind, which is
        quicker."""
        truth = Truth.of(self.cell)
        out: dict[str, float] = {}
        drawn.apply(truth)
        for (name, kind, _, given), without in zip(self.protocol, self.healthy, strict=True):
            if kind in kinds and (not first_only or name in ("motion-1", f"{kind}-1")):
                added = effect_sizes(kind, simulate(truth, kind, given), without, self.cell["noise"])
                out |= {f"{name}.{column}": x for column, x in added.items()}
        return out

    def draw(self, rng, effect, catalogued: bool, wanted: float) -> tuple[Drawn, dict]:
        target, seed = str(rng.choice(effect.targets(self.cell))), int(rng.integers(2**31))
        if catalogued:
            parameters = effect.draw(rng, self.cell, target)
        else:

            def parameters(m):
                return {"magnitude": m}

        def make(m):
            return Drawn(effect.id, target, parameters(m), catalogued, seed)

        drawn = scale_to_size(
            make, effect.span, wanted, lambda d: max(self.size(d, effect.kinds, True).values(), default=0.0)
        )
        size = self.size(drawn, effect.kinds)
        kept = {c: round(x, 2) for c, x in size.items() if x >= LEAST_WRITTEN}
        label = {"effect": drawn.effect, "target": target, "parameters": drawn.parameters, "catalogued": catalogued}
        return drawn, label | {"size": kept, "largest": round(max(size.values()), 3)}


def draw_seen(scene: Scene, rng, effect, catalogued: bool, wanted: float) -> tuple[Drawn, dict]:
    """An effect on a target where it can be seen at all: load friction on a joint without load cannot."""
    for _ in range(4):
        drawn, label = scene.draw(rng, effect, catalogued, wanted)
        if label["largest"] >= 0.25 * min(wanted, 1.0):
            break
    return drawn, label


def further_effects(sort: str) -> int:
    """How many effects a cell carries beside the first: `several 5` carries five."""
    if sort.startswith("several"):
        return int(sort.split()[1]) - 1
    return int(sort == "pair")


def draw_effects(scene: Scene, sort: str, rng, turn: int) -> tuple[list[Drawn], list[dict]]:
    """The effects of a cell; kinds take turns, so that a short run does not draw one twice."""
    if sort in ("healthy", "scatter_healthy"):
        return [], []
    chosen: list[tuple[Any, bool]]
    if sort == "unknown":
        chosen, wanted = [(OFF_CATALOGUE[turn % len(OFF_CATALOGUE)], False)], [log_uniform(rng, 3, 40)]
    else:
        first = CATALOGUE[turn % len(CATALOGUE)]
        span = FAINT if sort == "faint" else (0.2, 1.5) if sort == "single" and rng.random() < 0.45 else (1.5, 30)
        chosen, wanted = [(first, True)], [log_uniform(rng, *span)]
        for _ in range(further_effects(sort)):
            other = [e for e in CATALOGUE if all(e.id != taken.id for taken, _ in chosen)]
            chosen.append((other[rng.integers(len(other))], True))
            wanted.append(log_uniform(rng, 1.5, 30))
    drawn = [draw_seen(scene, rng, e, known, w) for (e, known), w in zip(chosen, wanted, strict=True)]
    return [d for d, _ in drawn], [label for _, label in drawn]


def scatter_parameters(cell: dict, rng) -> None:
    """Small errors of all masses, torque constants and frictions, as any real nominal model has."""
    for body in [*cell["robot"]["links"], cell["tool"]]:
        s = 1 + JITTER["mass"] * rng.standard_normal()
        body.update(mass=body["mass"] * s, inertia=[x * s for x in body["inertia"]])
    d = cell["drives"]
    d["torque_constant"] = [x * (1 + JITTER["torque_constant"] * rng.standard_normal()) for x in d["torque_constant"]]
    for key in ("coulomb", "viscous"):
        d["friction"][key] = [x * (1 + JITTER["friction"] * rng.standard_normal()) for x in d["friction"][key]]


def draw_log_fault(sort: str, rng) -> dict:
    """How the recording itself is spoilt."""
    if sort == "noise":
        return {"noise": float(rng.choice([0.5, 2.0]))}
    if sort == "clock":
        return {"wrench_late": float(rng.uniform(0.001, 0.004))}
    if sort == "outliers":
        return {"outliers": float(rng.uniform(0.001, 0.005))}
    if sort == "missing":
        return {"missing": str(rng.choice(["wrench", "poses", "motion", "views", "profile"]))}
    return {}


def apply_log_fault(kind: str, given: dict, seen: dict, how: dict, noise: dict, rng) -> dict:
    if "wrench_late" in how and kind == "motion":
        for c in WRENCH:
            seen[c] = np.interp(given["t"] - how["wrench_late"], given["t"], seen[c])
    if how.get("missing") == "wrench":
        seen = {c: x for c, x in seen.items() if c not in WRENCH}
    if "outliers" in how:
        for c in seen:
            if c != "sphere" and c not in QUATERNION:
                hit = rng.random(len(seen[c])) < how["outliers"]
                seen[c] = seen[c] + hit * rng.uniform(10, 60, len(hit)) * rng.choice([-1, 1], len(hit)) * noise_sigma(
                    noise, kind, c
                )
    return seen


def suits_cell(missing: str | None, labels: list[dict], kind: str) -> bool:
    """Whether an experiment is kept: a missing kind never takes the last that shows the effect."""
    shown = {c.split("-")[0] for label in labels for c in label["size"]}
    return missing != kind or shown <= {kind}


FORMS = {
    "t": "%.3f",
    "speed": "%.3f",
    "q": "%.6f",
    "qc": "%.6f",
    "x": "%.5f",
    "tilt": "%.5f",
    "alpha": "%.5f",
    "cx": "%.5f",
    "cy": "%.5f",
    "fc": "%.3f",
    "i": "%.4f",
    "f": "%.3f",
    "tau": "%.4f",
    "u": "%.3f",
    "v": "%.3f",
    "z": "%.6f",
    "zc": "%.6f",
}
WHOLE = ("pose", "view", "line", "run", "marker", "corner", "sphere")


def csv_format(column: str, kind: str) -> str:
    if column in WHOLE:
        return "%d"
    if kind == "poses" and column in ("x", "y", "z", "qw", "qx", "qy", "qz"):
        return "%.7f" if column[0] == "q" else "%.6f"
    if column in ("tx", "ty", "tz"):
        return "%.4f"
    return FORMS.get(column) or FORMS.get(column.rstrip("0123456789")) or FORMS[column[0]]


def write_csv(file: Path, columns: dict, kind: str) -> None:
    line = ",".join(csv_format(c, kind) for c in columns) + "\n"
    rows = zip(*(x.tolist() for x in columns.values()), strict=True)
    file.write_text(",".join(columns) + "\n" + "".join(line % row for row in rows))


def write_recording(folder: Path, cell: dict, truth: Truth, protocol: list, how: dict, labels: list[dict], rng) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    # The cell that is handed over may believe another noise than there is.
    told = cell | {"noise": {k: v / how.get("noise", 1.0) for k, v in cell["noise"].items()}}
    (folder / "cell.yaml").write_text(yaml.safe_dump(told, sort_keys=False))
    listed = []
    for name, kind, part, given in protocol:
        if not suits_cell(how.get("missing"), labels, kind):
            continue
        seen = with_noise(simulate(truth, kind, given), kind, cell["noise"], rng)
        seen = apply_log_fault(kind, given, seen, how, cell["noise"], rng)
        write_csv(folder / f"{name}.csv", given | seen, kind)
        listed.append({"name": name, "kind": kind, "file": f"{name}.csv", "split": part})
    text = {"format": "kr5-recording/1", "cell": "cell.yaml", "experiments": listed}
    (folder / "recording.yaml").write_text(yaml.safe_dump(text, sort_keys=False))


def draw_one_cell(folder: Path, name: str, sort: str, turn: int, seed: int, size: Size) -> dict:
    """Records one cell twice; its label."""
    rng = np.random.default_rng(seed)
    cell, home = draw_cell(rng)
    scene = Scene(cell, draw_protocol(cell, home, rng, size))
    drawn, labels = draw_effects(scene, sort, rng, turn)
    real = copy.deepcopy(cell)
    if sort.startswith("scatter"):
        scatter_parameters(real, rng)
    truth, how = Truth.of(real), draw_log_fault(sort, rng)
    for effect in drawn:
        effect.apply(truth)
    write_recording(folder / "recordings" / name, cell, truth, scene.protocol, how, labels, rng)
    again = draw_protocol(cell, home, rng, size)
    write_recording(
        folder / "fresh" / name, cell, truth, again, {k: v for k, v in how.items() if k == "noise"}, labels, rng
    )
    jitter = JITTER["mass"] if sort.startswith("scatter") else 0.0
    return {
        "sort": "single" if sort == "faint" else sort.split()[0],
        "cell": cell["name"],
        "effects": labels,
        "jitter": jitter,
        "condition": how,
    }


def write_seal(seal: Path, cells: dict, about: dict) -> None:
    seal.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps({"format": SEAL, **about, "cells": cells}, default=float)
    seal.write_bytes(zlib.compress(text.encode(), 9))


def read_seal(seal: Path) -> dict:
    data = json.loads(zlib.decompress(seal.read_bytes()))
    if data.get("format") != SEAL:
        raise ValueError(f"{seal}: not a seal of this bench (format {data.get('format')!r}, expected {SEAL})")
    return data


def draw_sealed_cell(parts: Path, folder: Path, name: str, *rest) -> None:
    """Records one cell and puts its label apart, whole or not at all."""
    label = draw_one_cell(folder, name, *rest)
    parts.mkdir(parents=True, exist_ok=True)
    unfinished = parts / f".{name}"
    write_seal(unfinished, {name: label}, {})
    unfinished.rename(parts / name)


def join_seal(parts: Path, seal: Path, about: dict) -> None:
    """Seals the labels of all cells in one file."""
    files = sorted(p for p in parts.iterdir() if not p.name.startswith("."))
    write_seal(seal, {name: label for f in files for name, label in read_seal(f)["cells"].items()}, about)
    for f in parts.iterdir():
        f.unlink()
    parts.rmdir()


def plan_cells(
    cells: int, seed: int, small: bool, faint: bool = False, effects: int = 0
) -> list[tuple[str, str, int, int, Size]]:
    """Arguments of `draw_one_cell` after the folder, for every cell; all of one sort for `faint` or with `effects`."""
    rng = np.random.default_rng(seed)
    one = "faint" if faint else f"several {effects}" if effects else ""
    kinds = [one] * cells if one else draw_sorts(cells, rng)
    order = {"unknown": rng.permutation(len(OFF_CATALOGUE)), "": rng.permutation(len(CATALOGUE))}
    turn, out = {"unknown": 0, "": 0}, []
    for k, sort in enumerate(kinds):
        of = "unknown" if sort == "unknown" else ""
        out.append(
            (
                f"cell-{k:04d}",
                sort,
                int(order[of][turn[of] % len(order[of])]),
                int(rng.integers(2**62)),
                SMALL if small else CASES,
            )
        )
        turn[of] += "healthy" not in sort
    return out
