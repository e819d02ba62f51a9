"""A picture of each effect of the catalogue: what it does to a recording of a cell, and that a simulation with the
effect explains it."""

import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import kr5
import kr5.cell
import numpy as np
from kr5.files import writing
from kr5.files.paths import find_shipped
from kr5.gap import Cause, ParameterEstimate, Variable, column_text, effect_text, find_variable, variable_text

from kr5_tools.cli import arguments, terminal
from kr5_tools.gap_report.messages import capitalised

PROTOCOL = Path("share/protocols/standard.yaml")
# Of each kind one experiment of the protocol, and of motions one that begins late, for what builds up over the session.
EXPERIMENTS = ("motion-1", "motion-5", "poses-1", "views-2", "scan-2", "step-1", "press-2", "profile-2")
SEED = 1
MOST_POINTS = 1500
TITLE_WIDTH = 95  # [characters]
BINS = 15
LEAST_CHANGE = 0.1  # RMS change of a column over its noise, below which nothing would be seen
CONSTANT = 0.2  # weight of a constant change beside one that varies, which says more of the effect
NEGLIGIBLE = 1e-9  # of a value that is only rounding
ROWS = {"poses": "posture", "views": "point of the images", "scan": "point of the profiles"}
LABELS = ("marker", "corner", "pose", "view", "line", "run")  # columns that number rows


@dataclass
class EffectPicture:
    """Residuals of one column over its noise [-], for a recording of a cell that has the effect: simulated without
    the effect and with it; and the variable that orders the former best."""

    effect: str
    target: str
    values: list[str]
    kind: str
    column: str
    without: np.ndarray
    with_effect: np.ndarray
    over: np.ndarray
    over_name: str
    variable: np.ndarray
    variable_name: str


def standard_experiments(cell: kr5.cell.Cell) -> list[kr5.cell.Experiment]:
    """Experiments of the standard protocol that the cell can do, with their given columns."""
    from kr5_tools.simulation.protocol_file import load_protocol

    file = find_shipped(PROTOCOL)
    if file is None:
        raise kr5.FileError(PROTOCOL, "no such file", remedy="run the command inside a checkout of the project")
    return [e for e in load_protocol(file, cell, SEED) if e.name in EXPERIMENTS]


def picture_of(effect: str, cell: kr5.cell.Cell, experiments: list[kr5.cell.Experiment]) -> EffectPicture | None:
    """The effect on the target and in the column where it shows most; None where this cell does not show it."""
    best: tuple[float, str, Any, Any, Any] | None = None
    for target in cell.effect_targets(effect):
        found = _residuals(effect, target, cell, experiments)
        if found is None:
            continue
        changed, recording, columns = found
        for column in columns:
            rows = np.asarray(column.residuals)
            change = (rows[:, 0] - rows[:, 1])[np.isfinite(rows).all(axis=1)]
            if not len(change) or np.sqrt(np.mean(change**2)) < LEAST_CHANGE:
                continue
            score = float(np.hypot(np.std(change), CONSTANT * np.mean(change)))
            if best is None or score > best[0]:
                best = score, target, changed, recording, column
    if best is None:
        return None
    _, target, changed, recording, column = best
    experiment = next(e for e in recording.experiments if e.name == column.experiment)
    rows = np.asarray(column.residuals)
    over, over_name = _course(experiment)
    variable_name, variable = _best_variable(cell, experiment, column.column, rows[:, 0] - rows[:, 1])
    return EffectPicture(
        effect=effect,
        target=target,
        values=_value_texts(effect, target, cell, changed),
        kind=str(experiment.kind),
        column=column.column,
        without=rows[:, 0],
        with_effect=rows[:, 1],
        over=over,
        over_name=over_name,
        variable=variable,
        variable_name=variable_name,
    )


def _residuals(
    effect: str, target: str, cell: kr5.cell.Cell, experiments: list[kr5.cell.Experiment]
) -> tuple[Any, Any, Any] | None:
    """The cell with the effect at a typical size, what it would record, and the residuals; None where it cannot."""
    import kr5.gap

    from kr5_tools.simulation.experiments import simulate_experiment

    simulator = arguments.make_simulator(False)
    last = max(float(e["t"][-1]) for e in experiments if str(e.kind) == "motion")
    recorded = []
    try:
        changed = kr5.gap.with_typical_effect(cell, effect, target, 0.0, last)
        for number, experiment in enumerate(experiments):
            copy = kr5.cell.Experiment(
                name=experiment.name, kind=experiment.kind, file=experiment.file, split=experiment.split
            )
            copy.data = experiment.data
            copy.data = simulate_experiment(changed, simulator, copy, [SEED, number])
            recorded.append(copy)
    except kr5.InvalidArgument:
        return None
    recording = kr5.cell.Recording(cell, recorded)
    return changed, recording, kr5.gap.residual_columns(recording, simulator, [changed])


def _course(experiment: kr5.cell.Experiment) -> tuple[np.ndarray, str]:
    """The order of the rows: time where it runs on, else their number."""
    t = np.asarray(experiment["t"])
    if kind := ROWS.get(str(experiment.kind)):
        return np.arange(1, len(t) + 1, dtype=float), kind
    return t - t[0], "time [s]"


def _best_variable(
    cell: kr5.cell.Cell, experiment: kr5.cell.Experiment, column: str, change: np.ndarray
) -> tuple[str, np.ndarray]:
    """The variable whose bins explain most of the change by their means, with its name and unit."""
    use = np.isfinite(change)
    best: tuple[float, str, np.ndarray] | None = None
    for variable, unit, values in _variables(cell, experiment, column):
        if np.ptp(values[use]) < NEGLIGIBLE:
            continue
        edges = np.unique(np.quantile(values[use], np.linspace(0, 1, BINS + 1)))
        bins = np.clip(np.searchsorted(edges, values[use], side="right") - 1, 0, len(edges) - 2)
        sums, counts = np.bincount(bins, change[use]), np.bincount(bins)
        explained = float(np.sum(sums[counts > 0] ** 2 / counts[counts > 0]))
        if best is None or explained > 1.02 * best[0]:
            text = variable_text(variable, str(experiment.kind))
            best = explained, f"{text}{f' [{unit}]' if unit else ''}", values
    if best is None:
        return _course(experiment)[::-1]
    return best[1], best[2]


def _variables(
    cell: kr5.cell.Cell, experiment: kr5.cell.Experiment, column: str
) -> list[tuple[Variable, str, np.ndarray]]:
    """What a change may depend on, with unit and values: given columns, in views the place in the image, of motions
    also speeds and accelerations, and the simulated column itself."""
    data, kind = experiment.data, str(experiment.kind)
    out = []
    for c in kr5.cell.columns(experiment.kind, cell.robot.joints):
        wanted = c.name in ("u", "v") if kind == "views" else str(c.role) == "given" and c.name not in ("t", *LABELS)
        if wanted and c.name in data:
            unit = c.unit.partition(" or ")[0]
            out.append(
                (find_variable(c.name.replace("qc", "q")), "" if unit == "-" else unit, np.asarray(data[c.name]))
            )
    if kind == "motion":
        t = np.asarray(data["t"])
        for j in range(1, cell.robot.joints + 1):
            speed = np.gradient(np.asarray(data[f"qc{j}"]), t)
            velocity, acceleration = (Variable(kind=f"joint_{what}", joint=j) for what in ("velocity", "acceleration"))
            out += [(velocity, "rad/s", speed), (acceleration, "rad/s²", np.gradient(speed, t))]
    if kind != "views":
        predicted = arguments.make_simulator(False).predict(cell, experiment)
        if column in predicted:
            unit = kr5.cell.find_column(experiment.kind, column).unit.partition(" or ")[0]
            out.append((Variable(kind="prediction", column=column), unit, np.asarray(predicted[column])))
    return out


def _value_texts(effect: str, target: str, cell: kr5.cell.Cell, changed: kr5.cell.Cell) -> list[str]:
    """The parameters of the effect, with what the cell says where they replace it."""
    from kr5_tools.gap_report.parameter_rows import is_pose, parameter_rows

    values = changed.effects.to_dict()[effect][target]
    units = {p.name: p.unit for p in kr5.cell.find_effect(effect).parameters}
    parameters = []
    for name, value in values.items():
        numbers = [float(x) for x in np.ravel(value)]
        zeros = [0.0] * (6 if np.ndim(value) == 2 else len(numbers))
        parameters.append(ParameterEstimate(name=name, value=numbers, std=zeros, unit=units[name]))
    rows = parameter_rows(Cause(effect=effect, target=target, parameters=parameters), cell)
    if any(is_pose(p) for p in parameters):
        sizes = [float(row["value"]) for row in rows]
        return [f"shifted by {np.linalg.norm(sizes[:3]):.2g} mm, turned by {np.linalg.norm(sizes[3:]):.2g}°"]
    texts = []
    for row in rows:
        value, nominal = float(row["value"]), float(row["nominal"] or 0.0)
        if abs(value - nominal) < NEGLIGIBLE and len(rows) > 1:
            continue
        text = f"{row['name']} {value:.4g} {row['unit']}".rstrip()
        replaced = abs(nominal) > NEGLIGIBLE
        texts.append(f"{text} instead of {nominal:.4g}" if replaced else text)
    return texts


def draw_effect(picture: EffectPicture) -> Any:
    """The figure of a picture, for print and screen; close it after use."""
    from kr5_tools.pages.plot_style import GREY, RED, STYLE, plt

    step = max(1, len(picture.over) // MOST_POINTS)
    with plt.rc_context(STYLE):
        figure, (left, right) = plt.subplots(1, 2, figsize=(7.2, 3.1), sharey=True)
        for axes, x in ((left, picture.over), (right, picture.variable)):
            axes.plot(x[::step], picture.without[::step], ".", ms=3, color=RED, label="simulated without the effect")
            axes.plot(x[::step], picture.with_effect[::step], ".", ms=1.8, color=GREY, label="simulated with it")
        left.set_xlabel(picture.over_name)
        right.set_xlabel(picture.variable_name)
        left.set_ylabel("residual over noise [-]")
        column = capitalised(column_text(f"{picture.kind}.{picture.column}"))
        name = capitalised(effect_text(picture.effect, picture.target))
        head = textwrap.fill(f"{name}: {', '.join(picture.values)}", TITLE_WIDTH)
        figure.suptitle(f"{head}\n{column} ({picture.kind}.{picture.column})", fontsize=10, x=0.01, ha="left")
        figure.legend(*left.get_legend_handles_labels(), loc="outside lower left", ncols=2, markerscale=3, fontsize=9)
    return figure


def write_effect_pictures(
    effects: list[str], cell: kr5.cell.Cell, folder: Path, picture_format: str = "png"
) -> tuple[list[Path], list[str]]:
    """Draws each effect into FOLDER/EFFECT.png (or .svg); the files, and the effects that this cell does not show."""
    from kr5_tools.pages.plot_style import plt

    with terminal.spinner("choosing the motions"):
        experiments = standard_experiments(cell)
    files, unseen = [], []
    for effect in terminal.track(effects, "drawing the effects"):
        picture = picture_of(effect, cell, experiments)
        if picture is None:
            unseen.append(effect)
            continue
        figure = draw_effect(picture)
        files.append(folder / f"{effect}.{picture_format}")
        writing.save_figure(figure, files[-1], dpi=160)
        plt.close(figure)
    return files, unseen
