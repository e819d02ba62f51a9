"""What MkDocs calls when it builds the guide: pages and tables made from the code, so that nothing is written twice.

A line `<!-- make: NAME ARGUMENTS -->` of a page becomes what the function of that name in MAKERS returns.
"""

import hashlib
import importlib
import os
import re
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File

import command_pages
import cpp_pages
import effect_pages
import file_tables
import key_tables
import python_pages

ROOT = Path(__file__).resolve().parents[2]
PICTURES = ROOT / "build/guide/pictures"
VENDOR = Path(__file__).parent / "vendor/iframe-worker"
DRAFT = "KR5_GUIDE_DRAFT"  # set: without pictures, which take a while to draw
MAKE = re.compile(r"^<!-- make: (.+) -->$", re.MULTILINE)
NOT_RUN = re.compile(r"^<!-- not run: (.+) -->\n", re.MULTILINE)

MAKERS: dict[str, Callable[..., str]] = {
    "struct": lambda name, title, *skip: key_tables.struct_tables(name, title, skip),
    "model": lambda name, title: key_tables.model_tables(name, title),
    "map_example": file_tables.map_example,
    "columns": file_tables.columns_tables,
    "signals": file_tables.signals_tables,
    "formats": file_tables.formats_table,
    "results": file_tables.results_tables,
}
# Places of the checkout to which pages link, so that the links lead somewhere there, and the made page of each.
PLACES = {
    "CONVENTIONS.md": "conventions.md",
    "libkr5/include/kr5": "cpp-api/index.md",
    "libkr5/include/kr5/force": "cpp-api/force.md",
    "libkr5/include/kr5/rsi": "cpp-api/rsi.md",
    "libkr5/src/cell/effect_rows": "effects.md",
}
PLACE = re.compile(rf"\]\((?:\.\./)+({'|'.join(map(re.escape, PLACES))})(#[^)]*)?\)")
MADE: dict[str, str] = {}  # text of each page that is made, by its place


def on_config(config: Any) -> Any:
    """Makes the pages, and puts them into the navigation below the index of their folder."""
    MADE.update(
        {
            "effects.md": effect_pages.effects_page(_pictures()),
            "conventions.md": _from_root("CONVENTIONS.md"),
            "changelog.md": _from_root("CHANGELOG.md"),
            **command_pages.command_pages(),
            **cpp_pages.cpp_pages(ROOT),
            **python_pages.python_pages(),
        }
    )
    for part in config.nav:
        for entry in next(iter(part.values())):
            inner = next(iter(entry.values())) if isinstance(entry, dict) else None
            if isinstance(inner, list):
                folder = inner[0].partition("/")[0]
                inner += [place for place in MADE if place.startswith(f"{folder}/") and place not in inner]
    return config


def _pictures() -> Path | None:
    """The folder of the pictures of the effects, drawn where they are not; none in a draft."""
    if os.environ.get(DRAFT):
        return None
    effect_pages.draw_pictures(PICTURES, _digest())
    return PICTURES


def on_files(files: Any, config: Any) -> Any:
    """Adds the pages that are made, and their pictures."""
    for place, text in MADE.items():
        files.append(File.generated(config, place, content=text))
    worker = "/*" + (VENDOR / "LICENSE").read_text() + "*/\n" + (VENDOR / "shim.js").read_text()
    files.append(File.generated(config, "assets/iframe-worker.js", content=worker))
    if not os.environ.get(DRAFT):
        for file in sorted(PICTURES.glob("*.png")):
            files.append(File.generated(config, f"pictures/{file.name}", abs_src_path=str(file)))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Fills in the tables, leads links to places of the checkout to the pages made of them, and says beside a block of
    commands why the tests do not run it."""
    up = "../" * page.file.src_uri.count("/")
    markdown = PLACE.sub(lambda m: f"]({up}{PLACES[m[1]]}{m[2] or ''})", markdown)
    markdown = MAKE.sub(lambda m: _made(m[1]), markdown)
    return NOT_RUN.sub(lambda m: f'<p class="not-run" markdown>Not run by the tests: {m[1]}.</p>\n\n', markdown)


def _made(words: str) -> str:
    name, *arguments = shlex.split(words)
    return MAKERS[name](*arguments)


def _digest() -> str:
    """Of what the pictures are drawn from: the extension and the command."""
    digest = hashlib.sha256()
    for module in ("kr5._kr5", "kr5_tools.gap.effect_pictures"):
        digest.update(Path(importlib.import_module(module).__file__ or "").read_bytes())
    return digest.hexdigest()


def _from_root(name: str) -> str:
    """A page that stands at the top of the checkout; its links start there."""
    text = (ROOT / name).read_text(encoding="utf-8")
    text = text.replace("](CONVENTIONS.md", "](conventions.md").replace("](share/doc/", "](")
    return re.sub(r"\[([^\]]+)\]\((CONTRIBUTING|README|LICENSE)(\.md)?\)", r"`\2\3`", text)
