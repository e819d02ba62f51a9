"""Who may do what in the Python part: only commands end a process and know typer, only they are not imported."""

import ast
import functools
import importlib
from pathlib import Path

import kr5
import pytest

import kr5_tools
from kr5_tools.command_table import entries

TOOLS = Path(kr5_tools.__file__).parent
LIBRARY = Path(kr5.__file__).parent
PACKAGES = [LIBRARY / name for name in ("files", "logs", "models", "tables")]
# What talks to people beside the commands: their common terminal, options that several share, and their texts.
TALKING = {
    "gap/source.py",
    "gap/terminal_report.py",
    "gap/diagnosis_run.py",
    "exports/command_line.py",
    "sweep/runner.py",
}


@functools.cache
def commands() -> set[str]:
    """Modules of commands: those of the table of the command, and what a group of it is made of."""
    found = {f"kr5_tools.{entry.module}" for entry in entries()}
    for file in TOOLS.rglob("*.py"):
        if any(isinstance(n, ast.FunctionDef) and n.name == "add_to" for n in ast.parse(file.read_text()).body):
            found.add(module_of(file))
    return found


def module_of(file: Path) -> str:
    return "kr5_tools." + ".".join(file.relative_to(TOOLS).with_suffix("").parts)


def libraries() -> list[Path]:
    """Files that are no commands, and not what commands talk with."""
    told = commands() | {"kr5_tools.app", "kr5_tools.start", "kr5_tools.__main__"}
    files = [f for f in TOOLS.rglob("*.py") if module_of(f) not in told and f.parent.name != "cli"]
    return [*files, *(f for package in PACKAGES for f in package.rglob("*.py"))]


def calls(tree: ast.Module) -> list[str]:
    return [ast.unparse(n.func) for n in ast.walk(tree) if isinstance(n, ast.Call)]


def imported(tree: ast.Module) -> set[str]:
    """Full names of the modules, and of what is taken from them, which may be a module too."""
    names = {a.name for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module, *(f"{node.module}.{a.name}" for a in node.names)}
    return names


def test_only_commands_print_and_end():
    for file in libraries():
        ends = {"fail", "terminal.fail", "print_note", "terminal.print_note", "print", "sys.exit", "typer.Exit"}
        found = ends & set(calls(ast.parse(file.read_text())))
        assert not found, f"{file}: calls {found}; raise kr5.Error, or warn with kr5.Caution"


def test_only_what_talks_knows_typer_and_rich():
    for file in libraries():
        if file.is_relative_to(TOOLS) and file.relative_to(TOOLS).as_posix() in TALKING:
            continue
        found = {"typer", "rich"} & {name.split(".")[0] for name in imported(ast.parse(file.read_text()))}
        assert not found, f"{file}: imports {found}"


def test_no_library_imports_a_command():
    importers = {"kr5_tools.app", "kr5_tools.gap.command", "kr5_tools.rsi.command"}
    for file in (f for f in TOOLS.rglob("*.py") if module_of(f) not in importers):
        found = commands() & imported(ast.parse(file.read_text())) - {module_of(file)}
        assert not found, f"{file}: imports the command {found}; what both need is a library of its own"


@pytest.mark.parametrize("package", ["kr5.files", "kr5.logs", "kr5.models", "kr5.tables"])
def test_what_a_package_exports_is_documented(package):
    module = importlib.import_module(package)
    assert module.__doc__ and module.__all__
    for name in module.__all__:
        member = getattr(module, name)
        assert not callable(member) or member.__doc__, f"{package}.{name} has no docstring"
