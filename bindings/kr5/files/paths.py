"""Paths: of files that ship with kr5, in the checkout or beside an installed package, and names that are no UTF-8."""

import contextlib
import os
import stat
import tempfile
from collections.abc import Iterator
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


def shown_name(file: Path | str) -> str:
    """The name as text; what of it is no UTF-8 stands as \\udcff and so on."""
    return str(file).encode("utf-8", errors="backslashreplace").decode("utf-8")


def library_path(file: Path | str) -> Any:
    """A path as functions of C++ take it that want text: its bytes, since names of files need not be UTF-8."""
    return os.fsencode(file)


@contextlib.contextmanager
def plain_path(file: Path) -> Iterator[Path]:
    """A path for libraries that take UTF-8 alone: the file itself, or a link to it."""
    if shown_name(file) == str(file):
        yield file
        return
    with tempfile.TemporaryDirectory(prefix="kr5-") as folder:
        link = Path(folder) / f"file{shown_name(file.suffix)}"
        link.symlink_to(file.resolve())
        yield link
