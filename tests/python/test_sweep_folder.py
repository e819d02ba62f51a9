"""The folder of a sweep as kills, other sweeps and damage leave it."""

import csv
import fcntl
import json
import os

import kr5
import pytest
from kr5.files import writing

from kr5_tools.sweep import sweep_file
from kr5_tools.sweep.trials import HEADER, Grid, Trial, seed_of

GRID = Grid((15.0,), (0.5,), ("vertical",), ("profile_fit",), "arm", 5)
CELL = "format: kr5-cell/1\n"


def trial(number, grid=GRID):
    (key,) = [key for key in grid.keys(number + 1) if key.number == number]
    place = (key.orientation, key.strategy, key.tilt, key.clearance, key.number)
    return Trial(*place, seed_of(key, grid.seed), 0.001, 0.0, 1, 1, "done", "none", 4.5, 0.02, 1e-4, 12.0)


@pytest.fixture
def folder(tmp_path):
    """Of a sweep with two trials."""
    with sweep_file.SweepFolder(tmp_path / "sweep", GRID, CELL) as opened:
        opened.add([trial(0), trial(1)])
    return tmp_path / "sweep"


def contents(folder):
    return {f.name: f.read_bytes() for f in folder.iterdir()}


def refusal(folder, grid=GRID):
    with pytest.raises(kr5.IoError) as end:
        sweep_file.SweepFolder(folder, grid, CELL)
    return str(end.value)


def test_the_description_is_there_before_the_first_trial(tmp_path):
    with writing.held_back(), sweep_file.SweepFolder(tmp_path / "sweep", GRID, CELL):
        assert json.loads((tmp_path / "sweep" / "sweep.json").read_text())["seed"] == 5


def test_a_second_sweep_changes_nothing(folder):
    other = Grid((15.0,), (0.5,), ("vertical",), ("profile_fit",), "arm", 6)
    before = contents(folder)
    with (folder / "trials.csv").open("ab") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        assert "another sweep is using this folder" in refusal(folder, other)
    assert contents(folder) == before
    assert "seed: found 5, now it is 6" in refusal(folder, other)
    assert contents(folder) == before


def test_two_sweeps_that_begin_together_do_not_mix(tmp_path):
    path = tmp_path / "sweep"
    path.mkdir()
    with (path / "trials.csv").open("ab") as held:  # the other one has the lock, and has not said yet what it sweeps
        fcntl.flock(held, fcntl.LOCK_EX)
        assert "another sweep is using this folder" in refusal(path)
    assert contents(path) == {"trials.csv": b""}


def test_a_sweep_killed_as_it_began_goes_on(tmp_path):
    path = tmp_path / "sweep"
    path.mkdir()
    (path / ".kr5-abcd.json").write_text('{"format": "kr5-sw')
    (path / "trials.csv").write_bytes(b"")
    with sweep_file.SweepFolder(path, GRID, CELL) as opened:
        assert opened.trials == {}
    assert json.loads((path / "sweep.json").read_text())["format"] == "kr5-sweep/1"


@pytest.mark.parametrize("name, text", [("notes.txt", "mine"), ("trials.csv", "a,b\n")])
def test_a_folder_of_other_things_is_left_alone(tmp_path, name, text):
    path = tmp_path / "sweep"
    path.mkdir()
    (path / name).write_text(text)
    assert "with other files" in refusal(path)
    assert contents(path) == {name: text.encode()}


BAD_CELLS = [
    ("strategy", "luck"),
    ("orientation", "[bold]"),
    ("tilt_deg", "16"),
    ("clearance_mm", "nan"),
    ("trial", "-1"),
    ("seed", "7"),
    ("inserted", "2"),
    ("time", "inf"),
    ("depth", "1e999"),
    ("attempts", "0"),
    ("attempts", "1e3"),
    ("trial", "9" * 400),
]


@pytest.mark.parametrize("column, value", BAD_CELLS)
def test_a_row_that_is_no_trial_is_named(folder, column, value):
    file = folder / "trials.csv"
    rows = list(csv.reader(file.read_text().splitlines()))
    rows[2][HEADER.index(column)] = value
    file.write_text("\n".join(",".join(row) for row in rows) + "\n")
    before = contents(folder)
    assert "trials.csv:3: is not a trial" in refusal(folder)
    assert contents(folder) == before


def test_trials_without_an_end_are_refused(folder):
    (folder / "trials.csv").unlink()
    os.mkfifo(folder / "trials.csv")  # to which nobody writes
    with pytest.raises(kr5.FileError, match="trials.csv: is a pipe or a socket; expected the trials of the sweep"):
        sweep_file.read_trials(folder / "trials.csv", GRID)


def test_a_folder_in_the_place_of_the_trials_is_refused(folder):
    (folder / "trials.csv").unlink()
    (folder / "trials.csv").mkdir()
    assert "trials.csv: cannot be written: Is a directory; choose another folder (-o)" in refusal(folder)
    with pytest.raises(kr5.FileError, match="trials.csv: cannot be read: Is a directory; expected the trials"):
        sweep_file.read_trials(folder / "trials.csv", GRID)


def test_a_file_in_the_place_of_the_folder_is_refused(folder):
    assert "sweep.json: cannot be written: File exists; choose another folder" in refusal(folder / "sweep.json")
    assert "cannot be written: Not a directory" in refusal(folder / "sweep.json" / "deeper")


@pytest.mark.parametrize("damage", [b"\xff\xfe", b"\x00", b'"' + b"x" * 200_000 + b'"'])
def test_bytes_that_are_no_table_are_refused(folder, damage):
    file = folder / "trials.csv"
    file.write_bytes(file.read_bytes() + damage + b"\n")
    assert "trials.csv" in refusal(folder)
