"""Logs of a robot with its model, from Python: what `kr5 gap diagnose LOG --model MODEL` does."""

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import kr5.arm_log
import kr5.gap
from kr5.logs.column_list import header_entry
from kr5.logs.compared_source import ComparedSource, SourceOptions, open_source

Paths = str | os.PathLike[str] | Sequence[str | os.PathLike[str]]


def read_logs(
    logs: Paths,
    model: str | os.PathLike[str],
    *,
    base: str = "",
    tip: str = "",
    every: float | None = None,
    columns: str = "",
    settings: Sequence[str] = (),
    trust: bool = False,
    episodes: str = "",
    check: str = "",
) -> ComparedSource:
    """Logs of one robot as a recording, columns found by their names and numbers.

    logs: in any format, one or several. model: URDF, MJCF or cell file of the robot. base, tip: links of the
    model between which the arm is. every: interval of rows without a clock [s]. columns: their
    names in order, where a log has none or others, such as "t,q{1-6},tau{1-6}". settings: entries of the map or the
    cell, such as "columns.tau.unit=N mm". trust: also numbers that are implausible.
    episodes: those of a data set, such as "3,7-12". check: of several logs or episodes, those that are kept to judge,
    by name or number; without, the last ones.

    The result has `recording` (kr5.cell.Recording), `notes` (how the columns were read) and `best_arm` (what the best
    rigid arm with friction is off in each column: kr5.arm_log.BestArmErrors).

    Raises kr5.FileError where a file cannot be read and kr5.Errors, with every problem, where the logs do not fit the
    model; the text names the remedy, with `--set` for `settings`. Warns with kr5.Implausible of what `trust` lets pass.
    """
    paths = [logs] if isinstance(logs, (str, os.PathLike)) else list(logs)
    entries = [*([header_entry(columns)] if columns else []), *settings]
    options = SourceOptions(Path(model), base, tip, every, entries, trust, episodes, check)
    return open_source([Path(path) for path in paths], options)


def diagnose_logs(
    logs: Paths,
    model: str | os.PathLike[str],
    *,
    options: kr5.gap.DiagnoseOptions | None = None,
    progress: Callable[[str, float], None] | None = None,
    **reading: Any,
) -> kr5.gap.Diagnosis:
    """Why a model and a robot disagree. `reading`: as of read_logs; options, progress: as of kr5.gap.diagnose. The
    search is as wide as the log of a real arm needs, unless options say otherwise."""
    compared = read_logs(logs, model, **reading)
    return kr5.arm_log.diagnose(compared.recording, None, options or kr5.gap.DiagnoseOptions(), progress)
