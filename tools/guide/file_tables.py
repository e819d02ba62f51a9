"""Tables of the files of the project: columns of recordings, signals of protocols, results."""

import inspect
from typing import Any

import kr5.cell
from kr5.files import result_models
from kr5.logs import map_file

import key_tables
from guide_markdown import code, escape, table
from kr5_tools.command_table import result_titles
from kr5_tools.simulation import protocol_file

JOINTS = 2  # of the arm in tables of columns: enough to see how they are numbered


def columns_tables() -> str:
    """Columns of every kind of experiment."""
    parts = []
    for kind in kr5.cell.Kind.__members__.values():
        rows = [
            (code(c.name), str(c.role), c.unit, code(c.noise) if c.noise else "", c.group, escape(c.label or ""))
            for c in kr5.cell.columns(kind, JOINTS)
        ]
        heads = ("column", "role", "unit", "noise", "group", "meaning")
        parts.append(f"### Kind `{kind}`\n\n{table(heads, rows)}")
    return "\n\n".join(parts)


def signals_tables() -> str:
    """Parameters of every signal of a protocol."""
    parts = []
    for kind, signals in protocol_file.KINDS.items():
        for name, signal in signals.items():
            several = f", signal `{name}`" if len(signals) > 1 else ""
            rows = []
            for parameter in list(inspect.signature(signal).parameters.values())[1:]:
                default = parameter.default
                shown = (
                    "**required**" if default is inspect.Parameter.empty else key_tables.default_text(_plain(default))
                )
                value = key_tables.annotation_text(parameter.annotation, {})
                rows.append((code(parameter.name), value, _unit(parameter.annotation), shown))
            doc = escape(inspect.cleandoc(signal.__doc__ or "").replace("\n", " "))
            heads = ("key", "value", "unit", "without it")
            parts.append(f"### Kind `{kind}`{several}\n\n{doc}\n\n{table(heads, rows)}")
    return "\n\n".join(parts)


def _plain(default: Any) -> Any:
    return list(default) if isinstance(default, tuple) else default


def _unit(annotation: Any) -> str:
    found = (getattr(m, "description", None) for m in getattr(annotation, "__metadata__", ()))
    return next((escape(d) for d in found if d), "")


def map_example() -> str:
    """The example that the command shows, and its legend."""
    return f"```yaml\n{map_file.EXAMPLE}```"


def formats_table() -> str:
    """Every format of a result, and of the other files."""
    rows = [(code(name), escape(title)) for name, title in result_titles().items()]
    return table(("format", "holds"), rows)


def results_tables() -> str:
    """Keys of every result that has keys of its own."""
    parts, done = [], set()
    for name, title in result_titles().items():
        model = result_models.model_of(name)
        if model is result_models.ResultFile or model in done:
            continue
        done.add(model)
        dotted = f"{model.__module__}.{model.__qualname__}"
        parts.append(key_tables.model_tables(dotted, f"{title}: `{name}`"))
    return "\n\n".join(parts)
