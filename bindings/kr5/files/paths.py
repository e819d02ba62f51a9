"""Paths: of files that ship with kr5, in the checkout or beside an installed package, and as the library takes them."""

import os
import stat
from pathlib import Path
from typing import Any

PACKAGE = Path(__file__).resolve().parents[1]
CHECKOUT = PACKAGE.parents[1]
SHIPPED_CELL = Path("share/cells/kr5_arc.yaml")


def find_shipped(file: Path) -> Path | None:
    """A file or folder of share, named from the checkout: there, in the installed package, or in the present folder."""
    places = (CHECKOUT / file, PACKAGE.parent / "kr5" / file, file)
    return next((place for place in places if place.exists()), None)


def find_shipped_cell() -> Path | None:
    """The cell that commands take when none is named."""
    return find_shipped(SHIPPED_CELL)


def is_device(file: Path) -> bool:
    """Something is there that is no regular file."""
    return file.exists() and not stat.S_ISREG(file.stat().st_mode)


def is_same(a: Path, b: Path) -> bool:
    """Both are one file, which is there or would be there, and no device."""
    try:
        return not is_device(a) and (a.samefile(b) if a.exists() and b.exists() else a.resolve() == b.resolve())
    except (OSError, RuntimeError, ValueError):
        return False


def library_path(file: Path | str) -> Any:
    """A path as functions of kr5 take it that want text: its bytes, since names of files need not be UTF-8."""
    return os.fsencode(file)
