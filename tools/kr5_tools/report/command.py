"""`kr5 report`: one self-contained page for any result file, and every plot as PNG."""

from __future__ import annotations

import base64
import contextlib
import importlib
import io
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn, cast

import typer

from kr5_tools.cli import arguments, terminal
from kr5_tools.cli.numbers import format_number
from kr5_tools.pages.rendering import embed_plot, render_page, script_json, write_png

if TYPE_CHECKING:  # for types alone: it loads numpy and pydantic, which --help need not wait for
    from kr5.files.result_types import FigureData, FrameData, ResultData, ViewData, ViewNumber

    from kr5_tools.calibrate.plots import Plot

app = typer.Typer()

MOST_THUMBNAILS = 60
SMALL, DRAWN = 220, 640  # longest side of a thumbnail [px]: of an image, and of a drawing, whose words are to be read
# Columns of the table of views: key, heading, factor, what rounds it.
VIEW_COLUMNS: tuple[tuple[ViewNumber, str, float, str], ...] = (
    ("points", "points", 1.0, "{:.0f}"),
    ("rms_px", "RMS [px]", 1.0, "{:.3f}"),
    ("weight", "weight [-]", 1.0, "{:.2f}"),
    ("robot_position", "robot error [mm]", 1e3, "{:.3f}"),
    ("robot_rotation", "robot error [deg]", 180 / math.pi, "{:.3f}"),
    ("distance", "tip error [mm]", 1e3, "{:.3f}"),
    ("position_error", "error [mm]", 1e3, "{:.3f}"),
    ("noise_px", "noise [px]", 1.0, "{:.3f}"),
    ("tilt_deg", "tilt [deg]", 1.0, "{:.1f}"),
    ("influence", "influence [-]", 1.0, "{:.1f}"),
)


@app.command(epilog="Example: kr5 report result.json -o report.html --png plots")
def report(
    result: Annotated[
        Path,
        typer.Argument(
            metavar="RESULT", help="Result file, written by a kr5 command with -o or --json; or a protocol (YAML)."
        ),
    ],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="The page.")] = Path("report.html"),
    png: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder for the plots as PNG files.")] = None,
    recording: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Recording of a diagnosis, if it is not at the path in the result file."),
    ] = None,
    json_file: arguments.JsonOption = None,
) -> None:
    """Self-contained page of a result file (no network, no other files), and its plots as PNG."""
    from kr5.files import writing

    writing.check_writable(output, json_file, inputs=[result, recording])
    writing.check_page(output)
    written = write_page_of(result, output, png, recording)
    writing.write_json({"report": str(output), "png": [str(f) for f in written]}, json_file)
    out = terminal.console(json_file)
    out.print(f"report: {output}", soft_wrap=True)
    for file in written:
        out.print(f"plot:   {file}", soft_wrap=True)


# Modules whose `write_page(data, source, output, png)` shows a format in its own way.
PAGES = {
    "kr5-bin-run/1": "picking.run_statistics",
    "kr5-dynamics/1": "identify.dynamics_page",
    "kr5-gap-comparison/1": "gap.compare_page",
    "kr5-gap-explanation/1": "gap.explain_page",
    "kr5-gap-measure/1": "gap.measure_page",
    "kr5-gap-plan/1": "gap.plan_page",
    "kr5-insertion/1": "insertion.result_page",
    "kr5-payload/1": "identify.payload_page",
    "kr5-pick/1": "picking.pick_page",
    "kr5-scene-result/1": "simulation.scene_page",
    "kr5-sensitivity/1": "sensitivity.page",
    "kr5-uncertainty/1": "uncertainty.page",
}


def write_page_of(result: Path, output: Path, png: Path | None, recording: Path | None) -> list[Path]:
    """Writes the page of a result file or a protocol; returns the files of its plots."""
    from kr5.files import results

    from kr5_tools.command_table import result_titles

    if result.suffix.lower() in (".yaml", ".yml"):
        return write_protocol_page(result, output, png)
    data = results.read_result(result, *result_titles())
    if data["format"] in ("kr5-gap/1", "kr5-gap/2"):
        from kr5_tools.gap_report.diagnosis_file import read_diagnosis
        from kr5_tools.gap_report.page import write_gap_report

        return write_gap_report(read_diagnosis(result), result, output, png, recording)
    if data["format"] == "kr5-sweep/1":
        from kr5_tools.sweep.page import write_page

        return write_page(cast("ResultData", data), result, output, png)
    if module := PAGES.get(data["format"]):
        try:
            written: list[Path] = importlib.import_module(f"kr5_tools.{module}").write_page(
                data, result.name, output, png
            )
            return written
        except MALFORMED as error:
            fail_malformed(result, error)
    return write_report(cast("ResultData", data), result, output, png)


def write_protocol_page(source: Path, output: Path, png: Path | None) -> list[Path]:
    from kr5.files import results
    from kr5.files.documents import read_yaml

    from kr5_tools.simulation import protocol_page

    content = read_yaml(source, "a protocol (kr5-protocol/1), or a result file, which is JSON")
    found = content.get("format") if isinstance(content, dict) else None
    if found != "kr5-protocol/1":
        results.fail_format(source, found, ["kr5-protocol/1"])
    return protocol_page.write_page(source, output, png)


MALFORMED = (TypeError, ValueError, KeyError, AttributeError, IndexError)


def fail_malformed(source: Path, error: Exception) -> NoReturn:
    terminal.fail(
        f"{source}: is not a valid result file ({type(error).__name__}: {error}); create it again with its kr5 command"
    )


def write_report(data: ResultData, source: Path, output: Path, png: Path | None = None) -> list[Path]:
    """Writes the page and, if asked, the plots; returns the files of the plots."""
    import matplotlib.pyplot as plt
    from kr5.files import writing

    from kr5_tools.calibrate import plots
    from kr5_tools.pages.plot_style import STYLE

    drawn: list[Any] = []
    try:
        with terminal.spinner("Drawing the plots …"), plt.rc_context(STYLE):
            drawn = plots.plots_of(data)
            page = make_page(data, source, drawn)
            writing.write_text(page, output)
            return write_png(drawn, png) if png else []
    except MALFORMED as error:
        fail_malformed(source, error)
    finally:
        for plot in drawn:
            plt.close(plot.figure)


def make_page(data: ResultData, source: Path, drawn: list[Plot]) -> str:
    """The HTML of the page."""
    from kr5_tools.command_table import result_titles
    from kr5_tools.exports.page_items import page_items
    from kr5_tools.targets import detection_table

    views, columns = view_table(data, source)
    rows, figure_notes = shown_figures(data)
    figures, poses = split_figures(rows)
    drawn_on = any(v["thumbnail"] and v["thumbnail"]["drawn"] for v in views)
    return render_page(
        "report.html",
        brand="kr5 report",
        title=result_titles()[data["format"]],
        data=data,
        source=source.name,
        plots=[embed_plot(p) for p in drawn if p.name != "frames"],
        views=views,
        columns=columns,
        figures=figures,
        figure_notes=figure_notes,
        corrected=any(row.get("corrected") for row in figures),
        poses=poses,
        seen=detection_table.seen_table(data),
        seen_columns=detection_table.COLUMNS,
        drawn_on=drawn_on,
        held_out=[(HELD_OUT_NAMES.get(name, name), text) for name, text in flatten(data.get("held_out", {}))],
        input=flatten(data.get("input", {})),
        models=model_table(data),
        scene=script_json(frame_scene(data)),
        exports=page_items(data),
        icon=ICONS.get(data["verdict"]["word"], "") if data.get("verdict") else "",
        fit=data.get("result", {}).get("fit"),
    )


HAND_EYE_NOTE = (
    "The expected error is that of the calibration alone; errors in held-out views contain the noise of robot and"
    " camera in each view."
)
HELD_OUT_NAMES = {  # of kr5 calibrate kinematics; field_phrase sets units in brackets
    "placed_on_them": "device and measured point were placed on them",
    "nominal_mean_mm": "mean error of the nominal arm_mm",
    "mean_mm": "mean error_mm",
    "rms_mm": "RMS error_mm",
    "max_mm": "largest error_mm",
}


def shown_figures(data: ResultData) -> tuple[list[FigureData], list[str]]:
    """The figures of a page, and what is said below them."""
    if data["format"] == "kr5-kinematics/1":
        from kr5_tools.calibrate.kinematics_figures import figures_and_notes

        return cast("tuple[list[FigureData], list[str]]", figures_and_notes(data))
    judged = data["format"] == "kr5-hand-eye/1" and "held_out" in data
    return data.get("figures", []), [HAND_EYE_NOTE] if judged else []


ICONS = {"good": "✓", "doubtful": "!", "unusable": "✗"}  # beside the colour, for those who do not see it


def flatten(values: Mapping[str, object], prefix: str = "") -> list[tuple[str, str]]:
    """Nested values as pairs of name and text; long lists by their length."""
    out = []
    for key, value in values.items():
        name = f"{prefix}{key}"
        if isinstance(value, dict):
            out += flatten(value, f"{name}.")
        elif isinstance(value, bool):
            out.append((name, "yes" if value else "no"))
        elif isinstance(value, float):
            out.append((name, format_number(value)))
        elif isinstance(value, list) and (len(value) > 4 or any(isinstance(v, (list, dict)) for v in value)):
            out.append((name, f"{len(value)} entries"))
        elif isinstance(value, list):
            out.append((name, ", ".join(format_number(v) if isinstance(v, float) else str(v) for v in value)))
        elif value is not None:
            out.append((name, str(value)))
    return out


POSE = {"x": "mm", "y": "mm", "z": "mm", "roll": "deg", "pitch": "deg", "yaw": "deg"}


def split_figures(figures: list[FigureData]) -> tuple[list[FigureData], list[dict[str, Any]]]:
    """Figures one a row, and poses one a row where there are so many that six rows for each would hide the rest."""
    poses, rest, i = [], [], 0
    while i < len(figures):
        six = figures[i : i + 6]
        names = [str(f["name"]).rpartition(" ") for f in six]
        whole = [(n[2], f["unit"]) for n, f in zip(names, six)] == list(POSE.items()) and len(
            {n[0] for n in names}
        ) == 1
        if not whole or any(f.get("value") is None for f in six):
            rest.append(figures[i])
            i += 1
            continue
        std = [max((f.get("std") or 0.0 for f in part), default=0.0) for part in (six[:3], six[3:])]
        poses.append(
            {
                "name": names[0][0],
                "std": [format_number(s, s) for s in std],
                "cells": [format_number(f["value"], std[k // 3]) for k, f in enumerate(six)],
            }
        )
        i += 6
    return (rest, poses) if len(poses) > 2 else (figures, [])


def view_table(data: ResultData, source: Path) -> tuple[list[dict[str, Any]], list[str]]:
    """Rows of the table of views with thumbnails, and the headings of its columns."""
    views = data.get("views", [])
    used = [c for c in VIEW_COLUMNS if any(isinstance(v.get(c[0]), (int, float)) for v in views)]
    seen = seen_points(data)
    keep = {id(v) for v in sorted(views, key=lambda v: not v.get("outlier"))[:MOST_THUMBNAILS]}
    rows = []
    for view in views:
        cells = [
            f.format(factor * value) if isinstance(value := view.get(key), (int, float)) else "–"
            for key, _, factor, f in used
        ]
        rows.append(
            {
                "name": view["name"],
                "outlier": bool(view.get("outlier")),
                "reason": view.get("reason") or "",
                "cells": cells,
                "thumbnail": make_thumbnail(view, source, seen.get(view["name"], [])) if id(view) in keep else None,
            }
        )
    return rows, [heading for _, heading, _, _ in used]


def seen_points(data: ResultData) -> dict[Any, list[tuple[float, float]]]:
    """The points that were seen in each view [px]."""
    out: dict[Any, list[tuple[float, float]]] = {}
    for residual in data.get("residuals", ()):
        out.setdefault(residual.get("view"), []).extend(zip(residual["u"], residual["v"]))
    for finding in data.get("found", ()):
        u, v = finding["pixels"]
        out.setdefault(finding["view"], []).extend(zip(u, v))
    return out


def make_thumbnail(view: ViewData, source: Path, points: list[tuple[float, float]]) -> dict[str, Any] | None:
    """A small picture of the view, if its drawing or its image can still be found; an image has the points on it that
    were seen."""
    from PIL import Image

    named = [("drawing", view.get("drawing")), ("image", view.get("image"))]
    places = [(key, folder / name) for key, name in named if name for folder in (Path(), source.parent)]
    kind, file = next(((key, p) for key, p in places if p.is_file()), ("", None))
    if file is None:
        return None
    drawn = kind == "drawing"
    with contextlib.suppress(OSError), Image.open(file) as image:
        width, height = image.size
        small = image.convert("RGB" if drawn else "L")
        small.thumbnail((DRAWN, DRAWN) if drawn else (SMALL, SMALL))
        buffer = io.BytesIO()
        small.save(buffer, format="JPEG", quality=55)
        return {
            "src": "data:image/jpeg;base64," + base64.b64encode(buffer.getvalue()).decode(),
            "width": width,
            "height": height,
            "radius": round(width / 110),
            "drawn": drawn,
            "points": [] if drawn else [(round(u), round(v)) for u, v in points[:150]],
        }
    return None


def model_table(data: ResultData) -> list[dict[str, Any]]:
    """Camera models compared, best first."""
    from kr5_tools.calibrate.plots import model_name

    rows = data.get("result", {}).get("models") or []
    rows = sorted(rows, key=lambda m: m.get("held_out_rms") or math.inf)
    rows = [m for i, m in enumerate(rows) if i < 8 or m.get("chosen")]
    return [
        {
            "name": model_name(m),
            "parameters": m.get("parameters"),
            "chosen": bool(m.get("chosen")),
            "held_out": format_number(m.get("held_out_rms")),
            "fitted": format_number(m.get("fitted_rms")),
        }
        for m in rows
    ]


def frame_scene(data: ResultData) -> dict[str, Any] | None:
    """What the 3D view draws: frames in the root, lines to their parents, and the uncertainty of their place."""
    from kr5_tools.calibrate.plots import root_poses

    frames = data.get("frames")
    if not frames:
        return None
    poses = root_poses(frames)
    names, box = list(poses), board_box(data)
    out = []
    for frame in frames:
        kind = frame_kind(frame, data["format"])
        out.append(
            {
                "name": frame["name"],
                "T": poses[frame["name"]].round(6).tolist(),
                "kind": kind,
                "parent": names.index(parent)
                if (parent := frame.get("parent")) is not None and parent in poses
                else None,
                "box": box if kind in ("board", "boards") else marker_box(frame),
            }
        )
    return {"frames": out}


def board_box(data: ResultData) -> list[float] | None:
    """Lowest x, y and highest x, y of the board named in the input, in its own frame [m]."""
    board = data.get("input", {}).get("board") or data.get("input", {}).get("target")
    if not isinstance(board, str):
        return None
    import kr5.vision

    with contextlib.suppress(kr5.Error):
        return [float(v) for v in kr5.vision.printed_area(kr5.parse_target(board)).T.ravel()]
    return None


def marker_box(frame: FrameData) -> list[float] | None:
    """The same for one marker, whose frame lies in its middle."""
    size = frame.get("size")
    return [-size[0] / 2, -size[1] / 2, size[0] / 2, size[1] / 2] if size else None


# What a frame stands for, by words in its name. Stations, boards and poses are many, drawn small and without names.
KINDS = {
    "camera": ("camera",),
    "station": ("view", "station", ".png", ".jpg"),
    "pose": ("pose",),
    "board": ("target", "board"),
    "marker": ("marker", "tag"),
    "tool": ("tool", "tip"),
    "base": ("base", "world"),
    "flange": ("flange",),
}


def frame_kind(frame: FrameData, format: str) -> str:
    """What a frame stands for: said in the file, else guessed from its name."""
    if frame.get("kind"):
        return str(frame["kind"])
    if format == "kr5-camera/1" and frame.get("parent"):
        return "boards"
    name = frame["name"].lower()
    return next((kind for kind, words in KINDS.items() if any(word in name for word in words)), "frame")
