"""The options --export of the commands that calibrate."""

import functools
import inspect
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, cast

import kr5
import typer
from kr5.files.result_types import ResultData
from kr5.files.writing import write_text

from kr5_tools.cli.terminal import Console
from kr5_tools.exports.forms import FORMS, Form, form_of
from kr5_tools.exports.items import ExportItems, items_of

PANEL = "Export"
PARTS = {"poses": "poses", "camera": "a camera"}  # of results, in words


def _options(parts: tuple[str, ...]) -> dict[str, Any]:
    """The options of a command whose result is of these parts, with the forms that hold one of them."""
    forms = [form for form in FORMS if set(form.takes) & set(parts)]
    endings = ", ".join(f"{form.endings[0]} ({form.title})" for form in forms)
    frame = "Name of the frame in which the exported pose is stated, e.g. tool0."
    if "poses" not in parts:
        child = "Name of the exported camera, e.g. left_camera."
    elif "camera" not in parts:
        child = "Name of the frame that is placed, e.g. camera_optical_frame."
    else:
        child = "Name of the frame that is placed, or of the exported camera, e.g. camera_optical_frame."
    return {
        "export": Annotated[
            list[Path] | None,
            typer.Option(
                "--export",
                metavar="FILE",
                rich_help_panel=PANEL,
                help=f"File of the result for other programs: {endings}. Repeatable.",
            ),
        ],
        "export_format": _text_option(
            "--export-format",
            "FORMAT",
            f"Format of these files, if not that of their ending: {', '.join(form.name for form in forms)}.",
        ),
        **({"export_parent": _text_option("--export-parent", "FRAME", frame)} if "poses" in parts else {}),
        "export_child": _text_option("--export-child", "FRAME" if "poses" in parts else "NAME", child),
    }


def _text_option(flag: str, metavar: str, text: str) -> Any:
    return Annotated[str | None, typer.Option(flag, metavar=metavar, rich_help_panel=PANEL, help=text)]


@dataclass
class Exports:
    """Files of a result for other programs, as the options ask for them."""

    files: list[Path]
    forms: list[Form]
    parent: str | None = None
    child: str | None = None

    def check_parts(self, *parts: str) -> None:
        """Refuses a form that holds nothing of a result of these parts, of "poses" and "camera"."""
        for file, form in zip(self.files, self.forms):
            if not set(form.takes) & set(parts):
                raise kr5.InvalidArgument(
                    f"--export: {file}: {form.name} holds {_either(form.takes)}, and this result has {_either(parts)}"
                )

    def write(self, data: dict[str, Any], to: Console) -> None:
        """Writes the files of a result, each with a line for people; complains where it does not have what a form
        holds."""
        if not self.files:
            return
        if data.get("verdict", {}).get("word") == "unusable":
            warnings.warn("not exported: the result is unusable", kr5.Caution, stacklevel=2)
            return
        items = self._named(items_of(cast(ResultData, data)))
        for file, form in zip(self.files, self.forms):
            if form.missing(items):
                raise kr5.InvalidArgument(
                    f"--export: {file}: {form.name} holds {_either(form.takes)}, which this result does not have"
                )
            write_text(form.text(items), file)
            to.print(f"export: {file} ({form.title})", soft_wrap=True)

    def _named(self, items: ExportItems) -> ExportItems:
        """The items under the names of frames that were asked for."""
        poses = items.main_poses()
        for pose in poses if self.parent else ():
            pose.parent = str(self.parent)
        if self.child:
            if len(poses) > 1:
                names = ", ".join(pose.child for pose in poses)
                raise kr5.InvalidArgument(
                    f"--export-child: the result has {len(poses)} poses ({names}), which keep their names"
                )
            for pose in poses:
                pose.child = self.child
            for camera in items.cameras:
                camera.name = self.child
        return items


def _either(parts: Iterable[str]) -> str:
    return " or ".join(PARTS[part] for part in parts)


def _exports(
    parts: tuple[str, ...],
    export: list[Path] | None,
    export_format: str | None,
    export_parent: str | None = None,
    export_child: str | None = None,
) -> Exports:
    given = {"--export-format": export_format, "--export-parent": export_parent, "--export-child": export_child}
    if not export and (alone := [flag for flag, value in given.items() if value is not None]):
        raise kr5.InvalidArgument(f"{alone[0]}: --export is missing; name the file to write")
    for flag, name in (("--export-parent", export_parent), ("--export-child", export_child)):
        if name is not None and (not name or any(c.isspace() or c in "<>&\"'," for c in name)):
            raise kr5.InvalidArgument(
                f"{flag}: found {name!r}, expected the name of a frame, without blanks, quotes, commas and <>&"
            )
    if export_parent and export_parent == export_child:
        raise kr5.InvalidArgument(
            f"--export-child: found {export_child}, which is the parent, too; expected another frame"
        )
    files = export or []
    forms = [form_of(file, export_format) for file in files]
    exports = Exports(files, forms, export_parent, export_child)
    exports.check_parts(*parts)
    return exports


def export_options(*parts: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Gives a command the options --export, --export-format, --export-parent (of poses) and --export-child; it gets
    them as the keyword argument `exports`, an `Exports`.

    parts: what its result may hold, of "poses" and "camera"; another form is refused before the command begins.
    """

    options = _options(parts)

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        signature = inspect.signature(command, eval_str=True)
        keyword_only = inspect.Parameter.KEYWORD_ONLY
        own = [p.replace(kind=keyword_only) for p in signature.parameters.values() if p.name != "exports"]
        if len(own) == len(signature.parameters):
            raise TypeError(f"{command.__name__} has no argument 'exports'")
        added = [inspect.Parameter(n, keyword_only, default=None, annotation=a) for n, a in options.items()]

        @functools.wraps(command)
        def with_exports(**given: Any) -> Any:
            return command(exports=_exports(parts, **{name: given.pop(name) for name in options}), **given)

        with_exports.__dict__["__signature__"] = signature.replace(parameters=[*own, *added])
        del with_exports.__wrapped__
        with_exports.__annotations__ = {p.name: p.annotation for p in [*own, *added]}
        return with_exports

    return decorate
