"""JSON logs: a list of objects of numbers, a row each, as BAM writes its logs, or lists of numbers by name."""

import json
from pathlib import Path

import numpy as np

import kr5
from kr5.files.documents import read_text
from kr5.logs.log import Log

MAX_BYTES = 512 << 20
EXPECTED = "a list of objects with numbers, such as {entries: [{timestamp, position, goal_position}, ...]}"


def read_json_log(file: Path) -> Log:
    """Numbers by their keys; those beside the rows (a mass, a voltage) are told in a note."""
    try:
        data = json.loads(read_text(file, EXPECTED, MAX_BYTES))
    except (ValueError, RecursionError) as error:
        raise kr5.FileError(file, f"is no JSON: {error}; expected {EXPECTED}") from error
    log = Log(file)
    lists = data if isinstance(data, dict) else {"": data}
    for rows in lists.values():
        if isinstance(rows, list) and len(rows) > 1 and all(isinstance(row, dict) for row in rows):
            _add_rows(log, rows)
            break
    else:
        for name, values in lists.items():
            if (numbers := _as_numbers(values)) is not None:
                log.add_vector(name or "column", numbers, f"{len(numbers)} rows")
    if not log.columns:
        raise kr5.FileError(file, f"contains no rows of numbers; expected {EXPECTED}")
    single = {k: v for k, v in lists.items() if isinstance(v, (int, float, str)) and not isinstance(v, bool)}
    log.stated = {k: float(v) for k, v in single.items() if not isinstance(v, str)}
    if single:
        told = ", ".join(
            f"{key} {value if isinstance(value, str) else format(value, 'g')}" for key, value in single.items()
        )
        log.notes.append(f"{file.name} states {told}, which is not read into the model")
    return log


def _add_rows(log: Log, rows: list[dict[str, object]]) -> None:
    for name in dict.fromkeys(key for row in rows for key in row):
        numbers = _as_numbers([row.get(name) for row in rows])
        if numbers is not None:
            log.add_vector(name, numbers, "")


def _as_numbers(values: object) -> np.ndarray | None:
    """Numbers, or vectors of one length, a row each; NaN where there is none. Nothing for other values."""
    if not isinstance(values, list) or len(values) < 2:
        return None
    try:
        out = np.array([np.nan if v is None else v for v in values], float)
    except (TypeError, ValueError):
        return None
    return out if out.ndim in (1, 2) and np.isfinite(out).any() else None
