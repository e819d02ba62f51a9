"""Shared libraries: what they need, where it stands, which symbols they use of each other."""

import re
import subprocess
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

# Part of every Linux for which a wheel is made (PEP 600), and of Python itself.
SYSTEM = re.compile(r"(ld-linux.*|linux-vdso|lib(c|m|dl|rt|pthread|resolv|stdc\+\+|gcc_s|z))\.so(\.|$)")


@dataclass(frozen=True, order=True)
class Symbol:
    name: str
    version: str  # empty where the library has no versions
    kind: str  # as nm says it: T, W, i of functions, others of data
    size: int


def needed(library: Path) -> list[str]:
    """Names of the libraries that one is linked with."""
    return re.findall(r"NEEDED\s+(\S+)", _run("objdump", "-p", library))


def closure(libraries: Iterable[Path]) -> dict[str, Path]:
    """Where the loader finds all that these need, directly or not, by name."""
    out = {}
    for library in libraries:
        for name, path in re.findall(r"(\S+) => (/\S+)", _run("ldd", library)):
            out[name] = Path(path)
    return out


def reachable(libraries: Iterable[Path], places: dict[str, Path], without: re.Pattern[str]) -> dict[str, Path]:
    """Those of `places` that are needed when nothing is loaded whose name matches `without`; none of the system."""
    out: dict[str, Path] = {}
    waiting = [name for library in libraries for name in needed(library)]
    while waiting:
        name = waiting.pop()
        if name in out or name not in places or without.match(name) or SYSTEM.match(name):
            continue
        out[name] = places[name]
        waiting += needed(places[name])
    return out


def used_symbols(user: Path, of: Path) -> set[Symbol]:
    """The symbols of a library that another one uses."""
    wanted = {line.split()[-1] for line in _run("nm", "-D", "--undefined-only", user).splitlines()}
    out = set()
    for line in _run("nm", "-D", "-S", "--defined-only", of).splitlines():
        *numbers, kind, name = line.split()
        plain, _, version = name.replace("@@", "@").partition("@")
        size = int(numbers[1], 16) if len(numbers) > 1 else 0
        if name.replace("@@", "@") in wanted or plain in wanted:
            out.add(Symbol(plain, version, kind, size))
    return out


def _run(*command: object) -> str:
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, check=True).stdout
