"""`kr5 identify elasticity`: stiffness and play of the gears, from angles on both sides of them."""

import math
from pathlib import Path
from typing import Annotated, Any

import kr5.cell
import numpy as np
import typer
from kr5 import cell as kr5_cell
from kr5 import identification
from kr5.files.results import write_if_usable, write_result
from kr5.files.writing import check_writable
from kr5.tables.options import TableOptions
from kr5.tables.roles import Role

from kr5_tools.cli.arguments import JsonOption, ResultOption
from kr5_tools.cli.cell_output import WriteCellOption, write_cell_file
from kr5_tools.cli.options import options_from
from kr5_tools.cli.table_options import AngleUnit, ColumnsOption, EpisodeOption, tell_notes
from kr5_tools.cli.tables import figure_row, print_result
from kr5_tools.cli.terminal import console, fail

app = typer.Typer()
MOST_JOINTS = 99
LINKS = Role("q", "link angles", "angle", counted=True, may_lack=True, may_skip=True)
MOTORS = Role(
    "m",
    "motor angles over the gear ratio",
    "angle",
    counted=True,
    may_lack=True,
    may_skip=True,
    follows="q",
    largest=math.inf,
)
LINK_TORQUES = Role(
    "tau", "torques through the gears", "torque", counted=True, needed=False, may_lack=True, may_skip=True
)
MOST_SHOWN = 600  # readings of a result file, for its plot


@app.command(
    epilog="Example: kr5 identify elasticity readings.csv --torque-noise 2 --angle-unit deg -o elasticity.json"
)
@options_from(identification.ElasticityOptions, skip=("torque_noise",))
def elasticity(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="READINGS",
            help=(
                "Table, a row a reading, in order of time: link angles q1, q2, …; angles of the motor side over the"
                " gear ratio m1, m2, …; torques through the gears tau1, tau2, … [N m]; empty where nothing was read."
            ),
        ),
    ],
    options: identification.ElasticityOptions,
    torque_noise: Annotated[
        str | None,
        typer.Option(
            metavar="S,S,…",
            help="Standard deviation of the torques, one number for all or one a joint \\[N m or N]; without it they"
            " are taken as exact, and noise makes the joints look too stiff.",
        ),
    ] = None,
    columns: ColumnsOption = None,
    episodes: EpisodeOption = "",
    angle: AngleUnit = None,
    cell: Annotated[
        Path | None,
        typer.Option(
            metavar="CELL.yaml",
            help="Cell with masses, whose gravity is the torque of readings at rest, where the file has no torques; and"
            " into which --write-cell puts the result.",
        ),
    ] = None,
    write_cell: WriteCellOption = None,
    output: ResultOption = None,
    json_file: JsonOption = None,
) -> None:
    """Stiffness and free play of each joint, from angles on both sides of the gears (a second encoder on the link)
    and the torques between them.

    Torques are those on the link: of a joint torque sensor, or of a model; friction and inertia of the motors do not
    belong to them. Without a second encoder, measure poses of the sagging arm: kr5 calibrate kinematics --elasticity.
    """
    check_writable(output, write_cell, json_file, inputs=[file, *([cell] if cell else [])])
    if write_cell and not cell:
        fail("--write-cell: --cell is missing; name the cell into which the result is put")
    believed = kr5_cell.load_cell(cell) if cell else None
    wanted = TableOptions(columns, angle=angle, episodes=episodes)
    readings = read_readings(file, wanted, believed)
    tell_notes(wanted.notes)
    if torque_noise is not None:
        options.torque_noise = read_noise(torque_noise)
    result = identification.identify_elasticity(readings, options)
    keys = result_keys(file, readings, result, options)
    data = write_result(None, "kr5-elasticity/1", **keys)
    write_if_usable(data, result.fit, output, json_file)
    print_result(keys, console(json_file))
    if believed is not None and write_cell:
        for spring in result.joints:
            if spring.told:
                identification.set_joint_spring(believed, spring.joint - 1, spring.stiffness, spring.gap)
        write_cell_file(believed, write_cell)


def read_noise(text: str) -> np.ndarray:
    """Numbers with commas."""
    try:
        return np.array([float(part) for part in text.split(",")])
    except ValueError:
        fail(f"--torque-noise: found {text!r}, expected numbers with commas, as 2,2,1")


def read_readings(file: Path, wanted: TableOptions, believed: kr5.cell.Cell | None) -> Any:
    """Readings of a table. A joint of which a column is missing was not read."""
    table = wanted.read(file, [LINKS, MOTORS, LINK_TORQUES])
    both = [k for k in range(MOST_JOINTS) if all(len(table.names[r]) > k and table.names[r][k] for r in ("q", "m"))]
    if not both:
        raise table.lacks("q and m of the same joint", "angles on both sides of its gear")
    n = both[-1] + 1
    q, motor = (_of_joints(table[role], n) for role in ("q", "m"))
    if believed is not None:
        slides = [str(joint.type) == "prismatic" for joint in believed.nominal_chain().joints]
        if n > len(slides) or (any(slides) and table.units["q"] != "rad"):
            fail(
                f"{file}: the cell has {len(slides)} joints, found {n}; the values of slides are in m,"
                " without --angle-unit"
            )
    if "tau" in table:
        torque = _of_joints(table["tau"], n)
    elif believed is not None:
        torque = gravity_torques(file, believed, q)
    else:
        fail(f"{file}: found no torques tau1, …; give them, or a --cell with masses for readings at rest")
    return identification.ElasticityReadings(motor=motor, link=q, torque=torque)


def _of_joints(values: np.ndarray, n: int) -> np.ndarray:
    """The first n columns; NaN where there are fewer."""
    return np.column_stack([values[:, :n], np.full((len(values), max(0, n - values.shape[1])), np.nan)])


def gravity_torques(file: Path, believed: kr5.cell.Cell, q: np.ndarray) -> np.ndarray:
    """Torques that hold the links of a cell in these postures; NaN where an angle is missing."""
    if not believed.robot.links:
        fail("--cell: the cell has no masses (robot.links), from which the torques of gravity follow")
    if q.shape[1] != believed.robot.joints:
        fail(f"{file}: found angles of {q.shape[1]} joints, expected all {believed.robot.joints} for gravity")
    whole = np.isfinite(q).all(axis=1)
    still = np.zeros((int(whole.sum()), q.shape[1]))
    out = np.full(q.shape, np.nan)
    if whole.any():
        states = identification.JointMotion(t=np.arange(len(still)), q=q[whole], qd=still, qdd=still, tau=still)
        out[whole] = identification.nominal_torques(believed, states)
    return out


def result_keys(
    file: Path,
    readings: identification.ElasticityReadings,
    result: identification.ElasticityResult,
    options: identification.ElasticityOptions,
) -> dict[str, Any]:
    """What the result file holds beside its head."""
    figures, warnings = [], []
    for s in result.joints:
        if s.told:
            std = s.stiffness**2 * s.compliance_std
            figures.append(figure_row(f"stiffness of joint {s.joint}", s.stiffness, std, "N m/rad"))
        elif np.isfinite(s.stiffness_low) and s.stiffness_low > 0:
            figures.append(
                figure_row(f"lower bound of the stiffness of joint {s.joint} (95 %)", s.stiffness_low, None, "N m/rad")
            )
        if s.gap > 0:
            figures.append(figure_row(f"free play of joint {s.joint}", 1e3 * s.gap, 1e3 * s.gap_std, "mrad"))
        if s.told and s.attenuation < 1:
            name = f"compliance of joint {s.joint} by least squares over the true one"
            figures.append(figure_row(name, s.attenuation, None, "-"))
        if s.doubtful:
            warnings.append(f"joint {s.joint}: {s.message}")
    every = max(1, len(readings.link) // MOST_SHOWN)
    lead = np.asarray(readings.motor) - np.asarray(readings.link)
    told = sum(s.told for s in result.joints)
    text = f"stiffness of {told} of {len(result.joints)} joints determined"
    if not len(options.torque_noise):
        text += ", from torques that are taken as exact (--torque-noise)"
    return {
        "input": {"file": str(file), "options": options.to_dict()},
        "verdict": {"word": "doubtful" if warnings else "good", "text": "; ".join([text, *warnings])},
        "figures": figures,
        "result": {**result.to_dict(), "lead": lead[::every], "torque": np.asarray(readings.torque)[::every]},
    }
