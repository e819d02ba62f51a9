"""What one could do without a diagnosis: four plain methods, judged like it.

Each sees the recording alone and reasons with first-order signatures: `best_single` fits every effect on its own and
takes the one that leaves least; `all_at_once` fits everything together, damped; `tuning` fits friction, damping and
armature of each joint to the currents, as system identification toolboxes do; `nearest` takes the signature most alike.
"""

import json
import time
from pathlib import Path

import numpy as np
from scipy.stats import chi2, norm

from .diagnosis_runs import DONE
from .recording import read_recording
from .signatures import Hypothesis, Stack

ENOUGH = 1.1  # gap after a fit that counts as explained
TUNED = ("viscous_friction", "coulomb_friction", "rotor_inertia")


def exceeding_columns(stack: Stack, residual: np.ndarray, fit: bool | None = None) -> np.ndarray:
    """Columns that stand above the floor: n gap^2 beyond the 99.9 % quantile of chi-square."""
    rows = stack.good & ((stack.fit == fit) if fit is not None else True)
    n = np.bincount(stack.column[rows], minlength=len(stack.names))
    total = np.bincount(stack.column[rows], residual[rows] ** 2, minlength=len(stack.names))
    return np.flatnonzero(total > chi2.ppf(0.999, np.maximum(n, 1)))


def relative_gap(stack: Stack, residual: np.ndarray, columns: np.ndarray) -> float:
    rows = stack.good & ~stack.fit & np.isin(stack.column, columns)
    return float(np.sqrt(np.mean(residual[rows] ** 2))) if rows.any() else 1.0


def ridge_solution(A: np.ndarray, b: np.ndarray, ridge: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Least squares and its standard deviations, columns scaled."""
    scale = np.linalg.norm(A, axis=0)
    scale[scale == 0] = 1.0
    N = (A / scale).T @ (A / scale) + (ridge + 1e-10) * np.eye(A.shape[1])
    inverse = np.linalg.inv(N)
    return inverse @ ((A / scale).T @ b) / scale, np.sqrt(np.diag(inverse)) / scale


def cause_entry(h: Hypothesis, x: np.ndarray, std: np.ndarray, probability: float) -> dict:
    values = {n: {"value": float(v), "std": float(s)} for n, v, s in zip(h.names, h.nominal + x, std, strict=True)}
    return {
        "effect": h.effect,
        "target": h.target,
        "probability": float(probability),
        "parameters": values,
        "tied_with": [],
    }


def best_single(stack: Stack, hypotheses: list[Hypothesis]) -> tuple[list[dict], np.ndarray]:
    fit, loss, solved = stack.fit & stack.good, [], []
    for h in hypotheses:
        x, std = ridge_solution(h.columns[fit], stack.residual[fit])
        rest = stack.residual - h.columns @ x
        loss.append(np.sum(rest[fit] ** 2) + len(x) * np.log(fit.sum()))
        solved.append((x, std, rest))
    weight = np.exp(-0.5 * (np.array(loss) - min(loss)))
    order = np.argsort(loss)[:3]
    causes = [
        cause_entry(hypotheses[k], solved[k][0], solved[k][1], weight[k] / weight.sum())
        for k in order
        if weight[k] > 1e-3 * weight.sum()
    ]
    return causes[:1], solved[order[0]][2]


def all_at_once(stack: Stack, hypotheses: list[Hypothesis]) -> tuple[list[dict], np.ndarray]:
    fit = stack.fit & stack.good
    A = np.column_stack([h.columns for h in hypotheses])
    x, std = ridge_solution(A[fit], stack.residual[fit], ridge=1e-3)
    causes, k = [], 0
    for h in hypotheses:
        part = slice(k, k + len(h.names))
        k += len(h.names)
        z = np.abs(x[part] / std[part]).max()
        if z > 5:
            told = cause_entry(h, x[part], std[part], 2 * norm.cdf(z) - 1)
            causes.append((float(np.sum((h.columns[fit] @ x[part]) ** 2)), told))
    return [c for _, c in sorted(causes, key=lambda c: -c[0])][:5], stack.residual - A @ x


def tuning(stack: Stack, hypotheses: list[Hypothesis]) -> tuple[list[dict], np.ndarray]:
    own = [h for h in hypotheses if h.effect in TUNED]
    fit = stack.fit & stack.good & np.isin(stack.column, [k for k, (_, c) in enumerate(stack.names) if c[0] == "i"])
    if not own or not fit.any():
        return [], stack.residual
    A = np.column_stack([h.columns for h in own])
    x, std = ridge_solution(A[fit], stack.residual[fit])
    z = np.abs(x / std)
    causes = [
        cause_entry(own[k], x[k : k + 1], std[k : k + 1], 2 * norm.cdf(z[k]) - 1)
        for k in np.argsort(-z)[:5]
        if z[k] > 5
    ]
    return causes, stack.residual - A @ x


def nearest(stack: Stack, hypotheses: list[Hypothesis]) -> tuple[list[dict], np.ndarray]:
    fit, best = stack.fit & stack.good, []
    for k, h in enumerate(hypotheses):
        norms = np.linalg.norm(h.columns[fit], axis=0)
        alike = np.abs(h.columns[fit].T @ stack.residual[fit]) / np.maximum(
            norms * np.linalg.norm(stack.residual[fit]), 1e-30
        )
        j = int(np.argmax(alike))
        best.append((alike[j], k, j))
    alike, k, j = max(best)
    h = hypotheses[k]
    x, std = ridge_solution(h.columns[fit][:, [j]], stack.residual[fit])
    told = Hypothesis(h.effect, h.target, [h.names[j]], h.nominal[[j]], h.columns[:, [j]])
    return [cause_entry(told, x, std, alike)], stack.residual - told.columns @ x


METHODS = {"best_single": best_single, "all_at_once": all_at_once, "tuning": tuning, "nearest": nearest}


def diagnose(stack: Stack, hypotheses: list[Hypothesis], method: str) -> dict:
    columns = exceeding_columns(stack, stack.residual)
    if not len(columns):
        return {"format": "kr5-gap/1", "verdict": "no_gap", "causes": []}
    causes, rest = METHODS[method](stack, hypotheses)
    after, before = relative_gap(stack, rest, columns), relative_gap(stack, stack.residual, columns)
    verdict = (
        "explained"
        if causes and after < ENOUGH
        else "partly_explained"
        if causes and after < 0.8 * before
        else "unknown"
    )
    return {
        "format": "kr5-gap/1",
        "verdict": verdict,
        "causes": causes,
        "shrink": {"before": before, "after": after, "floor": 1.0},
    }


def diagnose_one(recording: Path, out: Path) -> None:
    """All methods on one recording; each into its own folder. The time of the signatures is told with each."""
    start = time.monotonic()
    stack = Stack(*read_recording(recording))
    hypotheses = stack.hypotheses()
    shared = time.monotonic() - start
    for method in METHODS:
        folder = out / method / recording.name
        folder.mkdir(parents=True, exist_ok=True)
        begin = time.monotonic()
        (folder / "diagnosis.json").write_text(json.dumps(diagnose(stack, hypotheses, method)))
        (folder / DONE).write_text(json.dumps({"code": 0, "seconds": shared + time.monotonic() - begin}))
