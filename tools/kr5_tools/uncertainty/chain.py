"""Uncertainty through a chain of poses, to first order and by the unscented transform."""

from pathlib import Path
from typing import Any

import kr5
import numpy as np
from kr5.files.documents import read_document, read_text

from kr5_tools.cli.numbers import format_number
from kr5_tools.cli.tables import pose_figures
from kr5_tools.uncertainty.documents import BOOK, ChainFile, covariance_of, pose_of
from kr5_tools.uncertainty.tables import AXES, ellipsoid_table, matrix_table

SHOWN = np.repeat([1e3, 180 / np.pi], 3)  # mm and degrees
NEAR = 0.1  # share by which both deviations may differ before the second order matters


def read_chain(file: Path | None) -> tuple[list[str], list[Any], Any, float, Path]:
    """Names and poses (kr5.UncertainPose) of a chain, its point (kr5.UncertainVector or None) and the probability."""
    source = file or BOOK / "grid.yaml"
    text = read_text(source, "a chain of poses")
    document = read_document(source, ChainFile, "a chain of poses, a list `chain`")
    chain = []
    for k, entry in enumerate(document.chain):
        T = pose_of(entry, document, source, ["chain", k], text)
        C = covariance_of(entry.sigma, entry.covariance, document.six, source, ["chain", k], text)
        pose = kr5.UncertainPose(T=T, covariance=C)
        chain.append(pose.inverse() if entry.inverse else pose)
    point = None
    if document.point is not None:
        factors = np.repeat(document.length_factor, 3)
        C = covariance_of(document.point.sigma, document.point.covariance, factors, source, ["point"], text)
        point = kr5.UncertainVector(value=factors * np.array(document.point.value), covariance=C)
    names = [f"{entry.name}⁻¹" if entry.inverse else entry.name for entry in document.chain]
    return names, chain, point, document.confidence, source


def chain_result(
    names: list[str], chain: list[kr5.UncertainPose], point: kr5.UncertainVector | None, confidence: float
) -> dict[str, Any]:
    """Parts of the page, figures, verdict and numbers of a propagation."""
    first, second = kr5.propagate_chain(chain), kr5.propagate_chain_unscented(chain)
    sigma = [np.sqrt(np.diag(pose.covariance)) for pose in (first, second)]
    apart = kr5.deviation_change(first.covariance, second.covariance)
    shift = kr5.pose_difference(first.T, second.T)
    tables = [_deviation_table(sigma, shift), _share_table(names, chain)]
    C = np.asarray(second.covariance)
    if sigma[1][:3].any():
        tables.append(ellipsoid_table("Ellipsoid of the position", C[:3, :3], confidence, "mm", 1e3))
    if sigma[1][3:].any():
        tables.append(ellipsoid_table("Ellipsoid of the rotation", C[3:, 3:], confidence, "deg", 180 / np.pi))
    parts = [
        {
            "title": "Pose " + " ".join(names),
            "texts": ["Errors are about the axes of the last frame. Unscented: what the second order adds."],
            "tables": tables,
            "ellipses": [_position_ellipses(first, second, confidence)] if sigma[1][:3].any() else [],
        }
    ]
    result: dict[str, Any] = {"first_order": first, "unscented": second}
    if point is not None:
        part, found = _point_part(first, point, confidence)
        parts.append(part)
        result["point"] = found
    if apart > NEAR:
        verdict = {
            "word": "doubtful",
            "text": f"the second order changes a deviation by {100 * apart:.0f} %: use the unscented covariance",
        }
    else:
        verdict = {"word": "good", "text": f"first order and unscented agree within {100 * apart:.2g} %"}
    return {
        "verdict": verdict,
        "figures": pose_figures("pose", second.T, second.covariance),
        "parts": parts,
        "result": result,
    }


def _deviation_table(sigma: list[np.ndarray], shift: np.ndarray) -> dict[str, Any]:
    names = [f"{axis} [mm]" for axis in AXES] + [f"r{axis} [deg]" for axis in AXES]
    rows = [
        [name, *(format_number(float(x)) for x in (a * s, b * s, d * s))]
        for name, a, b, d, s in zip(names, *sigma, np.asarray(shift), SHOWN)
    ]
    return {
        "title": "Standard deviations",
        "columns": ["axis", "first order", "unscented", "shift of the mean"],
        "rows": rows,
        "texts": [],
    }


def _share_table(names: list[str], chain: list[kr5.UncertainPose]) -> dict[str, Any]:
    """Deviations at the end by the error of each pose alone."""
    rows = []
    for name, alone in zip(names, kr5.chain_contributions(chain)):
        variance = np.diag(alone)
        rows.append(
            [
                name,
                format_number(1e3 * float(np.sqrt(variance[:3].sum()))),
                format_number(float(np.degrees(np.sqrt(variance[3:].sum())))),
            ]
        )
    return {
        "title": "By the error of each pose alone",
        "columns": ["pose", "position [mm]", "rotation [deg]"],
        "rows": rows,
        "texts": ["Root of the sum of the variances of the three axes."],
    }


def _position_ellipses(first: kr5.UncertainPose, second: kr5.UncertainPose, confidence: float) -> dict[str, Any]:
    """The two coordinates that vary most."""
    C = np.asarray(second.covariance)[:3, :3]
    a, b = sorted(np.argsort(-np.diag(C), kind="stable")[:2].tolist())
    pick = np.ix_([a, b], [a, b])
    shift = 1e3 * (np.linalg.inv(first.T) @ second.T)[:3, 3]
    return {
        "name": "position",
        "title": "Error of the position",
        "text": f"Regions that hold two coordinates of the error with a probability of {100 * confidence:g} %.",
        "axes": [f"{AXES[a]} [mm]", f"{AXES[b]} [mm]"],
        "confidence": confidence,
        "ellipses": [
            {
                "name": "first order",
                "centre": [0.0, 0.0],
                "covariance": 1e6 * np.asarray(first.covariance)[:3, :3][pick],
            },
            {"name": "unscented", "centre": [shift[a], shift[b]], "covariance": 1e6 * C[pick]},
        ],
    }


def _point_part(
    T: kr5.UncertainPose, point: kr5.UncertainVector, confidence: float
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Eq. 3.49, and the same with the error of the rotation, which it leaves out (I-06 of the digest)."""
    book = kr5.transform_point(T, point.value, point.covariance, False)
    whole = kr5.transform_point(T, point.value, point.covariance, True)
    lever = 1e3 * float(np.linalg.norm(point.value))
    added = [1e3 * float(np.sqrt(np.trace(x.covariance))) for x in (book, whole)]
    value = ", ".join(f"{1e3 * x:.3f}" for x in np.asarray(whole.value))
    part = {
        "title": "Point",
        "texts": [
            f"At [{value}] mm. Total deviation {added[0]:.4g} mm as eq. 3.49 has it, {added[1]:.4g} mm with the error"
            f" of the rotation on the lever of {lever:.4g} mm."
        ],
        "tables": [
            matrix_table("Covariance, R C Rᵀ + C_t (eq. 3.49)", np.asarray(book.covariance)),
            matrix_table("Covariance with the error of the rotation", np.asarray(whole.covariance)),
            ellipsoid_table("Ellipsoid of the point", np.asarray(whole.covariance), confidence, "mm", 1e3),
        ],
        "ellipses": [],
    }
    return part, {"eq_3_49": book, "with_rotation": whole}
