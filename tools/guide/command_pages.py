"""A page for each command with its options, made from the command itself."""

from typing import Any

import typer
import typer.main
from rich.text import Text

from guide_markdown import cell_text, code, escape, table
from kr5_tools.app import make_app


def command_pages() -> dict[str, str]:
    """Pages by their place in the guide."""
    top = typer.main.get_command(make_app())
    pages, rows = {}, []
    for name, command in top.commands.items():  # type: ignore[attr-defined]
        leaves = list(_leaves(command, f"kr5 {name}"))
        for path, leaf in leaves:
            rows.append((f"[`{path}`]({name}.md#{_anchor(path)})", escape(_sentence(leaf))))
        body = "\n\n".join(_section(path, leaf) for path, leaf in leaves)
        pages[f"commands/{name}.md"] = f"# kr5 {name}\n\n{escape(_plain(command.help or ''))}\n\n{body}"
    index = (
        "# Commands\n\nEvery command, made from its `--help`. Options are in SI units unless their help shows another"
        " one in brackets. Exit codes: 0 done; 1 done, but the result is unusable or not what was claimed; 2 bad input,"
        " with one line on standard error and no file written; 130 stopped by Ctrl-C.\n\n"
        + table(("command", "does"), rows)
    )
    return {"commands/index.md": index, **pages}


def _leaves(command: Any, path: str) -> Any:
    inner = getattr(command, "commands", None)
    if not inner:
        yield path, command
        return
    for name, child in inner.items():
        yield from _leaves(child, f"{path} {name}")


def _anchor(path: str) -> str:
    return path.replace(" ", "-")


def _plain(markup: str) -> str:
    """Text of a help with the markup of rich taken away, in paragraphs."""
    text = Text.from_markup(markup).plain
    return "\n\n".join(" ".join(part.split()) for part in text.split("\n\n"))


def _sentence(command: Any) -> str:
    return _plain(command.help or "").split("\n\n")[0]


def _section(path: str, command: Any) -> str:
    parts = [f"## `{path}` {{ #{_anchor(path)} }}", escape(_plain(command.help or ""))]
    arguments, options = [], []
    for parameter in command.params:
        if parameter.name == "help" or getattr(parameter, "hidden", False):
            continue
        text = escape(_plain(getattr(parameter, "help", None) or ""))
        if parameter.param_type_name == "argument":
            arguments.append((code(parameter.display_name_raw), text))
        else:
            flags = "/".join([*parameter.opts, *parameter.secondary_opts])
            metavar = (
                ""
                if parameter.is_flag
                else parameter.metavar or parameter.display_type(typer.Context(command)).strip("<>")
            )
            default = _default(parameter)
            options.append((code(flags), cell_text(metavar), text + (f" Default: {code(default)}." if default else "")))
    if arguments:
        parts.append(table(("argument", "meaning"), arguments))
    if options:
        parts.append(table(("option", "value", "meaning"), options))
    if command.epilog:
        parts.append("```sh\n" + _examples(command.epilog) + "\n```")
    return "\n\n".join(parts)


def _default(parameter: Any) -> str:
    value = parameter.default
    if parameter.required or value is None or callable(value) or value == [] or value is False:
        return ""
    return " ".join(map(str, value)) if isinstance(value, (list, tuple)) else str(value)


def _examples(epilog: str) -> str:
    text = " ".join(_plain(epilog).split())
    text = text.removeprefix("Examples:").removeprefix("Example:").strip()
    return "\n".join(part.strip() for part in text.split("; "))
