"""The forms by name, and which of them the name of a file asks for."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import kr5

from kr5_tools.exports import camera_forms, pose_forms
from kr5_tools.exports.items import ExportItems


@dataclass(frozen=True)
class Form:
    """A form of a result: what it needs, its text, the endings of its files."""

    name: str
    title: str  # for people
    endings: tuple[str, ...]
    takes: tuple[str, ...]  # of "poses" and "camera"; one of them must be there
    text: Callable[[ExportItems], str]

    def missing(self, items: ExportItems) -> bool:
        """Whether the result has nothing of what it holds."""
        there = {"poses": bool(items.main_poses()), "camera": bool(items.cameras)}
        return not any(there[key] for key in self.takes)


def _of_poses(form: pose_forms.PoseForm) -> Callable[[ExportItems], str]:
    return lambda items: form(items.main_poses())


FORMS = (
    Form("ros2-command", "ROS 2 command", (".sh",), ("poses",), _of_poses(pose_forms.ros_command)),
    Form(
        "launch-py",
        "ROS 2 launch file in Python",
        (".launch.py", ".py"),
        ("poses",),
        _of_poses(pose_forms.launch_python),
    ),
    Form(
        "launch-xml",
        "ROS 2 launch file in XML",
        (".launch.xml", ".launch"),
        ("poses",),
        _of_poses(pose_forms.launch_xml),
    ),
    Form("urdf", "URDF", (".urdf", ".xacro"), ("poses",), _of_poses(pose_forms.urdf)),
    Form("matrix", "4×4 matrix", (".txt",), ("poses",), _of_poses(pose_forms.matrix_text)),
    Form("csv", "CSV", (".csv",), ("poses",), _of_poses(pose_forms.csv)),
    Form("json", "JSON", (".json",), ("poses",), _of_poses(pose_forms.json_text)),
    Form(
        "camera-info",
        "ROS camera_info",
        (".yaml",),
        ("camera",),
        lambda items: camera_forms.camera_info(items.cameras[0]),
    ),
    Form(
        "opencv",
        "OpenCV",
        (".yml",),
        ("camera", "poses"),
        lambda items: camera_forms.opencv(items.cameras, items.main_poses()),
    ),
)
BY_NAME = {form.name: form for form in FORMS}


def form_of(file: Path, name: str | None) -> Form:
    """The form that is named, else that of the ending of a file; complains of an unknown one."""
    if name is not None:
        if name not in BY_NAME:
            raise kr5.InvalidArgument(f"--export-format: found {name}, expected one of {', '.join(BY_NAME)}")
        return BY_NAME[name]
    for form in FORMS:
        if file.name.lower().endswith(form.endings):
            return form
    endings = ", ".join(f"{form.endings[0]} ({form.name})" for form in FORMS)
    raise kr5.InvalidArgument(
        f"--export: {file}: found the ending '{file.suffix}', expected {endings}; or name the form with --export-format"
    )
