"""`kr5 rsi`: KUKA controllers over the RobotSensorInterface."""

import typer

app = typer.Typer(no_args_is_help=True)


@app.callback()
def rsi() -> None:
    """KUKA controllers over the RobotSensorInterface (RSI)."""
