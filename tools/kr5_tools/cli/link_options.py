"""The layout and the port that commands at a link listen on."""

from pathlib import Path
from typing import Annotated

import kr5
import typer
from kr5 import rsi
from kr5.files.paths import library_path

from kr5_tools.cli import terminal

LayoutArgument = Annotated[
    Path,
    typer.Argument(
        metavar="LAYOUT.xml",
        help="Sensor configuration of the controller's Ethernet object (the XML that `kr5 rsi files` writes).",
    ),
]
PortOption = Annotated[
    int | None,
    typer.Option("--port", metavar="N", min=1, max=65535, help="Port to listen on; by default that of the layout."),
]
ListenOption = Annotated[
    str, typer.Option("--listen", metavar="ADDRESS", help="Address of the network card; 0.0.0.0: every one.")
]
SettingsOption = Annotated[
    Path | None,
    typer.Option(
        "--settings",
        metavar="SETTINGS.yaml",
        help="What the configuration does not hold: axes (sign, zero \\[rad]), current_units \\[A], gripper,"
        " linear_externals, meanings (kr5-rsi-settings/1).",
    ),
]
PassiveOption = Annotated[
    bool, typer.Option("--passive", help="Only listen. A controller without answers stops after its timeout.")
]


def read_layout(file: Path, settings: Path | None) -> rsi.TelegramLayout:
    """The layout of a sensor configuration, with what a file of settings says besides."""
    return settled_layout(rsi.load_layout(library_path(file)), settings)


def settled_layout(layout: rsi.TelegramLayout, settings: Path | None) -> rsi.TelegramLayout:
    """A layout with what a file of settings says besides."""
    if settings is None:
        return layout
    try:
        return rsi.with_settings(layout, rsi.load_layout_settings(settings))
    except kr5.InvalidArgument as error:
        raise kr5.FileError(settings, str(error)) from None


def listening_layout(layout: rsi.TelegramLayout, port: int | None) -> rsi.TelegramLayout:
    """The layout with the port that is listened on."""
    out = rsi.TelegramLayout.from_dict(layout.to_dict())
    if port is not None:
        out.port = port
    return out


def link_options(
    layout: rsi.TelegramLayout, options: rsi.DiagnosisOptions, listen: str, passive: bool
) -> rsi.LinkOptions:
    """Of a link that answers unless nobody expects it to."""
    if layout.only_send and not passive:
        terminal.print_note("the layout says ONLYSEND: the controller expects no answers and gets none.")
    cycle = options.cycle_of(layout.controller)
    return rsi.LinkOptions(
        mode=options.mode, frame=options.frame, cycle=cycle, listen=listen, answer=not (passive or layout.only_send)
    )
