"""Every command against files that are not as they should be: tests/fuzz/commands, in short and in full."""

import importlib
import json
import os
import subprocess
import sys

import pytest

from conftest import ROOT

pytest.importorskip("kr5.sim", reason="this kr5 was built without DART")
for needed in ("h5py", "mcap", "pyarrow", "rosbags"):
    pytest.importorskip(needed, reason="pip install 'kr5[test]'")

COMMANDS = ROOT / "tests/fuzz/commands"
IN_SHORT = [["unchanged", "found", "files", "--minutes", 1, "--runs", 120]]
IN_FULL = [["unchanged", "found", "files", "--minutes", 10], ["cells", "--minutes", 10]]


@pytest.mark.parametrize(
    "what", IN_FULL if os.environ.get("KR5_FULL") else IN_SHORT, ids=lambda words: " ".join(map(str, words))
)
def test_no_command_ends_otherwise_than_it_says(what, tmp_path):
    command = [sys.executable, COMMANDS, "--seed", 1, "--keep", tmp_path, *what]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture
def found(monkeypatch):
    monkeypatch.syspath_prepend(str(COMMANDS))
    return importlib.import_module("found")


def finding(found, change):
    job = next(j for j in importlib.import_module("inputs").JOBS if j.arguments.startswith("pick cloud.pcd"))
    return found.Found(job, change, "cloud.pcd: other bytes", "traceback: KeyError at kr5_tools/x.py:f", ("out.json",))


@pytest.mark.parametrize(
    "kind, content",
    [("file", b"\x00\xffrows"), ("link", b"/dev/zero"), ("folder", b""), ("pipe", b""), ("missing", b"")],
)
def test_what_was_found_is_saved_and_put_back(found, tmp_path, kind, content):
    one = finding(found, found.Change("cloud.pcd", kind, content))
    folder = found.save(one, tmp_path / "found")
    assert found.save(one, tmp_path / "found") == folder  # once
    assert found.load(tmp_path / "found") == [one]
    for before in ("file", "folder"):
        place = tmp_path / before
        place.mkdir()
        if before == "file":
            (place / "cloud.pcd").write_text("as it was")
        else:
            (place / "cloud.pcd").mkdir()
        found.put(one.change, place)
        assert found.take(place / "cloud.pcd", place) == one.change


def test_a_finding_whose_command_is_no_job_any_more_is_told(found, tmp_path):
    folder = found.save(finding(found, found.Change("cloud.pcd", "missing")), tmp_path)
    record = json.loads((folder / found.RECORD).read_text())
    (folder / found.RECORD).write_text(json.dumps({**record, "command": "pick nothing"}))
    with pytest.raises(ValueError, match="'kr5 pick nothing' is no job; write one"):
        found.load(tmp_path)


def test_a_problem_is_told_and_kept_and_ends_in_failure(tmp_path):
    """A job that is expected to end otherwise than it does stands for a command that does so."""
    program = """
import dataclasses, runpy, sys
sys.path.insert(0, {commands!r})
import inputs
job = next(j for j in inputs.JOBS if j.arguments.startswith("pick cloud.pcd"))
inputs.JOBS = [dataclasses.replace(job, code=7)]
inputs.prepare = lambda folder, run: (folder / "cell").mkdir()
sys.argv = ["fuzz", "unchanged"]
runpy.run_path({commands!r}, run_name="__main__")
"""
    words = [sys.executable, "-c", program.format(commands=str(COMMANDS))]
    done = subprocess.run(words, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 1, done.stdout + done.stderr
    assert "exit code 2 of unchanged inputs, expected 7" in done.stdout and "pick cloud.pcd" in done.stdout
