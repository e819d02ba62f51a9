"""`kr5 gap explain`: what an effect does, and what a recording says for and against it."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import kr5
import kr5.cell
import kr5.gap
import typer
from kr5.files import results, writing
from kr5.logs.compared_source import command_of

from kr5_tools.cli import arguments, tables, terminal
from kr5_tools.cli.terminal import Console
from kr5_tools.gap.explained_targets import TARGET_COLUMNS, target_rows
from kr5_tools.gap.source import known_target
from kr5_tools.gap_report.diagnosis_file import DiagnosisFile, read_diagnosis

if TYPE_CHECKING:
    from kr5_tools.gap_report.evidence_data import Evidence

What = Annotated[
    Path, typer.Argument(metavar="GAP.json|RECORDING", help="Result file of a diagnosis, or the folder of a recording.")
]
EffectAt = Annotated[
    str | None,
    typer.Argument(
        metavar="EFFECT[:TARGET]",
        help=(
            "Effect to explain, e.g. stribeck_friction or stribeck_friction:joint3; without it the verdict is"
            " explained."
        ),
    ),
]
Recording = Annotated[
    Path | None,
    typer.Option(
        "--recording", metavar="FOLDER", help="Recording of the diagnosis, if it is not at the path in the result file."
    ),
]


def add_to(app: typer.Typer) -> None:
    app.command("explain", epilog="Example: kr5 gap explain gap.json stribeck_friction:joint3")(explain)


def explain(
    what: What, effect: EffectAt = None, recording: Recording = None, json_file: arguments.JsonOption = None
) -> None:
    """Explanation of a verdict or of one effect: what it does, in which columns it shows, and the evidence for and
    against it.

    The effect is fitted to the `fit` experiments and evaluated on the `check` experiments; with a diagnosis, in place
    of the most similar cause."""
    from kr5_tools.gap_report.evidence_data import Evidence, named_inputs

    writing.check_writable(json_file, inputs=[what, recording])
    name, _, target = (effect or "").partition(":")
    row = kr5.cell.find_effect(name) if name else None
    diagnosis, recorded = _read(what, recording, diagnose=row is None)
    evidence = Evidence(diagnosis.found, recorded) if recorded else None
    if row is None:
        told = explain_verdict(diagnosis, evidence)
    elif evidence is None:
        named = "logs and their model were" if diagnosis.of_logs else "recording was"
        raise kr5.InvalidArgument(f"{what}: its {named} not found; specify a recording with --recording FOLDER")
    else:
        told = explain_effect(row, target, evidence)
    results.write_result(json_file, "kr5-gap-explanation/1", **told, input=named_inputs(diagnosis.input, evidence))
    print_explanation(told, terminal.console(json_file))


def _read(what: Path, recording: Path | None, diagnose: bool) -> tuple[DiagnosisFile, kr5.cell.Recording | None]:
    """The diagnosis and its recording; of a bare recording made now, if it is needed, else one that blames nothing."""
    from kr5_tools.gap_report.evidence_data import find_recording

    if not what.is_dir():
        diagnosis = read_diagnosis(what)
        return diagnosis, find_recording(diagnosis.input, what, recording)
    recorded = kr5.cell.load_recording(what)
    if diagnose:
        from kr5_tools.gap.diagnosis_run import run_diagnosis

        options = kr5.gap.DiagnoseOptions()
        return DiagnosisFile(run_diagnosis(recorded, arguments.make_simulator(False), options)), recorded
    return DiagnosisFile(kr5.gap.Diagnosis(verdict="unknown")), recorded


def explain_verdict(diagnosis: DiagnosisFile, evidence: "Evidence | None") -> dict[str, Any]:
    """The verdict with its causes, for and against each."""
    from kr5_tools.gap.terminal_report import note_text
    from kr5_tools.gap_report.evidence_data import named_inputs
    from kr5_tools.gap_report.messages import next_steps
    from kr5_tools.gap_report.page import cause_rows, floor_text

    found = diagnosis.found
    with terminal.spinner("Fitting other effects …"):
        causes = cause_rows(found, evidence)
    inputs = named_inputs(diagnosis.input, evidence)
    return {
        "verdict": str(found.verdict),
        "text": found.text + floor_text(found, evidence),
        "causes": causes,
        "notes": [note_text(note) for note in kr5.gap.notes(found, diagnosis.noise_declared)],
        "next": next_steps(diagnosis, command_of(inputs), inputs.get("model"), evidence.cell if evidence else None),
    }


def explain_effect(row: kr5.cell.Effect, target: str, evidence: "Evidence") -> dict[str, Any]:
    """What the catalogue says of an effect, and what the recording says of it on each target."""
    cell = evidence.recording.cell
    targets, target = cell.effect_targets(row.id), known_target(target, cell)
    if target and target not in targets:
        raise kr5.InvalidArgument(
            f"{row.id}: found target '{target}', expected"
            f" {'one of ' + ', '.join(targets) if targets else 'a cell that has such a part'}"
        )
    told: dict[str, Any] = {
        "effect": row.id,
        "name": row.label,
        "what": row.description,
        "shows": row.shows_in,
        "remedy": row.remedy,
        "parameters": [{"name": p.name, "unit": p.unit, "what": p.description} for p in row.parameters],
        "targets": [],
    }
    with terminal.spinner("Fitting …"):
        trials = kr5.gap.try_effect(
            evidence.found, row.id, [target] if target else targets, evidence.recording, evidence.simulator
        )
        told["targets"] = [_trial_row(trial, evidence) for trial in trials]
    return told


def _trial_row(trial: kr5.gap.EffectTrial, evidence: "Evidence") -> dict[str, Any]:
    """What fitting an effect on a target showed, for it and against it."""
    from kr5_tools.gap_report.parameter_rows import parameter_rows

    reasons = kr5.gap.trial_reasons(trial, evidence.found, evidence.told)
    out = {
        "target": trial.target,
        "name": kr5.gap.effect_text(trial.effect, trial.target),
        "closed": None,
        "for": reasons.in_favour,
        "against": reasons.against,
        "parameters": [],
    }
    fit = trial.fit
    if fit is None:
        return out
    return {
        **out,
        "closed": fit.explained_fraction,
        "choice": fit.choice,
        "parameters": parameter_rows(fit, evidence.recording.cell),
        "columns": [{"column": c.column, "before": c.before, "after": c.after} for c in fit.columns],
    }


def print_explanation(told: dict[str, Any], to: Console) -> None:
    """For people."""
    from kr5_tools.gap_report.messages import capitalised

    def say(text: str, style: str = "") -> None:
        to.print(text, style=style, soft_wrap=True, markup=False)

    if "text" in told:
        say(told["text"], "bold")
        for cause in told["causes"]:
            to.print()
            say(f"{cause['name']} ({cause['id']}), {cause['sure']} probable", "bold")
            say(f"  {cause['what']}{f'. Shows in {cause_shows}' if (cause_shows := cause['shows']) else ''}.")
            _show_reasons(cause, to, say)
        for title, rows in (("Notes", told["notes"]), ("Next steps", [s.replace("`", "") for s in told["next"]])):
            if rows:
                to.print()
                say(title, "bold")
            for row in rows:
                say(f"  - {row}")
        return
    say(f"{capitalised(told['name'])} ({told['effect']})", "bold")
    say(f"  {capitalised(told['what'])}.")
    if told["shows"]:
        say(f"  Shows in {told['shows']}.")
    for p in told["parameters"]:
        say(f"  {p['name']} [{p['unit']}]: {p['what']}")
    if len(told["targets"]) > 1:
        to.print()
        to.print(
            tables.make_table("Each target, fitted alone", TARGET_COLUMNS, target_rows(told["targets"]), text=(2,))
        )
    best = told["targets"][0]
    to.print()
    say(capitalised(best["name"]) + (f" ({best['choice']})" if best.get("choice") else ""), "bold")
    _show_reasons(best, to, say)
    if told["remedy"]:
        say(f"  Remedy if it is the cause: {told['remedy'].replace('`', '')}")


def _show_reasons(cause: dict[str, Any], to: Console, say: Callable[[str], None]) -> None:
    if cause["parameters"]:
        rows = [[f"  {p['name']}", p["value"], p["std"], p["unit"], p["nominal"]] for p in cause["parameters"]]
        to.print(tables.make_table("", ["  parameter", "value", "± std", "unit", "cell value"], rows, text=(3,)))
    for title, key in (("For it", "for"), ("Against it", "against"), ("Alternatives", "rivals")):
        if cause.get(key):
            say(f"  {title}:")
        for text in cause.get(key, ()):
            say(f"    - {text}")
