"""`kr5 record`: a protocol, run in the simulator."""

from pathlib import Path
from typing import Annotated, Any

import typer

from . import common

app = typer.Typer()


@app.command(epilog="Example: kr5 record --cell share/cells/kr5_arc.yaml --protocol share/protocols/standard.yaml -o monday")
def record(
    cell_file: Annotated[Path, typer.Option("--cell", metavar="CELL.yaml", help="The cell, with the effects it carries.")],
    protocol: Annotated[Path, typer.Option("--protocol", metavar="PROTOCOL.yaml", help="What to do (kr5-protocol/1).")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FOLDER", help="Where the recording goes; must not be there yet.")],
    seed: Annotated[int, typer.Option("--seed", min=0, help="Of postures and noise: the same seed gives the same recording.")] = 1,
    nominal: Annotated[bool, typer.Option("--nominal", help="Write the cell without its effects, as one believes it before a diagnosis.")] = False,
    images: Annotated[bool, typer.Option("--images", help="Render what the camera sees in `views` too: a folder for each in FOLDER, as `kr5 "
                                         "calibrate hand-eye` reads it.")] = False,
    full: common.Grade = False,
    json_file: common.Json = None,
) -> None:
    """Runs a protocol in the simulator, adds the noise the cell states, and writes what a real cell would have recorded."""
    import kr5.cell

    from . import protocol as protocols

    if output.exists() and (not output.is_dir() or any(output.iterdir())):
        common.fail(f"{output}: is there already; expected a new or empty folder, so that no recording is lost")
    cell = loaded(kr5.cell.load_cell(cell_file), protocols.weight(protocol))
    simulator = common.simulator(full)
    with common.working(f"choosing the postures of {protocol}"):
        experiments = protocols.load(protocol, cell, seed)
    for number, experiment in enumerate(common.track(experiments, "recording")):
        experiment.data = shown(cell, simulator, experiment, [seed, number, 1])
    believed = cell
    if nominal:
        believed = loaded(kr5.cell.load_cell(cell_file), protocols.weight(protocol))
        believed.effects = {}
    kr5.cell.save_recording(kr5.cell.Recording(believed, experiments), output)
    if images:
        for number, experiment in enumerate(experiments):
            if str(experiment.kind) == "views":
                take_pictures(output / experiment.name, cell, believed, simulator, experiment, seed + number)
    rows = [[e.name, str(e.kind), str(e.split), len(e.data)] for e in experiments]
    to = common.console(json_file)
    table = common.table(f"Recording {output}", ["experiment", "kind", "split", "rows"], rows)
    for column in (1, 2):
        table.columns[column].justify = "left"
    to.print(table)
    common.write_json({"folder": str(output), "experiments": [dict(zip(("name", "kind", "split", "rows"), r)) for r in rows]}, json_file)


def loaded(cell: Any, weight: float) -> Any:
    """The cell with the known weight of a protocol on its tool."""
    import kr5.gap

    return kr5.gap.with_load(cell, weight) if weight > 0 else cell


def take_pictures(folder: Path, cell: Any, believed: Any, simulator: Any, views: Any, seed: int) -> None:
    """A picture of each view, and what belongs to it."""
    import numpy as np

    from . import pictures

    _, first = np.unique(views["view"], return_index=True)
    q = np.column_stack([views[f"q{i + 1}"] for i in range(cell.robot.joints)])[first]
    shots = pictures.shots_of(simulator, cell, q, views["t"][first])
    pictures.write_views(folder, believed, shots, {"blur": 0.6, "noise": 1.5, "seed": seed})


def shown(cell: Any, simulator: Any, experiment: Any, seed: list[int]) -> Any:
    """Given columns and what noisy sensors show. Rows in which a sensor sees nothing are left out."""
    import kr5.cell
    import kr5.io
    import numpy as np

    random = np.random.default_rng(seed)
    given, predicted = experiment.data, simulator.predict(cell, experiment)
    values = {name: np.array(given[name]) for name in given.columns} | {name: np.array(predicted[name]) for name in predicted.columns}
    for column in kr5.cell.columns(experiment.kind, cell.robot.joints):
        if column.noise and column.name in predicted and column.group != "orientation":
            values[column.name] += random.normal(0.0, getattr(cell.noise, column.noise), len(predicted))
    if "qw" in predicted:
        turn_a_little(values, cell.noise.pose_rotation, random)
    table = np.column_stack(list(values.values()))
    return kr5.io.Table(list(values), table[np.isfinite(table).all(axis=1)])


def turn_a_little(values: dict[str, Any], sigma: float, random: Any) -> None:
    """Turns each orientation by a random rotation vector in its own frame."""
    import numpy as np
    from scipy.spatial.transform import Rotation

    names = ("qx", "qy", "qz", "qw")
    turned = Rotation.from_quat(np.column_stack([values[n] for n in names])) * Rotation.from_rotvec(
        random.normal(0.0, sigma, (len(values["qw"]), 3)))
    for name, column in zip(names, turned.as_quat(canonical=True).T):
        values[name] = column
