"""`kr5 calibrate timed`: hand-eye and the offset between two clocks, from time-stamped pose streams."""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from kr5 import calibration, io

from .common import Json, Output, console, fail, figure, keep, pose_figures, show_result, working, write_result
from .options import options_from

app = typer.Typer()
COLUMNS = ("t", "x", "y", "z", "qx", "qy", "qz", "qw")


@app.command(epilog="Example:  kr5 calibrate timed hand.csv camera.csv -o timed.json --png alignment.png")
@options_from(calibration.TimedHandEyeOptions)
def timed(
    hand: Annotated[Path, typer.Argument(help="CSV of the hand in the base: t, x, y, z, qx, qy, qz, qw (s, m).")],
    camera: Annotated[Path, typer.Argument(help="CSV of the camera in the world of the target, same columns.")],
    options: calibration.TimedHandEyeOptions,
    output: Output = None,
    json_file: Json = None,
    png: Annotated[Path | None, typer.Option(help="Draw the speeds of turning, before and after.")] = None,
) -> None:
    """Finds t_camera = t_hand + offset together with the camera's place on the hand."""
    options.validate()
    streams = load_stream(hand), load_stream(camera)
    with working("Aligning the streams"):
        result = calibration.calibrate_timed_hand_eye(*streams, options)
    data = write_result(None, "kr5-timed-hand-eye/1", **_keys(result, hand, camera))
    show_result(data, console(json_file))
    keep(data, result.fit, output, json_file)
    if png is not None:
        from .plot_style import STYLE, plt
        from .plots import alignment

        with plt.rc_context(STYLE):
            drawn = alignment(data)
            drawn.savefig(png, dpi=150)
            plt.close(drawn)


def load_stream(file: Path) -> Any:
    """A pose stream; the order of the quaternion is that of the column names."""
    csv = io.load_csv(file)
    columns = list(csv.columns)
    if missing := [c for c in COLUMNS if c not in columns]:
        fail(f"{file}: found the columns {', '.join(columns)}, expected {', '.join(COLUMNS)}; missing: {', '.join(missing)}")
    rows = np.asarray(csv.values)[:, [columns.index(c) for c in COLUMNS]]
    norm = np.linalg.norm(rows[:, 4:], axis=1)
    if (bad := np.flatnonzero(np.abs(norm - 1) > 0.02)).size:
        fail(f"{file}: row {bad[0] + 1}: qx qy qz qw: found length {norm[bad[0]]:.4g}, expected 1: are these quaternions, "
             "and are the columns named in their order?")
    return calibration.PoseStream(t=list(rows[:, 0]), poses=calibration.to_poses(rows[:, 1:], calibration.PoseFormat()))


def _keys(result: Any, hand: Path, camera: Path) -> dict[str, Any]:
    keys = {"input": {"hand": str(hand), "camera": str(camera)}, "verdict": _verdict(result), "result": result.to_dict()}
    if not result.fit.usable:
        causes = [{"cause": result.cause, "text": result.fit.message}] if result.cause else []
        return {**keys, "causes": causes}
    a, start = result.alignment, result.alignment.t_hand[0]
    alignment = {"t_robot": np.array(a.t_hand) - start, "robot": a.hand, "t_camera": np.array(a.t_camera) - start,
                 "camera": a.camera, "offset": result.offset, "label": "speed of turning [rad/s]"}
    figures = [
        figure("clock offset (camera less hand)", 1e3 * result.offset, 1e3 * result.offset_std, "ms"),
        *pose_figures("camera on hand,", result.T_hand_camera, result.covariance),
        *pose_figures("world in base,", result.T_base_world, result.covariance_world),
        figure("spread of the world, median", 1e3 * result.spread_median, None, "mm"),
        figure("spread of the world, RMS", 1e3 * result.spread_rms, None, "mm"),
    ]
    frames = [{"name": "hand", "parent": None, "T": np.eye(4)}, {"name": "camera", "parent": "hand", "T": result.T_hand_camera}]
    return {**keys, "figures": figures, "frames": frames, "alignment": alignment}


def _verdict(result: Any) -> dict[str, str]:
    if not result.fit.usable:
        return {"word": "unusable", "text": result.fit.message}
    position = 1e3 * float(np.sqrt(np.trace(result.covariance[:3, :3])))
    text = (f"offset {1e3 * result.offset:.2f} ± {1e3 * result.offset_std:.2f} ms, camera on the hand known to {position:.1f} mm "
            "(one standard deviation)")
    doubtful = str(result.fit.status) != "converged" or position > 10 or result.outliers > 0.2 * result.used
    return {"word": "doubtful" if doubtful else "good", "text": text}
