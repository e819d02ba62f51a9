"""`kr5 calibrate postures`: the postures to measure for a calibration of the arm."""

from pathlib import Path
from typing import Annotated, Any

import kr5
import kr5.calibration
import kr5.cell
import numpy as np
import typer
from kr5 import calibration, cell, kinematics
from kr5.files.results import write_result
from kr5.files.writing import check_writable, write_json, write_text
from kr5.tables.options import TableOptions

from kr5_tools.calibrate.postures import read_joint_values
from kr5_tools.cli.arguments import JsonOption
from kr5_tools.cli.options import options_from
from kr5_tools.cli.table_options import AngleUnit, ColumnsOption, JointColumns, tell_notes
from kr5_tools.cli.tables import figure_row, print_result
from kr5_tools.cli.terminal import console, fail, spinner

app = typer.Typer()
TRIES = 200  # for each candidate, before the cell is said to have none
MOST_TILT = np.radians(50)  # of the board against the line of sight
SHARE_OF_IMAGE = (0.3, 0.95)  # that the board spans


@app.command(
    "postures", epilog="Example:  kr5 calibrate postures --cell cell.yaml --count 60 --see-board -o postures.csv"
)
@options_from(calibration.PostureChoiceOptions, skip=("point", "exchanges"))
def calibrate_postures(
    options: calibration.PostureChoiceOptions,
    cell_file: Annotated[Path, typer.Option("--cell", metavar="CELL", help="Cell with the nominal arm.")],
    candidates: Annotated[
        Path | None,
        typer.Option(metavar="TABLE", help="Joint values to choose from; by default drawn within the limits."),
    ] = None,
    draw: Annotated[int, typer.Option(min=10, help="Number of candidates to draw.")] = 2000,
    lowest: Annotated[float, typer.Option(help="Minimum height of flange and tool tip above the base \\[m].")] = 0.1,
    see_board: Annotated[
        bool, typer.Option("--see-board", help="Only postures at which the camera of the cell sees its whole board.")
    ] = False,
    columns: ColumnsOption = None,
    joints: JointColumns = None,
    angle: AngleUnit = None,
    seed: Annotated[int, typer.Option(help="Random seed.")] = 1,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="CSV", help="The postures, a row of joint values each.")
    ] = None,
    json_file: JsonOption = None,
) -> None:
    """The most informative postures for an arm's parameters, for kr5 calibrate kinematics and kr5 calibrate cell.

    The file of --json is one that kr5 report shows: what each further posture adds.
    """
    options.validate()
    check_writable(output, json_file, inputs=[f for f in (cell_file, candidates) if f])
    believed = cell.load_cell(cell_file)
    chain = believed.nominal_chain()
    wanted = TableOptions(columns, joints, angle=angle)
    if not np.isfinite(lowest):
        fail(f"--lowest: found {lowest}, expected a height [m]")
    if len(wanted.joint_names(len(chain.joints))) != len(chain.joints):
        fail(f"--joints: found {joints}, expected the names of {len(chain.joints)} columns, or one such as joint_{{}}")
    if candidates:
        drawn = read_joint_values(candidates, chain.joints, wanted)
        tell_notes(wanted.notes)
    else:
        with spinner("Drawing candidates"):
            drawn = draw_candidates(believed, draw, lowest, see_board, np.random.default_rng(seed))
    if len(drawn) < options.count:
        source = str(candidates) if candidates else "--lowest, --see-board, --draw"
        fail(f"{source}: found {len(drawn)} candidates, expected at least the {options.count} postures of --count")
    if believed.tool is not None:
        options.point = np.asarray(believed.tool.T_flange_tool)[:3, 3]
    with spinner("Choosing"):
        choice = calibration.choose_postures(chain, list(drawn), options)
    chosen = drawn[choice.chosen]
    names = wanted.joint_names(chosen.shape[1])
    revolute = np.array([str(j.type) != "prismatic" for j in chain.joints])
    if output:
        rows = np.where(revolute, np.degrees(chosen) if angle == "deg" else chosen, chosen)
        lines = [",".join(names), *(",".join(f"{v:.6f}" for v in row) for row in rows)]
        write_text("\n".join(lines) + "\n", output)
    data = write_result(
        None,
        "kr5-postures/1",
        input={"cell": str(cell_file), "candidates": str(candidates or f"{len(drawn)} drawn"), "seed": seed},
        figures=_figures(choice, options, drawn),
        result={
            **choice.to_dict(),
            "criterion": str(options.criterion),
            "q": chosen,
            "candidates": drawn,
            "units": ["rad" if r else "m" for r in revolute],
        },
    )
    write_json(data, json_file)
    out = console(json_file)
    print_result(data, out)
    if output:
        out.print(f"postures: {output}", soft_wrap=True)


def draw_candidates(
    believed: kr5.cell.Cell, count: int, lowest: float, see_board: bool, random: np.random.Generator
) -> np.ndarray:
    """Postures within the limits, clear of the floor, and on demand with the board in sight; fewer where so many are
    not found."""
    limits = believed.robot.limits
    if not len(limits.lower):
        fail("--cell: robot.limits: found none, expected lower and upper; or give --candidates")
    low, high = np.array(limits.lower), np.array(limits.upper)
    tip = np.eye(4) if believed.tool is None else np.asarray(believed.tool.T_flange_tool)
    chain, found = believed.nominal_chain(), []
    view = BoardView(believed) if see_board else None
    for _ in range(TRIES * count):
        q = view.draw(random) if view else random.uniform(low, high)
        if q is None:
            continue
        T = np.asarray(chain.flange(q))
        if min(T[2, 3], (T @ tip)[2, 3]) >= lowest:
            found.append(q)
        if len(found) == count:
            break
    return np.array(found).reshape(-1, len(low))


class BoardView:
    """Postures at which the camera on the flange sees the whole board of the cell."""

    def __init__(self, believed: kr5.cell.Cell) -> None:
        for part in ("camera", "board"):
            if getattr(believed, part) is None:
                fail(f"--see-board: the cell has no {part}")
        T_flange_camera = believed.T_flange_camera()
        if T_flange_camera is None:
            fail("--see-board: the camera of the cell is not on the flange")
        self.camera = believed.camera.pinhole()
        self.T_flange_camera = np.asarray(T_flange_camera)
        self.T_base_target = np.asarray(believed.board.T_base_target)
        self.points = np.asarray(kr5.target_points(believed.board.target())[0])
        self.middle = self.points.mean(axis=1)
        self.radius = float(np.linalg.norm(self.points - self.middle[:, None], axis=0).max())
        self.chain = believed.nominal_chain()
        self.limits = kinematics.InverseOptions(
            lower=np.array(believed.robot.limits.lower), upper=np.array(believed.robot.limits.upper)
        )

    def draw(self, random: np.random.Generator) -> np.ndarray | None:
        """One posture, or none where this view cannot be reached."""
        c = self.camera
        z = c.fx * self.radius / (0.5 * random.uniform(*SHARE_OF_IMAGE) * min(c.width, c.height))
        way, tilt = random.uniform(0, 2 * np.pi), random.uniform(0, MOST_TILT)
        M = kr5.to_pose([0, 0, 0, tilt * np.cos(way), tilt * np.sin(way), 0])
        M = M @ kr5.to_pose([0, 0, 0, 0, 0, random.uniform(-np.pi, np.pi)])
        pixel = random.uniform(0.2, 0.8, 2) * [c.width, c.height]
        M[:3, 3] = z * np.asarray(c.rays(pixel[:, None]))[:, 0] - M[:3, :3] @ self.middle
        placed = M[:3, :3] @ self.points + M[:3, 3:]
        if not (placed[2] > 0).all():
            return None
        pixels = np.asarray(c.project(placed))
        if not ((pixels > 0) & (pixels < [[c.width - 1], [c.height - 1]])).all():
            return None
        T = self.T_base_target @ np.linalg.inv(M) @ np.linalg.inv(self.T_flange_camera)
        reached = [p.q for p in kinematics.inverse_kinematics(self.chain, T, self.limits).postures if p.usable]
        return np.asarray(reached[random.integers(len(reached))]) if reached else None


def _figures(
    choice: kr5.calibration.PostureChoice, options: kr5.calibration.PostureChoiceOptions, drawn: np.ndarray
) -> list[dict[str, Any]]:
    rows = [
        figure_row("candidates", len(drawn), None, "-"),
        figure_row("postures chosen", len(choice.chosen), None, "-"),
    ]
    if str(options.criterion) == "prediction":
        rows.append(figure_row("expected error of a predicted place (RMS)", 1e3 * choice.value, None, "mm"))
    elif str(options.criterion) == "variance":
        rows.append(figure_row("parameters' standard deviation over their spread (RMS)", choice.value, None, "-"))
    else:
        rows.append(figure_row("logarithm of the determinant per parameter", choice.value, None, "-"))
    return rows
