"""What every command shares: errors, progress, result files, tables with units."""

import contextlib
import datetime
import json
import math
import os
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import track as rich_track
from rich.table import Table

FORMATS = ("kr5-camera/1", "kr5-hand-eye/1", "kr5-tool/1", "kr5-timed-hand-eye/1", "kr5-marker-map/1", "kr5-detection/1",
           "kr5-gap/1")
COLOURS = {"good": "green", "doubtful": "yellow", "unusable": "red"}

errors = Console(stderr=True, highlight=False, emoji=False)

Json = Annotated[Path | None, typer.Option("--json", metavar="FILE", help="Write JSON here; - for standard output.")]
Output = Annotated[Path | None, typer.Option("-o", "--output", metavar="RESULT.json", help="Write the result file here.")]


Grade = Annotated[bool, typer.Option("--full", help="Step the cell through time in DART instead of the fast grade; slower.")]


def simulator(full: bool) -> Any:
    """The simulator of a grade; what is linked with DART is imported only when it is asked for."""
    if full:
        import kr5.sim

        return kr5.sim.DartSimulator()
    import kr5.predict

    return kr5.predict.FastSimulator()


def fail(message: str) -> NoReturn:
    """Ends the command with one plain complaint and exit code 2."""
    errors.print(f"[red]error:[/red] {escape(message)}", soft_wrap=True)
    raise typer.Exit(2)


IMAGE_ENDINGS = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm")


def image_files(given: list[Path]) -> list[Path]:
    """The files given, and the images of the folders given; complains of what is not there."""
    files = []
    for path in given:
        if not path.exists():
            fail(f"{path}: no such file or folder")
        inside = sorted(f for f in path.iterdir() if f.suffix.lower() in IMAGE_ENDINGS) if path.is_dir() else [path]
        if not inside:
            fail(f"{path}: the folder holds no image ({', '.join(IMAGE_ENDINGS)})")
        files += inside
    return files


def short_names(files: Iterable[Path | str]) -> list[str]:
    """The name of each file, with as many of its folders as tell it from the others."""
    paths = [Path(os.path.abspath(file)).parts[1:] for file in files]
    depth = 1
    while len({path[-depth:] for path in paths}) < len(set(paths)):
        depth += 1
    return ["/".join(path[-depth:]) for path in paths]


def is_users_to_mend(error: Exception) -> bool:
    """Bad input, not a bug: everything kr5 throws on purpose, and files that cannot be read or written."""
    if isinstance(error, OSError):
        return True
    import kr5

    return isinstance(error, kr5.Error)


def console(json_file: Path | None = None) -> Console:
    """Where people read. With `--json -` standard output belongs to the JSON, and people read standard error."""
    return errors if str(json_file) == "-" else Console(highlight=False, emoji=False)


def track(items: Iterable, what: str) -> Iterable:
    """The items, with a progress bar for people at a terminal."""
    return rich_track(items, description=what, console=errors, transient=True, disable=not errors.is_terminal)


@contextlib.contextmanager
def working(what: str) -> Iterator[None]:
    """A sign of life during one long call."""
    with errors.status(what) if errors.is_terminal else contextlib.nullcontext():
        yield


def plain(value: Any) -> Any:
    """Numbers, texts, lists and dicts only; what JSON cannot write (NaN, infinity) becomes null."""
    if hasattr(value, "to_dict"):
        return plain(value.to_dict())
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    return str(value)


def write_text(text: str, file: Path | str) -> None:
    """Writes beside the file and renames, so that a failure leaves the old file as it was. `-` is standard output."""
    if str(file) == "-":
        sys.stdout.write(text)
        return
    file = Path(file)
    try:
        handle, beside = tempfile.mkstemp(dir=file.parent, prefix=f".{file.name}.")
    except OSError as error:
        fail(f"{file}: cannot be written: {error.strerror}; is its folder there?")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as stream:
            stream.write(text)
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(beside, 0o666 & ~umask)  # mkstemp gives 0600
        os.replace(beside, file)
    except BaseException:
        Path(beside).unlink(missing_ok=True)
        raise


def check_writable(*files: Path | None) -> None:
    """Complains of outputs whose folder is not there, before what may take minutes is begun."""
    for file in files:
        if file is not None and str(file) != "-" and not Path(file).parent.is_dir():
            fail(f"{file}: cannot be written: there is no folder {Path(file).parent}")


def write_json(data: Any, file: Path | str | None) -> None:
    """Writes JSON; does nothing without a file."""
    if file is not None:
        write_text(json.dumps(plain(data), indent=1, ensure_ascii=False) + "\n", file)


def write_result(file: Path | None, format: str, **keys: Any) -> dict[str, Any]:
    """Makes a result (`format`, version, created, command, and `keys`), writes it if there is a file, returns it."""
    import kr5

    created = datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds")
    command = " ".join(["kr5", *sys.argv[1:]])
    data = {"format": format, "version": kr5.__version__, "created": created, "command": command, **plain(keys)}
    write_json(data, file)
    return data


def keep(data: dict[str, Any], fit: Any, *files: Path | None) -> None:
    """Writes a result where it is wanted; one that must not be used is told, and no older file is lost for it."""
    if not fit.usable:
        fail(fit.message)
    for file in files:
        write_json(data, file)


def read_result(file: Path, *formats: str) -> dict[str, Any]:
    """Reads a result file of one of the formats (of any, when none is named)."""
    wanted = formats or FORMATS
    try:
        data = json.loads(Path(file).read_text(encoding="utf-8"))
    except OSError as error:
        fail(f"{file}: {error.strerror}; expected a result file written by a kr5 command with -o")
    except ValueError as error:
        fail(f"{file}: is no JSON ({error}); expected a result file written by a kr5 command with -o")
    found = data.get("format") if isinstance(data, dict) else None
    if found not in wanted:
        fail(f"{file}: format: found {found!r}, expected one of {', '.join(wanted)}")
    return data


def figure(name: str, value: float, std: float | None, unit: str) -> dict[str, Any]:
    """One row of the table of numbers with doubt."""
    return {"name": name, "value": value, "std": std, "unit": unit}


def pose_figures(name: str, T: Any, covariance: Any) -> list[dict[str, Any]]:
    """Position [mm] and roll, pitch, yaw [deg] of a pose, with the deviations its covariance (right perturbation) gives."""
    import kr5
    import numpy as np

    step = 1e-6
    centre = kr5.to_xyzrpy(T)
    J = np.empty((6, 6))
    for i in range(6):
        change = kr5.to_xyzrpy(T @ kr5.to_pose(step * np.eye(6)[i])) - centre
        change[3:] = (change[3:] + np.pi) % (2 * np.pi) - np.pi
        J[:, i] = change / step
    std = np.sqrt(np.maximum(np.diag(J @ np.asarray(covariance) @ J.T), 0))
    axes = ("x", "y", "z", "roll", "pitch", "yaw")
    scale = [1e3] * 3 + [180 / np.pi] * 3
    units = ["mm"] * 3 + ["deg"] * 3
    return [figure(f"{name} {axes[i]}", centre[i] * scale[i], std[i] * scale[i], units[i]) for i in range(6)]


def number(value: float | None, std: float | None = None) -> str:
    """A number with as many digits as its doubt allows (two digits of it), else four."""
    if value is None or not math.isfinite(value):
        return "–"
    if not std or not math.isfinite(std):
        return f"{value:.4g}"
    return f"{value:.{min(max(1 - math.floor(math.log10(std)), 0), 9)}f}"


def table(title: str, columns: list[str], rows: Iterable[Iterable[Any]], text: Iterable[int] = ()) -> Table:
    """A table whose first column, and those of `text`, are text and whose others are numbers; units belong into the names
    of the columns."""
    out = Table(title=title, title_justify="left", box=None, header_style="bold")
    for i, column in enumerate(columns):
        out.add_column(escape(column), justify="left" if i == 0 or i in text else "right")
    for row in rows:
        out.add_row(*(escape(number(cell) if isinstance(cell, float) else str(cell)) for cell in row))
    return out


def show_result(data: dict[str, Any], to: Console) -> None:
    """Verdict, causes and figures of a result, for people."""
    if rows := data.get("figures"):
        cells = ([r["name"], number(r["value"], r.get("std")), number(r.get("std"), r.get("std")), r["unit"]] for r in rows)
        to.print(table("", ["what", "value", "± std", "unit"], cells))
    if verdict := data.get("verdict"):
        colour = COLOURS.get(verdict["word"], "default")
        to.print(f"[bold {colour}]{escape(verdict['word'])}[/]: {escape(verdict['text'])}", soft_wrap=True)
    for cause in data.get("causes", ()):
        remedy = f" {cause['remedy']}" if cause.get("remedy") else ""
        to.print(f"  [bold]{escape(cause['cause'])}[/]: {escape(cause['text'] + remedy)}", soft_wrap=True)
