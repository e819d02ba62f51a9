"""Files written beside and renamed, all of them once a command has succeeded, so that a failure leaves what was
there.
"""

from __future__ import annotations

import contextlib
import io
import json
import math
import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import kr5
from kr5.files.inputs import is_read
from kr5.files.paths import is_device, is_same, shown_name

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass
class Surroundings:
    """What a program around the writing of files wants: a command sets it, which Ctrl-C may end and which shows that
    it works."""

    shield: Callable[[], contextlib.AbstractContextManager[None]] = contextlib.nullcontext  # around what must not break
    before_output: Callable[[], None] = lambda: None  # before standard output is written to


surroundings = Surroundings()

# Complete files and where they go, while the files of a command are held back; None: each is put in its place at once.
_held: list[tuple[Path, Path]] | None = None
_unfinished: set[Path] = set()  # files and folders that are being written
_written: list[Path] = []  # those that this command has put in their places
_made: list[Path] = []  # folders that this command has made, inner ones last


def to_plain(value: object) -> Any:
    """Numbers, texts, lists and dicts only; what JSON cannot write (NaN, infinity) becomes null."""
    if hasattr(value, "to_dict"):
        return to_plain(value.to_dict())
    if isinstance(value, dict):
        return {str(key): to_plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):
        return to_plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [to_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    return str(value)


@contextlib.contextmanager
def held_back() -> Iterator[None]:
    """Files that are written inside appear together at the end, or not at all when it ends by an exception."""
    global _held
    before, _held = _held, []
    if before is None:
        _written.clear()
    try:
        yield
        publish()
    finally:
        for new, _ in _held:
            new.unlink(missing_ok=True)
        _held = before
        _remove_empty_folders()


def publish() -> None:
    """Puts the files held back so far in their places, all of them also when Ctrl-C comes; devices, which may refuse,
    come first."""
    if _held:
        _held.sort(key=lambda pair: not is_device(pair[1]))
    with surroundings.shield():
        while _held:
            _put(*_held.pop(0))


def written_files() -> list[Path]:
    """Files and folders that this command has written so far, and that are there."""
    return [file for file in _written if file.exists()]


def discard() -> None:
    """Removes what is not finished, when the process is about to end."""
    for new in [*_unfinished, *(new for new, _ in _held or ())]:
        if new.is_dir():
            shutil.rmtree(new, ignore_errors=True)
        else:
            new.unlink(missing_ok=True)
    _remove_empty_folders()


def make_folder(folder: Path) -> None:
    """A folder for outputs, with those above it; it is gone again when the command ends without a file in it."""
    for one in (*reversed(folder.parents), folder):
        if not one.exists():
            _made.append(one)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise kr5.FileError(folder, f"cannot be written: {error.strerror}") from error


def _remove_empty_folders() -> None:
    while _made:
        with contextlib.suppress(OSError):
            _made.pop().rmdir()


@contextlib.contextmanager
def beside(file: Path | str) -> Iterator[Path]:
    """A new file of the same ending, to be written in place of `file`, which it replaces once it is complete.

    A link is followed. What is no regular file, such as /dev/null, is written to and not replaced.
    """
    target = _target(file)
    folder = Path(tempfile.gettempdir()) if is_device(target) else target.parent
    try:
        handle, name = tempfile.mkstemp(dir=folder, prefix=".kr5-", suffix=target.suffix)
    except OSError as error:
        raise kr5.FileError(file, f"cannot be written: {error.strerror}; does its folder exist?") from error
    os.close(handle)
    new = Path(name)
    _unfinished.add(new)
    try:
        yield new
        _allow_reading(new, target)
    except BaseException as error:
        new.unlink(missing_ok=True)
        _rename_error(error, new, file)
        raise
    finally:
        _unfinished.discard(new)
    if _held is None:
        _put(new, target)
    else:
        _held.append((new, target))


def _rename_error(error: BaseException, new: Path, wanted: Path | str) -> None:
    """Raises what the system says of a file, and what the library says of one that nobody knows, of the file that is
    wanted."""
    if isinstance(error, kr5.IoError):
        if str(new) in str(error):
            raise kr5.IoError(str(error).replace(str(new), str(wanted))) from error
    elif isinstance(error, OSError):
        raise kr5.FileError(wanted, f"cannot be written: {error.strerror or error}") from error


def check_new_folder(folder: Path) -> None:
    """Complains of a folder that holds something, so that nothing in it is lost or mixed."""
    if folder.is_symlink() or (folder.exists() and (not folder.is_dir() or any(folder.iterdir()))):
        raise kr5.FileError(folder, "exists already; expected a new or empty folder, so that nothing is overwritten")


@contextlib.contextmanager
def folder_beside(folder: Path) -> Iterator[Path]:
    """A new folder, to be filled in place of `folder`, which is not there yet or empty, and which it becomes once
    it is complete.
    """
    global _held
    check_new_folder(folder)
    make_folder(folder.parent)
    try:
        place = folder.resolve()
        new = Path(tempfile.mkdtemp(dir=place.parent, prefix=".kr5-"))
    except (OSError, RuntimeError) as error:
        raise kr5.FileError(folder, f"cannot be written: {getattr(error, 'strerror', None) or error}") from error
    _unfinished.add(new)
    before, _held = _held, None
    try:
        yield new
        umask = os.umask(0)
        os.umask(umask)
        new.chmod(0o777 & ~umask)
        new.replace(place)
        _written.append(folder)
    except BaseException as error:
        _rename_error(error, new, folder)
        raise
    finally:
        _held = before
        shutil.rmtree(new, ignore_errors=True)
        _unfinished.discard(new)


def _target(file: Path | str) -> Path:
    """Where a file goes: the end of its links."""
    try:
        target = Path(os.path.realpath(file)) if Path(file).is_symlink() else Path(file)
        is_folder = target.is_dir()
    except (OSError, RuntimeError) as error:
        raise kr5.FileError(file, f"cannot be written: {getattr(error, 'strerror', None) or error}") from error
    if is_folder:
        raise kr5.FileError(file, "cannot be written: is a folder")
    if target.is_symlink():
        raise kr5.FileError(file, "cannot be written: its links are circular")
    return target


def _allow_reading(new: Path, target: Path) -> None:
    """The rights of the file replaced, or those of any new file; temporary files have fewer."""
    umask = os.umask(0)
    os.umask(umask)
    mode = stat.S_IMODE(target.stat().st_mode) if target.is_file() else 0o666 & ~umask
    new.chmod(mode)


def _put(new: Path, target: Path) -> None:
    try:
        if is_device(target):
            with new.open("rb") as source, target.open("wb") as stream:
                shutil.copyfileobj(source, stream)
            new.unlink()
        else:
            new.replace(target)
    except OSError as error:
        new.unlink(missing_ok=True)
        raise kr5.FileError(target, f"cannot be written: {error.strerror}") from error
    _written.append(target)


def write_bytes(data: bytes, file: Path | str) -> None:
    with beside(file) as new:
        new.write_bytes(data)


def write_text(text: str, file: Path | str) -> None:
    """Text in UTF-8; bytes of a file name that are none stand as \\udc80 and so on. `-` is standard output."""
    if str(file) == "-":
        surroundings.before_output()
        sys.stdout.write(text)
        return
    write_bytes(text.encode("utf-8", errors="backslashreplace"), file)


def write_json(data: object, file: Path | str | None) -> None:
    """Writes JSON; does nothing without a file."""
    if file is not None:
        write_text(json.dumps(to_plain(data), indent=1, ensure_ascii=False) + "\n", file)


def make_printable(figure: Figure) -> None:
    """Names of files in the texts of a figure need not be UTF-8, which is all that matplotlib draws."""
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        text.set_text(shown_name(text.get_text()))


def save_figure(
    figure: Figure, file: Path | str, dpi: float | None = None, metadata: dict[str, str | None] | None = None
) -> None:
    """A figure of matplotlib, in the format that the ending of the file names."""
    make_printable(figure)
    buffer = io.BytesIO()  # a writer of matplotlib that meets a full disk complains of itself instead
    figure.savefig(buffer, format=Path(file).suffix[1:].lower() or None, dpi=dpi, metadata=metadata)
    write_bytes(buffer.getvalue(), file)


def check_writable(*files: Path | None, inputs: Iterable[Path | str | None] = ()) -> None:
    """Complains of outputs whose folder is not there, and of one that would replace an input, before what may take
    minutes is begun. An input may be a folder: `kr5.files.inputs.is_read` says what is read of it.
    """
    outputs = [Path(file) for file in files if file is not None and str(file) != "-"]
    for file in outputs:
        if not file.parent.is_dir():
            raise kr5.FileError(file, f"cannot be written: no such folder {file.parent}")
        if file.is_dir():
            raise kr5.FileError(file, "cannot be written: is a folder")
    read = [Path(file) for file in inputs if file is not None]
    for file in outputs:
        if any(is_read(file, other) for other in read):
            raise kr5.FileError(
                file, "is an input of this command", remedy="choose another output file, so that it is not overwritten"
            )
    for k, file in enumerate(outputs):
        if any(is_same(file, other) for other in outputs[:k]):
            raise kr5.FileError(file, "is the file of two outputs", remedy="choose another file for one of them")


def check_page(page: Path | None) -> None:
    """Complains of a page whose name says that it is something else, such as a result."""
    if page is not None and page.suffix.lower() not in (".html", ".htm"):
        raise kr5.FileError(
            page, f"found the ending '{page.suffix}', expected .html: it is a page; --json writes the numbers"
        )
