"""`kr5 render`: a picture of targets with known truth."""

from pathlib import Path
from typing import Annotated, Any

import typer
from kr5.files import writing
from kr5.files.documents import Document, read_document
from kr5.files.paths import library_path
from pydantic import Field

from kr5_tools.cli import arguments, terminal
from kr5_tools.targets.sightings import load_target

app = typer.Typer()


@app.command(epilog="Example: kr5 render scene.yaml -o view.png --truth view.json")
def render(
    scene: Annotated[
        Path,
        typer.Argument(
            metavar="SCENE.yaml",
            help="camera: fields of a camera; targets: a list of target (short "
            "form or fields) and T_camera_target; options: of the renderer.",
        ),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="IMAGE", help="The picture.")],
    truth: Annotated[
        Path | None, typer.Option(metavar="FILE", help="JSON with the pixel of every point of every target.")
    ] = None,
    json_file: arguments.JsonOption = None,
) -> None:
    """Image of targets as seen by a camera, with lens, blur, noise and light; edges are accurate to hundredths of a
    pixel.

    A pose is x y z roll pitch yaw, in m and rad, or a 4x4 matrix.
    """
    import kr5.vision

    writing.check_writable(output, truth, json_file, inputs=[scene])
    camera, placed, options = load_scene(scene)
    with terminal.spinner("Rendering …"):
        image = kr5.vision.render(placed, camera, options)
    with writing.beside(output) as new:
        kr5.vision.save_image(image, library_path(new))
    views = [kr5.vision.visible_points(p.target, p.T_camera_target, camera) for p in placed]
    writing.write_json([view.to_dict() for view in views], truth)
    writing.write_json({"image": str(output), "points": [len(view.ids) for view in views]}, json_file)
    seen = ", ".join(f"{len(view.ids)} points of target {i}" for i, view in enumerate(views, start=1))
    terminal.console(json_file).print(f"{output}: {camera.width} x {camera.height} px; {seen}", soft_wrap=True)


class PlacedTargetEntry(Document):
    target: str | dict[str, Any] = Field(description="a target's short form, file, or fields")
    T_camera_target: list[float] | list[list[float]] = Field(description="pose x y z roll pitch yaw or 4 x 4 [m, rad]")


class SceneFile(Document):
    """What is rendered: a camera, targets before it, and options."""

    camera: dict[str, Any]
    targets: list[PlacedTargetEntry]
    options: dict[str, Any] | None = None


def load_scene(file: Path) -> tuple[Any, list[Any], Any]:
    """Camera, placed targets and options of a scene file."""
    import kr5.vision

    scene = read_document(file, SceneFile, "a YAML file with camera, targets and options")
    try:
        camera = kr5.Pinhole.from_dict(scene.camera)
        options = kr5.vision.RenderOptions.from_dict(scene.options or {})
        placed = [_placed(entry) for entry in scene.targets]
    except (TypeError, ValueError, KeyError) as error:
        terminal.fail(f"{file}: {error}")
    return camera, placed, options


def _placed(entry: PlacedTargetEntry) -> Any:
    import kr5.vision

    target = load_target(entry.target) if isinstance(entry.target, str) else kr5.Target.from_dict(entry.target)
    T = entry.T_camera_target
    return kr5.vision.PlacedTarget(target=target, T_camera_target=kr5.from_xyzrpy(T) if len(T) == 6 else T)
