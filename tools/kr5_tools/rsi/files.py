"""`kr5 rsi files`: what a controller needs to take part, its program and its sensor configuration."""

from pathlib import Path
from typing import Annotated, Literal

import typer
from kr5 import rsi
from kr5.files import writing

from kr5_tools.cli import arguments, tables, terminal
from kr5_tools.cli.options import options_from
from kr5_tools.rsi import emulator_setup

FILE_COLUMNS = ["file", "folder on the controller"]


def add_to(app: typer.Typer) -> None:
    app.command(
        "files",
        epilog="Example: kr5 rsi files --controller krc4 --corrections cartesian --address 192.168.1.60"
        " --name my_cell -o for_the_controller",
    )(files)


@options_from(rsi.ProgramOptions, skip=("start",))
def files(
    options: rsi.ProgramOptions,
    folder: Annotated[
        Path, typer.Option("-o", "--output", metavar="FOLDER", help="Folder to write into; it is made where needed.")
    ],
    layout_file: Annotated[
        Path | None,
        typer.Argument(
            metavar="[LAYOUT.xml]",
            show_default=False,
            help="Sensor configuration whose elements and address are to be kept; without, the usual elements of"
            " --controller.",
        ),
    ] = None,
    controller: Annotated[
        Literal[emulator_setup.CONTROLLERS] | None,  # type: ignore[valid-type]
        typer.Option("--controller", help="The controller; by default that of LAYOUT.xml."),
    ] = None,
    corrections: Annotated[
        Literal["axes", "cartesian"], typer.Option("--corrections", help="What answers correct, without LAYOUT.xml.")
    ] = "axes",
    address: Annotated[
        str | None,
        typer.Option("--address", help="Address of this computer on the controller's network; as in LAYOUT.xml."),
    ] = None,
    port: Annotated[
        int | None, typer.Option(min=1, max=65535, help="Port that this computer listens on; as in LAYOUT.xml.")
    ] = None,
    json_file: arguments.JsonOption = None,
) -> None:
    """Files for a KUKA controller: the KRL program that switches the sensor interface on, the sensor configuration, and
    the signal flow that wires it to corrections and readings.

    What is to be wired by hand, and what no published file confirms, is told. No file was tried on a controller yet:
    begin in T1.
    """
    if layout_file is None and not (controller and address):
        terminal.fail("LAYOUT.xml: is missing; name it, or the controller and this computer: --controller, --address")
    writing.check_writable(json_file, inputs=[layout_file])
    layout = emulator_setup.make_layout(layout_file, controller, corrections, address, port, None)
    made = rsi.controller_files(layout, options)
    paths = [folder / file.name for file in made.files]
    writing.make_folder(folder)
    writing.check_writable(*paths, json_file, inputs=[layout_file])
    for file, path in zip(made.files, paths):
        writing.write_text(file.text, path)
    to = terminal.console(json_file)
    rows = [[str(path), file.folder] for file, path in zip(made.files, paths)]
    to.print(tables.make_table("", FILE_COLUMNS, rows, text=(1,)))
    print_left(made)
    writing.write_json({"address": layout.address, "port": layout.port, **made.to_dict()}, json_file)


def print_left(made: rsi.ControllerFiles) -> None:
    """What a person has still to do with the files."""
    if made.unwired:
        terminal.print_note(f"to be wired by hand, else the controller refuses them: {', '.join(made.unwired)}.")
    if made.unconfirmed:
        terminal.print_note(f"compare the numbers of these objects in RSIVisual: {', '.join(made.unconfirmed)}.")
