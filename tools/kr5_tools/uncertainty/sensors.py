"""Covariances of what sensors on the flange measure, in one frame, compared with printed ones, and fused (Hayat et al.
2022, sections 3.4.3 and 3.4.4)."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from kr5.files.documents import fail_at, read_document, read_text

from kr5_tools.cli.tables import figure_row
from kr5_tools.uncertainty.documents import PrintedEntry, SensorsFile, covariance_of, pose_of
from kr5_tools.uncertainty.tables import AXES, ellipsoid_table, matrix_table


@dataclass(frozen=True)
class Measurement:
    """What a sensor says of the point, in the common frame: as eq. 3.61 has it, and with the error of its rotation."""

    name: str
    book: Any  # kr5.UncertainVector
    whole: Any
    rotation_varies: bool


@dataclass(frozen=True)
class Sensors:
    source: Path
    text: str
    document: SensorsFile
    measurements: list[Measurement]


def read_sensors(source: Path, translation: float | None, rotation: float | None) -> Sensors:
    """Measurements of a file. `translation` [m] and `rotation` [rad] replace the deviations of the poses."""
    import kr5

    text = read_text(source, "measurements of sensors")
    document = read_document(source, SensorsFile, "measurements of sensors, a list `measurements`")
    lengths = np.repeat(document.length_factor, 3)
    out = []
    for k, entry in enumerate(document.measurements):
        at: list[int | str] = ["measurements", k]
        C_pose = covariance_of(entry.pose_sigma, None, document.six, source, at, text)
        for part, sigma in ((slice(0, 3), translation), (slice(3, 6), rotation)):
            if sigma is not None:
                C_pose[part, part] = sigma**2 * np.eye(3)
        pose = kr5.UncertainPose(T=pose_of(entry, document, source, at, text), covariance=C_pose)
        C = covariance_of(entry.sigma, entry.covariance, lengths, source, at, text)
        point = lengths * np.array(entry.point)
        book, whole = (kr5.transform_point(pose, point, C, term) for term in (False, True))
        out.append(Measurement(entry.name, book, whole, bool(C_pose[3:, 3:].any())))
    return Sensors(source, text, document, out)


def sensors_result(sensors: Sensors, fused: bool) -> dict[str, Any]:
    """Parts of the page, figures, verdict and numbers: of every measurement, and of all together."""
    parts, figures = [], []
    result: dict[str, Any] = {"measurements": {}}
    known: dict[str, np.ndarray] = {}
    frame, confidence = sensors.document.frame, sensors.document.confidence
    for m in sensors.measurements:
        known[m.name] = np.asarray(m.book.covariance)
        tables = [matrix_table(f"{m.name}: Q Σ Qᵀ + Σ_t in the frame of the {frame} (eq. 3.61)", known[m.name])]
        if m.rotation_varies:
            known[m.name] = np.asarray(m.whole.covariance)
            tables.append(matrix_table(f"{m.name}, with the error of the rotation", known[m.name]))
        tables.append(ellipsoid_table(f"{m.name}: ellipsoid", known[m.name], confidence, "mm", 1e3))
        parts.append({"title": m.name, "texts": [], "tables": tables, "ellipses": []})
        result["measurements"][m.name] = {"eq_3_61": m.book, "with_rotation": m.whole}
        figures += _deviations(m.name, known[m.name])
    if fused:
        part, both = _fused_part(sensors, known)
        parts.append(part)
        figures += _deviations("fused", known["fused"])
        result["fused"] = both
    comparisons = [_compare(p, known, sensors) for p in sensors.document.printed]
    result["printed"] = [c[1] for c in comparisons]
    if comparisons:
        parts.append(
            {"title": "Printed covariances", "texts": [], "tables": [c[0] for c in comparisons], "ellipses": []}
        )
    return {"verdict": _verdict(sensors, known, fused), "figures": figures, "parts": parts, "result": result}


def _deviations(name: str, covariance: np.ndarray) -> list[dict[str, Any]]:
    sigma = 1e3 * np.sqrt(np.diag(covariance))
    return [figure_row(f"{name}: deviation {axis}", float(s), None, "mm") for axis, s in zip(AXES, sigma)]


def _fused_part(sensors: Sensors, known: dict[str, np.ndarray]) -> tuple[dict[str, Any], Any]:
    """(sum C^-1)^-1, beside each measurement alone."""
    import kr5

    document = sensors.document
    for k, m in enumerate(sensors.measurements):
        if float(np.linalg.eigvalsh(known[m.name]).min()) <= 1e-12 * float(known[m.name].max()):
            fail_at(
                sensors.source,
                ["measurements", k, "covariance"],
                "is singular in the common frame: nothing is exact; give pose_sigma or a larger sigma",
                sensors.text,
            )
    values = [kr5.UncertainVector(value=m.whole.value, covariance=known[m.name]) for m in sensors.measurements]
    both = kr5.fuse(values)
    known["fused"] = np.asarray(both.covariance)
    traces = {name: 1e6 * float(np.trace(C)) for name, C in known.items()}
    texts = ["Trace of the covariances: " + ", ".join(f"{n} {t:.4g} mm²" for n, t in traces.items()) + "."]
    tables = [
        matrix_table("Fused: (Σ C⁻¹)⁻¹", known["fused"]),
        ellipsoid_table("Fused: ellipsoid", known["fused"], document.confidence, "mm", 1e3),
    ]
    a, b = sorted(np.argsort(-np.diag(sum(known.values())), kind="stable")[:2].tolist())
    pick = np.ix_([a, b], [a, b])
    drawn = {
        "name": "fusion",
        "title": "Each measurement and all together",
        "text": f"Regions that hold two coordinates of the error with a probability of"
        f" {100 * document.confidence:g} %.",
        "axes": [f"{AXES[a]} [mm]", f"{AXES[b]} [mm]"],
        "confidence": document.confidence,
        "ellipses": [{"name": n, "centre": [0.0, 0.0], "covariance": 1e6 * C[pick]} for n, C in known.items()],
    }
    return {"title": "Fusion", "texts": texts, "tables": tables, "ellipses": [drawn]}, both


def _compare(
    entry: PrintedEntry, known: dict[str, np.ndarray], sensors: Sensors
) -> tuple[dict[str, Any], dict[str, Any]]:
    """A printed covariance: whether it is one, and how far it is from the one computed here."""
    import kr5

    C = np.array(entry.covariance)
    defect = kr5.covariance_defect(C, entry.rounding)
    area = sensors.document.length_factor**2
    found: dict[str, Any] = {"name": entry.name, "defect": defect, "difference": None}
    if defect:
        texts = [f"{entry.name} {defect}. It is not used."]
    else:
        texts = [f"{entry.name} is a covariance within its rounding."]
    if entry.of in known:
        found["difference"] = float(np.abs(C * area - known[entry.of]).max())
        texts.append(f"Its largest difference from the one computed here is {1e6 * found['difference']:.3g} mm².")
    elif entry.of != "fused":
        index = sensors.document.printed.index(entry)
        fail_at(
            sensors.source,
            ["printed", index, "of"],
            f"found {entry.of!r}, expected one of {', '.join([*known, 'fused'])}",
            sensors.text,
        )
    return matrix_table(f"{entry.name}, of {entry.of}", C * area, tuple(texts)), found


def _verdict(sensors: Sensors, known: dict[str, np.ndarray], fused: bool) -> dict[str, str]:
    if not fused:
        names = ", ".join(m.name for m in sensors.measurements)
        return {"word": "good", "text": f"{names}: positive definite in the frame of the {sensors.document.frame}"}
    least = min(float(np.trace(C)) for name, C in known.items() if name != "fused")
    share = float(np.trace(known["fused"])) / least
    return {"word": "good", "text": f"fused, the trace is {100 * share:.3g} % of the best measurement's alone"}
