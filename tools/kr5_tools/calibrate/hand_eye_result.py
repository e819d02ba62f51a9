"""What is told of a hand-eye calibration, whether it was made from images or from pairs of poses."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import kr5.calibration
import kr5.cell
import numpy as np
from kr5.files.results import write_if_usable, write_result

from kr5_tools.cli.cell_output import put_camera_pose, write_cell_file
from kr5_tools.cli.numbers import format_percent, root_mean_square
from kr5_tools.cli.tables import figure_row, make_table, pose_figures, print_result
from kr5_tools.cli.terminal import Console, console
from kr5_tools.exports.command_line import Exports


def add_outlier_free(judged: dict[str, Any], result: kr5.calibration.HandEyeResult) -> dict[str, Any]:
    """Errors on held-out views with those of the views that agree, where some contradict them."""
    outliers = {view.name for view in result.views if view.outlier}
    sound = [view for view in judged.get("views", ()) if view["name"] not in outliers]
    if not sound or len(sound) == len(judged["views"]):
        return judged
    rms = {
        f"{what}_rms_without_outliers": root_mean_square(view[what] for view in sound)
        for what in ("position", "rotation")
    }
    return {**judged, **rms}


def held_out_figures(judged: dict[str, Any]) -> dict[str, float]:
    """For people: mm and deg, by the end of the name."""
    return {
        f"{what}_{how}_{unit}": scale * judged[f"{what}_{how}"]
        for how in ("rms", "rms_without_outliers", "median")
        for what, scale, unit in (("position", 1e3, "mm"), ("rotation", 180 / np.pi, "deg"))
        if f"{what}_{how}" in judged
    }


def in_hand(result: kr5.calibration.HandEyeResult | kr5.calibration.CellCalibrationResult) -> bool:
    return str(result.mount) == "eye_in_hand"


def predict_target(
    result: kr5.calibration.HandEyeResult | kr5.calibration.CellCalibrationResult, T_base_flange: np.ndarray
) -> np.ndarray:
    """T_camera_target that the result gives for a pose of the robot."""
    T_mount_fixed = np.linalg.inv(T_base_flange) if in_hand(result) else T_base_flange
    T: np.ndarray = np.linalg.inv(result.T_mount_camera) @ T_mount_fixed @ result.T_fixed_target
    return T


def frames_of(
    result: kr5.calibration.HandEyeResult | kr5.calibration.CellCalibrationResult,
    poses: list[np.ndarray],
    views: Sequence[kr5.calibration.HandEyeViewReport | kr5.View],
) -> list[dict[str, Any]]:
    hand, base = ("camera", "target") if in_hand(result) else ("target", "camera")
    placed = {"camera": result.T_mount_camera, "target": result.T_fixed_target}
    frames: list[dict[str, Any]] = [
        {"name": "base", "parent": None, "T": np.eye(4)},
        {"name": base, "parent": "base", "T": placed[base]},
        {"name": "flange", "parent": "base", "T": poses[0]},
        {"name": hand, "parent": "flange", "T": placed[hand]},
    ]
    kind = "station" if in_hand(result) else "boards"
    return frames + [
        {"name": f"{hand} {v.name}", "kind": kind, "parent": "base", "T": T @ placed[hand]}
        for v, T in zip(views[1:], poses[1:])
    ]


def figures_of(
    result: kr5.calibration.HandEyeResult, diagnosis: kr5.calibration.HandEyeDiagnosis, held_out: dict[str, Any]
) -> list[dict[str, Any]]:
    if not result.fit.usable:
        return []
    where = ("camera on flange", "target in base") if in_hand(result) else ("camera in base", "target on flange")
    rows = pose_figures(where[0], result.T_mount_camera, result.covariance)
    _add_corrected(rows, where[0], diagnosis)
    rows += pose_figures(where[1], result.T_fixed_target, result.covariance_target)
    at = f"{diagnosis.working_distance:.2g} m ahead"
    rows += [
        figure_row(f"expected error {at} (RMS)", 1e3 * diagnosis.tool_error, None, "mm"),
        figure_row(f"95 % of errors {at} below", 1e3 * diagnosis.tool_error_95, None, "mm"),
        *_noise_figures(result),
        figure_row("rotation of the wrist, major axis (RMS)", np.degrees(diagnosis.rotation_major), None, "deg"),
        figure_row("rotation of the wrist, second axis (RMS)", np.degrees(diagnosis.rotation_minor), None, "deg"),
    ]
    if held_out:
        without = "_without_outliers" if "position_rms_without_outliers" in held_out else ""
        said = "target in held-out views" + (" without outliers" if without else "")
        rows += [
            figure_row(f"{said} (RMS)", 1e3 * held_out[f"position_rms{without}"], None, "mm"),
            figure_row(f"{said}, rotation (RMS)", np.degrees(held_out[f"rotation_rms{without}"]), None, "deg"),
        ]
    return rows


def _add_corrected(rows: list[dict[str, Any]], name: str, diagnosis: kr5.calibration.HandEyeDiagnosis) -> None:
    """Beside the pose of the camera, that with the first cause corrected, where it is likely and changes anything."""
    cause = next(iter(diagnosis.causes), None)
    if cause is None or cause.T_mount_camera is None or cause.probability < 0.5 or not cause.consequence:
        return
    for row, corrected in zip(rows, pose_figures(name, cause.T_mount_camera, cause.covariance)):
        row["corrected"] = [corrected["value"], corrected["std"]]


def _noise_figures(result: kr5.calibration.HandEyeResult) -> list[dict[str, Any]]:
    robot = figure_row("robot noise, rotation", np.degrees(result.sigma_robot_rotation), None, "deg")
    if result.sigma_pixel:
        return [
            figure_row("noise of a point per axis", result.sigma_pixel, None, "px"),
            figure_row("robot noise, position", 1e3 * result.sigma_robot_position, None, "mm"),
            robot,
        ]
    return [
        figure_row("noise of robot and camera, position", 1e3 * result.sigma_robot_position, None, "mm"),
        robot,
        figure_row("camera noise, rotation", np.degrees(result.sigma_camera_rotation), None, "deg"),
    ]


def show_hand_eye(keys: dict[str, Any], out: Console) -> None:
    """The verdict, each cause with its evidence and remedy, the figures, then the views."""
    print_result({"verdict": keys["verdict"]}, out)
    for cause in keys["causes"]:
        print_result({"causes": [cause]}, out)
        out.print(
            f"    {cause['evidence']} Probability: {format_percent(cause['probability'])}.",
            soft_wrap=True,
            markup=False,
        )
    print_result({"figures": keys["figures"]}, out)
    if any(row.get("corrected") for row in keys["figures"]):
        out.print("Value: as recorded. Corrected: with the first cause corrected.", soft_wrap=True)
    for lost in keys["input"].get("without_target", ()):
        out.print(f"  not used: {lost['name']}: {lost['message']}", soft_wrap=True, markup=False)
    pixels = any(v.get("rms_px") for v in keys["views"])
    rows = (
        [
            v["name"],
            *([v["rms_px"]] if pixels else []),
            1e3 * v["robot_position"],
            float(np.degrees(v["robot_rotation"])),
            v["weight"],
            "outlier" if v["outlier"] else "",
        ]
        for v in keys["views"]
    )
    columns = [*(["RMS [px]"] if pixels else []), "robot error [mm]", "robot error [deg]", "weight [-]", ""]
    out.print()
    out.print(make_table("Views", ["view", *columns], rows))


def write_hand_eye(
    keys: dict[str, Any],
    fit: kr5.FitReport,
    output: Path | None,
    json_file: Path | None,
    exports: Exports,
    believed: kr5.cell.Cell,
    write_cell: Path | None,
    lens: kr5.Pinhole | None = None,
) -> bool:
    """Writes result, exports and the pose of the camera into the cell `believed`, if there is one; says whether the
    result may be used."""
    written = write_result(None, "kr5-hand-eye/1", **keys)
    write_if_usable(written, fit, output, json_file)
    exports.write(written, console(json_file))
    if believed:
        put_camera_pose(believed, keys["input"]["mount"], np.array(keys["result"]["T_mount_camera"]), lens)
        write_cell_file(believed, write_cell)
    return bool(keys["verdict"]["word"] != "unusable")
