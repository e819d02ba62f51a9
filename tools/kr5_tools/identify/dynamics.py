"""`kr5 identify dynamics`: inertial parameters, friction and rotors of an arm from its motion and torques."""

from pathlib import Path
from typing import Annotated, Any, cast

import kr5.identification
import numpy as np
import typer
from kr5 import identification
from kr5.files.result_types import ResultData
from kr5.files.results import write_result
from kr5.files.writing import check_writable, write_json
from kr5.logs.joint_motion import arm_model
from kr5.logs.log_file import LOG_FORMATS

from kr5_tools.cli.arguments import JsonOption, ResultOption
from kr5_tools.cli.arm_file import BaseOption, TipOption, arm_file
from kr5_tools.cli.options import options_from
from kr5_tools.cli.table_options import ColumnsOption, EpisodesOption
from kr5_tools.cli.tables import figure_row, make_table, print_result
from kr5_tools.cli.terminal import Console, console, fail, print_note, spinner
from kr5_tools.identify.dynamics_errors import error_rows
from kr5_tools.identify.dynamics_parts import SHOWN_SAMPLES, Part, condition_parts
from kr5_tools.identify.identified_cell import expected_bodies, write_identified_cell
from kr5_tools.identify.motion_logs import MotionLogs, conditioning_of, log_and_terms_options, read_motions

app = typer.Typer()
DOUBTFUL_CONDITION = 1000.0
OVERFIT = 1.5  # held-out error over fitted error that is a reason for a warning


@app.command(epilog="Example: kr5 identify dynamics recordings/monday --choose-terms -o dynamics.json")
@options_from(identification.DynamicsOptions, skip=("held_out", "prior_bodies"))
@log_and_terms_options
def dynamics(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="RECORDING",
            help=f"Folder of a recording (recording.yaml); or a log ({LOG_FORMATS}), with --cell or --map.",
        ),
    ],
    context: typer.Context,
    options: identification.DynamicsOptions,
    log: identification.ConditioningOptions,
    terms: identification.JointTerms,
    cell: Annotated[
        Path | None,
        typer.Option(
            "--cell", metavar="CELL", help="Cell file, URDF or MJCF of the arm; for a log, its map is guessed."
        ),
    ] = None,
    map_file: Annotated[
        Path | None,
        typer.Option("--map", metavar="MAP.yaml", help="Meaning of the columns of a log; see kr5 recording guess."),
    ] = None,
    held_out: Annotated[
        float,
        typer.Option(
            min=0.0,
            max=0.9,
            help="Last part of the motion, held out for validation where the recording names no check experiments [-].",
        ),
    ] = 1 / 3,
    columns: ColumnsOption = None,
    episodes: EpisodesOption = "",
    base: BaseOption = "",
    tip: TipOption = "",
    output: ResultOption = None,
    page: Annotated[
        Path | None,
        typer.Option("--page", metavar="FILE.html", help="Page with torques by joint, tables and findings."),
    ] = None,
    write_cell: Annotated[
        Path | None,
        typer.Option("--write-cell", metavar="OUT.yaml", help="Cell with the identified links, rotors and friction."),
    ] = None,
    json_file: JsonOption = None,
) -> None:
    """Dynamic parameters that the data determine, with standard deviations, and the torques that they predict on
    held-out data.

    The log is conditioned first, and its faults are named; from a faulty log nothing is estimated. Exit code 2 when
    the log or the motion does not determine the parameters.
    """
    options.validate()
    check_writable(output, page, write_cell, json_file, inputs=[source, cell, map_file])
    motions = read_motions(source, arm_file(cell, base, tip), map_file, held_out, columns, episodes)
    conditioning = conditioning_of(log, motions.cell)
    model = arm_model(motions.cell, [terms] * motions.cell.robot.joints)
    options.held_out = 0.0
    options.prior_bodies = expected_bodies(motions.cell)
    if not _is_stated(context, "smooth_torques"):
        with spinner("Comparing torques as logged and smoothed"):
            chosen = identification.choose_torque_smoothing(motions.fit, conditioning, model)
        conditioning.smooth_torques = chosen.smooth
        if not chosen.smooth:
            print_note(_logged_text(chosen))
    fit, check = condition_parts(motions, conditioning)
    with spinner("Identifying the dynamics"):
        result = identification.identify_dynamics(
            identification.merged_motion([p.motion for p in fit.parts]), model, options
        )
    if not result.fit.usable:
        fail(f"{source}: {result.fit.message}")
    keys = result_keys(source, motions, result, fit, check)
    _show(keys, result, console(json_file))
    data = write_result(output, "kr5-dynamics/1", **keys)
    if page:
        from kr5_tools.identify.dynamics_page import write_page

        write_page(cast(ResultData, data), str(source), page, None)
    if write_cell:
        write_identified_cell(
            motions.cell, identification.merged_motion([p.motion for p in fit.parts]), result, options, write_cell
        )
    write_json(data, json_file)


def _logged_text(chosen: kr5.identification.TorqueSmoothing) -> str:
    return (
        "torques are fitted as logged (--no-smooth-torques): on a third of the motion left out their error is"
        f" {100 * chosen.error_logged:.3g} % instead of {100 * chosen.error_smoothed:.3g} %"
    )


def _is_stated(context: typer.Context, option: str) -> bool:
    """Whether an option was given on the command line."""
    source = context.get_parameter_source(option)
    return source is not None and source.name == "COMMANDLINE"


def _judged(result: kr5.identification.DynamicsResult, part: Part) -> tuple[dict[str, Any], dict[str, Any]]:
    """Errors of a part against the torques as logged and as smoothed, and the curves of its plot."""
    motion = identification.merged_motion([p.motion for p in part.parts])
    predicted = np.asarray(identification.predict_torques(result, motion))
    measured, smoothed = part.measured(), np.asarray(motion.tau)
    every = max(1, len(predicted) // SHOWN_SAMPLES)
    as_logged, as_smoothed = (identification.torque_error(m, predicted).to_dict() for m in (measured, smoothed))
    errors = {**as_logged, "smoothed": as_smoothed}
    curves = {"t": np.asarray(motion.t)[::every], "measured": smoothed[::every], "predicted": predicted[::every]}
    return errors, curves


def result_keys(
    source: Path, motions: MotionLogs, result: kr5.identification.DynamicsResult, fit: Part, check: Part
) -> dict[str, Any]:
    """What the result file holds beside its head."""
    base, seen = result.base, result.observability
    figures = [
        figure_row(e, float(v), float(s), unit.replace("^2", "²"))
        for e, v, s, unit in zip(base.expressions, result.values, result.deviations, base.units, strict=True)
    ]
    errors, curves = {}, {}
    errors["fitted"], curves["fitted"] = _judged(result, fit)
    if check.parts:
        errors["held_out"], curves["held_out"] = _judged(result, check)
    findings = [f.to_dict() for f in (*fit.findings, *check.findings)]
    return {
        "input": {"source": str(source), "experiments": motions.names, "notes": motions.notes},
        "verdict": verdict_of(result, errors, findings),
        "figures": figures,
        "held_out": {"total": errors["held_out"]["total"]} if check.parts else {},
        "result": {
            "fit": result.fit.to_dict(),
            "expressions": base.expressions,
            "values": result.values,
            "deviations": result.deviations,
            "covariance": result.covariance,
            "standard": dict(zip(base.parameters, np.asarray(result.parameters), strict=True)),
            "condition": seen.condition,
            "scaled_condition": seen.scaled_condition,
            "unidentifiable": seen.unidentifiable,
            "unmoved": seen.unmoved,
            "terms": [t.to_dict() for t in result.model.terms],
            "estimate": {
                "estimator": str(result.estimator),
                "prior_spread": result.prior_spread,
                "min_speed": result.min_speed,
            },
            "conditioning": {
                "cutoff": fit.parts[0].cutoff,
                "decimation": fit.parts[0].decimation,
                "samples": sum(len(p.motion.t) for p in fit.parts),
            },
            "errors": errors,
            "curves": curves,
            "findings": findings,
        },
    }


def verdict_of(
    result: kr5.identification.DynamicsResult, errors: dict[str, Any], findings: list[dict[str, Any]]
) -> dict[str, str]:
    """Good unless the data leave warnings, which are named."""
    seen, warnings = result.observability, [f["text"] for f in findings if str(f["severity"]) == "warning"]
    if seen.unidentifiable:
        warnings.append(
            f"the motion does not determine {len(seen.unidentifiable)} combinations:"
            f" {', '.join(seen.unidentifiable[:4])}"
        )
    if seen.scaled_condition > DOUBTFUL_CONDITION:
        warnings.append(f"condition number {seen.scaled_condition:.3g}, so some parameters are determined poorly")
    text = f"{result.base.size} base parameters; torque error {100 * errors['fitted']['total']:.3g} % fitted"
    if "held_out" in errors:
        text += f", {100 * errors['held_out']['total']:.3g} % held out"
        if errors["held_out"]["total"] > OVERFIT * errors["fitted"]["total"]:
            warnings.append("torques of the held-out part are predicted much worse than those that were fitted")
    return {"word": "doubtful" if warnings else "good", "text": "; ".join([text, *warnings])}


def _show(keys: dict[str, Any], result: kr5.identification.DynamicsResult, out: Console) -> None:
    print_result(keys, out)
    columns, rows = error_rows(keys["result"]["errors"])
    out.print()
    out.print(make_table("Torque errors, measured minus predicted", columns, rows))
    seen = result.observability
    out.print(f"condition number {seen.condition:.4g}, with columns of unit length {seen.scaled_condition:.4g}")
