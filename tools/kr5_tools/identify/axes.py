"""`kr5 identify axes`: joint axes and Denavit-Hartenberg parameters from joints moved one at a time, without nominal
values."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import kr5.cell
import numpy as np
import typer
from kr5 import calibration, kinematics
from kr5.cell import load_cell
from kr5.files.results import write_result
from kr5.files.writing import check_writable, write_json
from kr5.tables.options import TableOptions
from kr5.tables.roles import joints_role

from kr5_tools.calibrate.postures import POINTS, POSE, measured
from kr5_tools.cli.arguments import JsonOption, ResultOption
from kr5_tools.cli.options import options_from
from kr5_tools.cli.table_options import (
    AngleUnit,
    ColumnsOption,
    Convention,
    JointColumns,
    LengthUnit,
    PositionColumns,
    tell_notes,
)
from kr5_tools.cli.tables import figure_row, make_table, print_result
from kr5_tools.cli.terminal import Console, console, fail, spinner
from kr5_tools.identify.axis_chain import chain_of
from kr5_tools.identify.image_turns import Mount, image_turn
from kr5_tools.identify.turn_checks import (
    home_point_warnings,
    length_warnings,
    near_parallel,
    nominal_warnings,
    shift_warnings,
    uneven_warnings,
)

app = typer.Typer()
STANDING = 1e-3  # a joint that moves by less stands still [rad]
DRAWS = 400  # of the axes, for the uncertainty of the parameters
MOST_NAMED = 12  # rows of a finding
PARAMETERS = (
    *(("b", 1e3, "mm"), ("a", 1e3, "mm")),
    *((name, 180 / np.pi, "deg") for name in ("alpha", "beta", "theta_offset")),
)


@app.command(epilog="Example:  kr5 identify axes turns.csv -o axes.json")
@options_from(calibration.JointAxisOptions)
def axes(
    files: Annotated[
        list[Path],
        typer.Argument(
            help=(
                "One table with joint values (q1, q2, …) and what was measured, in which one joint after the other"
                " moves and the others stand; or one table a joint, from the base, of what was measured while it moved;"
                " or one folder of images a joint, with --camera and --target."
            )
        ),
    ],
    options: calibration.JointAxisOptions,
    camera: Annotated[Path | None, typer.Option(help="Camera file, for folders of images.")] = None,
    target: Annotated[
        str | None,
        typer.Option(help="Target in the images, such as map.json of kr5 calibrate map, or grid:36h11:5x7:0.03:0.01."),
    ] = None,
    mount: Annotated[
        Mount,
        typer.Option(help="Camera on the arm before a fixed target, or fixed camera before a target on the arm."),
    ] = "eye_in_hand",
    upright: Annotated[
        Path | None,
        typer.Option(
            help=(
                "Table, or folder of images, in which joint 6 turns with the forearm along axis 1; in FILES it stands"
                " across. Lengths then also follow from distances of parallel axes."
            )
        ),
    ] = None,
    cell: Annotated[
        Path | None,
        typer.Option(help="Cell of this arm, only to detect mirrored and scaled measurements; nothing is fitted."),
    ] = None,
    columns: ColumnsOption = None,
    joints: JointColumns = None,
    position: PositionColumns = None,
    convention: Convention = None,
    length: LengthUnit = None,
    angle: AngleUnit = None,
    output: ResultOption = None,
    json_file: JsonOption = None,
) -> None:
    """Circle-point analysis: each joint's axis from the arc it traces, with its quality and uncertainty, and the DH
    parameters of the arm by dual vectors, parallel and intersecting axes included. No nominal values are needed.

    Exit code: 0 when every axis was found, 2 when one was not or the input is invalid.
    """
    options.validate()
    check_writable(output, json_file, inputs=[f for f in (*files, camera, upright, cell) if f])
    wanted = TableOptions(columns, joints, position, convention, length, angle)
    turns = _image_turns(files, camera, target, mount) if files[0].is_dir() else _turns(files, wanted)
    tell_notes(wanted.notes)
    results = []
    with spinner("Identifying the axes"):
        for k, samples in enumerate(turns.samples):
            result = calibration.identify_joint_axis(samples, options)
            if not result.fit.usable:
                fail(f"joint {k + 1}{_where(turns.labels[k])}: {result.fit.message}")
            results.append(result)
    nominal = load_cell(cell).nominal_chain() if cell else None
    keys = _keys(files, turns, results, nominal)
    if upright:
        _add_lengths(keys, results, _upright_axis(upright, wanted, camera, target, mount, options))
    _show(results, keys, console(json_file))
    data = write_result(output, "kr5-axes/1", **keys)
    write_json(data, json_file)


@dataclass
class Turns:
    """Samples of each joint, what each is called in the input, and the joint values at which the others stood."""

    home: np.ndarray
    samples: list[list[Any]] = field(default_factory=list)
    labels: list[list[str]] = field(default_factory=list)


def _where(labels: list[str]) -> str:
    return f" ({labels[0]} to {labels[-1]})" if labels else ""


def _image_turns(folders: list[Path], camera: Path | None, target: str | None, mount: str) -> Turns:
    out = Turns(np.zeros(len(folders)))
    for folder in folders:
        samples, labels = image_turn(folder, camera, target, mount)
        out.samples.append(samples)
        out.labels.append(labels)
    return out


def _table_turn(file: Path, wanted: TableOptions) -> tuple[list[Any], list[str]]:
    """Samples of a table in which one joint turns, with its joint value where there is one that varies alone."""
    table = wanted.read(file, [POSE, POINTS])
    rows = measured(table)
    labels = [f"{file.name} {table.row(i)}" for i in range(len(rows))]
    return [calibration.JointSample(**row) for row in rows], labels


def _turns(files: list[Path], wanted: TableOptions) -> Turns:
    if len(files) > 1:
        out = Turns(np.zeros(len(files)))
        for one in files:
            samples, labels = _table_turn(one, wanted)
            out.samples.append(samples)
            out.labels.append(labels)
        return out
    file = files[0]
    table = wanted.read(file, [joints_role(), POSE, POINTS])
    q = table["q"]
    home = np.array([_commonest(column) for column in q.T])
    away = np.abs(q - home) > STANDING
    if (several := np.flatnonzero(away.sum(axis=1) > 1)).size:
        moved = ", ".join(f"q{k + 1}" for k in np.flatnonzero(away[several[0]]))
        further = f" (and {_listed([table.row(i) for i in several[1:]])} likewise)" if len(several) > 1 else ""
        fail(
            f"{file}: {table.row(several[0])}: {moved} are away from where they usually stand{further}; move one joint"
            " at a time"
        )
    seen = measured(table)
    turns = Turns(home)
    for k in range(q.shape[1]):
        # Rows with every joint at home belong to each joint.
        rows = np.flatnonzero(~np.delete(away, k, axis=1).any(axis=1))
        if not away[:, k].any():
            fail(f"{file}: joint {k + 1} did not move")
        turns.samples.append([calibration.JointSample(q=float(q[i, k]), **seen[i]) for i in rows])
        turns.labels.append([table.row(int(i)) for i in rows])
    return turns


def _listed(names: list[str]) -> str:
    """Names with commas; of many, the first."""
    shown = ", ".join(names[:MOST_NAMED])
    return f"{shown} and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else shown


def _upright_axis(
    source: Path,
    wanted: TableOptions,
    camera: Path | None,
    target: str | None,
    mount: str,
    options: calibration.JointAxisOptions,
) -> calibration.JointAxisResult:
    """Axis 6 with the forearm upright."""
    samples, labels = image_turn(source, camera, target, mount) if source.is_dir() else _table_turn(source, wanted)
    result = calibration.identify_joint_axis(samples, options)
    if not result.fit.usable:
        fail(f"{source}: joint 6{_where(labels)}: {result.fit.message}")
    return result


def _add_lengths(
    keys: dict[str, Any], results: list[calibration.JointAxisResult], sixth_upright: calibration.JointAxisResult
) -> None:
    """Lengths from distances of parallel axes, beside those from the common normals."""
    if len(results) != 6:
        fail(f"--upright: the arm has {len(results)} joints; the distances of parallel axes are those of six")
    arm = kinematics.DhChain.from_dict(keys["result"]["arm"])
    tolerance = max(0.01, 3 * max(float(np.sqrt(np.trace(r.covariance[2:, 2:]))) for r in results))
    if objection := calibration.parallel_plane_objection(arm, tolerance):
        fail(f"--upright: the distances of parallel axes do not determine the lengths of this arm: {objection}")
    one, two, three, _, five, six = results
    distances = calibration.parallel_plane_distances(
        calibration.ParallelPlaneAxes(
            axis1=one, axis2=two, axis3=three, axis5=five, axis6=six, axis6_upright=sixth_upright
        )
    )
    lengths = calibration.lengths_from_parallel_planes(distances)
    if not lengths.fit.usable:
        fail(f"--upright: {lengths.fit.message}")
    spread = 1e3 * np.sqrt(np.diag(lengths.covariance))
    for k, name in enumerate(("a1", "a2", "a3", "b4")):
        label = f"{name}, by parallel planes"
        keys["figures"].append(figure_row(label, 1e3 * getattr(lengths, name), float(spread[k]), "mm"))
    keys["result"] |= {"parallel_planes": lengths.to_dict(), "axis_distances": distances.to_dict()}


def _commonest(column: np.ndarray) -> float:
    """Where a joint stands most often: the value with the most others within STANDING."""
    near = [(np.abs(column - value) <= STANDING).sum() for value in column]
    return float(column[int(np.argmax(near))])


def _drawn(result: calibration.JointAxisResult, random: np.random.Generator) -> kinematics.AxisLine:
    """An axis as it may be, by its covariance."""
    x, y, rx, ry = random.multivariate_normal(np.zeros(4), result.covariance)
    T = np.asarray(result.T_world_axis)
    direction = T[:3, :3] @ [np.sin(ry), -np.sin(rx), 1.0]
    return kinematics.AxisLine(
        point=T[:3, 3] + T[:3, :3] @ [x, y, 0.0], direction=direction / np.linalg.norm(direction)
    )


def _keys(
    files: list[Path], turns: Turns, results: list[calibration.JointAxisResult], nominal: kr5.kinematics.DhChain | None
) -> dict[str, Any]:
    home = turns.home
    first = turns.samples[-1][0]
    end = first.T_world_tool[:3, 3] if first.T_world_tool is not None else first.points[:, 0]
    chain = chain_of([r.axis for r in results], home, end)
    random = np.random.default_rng(1)
    draws = [chain_of([_drawn(r, random) for r in results], home, end) for _ in range(DRAWS)]
    figures = []
    for k, joint in enumerate(chain.joints[:-1]):  # the last row ends in whatever was measured
        for name, scale, unit in PARAMETERS:
            if k == 0 and name in ("b", "theta_offset"):
                continue  # where the first frame lies along and about axis 1 is a matter of choice
            if name == ("b" if near_parallel(joint) else "beta"):
                continue  # beside near-parallel axes b is a matter of choice, and beta takes its place
            spread = np.array([getattr(d.joints[k], name) for d in draws]) - getattr(joint, name)
            if unit == "deg":
                spread = (spread + np.pi) % (2 * np.pi) - np.pi
            figures.append(
                figure_row(f"joint{k + 1}.{name}", scale * getattr(joint, name), scale * float(spread.std()), unit)
            )
    warnings = [f"joint {k + 1}: {text}" for k, r in enumerate(results) for text in r.warnings]
    for k, r in enumerate(results):
        if r.outliers:
            names = _listed([turns.labels[k][i] for i in r.outliers])
            warnings.append(f"joint {k + 1}: left out because they contradict the others: {names}")
    warnings += shift_warnings(turns.labels, results)
    warnings += uneven_warnings(turns.samples, turns.labels, results)
    warnings += home_point_warnings(turns.samples, turns.labels, results, home)
    warnings += length_warnings(chain)
    if nominal is not None:
        warnings += nominal_warnings(chain, nominal, home)
    worst = min(range(len(results)), key=lambda k: results[k].quality)
    text = (
        f"{len(results)} axes; the least certain is that of joint {worst + 1}, whose singular values are"
        f" {results[worst].quality:.0f} to 1"
    )
    frames = [{"name": "device", "parent": None, "T": np.eye(4)}]
    frames += [{"name": f"axis {k + 1}", "parent": "device", "T": r.T_world_axis} for k, r in enumerate(results)]
    return {
        "input": {"files": [str(f) for f in files]},
        "verdict": {"word": "doubtful" if warnings else "good", "text": "; ".join([text, *warnings])},
        "figures": figures,
        "frames": frames,
        "result": {"axes": [r.to_dict() for r in results], "arm": chain.to_dict(), "home": home},
    }


def _show(results: list[calibration.JointAxisResult], data: dict[str, Any], out: Console) -> None:
    print_result(data, out)
    rows = []
    for k, r in enumerate(results):
        tilt = 180 / np.pi * float(np.sqrt(np.trace(r.covariance[2:, 2:])))
        offset = 1e3 * float(np.sqrt(np.trace(r.covariance[:2, :2])))
        rows.append([f"{k + 1}", f"{r.quality:.0f}", 180 / np.pi * r.arc, 1e3 * r.rms, offset, tilt, len(r.outliers)])
    names = ["joint", "s1/s3 [-]", "arc [deg]", "RMS [mm]", "± offset [mm]", "± tilt [deg]", "outliers"]
    out.print()
    out.print(make_table("Axes", names, rows))
