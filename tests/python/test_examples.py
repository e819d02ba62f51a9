"""The numbered examples: each runs as typed, from any folder, and prints what its C++ twin prints (a ctest compares
that one with the same file)."""

import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).resolve().parents[2] / "tools/examples").glob("[0-9]*.py"))


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda file: file.stem)
def test_an_example_prints_what_its_twin_prints(example, tmp_path):
    done = subprocess.run([sys.executable, example], capture_output=True, text=True, timeout=300, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout == example.with_suffix(".txt").read_text()
    assert example.with_suffix(".cpp").exists()
    assert not list(tmp_path.iterdir())
