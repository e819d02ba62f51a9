"""Paths: of files that ship with kr5, in the checkout or beside an installed package, and as the library takes them."""

import os
from pathlib import Path
from typing import Any

PACKAGE = Path(__file__).resolve().parents[1]
CHECKOUT = PACKAGE.parents[1]
SHIPPED_CELL = Path("share/cells/kr5_arc.yaml")


def find_shipped_cell() -> Path | None:
    """The cell that commands take when none is named."""
    places = (CHECKOUT / SHIPPED_CELL, PACKAGE / "cells" / SHIPPED_CELL.name, SHIPPED_CELL)
    return next((place for place in places if place.is_file()), None)


def library_path(file: Path | str) -> Any:
    """A path as functions of kr5 take it that want text: its bytes, since names of files need not be UTF-8."""
    return os.fsencode(file)
