"""Reads a camera from any of the usual files."""

import math
import xml.etree.ElementTree as xml
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import kr5
from kr5.files.documents import parse_json, parse_yaml, read_text
from kr5.files.opencv_storage import as_yaml, parse_storage

FORMS = (
    "a result of `kr5 calibrate camera`, a YAML with fx fy cx cy (and width, height, k1 ... p2), a cell.yaml, "
    "ViSP's XML or a camera of OpenCV (YAML, XML, JSON) or ROS"
)
LENS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")  # OpenCV's order, ours, and that of cell.yaml
MAX_SIDE = 1_000_000  # of an image [px]
FIELDS = ("width", "height", "fx", "fy", "cx", "cy", *LENS)


def check_size(camera: kr5.Pinhole, file: Path | str, size: tuple[int, int], image: Path | None = None) -> None:
    """Complains of a camera file that is not for images of this size (width, height) [px]."""
    if (camera.width, camera.height) != tuple(size):
        whose = f"{image} has" if image else "the images have"
        raise kr5.FileError(
            file, f"is a camera of {camera.width} x {camera.height} px, but {whose} {size[0]} x {size[1]} px"
        )


def load_camera(file: Path | str, size: tuple[int, int] | None = None, image: Path | None = None) -> kr5.Pinhole:
    """The kr5.Pinhole in a file, for images, or one, of `size` (width, height) [px], which is taken where the file does
    not say it."""
    file = Path(file)
    fields = _fields(file, read_text(file, FORMS))
    if size and not (fields.get("width") and fields.get("height")):
        fields["width"], fields["height"] = size
    camera = _pinhole(file, fields)
    if size:
        check_size(camera, file, size, image)
    return camera


def _fields(file: Path, text: str) -> dict[str, Any]:
    data = parse_storage(text, file, FORMS)
    if data is None and text.lstrip().startswith("<"):
        return _from_xml(file, text)
    if data is None:
        data = (
            parse_json(text, file, FORMS) if text.lstrip().startswith("{") else parse_yaml(as_yaml(text), file, FORMS)
        )
    if not isinstance(data, dict):
        raise kr5.FileError(file, f"contains no camera; expected {FORMS}")
    if str(data.get("format", "")).startswith("kr5-camera/"):
        if data.get("verdict", {}).get("word") == "unusable":
            raise kr5.FileError(
                file, f"the calibration is unusable ({data['verdict'].get('text', '')})", remedy="calibrate again"
            )
        return dict(data.get("result", {}).get("camera", {}))
    for names in (("camera_matrix", "distortion_coefficients"), ("M1", "D1"), ("M", "D"), ("K", "D")):
        if names[0] in data:
            return _from_opencv(file, data, *names)
    return _from_cell(file, data["camera"]) if isinstance(data.get("camera"), dict) else dict(data)


def _from_cell(file: Path, camera: Mapping[str, object]) -> dict[str, Any]:
    """Short and general form of cell.yaml: distortion as a list k1 k2 p1 p2 k3 ..., or {model, values}."""
    fields = {key: camera[key] for key in FIELDS if key in camera}
    values = camera.get("distortion", [])
    if isinstance(values, dict):
        values = values.get("values", [])
    if isinstance(values, dict):
        return fields | values
    if not isinstance(values, list) or len(values) > len(LENS):
        raise kr5.FileError(
            file, f"found {values!r}, expected up to 8 numbers k1 k2 p1 p2 k3 k4 k5 k6", field="camera.distortion"
        )
    return fields | dict(zip(LENS, values))


def _from_opencv(file: Path, data: dict[str, Any], matrix: str, lens: str) -> dict[str, Any]:
    def numbers(key: str) -> list[float]:
        value = data.get(key, [])
        value = value.get("data", []) if isinstance(value, dict) else value
        flat = [x for row in value for x in (row if isinstance(row, list) else [row])]
        return [float(x) for x in flat]

    if data.get("distortion_model") in ("equidistant", "fisheye"):
        raise kr5.FileError(
            file,
            f"found {data['distortion_model']}, expected plumb_bob or rational_polynomial",
            field="distortion_model",
        )
    try:
        K, values = numbers(matrix), numbers(lens)
    except (TypeError, ValueError):
        raise kr5.FileError(file, f"{matrix} or {lens} holds something that is no number") from None
    if len(K) != 9:
        raise kr5.FileError(file, f"found {len(K)} numbers, expected the 9 of fx 0 cx, 0 fy cy, 0 0 1", field=matrix)
    if any(values[len(LENS) :]):
        raise kr5.FileError(
            file,
            "thin-prism and tilt terms (beyond the 8th) are not supported",
            field=lens,
            remedy="calibrate without them",
        )
    fields = {"fx": K[0], "fy": K[4], "cx": K[2], "cy": K[5], **dict(zip(LENS, values))}
    for ours, theirs in (("width", "image_width"), ("height", "image_height")):
        if theirs in data:
            fields[ours] = data[theirs]
    return fields


def _from_xml(file: Path, text: str) -> dict[str, Any]:
    """ViSP: of the models in the file, the one with distortion. Its u = u0 + px x (1 + kud r^2) is our k1."""
    try:
        root = xml.fromstring(text)
    except xml.ParseError as error:
        raise kr5.FileError(file, f"is not valid XML ({error}); expected {FORMS}") from error
    camera = root if root.tag == "camera" else root.find(".//camera")
    models = [] if camera is None else camera.findall("model")
    if not models:
        raise kr5.FileError(file, "holds no <camera> with a <model>; expected ViSP's camera file")
    model = next((m for m in models if "WithDistortion" in m.findtext("type", "")), models[0])
    names = {"fx": "px", "fy": "py", "cx": "u0", "cy": "v0"}
    fields = {ours: (model.findtext(theirs) or "").strip() for ours, theirs in names.items()}
    fields["k1"] = (model.findtext("kud") or "0").strip()
    for ours, theirs in (("width", "image_width"), ("height", "image_height")):
        if camera is not None and (found := camera.findtext(theirs)) is not None:
            fields[ours] = found.strip()
    return fields


def _pinhole(file: Path, fields: dict[str, Any]) -> kr5.Pinhole:
    for key in ("fx", "fy", "cx", "cy", "width", "height"):
        if fields.get(key) in (None, ""):
            raise kr5.FileError(file, f"{key} is missing; expected {FORMS}")
    values: dict[str, Any] = {}
    for key in FIELDS:
        try:
            value = float(fields.get(key, 0.0))
        except (TypeError, ValueError):
            value = math.nan
        if not math.isfinite(value):
            raise kr5.FileError(file, f"found {fields[key]!r}, expected a number", field=key)
        if key in ("width", "height"):
            if not 1 <= value <= MAX_SIDE:
                raise kr5.FileError(file, f"found {value:g}, expected 1 to {MAX_SIDE} px", field=key)
            value = int(value)
        values[key] = value
    camera = kr5.Pinhole(**values)
    try:
        camera.validate()
    except kr5.InvalidArgument as error:
        raise kr5.FileError(file, str(error)) from error
    return camera
