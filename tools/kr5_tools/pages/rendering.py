"""What all pages share: the template engine, embedded plots, JSON inside a script."""

import io
import json
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from kr5_tools.cli.numbers import format_number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

UNITS = {"px", "mm", "deg", "m", "rad", "s", "ms"}


class ShownPlot(Protocol):
    """A figure with its name (of the PNG file), its title, and what it shows, in words."""

    name: str
    title: str
    text: str
    figure: "Figure"
    wide: bool


def field_phrase(name: object) -> str:
    """A name from the file as words: `rms_px` is rms [px]."""
    *words, last = str(name).split("_")
    return " ".join([*words, f"[{last}]" if words and last in UNITS else last])


def with_code(text: str) -> Any:
    """What stands between backticks becomes code; all else is escaped."""
    from markupsafe import Markup, escape

    return Markup("").join(
        Markup("<code>{}</code>").format(part) if k % 2 else escape(part) for k, part in enumerate(text.split("`"))
    )


def render_page(template: str, **values: object) -> str:
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
    env.filters["themed"] = with_theme
    env.filters["words"] = word_columns
    env.globals["vendored"] = read_vendored
    return env.get_template(template).render(**values)


def embed_plot(plot: ShownPlot) -> dict[str, Any]:
    """A plot with its figure as SVG, a part of the page, so that its colours follow the page's theme."""
    from kr5.files import writing
    from markupsafe import Markup, escape

    buffer = io.StringIO()
    writing.make_printable(plot.figure)
    plot.figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None}, transparent=True, dpi=120)
    text = themed_svg(buffer.getvalue())
    label = escape(f"{plot.title}. {plot.text}")
    return {
        "name": plot.name,
        "title": plot.title,
        "text": plot.text,
        "wide": plot.wide,
        "svg": Markup(text.replace("<svg ", f'<svg class="plot" role="img" aria-label="{label}" ', 1)),
    }


def word_columns(table: dict[str, Any]) -> list[int]:
    """The columns of a table that hold no number, which stand to the left."""
    columns = list(zip(*table["rows"]))
    starts = [[str(cell).lstrip("-+−± ")[:1] for cell in cells] for cells in columns]
    return [k for k, cells in enumerate(starts) if not any(start == "." or start.isdecimal() for start in cells)]


def read_vendored(name: str) -> Any:
    """A file of another project that pages hold, as it is."""
    from markupsafe import Markup

    return Markup((Path(__file__).parent / "vendor" / name).read_text(encoding="utf-8"))


def theme_variable(colour: str) -> str:
    """The variable of report.css that holds a colour for both themes, `--plot-ink`; other colours as they are."""
    from kr5_tools.pages.plot_style import THEMED

    names = {themed.lower(): f"--{name}" for themed, name in THEMED.items()}
    return names.get(colour.lower(), colour)


def with_theme(colour: str) -> str:
    """A colour for a rule of CSS, by its variable where it has one."""
    name = theme_variable(colour)
    return f"var({name})" if name.startswith("--") else name


def themed_svg(text: str) -> str:
    """An SVG of matplotlib as an element of a page: without prolog, metadata, names of its groups, and rules for what
    is outside of it; themed colours by the name of their variable."""

    def variable(match: re.Match[str]) -> str:
        return match[1] + with_theme(match[2])

    text = text[text.index("<svg ") :].replace("*{stroke-linejoin", ".plot *{stroke-linejoin", 1)
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r'<g id="[^"]*"', "<g", text)
    return re.sub(r"((?:fill|stroke|stop-color): ?)(#[0-9a-fA-F]{6})", variable, text)


def write_png(plots: Sequence[ShownPlot], folder: Path) -> list[Path]:
    """Each plot as a PNG file."""
    from kr5.files import writing

    writing.make_folder(folder)
    files = [folder / f"{plot.name}.png" for plot in plots]
    for plot, file in zip(plots, files):
        writing.save_figure(plot.figure, file, dpi=150, metadata={"Software": None})
    return files


def write_drawn(draw: Callable[[], Sequence[ShownPlot]], folder: Path) -> list[Path]:
    """Draws plots in the style of the pages, and writes each as a PNG file."""
    from kr5_tools.pages.plot_style import STYLE, plt

    with plt.rc_context(STYLE):
        drawn = draw()
        files = write_png(drawn, folder)
        for plot in drawn:
            plt.close(plot.figure)
    return files


def script_json(value: object) -> str:
    """JSON that may stand inside a script element."""
    return json.dumps(value, allow_nan=False, ensure_ascii=False).replace("<", "\\u003c")
