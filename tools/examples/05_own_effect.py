"""An effect of one's own, fitted beside those of the catalogue: a current sensor that bends."""

import kr5.cell
import kr5.gap
import kr5.io
import kr5.predict
import numpy as np

cell = kr5.cell.load_cell(kr5.share("cells/kr5_arc.yaml"))
cell.effects = {}
home = np.array([0.0, 0.02, -2.75, 0.0, -0.3, 1.571])


def moved(name, split, rate):
    """A motion of joint 2, and its current as the bent sensor shows it."""
    experiment = kr5.cell.Experiment(name=name, kind="motion", file=f"{name}.csv", split=split)
    t = 0.012 * np.arange(800)
    q = np.tile(home, (len(t), 1))
    q[:, 1] += 0.4 * np.sin(rate * t) * (1 - np.exp(-t * t))
    given = ["t", *(f"qc{i + 1}" for i in range(6))]
    experiment.data = kr5.io.Table(given, np.column_stack([t, q]))
    i2 = kr5.predict.FastSimulator().predict(cell, experiment)["i2"]
    noise = 12.9898 * np.sin(78.233 * np.arange(len(t)) + rate) * 43.7585  # of no true random numbers, alike everywhere
    noise = np.sqrt(12) * cell.noise.current * (noise - np.floor(noise) - 0.5)
    experiment.data = kr5.io.Table([*given, "i2"], np.column_stack([t, q, i2 + 0.02 * i2**2 + noise]))
    return experiment


def bend(columns, experiment, x):
    if "i2" in columns:
        columns["i2"] = columns["i2"] + x[0] * columns["i2"] ** 2
    return columns


recording = kr5.cell.Recording(
    cell, [moved("slow", "fit", 1.3), moved("fast", "fit", 2.9), moved("other", "check", 2.1)]
)
options = kr5.gap.DiagnoseOptions()
options.own_hypotheses = [
    kr5.gap.Hypothesis(
        effect="bent_sensor",
        target="i2",
        coordinates=[kr5.gap.Coordinate(name="bend", unit="1/A", size=0.01, lower=-0.5, upper=0.5)],
        change=bend,
    )
]
found = kr5.gap.diagnose(recording, options=options)
print(found.verdict)
for cause in found.causes:
    for p in cause.parameters:
        print(f"{cause.effect} on {cause.target}: {p.name} {p.value[0]:.4f} +- {p.std[0]:.4f} {p.unit}")
print(f"gap {found.reduction.before:.1f} -> {found.reduction.after:.1f}")
