"""The entry point of `kr5`, small so that Ctrl-C is heard from the beginning: loading the command takes a moment."""

import os
import sys


def main() -> None:
    """Loads the command and runs it."""
    try:
        from kr5_tools.app import main as run
    except KeyboardInterrupt:
        sys.stderr.write("stopped; nothing was written\n")
        sys.stderr.flush()
        os._exit(130)
    run()
