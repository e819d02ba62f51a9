"""What MkDocs calls when it builds the guide: pages and tables that are made from the code, so that nothing is written twice.

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

import command_pages
import cpp_pages
import effect_pages
import file_tables
import key_tables
import kr5
from mkdocs.structure.files import File

ROOT = Path(__file__).resolve().parents[2]
PICTURES = ROOT / "build/guide/pictures"
DRAFT = "KR5_GUIDE_DRAFT"  # set: without pictures, which take a while to draw
MAKE = re.compile(r"^<!-- make: (.+) -->$", re.MULTILINE)
NOT_RUN = re.compile(r"^<!-- not run: (.+) -->\n", re.MULTILINE)

MAKERS: dict[str, Callable[..., str]] = {
    "struct": lambda name, title, *skip: key_tables.struct_tables(name, title, skip),
    "model": lambda name, title: key_tables.model_tables(name, title),
    "columns": file_tables.columns_tables,
    "signals": file_tables.signals_tables,
    "formats": file_tables.formats_table,
    "results": file_tables.results_tables,
}
PYTHON_MODULES = ("kr5",) + tuple(
    f"kr5.{name}"
    for name in (
        "calibration", "cell", "fit", "force", "gap", "identification", "io", "kinematics", "physics", "picking", "predict",
        "sim", "uncertainty", "vision",
    )
)


def on_files(files: Any, config: Any) -> Any:
    """Adds the pages that are made."""
    pictures = None
    if not os.environ.get(DRAFT):
        pictures = PICTURES
        effect_pages.draw_pictures(pictures, _digest())
        for file in sorted(pictures.glob("*.png")):
            files.append(File.generated(config, f"pictures/{file.name}", abs_src_path=str(file)))
    pages = {
        "effects.md": effect_pages.effects_page(pictures),
        "conventions.md": _from_root("CONVENTIONS.md"),
        "changelog.md": _from_root("CHANGELOG.md"),
        **command_pages.command_pages(),
        **cpp_pages.cpp_pages(ROOT),
        **_python_pages(),
    }
    for place, text in pages.items():
        files.append(File.generated(config, place, content=text))
    return files


def on_nav(nav: Any, config: Any, files: Any) -> Any:
    return nav


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Fills in the tables, and says beside a block of commands why the tests do not run it."""
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


def _python_pages() -> dict[str, str]:
    rows, pages = [], {}
    for module in PYTHON_MODULES:
        found = kr5 if module == "kr5" else importlib.import_module(module)
        line = (found.__doc__ or "").strip().split("\n")[0]
        pages[f"python-api/{module}.md"] = f"# {module}\n\n::: {module}\n"
        rows.append(f"| [`{module}`]({module}.md) | {line} |")
    pages["python-api/index.md"] = (
        "# Python reference\n\nEvery class and function with its documentation. How they are used: [Python](../python.md).\n\n"
        "| module | holds |\n| --- | --- |\n" + "\n".join(rows) + "\n"
    )
    return pages
