"""A dataset.yaml proposed for a folder of images and robot poses: what belongs together, and how it is to be read."""

import itertools
import re
import tempfile
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import kr5
import numpy as np
import yaml
from kr5 import calibration
from kr5.files.camera import load_camera
from kr5.files.images import IMAGE_ENDINGS
from kr5.files.paths import library_path

from kr5_tools.calibrate.datasets import camera_of, read_dataset
from kr5_tools.calibrate.pose_pairs import check_holds_no_pairs
from kr5_tools.calibrate.target_guess import GUESSED, QUICK, TargetGuess, guess_target
from kr5_tools.calibrate.target_size import resized_name, resized_sightings
from kr5_tools.cli.terminal import spinner
from kr5_tools.targets.sightings import Sightings, find_in_images, load_image, load_target

POSES = {".yaml", ".yml", ".json", ".csv", ".txt"}
PROBES = 3  # images, spread over the set, in which targets are tried
OTHER_MOUNT = {"eye_in_hand": "eye_to_hand", "eye_to_hand": "eye_in_hand"}
INVERTED = "T_flange_base"  # meaning of poses of which no image tells them from T_base_flange with the other mount


@dataclass
class Reason:
    """One item of a proposal, and how sure it is."""

    item: str
    proposal: str
    why: str
    confidence: str


@dataclass
class Proposal:
    """Keys of a dataset.yaml, with a reason for each."""

    keys: dict[str, Any]
    reasons: list[Reason]

    @property
    def text(self) -> str:
        """As a file."""
        return yaml.safe_dump(self.keys, sort_keys=False)

    @property
    def undecided(self) -> list[str]:
        """Items that the data leave open."""
        return [reason.item for reason in self.reasons if reason.confidence == "low"]


def read_or_propose(
    folder: Path, description: Path | None, target: str | None, camera: Path | None, mount: str | None
) -> Any:
    """The data set in a folder; without a description it is proposed, and what is taken is told. `target`, `camera`,
    `mount`: what is known.

    Raises kr5.FileError when the data leave open how they are to be read.
    """
    file = folder / "dataset.yaml"
    if description or file.exists() or not folder.is_dir() or not any(folder.iterdir()):
        return read_dataset(folder, description)
    check_holds_no_pairs(folder)
    proposal = propose_dataset(folder, target, camera)
    keys = proposal.keys
    command = " ".join(["kr5 dataset guess", str(folder), *(["--target", target] if target else []), "-o", str(file)])
    if proposal.undecided:
        raise kr5.FileError(
            file, f"no such file, and the data leave open: {', '.join(proposal.undecided)}; `{command}` proposes one"
        )
    if mount and mount != keys["mount"]:
        keys["mount"], keys["convention"]["meaning"] = mount, INVERTED
    form = keys["convention"]
    told = (
        f"{file}: no such file; taken are {keys['poses']} as {form['meaning']}, {form['rotation']}, {form['position']},"
        f" {form['angle']}, mount {keys['mount']}, target {keys['target']}; `{command}` writes this with its reasons"
    )
    warnings.warn(told, kr5.Caution, stacklevel=2)
    with tempfile.TemporaryDirectory() as place:
        written = Path(place) / file.name
        written.write_text(proposal.text, encoding="utf-8")
        return read_dataset(folder, written)


def propose_dataset(folder: Path, target: str | None, camera_file: Path | None = None) -> Proposal:
    """What the images and files of a folder are. `target`, `camera_file`: those that are known."""
    reasons: list[Reason] = []
    images = find_images(folder, reasons)
    poses, readings = _poses(folder, images, reasons)
    shown, seen = _target(folder, images, target)
    found, camera, how = _camera(folder, seen, camera_file)
    views = [calibration.ViewOfPose(pose=i, view=v) for i, v in zip(seen.index, seen.views, strict=True)]
    conventions = _conventions(readings, views, camera)
    name, why, is_sure = shown.name, shown.why, not shown.is_size_guessed
    if not is_sure:
        with spinner("Looking for the size of the target"):
            sized = calibration.size_from_poses(readings, views, camera, conventions)
        how = GUESSED
        if sized:
            is_sure = _is_clear(sized.conventions)
            how = _size_reason(conventions[0].error, sized.conventions[0].error)
            name, seen = resized_name(name, sized.factor), resized_sightings(seen, sized.factor)
            conventions = sized.conventions
        why = f"{why}; {how}"
    why = f"{why}; found in {len(seen.views)} of {len(images)} images"
    reasons.append(Reason("target", name, why, "high" if is_sure else "low"))
    reasons.append(Reason("camera", found.name if found else "-", how, "high"))
    reasons += _convention_reasons(conventions)
    return Proposal(_keys(folder, images, poses, conventions[0], name, found), reasons)


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


def find_texts(folder: Path) -> list[Path]:
    """Files in which poses or words about the target are looked for, but the description that is proposed."""
    return [f for family in _families(folder, POSES) for f in family if f.name != "dataset.yaml"]


def _number(file: Path) -> int:
    return int((re.findall(r"\d+", file.stem) or ["-1"])[-1])


def _pattern(folder: Path, files: list[Path]) -> str:
    where = files[0].parent.relative_to(folder)
    name = files[0].name if len(files) == 1 else _family(files[0])[2] + files[0].suffix
    return str(where / name)


def find_images(folder: Path, reasons: list[Reason]) -> list[Path]:
    families = _families(folder, set(IMAGE_ENDINGS))
    if not families:
        check_holds_no_pairs(folder)
        raise kr5.FileError(folder, f"found no image ({', '.join(IMAGE_ENDINGS)}), expected images and robot poses")
    best = max(families, key=len)
    sure = sum(len(f) == len(best) for f in families) == 1
    why = f"{len(best)} files, the largest group"
    reasons.append(Reason("images", _pattern(folder, best), why, "high" if sure else "low"))
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


def _poses(folder: Path, images: list[Path], reasons: list[Reason]) -> tuple[list[Path], list[calibration.PoseRows]]:
    objection = ""
    for files in sorted(_families(folder, POSES), key=lambda g: -len(g)):
        if len(files) not in (1, len(images)) or files[0].name == "dataset.yaml":
            continue
        readings = _readings(files)
        if not readings or len(readings[-1].rows) != len(images):
            objection = objection or _objection(folder, files, len(images))
            continue
        how = (
            f"one file each, paired by number {_number(files[0])} to {_number(files[-1])}"
            if len(files) > 1
            else "one row an image"
        )
        why = f"{len(images)} poses for {len(images)} images, {how}"
        reasons.append(Reason("poses", _pattern(folder, files), why, "high"))
        return files, readings
    raise kr5.FileError(
        folder,
        f"found no poses for the {len(images)} images{objection}; expected a file of numbers for each (YAML, JSON,"
        " text), or one CSV or text file with a row for each",
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


def _target(folder: Path, images: list[Path], given: str | None) -> tuple[TargetGuess, Sightings]:
    """The target, and where it was seen."""
    places = np.linspace(0, len(images) - 1, PROBES + 2)[1:-1].round().astype(int)
    probes = {images[i]: load_image(images[i]) for i in places} if not given else {}
    shown = TargetGuess(given, "given") if given else guess_target(*_hints(folder), probes)
    seen = find_in_images(
        images,
        load_target(shown.name),
        least=4,
        options=None if given else QUICK,
        load=lambda file: probes[file] if file in probes else load_image(file),
    )
    return shown, seen


def _camera(folder: Path, seen: Sightings, given: Path | None) -> tuple[Path | None, kr5.Pinhole, str]:
    """The camera's file in the folder, where there is one, its parameters, and where they are from."""
    if given:
        return None, load_camera(given, seen.size), "given"
    for file in sorted(folder.glob("*")):
        if file.suffix.lower() in {".xml", ".yaml", ".yml", ".json"} and re.search("cam|intrinsic", file.stem, re.I):
            return file, load_camera(file, seen.size), "a camera file of the folder"
    camera, how = camera_of("", seen)
    return None, camera, f"no camera file: {how}"


def _conventions(
    readings: list[calibration.PoseRows], views: list[calibration.ViewOfPose], camera: kr5.Pinhole
) -> list[calibration.PoseConvention]:
    """The readings of the poses, the one under which robot and camera agree best first."""
    with spinner("Trying conventions"):
        found = list(calibration.rank_conventions(readings, views, camera))
    if not found:
        raise kr5.InvalidArgument(
            "no convention of the robot poses allows a calibration with the images: too little"
            " rotation, or they do not belong together"
        )
    return found


def _size_reason(before: float, after: float) -> str:
    return (
        f"size from the robot poses: robot and camera agree to {1e3 * after:.2g} mm with it, to {1e3 * before:.2g} mm"
        " with a usual size; check it with a ruler"
    )


def _is_clear(conventions: list[calibration.PoseConvention]) -> bool:
    """Whether robot and camera agree much better under the first reading than under the next."""
    return len(conventions) == 1 or conventions[1].error > 3 * conventions[0].error


def _convention_reasons(conventions: list[calibration.PoseConvention]) -> list[Reason]:
    """The best reading of the poses beside the next best, and the other that no image can tell from it."""
    best, *rivals = conventions
    why = "the only possible reading"
    if rivals:
        why = (
            f"robot and camera agree to {1e3 * best.error:.2g} mm, next best reading ({_text(rivals[0])}) to"
            f" {1e3 * rivals[0].error:.3g} mm"
        )
    # T X M = Z with the poses inverted is the other mount's equation: no image can tell the two apart.
    other = f"or {INVERTED}, {OTHER_MOUNT[str(best.mount)]}"
    same = "inverted poses with the other mount agree equally well; check in the cell what carries the camera"
    return [
        Reason("convention, mount", _text(best), why, "high" if _is_clear(conventions) else "low"),
        Reason("", other, same, "not identified by the data"),
    ]


def _text(reading: calibration.PoseConvention) -> str:
    f = reading.format
    return f"{f.meaning}, {f.rotation}, {f.position}, {f.angle}, {reading.mount}"


def _keys(
    folder: Path,
    images: list[Path],
    poses: list[Path],
    best: calibration.PoseConvention,
    target: str,
    camera: Path | None,
) -> dict[str, Any]:
    """Of the dataset.yaml."""
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
    return data
