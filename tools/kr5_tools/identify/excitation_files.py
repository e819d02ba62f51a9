"""A designed motion as files: CSV for any controller, KRL for KUKA's."""

import re
from pathlib import Path

import kr5
import kr5.identification
import kr5.kinematics
import numpy as np
from kr5.files.writing import write_text

MOST_KRL_AXES = 12  # A1 to A6, E1 to E6
KRL_INTERVAL = 0.2  # between the points of a spline [s]
KRL_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,20}$")


def write_motion_csv(motion: kr5.identification.JointMotion, tau: np.ndarray, file: Path) -> None:
    """Time, joint values, speeds, accelerations and (where they are known) nominal torques, in SI."""
    joints = range(1, np.asarray(motion.q).shape[1] + 1)
    names = ["t", *(f"{kind}{j}" for kind in ("q", "qd", "qdd") for j in joints)]
    columns = [np.asarray(motion.t)[:, None], motion.q, motion.qd, motion.qdd]
    if tau.size:
        names += [f"tau{j}" for j in joints]
        columns.append(tau)
    rows = (",".join(f"{value:.9g}" for value in row) for row in np.hstack(columns))
    write_text("\n".join([",".join(names), *rows]) + "\n", file)


def krl_files(stem: Path) -> tuple[Path, Path]:
    """The two files of a KRL module. Its name is that of the files, which KRL limits."""
    if not KRL_NAME.match(stem.name):
        raise kr5.InvalidArgument(
            f"--krl: found {stem.name!r}, expected a name of KRL: a letter, then up to 20 letters, digits or _"
        )
    return stem.with_name(stem.name + ".src"), stem.with_name(stem.name + ".dat")


def write_krl(
    excitation: kr5.identification.Excitation, chain: kr5.kinematics.DhChain, cell_name: str, stem: Path
) -> None:
    """A KRL module that makes the motion: axis values in degrees (external linear axes in mm), at reduced override."""
    source, data = krl_files(stem)
    axes = _axis_names(len(chain.joints))
    scale = np.array([1e3 if str(j.type) == "prismatic" else 180 / np.pi for j in chain.joints])
    times, points = _points(excitation.motion)
    write_text(_source(excitation, stem.name, cell_name, axes, scale, times), source)
    write_text(_data(stem.name, axes, scale, points), data)


def _axis_names(joints: int) -> list[str]:
    if joints > MOST_KRL_AXES:
        raise kr5.InvalidArgument(f"--krl: the arm has {joints} joints; KRL has {MOST_KRL_AXES} axes")
    return [f"A{j + 1}" if j < 6 else f"E{j - 5}" for j in range(joints)]


def _points(motion: kr5.identification.ExcitationMotion) -> tuple[np.ndarray, np.ndarray]:
    """Times and joint values at the points, without the first, which is the start."""
    if str(motion.kind) == "point_to_point":
        return np.asarray(motion.times), np.asarray(motion.points)
    states = motion.sampled(motion.period / np.ceil(motion.period / KRL_INTERVAL))
    return np.asarray(states.t), np.asarray(states.q)


def _listed(axes: list[str], values: np.ndarray) -> str:
    return ", ".join(f"{axis} {value:.4f}" for axis, value in zip(axes, values, strict=True))


def _source(
    excitation: kr5.identification.Excitation,
    name: str,
    cell_name: str,
    axes: list[str],
    scale: np.ndarray,
    times: np.ndarray,
) -> str:
    limits = excitation.limits
    lines = [
        f"DEF {name}( )",
        f"; Excitation for the identification of the dynamics of {cell_name or 'an arm'},",
        "; made by kr5 identify excitation.",
        "; Axis values are joint values of that cell in degrees (linear axes in mm), neither signs nor zeros changed:",
        "; compare one posture with the controller before anything moves.",
        "; Run it in T1 first, with nobody and nothing within reach, a hand on the enabling switch.",
        f"; Duration {times[-1]:.1f} s. The motion keeps, axis by axis (degrees or mm, per s, per s^2):",
    ]
    lower, upper, speed, acceleration = (
        scale * np.asarray(values) for values in (limits.lower, limits.upper, limits.speed, limits.acceleration)
    )
    lines += [
        f";   {axis}: {lower[j]:.1f} to {upper[j]:.1f}; speed {speed[j]:.1f}; acceleration {acceleration[j]:.0f}"
        for j, axis in enumerate(axes)
    ]
    lines += [
        f"; Minimum height of the guarded points above the base: {1e3 * excitation.lowest:.0f} mm.",
        "BAS (#INITMOV, 0)",
    ]
    if str(excitation.motion.kind) == "point_to_point":
        lines += _point_moves(excitation, times, speed)
    else:
        lines += _spline_moves(times)
    return "\r\n".join([*lines, "END", ""])


def _point_moves(excitation: kr5.identification.Excitation, times: np.ndarray, speed: np.ndarray) -> list[str]:
    """Each stroke at the part of the axis speeds that gives it its time."""
    points = np.asarray(excitation.motion.points)
    peak = 1.875 if str(excitation.motion.profile) == "quintic" else 4.0 / 3.0
    lines = ["BAS (#VEL_PTP, 10)", "PTP XP1"]
    for k, time in enumerate(np.diff(times)):
        way = np.abs(points[k + 1] - points[k])
        share = float((peak * way / time / np.asarray(excitation.limits.speed)).max())
        lines += [f"BAS (#VEL_PTP, {max(1, min(100, round(100 * share)))})", f"PTP XP{k + 2}"]
    return lines


def _spline_moves(times: np.ndarray) -> list[str]:
    """A spline block with the time of each of its parts (KSS 8.3 and later)."""
    lines = ["BAS (#VEL_PTP, 10)", "PTP XP1", "PTP_SPLINE", "TIME_BLOCK START"]
    for k in range(1, len(times)):
        lines += [f"SPTP XP{k + 1}", f"TIME_BLOCK PART = {100 * (times[k] - times[k - 1]) / times[-1]:.5f}"]
    lines[-1] = f"TIME_BLOCK END = {times[-1]:.4f}"
    return [*lines, "ENDSPLINE"]


def _data(name: str, axes: list[str], scale: np.ndarray, points: np.ndarray) -> str:
    lines = [f"DEFDAT {name}"]
    lines += [f"DECL E6AXIS XP{k + 1}={{{_listed(axes, scale * q)}}}" for k, q in enumerate(points)]
    return "\r\n".join([*lines, "ENDDAT", ""])
