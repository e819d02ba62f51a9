"""What the command lines of the benches share."""

import argparse
import os
from pathlib import Path

REFERENCE = Path(os.environ.get("KR5_REFERENCE_DIR", Path(__file__).resolve().parents[3] / "shared"))


def parser(doc: str, *, reference: bool = False, build: bool = False, json: bool = False) -> argparse.ArgumentParser:
    """A parser whose help is the bench's own text, with the arguments several benches have."""
    out = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    if build:
        out.add_argument("build", type=Path, help="folder of a C++ build with tests")
        out.add_argument("--quick", action="store_true", help="few trials, as in CI")
    if reference:
        out.add_argument("--reference", type=Path, default=REFERENCE, help="folder that holds data/")
    if json:
        out.add_argument("--json", type=Path, help="write the figures here")
    return out
