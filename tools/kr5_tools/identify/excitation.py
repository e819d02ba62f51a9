"""`kr5 identify excitation`: a motion that excites the dynamics of an arm, before anything is logged."""

import math
from pathlib import Path
from typing import Annotated, Any

import kr5.cell
import kr5.identification
import numpy as np
import typer
from kr5 import identification, predict, robot
from kr5.files.results import write_result
from kr5.files.writing import check_writable, write_json

from kr5_tools.cli.arguments import JsonOption, ResultOption
from kr5_tools.cli.arm_file import ArmFile, BaseOption, TipOption
from kr5_tools.cli.options import options_from
from kr5_tools.cli.tables import figure_row, make_table, print_result
from kr5_tools.cli.terminal import Console, console, fail, print_note, share_bar
from kr5_tools.identify.excitation_files import krl_files, write_krl, write_motion_csv

app = typer.Typer()
MOST_SHOWN = 600  # samples of a result file, for its plots
BOOK_CONDITION = 51.0  # Hayat et al. 2022, section 4.4.3.2 [-]


@app.command(epilog="Example:  kr5 identify excitation cell.yaml --csv motion.csv --krl excite -o excitation.json")
@options_from(
    identification.ExcitationOptions,
    skip=("torque_noise", "start", "lowest", "points", "keep_out", "link_radii"),
)
def excitation(
    arm: Annotated[Path, typer.Argument(metavar="CELL|ROBOT", help="Cell file, or URDF or MJCF of a robot.")],
    options: identification.ExcitationOptions,
    start: Annotated[
        str | None, typer.Option(metavar="Q1,Q2,…", help="Joint values at the start and the end \\[rad or m].")
    ] = None,
    lowest: Annotated[
        float | None,
        typer.Option(help="Minimum height of flange and tool tip above the base \\[m]; without it, not limited."),
    ] = None,
    keep_out: Annotated[
        Path | None,
        typer.Option(
            metavar="ZONES.yaml",
            help="Boxes, balls and floors that links and tool stay clear of; an example stands above.",
        ),
    ] = None,
    cell_objects: Annotated[
        bool,
        typer.Option(
            "--cell-objects/--no-cell-objects",
            help="Whether tube, board, targets and sphere of the cell are zones as well.",
        ),
    ] = True,
    link_radii: Annotated[
        str | None,
        typer.Option(
            metavar="R1,R2,…",
            help="Radius of the capsules about the DH lengths of each link, then of the tool; the last value holds for"
            " all further ones \\[m].  [dim](default: 0.1)[/dim]",
        ),
    ] = None,
    speed: Annotated[
        str | None,
        typer.Option(metavar="V1,V2,…", help="Maximum joint speeds in place of the cell's \\[rad/s or m/s]."),
    ] = None,
    acceleration: Annotated[
        str | None, typer.Option(metavar="A1,A2,…", help="Maximum joint accelerations \\[rad/s^2 or m/s^2].")
    ] = None,
    torque: Annotated[
        str | None,
        typer.Option(metavar="T1,T2,…", help="Maximum torques in place of the cell's, on the joint side \\[N m or N]."),
    ] = None,
    torque_noise: Annotated[
        str | None, typer.Option(metavar="S1,S2,…", help="Noise of each joint torque, as a weight \\[N m or N].")
    ] = None,
    interval: Annotated[
        float | None, typer.Option(help="Interval of the samples of --csv \\[s]; by default the cycle of the cell.")
    ] = None,
    csv: Annotated[
        Path | None, typer.Option(metavar="CSV", help="The motion: t, q1 …, qd1 …, qdd1 …, nominal tau1 …, in SI.")
    ] = None,
    krl: Annotated[
        Path | None, typer.Option(metavar="NAME", help="The motion as a KRL module: NAME.src and NAME.dat, in degrees.")
    ] = None,
    base: BaseOption = "",
    tip: TipOption = "",
    output: ResultOption = None,
    json_file: JsonOption = None,
) -> None:
    """Exciting motion for the identification of an arm's dynamics: harmonics, or strokes from point to point,
    optimised until their torques determine the base parameters best. The motion stays within positions, speeds,
    accelerations and nominal torques, above a height, and clear of the cell. Strokes whose torques would be too large
    are slowed.

    Keep out: a file such as `keep_out: [{name: table, kind: box, T_B_O: [0.9, 0, 0.1, 0, 0, 0], size: [0.6, 1.2, 0.2]},
    {name: lamp, kind: ball, T_B_O: [0, 0.8, 1.5, 0, 0, 0], radius: 0.2}, {name: ground, kind: floor}]` [m, rad]. The
    arm is modelled as capsules around its DH lengths and from flange to tool tip; self-collision is not checked. Run
    the motion slowly first.

    Exit code: 0 when there is a motion, 2 when none was found within the limits or the input is invalid.
    """
    modules = krl_files(krl) if krl else (None, None)
    check_writable(output, json_file, csv, *modules, inputs=[arm, *([keep_out] if keep_out else [])])
    believed = ArmFile(arm, base, tip).cell()
    joints = len(believed.nominal_chain().joints)
    limits = _limits(believed, joints, speed, acceleration, torque)
    if start is not None:
        options.start = _values("--start", start, joints)
    if torque_noise is not None:
        options.torque_noise = _values("--torque-noise", torque_noise, joints)
    if lowest is not None:
        options.lowest = lowest
    if believed.tool is not None:
        options.points = np.asarray(believed.tool.T_flange_tool)[:3, 3:]
    options.keep_out = _zones(believed, keep_out, cell_objects)
    if link_radii is not None:
        options.link_radii = _radii(link_radii, joints)
    options.validate()
    every = _interval(believed, interval)
    with share_bar("Designing the motion") as progress:
        found = identification.design_excitation(believed, limits, options, progress)
    if not found.fit.usable:
        fail(found.fit.message)
    keys = _keys(found, believed, every, str(options.criterion) == "condition_unscaled")
    if lowest is None and (warning := _below_base(found, believed, options.keep_out)):
        keys["verdict"] = {"word": "doubtful", "text": f"{warning}; {keys['verdict']['text']}"}
    keys["input"] = {"arm": str(arm), "joints": joints, "seed": options.seed, "options": options.to_dict()}
    _show(found, keys, console(json_file))
    if csv:
        states = found.motion.sampled(every)
        tau = identification.nominal_torques(believed, states) if believed.robot.links else np.empty(0)
        write_motion_csv(states, tau, csv)
    if krl:
        write_krl(found, believed.nominal_chain(), believed.name, krl)
    data = write_result(output, "kr5-excitation/1", **keys)
    write_json(data, json_file)


def _values(option: str, text: str, joints: int) -> np.ndarray:
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        fail(f"{option}: found {text!r}, expected {joints} numbers with commas between")
    if len(values) != joints or not all(map(math.isfinite, values)):
        fail(f"{option}: found {text!r}, expected {joints} finite numbers, one a joint")
    return np.array(values)


def _zones(believed: kr5.cell.Cell, file: Path | None, cell_objects: bool) -> list[Any]:
    """Zones of the file, and the objects of the cell; of its plane the extent is not known."""
    objects = predict.scanner_objects(believed) if cell_objects else []
    own = [identification.keep_out_of(o) for o in objects if o.name != "plane"]
    return own + (identification.load_keep_out(file) if file else [])


def _radii(text: str, joints: int) -> np.ndarray:
    count = text.count(",") + 1
    if count > joints + 1:
        fail(f"--link-radii: found {count} numbers, expected at most {joints + 1}: one a link and one of the tool")
    return _values("--link-radii", text, count)


def _limits(
    believed: kr5.cell.Cell, joints: int, speed: str | None, acceleration: str | None, torque: str | None
) -> Any:
    stated = believed.robot.limits
    if stated is not None and not len(stated.velocity) and speed is not None:
        stated.velocity = _values("--speed", speed, joints)
        believed.robot.limits = stated
    limits = identification.motion_limits(believed)
    for option, text, name in (
        ("--speed", speed, "speed"),
        ("--acceleration", acceleration, "acceleration"),
        ("--torque", torque, "torque"),
    ):
        if text is not None:
            setattr(limits, name, _values(option, text, joints))
    if not len(limits.torque):
        print_note(
            "the cell states no torque limits (robot.limits.effort) and --torque is not given: torques are not limited"
        )
    return limits


def _interval(believed: kr5.cell.Cell, given: float | None) -> float:
    if given is not None and not (math.isfinite(given) and given > 0):
        fail(f"--interval: found {given}, expected a time above 0 [s]")
    return given or (believed.servo.cycle if believed.servo else robot.usual_cycle)


def _keys(
    found: kr5.identification.Excitation, believed: kr5.cell.Cell, every: float, unscaled: bool
) -> dict[str, Any]:
    duration = found.motion.duration()
    columns = "in SI units" if unscaled else "of unit length"
    condition = found.condition_unscaled if unscaled else found.condition
    figures = [
        figure_row("base parameters", found.base_parameters, None, "-"),
        figure_row("condition number, columns of unit length", found.condition, None, "-"),
        figure_row("condition number, columns in SI units", found.condition_unscaled, None, "-"),
        figure_row(f"before the exchanges, columns {columns}", found.condition_after[0], None, "-"),
        figure_row("duration", duration, None, "s"),
        figure_row("minimum height of flange and tool", 1e3 * found.lowest, None, "mm"),
    ]
    if found.nearest:
        figures.append(figure_row(f"minimum clearance: {found.nearest}", 1e3 * found.clearance, None, "mm"))
    if found.slowed_strokes:
        figures.append(figure_row("strokes slowed because of torques", found.slowed_strokes, None, "-"))
    shown = found.motion.sampled(max(every, duration / MOST_SHOWN))
    word = "good" if condition <= BOOK_CONDITION else "doubtful"
    text = (
        f"condition number {condition:.1f} of {found.base_parameters} base parameters, columns {columns};"
        f" the PTP motion of Hayat et al. 2022 has {BOOK_CONDITION:.0f} for the 52 of a KR5"
    )
    return {
        "verdict": {"word": word, "text": text},
        "figures": figures,
        "result": {
            **found.to_dict(),
            "units": ["m" if str(j.type) == "prismatic" else "rad" for j in believed.nominal_chain().joints],
            "t": shown.t,
            "q": shown.q,
            "qd": shown.qd,
        },
    }


def _below_base(
    found: kr5.identification.Excitation, believed: kr5.cell.Cell, zones: list[identification.KeepOut]
) -> str:
    """A warning of a motion below the base of an arm that stands on it, of which no floor is known."""
    stands = believed.robot.gravity[2] < 0
    has_floor = any(str(zone.kind) == "floor" for zone in zones)
    if found.lowest >= 0 or has_floor or not stands:
        return ""
    return (
        f"flange or tool goes {-1e3 * found.lowest:.0f} mm below the base: --lowest 0 keeps the motion above it, and a"
        " smaller number states a lower floor"
    )


def _show(found: kr5.identification.Excitation, keys: dict[str, Any], out: Console) -> None:
    print_result(keys, out)
    rows = []
    for j, position in enumerate(found.position_use):
        torque = 100 * float(found.torque_use[j]) if len(found.torque_use) else None
        peak = float(found.torque_peak[j]) if len(found.torque_peak) else None
        use = (100 * float(part) for part in (position, found.speed_use[j], found.acceleration_use[j]))
        rows.append([f"{j + 1}", *use, torque if torque is not None else "–", peak if peak is not None else "–"])
    names = ["joint", "range [%]", "speed [%]", "acceleration [%]", "torque [%]", "peak torque [N m or N]"]
    out.print()
    out.print(make_table("Use of the limits", names, rows))
