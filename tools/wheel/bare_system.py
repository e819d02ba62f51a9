"""A system without the libraries that a wheel brings: the files of Python's own packages and nothing else.

Made of what is installed here, so it needs no network and some seconds. `bwrap` (Debian: bubblewrap) shows it to a
command as its root.
"""

import os
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path

# Everything that a bare Debian with Python has; what they depend on follows.
PACKAGES = ("base-files", "bash", "coreutils", "libc-bin", "libstdc++6", "python3", "python3-venv")
LEFT_OUT = ("/usr/share/doc", "/usr/share/man", "/usr/share/locale", "/usr/share/info")


def package_closure(names: tuple[str, ...] = PACKAGES) -> set[str]:
    """The packages and all that they depend on, of those installed."""
    shown = _run("dpkg-query", "-W", "-f=${Package}\t${Depends}, ${Pre-Depends}\t${Provides}\n")
    depends: dict[str, list[str]] = {}
    for line in shown.splitlines():
        name, needs, provides = line.split("\t")
        depends[name] = [_name(part) for alternatives in needs.split(",") for part in alternatives.split("|")]
        for virtual in filter(None, map(_name, provides.split(","))):
            depends.setdefault(virtual, []).append(name)
    out: set[str] = set()
    waiting = list(names)
    while waiting:
        name = waiting.pop()
        if name in depends and name not in out:
            out.add(name)
            waiting += depends[name]
    return out


def make(folder: Path) -> None:
    """Copies the files of these packages below `folder`."""
    packages = sorted(package_closure() & set(_run("dpkg-query", "-W", "-f=${Package}\n").split()))
    files = _run("dpkg-query", "-L", *packages).splitlines()
    for link in ("bin", "lib", "lib64", "sbin"):  # of a system whose /usr is merged
        if Path("/", link).is_symlink():
            (folder / link).parent.mkdir(parents=True, exist_ok=True)
            (folder / link).symlink_to(os.readlink(Path("/", link)))
    for name in ("dev", "proc", "tmp"):
        (folder / name).mkdir()
    for name in files:
        source = Path(name)
        if not name.startswith("/") or name.startswith(LEFT_OUT) or source.is_dir() or not os.path.lexists(source):
            continue
        copy = folder / str(source.parent.resolve() / source.name).lstrip("/")
        copy.parent.mkdir(parents=True, exist_ok=True)
        if not os.path.lexists(copy):
            shutil.copy2(source, copy, follow_symlinks=False)


def command(
    root: Path, words: list[str], readable: list[Path], writable: list[Path], environment: Mapping[str, str]
) -> list[str]:
    """The command that runs `words` with `root` as /, with these folders at the places that they have here."""
    out = ["bwrap", "--unshare-all", "--die-with-parent", "--bind", str(root), "/", "--proc", "/proc", "--dev", "/dev"]
    out += ["--tmpfs", "/tmp", "--clearenv"]
    for name, value in {"PATH": "/usr/bin", "HOME": "/tmp", "LANG": "C.UTF-8", **environment}.items():
        out += ["--setenv", name, value]
    for folder in readable:
        out += ["--ro-bind", str(folder), str(folder)]
    for folder in writable:
        out += ["--bind", str(folder), str(folder)]
    return [*out, *words]


def _name(dependency: str) -> str:
    """`python3:any (>= 3.11)` is python3."""
    return dependency.strip().split(" ")[0].split(":")[0]


def _run(*words: str) -> str:
    return subprocess.run(words, capture_output=True, text=True, check=True).stdout
