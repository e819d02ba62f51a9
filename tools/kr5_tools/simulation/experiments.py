"""Experiments of a simulated cell."""

import kr5.cell
import kr5.io
import numpy as np


def with_load(cell: kr5.cell.Cell, weight: float) -> kr5.cell.Cell:
    """The cell with the known weight of a protocol on its tool."""
    import kr5.gap

    return kr5.gap.with_load(cell, weight) if weight > 0 else cell


def simulate_experiment(
    cell: kr5.cell.Cell, simulator: kr5.cell.Simulator, experiment: kr5.cell.Experiment, seed: list[int]
) -> kr5.io.Table:
    """Given columns and what noisy sensors show. Rows in which a sensor sees nothing are left out."""
    random = np.random.default_rng(seed)
    given, predicted = experiment.data, simulator.predict(cell, experiment)
    values = {name: np.array(given[name]) for name in given.columns} | {
        name: np.array(predicted[name]) for name in predicted.columns
    }
    for column in kr5.cell.columns(experiment.kind, cell.robot.joints):
        if column.noise and column.name in predicted and column.group != "orientation":
            values[column.name] += random.normal(0.0, cell.noise.of(column.noise, column.joint), len(predicted))
    if "qw" in predicted:
        turn_a_little(values, cell.noise.pose_rotation, random)
    table = np.column_stack(list(values.values()))
    return kr5.io.Table(list(values), table[np.isfinite(table).all(axis=1)])


def turn_a_little(values: dict[str, np.ndarray], sigma: float, random: np.random.Generator) -> None:
    """Turns each orientation by a random rotation vector in its own frame."""
    from scipy.spatial.transform import Rotation

    names = ("qx", "qy", "qz", "qw")
    turned = Rotation.from_quat(np.column_stack([values[n] for n in names])) * Rotation.from_rotvec(
        random.normal(0.0, sigma, (len(values["qw"]), 3))
    )
    for name, column in zip(names, turned.as_quat(canonical=True).T):
        values[name] = column
