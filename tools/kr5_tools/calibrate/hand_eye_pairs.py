"""`kr5 calibrate hand-eye PAIRS`: the same from pairs of poses, without images."""

import warnings
from pathlib import Path
from typing import Any

import kr5
import kr5.cell
import numpy as np
from kr5 import calibration
from kr5.files.writing import check_writable
from kr5.tables.options import TableOptions

from kr5_tools.calibrate.hand_eye_result import (
    add_outlier_free,
    figures_of,
    frames_of,
    held_out_figures,
    show_hand_eye,
    write_hand_eye,
)
from kr5_tools.calibrate.pose_pairs import PosePairs, read_pairs_file
from kr5_tools.cli.table_options import tell_notes
from kr5_tools.cli.terminal import console, spinner
from kr5_tools.exports.command_line import Exports

FOLDS = 10
FAR_CARRIED = 0.5  # farther from the flange little is carried [m]


def refuse_image_options(dataset: Path | None, camera: Path | None, target: str | None, sigma_pixel: float) -> None:
    """Complains of what only images can use."""
    given = (("--dataset", dataset), ("--camera", camera), ("--target", target), ("--sigma-pixel", sigma_pixel))
    if flags := [flag for flag, value in given if value]:
        raise kr5.InvalidArgument(
            f"{', '.join(flags)}: only with a folder of images; pairs of poses need neither camera nor target"
        )


def refuse_pair_options(*values: object) -> None:
    """Complains of what only pairs of poses can use."""
    meanings = ("--camera-poses", "--robot-meaning", "--camera-meaning")
    names = (*meanings, "--columns", "--convention", "--length-unit", "--angle-unit", "--sigma-camera-rotation")
    if flags := [flag for flag, value in zip(names, values, strict=True) if value]:
        raise kr5.InvalidArgument(
            f"{', '.join(flags)}: only with a file of pairs of poses; a folder says its convention in dataset.yaml"
        )


def calibrate_pairs(
    file: Path,
    camera_poses: Path | None,
    mount: str | None,
    meaning: tuple[str | None, str | None],
    wanted: TableOptions,
    options: calibration.HandEyeOptions,
    sigma_camera_rotation: float,
    judging: calibration.HandEyeDiagnosisOptions,
    output: Path | None,
    json_file: Path | None,
    believed: kr5.cell.Cell,
    write_cell: Path | None,
    exports: Exports,
) -> bool:
    """Calibrates, diagnoses, tells and writes; says whether the result may be used."""
    exports.check_parts("poses")
    check_writable(output, json_file, write_cell, *exports.files, inputs=[file, camera_poses])
    data = read_pairs_file(file, camera_poses, wanted, mount=mount)
    tell_notes(wanted.notes)
    data.mount = mount or data.mount
    if data.mount is None:
        raise kr5.FileError(
            file,
            "does not say where the camera is mounted, and pairs of poses cannot show it; specify --mount"
            " eye_in_hand or --mount eye_to_hand",
        )
    chosen = calibration.HandEyePairsOptions(
        mount=data.mount,
        sigma_position=options.sigma_robot_position,
        sigma_robot_rotation=options.sigma_robot_rotation,
        sigma_camera_rotation=sigma_camera_rotation,
        min_rotation=options.min_rotation,
        outlier_false_alarm=options.outlier_false_alarm,
    )
    chosen.validate()
    pairs, read_as = _choose_reading(data, *meaning)
    with spinner("Calibrating"):
        result = calibration.calibrate_hand_eye_pairs(pairs, chosen)
    keys = _keys(data, pairs, result, chosen, judging)
    keys["input"] = {
        "pairs": str(file),
        **({"camera_poses": str(camera_poses)} if camera_poses else {}),
        "source": data.source,
        "count": len(pairs),
        "mount": data.mount,
        "convention": data.convention.to_dict(),
        "read_as": read_as,
    }
    show_hand_eye(keys, console(json_file))
    return write_hand_eye(keys, result.fit, output, json_file, exports, believed, write_cell)


def _pairs(data: PosePairs) -> list[Any]:
    robot = calibration.to_poses(data.rows, data.convention)
    return [
        calibration.PosePair(name=name, T_base_flange=T, T_camera_target=M)
        for name, T, M in zip(data.names, robot, data.T_camera_target, strict=True)
    ]


def _choose_reading(data: PosePairs, robot: str | None, camera: str | None) -> tuple[list[Any], str]:
    """The pairs as the options say, or as the data tell; and that in words."""
    if robot:
        data.convention.meaning = robot
    if camera == "T_target_camera":
        data.T_camera_target = [np.linalg.inv(T) for T in data.T_camera_target]
    pairs = _pairs(data)
    if robot or camera:
        return pairs, f"{data.convention.meaning} and {camera or 'T_camera_target'}, as the options say"
    found = calibration.compare_pair_readings(pairs, data.mount)
    best, stated, text = found.readings[0], str(data.convention.meaning), found.text
    if stated == "T_flange_base":  # the comparison calls T_base_flange what is read as stated
        text = "T_base_flange".join(part.replace("T_base_flange", stated) for part in text.split(stated))
    if not found.certain:
        warnings.warn(f"{text} They are read as {stated} and T_camera_target.", kr5.Caution, stacklevel=2)
        return pairs, text
    if not (best.robot_inverted or best.camera_inverted):
        if best.flange_distance > FAR_CARRIED and best.flange_distance > 2 * best.base_distance:
            warnings.warn(
                f"{text} Are both inverted, or robot and camera exchanged, or is the mount the other one?",
                kr5.Caution,
                stacklevel=2,
            )
        return pairs, f"{stated} and T_camera_target, as stated; the data agree"
    if best.robot_inverted:
        data.convention.meaning = "T_base_flange" if stated == "T_flange_base" else "T_flange_base"
    if best.camera_inverted:
        data.T_camera_target = [np.linalg.inv(T) for T in data.T_camera_target]
    seen = "T_target_camera" if best.camera_inverted else "T_camera_target"
    warnings.warn(
        f"{text} They are read as {data.convention.meaning} and {seen}; or the mount is the other one.",
        kr5.Caution,
        stacklevel=2,
    )
    return calibration.read_pairs(pairs, best), f"{data.convention.meaning} and {seen}, as the data show"


def _keys(
    data: PosePairs,
    pairs: list[calibration.PosePair],
    result: calibration.HandEyeResult,
    options: calibration.HandEyePairsOptions,
    judging: calibration.HandEyeDiagnosisOptions,
) -> dict[str, Any]:
    with spinner("Searching for faults of the recording"):
        diagnosis = calibration.diagnose_hand_eye_pairs(
            data.rows, data.convention, data.T_camera_target, data.mount, result, data.names, data.times, judging
        )
    held_out = {}
    if result.fit.usable and len(pairs) >= 5:
        with spinner("Evaluating held-out pairs"):
            judged = calibration.evaluate_hand_eye_pairs(pairs, options, FOLDS)
        held_out = add_outlier_free(judged.to_dict(), result) if judged.views else {}
    return {
        "verdict": {"word": str(diagnosis.verdict), "text": diagnosis.text},
        "causes": [c.to_dict() for c in diagnosis.causes],
        "figures": figures_of(result, diagnosis, held_out),
        "views": [{k: v for k, v in view.to_dict().items() if k != "rms_px"} for view in result.views],
        "frames": frames_of(result, [p.T_base_flange for p in pairs], result.views),
        **({"held_out": held_out_figures(held_out)} if held_out else {}),
        "diagnosis": diagnosis.to_dict(),
        "result": result.to_dict(),
    }
