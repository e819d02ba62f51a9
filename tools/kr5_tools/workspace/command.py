"""`kr5 workspace`: where an arm can put its flange, wrist or tool, and how well it moves it there."""

from pathlib import Path
from typing import Annotated, Any, Literal

import kr5.cell
import numpy as np
import typer
from kr5 import kinematics
from kr5.files.results import write_result
from kr5.files.writing import check_writable, write_json

from kr5_tools.cli.arguments import JsonOption, ResultOption
from kr5_tools.cli.arm_file import ArmFile, BaseOption, TipOption
from kr5_tools.cli.options import options_from
from kr5_tools.cli.tables import figure_row, print_result
from kr5_tools.cli.terminal import console, fail, print_note, spinner

app = typer.Typer()
Point = Literal["auto", "flange", "wrist", "tool"]


@app.command(epilog="Example:  kr5 workspace cell.yaml -o workspace.json")
@options_from(kinematics.WorkspaceOptions, skip=("point",))
def workspace(
    arm: Annotated[Path, typer.Argument(metavar="CELL|ROBOT", help="Cell file, or URDF or MJCF of a robot.")],
    options: kinematics.WorkspaceOptions,
    point: Annotated[
        Point,
        typer.Option(
            help="Mapped point; auto: centre of a spherical wrist, for which makers state the reach, else flange."
        ),
    ] = "auto",
    base: BaseOption = "",
    tip: TipOption = "",
    output: ResultOption = None,
    json_file: JsonOption = None,
) -> None:
    """Workspace of an arm: reach, reachable region by radius and height within the joint limits, manipulability,
    smallest singular value and condition number.

    Exit code: 0 when there is a map, 2 when there is none or the input is invalid.
    """
    check_writable(output, json_file, inputs=[arm])
    believed = ArmFile(arm, base, tip).cell()
    chain = believed.nominal_chain()
    options.point, shown = _point(believed, chain, point)
    options.validate()
    lower, upper = _limits(believed, len(chain.joints))
    with spinner("Mapping the workspace"):
        found = kinematics.workspace_map(chain, lower, upper, options)
        stretched = _reach_without_limits(chain, lower, upper, options)
    keys = _keys(found, shown, lower, upper, stretched)
    keys["input"] = {"arm": str(arm), "point": shown, "samples": options.samples, "joints": len(chain.joints)}
    print_result(keys, console(json_file))
    data = write_result(output, "kr5-workspace/1", **keys)
    write_json(data, json_file)


def _point(believed: kr5.cell.Cell, chain: kinematics.DhChain, wanted: str) -> tuple[np.ndarray, str]:
    wrist = kinematics.wrist_centre(chain)
    if wanted == "wrist" and wrist is None:
        fail("--point wrist: the last three axes of this arm do not meet in one point; choose flange or tool")
    if wanted == "wrist" or (wanted == "auto" and wrist is not None):
        return np.asarray(wrist), "wrist centre"
    if wanted == "tool":
        if believed.tool is None:
            fail("--point tool: the cell has no tool")
        return np.asarray(believed.tool.T_flange_tool)[:3, 3], "tool tip"
    return np.zeros(3), "flange"


def _limits(believed: kr5.cell.Cell, joints: int) -> tuple[np.ndarray, np.ndarray]:
    limits = believed.robot.limits
    if limits is None:
        print_note("the cell states no joint limits: every joint turns once")
        return np.full(joints, -np.inf), np.full(joints, np.inf)
    return np.asarray(limits.lower, float), np.asarray(limits.upper, float)


def _reach_without_limits(
    chain: kinematics.DhChain, lower: np.ndarray, upper: np.ndarray, options: kinematics.WorkspaceOptions
) -> float:
    """The reach that follows from the lengths alone, which makers state; slides keep their limits."""
    turns = np.array([str(j.type) == "revolute" for j in chain.joints])
    free = kinematics.WorkspaceOptions(point=options.point, samples=1000, cells=4)
    low, high = np.where(turns, -np.inf, lower), np.where(turns, np.inf, upper)
    return float(kinematics.workspace_map(chain, low, high, free).reach)


def _keys(
    found: kinematics.WorkspaceMap, shown: str, lower: np.ndarray, upper: np.ndarray, stretched: float
) -> dict[str, Any]:
    seen = np.asarray(found.counts) > 0
    best = np.where(seen, np.asarray(found.min_singular_value), -np.inf)
    row, column = np.unravel_index(int(np.argmax(best)), best.shape)
    figures = [
        figure_row(f"reach of the {shown} from axis 1", 1e3 * found.reach, None, "mm"),
        figure_row("the same without joint limits", 1e3 * stretched, None, "mm"),
        figure_row(f"minimum distance of the {shown} from axis 1", max(0.0, round(1e3 * found.inner, 3)), None, "mm"),
        figure_row(f"minimum height of the {shown}", 1e3 * found.lowest, None, "mm"),
        figure_row(f"maximum height of the {shown}", 1e3 * found.highest, None, "mm"),
        figure_row("maximum manipulability of the point", float(np.nanmax(found.dexterity)), None, "m^k"),
        figure_row("minimum condition number of the Jacobian", float(np.nanmin(found.condition)), None, "-"),
        figure_row("maximum of the smallest singular value", float(best.max()), None, "-"),
        figure_row("at radius", 1e3 * float(np.asarray(found.radius)[column]), None, "mm"),
        figure_row("at height", 1e3 * float(np.asarray(found.height)[row]), None, "mm"),
    ]
    posture = ", ".join(f"{q:.4g}" for q in found.q_reach)
    text = (
        f"The {shown} reaches {1e3 * found.reach:.1f} mm from the axis of joint 1, at joint values {posture}"
        f" [rad, slides m] ({1e3 * stretched:.1f} mm without joint limits); heights {1e3 * found.lowest:.0f} to"
        f" {1e3 * found.highest:.0f} mm."
    )
    return {
        "verdict": {"word": "good", "text": text},
        "figures": figures,
        "limits": {"lower": lower, "upper": upper},
        "reach_without_limits": stretched,
        "result": found.to_dict(),
    }
