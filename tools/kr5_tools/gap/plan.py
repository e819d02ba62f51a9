"""`kr5 gap plan`: the experiment that tells apart what a recording cannot."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import kr5
import kr5.cell
import kr5.gap
import typer
import yaml
from kr5.files import results, writing

from kr5_tools.cli import arguments, tables, terminal
from kr5_tools.cli.numbers import format_percent
from kr5_tools.cli.options import options_from
from kr5_tools.cli.terminal import Console
from kr5_tools.gap.source import known_target

MOST_REPEATS = 20  # written to a protocol
MOST_ALTERNATIVES = 4
Folder = Annotated[Path, typer.Argument(metavar="RECORDING", help="The folder of a recording (recording.yaml).")]
Separate = Annotated[
    str | None,
    typer.Option(
        "--separate",
        metavar="EFFECT:TARGET,…",
        help=(
            "Alternatives to distinguish, e.g. coulomb_friction:joint3,payload:tool; + joins effects that act together."
            " By default those that a diagnosis of the recording cannot distinguish."
        ),
    ),
]
Protocol = Annotated[
    Path | None,
    typer.Option(
        "-o",
        "--output",
        metavar="NEXT.yaml",
        help="Protocol of the best experiment; its columns go into a CSV file beside it.",
    ),
]
Done = Annotated[
    list[Path] | None,
    typer.Option(
        "--done",
        metavar="FOLDER",
        help="Recording of the planned experiment, to compare the alternatives on both. May be given several times.",
    ),
]


def add_to(app: typer.Typer) -> None:
    app.command(
        "plan",
        epilog=(
            "Example: kr5 gap plan recordings/monday --separate coulomb_friction:joint3,stribeck_friction:joint3 -o"
            " next.yaml"
        ),
    )(plan)


@options_from(kr5.gap.PlanOptions)
def plan(
    folder: Folder,
    options: kr5.gap.PlanOptions,
    separate: Separate = None,
    done: Done = None,
    full: arguments.FullOption = False,
    json_file: arguments.JsonOption = None,
    output: Protocol = None,
) -> None:
    """Plan of the experiment that distinguishes what a recording cannot, as a protocol for `kr5 record` or a robot.

    Motions, postures, weights, speeds, waiting times, views, scans, steps, presses and profiles are simulated with each
    of the alternatives, which look alike in the recording; the one that distinguishes them in the shortest time is
    selected."""
    options.validate()
    writing.check_writable(output, json_file, inputs=[folder])
    recording = kr5.cell.load_recording(folder)
    simulator = arguments.make_simulator(full)
    to = terminal.console(json_file)
    alternatives = parse_alternatives(separate, recording.cell) if separate else tied_alternatives(recording, simulator)
    if len(alternatives) < 2:
        to.print(
            "No effects are tied: the diagnosis identifies each cause. To distinguish other"
            " effects, name them with --separate.",
            soft_wrap=True,
        )
        results.write_result(json_file, "kr5-gap-plan/1", alternatives=[], text="", experiments=[])
        return
    if done:
        weighed = weigh_alternatives(
            recording, [kr5.cell.load_recording(d) for d in done], simulator, alternatives, options, to
        )
        named = [[{"effect": n.effect, "target": n.target} for n in names] for names in alternatives]
        keys = {"alternatives": named, "text": weighed_text(alternatives, weighed), "experiments": []}
        inputs = {"recording": str(folder.resolve()), "done": [str(d.resolve()) for d in done]}
        results.write_result(json_file, "kr5-gap-plan/1", **{**weighed.to_dict(), **keys}, input=inputs)
        return
    with terminal.spinner("searching for the experiment that distinguishes them"):
        found = kr5.gap.plan(recording, alternatives, simulator, options)
    print_plan(found, to)
    if output and found.experiments:
        write_protocol(found.experiments[0], output, resting_posture(recording), to)
    planned = {**found.to_dict(), "experiments": [e.to_dict() for e in found.experiments]}
    results.write_result(json_file, "kr5-gap-plan/1", **planned, input={"recording": str(folder.resolve())})


def parse_alternatives(text: str, cell: kr5.cell.Cell) -> list[list[kr5.gap.EffectName]]:
    """The alternatives of --separate."""
    out = []
    for part in text.split(","):
        names = [name.strip().partition(":") for name in part.split("+")]
        if any(not effect or not target for effect, _, target in names):
            raise kr5.InvalidArgument(
                f"--separate: found {part!r}, expected EFFECT:TARGET such as coulomb_friction:joint3"
            )
        out.append(
            [kr5.gap.EffectName(effect=effect, target=known_target(target, cell)) for effect, _, target in names]
        )
    if len(out) < 2:
        raise kr5.InvalidArgument(
            f"--separate: found {text!r}, expected two or more EFFECT:TARGET, separated by commas"
        )
    return out


def tied_alternatives(recording: kr5.cell.Recording, simulator: kr5.cell.Simulator) -> list[list[kr5.gap.EffectName]]:
    """What a diagnosis blames, and the same with each effect that could stand in the place of a cause."""
    from kr5_tools.gap.diagnosis_run import run_diagnosis

    found = run_diagnosis(recording, simulator, kr5.gap.DiagnoseOptions())
    return kr5.gap.tied_alternatives(found)[:MOST_ALTERNATIVES]


def alternative_texts(alternatives: Sequence[Sequence[kr5.gap.EffectName]]) -> list[str]:
    """Each alternative by the names of the catalogue."""
    return [" with ".join(f"{n.effect} on {n.target}" for n in names) for names in alternatives]


def alternative_words(alternatives: Sequence[Sequence[kr5.gap.EffectName]]) -> list[str]:
    """Each alternative in words."""
    return [" with ".join(kr5.gap.effect_text(n.effect, n.target) for n in names) for names in alternatives]


def resting_posture(recording: kr5.cell.Recording) -> list[float] | None:
    """Where the first recorded motion began, for people who add experiments to the protocol."""
    joints = recording.cell.robot.joints
    for e in recording.experiments:
        if str(e.kind) == "motion" and len(e.data):
            return [round(float(e[f"qc{j + 1}"][0]), 6) for j in range(joints)]
    return None


def weighed_text(alternatives: Sequence[Sequence[kr5.gap.EffectName]], weighed: kr5.gap.ModelComparison) -> str:
    """The alternative that the recordings decide for, in words."""
    best = weighed.best
    return f"{alternative_words(alternatives)[best]} is {format_percent(weighed.probability[best])} probable"


def weigh_alternatives(
    recording: kr5.cell.Recording,
    more: list[kr5.cell.Recording],
    simulator: kr5.cell.Simulator,
    alternatives: Sequence[Sequence[kr5.gap.EffectName]],
    options: kr5.gap.PlanOptions,
    to: Console,
) -> kr5.gap.ModelComparison:
    with terminal.spinner("fitting the alternatives"):
        weighed = kr5.gap.compare_models([recording, *more], alternatives, simulator, options)
    rows = [
        [name, f"{e:.1f}", format_percent(p)]
        for name, e, p in zip(alternative_words(alternatives), weighed.log_evidence, weighed.probability)
    ]
    to.print(tables.make_table("Alternatives", ["alternative", "log evidence [-]", "probability"], rows))
    return weighed


def print_plan(found: kr5.gap.Plan, to: Console) -> None:
    """The plan for people."""
    words = alternative_words(found.alternatives)
    if found.assumed:
        to.print(f"The recording shows none of the effects: a typical size of {words[0]} is assumed.", soft_wrap=True)
    text = found.text
    for name, word in zip(alternative_texts(found.alternatives), words):
        text = text.replace(name, word)
    to.print(f"{text}.", style="bold", soft_wrap=True)
    if not found.experiments:
        return
    rows = [
        [
            e.what,
            f"{e.separation:.1f}",
            e.repeats,
            f"{e.separation_repeated:.1f}",
            error_text(e.wrong),
            round(e.seconds),
        ]
        for e in found.experiments
    ]
    heads = ["experiment", "separation [σ]", "repeats", "in total [σ]", "error [%]", "duration [s]"]
    to.print()
    to.print(tables.make_table("Experiments, best first", heads, rows))
    columns = [c for c in found.experiments[0].columns if c.difference > 0.01][:8]
    rows = [[c.column, *(f"{change:.2f}" for change in c.change), f"{c.difference:.2f}"] for c in columns]
    heads = ["column", *(f"{word} [-]" for word in words), "difference [-]"]
    to.print()
    to.print(tables.make_table("Forecast of the best: RMS change of each column over its noise", heads, rows))
    to.print()
    to.print(
        "The plan respects joint limits, a fraction of the speed limits, torques and the lowest recorded"
        " point. It does not check collisions: view the motion with kr5 replay before a robot runs it.",
        soft_wrap=True,
    )


def error_text(probability: float) -> str:
    """A probability of error in percent, as a number of a table."""
    return "< 0.01" if probability < 1e-4 else f"{100 * probability:.2g}"


def write_protocol(best: kr5.gap.PlannedExperiment, file: Path, start: list[float] | None, to: Console) -> None:
    """The protocol, and the given columns of its experiment beside it."""
    import kr5.io

    table = file.with_name(f"{file.stem}-{best.experiment.kind}.csv")
    with writing.beside(table) as new:
        kr5.io.save_csv(best.experiment.data, new)
    times = min(best.repeats, MOST_REPEATS)
    names = [best.experiment.name + (f"-{i + 1}" if times > 1 else "") for i in range(times)]
    data: dict[str, Any] = {"format": "kr5-protocol/1", "name": file.stem}
    if best.load > 0:
        data["load"] = best.load
    if start:
        data["home"] = start
    data["experiments"] = [
        {"name": n, "kind": str(best.experiment.kind), "split": "fit", "given": table.name} for n in names
    ]
    comment = f"# {best.what[0].upper()}{best.what[1:]}: {best.separation:.1f} standard deviations expected.\n"
    writing.write_text(comment + yaml.safe_dump(data, sort_keys=False), file)
    to.print(
        f"{file}, {table}: the protocol; run it, or simulate it with kr5 record --protocol {file}.", soft_wrap=True
    )
