"""The licences of the libraries in a wheel: of each the text of its Debian source package, and where its source is."""

import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

COMMON = Path("/usr/share/common-licenses")


@dataclass(frozen=True, order=True)
class Package:
    name: str
    version: str
    source: str  # name and version of its source package

    @property
    def licence(self) -> str:
        """Name of the file with its licence."""
        return f"{self.source.split()[0]}.txt"


def package_of(library: Path) -> Package:
    """The Debian package that a library came with."""
    path = library.resolve()
    names = [str(path), str(path).removeprefix("/usr")]  # /lib and /usr/lib are one folder
    found = subprocess.run(["dpkg-query", "-S", *names], capture_output=True, text=True).stdout
    if not found:
        raise SystemExit(f"error: {path} belongs to no Debian package, so its licence is not known")
    name = found.split(":", 1)[0].split(",")[0]
    form = "${Package}\t${Version}\t${source:Package} ${source:Version}"
    shown = subprocess.run(["dpkg-query", "-W", f"-f={form}", name], capture_output=True, text=True, check=True).stdout
    return Package(*shown.split("\t"))


def write_licences(libraries: dict[str, Path], folder: Path) -> None:
    """Writes the text of every source package, the common licences that they name, and an index."""
    folder.mkdir(parents=True)
    by_package: dict[Package, list[str]] = {}
    for name, path in sorted(libraries.items()):
        by_package.setdefault(package_of(path), []).append(name)
    common = set()
    for package in by_package:
        text = (Path("/usr/share/doc") / package.name / "copyright").read_text(encoding="utf-8", errors="replace")
        common |= set(re.findall(rf"{COMMON}/([\w.-]*\w)", text))
        (folder / package.licence).write_text(text, encoding="utf-8")
    for name in sorted(common):
        if (COMMON / name).is_file():
            (folder / f"{name}.txt").write_bytes((COMMON / name).read_bytes())
    (folder / "README.md").write_text(_index(by_package), encoding="utf-8")


def _index(by_package: dict[Package, list[str]]) -> str:
    rows = [
        f"| {', '.join(names)} | {p.name} {p.version} | {p.source} | {p.licence} |"
        for p, names in sorted(by_package.items())
    ]
    return (
        "# Libraries in this wheel\n\n"
        "The libraries in `kr5.libs` are those of Debian, stripped. Each is under the licence that the table names;"
        " kr5 itself is under BSD-3-Clause. ViSP, GSL and SuiteSparseQR are under the GPL, and so"
        " are the extensions that are linked with them, `kr5._kr5`, `kr5._kr5_vision` and `kr5._kr5_work`, as a whole"
        " under version 3."
        " The source of a library is that of its Debian package: `apt-get source SOURCE=VERSION`, or"
        " https://snapshot.debian.org.\n\n"
        "| library | Debian package | source | licence |\n|---|---|---|---|\n" + "\n".join(rows) + "\n"
    )
