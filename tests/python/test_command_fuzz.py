"""Every command against files that are not as they should be: tests/fuzz/commands, in short and in full."""

import os
import subprocess
import sys

import pytest

from conftest import ROOT

pytest.importorskip("kr5.sim", reason="this kr5 was built without DART")
pytest.importorskip("mcap", reason="pip install 'kr5[mcap]'")

FILES = ["--minutes", 1, "--runs", 120]
IN_FULL = [["--minutes", 10], ["--cells", "--minutes", 10]]


@pytest.mark.parametrize(
    "what", IN_FULL if os.environ.get("KR5_FULL") else [FILES], ids=lambda words: " ".join(map(str, words))
)
def test_no_command_ends_otherwise_than_it_says(what, tmp_path):
    command = [sys.executable, ROOT / "tests" / "fuzz" / "commands", "--seed", 1, "--keep", tmp_path, *what]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
