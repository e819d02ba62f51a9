"""Sentences about turns of joints, from the typed result of `kr5.calibration.identify_arm_axes`."""

import kr5.calibration

MOST_NAMED = 12  # rows of a finding


def listed(names: list[str]) -> str:
    """Names with commas; of many, the first."""
    shown = ", ".join(names[:MOST_NAMED])
    return f"{shown} and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else shown


def where(labels: list[str]) -> str:
    """Which rows a turn is of, in brackets; nothing where they have no names."""
    return f" ({labels[0]} to {labels[-1]})" if labels else ""


def several_text(split: kr5.calibration.TurnSplit, rows: list[str]) -> str:
    """Rows in which several joints are away from home, and what to do; `rows` are the names of all those."""
    moved = ", ".join(f"q{k + 1}" for k in split.several[0].joints)
    further = f" (and {listed(rows[1:])} likewise)" if len(rows) > 1 else ""
    return f"{rows[0]}: {moved} are away from where they usually stand{further}; move one joint at a time"


def axis_warnings(result: kr5.calibration.ArmAxesResult, labels: list[list[str]]) -> list[str]:
    """Everything that makes the axes doubtful; `labels` are the names of each turn's samples."""
    found = result.findings
    return [
        *(f"joint {k + 1}: {text}" for k, axis in enumerate(result.axes) for text in _axis_texts(axis.findings)),
        *_outlier_texts(result, labels),
        *([_shift_text(found.shifted_rows, labels)] if found.shifted_rows else []),
        *(_noise_text(one, labels[one.joint]) for one in found.uneven_noise),
        *(_jump_text(one, labels) for one in found.home_jumps),
        *([_length_text(found.implausible_length)] if found.implausible_length else []),
        *([_nominal_text(found.nominal_mismatch, len(result.axes))] if found.nominal_mismatch else []),
    ]


def _axis_texts(found: kr5.calibration.AxisFindings) -> list[str]:
    texts = []
    if found.systematic_residuals:
        texts.append(
            "the points leave their circles in a systematic way: another joint moved, the arm yields, or the device"
            " moved"
        )
    if scaled := found.scaled_readings:
        texts.append(
            f"the joint turned by {scaled.ratio:.4g} times its readings ({100 * scaled.std:.1f} % standard deviation):"
            " another joint moved, or the unit is wrong"
        )
    return texts


def _outlier_texts(result: kr5.calibration.ArmAxesResult, labels: list[list[str]]) -> list[str]:
    return [
        f"joint {k + 1}: left out because they contradict the others: {listed([labels[k][i] for i in axis.outliers])}"
        for k, axis in enumerate(result.axes)
        if axis.outliers
    ]


def _shift_text(found: kr5.calibration.ShiftedRows, labels: list[list[str]]) -> str:
    at = -1 if str(found.end) == "last" else 0
    rows = ", ".join(labels[k][at] for k in found.joints)
    return (
        f"of nearly every joint the {found.end} sample ({rows}) belongs to another joint's turn: the measurements are"
        " shifted by a row against the joint values"
    )


def _noise_text(found: kr5.calibration.UnevenNoise, labels: list[str]) -> str:
    step = "" if found.after_step is None else f"; the greatest step is before {labels[found.after_step]}"
    return (
        f"joint {found.joint + 1}{where(labels)}: the samples are {1e3 * found.sigma:.2g} mm off their circle, those of"
        f" the other joints {1e3 * found.sigma_others:.2g} mm: the device moved meanwhile, another joint moved, or the"
        f" sample is loose{step}"
    )


def _jump_text(found: kr5.calibration.HomeJump, labels: list[list[str]]) -> str:
    before, behind = labels[found.joint - 1], labels[found.joint]
    return (
        f"between joint {found.joint} (to {before[-1]}) and joint {found.joint + 1} (from {behind[0]}) the measured"
        f" point at home jumps by {1e3 * found.distance:.2f} mm: the device or the base moved, or another joint did"
    )


def _length_text(found: kr5.calibration.ImplausibleLength) -> str:
    if found.too_long:
        return f"the arm would be {found.length:.0f} m long: are the lengths in millimetres? (--length-unit mm)"
    return f"the arm would be {1e3 * found.length:.3g} mm long: are the lengths in metres? (--length-unit m)"


def _nominal_text(found: kr5.calibration.NominalMismatch, joints: int) -> str:
    if str(found.kind) == "joint_count":
        return f"{joints} axes were found, the cell's arm has {found.nominal_joints} joints"
    if str(found.kind) == "mirrored":
        return "the arm is the mirror image of the cell's: an axis of the device is reversed, or two changed places"
    return (
        f"every length is {found.scale:.4g} times the cell's: the scale of the device is wrong, or its unit"
        " (--length-unit)"
    )
