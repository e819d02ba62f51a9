"""`kr5 calibrate timed`: hand-eye and the offset between two clocks, from time-stamped pose streams."""

from pathlib import Path
from typing import Annotated, Any, cast

import kr5.calibration
import numpy as np
import typer
from kr5 import calibration
from kr5.files import writing
from kr5.files.result_types import ResultData
from kr5.files.results import write_if_usable, write_result
from kr5.tables.options import TableOptions
from kr5.tables.roles import TIME, PoseRole

from kr5_tools.cli.arguments import JsonOption, ResultOption
from kr5_tools.cli.cell_output import CellOption, WriteCellOption, load_target_cell, put_camera_pose, write_cell_file
from kr5_tools.cli.options import options_from
from kr5_tools.cli.table_options import ColumnsOption, Convention, PoseAngle, PoseLength, tell_notes
from kr5_tools.cli.tables import figure_row, pose_figures, print_result
from kr5_tools.cli.terminal import console, fail, spinner
from kr5_tools.exports.command_line import Exports, export_options

app = typer.Typer()
SLOWEST = 10.0  # [s] between rows; slower streams show no motion to compare
LONGEST = 1e5  # [s] of a recording: a day and a bit


@app.command(epilog="Example:  kr5 calibrate timed hand.csv camera.csv -o timed.json --png alignment.png")
@options_from(calibration.TimedHandEyeOptions)
@export_options("poses")
def timed(
    hand: Annotated[
        Path,
        typer.Argument(help="Table of the hand in the base: t, x, y, z and an orientation, such as qx, qy, qz, qw."),
    ],
    camera: Annotated[Path, typer.Argument(help="Table of the camera in the frame of the target, in the same form.")],
    options: calibration.TimedHandEyeOptions,
    exports: Exports,
    columns: ColumnsOption = None,
    convention: Convention = None,
    length: PoseLength = None,
    angle: PoseAngle = None,
    output: ResultOption = None,
    json_file: JsonOption = None,
    cell_file: CellOption = None,
    write_cell: WriteCellOption = None,
    png: Annotated[Path | None, typer.Option(help="Plot of the angular speeds before and after alignment.")] = None,
) -> None:
    """Hand-eye calibration from two pose streams with separate clocks: t_camera = t_hand + offset, and the pose of the
    camera on the hand.
    """
    options.validate()
    writing.check_writable(output, json_file, png, write_cell, *exports.files, inputs=[hand, camera, cell_file])
    believed = load_target_cell(cell_file, write_cell)
    wanted = TableOptions(columns, convention=convention, length=length, angle=angle)
    streams = load_stream(hand, wanted), load_stream(camera, wanted)
    tell_notes(wanted.notes)
    with spinner("Aligning the streams"):
        result = calibration.calibrate_timed_hand_eye(*streams, options)
    data = write_result(None, "kr5-timed-hand-eye/1", **_keys(result, hand, camera))
    out = console(json_file)
    print_result(data, out)
    write_if_usable(data, result.fit, output, json_file)
    exports.write(data, out)
    if believed:
        put_camera_pose(believed, "eye_in_hand", np.array(result.T_hand_camera))
        write_cell_file(believed, write_cell)
    if png is not None:
        from kr5_tools.calibrate.plots import alignment_plot
        from kr5_tools.pages.plot_style import STYLE, plt

        with plt.rc_context(STYLE):
            drawn = alignment_plot(cast(ResultData, data))
            if drawn is not None:
                writing.save_figure(drawn, png, dpi=150)
                plt.close(drawn)


def load_stream(file: Path, wanted: TableOptions | None = None) -> Any:
    """A pose stream; the order of a quaternion is that of the column names."""
    table = (wanted or TableOptions()).read(file, [TIME, PoseRole(strict=False)])
    check_stamps(file, table["t"])
    return calibration.PoseStream(t=list(table["t"]), poses=table.poses["pose"])


def check_stamps(file: Path, t: np.ndarray) -> None:
    """Complains of times that are no seconds of one recording: the streams are compared on even steps over the
    whole of it.
    """
    steps = np.diff(t)
    if not np.isfinite(t).all():
        fail(
            f"{file}: row {np.flatnonzero(~np.isfinite(t))[0] + 1}: t: found {t[~np.isfinite(t)][0]}, expected seconds"
        )
    if not len(steps):
        return
    step, widest = float(np.median(steps)), int(np.argmax(np.abs(steps)))
    if step > SLOWEST:
        fail(
            f"{file}: t: found a row every {step:.4g}, expected seconds and at least one row in {SLOWEST:g} s: "
            "are these "
            "milliseconds, microseconds or nanoseconds? Divide them"
        )
    if np.ptp(t) > LONGEST:
        fail(
            f"{file}: row {widest + 2}: t: found {t[widest + 1]:.9g} s after {t[widest]:.9g} s, in a stream of "
            f"{np.ptp(t):.4g} s; "
            f"expected one recording of at most {LONGEST:g} s: delete the rows before or after"
        )


def _keys(result: kr5.calibration.TimedHandEyeResult, hand: Path, camera: Path) -> dict[str, Any]:
    keys = {
        "input": {"hand": str(hand), "camera": str(camera)},
        "verdict": _verdict(result),
        "result": result.to_dict(),
    }
    if not result.fit.usable:
        causes = [{"cause": result.cause, "text": result.fit.message}] if result.cause else []
        return {**keys, "causes": causes}
    a, start = result.alignment, result.alignment.t_hand[0]
    alignment = {
        "t_robot": np.array(a.t_hand) - start,
        "robot": a.hand,
        "t_camera": np.array(a.t_camera) - start,
        "camera": a.camera,
        "offset": result.offset,
        "label": "angular speed [rad/s]",
    }
    figures = [
        figure_row("clock offset (camera less hand)", 1e3 * result.offset, 1e3 * result.offset_std, "ms"),
        *pose_figures("camera on hand,", result.T_hand_camera, result.covariance),
        *pose_figures("world in base,", result.T_base_world, result.covariance_world),
        figure_row("spread of the world, median", 1e3 * result.spread_median, None, "mm"),
        figure_row("spread of the world, RMS", 1e3 * result.spread_rms, None, "mm"),
    ]
    frames = [
        {"name": "hand", "parent": None, "T": np.eye(4)},
        {"name": "camera", "parent": "hand", "T": result.T_hand_camera},
    ]
    return {**keys, "figures": figures, "frames": frames, "alignment": alignment}


def _verdict(result: kr5.calibration.TimedHandEyeResult) -> dict[str, str]:
    if not result.fit.usable:
        return {"word": "unusable", "text": result.fit.message}
    position = 1e3 * float(np.sqrt(np.trace(result.covariance[:3, :3])))
    text = (
        f"offset {1e3 * result.offset:.2f} ± {1e3 * result.offset_std:.2f} ms, camera on the hand known to"
        f" {position:.1f} mm (one standard deviation)"
    )
    doubtful = str(result.fit.status) != "converged" or position > 10 or result.outliers > 0.2 * result.used
    return {"word": "doubtful" if doubtful else "good", "text": text}
