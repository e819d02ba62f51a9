"""`kr5 gap explain`: what an effect does, and what a recording says for and against it."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from . import common

What = Annotated[Path, typer.Argument(metavar="GAP.json|RECORDING", help="A diagnosis, or the folder of a recording.")]
EffectAt = Annotated[str | None, typer.Argument(metavar="EFFECT[:TARGET]", help="Such as stribeck_friction or stribeck_friction:joint3; "
                                                "without it the verdict is explained.")]
Recording = Annotated[Path | None, typer.Option("--recording", metavar="FOLDER", help="The recording of a diagnosis, when it is not where "
                                                "the file says.")]


def add_to(app: typer.Typer) -> None:
    app.command("explain", epilog="Example: kr5 gap explain gap.json stribeck_friction:joint3")(explain)


def explain(what: What, effect: EffectAt = None, recording: Recording = None, json_file: common.Json = None) -> None:
    """Explains a verdict, or one effect: what it does, in which columns it shows, what the recording says for and against it.

    The effect is fitted to the `fit` experiments and judged on the `check` experiments; with a diagnosis in the place of
    the cause that it comes nearest to.
    """
    from .gap_report_data import Evidence

    name, _, target = (effect or "").partition(":")
    row = _effect(name) if name else None
    data, found = _read(what, recording, diagnose=row is None)
    if row is None:
        evidence = Evidence(data, found) if found else None
        told = explain_verdict(data, evidence)
    else:
        if found is None:
            common.fail(f"{what}: its recording was not found; name it with --recording FOLDER")
        told = explain_effect(row, target, data, Evidence(data, found))
    common.write_json(told, json_file)
    show(told, common.console(json_file))


def _effect(name: str) -> Any:
    import kr5.cell

    return kr5.cell.find_effect(name)


def _read(what: Path, recording: Path | None, diagnose: bool) -> tuple[dict[str, Any], Any]:
    """The diagnosis and its recording; of a bare recording made now, if it is needed, else one that blames nothing."""
    import kr5.cell
    import kr5.gap

    from .gap_report import check
    from .gap_report_data import find_recording

    if not what.is_dir():
        data = common.read_result(what, "kr5-gap/1")
        check(data, what)
        return data, find_recording(data, what, recording)
    found = kr5.cell.load_recording(what)
    if diagnose:
        from .gap_diagnose import run_diagnosis

        return json.loads(run_diagnosis(found, common.simulator(False), kr5.gap.DiagnoseOptions()).to_json()), found
    return {"verdict": "unknown", "where": [], "causes": [], "unexplained": [], "warnings": []}, found


def explain_verdict(data: dict[str, Any], evidence: Any) -> dict[str, Any]:
    """The verdict with its causes, for and against each."""
    from .gap_report import cause_rows, floor_words
    from .gap_report_words import next_steps, notes, verdict_words

    with common.working("Trying what else it could be …"):
        causes = cause_rows(data, evidence)
    where = str(evidence.recording.folder) if evidence else "RECORDING"
    return {"verdict": data["verdict"], "text": verdict_words(data) + floor_words(data, evidence), "causes": causes,
            "notes": [" ".join(note) for note in notes(data.get("warnings", []))], "next": next_steps(data, where)}


def explain_effect(row: Any, target: str, data: dict[str, Any], evidence: Any) -> dict[str, Any]:
    """What the catalogue says of an effect, and what the recording says of it on each target."""
    from .gap_report_effects import words_of

    targets = evidence.recording.cell.effect_targets(row.id)
    if target and target not in targets:
        common.fail(f"{row.id}: found target '{target}', expected {'one of ' + ', '.join(targets) if targets else 'a cell that has such a part'}")
    words = words_of(row.id)
    told = {"effect": row.id, "name": words.name, "what": row.description, "shows": words.shows, "mend": words.mend,
            "parameters": [{"name": p.name, "unit": p.unit, "what": p.description} for p in row.parameters], "targets": []}
    with common.working("Fitting …"):
        found = best_trials(row, [target] if target else targets, data["causes"], evidence)
    for at, trial, k in found:
        told["targets"].append(_trial_words(at, trial, row, data, evidence, k))
    return told


def best_trials(row: Any, targets: list[str], causes: list[dict[str, Any]], evidence: Any) -> list[tuple[str, Any, int | None]]:
    """The effect on each target, in the place of the cause (by its number) where it does most, or of the one it is; best first."""
    import kr5.gap

    best: dict[str, tuple[Any, int | None]] = {}
    blamed = {c["target"]: k for k, c in enumerate(causes) if c["effect"] == row.id}
    for k in range(len(causes)) or [None]:
        names = [kr5.gap.EffectName(effect=row.id, target=at) for at in targets if blamed.get(at, k) == k]
        cell = evidence.cell_with([j for j in range(len(causes)) if j != k])
        for trial in kr5.gap.try_effects(evidence.recording, cell, evidence.simulator, names, evidence.options):
            if trial.target not in best or trial.closed > best[trial.target][0].closed:
                best[trial.target] = trial, k
    found = [(at, *best.get(at, (None, None))) for at in targets]
    return sorted(found, key=lambda row: -(row[1].closed if row[1] else -1.0))


def as_cause(trial: Any) -> dict[str, Any]:
    """In the form of a cause of kr5-gap/1."""
    def shaped(value: list[float]) -> Any:
        return value[0] if len(value) == 1 else [value[i:i + 4] for i in range(0, 16, 4)] if len(value) == 16 else value

    parameters = {p.name: {"value": shaped(list(p.value)), "std": shaped(list(p.std)), "unit": p.unit} for p in trial.parameters}
    return {"effect": trial.effect, "target": trial.target, "parameters": parameters}


def _trial_words(target: str, trial: Any, row: Any, data: dict[str, Any], evidence: Any, k: int | None) -> dict[str, Any]:
    from .gap_report_evidence import parameter_rows
    from .gap_report_words import column_words, effect_words, listed, percent

    out: dict[str, Any] = {"target": target, "name": effect_words(row.id, target), "closed": None, "for": [], "against": [], "parameters": []}
    if trial is None:
        return {**out, "against": ["It changes nothing that was recorded: this recording cannot speak about it."]}
    columns = [(c.column, c.before, c.after) for c in trial.columns]
    out |= {"closed": trial.closed, "choice": trial.choice, "parameters": parameter_rows(as_cause(trial), evidence.recording.cell),
            "columns": [{"column": g, "before": b, "after": a} for g, b, a in columns]}
    blamed = k is not None and (data["causes"][k]["effect"], data["causes"][k]["target"]) == (row.id, target)
    place = "" if k is None or blamed else f" in the place of {effect_words(data['causes'][k]['effect'], data['causes'][k]['target'])}"
    if not any(b > evidence.limit(g) for g, b, _ in columns):
        out["against"].append("There is no gap that it could explain.")
    elif trial.closed > 0.01:
        judged = ", on experiments not used to fit" if any(str(e.split) == "check" for e in evidence.experiments) else ""
        out["for"].append(f"Fitted{place}, it closes {percent(trial.closed)} of the excess{judged}.")
    else:
        out["against"].append(f"Fitted{place} as well as it can be, it closes less than 1 % of the excess.")
    better = [(g, b, a) for g, b, a in columns if a < b - 0.02][:4]
    if better:
        out["for"].append("Better with it: " + listed([f"the {column_words(g)} ({b:.2f} → {a:.2f})" for g, b, a in better]) + ".")
    left = sorted(((g, a) for g, b, a in columns if b > evidence.limit(g) and a > 1.02 * evidence.limit(g)), key=lambda p: -p[1])
    if left:
        out["against"].append("It leaves " + listed([f"the {column_words(g)} at {a:.2f}" for g, a in left[:4]])
                              + (f" and {len(left) - 4} more columns above the floor" if len(left) > 4 else "") + "; 1 is the floor.")
    worse = [(g, b, a) for g, b, a in columns if a > b + 0.02 and a > evidence.limit(g)][:3]
    out["against"] += [f"Worse with it: the {column_words(g)} ({b:.2f} → {a:.2f})." for g, b, a in worse]
    if blamed:
        out["for"].append(f"The diagnosis blames it, {percent(data['causes'][k]['probability'])} probable.")
    if data["causes"] and not blamed:
        out["against"].append(f"The diagnosis blames {listed([effect_words(c['effect'], c['target']) for c in data['causes']])}, not this.")
    return out


def show(told: dict[str, Any], to: Any) -> None:
    """For people."""
    from .gap_report_words import capital

    def say(text: str, style: str = "") -> None:
        to.print(text, style=style, soft_wrap=True, markup=False)

    if "text" in told:
        say(told["text"], "bold")
        for cause in told["causes"]:
            to.print()
            say(f"{cause['name']} ({cause['id']}), {cause['sure']} probable", "bold")
            say(f"  {cause['what']}{f'. Shows in {cause_shows}' if (cause_shows := cause['shows']) else ''}.")
            _show_reasons(cause, to, say)
        for title, rows in (("Notes", told["notes"]), ("What to do now", [s.replace("`", "") for s in told["next"]])):
            if rows:
                to.print()
                say(title, "bold")
            for row in rows:
                say(f"  - {row}")
        return
    say(f"{capital(told['name'])} ({told['effect']})", "bold")
    say(f"  {capital(told['what'])}.")
    if told["shows"]:
        say(f"  Shows in {told['shows']}.")
    for p in told["parameters"]:
        say(f"  {p['name']} [{p['unit']}]: {p['what']}")
    if len(told["targets"]) > 1:
        rows = [[t["target"], "–" if t["closed"] is None else f"{min(max(100 * t['closed'], 0.0), 100.0):.1f}", _values(t)] for t in told["targets"]]
        to.print()
        to.print(common.table("On each target, fitted alone", ["target", "closes [%]", "values"], rows, text=(2,)))
    best = told["targets"][0]
    to.print()
    say(capital(best["name"]) + (f" ({best['choice']})" if best.get("choice") else ""), "bold")
    _show_reasons(best, to, say)
    if told["mend"]:
        say(f"  What to do if it is the cause: {told['mend'].replace('`', '')}")


def _values(trial: dict[str, Any]) -> str:
    """The values of a trial, where it does anything."""
    if trial["closed"] is None:
        return "changes nothing that was recorded"
    if trial["closed"] < 0.005:
        return "best left off"
    return "; ".join(f"{p['name']} {p['value']} {p['std']} {p['unit']}" for p in trial["parameters"])


def _show_reasons(cause: dict[str, Any], to: Any, say: Any) -> None:
    if cause["parameters"]:
        rows = [[f"  {p['name']}", p["value"], p["std"], p["unit"], p["nominal"]] for p in cause["parameters"]]
        to.print(common.table("", ["  what", "value", "± std", "unit", "cell says"], rows, text=(3,)))
    for title, key in (("For it", "for"), ("Against it", "against"), ("In its place", "rivals")):
        if cause.get(key):
            say(f"  {title}:")
        for text in cause.get(key, ()):
            say(f"    - {text}")
