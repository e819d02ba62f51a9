"""`kr5 gap plan`: the experiment that tells apart what a recording cannot."""

from pathlib import Path
from typing import Annotated, Any

import typer
import yaml

import kr5.gap

from . import common
from .options import options_from

MOST_REPEATS = 20  # written to a protocol
MOST_ALTERNATIVES = 4
Folder = Annotated[Path, typer.Argument(metavar="RECORDING", help="The folder of a recording (recording.yaml).")]
Separate = Annotated[str | None, typer.Option("--separate", metavar="EFFECT:TARGET,EFFECT:TARGET", help="What is to be told apart, as "
                                              "coulomb_friction:joint3,payload:tool; effects that act together are joined by +. "
                                              "Without it: what a diagnosis of the recording cannot tell apart.")]
Protocol = Annotated[Path | None, typer.Option("-o", "--output", metavar="NEXT.yaml", help="Write the best experiment as a protocol here, its "
                                               "columns in a CSV file beside it.")]
Done = Annotated[list[Path] | None, typer.Option("--done", metavar="FOLDER", help="A recording of the planned experiment: says which "
                                                 "alternative both support. May be given several times.")]


def add_to(app: typer.Typer) -> None:
    app.command("plan", epilog="Example: kr5 gap plan recordings/monday --separate coulomb_friction:joint3,stribeck_friction:joint3 -o next.yaml")(plan)


@options_from(kr5.gap.PlanOptions)
def plan(
    folder: Folder,
    options: kr5.gap.PlanOptions,
    separate: Separate = None,
    done: Done = None,
    full: common.Grade = False,
    json_file: common.Json = None,
    output: Protocol = None,
) -> None:
    """Computes the experiment that tells apart what a recording cannot, and writes it as a protocol for `kr5 record` or a robot.

    Motions, postures, weights, speeds, waiting times, views, scans, steps, presses and profiles are simulated with each of the
    alternatives, which look alike in the recording; the one that tells them apart soonest is chosen.
    """
    import kr5.cell

    options.validate()
    recording = kr5.cell.load_recording(folder)
    simulator = common.simulator(full)
    to = common.console(json_file)
    alternatives = parse(separate) if separate else tied(recording, simulator)
    if len(alternatives) < 2:
        to.print("Nothing is tied: the diagnosis of this recording names each cause alone. --separate names what to tell apart all the same.", soft_wrap=True)
        common.write_json({"alternatives": [], "experiments": []}, json_file)
        return
    if done:
        weighed = weigh(recording, [kr5.cell.load_recording(d) for d in done], simulator, alternatives, options, to)
        common.write_json({"alternatives": words(alternatives), **weighed.to_dict()}, json_file)
        return
    with common.working("looking for the experiment that tells them apart"):
        found = kr5.gap.plan(recording, simulator, alternatives, options)
    show(found, to)
    if output and found.experiments:
        write(found.experiments[0], output, home(recording), to)
    common.write_json({**found.to_dict(), "experiments": [e.to_dict() for e in found.experiments]}, json_file)


def parse(text: str) -> list[list[Any]]:
    """The alternatives of --separate."""
    out = []
    for part in text.split(","):
        names = [name.strip().partition(":") for name in part.split("+")]
        if any(not effect or not target for effect, _, target in names):
            common.fail(f"--separate: found {part!r}, expected EFFECT:TARGET such as coulomb_friction:joint3")
        out.append([kr5.gap.EffectName(effect=effect, target=target) for effect, _, target in names])
    if len(out) < 2:
        common.fail(f"--separate: found {text!r}, expected two or more of EFFECT:TARGET with a comma between")
    return out


def tied(recording: Any, simulator: Any) -> list[list[Any]]:
    """What a diagnosis blames, and the same with each effect that could stand in the place of a cause."""
    from .gap_diagnose import _diagnose

    found = _diagnose(recording, simulator, kr5.gap.DiagnoseOptions())
    blamed = [kr5.gap.EffectName(effect=c.effect, target=c.target) for c in found.causes]
    out = [blamed] if blamed else []
    for k, cause in enumerate(found.causes):
        out += [[*blamed[:k], other, *blamed[k + 1:]] for other in cause.tied_with]
    return out[:MOST_ALTERNATIVES]


def words(alternatives: Any) -> list[str]:
    return [" with ".join(f"{n.effect} on {n.target}" for n in names) for names in alternatives]


def home(recording: Any) -> list[float] | None:
    """Where the first recorded motion began, for people who add experiments to the protocol."""
    joints = recording.cell.robot.joints
    for e in recording.experiments:
        if str(e.kind) == "motion" and len(e.data):
            return [round(float(e[f"qc{j + 1}"][0]), 6) for j in range(joints)]
    return None


def weigh(recording: Any, more: list[Any], simulator: Any, alternatives: Any, options: Any, to: Any) -> Any:
    with common.working("fitting the alternatives"):
        weighed = kr5.gap.weigh([recording, *more], simulator, alternatives, options)
    rows = [[name, e, p] for name, e, p in zip(words(alternatives), weighed.log_evidence, weighed.probability)]
    to.print(common.table("Which of them the recordings support", ["alternative", "log evidence [-]", "probability [-]"], rows))
    return weighed


def show(found: Any, to: Any) -> None:
    """The plan for people."""
    names = words(found.alternatives)
    if found.assumed:
        to.print(f"The recording shows none of them; {names[0]} of a usual size is assumed.", soft_wrap=True)
    to.print(f"[bold]{found.text}[/bold].", soft_wrap=True, highlight=False)
    if not found.experiments:
        return
    rows = [[e.what, e.separation, e.repeats, e.separation_repeated, e.wrong, round(e.seconds)] for e in found.experiments]
    to.print(common.table("Experiments, best first", ["what", "separation [sigma]", "times", "then [sigma]", "wrong [-]", "each [s]"], rows))
    columns = [c for c in found.experiments[0].columns if c.difference > 0.01][:8]
    rows = [[c.column, *c.change, c.difference] for c in columns]
    to.print(common.table("What the columns of the best would show, RMS from the nominal cell over noise [-]",
                          ["column", *names, "apart"], rows))
    to.print("Joint limits, a part of the speed limits, torques and the lowest point recorded are respected; collisions are not known: look at "
             "the motion (kr5 replay) before a robot runs it.", soft_wrap=True)


def write(best: Any, file: Path, start: list[float] | None, to: Any) -> None:
    """The protocol, and the given columns of its experiment beside it."""
    import kr5.io

    table = file.with_name(f"{file.stem}-{best.experiment.kind}.csv")
    try:
        kr5.io.save_csv(best.experiment.data, table)
    except kr5.Error as error:
        common.fail(str(error))
    times = min(best.repeats, MOST_REPEATS)
    names = [best.experiment.name + (f"-{i + 1}" if times > 1 else "") for i in range(times)]
    data: dict[str, Any] = {"format": "kr5-protocol/1", "name": file.stem}
    if best.load > 0:
        data["load"] = best.load
    if start:
        data["home"] = start
    data["experiments"] = [{"name": n, "kind": str(best.experiment.kind), "split": "fit", "given": table.name} for n in names]
    comment = f"# {best.what[0].upper()}{best.what[1:]}: {best.separation:.1f} standard deviations expected.\n"
    common.write_text(comment + yaml.safe_dump(data, sort_keys=False), file)
    to.print(f"{file}, {table}: the protocol; run it, or simulate it with kr5 record --protocol {file}.", soft_wrap=True)
