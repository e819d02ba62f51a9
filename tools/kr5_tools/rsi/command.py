"""`kr5 rsi`: KUKA controllers over the RobotSensorInterface."""

import typer

from kr5_tools.rsi import doctor, emulate, files, monitor

app = typer.Typer(no_args_is_help=True)
emulate.add_to(app)
monitor.add_to(app)
doctor.add_to(app)
files.add_to(app)


@app.callback()
def rsi() -> None:
    """KUKA controllers over the RobotSensorInterface (RSI)."""
