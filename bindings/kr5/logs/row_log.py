"""Rows of numbers, written to a log in CSV or MCAP while they come; the readers of this package read it."""

import contextlib
import json
import math
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

import kr5
from kr5.files import writing
from kr5.logs.mcap_file import INSTALL

ENDINGS = (".csv", ".mcap")
Put = Callable[[np.ndarray], None]


def check_ending(file: Path | None) -> None:
    """Complains of a log of another form before there are rows."""
    if file is not None and file.suffix.lower() not in ENDINGS:
        raise kr5.FileError(file, f"found the ending '{file.suffix}', expected .csv or .mcap")
    if file is not None and file.suffix.lower() == ".mcap":
        _mcap_writer(file)


@contextlib.contextmanager
def row_log(file: Path | None, names: Sequence[str], topic: str) -> Iterator[Put]:
    """A function that adds rows, of which the first number is a time [s]; the file is there once the block has ended.
    `topic`: of the messages of an MCAP."""
    if file is None:
        yield lambda rows: None
        return
    is_mcap = file.suffix.lower() == ".mcap"
    with writing.beside(file) as new, _mcap_rows(new, names, topic) if is_mcap else _csv_rows(new, names) as put:
        yield put


@contextlib.contextmanager
def _csv_rows(file: Path, names: Sequence[str]) -> Iterator[Put]:
    with file.open("w", encoding="utf-8", newline="\n") as stream:
        stream.write(",".join(names) + "\n")

        def put(rows: np.ndarray) -> None:
            for row in rows:
                stream.write(",".join(f"{v:.12g}" if math.isfinite(v) else "" for v in row) + "\n")

        yield put


def _mcap_writer(file: Path) -> type:
    try:
        from mcap.writer import Writer
    except ImportError:
        raise kr5.FileError(file, f"to write MCAP, the package mcap is needed: {INSTALL}") from None
    return Writer


@contextlib.contextmanager
def _mcap_rows(file: Path, names: Sequence[str], topic: str) -> Iterator[Put]:
    begun = time.time_ns()
    schema = {"type": "object", "properties": {name: {"type": "number"} for name in names}}
    with file.open("wb") as stream:
        writer = _mcap_writer(file)(stream)
        writer.start()
        channel = writer.register_channel(
            f"/{topic}", "json", writer.register_schema(topic, "jsonschema", json.dumps(schema).encode())
        )

        def put(rows: np.ndarray) -> None:
            for row in rows:
                stamp = begun + round(1e9 * row[0])
                message = {name: float(v) for name, v in zip(names, row) if math.isfinite(v)}
                writer.add_message(channel, stamp, json.dumps(message).encode(), stamp)

        try:
            yield put
        finally:
            writer.finish()
