"""Parquet: tables of numbers and vectors, read by row groups, those columns alone that are of use."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import kr5
from kr5.files.paths import plain_path
from kr5.logs.log import Log
from kr5.logs.row_chunks import WIDEST, cut_note, kept_rows, needed_columns

INSTALL = "pip install 'kr5[parquet]'"
EPISODE = "episode_index"  # of LeRobot: which rows are one recording
BATCH = 65_536  # rows that are decoded at once
BUFFER = 1 << 20  # of a file that is held beside them [B]


def read_parquet(file: Path) -> Log:
    """Every column of numbers, vectors with a column for each component; `a.b` is the field b of a structure."""
    log = Log(file)
    fill_log(log, [file], None)
    return log


def parquet_episodes(file: Path) -> list[int]:
    """Numbers of the episodes in a table of LeRobot; none in other tables."""
    parquet = open_parquet(file)
    if EPISODE not in parquet.schema_arrow.names:
        return []
    found: set[int] = set()
    for batch in parquet.iter_batches(BATCH, columns=[EPISODE]):
        found |= set(np.unique(batch.column(0).to_numpy(zero_copy_only=False)).tolist())
    return sorted(int(number) for number in found)


def open_parquet(file: Path) -> Any:
    try:
        import pyarrow.parquet
    except ImportError:
        raise kr5.FileError(file, f"to read Parquet, the package pyarrow is needed: {INSTALL}") from None
    try:
        with plain_path(file) as path:
            return pyarrow.parquet.ParquetFile(path, pre_buffer=False, buffer_size=BUFFER)  # not the whole file at once
    except (pyarrow.ArrowException, OSError) as error:
        why = str(error).split("\n")[0][:200]
        raise kr5.FileError(
            file, f"cannot be read as Parquet: {why}; was the recording ended properly? Copy the file again"
        ) from error


def fill_log(log: Log, files: list[Path], episode: int | None, labels: dict[str, list[str]] | None = None) -> None:
    """Adds the columns of tables of one form, one below the other. episode: of it alone; labels: names of the
    components of vectors."""
    opened = [open_parquet(file) for file in files]
    widths = _widths(opened[0])
    rows = sum(parquet.metadata.num_rows for parquet in opened)
    names = needed_columns(list(widths), list(widths.values()), rows)
    if not names:
        raise kr5.FileError(files[0], "contains no column of numbers; expected positions and commands of joints")
    width = sum(widths[name] for name in names)
    room, seen = kept_rows(rows, width), 0
    kept: dict[str, np.ndarray] = {}
    for file, parquet in zip(files, opened):
        for batch in _batches(file, parquet, names, episode):
            for name, values in batch.items():
                if name not in kept:
                    kept[name] = np.empty((room, *values.shape[1:]))
                if values.shape[1:] != kept[name].shape[1:]:
                    raise _different_lengths(file, name)
                kept[name][seen : seen + len(values)] = values[: room - seen]
            seen += len(next(iter(batch.values())))
            if seen >= room:
                break
    if not seen:
        raise kr5.FileError(files[0], "has no row" + (f" of episode {episode}" if episode is not None else ""))
    if seen > room or (episode is None and room < rows):
        log.notes.append(cut_note(log.file.name, room, rows))
    for name in names:
        column = kept.pop(name)
        log.add_vector(name, column if seen >= room else column[:seen].copy(), "", (labels or {}).get(name, ()))


def _batches(file: Path, parquet: Any, names: list[str], episode: int | None) -> Iterator[dict[str, np.ndarray]]:
    """The rows of a table in parts; of an episode, those of the row groups that may have some."""
    import pyarrow
    import pyarrow.compute

    chosen = episode is not None and EPISODE in parquet.schema_arrow.names
    groups = [k for k in range(parquet.num_row_groups) if not chosen or _may_hold(parquet, k, episode)]
    top = list(dict.fromkeys(name.split(".")[0] if name not in parquet.schema_arrow.names else name for name in names))
    if not groups:
        return
    try:
        for batch in parquet.iter_batches(BATCH, row_groups=groups, columns=[*top, *([EPISODE] if chosen else [])]):
            if chosen:
                batch = batch.filter(pyarrow.compute.equal(batch.column(EPISODE), episode))
            if batch.num_rows:
                yield {name: _numbers(file, batch, name) for name in names}
    except kr5.FileError:  # which is an OSError, too
        raise
    except (pyarrow.ArrowException, OSError) as error:
        why = str(error).split("\n")[0][:200]
        raise kr5.FileError(file, f"cannot be read as Parquet: {why}; copy the file again") from error


def _may_hold(parquet: Any, group: int, episode: int | None) -> bool:
    """Whether a row group may have rows of an episode, by the extremes that it states of its columns."""
    metadata = parquet.metadata.row_group(group)
    for k in range(metadata.num_columns):
        column = metadata.column(k)
        if column.path_in_schema == EPISODE and column.statistics is not None and column.statistics.has_min_max:
            return bool(column.statistics.min <= episode <= column.statistics.max)
    return True


def _widths(parquet: Any) -> dict[str, int]:
    """Columns of numbers, those of structures by their path, and how many numbers each has in a row."""
    schema = parquet.schema_arrow
    first: Any = None
    out: dict[str, int] = {}
    for field in schema:
        for name, kind in _leaves(field.name, field.type):
            if _is_number(kind):
                out[name] = 1
            elif _is_list(kind) and _is_number(kind.value_type):
                if first is None:
                    lists = [f.name for f in schema if _is_list(f.type) and _is_number(f.type.value_type)]
                    first = next(parquet.iter_batches(1, columns=lists), None)
                length = getattr(kind, "list_size", None) or _first_length(first, name)
                if 0 < length <= WIDEST:
                    out[name] = length
    return out


def _first_length(batch: Any, name: str) -> int:
    if batch is None or name not in batch.schema.names or not batch.num_rows:
        return 0
    value = batch.column(name)[0].as_py()
    return 0 if value is None else len(value)


def _leaves(name: str, kind: Any) -> list[tuple[str, Any]]:
    import pyarrow.types

    if pyarrow.types.is_struct(kind):
        fields = [kind.field(k) for k in range(kind.num_fields)]
        return [leaf for field in fields for leaf in _leaves(f"{name}.{field.name}", field.type)]
    return [(name, kind)]


def _is_list(kind: Any) -> bool:
    import pyarrow.types

    return bool(
        pyarrow.types.is_list(kind) or pyarrow.types.is_large_list(kind) or pyarrow.types.is_fixed_size_list(kind)
    )


def _is_number(kind: Any) -> bool:
    from pyarrow import types

    tests = (types.is_integer, types.is_floating, types.is_boolean, types.is_timestamp)
    return any(test(kind) for test in tests)


def _numbers(file: Path, batch: Any, name: str) -> np.ndarray:
    """A column, rows or rows x components; NaN where there is no number, seconds for times."""
    import pyarrow
    from pyarrow import compute, types

    column = batch.column(name) if name in batch.schema.names else _field(batch, name)
    if _is_list(column.type):
        lengths = compute.list_value_length(column)
        length = compute.max(lengths).as_py()
        if lengths.null_count or compute.min(lengths).as_py() != length:
            raise _different_lengths(file, name)
        values = column.flatten().cast(pyarrow.float64()).to_numpy(zero_copy_only=False)
        return np.asarray(values, float).reshape(len(column), length)
    if types.is_timestamp(column.type):
        nanoseconds = column.cast(pyarrow.timestamp("ns", column.type.tz)).cast(pyarrow.int64())
        return np.asarray(nanoseconds.cast(pyarrow.float64(), safe=False).to_numpy(zero_copy_only=False)) * 1e-9
    return np.asarray(column.cast(pyarrow.float64(), safe=False).to_numpy(zero_copy_only=False), float)


def _different_lengths(file: Path, name: str) -> kr5.FileError:
    return kr5.FileError(
        file, f"column '{name}': found vectors of different lengths, expected as many numbers in each row"
    )


def _field(batch: Any, path: str) -> Any:
    from pyarrow import compute

    top, *fields = path.split(".")
    return compute.struct_field(batch.column(top), fields)
