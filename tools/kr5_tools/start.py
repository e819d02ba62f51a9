"""The entry point of `kr5`, small so that Ctrl-C is heard from the beginning: loading the command takes a moment."""

import os
import sys

from kr5_tools.cli.interruption import STOPPED, stop_text


def main() -> None:
    """Loads the command and runs it."""
    try:
        from kr5_tools.app import main as run
    except KeyboardInterrupt:
        sys.stderr.write(f"{stop_text([])}\n")
        sys.stderr.flush()
        os._exit(STOPPED)
    run()
