"""The page of a scene: the cell in 3D above the signals of the scene, and the result of each expectation."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from kr5.files.result_types import ResultData

from kr5_tools.cell.frames import joint_unit
from kr5_tools.cli.numbers import NONE, format_count, table_unit
from kr5_tools.pages.tables_page import write_tables_page
from kr5_tools.replay.page import make_page
from kr5_tools.replay.peg_rotation import peg_rotations
from kr5_tools.replay.runs import Run
from kr5_tools.replay.signals import signal_of

if TYPE_CHECKING:
    import kr5.sim

# Columns of a scene beside those of a motion: label, unit and quantity.
ARM_COLUMNS = {
    "x": ("position x of the tool", "m", "position"),
    "y": ("position y of the tool", "m", "position"),
    "z": ("position z of the tool", "m", "position"),
    "energy": ("mechanical energy", "J", "energy"),
    "limited": ("whether a motor is at its current limit", "-", "drives"),
    "range": ("least range of the scanner", "m", "position"),
}
PUSH_COLUMNS = {
    "z": ("height of the peg's bottom above the face of the tube", "m", "position"),
    "x": ("position x of the peg's bottom in the tube frame", "m", "position"),
    "y": ("position y of the peg's bottom in the tube frame", "m", "position"),
    "depth": ("depth of the contact", "m", "position"),
    "push": ("commanded force", "N", "force"),
    "tilt": ("tilt of the peg", "rad", "angle"),
    "alpha": ("azimuth of the tilt", "rad", "angle"),
}
CHECK_COLUMNS = ["column", "statistic", "from [s]", "to [s]", "value", "at least", "at most", "unit", "result"]
CHECK_TEXT = "Each statistic is that of the column from the first time to the second."


def scene_result(result: "kr5.sim.SceneResult", name: str) -> dict[str, Any]:
    """What a scene gave (`kr5-scene-result/1`): each expectation, in SI, with the time that it is about."""
    end = float(result.rows["t"][-1])
    checks = [{**check.to_dict(), "unit": column_meaning(result, check.expected.column)[1]} for check in result.checks]
    for check in checks:
        check["expected"]["end"] = end if check["expected"]["end"] is None else check["expected"]["end"]
    return {"name": name, "passed": result.passed, "steps": result.steps, "duration": end, "checks": checks}


def verdict_text(data: ResultData) -> str:
    met, count = sum(check["passed"] for check in data["checks"]), len(data["checks"])
    return f"{met} of {format_count(count, 'expectation')} met."


def scene_page(result: "kr5.sim.SceneResult", data: ResultData, run: Run, source: Path) -> str:
    """The HTML of a scene that has just been run; `data`: its result."""
    return make_page(
        result.cell,
        [run],
        source,
        made_by="kr5 scene run",
        title=data["name"],
        solids=result.solids,
        template="scene.html",
        look="good" if result.passed else "unusable",
        icon="✓" if result.passed else "✗",
        word="Passed" if result.passed else "Failed",
        verdict=verdict_text(data),
        checks=checks_table(data),
    )


def write_page(data: ResultData, source: str, output: Path, png: Path | None) -> list[Path]:
    """Writes the page of a result file, which holds no motion."""
    text = "The result holds no motion; `kr5 scene run -o PAGE.html` writes the page with the motion."
    word, label = ("good", "Passed") if data["passed"] else ("unusable", "Failed")
    parts = [{"title": "", "texts": [text], "plots": [], "tables": [checks_table(data)]}]
    page: ResultData = {**data, "verdict": {"word": word, "label": label, "text": verdict_text(data)}}
    return write_tables_page(page, data["name"], "kr5 scene run", source, parts, output, png)


def checks_table(data: ResultData) -> dict[str, Any]:
    rows = [check_row(check) for check in data["checks"]]
    return {"title": "Expectations", "columns": CHECK_COLUMNS, "rows": rows, "texts": [CHECK_TEXT]}


def column_meaning(result: "kr5.sim.SceneResult", name: str) -> tuple[str, str, str]:
    """Label, unit and quantity of a column of a scene."""
    import kr5.cell

    own = PUSH_COLUMNS if "push" in result.rows else ARM_COLUMNS
    if name in own:
        return own[name]
    joints = result.cell.robot.joints
    columns = {c.name: c for c in kr5.cell.columns(kr5.cell.Kind.Motion, joints)}
    link = {f"link{i + 1}": f"q{i + 1}" for i in range(joints)}.get(name)
    column = columns[link or name]
    unit = joint_unit(result.cell, column.joint, str(column.unit))
    label = str(column.label) + (" behind the gear" if link else "")
    return label, unit, "link position" if link else str(column.channel)


def check_row(check: dict[str, Any]) -> list[str]:
    """An expectation and what came of it, in the units of tables."""
    expected = check["expected"]
    factor, unit = table_unit(check["unit"])
    keys = ("min", "max") if "min" in expected else ("least", "most")  # of versions before 0.3
    bounds = [NONE if expected[k] is None else f"{factor * expected[k]:.6g}" for k in keys]
    return [
        expected["column"],
        str(expected["statistic"]),
        f"{expected['begin']:g}",
        f"{expected['end']:g}",
        NONE if check["value"] is None else f"{factor * check['value']:.6g}",
        *bounds,
        unit,
        "met" if check["passed"] else "not met",
    ]


def scene_run(result: "kr5.sim.SceneResult") -> Run:
    """Postures of the arm over the time of the scene, and the columns of the scene as signals."""
    n, t = result.cell.robot.joints, np.asarray(result.rows["t"])
    signals = [
        signal_of(name, *column_meaning(result, name), t - t[0], result.rows[name])
        for name in result.rows.columns
        if name != "t"
    ]
    first = list(dict.fromkeys(check.expected.column for check in result.checks))
    if "link1" in result.rows:
        q = np.column_stack([result.rows[f"link{i + 1}"] for i in range(n)])
        return Run("scene", t - t[0], q=q, signals=signals, first=first)
    shown, q = _pushed(result, t)
    return Run("push", shown - t[0], q=q, signals=signals, first=first)


def _pushed(result: "kr5.sim.SceneResult", t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A push knows the peg alone: postures of the arm that would hold it so."""
    import kr5.kinematics

    from kr5_tools.cell.rest_posture import rest_posture

    cell, rows = result.cell, result.rows
    limits = cell.robot.limits
    options = kr5.kinematics.InverseOptions(near=rest_posture(cell, None))
    if limits:
        options.lower, options.upper = limits.lower, limits.upper
    kept: list[Any] = []
    q: list[Any] = []
    peg = peg_rotations(np.asarray(rows["tilt"]), np.asarray(rows["alpha"]))
    for k in np.unique(np.linspace(0, len(t) - 1, min(len(t), 150)).round().astype(int)):
        T_tube_tool = np.eye(4)
        T_tube_tool[:3, :3] = peg[k] * [-1.0, 1.0, -1.0]  # E looks out of the peg
        T_tube_tool[:3, 3] = [rows[name][k] for name in "xyz"]
        found = kr5.kinematics.inverse_kinematics(
            cell.nominal_chain(), cell.tube.T_base_tube @ T_tube_tool @ np.linalg.inv(cell.tool.T_flange_tool), options
        )
        usable = [np.asarray(p.q) for p in found.postures if p.usable]
        if not usable:
            raise kr5.InvalidArgument(
                f"{cell.name}: tube.T_B_T: the arm cannot hold the peg at this pose, so that it cannot"
                " be displayed; leave out -o and --rerun"
            )
        near = np.asarray(q[-1] if q else options.near)
        q.append(min(usable, key=lambda p: np.linalg.norm(p - near)))
        kept.append(k)
    return t[kept], np.array(q)
