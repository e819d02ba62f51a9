"""`kr5 identify gravity`: gravity model of an arm from slow motions, and current limits of passive compliance."""

from pathlib import Path
from typing import Annotated, Any

import kr5.cell
import kr5.kinematics
import numpy as np
import typer
from kr5 import cell, identification, physics
from kr5.files.results import write_result
from kr5.files.writing import check_writable, write_json
from kr5.logs.log_file import LOG_FORMATS
from kr5.tables.options import TableOptions
from kr5.tables.roles import CURRENTS, OPTIONAL_TIME, SPEEDS, TORQUES, joints_role

from kr5_tools.cli.arguments import JsonOption, ResultOption
from kr5_tools.cli.arm_file import ArmFile, BaseOption, TipOption
from kr5_tools.cli.cell_output import WriteCellOption, write_cell_file
from kr5_tools.cli.options import options_from
from kr5_tools.cli.table_options import AngleUnit, ColumnsOption, EpisodeOption, JointColumns, LengthUnit, tell_notes
from kr5_tools.cli.tables import figure_row, make_table, print_result
from kr5_tools.cli.terminal import Console, console, fail, print_note, spinner
from kr5_tools.identify.motion_logs import FROM_THE_CELL, conditioning_of, require_usable

app = typer.Typer()
LARGE_ERROR = 0.2  # held-out error over the torque of a joint, above which a model is doubtful [-]
MOST_POSTURES = 400  # of the log, for current limits
AT_REST = (
    "the rows are postures at rest, where friction holds the arm in unknown directions: it is part of the residuals,"
    " and biases gravity unless the postures were approached from all sides; slow motions to and fro tell it apart"
)
MOST_SHOWN = 600  # samples of a result file, for its plots


@app.command(epilog="Example:  kr5 identify gravity cell.yaml slow.csv --write-cell new.yaml -o gravity.json")
@options_from(identification.GravityOptions, skip=("gravity",))
@options_from(
    identification.ConditioningOptions,
    skip=(*FROM_THE_CELL, "smooth_torques"),
    argument="conditioning",
)
@options_from(identification.PassiveLimitOptions, skip=("T_flange_tool", "directions"), argument="limit_options")
def gravity(
    arm: Annotated[Path, typer.Argument(metavar="CELL|ROBOT", help="Cell file, or URDF or MJCF of a robot.")],
    log: Annotated[
        Path,
        typer.Argument(
            metavar="LOG",
            help=(
                "Slow motions to and fro, joints together or one after the other: t, joint values q1 …, and torques on"
                " the joint side tau1 … or motor currents i1 … [A]; speeds qd1 … if there are any. Or postures at rest,"
                " a row each, without t."
                f" {LOG_FORMATS}."
            ),
        ),
    ],
    options: identification.GravityOptions,
    conditioning: identification.ConditioningOptions,
    limit_options: identification.PassiveLimitOptions,
    planar: Annotated[
        bool,
        typer.Option(
            "--planar",
            help="Also one harmonic for each of the joints with parallel, horizontal axes (eqs. 5.5 to 5.7).",
        ),
    ] = False,
    columns: ColumnsOption = None,
    episodes: EpisodeOption = "",
    joints: JointColumns = None,
    angle: AngleUnit = None,
    length: LengthUnit = None,
    write_cell: WriteCellOption = None,
    base: BaseOption = "",
    tip: TipOption = "",
    output: ResultOption = None,
    json_file: JsonOption = None,
) -> None:
    """Gravity model of an arm from slow motions: mass moments with uncertainty, friction separated by the two
    directions of motion, error on held-out data; and, where the cell has motors, current limits above what the postures
    of a logged motion need. Postures at rest, which do not tell friction, give no current limits.

    Exit code: 0 when there is a model, 2 when the motion determines none or the input is invalid.
    """
    options.validate()
    limit_options.validate()
    check_writable(output, json_file, write_cell, inputs=[arm, log])
    believed = ArmFile(arm, base, tip).cell()
    if write_cell and not believed.robot.links:
        fail(f"{arm}: robot.links: found none, expected the masses of the links, which --write-cell keeps")
    chain = believed.nominal_chain()
    options.gravity = believed.robot.gravity
    wanted = TableOptions(columns, joints, length=length, angle=angle, episodes=episodes)
    logged, at_rest = gravity_log(log, believed, wanted)
    tell_notes([*wanted.notes, *([AT_REST] if at_rest else [])])
    findings: list[identification.LogFinding] = []
    with spinner("Identifying gravity"):
        if at_rest:
            motion = resting_motion(logged)
            found = identification.identify_gravity_at_rest(chain, logged.q, logged.tau, options)
        else:
            motion, findings = slow_motion(log, logged, conditioning_of(conditioning, believed))
            found = identification.identify_gravity(chain, motion, options)
    if not found.fit.usable:
        fail(f"{log}: {found.fit.message}")
    keys = _keys(found, motion, findings)
    keys["input"] = {"arm": str(arm), "log": str(log), "samples": len(motion.t), "options": options.to_dict()}
    out = console(json_file)
    if planar:
        _add_planar(keys, motion, chain, options)
    moving = believed.drives is not None and not at_rest
    limits = _add_limits(keys, believed, found, motion, limit_options) if moving else None
    print_result(keys, out)
    _show(found, chain, out)
    if limits:
        out.print()
        out.print(limits)
    if write_cell:
        put_gravity(believed, found)
        write_cell_file(believed, write_cell)
    data = write_result(output, "kr5-gravity/1", **keys)
    write_json(data, json_file)


def gravity_log(log: Path, believed: kr5.cell.Cell, wanted: TableOptions) -> tuple[identification.JointLog, bool]:
    """A log as it came, in SI: joint values, speeds, torques, and whether its rows are postures at rest. Currents
    become torques by the motors of the cell."""
    joints = believed.nominal_chain().joints
    table = wanted.read(log, [OPTIONAL_TIME, joints_role(joints), SPEEDS, TORQUES, CURRENTS], len(joints))
    if (rows := len(table["q"])) < 3:
        fail(f"{log}: found {rows} {'row' if rows == 1 else 'rows'}, expected at least three")
    at_rest = identification.are_postures(table["q"], timed="t" in table)
    if "t" not in table and not at_rest:
        raise table.lacks("t", "time of the samples; only postures at rest, far apart from row to row, need none")
    t = table["t"] if "t" in table else np.arange(len(table["q"]), dtype=float)
    if not (np.diff(t) > 0).all():
        fail(f"{log}: t: expected increasing times [s]")
    if "tau" in table:
        tau = table["tau"]
    elif "i" in table:
        if believed.drives is None:
            fail(f"{log}: has currents (i1 …), but the cell has no drives to make torques of them; log tau1 …")
        tau = physics.reported_torques(believed, table["i"])
    else:
        raise table.lacks("tau1, tau2, … or i1, i2, …", "torques or currents of the joints")
    log_of_arm = identification.JointLog(t=t, q=table["q"], tau=tau)
    if "qd" in table:
        log_of_arm.qd = table["qd"]
    return log_of_arm, at_rest


def resting_motion(log: identification.JointLog) -> identification.JointMotion:
    """Postures at rest as samples without speed."""
    still = np.zeros_like(log.q)
    return identification.JointMotion(t=log.t, q=log.q, qd=still, qdd=still, tau=log.tau)


def slow_motion(
    file: Path, log: identification.JointLog, options: identification.ConditioningOptions
) -> tuple[identification.JointMotion, list[identification.LogFinding]]:
    """The motion of a log and what was found in it. Torques are not smoothed, which would blur the friction that both
    directions tell apart; a joint that never moved has no moment to be told, and is no fault here."""
    options.smooth_torques = False
    options.accept = ",".join(part for part in (options.accept, "never_moved") if part)
    got = identification.condition_log(log, options)
    require_usable([got], f"{file}: ")
    return got.motion, [f for f in got.findings if str(f.severity) == "warning" and str(f.fault) != "never_moved"]


def put_gravity(believed: kr5.cell.Cell, found: identification.GravityResult) -> None:
    """First moments of the links, less the tool's; and the friction that was found."""
    links = list(believed.robot.links)
    tool = believed.tool
    carried = tool.mass if tool is not None else 0.0
    moment = carried * _tool_centre(tool) if tool is not None and carried else np.zeros(3)
    last = links[-1]
    own_mass = last.mass
    total = own_mass + carried
    if total > 0:
        last.com = (own_mass * np.asarray(last.com) + moment) / total
        last.mass = total
        links[-1] = last
    bodies = found.model.bodies(links)
    last = bodies[-1]
    if own_mass > 0:
        last.mass = last.mass - carried
        last.com = ((last.mass + carried) * np.asarray(last.com) - moment) / last.mass
    bodies[-1] = last
    believed.robot.links = bodies
    if believed.drives is not None:
        moved = np.isfinite(np.asarray(found.coulomb_sigma))
        drives = believed.drives
        friction = drives.friction
        friction.coulomb = np.where(moved, np.maximum(found.coulomb, 0.0), friction.coulomb)
        drives.friction = friction
        believed.drives = drives


def _tool_centre(tool: cell.Tool) -> np.ndarray:
    """Centre of mass of the tool in the flange frame; its com is given in that of the sensor."""
    T = np.asarray(tool.T_flange_sensor)
    return np.asarray(T[:3, :3] @ np.asarray(tool.com) + T[:3, 3])


def _keys(
    found: identification.GravityResult, motion: identification.JointMotion, findings: list[identification.LogFinding]
) -> dict[str, Any]:
    model = found.model
    sigma = np.sqrt(np.diag(model.covariance))
    told = np.abs(model.untold).max(axis=1, initial=0.0) < 1e-9 if model.untold.size else np.full(len(sigma), True)
    figures = [
        figure_row(name, float(value), float(std) if known else None, "kg m" if " c" in name else "kg")
        for name, value, std, known in zip(model.names, model.parameters, sigma, told, strict=True)
        if known
    ]
    moved = [j for j, size in enumerate(found.torque_rms) if size > 0]
    shares = {j: found.held_out_rms[j] / found.torque_rms[j] for j in moved}
    worst = max(moved, key=lambda j: shares[j], default=None)
    notes = [*found.notes, *(f.text for f in findings)]
    text = "no data were held out"
    if worst is not None:
        text = f"largest error on data held out: {100 * shares[worst]:.1f} % of the torque of joint {worst + 1}"
    doubtful = notes or (worst is not None and shares[worst] > LARGE_ERROR)
    every = max(1, len(motion.t) // MOST_SHOWN)
    predicted = [model.predict(q).tau for q in np.asarray(motion.q)[::every]]
    friction = np.sign(motion.qd) * found.coulomb + motion.qd * found.viscous + found.offset
    return {
        "verdict": {"word": "doubtful" if doubtful else "good", "text": "; ".join([text, *notes])},
        "figures": figures,
        "held_out": {"rms": found.held_out_rms, "torque_rms": found.torque_rms},
        "result": {
            **found.to_dict(),
            "t": motion.t[::every],
            "tau": motion.tau[::every],
            "predicted": np.array(predicted) + friction[::every],
            "gravity_torque": np.array(predicted),
        },
    }


def _show(found: identification.GravityResult, chain: kr5.kinematics.DhChain, out: Console) -> None:
    rows = []
    for j, size in enumerate(found.torque_rms):
        share = 100 * float(found.held_out_rms[j] / size) if size > 0 else None
        rows.append(
            [
                f"{j + 1}",
                float(size),
                float(found.residual_rms[j]),
                float(found.held_out_rms[j]),
                share if share is not None else "–",
                float(found.coulomb[j]),
                float(found.coulomb_sigma[j]),
            ]
        )
    unit = "N m or N" if any(str(j.type) == "prismatic" for j in chain.joints) else "N m"
    torques = [f"{name} [{unit}]" for name in ("torque RMS", "residual RMS", "held-out RMS", "Coulomb", "± std")]
    names = ["joint", *torques[:3], "held-out [%]", *torques[3:]]
    out.print()
    out.print(make_table("Slow motion", names, rows))


def _add_planar(
    keys: dict[str, Any],
    motion: identification.JointMotion,
    chain: kr5.kinematics.DhChain,
    options: identification.GravityOptions,
) -> None:
    """Harmonics of the joints in a plane, beside the general model."""
    angles = identification.gravity_angles(chain, np.median(motion.q, axis=0), options.gravity)
    found = identification.identify_planar_gravity(motion, angles, options)
    if not found.fit.usable:
        fail(f"--planar: {found.fit.message}")
    sigma = np.sqrt(np.diag(found.covariance))
    for k, harmonic in enumerate(found.joints):
        for c, part in enumerate(("constant", "sine", "cosine")):
            name = f"joint {harmonic.angle.joint + 1}, {part}"
            keys["figures"].append(figure_row(name, getattr(harmonic, part), float(sigma[3 * k + c]), "N m"))
    keys["result"]["planar"] = found.to_dict()


def _add_limits(
    keys: dict[str, Any],
    believed: kr5.cell.Cell,
    found: identification.GravityResult,
    motion: identification.JointMotion,
    options: identification.PassiveLimitOptions,
) -> Any:
    """Current limits for the postures of the log, and their table; None where gravity is not known well enough."""
    if believed.tool is not None:
        options.T_flange_tool = believed.tool.T_flange_tool
    every = max(1, len(motion.t) // MOST_POSTURES)
    postures = np.asarray(motion.q)[::every]
    told = [np.isfinite(found.model.predict(q).sigma).all() for q in postures]
    if not all(told):
        print_note("no current limits: gravity is not determined for every joint in the postures of the log")
        return None
    limits = identification.passive_limits(found.model, np.maximum(found.coulomb, 0.0), believed, postures, options)
    rows = [
        [
            f"{m + 1}",
            float(limits.limit[m]),
            float(limits.holding[m]),
            float(limits.friction[m]),
            float(limits.uncertainty[m]),
        ]
        for m in range(len(limits.limit))
    ]
    for name, force in (("gives way at, at most", limits.yield_force), ("pushes with, at most", limits.push_force)):
        finite = np.asarray(force)[np.isfinite(force)]
        if finite.size:
            keys["figures"].append(figure_row(f"contact force: {name}", float(finite.max()), None, "N"))
    if options.contact_force > 0:
        label = f"maximum margin that gives way at {options.contact_force:.0f} N"
        keys["figures"].append(figure_row(label, 100 * limits.max_margin, None, "%"))
    keys["result"]["limits"] = limits.to_dict()
    names = ["motor", "limit [A]", "holding [A]", "friction [A]", "uncertainty [A]"]
    return make_table(f"Current limits, {100 * options.margin:.0f} % above the need", names, rows)
