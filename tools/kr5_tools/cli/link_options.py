"""The layout and the port that commands at a link listen on."""

from pathlib import Path
from typing import Annotated

import typer
from kr5 import rsi

from kr5_tools.cli import terminal

LayoutArgument = Annotated[
    Path,
    typer.Argument(
        metavar="LAYOUT.xml", help="Sensor configuration of the controller's Ethernet object (..._ethernet.xml)."
    ),
]
PortOption = Annotated[
    int | None,
    typer.Option("--port", metavar="N", min=1, max=65535, help="Port to listen on; by default that of the layout."),
]
ListenOption = Annotated[
    str, typer.Option("--listen", metavar="ADDRESS", help="Address of the network card; 0.0.0.0: every one.")
]
PassiveOption = Annotated[
    bool, typer.Option("--passive", help="Only listen. A controller without answers stops after its timeout.")
]


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
