"""`kr5 dataset guess`: proposes a dataset.yaml for a folder, with its reasons."""

import itertools
import re
from pathlib import Path
from typing import Annotated, Any

import kr5
import numpy as np
import typer
import yaml
from kr5 import calibration
from kr5.files.camera import load_camera
from kr5.files.images import IMAGE_ENDINGS
from kr5.files.paths import library_path
from kr5.files.writing import check_writable, write_json, write_text

from kr5_tools.calibrate.datasets import camera_of
from kr5_tools.calibrate.pose_pairs import check_holds_no_pairs
from kr5_tools.cli.arguments import JsonOption
from kr5_tools.cli.tables import make_table
from kr5_tools.cli.terminal import console, fail, spinner
from kr5_tools.dataset.target_guess import GUESSED, QUICK, guess_target
from kr5_tools.targets.sightings import Sightings, find_in_images, load_image, load_target

app = typer.Typer()

POSES = {".yaml", ".yml", ".json", ".csv", ".txt"}
PROBES = 3  # images, spread over the set, in which targets are tried


@app.callback()
def group() -> None:
    """Description of a folder of images and robot poses."""


@app.command(epilog="Example:  kr5 dataset guess my_folder -o dataset.yaml")
def guess(
    folder: Annotated[Path, typer.Argument(help="Folder of images and robot poses.")],
    target: Annotated[str | None, typer.Option(help="Target, when it is known, e.g. chessboard:6x9:0.0236.")] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="dataset.yaml", help="File to write the proposal to.")
    ] = None,
    json_file: JsonOption = None,
) -> None:
    """Proposal of a dataset.yaml: which images and poses belong together, the convention of the poses, target, camera
    and mount.
    """
    if not folder.is_dir():
        fail(f"{folder}: no such folder; expected one with images and robot poses")
    out = console(json_file)
    reasons: list[list[Any]] = []
    images = _images(folder, reasons)
    check_writable(output, json_file, inputs=[*images, *_texts(folder)])
    poses, readings = _poses(folder, images, reasons)
    name, seen = _target(folder, images, target, reasons)
    camera_file, camera = _camera(folder, seen, reasons)
    best, *rivals = _convention(readings, seen, camera)
    reasons.append(
        [
            "convention, mount",
            _text(best),
            (
                f"robot and camera agree to {1e3 * best.error:.2g} mm, next best reading "
                f"({_text(rivals[0])}) to {1e3 * rivals[0].error:.3g} mm"
                if rivals
                else "the only possible reading"
            ),
            "high" if not rivals or rivals[0].error > 3 * best.error else "low",
        ]
    )
    # T X M = Z with the poses inverted is the other mount's equation: no image can tell the two apart.
    other = {"eye_in_hand": "eye_to_hand", "eye_to_hand": "eye_in_hand"}[str(best.mount)]
    reasons.append(
        [
            "",
            f"or T_flange_base, {other}",
            ("inverted poses with the other mount agree equally well; check in the cell what carries the camera"),
            "not identified by the data",
        ]
    )
    text = _yaml(folder, images, poses, best, name, camera_file)
    out.print(
        make_table(f"Proposal for {folder}", ["item", "proposal", "reason", "confidence"], reasons, text=(1, 2, 3))
    )
    if output:
        write_text(text, output)
    else:
        out.print(text, markup=False)
    write_json(
        {
            "dataset": yaml.safe_load(text),
            "reasons": [dict(zip(("what", "proposal", "because", "confidence"), r)) for r in reasons],
        },
        json_file,
    )


def _family(file: Path) -> tuple[str, str, str]:
    """What files of one kind have in common: folder, ending, and the name without its last number."""
    return str(file.parent), file.suffix.lower(), re.sub(r"\d+(?=\D*$)", "*", file.stem)


def _families(folder: Path, endings: set[str]) -> list[list[Path]]:
    files = [
        f
        for f in folder.rglob("*")
        if f.is_file() and f.suffix.lower() in endings and len(f.relative_to(folder).parts) <= 3
    ]
    files.sort(key=_family)
    return [sorted(g, key=_number) for _, g in itertools.groupby(files, _family)]


def _texts(folder: Path) -> list[Path]:
    """Files in which poses or words about the target are looked for, but the description that is proposed."""
    return [f for family in _families(folder, POSES) for f in family if f.name != "dataset.yaml"]


def _number(file: Path) -> int:
    return int((re.findall(r"\d+", file.stem) or ["-1"])[-1])


def _pattern(folder: Path, files: list[Path]) -> str:
    where = files[0].parent.relative_to(folder)
    name = files[0].name if len(files) == 1 else _family(files[0])[2] + files[0].suffix
    return str(where / name)


def _images(folder: Path, reasons: list[list[str]]) -> list[Path]:
    families = _families(folder, set(IMAGE_ENDINGS))
    if not families:
        check_holds_no_pairs(folder)
        fail(f"{folder}: found no image ({', '.join(IMAGE_ENDINGS)}), expected images and robot poses")
    best = max(families, key=len)
    sure = sum(len(f) == len(best) for f in families) == 1
    reasons.append(
        ["images", _pattern(folder, best), f"{len(best)} files, the largest group", "high" if sure else "low"]
    )
    return best


def _readings(files: list[Path]) -> list[calibration.PoseRows]:
    """Rows of pose files, in every form of rotation in which they can be read."""
    out = []
    for name in ("quaternion_xyzw", "quaternion_wxyz", "rotation_vector", "rpy", "kuka_abc", "matrix"):
        form = calibration.RotationForm(name)
        try:
            rows = np.vstack([calibration.load_poses(library_path(f), form) for f in files])
        except (kr5.Error, ValueError):
            continue
        if any(f.rotation == form for f in calibration.plausible_formats(rows)):
            out.append(calibration.PoseRows(rotation=form, rows=rows))
    return out


def _poses(folder: Path, images: list[Path], reasons: list[list[str]]) -> tuple[list[Path], list[calibration.PoseRows]]:
    why = ""
    for files in sorted(_families(folder, POSES), key=lambda g: -len(g)):
        if len(files) not in (1, len(images)) or files[0].name == "dataset.yaml":
            continue
        readings = _readings(files)
        if not readings or len(readings[-1].rows) != len(images):
            why = why or _objection(folder, files, len(images))
            continue
        how = (
            f"one file each, paired by number {_number(files[0])} to {_number(files[-1])}"
            if len(files) > 1
            else "one row an image"
        )
        reasons.append(
            ["poses", _pattern(folder, files), f"{len(images)} poses for {len(images)} images, {how}", "high"]
        )
        return files, readings
    fail(
        f"{folder}: found no poses for the {len(images)} images{why}; expected a file of numbers for each (YAML, JSON,"
        " text), or one CSV or text file with a row for each"
    )


def _objection(folder: Path, files: list[Path], count: int) -> str:
    """Why files with as many rows as there are images hold no poses: of six numbers, that the angles come first."""
    try:
        rows = np.vstack([calibration.load_poses(library_path(f), calibration.RotationForm("rpy")) for f in files])
    except (kr5.Error, ValueError):
        return ""
    if len(rows) != count:
        return ""
    said = "; ".join(calibration.format_objections(rows, calibration.PoseFormat.from_dict({"rotation": "rpy"})))
    if calibration.plausible_formats(np.roll(rows, 3, axis=1)):
        said = "its rotation stands before its position: write x y z first"
    return f" ({_pattern(folder, files)} holds six numbers a pose, but {said})"


def _hints(folder: Path) -> tuple[str, dict[str, Any]]:
    """Words and keys about a target in small texts of the folder."""
    text = ""
    keys: dict[str, Any] = {}
    many = {f for family in _families(folder, POSES) if len(family) > 2 for f in family}  # poses
    for file in sorted(folder.glob("*")):
        if (
            file in many
            or file.suffix.lower() not in {".txt", ".yaml", ".yml", ".md"}
            or file.name == "dataset.yaml"
            or file.stat().st_size > 20000
        ):
            continue
        content = file.read_text(encoding="utf-8", errors="replace")
        text += content + "\n"
        for key, value in re.findall(r"^\s*([A-Za-z_]+):\s*([^\s#]+)", content, re.M):
            keys.setdefault(key, value)
    return text, keys


def _target(folder: Path, images: list[Path], given: str | None, reasons: list[list[str]]) -> tuple[str, Sightings]:
    """Short form of the target, and where it was seen."""
    places = np.linspace(0, len(images) - 1, PROBES + 2)[1:-1].round().astype(int)
    probes = {images[i]: load_image(images[i]) for i in places} if not given else {}
    name, why = (given, "given") if given else guess_target(*_hints(folder), probes)
    seen = find_in_images(
        images,
        load_target(name),
        least=4,
        options=None if given else QUICK,
        load=lambda file: probes[file] if file in probes else load_image(file),
    )
    reasons.append(
        [
            "target",
            name,
            f"{why}; found in {len(seen.views)} of {len(images)} images",
            "low" if GUESSED in why else "high",
        ]
    )
    return name, seen


def _camera(folder: Path, seen: Sightings, reasons: list[list[str]]) -> tuple[Path | None, Any]:
    for file in sorted(folder.glob("*")):
        if file.suffix.lower() in {".xml", ".yaml", ".yml", ".json"} and re.search("cam|intrinsic", file.stem, re.I):
            reasons.append(["camera", file.name, "a camera file of the folder", "high"])
            return file, load_camera(file, seen.size)
    camera, how = camera_of("", seen)
    reasons.append(["camera", "-", f"no camera file: {how}", "high"])
    return None, camera


def _convention(
    readings: list[calibration.PoseRows], seen: Sightings, camera: kr5.Pinhole
) -> list[calibration.PoseConvention]:
    """The readings of the poses, the one under which robot and camera agree best first."""
    views = [calibration.ViewOfPose(pose=i, view=v) for i, v in zip(seen.index, seen.views)]
    with spinner("Trying conventions"):
        found = calibration.rank_conventions(readings, views, camera)
    if not found:
        fail(
            "no convention of the robot poses allows a calibration with the images: too little"
            " rotation, or they do not belong together"
        )
    return list(found)


def _text(reading: calibration.PoseConvention) -> str:
    f = reading.format
    return f"{f.meaning}, {f.rotation}, {f.position}, {f.angle}, {reading.mount}"


def _yaml(
    folder: Path,
    images: list[Path],
    poses: list[Path],
    best: calibration.PoseConvention,
    target: str,
    camera: Path | None,
) -> str:
    data = {
        "format": "kr5-dataset/1",
        "images": _pattern(folder, images),
        "poses": _pattern(folder, poses),
        "pairing": "number" if len(poses) > 1 else "order",
        "convention": {k: str(v) for k, v in best.format.to_dict().items()},
        "mount": str(best.mount),
        "target": target,
    }
    if camera:
        data["camera"] = str(camera.relative_to(folder))
    return yaml.safe_dump(data, sort_keys=False)
