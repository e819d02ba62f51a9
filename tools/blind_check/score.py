"""Opens the seal and counts."""

from pathlib import Path

import numpy as np
from scipy.optimize import minimize
from scipy.stats import binomtest

from .cell_score import CellScore, score_cell
from .diagnosis_runs import DONE
from .generate import read_seal
from .recording import read_json

SIZE_EDGES = (0.0, 0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0, 1.5, 3.0, 6.0, 12.0, np.inf)
SEEN = 1.5  # an effect of this size must be named
CONDITIONS = ("noise", "clock", "missing", "outliers")


def hit_rate(hits) -> dict:
    """A share with its exact 95 % interval."""
    hits = [bool(h) for h in hits]
    if not hits:
        return {"hits": 0, "of": 0, "rate": None, "low": None, "high": None}
    interval = binomtest(sum(hits), len(hits)).proportion_ci(0.95, method="exact")
    return {
        "hits": sum(hits),
        "of": len(hits),
        "rate": sum(hits) / len(hits),
        "low": interval.low,
        "high": interval.high,
    }


def count_rows(recording: Path) -> dict[str, int]:
    """Rows of each experiment."""
    return {file.stem: file.read_bytes().count(b"\n") - 1 for file in recording.glob("*.csv")}


def load_scores(seal: Path, results: Path) -> list[CellScore]:
    """Judges every sealed cell. One whose diagnosis failed counts as failed; one not tried has no time."""
    out = []
    for name, label in read_seal(seal)["cells"].items():
        at = results / name
        done = read_json(at / DONE)
        told = read_json(at / "diagnosis.json") if done and done["code"] == 0 else None
        before, after = read_json(at / "before.json"), read_json(at / "after.json")
        out.append(
            score_cell(
                name,
                label,
                told,
                done,
                before,
                after,
                count_rows(results.parents[1] / "fresh" / name) if before else {},
            )
        )
    return out


def cells_of(cells: list[CellScore], *sorts: str) -> list[CellScore]:
    return [c for c in cells if c.sort in sorts]


def by_size(cells: list[CellScore]) -> list[dict]:
    """Named first, in bins of size."""
    edges = list(zip(SIZE_EDGES, SIZE_EDGES[1:], strict=False))
    return [{"from": a, "to": b, **hit_rate(c.first for c in cells if a <= c.largest < b)} for a, b in edges]


def detection_limit(cells: list[CellScore]) -> dict:
    """Sizes at which half, and nine in ten, are named: a logistic curve in the size's logarithm, by maximum likelihood.

    `all_from`: the least size of all, when every one is named, so that there is no curve. Per effect the same slope
    with a place of its own, drawn to the common one as a sample of e-fold spread is."""
    x = np.log([max(c.largest, 1e-3) for c in cells])
    y = np.array([c.first for c in cells], float)
    if len(y) < 8 or y.min() == y.max():
        all_from = float(np.exp(x.min())) if len(y) >= 8 and y.min() == 1 else None
        return {"half": None, "nine_in_ten": None, "half_of_effect": {}, "half_median": None, "all_from": all_from}
    names, which = np.unique([c.label["effects"][0]["effect"] for c in cells], return_inverse=True)

    def loss(p, place):
        z = np.exp(p[1]) * (x - place)
        return (
            np.sum(np.logaddexp(0, -z) * y + np.logaddexp(0, z) * (1 - y)) + 0.05 * (p[1] - 1) ** 2 + 0.005 * p[0] ** 2
        )

    m, s = minimize(lambda p: loss(p, p[0]), [np.log(0.5), 1.0]).x
    own = minimize(lambda p: loss(p, p[0] + p[2:][which]) + 0.5 * np.sum(p[2:] ** 2), [m, s, *np.zeros(len(names))]).x
    of_effect = {str(n): float(np.exp(own[0] + d)) for n, d in zip(names, own[2:], strict=True)}
    half = {"half_of_effect": of_effect, "half_median": float(np.median(list(of_effect.values())))}
    return {"half": float(np.exp(m)), "nine_in_ten": float(np.exp(m + np.log(9) / np.exp(s))), "all_from": None} | half


def smallest_named(cells: list[CellScore]) -> dict[str, float | None]:
    """Per effect, the smallest size that was named first."""
    effects = sorted({c.label["effects"][0]["effect"] for c in cells})
    return {
        e: min((c.largest for c in cells if c.first and c.label["effects"][0]["effect"] == e), default=None)
        for e in effects
    }


def reliability(cells: list[CellScore], bins: int = 10) -> dict:
    """Of the causes given a probability, how many are right; the calibration error is the mean distance, by count."""
    told = [pair for c in cells for pair in c.causes]
    p, right = np.array([t[0] for t in told]), np.array([t[1] for t in told], float)
    rows, error = [], 0.0
    for k in range(bins):
        inside = (p >= k / bins) & ((p < (k + 1) / bins) | (k == bins - 1)) if len(p) else np.zeros(0, bool)
        if inside.any():
            rows.append({"told": float(p[inside].mean()), "count": int(inside.sum()), **hit_rate(right[inside])})
            error += inside.sum() / len(p) * abs(p[inside].mean() - right[inside].mean())
    return {"error": float(error) if rows else None, "causes": len(told), "bins": rows}


def confusion(cells: list[CellScore]) -> tuple[list[str], list[str], np.ndarray]:
    """True effect by first named one; cells of one effect or none."""
    pairs = []
    for c in cells:
        effects = c.label["effects"]
        if len(effects) <= 1:
            truth = (
                "healthy"
                if not effects
                else effects[0]["effect"]
                if effects[0]["catalogued"]
                else "not in the catalogue"
            )
            pairs.append((truth, c.first_named if c.verdict != "failed" else "failed"))
    last = {"healthy": 1, "not in the catalogue": 2, "nothing": 1, "failed": 2}
    order = [sorted({p[k] for p in pairs}, key=lambda n: (last.get(n, 0), n)) for k in (0, 1)]
    table = np.zeros((len(order[0]), len(order[1])), int)
    for truth, named in pairs:
        table[order[0].index(truth), order[1].index(named)] += 1
    return order[0], order[1], table


def quantiles(values, *at: float) -> list[float | None]:
    values = [v for v in values if v is not None and np.isfinite(v)]
    return [float(np.quantile(values, q)) if values else None for q in at]


def named_alone(cell: CellScore) -> bool:
    """Every effect is named, and nothing false beside them."""
    return all(cell.named) and all(right for _, right in cell.causes)


def score_all(cells: list[CellScore]) -> dict:
    """All figures of one method."""
    single, unknown = cells_of(cells, "single"), cells_of(cells, "unknown")
    pairs = [c for c in cells_of(cells, "pair") if c.largest >= SEEN]
    several = [c for c in cells_of(cells, "several") if c.largest >= SEEN]
    beside = [c for c in cells_of(cells, "scatter") if c.largest >= SEEN]
    errors = [e for c in cells for e in c.errors]
    sigmas = [e[3] for e in errors if np.isfinite(e[3])]
    (relative,) = quantiles([e[2] for e in errors], 0.5)
    closed = [c.closed for c in single if c.first and c.largest >= SEEN]
    return {
        "cells": len(cells),
        "failed": hit_rate(c.verdict == "failed" for c in cells),
        "single_named_first": hit_rate(c.first for c in single if c.largest >= SEEN),
        "single_named_alone": hit_rate(named_alone(c) for c in single if c.largest >= SEEN),
        "single_by_size": by_size(single),
        "detection_limit": detection_limit(single),
        "smallest_named": smallest_named(single),
        "smallest_named_median": quantiles(smallest_named(single).values(), 0.5)[0],
        "ties_of_first_cause": float(np.mean([c.ties for c in single if c.first] or [0])),
        "pair_both_named": hit_rate(all(c.named) for c in pairs),
        "pair_both_named_alone": hit_rate(named_alone(c) for c in pairs),
        "pair_one_named": hit_rate(any(c.named) for c in pairs),
        "several_all_named": hit_rate(all(c.named) for c in several),
        "several_effects_named": hit_rate(n for c in several for n in c.named),
        "false_cause_beside": hit_rate(
            any(not right for _, right in c.causes) for c in cells_of(cells, "single", "pair", "several")
        ),
        "healthy_called_healthy": hit_rate(c.verdict == "no_gap" and not c.causes for c in cells_of(cells, "healthy")),
        "scattered_healthy_blamed": hit_rate(bool(c.causes) for c in cells_of(cells, "scatter_healthy")),
        "unknown_called_explained": hit_rate(c.verdict == "explained" for c in unknown),
        "unknown_wrongly_sure": hit_rate(
            c.verdict == "explained" or any(p >= 0.9 for p, _ in c.causes) for c in unknown
        ),
        "unknown_called_no_gap": hit_rate(c.verdict == "no_gap" for c in unknown),
        "scatter_named": hit_rate(c.first for c in beside),
        "conditions": {s: hit_rate(c.first for c in cells_of(cells, s) if c.largest >= SEEN) for s in CONDITIONS},
        "reliability": reliability(cells),
        "parameter_within_2_sigma": hit_rate(s <= 2 for s in sigmas),
        "parameter_relative_error_median": relative,
        "excess_closed": dict(zip(("low", "median", "high"), quantiles(closed, 0.1, 0.5, 0.9), strict=True)),
        "seconds": dict(
            zip(("median", "most", "longest"), quantiles([c.seconds for c in cells], 0.5, 0.95, 1.0), strict=True)
        ),
        "cpu_median": quantiles([c.cpu for c in cells], 0.5)[0],
        "memory": quantiles([c.memory for c in cells], 1.0)[0],
    }
