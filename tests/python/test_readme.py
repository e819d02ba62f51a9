"""Every name that the README and the tasks of the guide give exists: headers, Python names, commands, files; and the
Python of the README runs as typed."""

import importlib
import re
import subprocess
import sys

import pytest
import typer.main

from conftest import ROOT
from kr5_tools.app import make_app

README = (ROOT / "README.md").read_text(encoding="utf-8")
TASKS = (ROOT / "share/doc/tasks.md").read_text(encoding="utf-8")
TEXT = README + TASKS
PROSE = re.sub(r"```.*?```", "", TEXT, flags=re.DOTALL)
TABLE = [line for line in TASKS.splitlines() if line.startswith("| ") and "`" in line]
FOLDERS = (ROOT / "libkr5/include", ROOT / "sim/include")


def code(text):
    """What stands between backticks on one line."""
    return re.findall(r"`([^`\n]+)`", text)


def headers():
    """The headers of a cell of the table: one after a comma may be named without its folder."""
    out = []
    for line in TABLE:
        folder = ""
        for name in code(line.split("|")[3]):
            if "/" in name:
                folder = name.rpartition("/")[0]
            out.append(name if "/" in name else f"{folder}/{name}")
    return out + re.findall(r"#include <(kr5/[^>]+)>", TEXT)


def python_names():
    found = {word for line in code(PROSE) for word in re.findall(r"(?<![\w/.-])kr5(?:\.\w+)+", line)}
    return sorted(name for name in found if not name.endswith((".hpp", ".py", ".yaml")))


def commands():
    """The words of each command, of texts such as `kr5 gap plan RECORDING`, `./tools/run kr5 calibrate hand-eye`."""
    found = set()
    for text in code(PROSE):
        for words in re.findall(r"(?:^|\s)kr5((?: [a-z][a-z-]*)+)", text):
            found.add(tuple(words.split()))
    return sorted(found)


def linked_files():
    links = re.findall(r"\]\(([^)#]+)\)", README)
    return sorted(
        {link for link in links if "://" not in link}
        | {w for text in code(PROSE) for w in re.findall(r"(?<![\w./<-])(?:tools|share|libkr5|tests)/[\w./-]+\w", text)}
    )


def test_the_readme_is_read():
    assert len(README.splitlines()) < 110
    assert len(TABLE) > 40 and len(headers()) > 35 and len(python_names()) > 25
    assert len(commands()) > 20 and len(linked_files()) > 5


@pytest.mark.parametrize("name", headers())
def test_a_header_exists(name):
    assert any((folder / name).exists() for folder in FOLDERS)
    assert name.startswith("kr5/")


@pytest.mark.parametrize("name", python_names())
def test_a_python_name_exists(name):
    found = importlib.import_module("kr5")
    done = "kr5"
    for part in name.split(".")[1:]:
        done += f".{part}"
        if not hasattr(found, part):
            try:
                importlib.import_module(done)
            except ModuleNotFoundError as error:
                if done.startswith("kr5.sim"):
                    pytest.skip("this kr5 was built without DART")
                raise AssertionError(f"{name}: there is no {done}") from error
        found = getattr(found, part)


@pytest.mark.parametrize("words", commands(), ids=" ".join)
def test_a_command_exists(words):
    """What follows a command without subcommands are arguments."""
    found = typer.main.get_command(make_app())
    for word in words:
        if not getattr(found, "commands", None):
            break
        assert word in found.commands, f"kr5 {' '.join(words)}: there is no {word}"
        found = found.commands[word]
    assert not getattr(found, "commands", None), f"kr5 {' '.join(words)} is a group of commands"


@pytest.mark.parametrize("name", linked_files())
def test_a_file_exists(name):
    assert (ROOT / name).exists()


def test_no_name_of_the_module_in_the_examples_is_unknown():
    """The names that the examples in Python import."""
    for module, names in re.findall(r"^from (kr5[\w.]*) import (.+)$", TEXT, re.MULTILINE):
        for name in names.split(","):
            assert hasattr(importlib.import_module(module), name.strip()), f"{module}.{name}"


BLOCKS = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)


def test_the_examples_in_python_are_read():
    assert BLOCKS


@pytest.mark.parametrize("code", BLOCKS, ids=range(len(BLOCKS)))
def test_an_example_in_python_runs_as_typed(code, tmp_path):
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, timeout=300)
    assert done.returncode == 0, done.stderr
    assert "verdict='explained'" in done.stdout
