"""Blocks of code of a page of the guide, and how they run: for the tests of the guide.

A block `sh` or `python` runs as typed, in the folder of its page, in order. What stands before it says otherwise:
`<!-- not run: REASON -->`, or `<!-- exit code 1 -->` where the command is to end with that code. A block `text` that
follows is what the block prints; a line `…` of it stands for any lines, a `…` within a line for any text. A block
with `title="FILE"` is written into that file of the folder.
"""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

FENCE = re.compile(r"^```(\w*)(.*)$")
MARK = re.compile(r"^<!-- (not run: (?P<reason>.+)|exit code (?P<code>\d+)) -->$")
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
RUN = ("sh", "python")
ANY = "…"
SNIPPET = "--8<--"


@dataclass
class Block:
    language: str
    title: str
    text: str
    line: int
    not_run: str = ""  # reason
    code: int = 0  # exit code
    output: str | None = None


def read_blocks(page: str) -> list[Block]:
    """The blocks of a page in order, each with the output that is quoted below it."""
    out: list[Block] = []
    lines = page.split("\n")
    mark, k, adjacent = None, 0, False
    while k < len(lines):
        opened = FENCE.match(lines[k])
        if not opened:
            found = MARK.match(lines[k])
            if lines[k].strip():
                mark, adjacent = found, False
            k += 1
            continue
        end = next(e for e in range(k + 1, len(lines)) if lines[e] == "```")
        text = "\n".join(lines[k + 1 : end])
        title = re.search(r'title="([^"]+)"', opened[2])
        if text.startswith(SNIPPET):  # a file with tests of its own
            mark, k, adjacent = None, end + 1, False
            continue
        if opened[1] == "text" and adjacent and out and out[-1].output is None:
            out[-1].output = text
        else:
            block = Block(opened[1], title[1] if title else "", text, k + 1)
            if mark:
                block.not_run, block.code = mark["reason"] or "", int(mark["code"] or 0)
            out.append(block)
        mark, k, adjacent = None, end + 1, opened[1] in RUN
    return out


def prepare(folder: Path, share: Path) -> dict[str, str]:
    """Makes the folder of a page: `share` as in a checkout, and `kr5` as this Python has it; gives its environment."""
    commands = folder / ".bin"
    commands.mkdir(parents=True)
    for name, words in (("kr5", "-m kr5_tools"), ("python", ""), ("python3", "")):
        file = commands / name
        file.write_text(f'#!/bin/sh\nexec "{sys.executable}" {words} "$@"\n')
        file.chmod(0o755)
    (folder / "share").symlink_to(share)
    return {**os.environ, "PATH": f"{commands}:{os.environ['PATH']}", "COLUMNS": "80", "NO_COLOR": "1", "TERM": "dumb"}


def run_block(block: Block, folder: Path, environment: dict[str, str], timeout: float = 300) -> str:
    """Runs a block and gives what it printed. @raises AssertionError when it ends otherwise than it should."""
    words = ["bash", "-euo", "pipefail", "-c"] if block.language == "sh" else [sys.executable, "-c"]
    done = subprocess.run(
        [*words, block.text],
        cwd=folder,
        env=environment,
        text=True,
        timeout=timeout,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    where = f"line {block.line}: {block.text}"
    assert done.returncode == block.code, f"{where}\nexit code {done.returncode}, expected {block.code}\n{done.stdout}"
    return done.stdout


def differences(expected: str, found: str) -> str:
    """In which line what is quoted is not what was printed; empty when it is."""
    wanted = [line for line in map(_squeeze, expected.split("\n")) if line]
    shown = [line for line in map(_squeeze, found.split("\n")) if line]
    k = 0
    free = False
    for line in wanted:
        if line == ANY:
            free = True
            continue
        places = range(k, len(shown)) if free else range(k, min(k + 1, len(shown)))
        at = next((p for p in places if _same(line, shown[p])), None)
        if at is None:
            near = "nothing more" if k >= len(shown) else f"after line {k}: {shown[k]!r}"
            return f"quoted: {line!r}; printed: {near}"
        k, free = at + 1, False
    return "" if free or k == len(shown) else f"printed beyond what is quoted: {shown[k]!r}"


def _squeeze(line: str) -> str:
    return " ".join(line.split())


def _same(wanted: str, shown: str) -> bool:
    """Whether two lines have the same words, and numbers that differ by one of the last digit quoted at most."""
    pattern = ".*".join(map(_words, wanted.split(ANY)))
    found = re.fullmatch(pattern, shown)
    if not found:
        return False
    return all(_near(a, b) for a, b in zip(NUMBER.findall(wanted), found.groups()))


def _words(text: str) -> str:
    return r"([-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?)".join(map(re.escape, NUMBER.split(text)))


def _near(wanted: str, shown: str) -> bool:
    mantissa, _, exponent = wanted.partition("e")
    decimals = len(mantissa.partition(".")[2])
    if "." not in mantissa and not exponent:
        return wanted == shown  # a count
    return abs(float(wanted) - float(shown)) <= 1.001 * 10.0 ** (int(exponent or 0) - decimals)


def pages(guide: Path) -> Iterator[Path]:
    """Pages that were written by hand."""
    yield from sorted(guide.rglob("*.md"))
