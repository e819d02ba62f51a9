"""`kr5 render`: a picture of targets with known truth."""

from pathlib import Path
from typing import Annotated, Any

import typer

from . import common
from .target import load_target

app = typer.Typer()


@app.command(epilog="Example: kr5 render scene.yaml -o view.png --truth view.json")
def render(
    scene: Annotated[Path, typer.Argument(metavar="SCENE.yaml", help="camera: fields of a camera; targets: a list of target (short "
                                          "form or fields) and T_camera_target; options: of the renderer.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="IMAGE", help="The picture.")],
    truth: Annotated[Path | None, typer.Option(metavar="FILE", help="Write where every point of every target is seen (JSON).")] = None,
    json_file: common.Json = None,
) -> None:
    """Renders what a camera sees of targets: lens, blur, noise and light as asked, edges exact to hundredths of a pixel.

    A pose is x y z roll pitch yaw, in m and rad, or a 4x4 matrix.
    """
    import kr5.vision

    camera, placed, options = load_scene(scene)
    with common.working("Rendering …"):
        image = kr5.vision.render(placed, camera, options)
    kr5.vision.save_image(image, str(output))
    views = [kr5.vision.visible_points(p.target, p.T_camera_target, camera) for p in placed]
    common.write_json([view.to_dict() for view in views], truth)
    common.write_json({"image": str(output), "points": [len(view.ids) for view in views]}, json_file)
    seen = ", ".join(f"{len(view.ids)} points of target {i}" for i, view in enumerate(views, start=1))
    common.console(json_file).print(f"{output}: {camera.width} x {camera.height} px; {seen}", soft_wrap=True)


def load_scene(file: Path) -> tuple[Any, list[Any], Any]:
    """Camera, placed targets and options of a scene file."""
    import kr5.vision
    import yaml

    try:
        data = yaml.safe_load(file.read_text(encoding="utf-8"))
    except OSError as error:
        common.fail(f"{file}: {error.strerror}; expected a YAML file with camera, targets and options")
    except yaml.YAMLError as error:
        common.fail(f"{file}: is no YAML: {' '.join(str(error).split())}")
    if not isinstance(data, dict) or not isinstance(data.get("camera"), dict) or not isinstance(data.get("targets"), list):
        common.fail(f"{file}: expected the keys camera (a map) and targets (a list)")
    if unknown := sorted(set(data) - {"camera", "targets", "options"}):
        common.fail(f"{file}: {unknown[0]}: an unknown key; there are camera, targets, options")
    try:
        camera = kr5.Pinhole.from_dict(data["camera"])
        options = kr5.vision.RenderOptions.from_dict(data.get("options") or {})
        placed = [_placed(entry) for entry in data["targets"]]
    except (TypeError, ValueError, KeyError) as error:
        common.fail(f"{file}: {error}")
    return camera, placed, options


def _placed(entry: Any) -> Any:
    import kr5.vision

    if not isinstance(entry, dict) or set(entry) != {"target", "T_camera_target"}:
        raise ValueError("targets: every entry has target and T_camera_target, no more and no less")
    target = entry["target"]
    target = load_target(target) if isinstance(target, str) else kr5.Target.from_dict(target)
    T = entry["T_camera_target"]
    return kr5.vision.PlacedTarget(target=target, T_camera_target=kr5.from_xyzrpy(T) if len(T) == 6 else T)
