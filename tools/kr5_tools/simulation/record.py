"""`kr5 record`: a protocol, run in the simulator."""

from pathlib import Path
from typing import Annotated

import kr5.cell
import kr5.io
import typer
from kr5.files import writing

from kr5_tools.cli import arguments, tables, terminal
from kr5_tools.simulation.experiments import simulate_experiment, with_load

app = typer.Typer()


@app.command(
    epilog="Example: kr5 record --cell share/cells/kr5_arc.yaml --protocol share/protocols/standard.yaml -o monday"
)
def record(
    cell_file: Annotated[Path, typer.Option("--cell", metavar="CELL.yaml", help="Cell file, with its effects.")],
    protocol: Annotated[
        Path, typer.Option("--protocol", metavar="PROTOCOL.yaml", help="Protocol of the experiments (kr5-protocol/1).")
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FOLDER", help="Folder of the recording; must not exist yet.")
    ],
    seed: Annotated[
        int,
        typer.Option(
            "--seed", min=0, help="Random seed of postures and noise; the same seed gives the same recording."
        ),
    ] = 1,
    nominal: Annotated[
        bool,
        typer.Option("--nominal", help="Write the nominal cell, without its effects, into the recording."),
    ] = False,
    images: Annotated[
        bool,
        typer.Option(
            "--images",
            help="Also render the camera images of `views`: a folder for each in FOLDER, as"
            " read by `kr5 calibrate hand-eye`.",
        ),
    ] = False,
    full: arguments.FullOption = False,
    json_file: arguments.JsonOption = None,
) -> None:
    """Recording of a simulated cell: runs a protocol in the simulator and adds the noise stated in the cell."""
    from kr5_tools.simulation import protocol_file

    writing.check_new_folder(output)
    writing.check_writable(json_file, inputs=[cell_file, protocol])
    cell = with_load(kr5.cell.load_cell(cell_file), protocol_file.load_on_tool(protocol))
    simulator = arguments.make_simulator(full)
    with terminal.spinner(f"choosing the postures of {protocol}"):
        experiments = protocol_file.load_protocol(protocol, cell, seed)
    for number, experiment in enumerate(terminal.track(experiments, "recording")):
        experiment.data = simulate_experiment(cell, simulator, experiment, [seed, number, 1])
    believed = cell
    if nominal:
        believed = with_load(kr5.cell.load_cell(cell_file), protocol_file.load_on_tool(protocol))
        believed.effects = {}
    with writing.folder_beside(output) as new:
        kr5.cell.save_recording(kr5.cell.Recording(believed, experiments), new)
        for number, experiment in enumerate(experiments if images else ()):
            if str(experiment.kind) == "views":
                take_pictures(new / experiment.name, cell, believed, simulator, experiment, seed + number)
    rows = [[e.name, str(e.kind), str(e.split), len(e.data)] for e in experiments]
    to = terminal.console(json_file)
    heads = ["experiment", "kind", "split", "rows"]
    to.print(tables.make_table(f"Recording {output}", heads, rows, text=(1, 2)))
    writing.write_json(
        {"folder": str(output), "experiments": [dict(zip(("name", "kind", "split", "rows"), r)) for r in rows]},
        json_file,
    )


def take_pictures(
    folder: Path,
    cell: kr5.cell.Cell,
    believed: kr5.cell.Cell,
    simulator: kr5.cell.Simulator,
    views: kr5.io.Table,
    seed: int,
) -> None:
    """A picture of each view, and what belongs to it."""
    import numpy as np

    from kr5_tools.simulation import camera_images

    _, first = np.unique(views["view"], return_index=True)
    q = np.column_stack([views[f"q{i + 1}"] for i in range(cell.robot.joints)])[first]
    shots = camera_images.shots_of(simulator, cell, q, views["t"][first])
    camera_images.write_views(folder, believed, shots, {"blur": 0.6, "noise": 1.5, "seed": seed})
