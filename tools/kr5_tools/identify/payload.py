"""`kr5 identify payload`: mass, centre and inertia of a load at the flange, from the torques with it."""

from pathlib import Path
from typing import Annotated, Any, cast

import kr5.cell
import kr5.identification
import numpy as np
import typer
from kr5 import cell as kr5_cell
from kr5 import identification, kinematics
from kr5.files.result_types import ResultData
from kr5.files.results import write_result
from kr5.files.writing import beside, check_writable, write_json
from kr5.logs.joint_motion import arm_model
from kr5.logs.log_file import LOG_FORMATS

from kr5_tools.cli.arguments import JsonOption, ResultOption
from kr5_tools.cli.arm_file import BaseOption, TipOption, arm_file
from kr5_tools.cli.options import options_from
from kr5_tools.cli.table_options import ColumnsOption, EpisodesOption
from kr5_tools.cli.tables import figure_row, make_table, print_result
from kr5_tools.cli.terminal import Console, console, fail, print_note, spinner
from kr5_tools.identify.dynamics_parts import SHOWN_SAMPLES, condition_parts
from kr5_tools.identify.identified_cell import believed_parameters, tool_body
from kr5_tools.identify.motion_logs import MotionLogs, conditioning_of, log_and_terms_options, read_motions

app = typer.Typer()
MOMENTS = ("mass", "m cx", "m cy", "m cz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz")
SEEN = 3.0  # standard deviations above which a load is told from none


@app.command(epilog="Example: kr5 identify payload loaded --without bare -o payload.json --page payload.html")
@options_from(identification.PayloadOptions)
@log_and_terms_options
def payload(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="LOADED",
            help=f"Motion with the load: folder of a recording, or a log ({LOG_FORMATS}), with --cell or --map.",
        ),
    ],
    options: identification.PayloadOptions,
    log: identification.ConditioningOptions,
    terms: identification.JointTerms,
    without: Annotated[
        Path | None,
        typer.Option(
            metavar="BARE",
            help="Motion of the same arm without the load; by default the masses of the cell are trusted.",
        ),
    ] = None,
    cell: Annotated[
        Path | None,
        typer.Option("--cell", metavar="CELL", help="Cell file of the arm, as identified; or its URDF or MJCF."),
    ] = None,
    map_file: Annotated[
        Path | None, typer.Option("--map", metavar="MAP.yaml", help="Meaning of the columns of both logs.")
    ] = None,
    columns: ColumnsOption = None,
    episodes: EpisodesOption = "",
    base: BaseOption = "",
    tip: TipOption = "",
    output: ResultOption = None,
    page: Annotated[
        Path | None, typer.Option("--page", metavar="FILE.html", help="Page with what the load adds to each torque.")
    ] = None,
    write_cell: Annotated[
        Path | None, typer.Option("--write-cell", metavar="OUT.yaml", help="Cell whose tool carries the load.")
    ] = None,
    json_file: JsonOption = None,
) -> None:
    """Mass, centre of mass and inertia of the load at the flange beside the tool of the cell, with standard deviations.

    With two logs nothing is assumed: the arm is identified from the one without the load. With one log the load is
    what the masses and friction of the cell leave unexplained, so the cell should be identified first. Exit code 2
    when the log or the motion does not determine the load.
    """
    options.validate()
    check_writable(output, page, write_cell, json_file, inputs=[source, without, cell, map_file])
    loaded, arm = read_motions(source, arm_file(cell, base, tip), map_file, 0.0, columns, episodes), None
    motion = conditioned(loaded, log)
    if without:
        bare = read_motions(without, arm_file(cell, base, tip), map_file, 0.0, columns, episodes)
        arm = identified_arm(bare, conditioned(bare, log), terms, without)
    with spinner("Identifying the payload"):
        if arm is not None:
            parameters = np.asarray(arm.parameters)
            model, result = arm.model, identification.identify_payload(motion, arm, options)
        else:
            model = arm_model(loaded.cell, [terms] * loaded.cell.robot.joints)
            parameters = believed_parameters(loaded.cell, model)
            result = identification.identify_payload(motion, model, parameters, options)
    if not result.fit.usable:
        fail(f"{source}: {result.fit.message}")
    keys = result_keys(source, without, loaded, result)
    keys["result"]["curves"] = load_curves(motion, model, parameters, result, options.refit_friction)
    print_result(keys, console(json_file))
    _show(result, console(json_file))
    data = write_result(output, "kr5-payload/1", **keys)
    if page:
        from kr5_tools.identify.payload_page import write_page

        write_page(cast(ResultData, data), str(source), page, None)
    if write_cell:
        with beside(write_cell) as new:
            kr5_cell.save_cell(with_payload(loaded.cell, result), new)
    write_json(data, json_file)


def conditioned(motions: MotionLogs, log: kr5.identification.ConditioningOptions) -> identification.JointMotion:
    """All motions of a source as one; a payload needs none that are held out."""
    options = conditioning_of(identification.ConditioningOptions.from_dict(log.to_dict()), motions.cell)
    motions.fit, motions.check = [*motions.fit, *motions.check], []
    fit, _ = condition_parts(motions, options)
    return identification.merged_motion([p.motion for p in fit.parts])


def identified_arm(
    bare: MotionLogs, motion: kr5.identification.JointMotion, terms: identification.JointTerms, source: Path
) -> identification.DynamicsResult:
    """The arm without the load."""
    model = arm_model(bare.cell, [terms] * bare.cell.robot.joints)
    with spinner("Identifying the arm without the load"):
        out = identification.identify_dynamics(motion, model, identification.DynamicsOptions(held_out=0.0))
    if not out.fit.usable:
        fail(f"--without {source}: {out.fit.message}")
    return out


def load_curves(
    motion: kr5.identification.JointMotion,
    model: kr5.identification.DynamicsModel,
    parameters: np.ndarray,
    result: kr5.identification.PayloadResult,
    friction: bool,
) -> dict[str, Any]:
    """What the load adds to the torques: measured less the arm without it, and by the body that was found."""
    regressor = identification.DynamicsRegressor(model)
    added = np.asarray(motion.tau) - np.asarray(regressor.torques(motion, parameters))
    m, mcx, mcy, mcz, *second = np.asarray(result.moments)
    chi = np.zeros_like(parameters)
    chi[13 * (np.asarray(motion.q).shape[1] - 1) :][:10] = [*second, mcx, mcy, mcz, m]
    body = np.asarray(regressor.link_torques(motion, chi))
    every = max(1, len(body) // SHOWN_SAMPLES)
    return {"t": np.asarray(motion.t)[::every], "measured": added[::every], "predicted": body[::every]}


def result_keys(
    source: Path, without: Path | None, motions: MotionLogs, result: kr5.identification.PayloadResult
) -> dict[str, Any]:
    """What the result file holds beside its head."""
    body, sigma = result.body, np.sqrt(np.diag(np.asarray(result.covariance)))
    com = zip("xyz", np.asarray(body.com), np.asarray(result.com_deviation), strict=True)
    figures = [figure_row("mass", float(body.mass), float(result.mass_deviation), "kg")]
    figures += [figure_row(f"centre {axis}", 1e3 * float(c), 1e3 * float(s), "mm") for axis, c, s in com]
    figures += [
        figure_row(f"{name} about the flange", float(v), float(s), "kg m²")
        for name, v, s in zip(MOMENTS[4:], np.asarray(result.moments)[4:], sigma[4:], strict=True)
    ]
    return {
        "input": {"source": str(source), "without": str(without) if without else None, "notes": motions.notes},
        "verdict": verdict_of(result, without is not None),
        "figures": figures,
        "result": {
            "fit": result.fit.to_dict(),
            "mass": body.mass,
            "com": body.com,
            "moments": dict(zip(MOMENTS, np.asarray(result.moments), strict=True)),
            "covariance": result.covariance,
            "possible": result.possible,
            "errors": {"fitted": result.fitted.to_dict(), "without": result.without.to_dict()},
        },
    }


def verdict_of(result: kr5.identification.PayloadResult, compared: bool) -> dict[str, str]:
    """Good unless the data leave warnings, which are named."""
    warnings = []
    if abs(result.body.mass) < SEEN * result.mass_deviation:
        warnings.append("the mass is not distinguishable from 0")
    elif not result.possible:
        warnings.append(
            "no such body can exist: the inertia is determined too poorly; mass and centre of mass may still be right"
        )
    if not compared:
        warnings.append(
            "the masses and friction of the cell are trusted; their errors are not in the standard deviations"
        )
    text = (
        f"{result.body.mass:.3g} kg; torque error {100 * result.fitted.total:.3g} % with the load,"
        f" {100 * result.without.total:.3g} % without"
    )
    return {"word": "doubtful" if warnings else "good", "text": "; ".join([text, *warnings])}


def _show(result: kr5.identification.PayloadResult, out: Console) -> None:
    errors = zip(np.asarray(result.without.rms), np.asarray(result.fitted.rms), strict=True)
    rows = [[f"{k + 1}", float(a), float(b)] for k, (a, b) in enumerate(errors)]
    out.print()
    out.print(make_table("RMS torque errors [N m]", ["joint", "without the load", "with the load"], rows))


def with_payload(cell: kr5.cell.Cell, result: kr5.identification.PayloadResult) -> Any:
    """A copy of the cell whose tool carries the load; its inertia counts where such a body can exist."""
    out = kr5_cell.parse_cell(cell.to_yaml())
    tool = out.tool if out.tool is not None else kr5_cell.Tool(T_flange_tool=np.eye(4))
    T = np.eye(4) if tool.T_flange_sensor is None else np.asarray(tool.T_flange_sensor)
    body = result.body
    if not result.possible:
        if body.mass <= 0:
            fail("--write-cell: the load has no positive mass, so no tool can carry it")
        print_note("the inertia of the load is not determined; it is written as a point mass")
        body = kinematics.Body(mass=body.mass, com=body.com, inertia=np.zeros(6))
    carried = tool_body(cell)
    merged = kinematics.transformed_body(np.linalg.inv(T), kinematics.merged_body(carried, body) if carried else body)
    tool.mass, tool.com, tool.inertia = merged.mass, merged.com, merged.inertia
    out.tool = tool
    return out
