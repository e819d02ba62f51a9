"""What all pages share: the template engine, embedded plots, JSON inside a script."""

import base64
import io
import json
from pathlib import Path
from typing import Any

from kr5_tools.cli import terminal
from kr5_tools.cli.numbers import format_number
from kr5_tools.files import writing

UNITS = {"px", "mm", "deg", "m", "rad", "s", "ms"}


def field_phrase(name: Any) -> str:
    """A name from the file as words: `rms_px` is rms [px]."""
    *words, last = str(name).split("_")
    return " ".join([*words, f"[{last}]" if words and last in UNITS else last])


def with_code(text: str) -> Any:
    """What stands between backticks becomes code; all else is escaped."""
    from markupsafe import Markup, escape

    return Markup("").join(
        Markup("<code>{}</code>").format(part) if k % 2 else escape(part) for k, part in enumerate(text.split("`"))
    )


def render_page(template: str, **values: Any) -> str:
    """The HTML of a page, from a template that extends base.html; it needs `title`, `brand` and `source`."""
    import jinja2

    env = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    env.filters["number"] = format_number
    env.filters["phrase"] = field_phrase
    env.filters["code"] = with_code
    return env.get_template(template).render(**values)


def embed_plot(plot: Any) -> dict[str, Any]:
    """A plot with its figure as an SVG inside the page."""
    buffer = io.BytesIO()
    plot.figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None}, transparent=True, dpi=120)
    return {
        "name": plot.name,
        "title": plot.title,
        "text": plot.text,
        "wide": plot.wide,
        "src": "data:image/svg+xml;base64," + base64.b64encode(buffer.getvalue()).decode(),
    }


def write_png(plots: list[Any], folder: Path) -> list[Path]:
    """Each plot as a PNG file."""
    try:
        writing.make_folder(folder)
        files = [folder / f"{plot.name}.png" for plot in plots]
        for plot, file in zip(plots, files):
            writing.save_figure(plot.figure, file, dpi=150, metadata={"Software": None})
    except OSError as error:
        terminal.fail(f"{folder}: the plots cannot be written: {error.strerror}")
    return files


def script_json(value: Any) -> str:
    """JSON that may stand inside a script element."""
    return json.dumps(value, allow_nan=False, ensure_ascii=False).replace("<", "\\u003c")
