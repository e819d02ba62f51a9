"""`kr5 dataset guess`: proposes a dataset.yaml for a folder, with its reasons."""

import itertools
import re
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
import yaml

import kr5
from kr5 import calibration, vision

from .calibrate_hand_eye import camera_of
from .camera import load_camera
from .common import IMAGE_ENDINGS, Json, console, fail, table, track, working, write_json, write_text

app = typer.Typer()

POSES = {".yaml", ".yml", ".json", ".csv", ".txt"}
OPENCV_DICTIONARIES = {i: f"aruco_{n}x{n}_{count}" for i, (n, count) in
                       enumerate(itertools.product((4, 5, 6, 7), (50, 100, 250, 1000)))}


@app.callback()
def group() -> None:
    """Describe a folder of images and robot poses."""


@app.command(epilog="Example:  kr5 dataset guess my_folder -o dataset.yaml")
def guess(
    folder: Annotated[Path, typer.Argument(help="Folder of images and robot poses.")],
    target: Annotated[str | None, typer.Option(help="The target, when it is known: chessboard:6x9:0.0236 ...")] = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", metavar="dataset.yaml", help="Write the proposal here.")] = None,
    json_file: Json = None,
) -> None:
    """Proposes which images and poses belong together, how the poses are written, the target, the camera and the mount."""
    if not folder.is_dir():
        fail(f"{folder}: no such folder; expected one with images and robot poses")
    out, reasons = console(json_file), []
    images = _images(folder, reasons)
    poses, forms = _poses(folder, images, reasons)
    name, views = _target(folder, images, target, reasons)
    camera_file, camera = _camera(folder, images, views, reasons)
    best, rivals = _convention(images, poses, forms, views, camera)
    reasons.append(["convention, mount", _text(best), f"robot and camera agree to {1e3 * best['error']:.2g} mm, next best reading "
                    f"({_text(rivals[0])}) to {1e3 * rivals[0]['error']:.2g} mm" if rivals else "the only reading possible",
                    "high" if not rivals or rivals[0]["error"] > 3 * best["error"] else "low"])
    # T X M = Z with the poses inverted is the other mount's equation: no image can tell the two apart.
    other = {"eye_in_hand": "eye_to_hand", "eye_to_hand": "eye_in_hand"}[best["mount"]]
    reasons.append(["", f"or T_flange_base, {other}", "inverted poses with the other mount agree exactly as well: look at the cell "
                    "to see what carries the camera", "not told by the data"])
    text = _yaml(folder, images, poses, best, name, camera_file)
    out.print(table(f"What {folder} seems to hold", ["what", "proposal", "because", "confidence"], reasons))
    if output:
        write_text(text, output)
    else:
        out.print(text, markup=False)
    write_json({"dataset": yaml.safe_load(text), "reasons": [dict(zip(("what", "proposal", "because", "confidence"), r)) for r in reasons]}, json_file)


def _family(file: Path) -> tuple[str, str, str]:
    """What files of one kind have in common: folder, ending, and the name without its last number."""
    return str(file.parent), file.suffix.lower(), re.sub(r"\d+(?=\D*$)", "*", file.stem)


def _families(folder: Path, endings: set[str]) -> list[list[Path]]:
    files = [f for f in folder.rglob("*") if f.is_file() and f.suffix.lower() in endings and len(f.relative_to(folder).parts) <= 3]
    files.sort(key=_family)
    return [sorted(g, key=_number) for _, g in itertools.groupby(files, _family)]


def _number(file: Path) -> int:
    return int((re.findall(r"\d+", file.stem) or ["-1"])[-1])


def _pattern(folder: Path, files: list[Path]) -> str:
    where = files[0].parent.relative_to(folder)
    name = files[0].name if len(files) == 1 else _family(files[0])[2] + files[0].suffix
    return str(where / name)


def _images(folder: Path, reasons: list) -> list[Path]:
    families = _families(folder, set(IMAGE_ENDINGS))
    if not families:
        fail(f"{folder}: found no image ({', '.join(IMAGE_ENDINGS)}), expected images and robot poses")
    best = max(families, key=len)
    sure = sum(len(f) == len(best) for f in families) == 1
    reasons.append(["images", _pattern(folder, best), f"{len(best)} files, the largest group", "high" if sure else "low"])
    return best


def _readable(files: list[Path]) -> tuple[np.ndarray | None, list[str]]:
    """Rows of pose files, and the forms of rotation in which they can be read."""
    forms, rows = [], None
    for form in ("quaternion_xyzw", "quaternion_wxyz", "rotation_vector", "rpy", "kuka_abc", "matrix"):
        try:
            found = np.vstack([calibration.load_poses(str(f), form) for f in files])
        except (kr5.Error, ValueError):
            continue
        if any(str(f.rotation) == form for f in calibration.plausible_formats(found)):
            forms.append(form)
            rows = found
    return rows, forms


def _poses(folder: Path, images: list[Path], reasons: list) -> tuple[list[Path], list[str]]:
    for files in sorted(_families(folder, POSES), key=lambda g: -len(g)):
        if len(files) not in (1, len(images)) or files[0].name == "dataset.yaml":
            continue
        rows, forms = _readable(files)
        if rows is None or len(rows) != len(images):
            continue
        how = f"one file each, paired by number {_number(files[0])} to {_number(files[-1])}" if len(files) > 1 else "one row an image"
        reasons.append(["poses", _pattern(folder, files), f"{len(rows)} poses for {len(images)} images, {how}", "high"])
        return files, forms
    fail(f"{folder}: found no poses for the {len(images)} images; expected a file of numbers for each (YAML, JSON, text), or one "
         "CSV or text file with a row for each")


def _hints(folder: Path) -> tuple[str, dict[str, Any]]:
    """Words and keys about a target in small texts of the folder."""
    text, keys = "", {}
    many = {f for family in _families(folder, POSES) if len(family) > 2 for f in family}  # poses
    for file in sorted(folder.glob("*")):
        if file in many or file.suffix.lower() not in {".txt", ".yaml", ".yml", ".md"} or file.name == "dataset.yaml" or file.stat().st_size > 20000:
            continue
        content = file.read_text(encoding="utf-8", errors="replace")
        text += content + "\n"
        for key, value in re.findall(r"^\s*([A-Za-z_]+):\s*([^\s#]+)", content, re.M):
            keys.setdefault(key, value)
    return text, keys


def _candidates(text: str, keys: dict[str, Any]) -> list[tuple[str, str]]:
    """Targets to try, with why: those the texts speak of first, then usual ones."""
    out = []
    rows, cols = keys.get("rows"), keys.get("cols")
    size = keys.get("spacing") or keys.get("chessboard_dim") or (re.findall(r"size[^\d]*([\d.]+)\s*m\b", text) or [None])[0]
    if rows and cols and "aruco_marker_dim" in keys and size:
        family = OPENCV_DICTIONARIES.get(int(keys.get("dictionary", 10)), "aruco_6x6_250")
        out.append((f"charuco:{family}:{rows}x{cols}:{size}:{keys['aruco_marker_dim']}", "named in a text of the folder"))
    elif rows and cols and size:
        out += [(f"{kind}:{rows}x{cols}:{size}", "named in a text of the folder") for kind in ("circles", "chessboard")]
    if (board := re.search(r"(\d+)\s*x\s*(\d+)", text)) and size:
        a, b = board.groups()
        out += [(f"chessboard:{r}x{c}:{size}", "size named in a text of the folder") for r, c in ((b, a), (a, b))]
    boards = [(6, 9), (6, 8), (5, 8), (7, 9), (7, 10), (8, 11), (5, 7), (7, 7), (8, 8), (4, 6), (6, 7), (9, 14)]
    out += [(f"chessboard:{r}x{c}:{size or 0.025}", "found by trying" + ("" if size else "; its size is a guess: measure it")) for r, c in boards]
    out += [(f"circles:{r}x{c}:{size or 0.02}", "found by trying" + ("" if size else "; its size is a guess: measure it"))
            for r, c in [(10, 10), (4, 5), (7, 7), (5, 7), (6, 9)]]
    return out


def _tag(image: np.ndarray, text: str) -> tuple[str, str] | None:
    """A single tag in the image."""
    size = (re.findall(r"size[^\d]*([\d.]+)\s*m\b", text) or [None])[0]
    for family in ("36h11", "25h9", "16h5", "41h12", "aruco_4x4_50", "aruco_5x5_100", "aruco_6x6_250"):
        tags = vision.find_tags(image, vision.TagOptions(families=[family]))
        if len(tags) == 1:
            why = f"one tag of {family} seen" + ("; size from a text of the folder" if size else "; its size is a guess: measure it")
            return f"tag:{family}:{tags[0].id}:{size or 0.05}", why
    return None


def _target(folder: Path, images: list[Path], given: str | None, reasons: list) -> tuple[str, dict[int, Any]]:
    """Short form of the target, and the views by the place of their image."""
    text, keys = _hints(folder)
    middle = np.asarray(vision.load_image(str(images[len(images) // 2])))
    tried = [(given, "given")] if given else []
    if not given:
        if "tag" in text.lower() and (tag := _tag(middle, text)):
            tried.append(tag)
        tried += _candidates(text, keys)
    options = vision.DetectOptions(explain=False)
    for name, why in track(tried, "Trying targets"):
        if str(vision.find_target(middle, kr5.parse_target(name), options).status) == "found":
            break
    else:
        tag = None if given else _tag(middle, text)
        if not tag:
            fail(f"{folder}: no known target was found in {images[len(images) // 2].name}; name it with --target")
        name, why = tag
    target, views = kr5.parse_target(name), {}
    for i, file in track(list(enumerate(images)), "Looking for the target"):
        found = vision.find_target(np.asarray(vision.load_image(str(file))), target, options)
        if str(found.status) == "found":
            views[i] = found.view
    if len(views) < 4:
        fail(f"{folder}: {name} was found in {len(views)} of {len(images)} images, expected at least four; name the target with --target")
    reasons.append(["target", name, f"{why}; found in {len(views)} of {len(images)} images", "low" if "guess" in why else "high"])
    return name, views


def _camera(folder: Path, images: list[Path], views: dict[int, Any], reasons: list) -> tuple[Path | None, Any]:
    height, width = np.asarray(vision.load_image(str(images[next(iter(views))]))).shape
    for file in sorted(folder.glob("*")):
        if file.suffix.lower() in {".xml", ".yaml", ".yml", ".json"} and re.search("cam|intrinsic", file.stem, re.I) and "cal_data" not in file.stem:
            reasons.append(["camera", file.name, "a camera file of the folder", "high"])
            return file, load_camera(file, (width, height))
    camera, how = camera_of("", {"views": list(views.values()), "size": (width, height)})
    reasons.append(["camera", "-", f"no camera file: {how}", "high"])
    return None, camera


def _convention(images: list, poses: list[Path], forms: list[str], views: dict[int, Any], camera: Any) -> tuple[dict, list[dict]]:
    """The reading of the poses under which robot and camera agree best, and the others."""
    found = []
    work = []
    for form in forms:
        rows = np.vstack([calibration.load_poses(str(f), form) for f in poses])
        work += [(rows, f) for f in calibration.plausible_formats(rows) if str(f.rotation) == form and str(f.meaning) == "T_base_flange"]
    tried: list[np.ndarray] = []
    for rows, form in work:
        all_poses = calibration.to_poses(rows, form)
        if any(np.allclose(all_poses, other) for other in tried):  # named values have one order only
            continue
        tried.append(np.array(all_poses))
        for mount in ("eye_in_hand", "eye_to_hand"):
            data = [calibration.HandEyeView(T_base_flange=all_poses[i], view=v) for i, v in views.items()]
            with working("Trying conventions"):
                result = calibration.calibrate_hand_eye(data, camera, calibration.HandEyeOptions(mount=mount))
            if not result.fit.usable:
                continue
            error = np.median([v.robot_position + 0.5 * v.robot_rotation for v in result.views])
            found.append({"format": form, "mount": mount, "error": float(error)})
    if not found:
        fail("under no convention do robot poses and images allow a calibration: too little rotation, or they do not belong together")
    found.sort(key=lambda f: f["error"])
    return found[0], found[1:]


def _text(reading: dict[str, Any]) -> str:
    f = reading["format"]
    return f"{f.meaning}, {f.rotation}, {f.position}, {f.angle}, {reading['mount']}"


def _yaml(folder: Path, images: list[Path], poses: list[Path], best: dict, target: str, camera: Path | None) -> str:
    data = {"format": "kr5-dataset/1", "images": _pattern(folder, images), "poses": _pattern(folder, poses),
            "pairing": "number" if len(poses) > 1 else "order",
            "convention": {k: str(v) for k, v in best["format"].to_dict().items()}, "mount": best["mount"], "target": target}
    if camera:
        data["camera"] = str(camera.relative_to(folder))
    return yaml.safe_dump(data, sort_keys=False)
