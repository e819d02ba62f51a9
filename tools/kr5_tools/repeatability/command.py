"""`kr5 repeatability`: pose repeatability and accuracy after ISO 9283, with confidence bounds."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import kr5.calibration
import numpy as np
import typer
from kr5 import calibration
from kr5.files.results import write_result
from kr5.files.writing import check_writable, write_json
from kr5.tables.options import TableOptions

from kr5_tools.calibrate.plot_files import write_plots
from kr5_tools.cli.arguments import JsonOption, PngOption, ResultOption
from kr5_tools.cli.numbers import format_count, format_range
from kr5_tools.cli.options import options_from
from kr5_tools.cli.table_options import ColumnsOption, Convention, PoseAngle, PoseLength, tell_notes
from kr5_tools.cli.tables import figure_row, make_table, print_result
from kr5_tools.cli.terminal import Console, console, fail, spinner
from kr5_tools.repeatability.returns import read_commanded, read_returns, see_returns

app = typer.Typer()
STANDARD = 30  # returns of each point that ISO 9283 asks for
COARSE = 0.01  # a repeatability beyond it is no arm's [m]
CHANCE = 1e-9  # a probability below it is not told
DEG = 180 / np.pi


@app.command(epilog="Example:  kr5 repeatability returns.csv --commanded commanded.csv -o repeatability.json")
@options_from(calibration.RepeatabilityOptions, skip=("seed",))
def repeatability(
    returns: Annotated[
        Path,
        typer.Argument(
            metavar="RETURNS",
            help=(
                "Table of measured poses with the point each belongs to (point, x, y, z, orientation; commanded_x … for"
                " accuracy), in the order of the test; or a folder with a folder of images of a target for each point."
            ),
        ),
    ],
    options: calibration.RepeatabilityOptions,
    commanded: Annotated[
        Path | None, typer.Option(help="Table of the commanded poses, one a point, in the frame of the measured ones.")
    ] = None,
    point: Annotated[str | None, typer.Option(help="Column that names the point; by default point.")] = None,
    columns: ColumnsOption = None,
    convention: Convention = None,
    length: PoseLength = None,
    angle: PoseAngle = None,
    target: Annotated[str | None, typer.Option(help="Images: the target, e.g. grid:36h11:5x7:0.03:0.01.")] = None,
    camera: Annotated[Path | None, typer.Option(help="Images: camera file.")] = None,
    hand_eye: Annotated[
        Path | None,
        typer.Option(help="Images: result of kr5 calibrate hand-eye; without, the camera itself is measured."),
    ] = None,
    output: ResultOption = None,
    png: PngOption = None,
    json_file: JsonOption = None,
) -> None:
    """Pose repeatability and accuracy after ISO 9283 of every point and of all together, with confidence bounds.

    Repeatability is the mean plus three standard deviations: RP of the position, RR of the rotation angle; RR_a, RR_b,
    RR_c are three standard deviations of the angles about Z, Y and X. Accuracy is the mean less the commanded pose: AP
    of the position, AP_a, AP_b, AP_c of the same angles.

    Exit code: 0 when there is a result, 2 when there is none or the input is invalid.
    """
    options.validate()
    wanted = TableOptions(columns, convention=convention, length=length, angle=angle, point=point)
    commands: list[Any] = []
    if returns.is_dir():
        check_writable(output, json_file, inputs=[returns, commanded, camera, hand_eye])
        if not (target and camera):
            fail(f"{returns}: is a folder of images, for which --target and --camera are needed")
        measured = see_returns(returns, target, camera, hand_eye)
    else:
        check_writable(output, json_file, inputs=[returns, commanded])
        if given := [f for f, v in (("--target", target), ("--camera", camera), ("--hand-eye", hand_eye)) if v]:
            fail(f"{', '.join(given)}: only with a folder of images")
        measured, commands = read_returns(returns, wanted)
    if commanded:
        commands = read_commanded(commanded, wanted)
    tell_notes(wanted.notes)
    with spinner("Simulating tests for the bounds"):
        result = calibration.measure_repeatability(measured, commands, options)
    keys = _keys(result, measured, options)
    keys["input"] = {
        "returns": str(returns),
        **({"commanded": str(commanded)} if commanded else {}),
        "points": len(result.points),
        "count": len(measured),
    }
    out = console(json_file)
    _show(result, keys, out)
    data = write_result(output, "kr5-repeatability/1", **keys)
    for file in write_plots(data, png):
        out.print(f"plot: {file}", soft_wrap=True)
    write_json(data, json_file)


def _bounded(name: str, figure: calibration.BoundedFigure, scale: float, unit: str) -> dict[str, Any]:
    row = figure_row(f"{name} (bounds {_interval(figure, scale)})", scale * figure.value, None, unit)
    return row | {"low": scale * figure.low, "high": scale * figure.high}


def _interval(figure: calibration.BoundedFigure, scale: float) -> str:
    return format_range(scale * figure.low, scale * figure.high)


def _figures(result: kr5.calibration.RepeatabilityResult) -> list[dict[str, Any]]:
    many = len(result.points) > 1
    rows = []
    for p in [*([result.overall] if many else []), *result.points]:
        where = p.point or "all points"
        rows.append(_bounded(f"RP, {where}", p.RP, 1e3, "mm"))
        rows.append(_bounded(f"RR, {where}", p.RR, DEG, "deg"))
        rows += [_bounded(f"RR_{a}, {where}, ±", getattr(p, f"RR_{a.upper()}"), DEG, "deg") for a in "abc"]
        if p.AP is not None:
            rows.append(_bounded(f"AP, {where}", p.AP, 1e3, "mm"))
        rows += [figure_row(f"AP_{a}, {where}", v, None, "deg") for a, v in zip("abc", _turns(p), strict=False)]
    return rows


def _turns(p: calibration.PointRepeatability) -> list[float]:
    """AP_a, AP_b, AP_c of a point; none without a commanded pose [deg]."""
    return [DEG * float(v) for v in p.offset[3:]]


def _causes(
    result: kr5.calibration.RepeatabilityResult, measured: list[calibration.PoseReturn]
) -> list[dict[str, str]]:
    mixed = [s for s in result.outliers if s.belongs_to]
    alone = [s for s in result.outliers if not s.belongs_to]
    few = next((p for p in result.points if p.returns < STANDARD), None)
    coarse = result.overall.RP.value > COARSE and not mixed
    found = [
        _mixed_up(mixed, measured) if mixed else None,
        _contradicting(alone, measured) if alone else None,
        _drifting(result.drift) if result.drift.significant else None,
        _few_returns(few) if few else None,
        _wrong_unit(result.overall.RP.value) if coarse else None,
    ]
    return [cause for cause in found if cause]


def _mixed_up(returns: list[calibration.SuspectReturn], measured: list[calibration.PoseReturn]) -> dict[str, str]:
    listed = ", ".join(f"{measured[s.index].name} (is at {s.belongs_to})" for s in returns[:8])
    count = format_count(len(returns), "return", ("carries", "carry"))
    return {
        "cause": "points_mixed_up",
        "text": f"{count} the name of the wrong point: {listed}.",
        "remedy": "Correct the names of the points.",
    }


def _contradicting(returns: list[calibration.SuspectReturn], measured: list[calibration.PoseReturn]) -> dict[str, str]:
    listed = ", ".join(f"{measured[s.index].name} ({1e3 * s.distance:.3g} mm off)" for s in returns[:8])
    count = format_count(len(returns), "return", ("contradicts", "contradict"))
    return {
        "cause": "outlier_returns",
        "text": f"{count} the others of the same point: {listed}.",
        "remedy": (
            "Check these measurements; where the measurement failed and not the arm, leave them out"
            " (--leave-out-outliers)."
        ),
    }


def _drifting(drift: calibration.ReturnDrift) -> dict[str, str]:
    motion = np.asarray(drift.motion)
    x, y, z = 1e3 * motion[:3]
    chance = f"{drift.probability:.1g}" if drift.probability > CHANCE else f"below {CHANCE:g}"
    return {
        "cause": "drift",
        "text": (
            f"The poses drift from the first return to the last: x {x:.3g}, y {y:.3g}, z {z:.3g} mm,"
            f" {DEG * np.linalg.norm(motion[3:]):.3g} deg (probability {chance} by chance)."
        ),
        "remedy": "Warm the arm up before the test, and check the mount of the measuring device.",
    }


def _few_returns(point: calibration.PointRepeatability) -> dict[str, str]:
    return {
        "cause": "few_returns",
        "text": f"{point.point} has {point.returns} returns; ISO 9283 asks for {STANDARD} of each point.",
        "remedy": "Measure more returns; the bounds show what these few determine.",
    }


def _wrong_unit(repeatability: float) -> dict[str, str]:
    return {
        "cause": "unit",
        "text": f"A repeatability of {1e3 * repeatability:.3g} mm is not that of an arm.",
        "remedy": "Check the unit of the positions (--length-unit) and the names of the points.",
    }


def _keys(
    result: kr5.calibration.RepeatabilityResult,
    measured: list[calibration.PoseReturn],
    options: calibration.RepeatabilityOptions,
) -> dict[str, Any]:
    means = {p.point: np.asarray(p.T_mean) for p in result.points}
    suspect = {s.index for s in result.outliers}
    shown = []
    for i, r in enumerate(measured):
        T = np.asarray(r.T)
        d = T[:3, 3] - means[r.point][:3, 3]
        shown.append({"point": r.point, "name": r.name, "deviation": d, "outlier": i in suspect})
    views = [
        {"name": measured[s.index].name, "position_error": s.distance, "robot_rotation": s.angle, "outlier": True}
        for s in result.outliers
    ]
    causes = _causes(result, measured)
    frames = [{"name": "measurement", "parent": None, "T": np.eye(4)}]
    frames += [{"name": f"point {p.point}", "parent": "measurement", "T": p.T_mean} for p in result.points]
    return {
        "verdict": _verdict(result, causes, options),
        "causes": causes,
        "figures": _figures(result),
        "views": views,
        "frames": frames,
        "returns": shown,
        "result": result.to_dict(),
    }


def _verdict(
    result: kr5.calibration.RepeatabilityResult, causes: list[dict[str, str]], options: calibration.RepeatabilityOptions
) -> dict[str, str]:
    share = f"{100 * options.confidence:g} %"
    everything = result.overall if len(result.points) > 1 else result.points[0]
    worst = max(result.points, key=lambda p: p.RP.value)
    text = f"RP {1e3 * everything.RP.value:.3g} mm ({share}: {_interval(everything.RP, 1e3)} mm)"
    if len(result.points) > 1:
        text += f", at worst {1e3 * worst.RP.value:.3g} mm at {worst.point}"
    text += f"; RR {DEG * everything.RR.value:.3g} deg ({share}: {_interval(everything.RR, DEG)} deg)"
    accurate = [(p.AP.value, p.point) for p in result.points if p.AP is not None]
    if accurate:
        far, point = max(accurate, key=lambda pair: pair[0])
        text += f"; AP at worst {1e3 * far:.3g} mm at {point}"
    if options.leave_out_outliers and result.outliers:
        text += f"; without {len(result.outliers)} outliers"
    serious = [c for c in causes if c["cause"] != "few_returns"]
    return {"word": "doubtful" if serious else "good", "text": text + "."}


def _show(result: kr5.calibration.RepeatabilityResult, data: Mapping[str, object], out: Console) -> None:
    print_result({**data, "figures": []}, out)
    positions, angles = [], []
    for p in [*result.points, *([result.overall] if len(result.points) > 1 else [])]:
        name = p.point or "all"
        accuracy = "–" if p.AP is None else f"{1e3 * p.AP.value:.3g}"
        positions.append([name, p.returns, *(f"{1e3 * v:.3g}" for v in (p.RP.value, p.RP.low, p.RP.high)), accuracy])
        turned = [f"{v:.3g}" for v in _turns(p)] or ["–"] * 3
        shown = [p.RR.value, p.RR.low, p.RR.high, *(getattr(p, f"RR_{a}").value for a in "ABC")]
        angles.append([name, *(f"{DEG * v:.3g}" for v in shown), *turned])
    out.print()
    out.print(make_table("Position [mm]", ["point", "returns", "RP", "low", "high", "AP"], positions))
    names = ["point", "RR", "low", "high", *(f"RR_{a} ±" for a in "abc"), *(f"AP_{a}" for a in "abc")]
    out.print()
    out.print(make_table("Orientation [deg]", names, angles))
