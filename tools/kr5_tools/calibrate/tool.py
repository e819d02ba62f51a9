"""`kr5 calibrate tool`: where the tool tip sits on the flange, from touches of one fixed point."""

from pathlib import Path
from typing import Annotated, Any

import kr5.calibration
import numpy as np
import typer
from kr5 import calibration
from kr5.files.results import write_if_usable, write_result
from kr5.files.writing import check_writable
from kr5.tables.options import TableOptions

from kr5_tools.cli.arguments import JsonOption, ResultOption
from kr5_tools.cli.cell_output import CellOption, WriteCellOption, load_target_cell, put_tool_tip, write_cell_file
from kr5_tools.cli.options import options_from
from kr5_tools.cli.table_options import ColumnsOption, Convention, PoseAngle, PoseLength, tell_notes
from kr5_tools.cli.tables import figure_row, make_table, print_result
from kr5_tools.cli.terminal import Console, console, fail
from kr5_tools.exports.command_line import Exports, export_options

app = typer.Typer()


@app.command(epilog="Example:  kr5 calibrate tool touches.csv --convention kuka -o tool.json")
@options_from(calibration.ToolOptions, skip=("previous",))
@export_options("poses")
def tool(
    poses: Annotated[
        Path,
        typer.Argument(
            help=(
                "Flange poses in the base that touch one point: a table, or a folder whose dataset.yaml names poses and"
                " convention."
            )
        ),
    ],
    options: calibration.ToolOptions,
    exports: Exports,
    dataset: Annotated[
        Path | None, typer.Option(help="A dataset.yaml outside the folder; its files are in the folder.")
    ] = None,
    columns: ColumnsOption = None,
    convention: Convention = None,
    length: PoseLength = None,
    angle: PoseAngle = None,
    previous: Annotated[
        tuple[float, float, float] | None, typer.Option(help="Previous tool tip, in the flange frame \\[m].")
    ] = None,
    cell_file: CellOption = None,
    write_cell: WriteCellOption = None,
    output: ResultOption = None,
    json_file: JsonOption = None,
) -> None:
    """Tool centre point from flange poses that touch one point, with uncertainty and outliers."""
    if previous is not None:
        options.previous = np.array(previous)
    options.validate()
    read = [poses, dataset, cell_file]
    check_writable(output, json_file, write_cell, *exports.files, inputs=read)
    believed = load_target_cell(cell_file, write_cell)
    if dataset or poses.is_dir():
        if given := [
            flag
            for flag, value in (
                *(("--columns", columns), ("--convention", convention)),
                *(("--length-unit", length), ("--angle-unit", angle)),
            )
            if value
        ]:
            fail(f"{', '.join(given)}: only with a table; in a folder it is taken from the dataset.yaml")
        T, used = read_folder(poses, dataset)
    else:
        wanted = TableOptions(columns, convention=convention, length=length, angle=angle)
        found = wanted.read_poses(poses)
        T, used = found.poses, found.format.to_dict()
        tell_notes(wanted.notes)
    result = calibration.calibrate_tool(T, options)
    data = write_result(None, "kr5-tool/1", **_keys(result, T, poses, used))
    out = console(json_file)
    _show(result, data, out)
    write_if_usable(data, result.fit, output, json_file)
    exports.write(data, out)
    if believed:
        put_tool_tip(believed, np.asarray(result.tip))
        write_cell_file(believed, write_cell)


def read_folder(folder: Path, description: Path | None) -> tuple[list[Any], dict[str, str]]:
    """Poses of a folder and the convention that its dataset.yaml states."""
    file = description or folder / "dataset.yaml"
    if not folder.is_dir():
        fail(f"{folder}: no such folder; expected one with robot poses")
    if not file.exists():
        fail(f"{file}: no such file; expected a dataset.yaml with poses and convention, or specify one with --dataset")
    data = calibration.load_pose_set(str(file), str(folder))
    _refuse_objections(folder, data.rows, data.convention, f"correct the convention in {file}")
    return data.poses(), data.convention.to_dict()


def _refuse_objections(source: Path, rows: np.ndarray, read_as: kr5.calibration.PoseFormat, remedy: str) -> None:
    if objections := calibration.format_objections(rows, read_as):
        used = read_as.to_dict()
        fail(
            f"{source}: read as {used['position']}, {used['rotation']}, {used['angle']}:"
            f" {'; '.join(objections)}; {remedy}"
        )


def _keys(result: kr5.calibration.ToolResult, T: list[np.ndarray], file: Path, used: dict[str, str]) -> dict[str, Any]:
    std = 1e3 * np.sqrt(np.diag(result.covariance))
    figures = [figure_row(f"tip {axis} in the flange", 1e3 * v, s, "mm") for axis, v, s in zip("xyz", result.tip, std)]
    keys = {"input": {"poses": str(file), **used}, "verdict": _verdict(result, std), "result": result.to_dict()}
    if not result.fit.usable:
        return keys
    touch = np.eye(4)
    touch[:3, 3] = result.point
    frames = [{"name": "base", "parent": None, "T": np.eye(4)}, {"name": "point", "parent": "base", "T": touch}]
    frames += [{"name": f"pose {i + 1}", "parent": "base", "T": pose} for i, pose in enumerate(T)]
    views = [{"name": f"pose {i + 1}", **p.to_dict()} for i, p in enumerate(result.poses)]
    return {**keys, "figures": figures, "views": views, "frames": frames}


def _verdict(result: kr5.calibration.ToolResult, std: np.ndarray) -> dict[str, str]:
    if not result.fit.usable:
        return {"word": "unusable", "text": result.fit.message}
    worst = float(np.linalg.norm(std))
    objections = list(result.warnings)
    if missed := [str(i + 1) for i, p in enumerate(result.poses) if p.outlier]:
        objections.append(f"pose {', '.join(missed)} missed the point and was left out; touch the point again")
    if worst > 1:
        objections.append("the tip is known to no better than 1 mm: add touches from more, and more tilted, directions")
    text = f"the tip is known to {worst:.2f} mm (one standard deviation)"
    return {"word": "doubtful" if objections else "good", "text": "; ".join([text, *objections])}


def _show(result: kr5.calibration.ToolResult, data: dict[str, Any], out: Console) -> None:
    print_result(data, out)
    if result.fit.usable:
        rows = [
            [f"{i + 1}", *(1e3 * r for r in p.residual), 1e3 * p.distance, "missed" if p.outlier else ""]
            for i, p in enumerate(result.poses)
        ]
        out.print()
        out.print(
            make_table(
                "Position of the tip by each pose, minus the point",
                ["pose", "x [mm]", "y [mm]", "z [mm]", "distance [mm]", ""],
                rows,
            )
        )
