"""`kr5 sensitivity`: Sobol's indices of a function of Python, or of an arm's parameters."""

from pathlib import Path
from typing import Annotated, Any, cast

import numpy as np
import typer
from kr5 import uncertainty
from kr5.files import results, writing
from kr5.files.result_types import ResultData

from kr5_tools.cli import arguments, terminal
from kr5_tools.cli.interruption import tell_when_stopped
from kr5_tools.cli.options import options_from
from kr5_tools.cli.terminal import Console
from kr5_tools.sensitivity import analysis as analysis_module
from kr5_tools.sensitivity import arm as arm_module
from kr5_tools.sensitivity import page
from kr5_tools.sensitivity.analysis import Analysis, evaluate_rows, probe, split_rows
from kr5_tools.sensitivity.inputs_file import Quantity, read_inputs
from kr5_tools.sensitivity.model import ArmModel, ModelError, function_model, model_file
from kr5_tools.sensitivity.outputs_folder import OutputsFolder
from kr5_tools.sweep import runner
from kr5_tools.sweep.runner import core_count

app = typer.Typer()
FORMAT = "kr5-sensitivity/1"
CHOSEN = ("samples", "max_samples", "tolerance", "resolution")  # with defaults of their own, or of the model


@app.command(epilog="Example: kr5 sensitivity --samples 1024 --max-samples 4096 -o sensitivity --png plots")
@options_from(uncertainty.SobolOptions, skip=CHOSEN)
def sensitivity(
    options: uncertainty.SobolOptions,
    model: Annotated[
        str | None,
        typer.Argument(
            metavar="[MODEL]",
            show_default=False,
            help="Function of Python, MODULE:FUNCTION or FILE.py:FUNCTION: it gets the inputs of one sample as an array"
            " in SI and gives a number, a list, or a map of names. Without one the model is an arm.",
        ),
    ] = None,
    inputs: Annotated[
        Path | None,
        typer.Option(metavar="INPUTS.yaml", help="Distributions and units of the inputs of MODEL.", show_default=False),
    ] = None,
    vectorized: Annotated[
        bool, typer.Option("--vectorized", help="MODEL gets all samples at once, as rows of an array.")
    ] = False,
    cell_file: Annotated[
        Path | None,
        typer.Option(
            "--cell",
            metavar="CELL.yaml",
            show_default=False,
            help="Cell with the arm; by default the KR5 Arc of Table 3.1 (share/cells/kr5_arc_printed.yaml).",
        ),
    ] = None,
    pose: Annotated[
        str | None,
        typer.Option(
            metavar="Q,Q,…",
            show_default=False,
            help="Joint values at which the arm stands \\[deg; mm of prismatic joints]; by default 0,70,12,0,0,0.",
        ),
    ] = None,
    workspace: Annotated[
        bool, typer.Option("--workspace", help="The whole workspace, joint values uniform between their limits.")
    ] = False,
    group: Annotated[
        list[str] | None,
        typer.Option(
            metavar="GROUP",
            show_default=False,
            help=(
                "Parameters that vary: all, lengths, angles, or names such as b1,alpha2; in a workspace also"
                " errors, where all includes the joint values as inputs. May be repeated; by default all,"
                " lengths, angles."
            ),
        ),
    ] = None,
    sigma_length: Annotated[float, typer.Option(help="Standard deviation of lengths of the arm \\[mm].")] = 1.0,
    sigma_angle: Annotated[float, typer.Option(help="Standard deviation of angles of the arm \\[deg].")] = 1.0,
    truncation: Annotated[float, typer.Option(help="Standard deviations at which both are cut off \\[-].")] = 3.0,
    samples: Annotated[int, typer.Option(help="Rows of the sample matrices to begin with, a power of two.")] = 1024,
    max_samples: Annotated[int, typer.Option(help="Rows up to which they are doubled.")] = 16384,
    tolerance: Annotated[
        float, typer.Option(help="Half the width of an interval at which no more rows are needed \\[-].")
    ] = 0.01,
    workers: Annotated[
        int | None,
        typer.Option(
            min=1,
            show_default=False,
            help="Number of processes on this machine; by default one per core for what takes longer.",
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS", help="Address of a Dask scheduler whose workers evaluate, e.g. tcp://host:8786."
        ),
    ] = None,
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            metavar="FOLDER",
            help="Folder of result.json, report.html and the outputs that are finished; an interrupted analysis"
            " continues there.",
        ),
    ] = Path("sensitivity"),
    png: arguments.PngOption = None,
    json_file: arguments.JsonOption = None,
) -> None:
    """Sobol's indices: uncertain inputs ranked by their share of the variance of each output, alone (first-order)
    and with interactions (total), with intervals, beside a table of one input at a time.

    Rows are doubled until every interval is narrow enough. Finished rows are on disk at once: after an interruption
    the same command continues. The same seed gives the same result, for any number of workers.
    """
    options.samples, options.max_samples, options.tolerance = samples, max_samples, tolerance
    options.validate()
    writing.check_writable(json_file, inputs=[model_file(model), inputs, cell_file])
    to = terminal.console(json_file)
    try:
        if model is not None:
            _refuse_arm_options(cell_file, pose, workspace, group)
            analyses = [_function_analysis(model, inputs, vectorized, options)]
        else:
            if inputs is not None or vectorized:
                terminal.fail("--inputs, --vectorized: apply only with a MODEL: MODULE:FUNCTION or FILE.py:FUNCTION")
            tolerances = _tolerances(sigma_length, sigma_angle, truncation)
            analyses = _arm_analyses(cell_file, pose, workspace, group, tolerances)
        _check_folder(output, analyses)
        tell_when_stopped(lambda: f"the finished rows are kept in {output}; the same command continues")
        found = [_run(a, output / a.name, options, workers, scheduler, to) for a in analyses]
    except ModelError as error:
        terminal.fail(str(error))
    for one in found:
        page.print_analysis(one, to)
    data = results.write_result(
        output / "result.json",
        FORMAT,
        verdict=_verdict(found),
        input=_input(model, inputs, cell_file),
        result={"analyses": found},
    )
    writing.write_json(data, json_file)
    files = page.write_page(
        cast(ResultData, data), (model or analyses[0].title.split(",")[0]), output / "report.html", png
    )
    if png:
        to.print(f"{png}: {len(files)} plots.", soft_wrap=True, markup=False)
    to.print(f"{output / 'report.html'}: open it in a browser.", soft_wrap=True, markup=False)


def _refuse_arm_options(cell_file: Path | None, pose: str | None, workspace: bool, group: list[str] | None) -> None:
    given = {"--cell": cell_file, "--pose": pose, "--workspace": workspace, "--group": group}
    if wrong := [name for name, value in given.items() if value]:
        terminal.fail(f"{', '.join(wrong)}: apply to an arm; give either these options or MODEL")


def _tolerances(length: float, angle: float, truncation: float) -> arm_module.Tolerances:
    for name, value in (("--sigma-length", length), ("--sigma-angle", angle), ("--truncation", truncation)):
        if not (np.isfinite(value) and value > 0):
            terminal.fail(f"{name}: found {value:g}, expected more than 0")
    return arm_module.Tolerances(1e-3 * length, float(np.radians(angle)), truncation)


def _arm_analyses(
    file: Path | None, pose: str | None, workspace: bool, groups: list[str] | None, tolerances: arm_module.Tolerances
) -> list[Analysis]:
    arm = arm_module.load_arm(file, pose, workspace)
    wanted = [arm_module.check_group(group, arm) for group in groups or ("all", "lengths", "angles")]
    return [arm_module.arm_analysis(arm, group, tolerances) for group in dict.fromkeys(wanted)]


def _function_analysis(given: str, file: Path | None, vectorized: bool, options: uncertainty.SobolOptions) -> Analysis:
    if file is None:
        terminal.fail("--inputs: is missing; expected a file with the distributions of the inputs")
    inputs, units, outputs = read_inputs(file)
    model = function_model(given, vectorized, tuple(q.name for q in units))
    if not outputs:
        sample = uncertainty.sobol_design(inputs, 0, 1, options)[0]
        outputs = [Quantity(name) for name in model.output_names(np.asarray(sample))]
    return Analysis(
        name="model",
        title=model.label,
        text=f"Inputs as in {file.name}.",
        model=model,
        inputs=tuple(inputs),
        units=tuple(units),
        outputs=tuple(outputs),
    )


def _check_folder(output: Path, analyses: list[Analysis]) -> None:
    """Complains of a folder of other things, in which files would be replaced."""
    if output.exists() and not output.is_dir():
        terminal.fail(f"{output}: is a file; expected a new folder, or that of an analysis to continue")
    if output.is_dir() and any(output.iterdir()):
        known = any((output / name / "analysis.json").is_file() for name in {a.name for a in analyses})
        ours = (output / "result.json").is_file() or any(output.glob("*/analysis.json")) or known
        begun = all(f.is_dir() and f.name in {a.name for a in analyses} for f in output.iterdir())
        if not (ours or begun):
            terminal.fail(
                f"{output}: is a folder with other files; expected a new folder, or that of an analysis to continue"
            )


def _run(
    analysis: Analysis,
    folder: Path,
    options: uncertainty.SobolOptions,
    workers: int | None,
    scheduler: str | None,
    to: Console,
) -> dict[str, Any]:
    """The indices of one analysis, with more rows until they are certain enough."""
    own = type(options)(**{**options.to_dict(), "resolution": analysis.resolution})
    count, seconds = probe(analysis, own)
    native = isinstance(analysis.model, ArmModel)
    samples = own.samples
    with OutputsFolder(folder, analysis, count, own) as rows:
        if rows.note:
            terminal.print_note(f"{rows.note}.")
        if rows.rows:
            to.print(f"{folder}: {len(rows.rows)} rows are there.", soft_wrap=True, markup=False)
        while True:
            missing = rows.missing(samples)
            work = seconds * analysis.evaluations_of_row * len(missing)
            processes = workers or (1 if native or work < analysis_module.LONG else core_count())
            job = _job(analysis, own, missing, seconds)
            runner.run_job(job, min(processes, max(1, len(missing))), scheduler, rows.add)
            found = uncertainty.sobol_estimate(rows.outputs(samples), list(analysis.inputs), own)
            if found.converged or 2 * samples > own.max_samples:
                break
            samples *= 2
    return _described(analysis, found, own, count)


def _job(analysis: Analysis, options: uncertainty.SobolOptions, missing: list[int], seconds: float) -> runner.Job:
    def batches(workers: int) -> list[tuple[Any, ...]]:
        parts = split_rows(missing, analysis.evaluations_of_row, workers, seconds)
        return [(analysis.model, analysis.inputs, options, first, count) for first, count in parts]

    return runner.Job(evaluate_rows, batches, len(missing), f"evaluating {analysis.name}", "rows")


def _described(
    analysis: Analysis, found: uncertainty.SobolResult, options: uncertainty.SobolOptions, count: int
) -> dict[str, Any]:
    """The result as it is written: indices in the order of the free inputs, outputs in SI."""
    outputs = analysis.outputs or tuple(Quantity(f"output {k + 1}") for k in range(count))
    alone = uncertainty.one_at_a_time(analysis.model.evaluate, list(analysis.inputs))
    free = analysis.free
    kept = {key: np.asarray(value)[free] for key, value in alone.to_dict().items() if key not in ("inputs", "centre")}
    names = {f"output {k + 1}": q.name for k, q in enumerate(outputs)}
    notes = [_with_names(note, names) for note in found.notes]
    described: dict[str, Any] = writing.to_plain(
        {
            "name": analysis.name,
            "title": analysis.title,
            "text": analysis.text,
            **found.to_dict(),
            "inputs": [
                {**analysis.inputs[k].to_dict(), "unit": analysis.units[k].unit, "factor": analysis.units[k].factor}
                for k in free
            ],
            "outputs": [{"name": q.name, "unit": q.unit, "factor": q.factor} for q in outputs],
            "one_at_a_time": kept,
            "confidence": options.confidence,
            "tolerance": options.tolerance,
            "seed": options.seed,
            "notes": notes,
        }
    )
    return described


def _with_names(note: str, names: dict[str, str]) -> str:
    """A note of the library with the names of the outputs in place of their numbers."""
    for number in sorted(names, key=len, reverse=True):
        note = note.replace(number, names[number])
    return note


def _verdict(found: list[dict[str, Any]]) -> dict[str, str]:
    open_ones = [one["title"] for one in found if not one["converged"]]
    if open_ones:
        text = f"intervals are wider than asked for: {'; '.join(open_ones)}. Raise --max-samples"
        return {"word": "doubtful", "text": text}
    widest = max(page.widest_interval(one) for one in found)
    return {"word": "good", "text": f"every index is known to ± {widest:.2g}"}


def _input(model: str | None, inputs: Path | None, cell_file: Path | None) -> dict[str, Any]:
    given = {"model": model, "inputs": inputs, "cell": cell_file}
    return {key: str(value) for key, value in given.items() if value is not None}
