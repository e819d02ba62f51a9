"""Folders of SAGE: `control.csv` with commands and `state_motor.csv` with measurements, lists in their cells."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

import kr5
from kr5 import arm_log
from kr5.logs.log import Log
from kr5.logs.units import unit_factor

TABLES = ("control", "state_motor")


def is_sage_folder(path: Path) -> bool:
    return path.is_dir() and all((path / f"{table}.csv").is_file() for table in TABLES)


def read_sage(folder: Path, read_table: Callable[[Path], Log]) -> Log:
    """`command.positions`, `state.positions` and others, a column a joint of joint_list.txt. Both tables count their
    time from one origin."""
    log = Log(folder)
    joints = _joints(folder)
    stamps: dict[str, np.ndarray] = {}
    for table in TABLES:
        own = read_table(folder / f"{table}.csv")
        log.notes += own.notes
        stamps[table] = own.column("timestamp", f"{folder}: {table}.csv")
        for name, columns in own.arrays.items():
            stem = f"{'command' if table == 'control' else 'state'}.{name}"
            log.add_vector(stem, own.stacked(columns), table, joints)
        if not own.arrays:
            raise kr5.FileError(own.file, "found no column of lists in brackets, expected positions of the joints")
    unit = arm_log.guess_time_unit(stamps["state_motor"])
    for table, times in stamps.items():
        name = f"{table}:timestamp"
        log.add(name, times * unit_factor(str(unit), ("time",), "clock")[0], table)
        log.clocks[table] = name
    return log


def _joints(folder: Path) -> list[str]:
    """Names of the joints in the order of the lists; none where the file lacks."""
    file = folder / "joint_list.txt"
    return file.read_text(encoding="utf-8-sig").split() if file.is_file() else []
