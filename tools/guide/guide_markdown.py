"""Markdown of the generated pages."""

import re
from collections.abc import Iterable, Sequence


def cell_text(text: object) -> str:
    """A text in a cell of a table."""
    return re.sub(r"\s+", " ", str(text)).strip().replace("|", "\\|")


def escape(text: object) -> str:
    """A text without meaning for Markdown; what stands between backticks stays code."""
    parts = re.split(r"(`[^`]*`)", str(text))
    return "".join(p if p.startswith("`") else re.sub(r"([\\*_<>\[\]])", r"\\\1", p) for p in parts)


def code(text: object) -> str:
    return f"`{cell_text(text)}`"


def table(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table; columns without any text are left out."""
    cells = [[cell_text(c) for c in row] for row in rows]
    kept = [k for k in range(len(heads)) if any(row[k] for row in cells)]
    lines = [[heads[k] for k in kept], ["---"] * len(kept), *([row[k] for k in kept] for row in cells)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def anchor(heading: str) -> str:
    """The anchor that the guide gives to a heading (as the extension `toc` of Python-Markdown does)."""
    from markdown.extensions.toc import slugify

    return str(slugify(re.sub(r"[`*\\]", "", heading), "-"))
