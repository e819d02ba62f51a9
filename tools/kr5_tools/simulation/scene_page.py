"""The page of a scene: the cell in 3D above the signals of the scene, and the result of each expectation."""

from pathlib import Path
from typing import Any

import numpy as np

from kr5_tools.cli import terminal
from kr5_tools.cli.numbers import NONE, table_unit
from kr5_tools.replay.page import make_page
from kr5_tools.replay.runs import Run
from kr5_tools.replay.signals import signal_of

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
CHECK_COLUMNS = ["column", "statistic", "from [s]", "to [s]", "value", "least", "most", "unit", "result"]


def scene_page(result: Any, run: Run, source: Path, title: str) -> str:
    """The HTML."""
    met = sum(check.passed for check in result.checks)
    return make_page(
        result.cell,
        [run],
        source,
        made_by="kr5 scene run",
        title=title,
        solids=result.solids,
        template="scene.html",
        look="good" if result.passed else "unusable",
        icon="✓" if result.passed else "✗",
        verdict=f"{met} of {len(result.checks)} expectations are met.",
        columns=CHECK_COLUMNS,
        checks=[check_row(result, check) for check in result.checks],
    )


def column_meaning(result: Any, name: str) -> tuple[str, str, str]:
    """Label, unit and quantity of a column of a scene."""
    import kr5.cell

    own = PUSH_COLUMNS if "push" in result.rows else ARM_COLUMNS
    if name in own:
        return own[name]
    joints = result.cell.robot.joints
    columns = {c.name: c for c in kr5.cell.columns(kr5.cell.Kind.Motion, joints)}
    link = {f"link{i + 1}": f"q{i + 1}" for i in range(joints)}.get(name)
    column = columns[link or name]
    linear = column.joint >= 0 and str(result.cell.robot.dh[column.joint].type) == "prismatic"
    unit = str(column.unit).split(" or ")[-1 if linear else 0]
    label = str(column.label) + (" behind the gear" if link else "")
    return label, unit, "link position" if link else str(column.channel)


def check_row(result: Any, check: Any) -> list[str]:
    """An expectation and what came of it, in the units of tables."""
    expected = check.expected
    factor, unit = table_unit(column_meaning(result, expected.column)[1])
    end = float(result.rows["t"][-1]) if expected.end is None else expected.end
    bounds = [NONE if bound is None else f"{factor * bound:.6g}" for bound in (expected.least, expected.most)]
    return [
        expected.column,
        str(expected.statistic),
        f"{expected.begin:g}",
        f"{end:g}",
        f"{factor * check.value:.6g}",
        *bounds,
        unit,
        "met" if check.passed else "not met",
    ]


def scene_run(result: Any) -> Run:
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


def _pushed(result: Any, t: Any) -> tuple[Any, Any]:
    """A push knows the peg alone: postures of the arm that would hold it so."""
    import kr5.kinematics

    from kr5_tools.cell.command import rest_posture

    cell, rows = result.cell, result.rows
    limits = cell.robot.limits
    options = kr5.kinematics.InverseOptions(
        near=rest_posture(cell, None), **({"lower": limits.lower, "upper": limits.upper} if limits else {})
    )
    kept: list[Any] = []
    q: list[Any] = []
    for k in np.unique(np.linspace(0, len(t) - 1, min(len(t), 150)).round().astype(int)):
        T_tube_tool = np.eye(4)
        tilt, alpha = rows["tilt"][k], rows["alpha"][k]
        z = -np.array(
            [np.sin(tilt) * np.cos(alpha), np.sin(tilt) * np.sin(alpha), np.cos(tilt)]
        )  # E looks out of the peg
        x = np.cross([0.0, 1.0, 0.0], z)
        x /= np.linalg.norm(x)
        T_tube_tool[:3, :3], T_tube_tool[:3, 3] = (
            np.column_stack([x, np.cross(z, x), z]),
            [rows["x"][k], rows["y"][k], rows["z"][k]],
        )
        found = kr5.kinematics.inverse_kinematics(
            cell.nominal_chain(), cell.tube.T_base_tube @ T_tube_tool @ np.linalg.inv(cell.tool.T_flange_tool), options
        )
        usable = [np.asarray(p.q) for p in found.postures if p.usable]
        if not usable:
            terminal.fail(
                f"{cell.name}: tube.T_B_T: the arm cannot hold the peg at this pose, so that it cannot"
                " be displayed; leave out -o and --rerun"
            )
        near = np.asarray(q[-1] if q else options.near)
        q.append(min(usable, key=lambda p: np.linalg.norm(p - near)))
        kept.append(k)
    return t[kept], np.array(q)
