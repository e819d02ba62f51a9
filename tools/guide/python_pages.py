"""A page for each module of the Python package: every class and function, from the stubs that type checkers read.

Griffe reads stubs and docstrings. The pages are written here and not by mkdocstrings, because nearly all classes are
lists of fields: as a table they are read at a glance, and a page has a tenth of the size.
"""

import importlib
import inspect
import re
from pathlib import Path
from typing import Any

import griffe
import kr5

from guide_markdown import code, escape, table
from key_tables import default_text

MODULES = (
    "arm_log",
    "calibration",
    "cell",
    "files",
    "fit",
    "force",
    "gap",
    "identification",
    "io",
    "job",
    "kinematics",
    "logs",
    "models",
    "physics",
    "picking",
    "predict",
    "robot",
    "rsi",
    "sim",
    "tables",
    "uncertainty",
    "vision",
    "work",
)
STANDARD = {"fields", "from_dict", "to_dict"}  # of every class that is a list of fields
SHORTER = (
    (r"kr5\._kr5(_\w+)?\.", "kr5."),
    (r'typing\.Annotated\[numpy\.typing\.(?:ArrayLike|NDArray\[[\w.]+\]), [\w.]+, "\[([^"]*)\]"\]', r"array[\1]"),
    (r"typing\.Annotated\[numpy\.typing\.ArrayLike, [\w.]+\]", "array"),
    (r"numpy\.typing\.ArrayLike", "array"),
    (r"numpy\.typing\.NDArray\[([\w.]+)\]", r"array of \1"),
    (r"numpy\.ndarray", "array"),
    (r"typing\.Supports(Float|Int) \| typing\.SupportsIndex", lambda m: m[1].lower()),
    (r"collections\.abc\.|typing\.|pathlib\.", ""),
)


def python_pages() -> dict[str, str]:
    """Pages by their place in the guide."""
    package = griffe.load(
        "kr5", search_paths=[Path(kr5.__file__).parents[1]], docstring_parser="numpy", allow_inspection=False
    )
    pages = {"python-api/kr5.md": _page("kr5", package["_kr5"], kr5, ("_errors", "_points", "_share", "_pose_figures"))}
    for name in MODULES:
        pages[f"python-api/kr5.{name}.md"] = _page(f"kr5.{name}", package[name], importlib.import_module(f"kr5.{name}"))
    rows = [
        (f"[`{Path(place).stem}`]({Path(place).name})", escape(text.split("\n")[2])) for place, text in pages.items()
    ]
    index = (
        "# Python reference\n\nEvery class and function. How they are used: [Python](../python.md). A class that is a"
        " list of fields takes them as keyword arguments, and has `to_dict()`, `from_dict(dict)` and `fields()`; where"
        " it is a set of options, `validate()` raises `kr5.InvalidArgument` naming the field. An enumeration is"
        " accepted by its name in lower case, too.\n\n" + table(("module", "holds"), rows)
    )
    return {"python-api/index.md": index, **pages}


def _page(name: str, module: Any, found: Any, further: Any = ()) -> str:
    """Page of a module; of the top, also what its Python files define."""
    members = dict(module.members)
    for part in further:
        members |= {k: v for k, v in module.parent[part].members.items() if k in vars(found)}
    functions, classes = [], []
    for word, member in members.items():
        if word.startswith("_") or (member.is_alias and not member.target_path.startswith("kr5.")):
            continue
        target = member.final_target if member.is_alias else member
        if target.is_function:
            functions.append((word, _function(word, target, name, "###")))
        elif target.is_class:
            classes.append((word, _class(word, target, getattr(found, word, None), name)))
    first = inspect.cleandoc(found.__doc__ or "")
    listed = [f"[`{word}`](#{_anchor(name, word)})" for word, _ in sorted(functions) + sorted(classes)]
    parts = [f"# {name}", escape(first.replace("\n", " ")), " · ".join(listed)]
    if functions:
        parts += ["## Functions", *(text for _, text in functions)]
    if classes:
        parts += ["## Classes", *(text for _, text in classes)]
    return "\n\n".join(parts)


def _anchor(module: str, name: str) -> str:
    return f"{module}.{name}".replace(".", "-")


def _shorter(text: object) -> str:
    out = str(text)
    for pattern, by in SHORTER:
        out = re.sub(pattern, by, out)  # type: ignore[call-overload]
    return out


def _overloads(function: Any) -> list[Any]:
    return list(function.overloads or [function])


def _function(name: str, function: Any, module: str, level: str) -> str:
    signatures = "\n".join(f"{name}{_signature(f)}" for f in _overloads(function))
    doc = next((f.docstring for f in [function, *_overloads(function)] if f.docstring), None)
    heading = f"{level} `{name}`" + (f" {{ #{_anchor(module, name)} }}" if level == "###" else "")
    return f"{heading}\n\n```python\n{signatures}\n```\n\n{_docstring(doc)}"


def _signature(function: Any) -> str:
    words, keyword_only = [], False
    for p in function.parameters:
        if p.name == "self":
            continue
        if p.kind is griffe.ParameterKind.keyword_only and not keyword_only:
            keyword_only = True
            words.append("*")
        if p.kind is griffe.ParameterKind.positional_only and p.name.startswith("arg"):
            words.append(_shorter(p.annotation))
            continue
        star = {griffe.ParameterKind.var_positional: "*", griffe.ParameterKind.var_keyword: "**"}.get(p.kind, "")
        kind = f": {_shorter(p.annotation)}" if p.annotation else ""
        words.append(f"{star}{p.name}{kind}" + (f" = {p.default}" if p.default is not None else ""))
    gives = f" -> {_shorter(function.returns)}" if function.returns else ""
    line = f"({', '.join(words)}){gives}"
    return line if len(line) < 90 else "(\n    " + ",\n    ".join(words) + f",\n){gives}"


def _docstring(doc: Any) -> str:
    """A docstring of numpy's style as text and lists."""
    if doc is None:
        return ""
    parts = []
    for section in doc.parsed:
        kind = section.kind.value
        if kind == "text":
            parts.append(escape(section.value.split("\nFields\n")[0]))
        elif kind in ("parameters", "attributes"):
            parts.append("\n".join(_item(f"`{p.name}`", p) for p in section.value))
        elif kind in ("returns", "yields"):
            parts.append("\n".join(_item("Returns", p) for p in section.value))
        elif kind == "raises":
            parts.append(
                "\n".join(f"- Raises `{_shorter(p.annotation)}`: {_said(p.description)}" for p in section.value)
            )
        elif kind == "admonition":
            parts.append(escape(section.value.contents))
        elif kind == "examples":
            parts.append(
                "\n\n".join(f"```python\n{t}\n```" if k.value == "examples" else escape(t) for k, t in section.value)
            )
    return "\n\n".join(p for p in parts if p)


def _item(what: str, entry: Any) -> str:
    kind = f" ({code(_shorter(entry.annotation))})" if entry.annotation else ""
    said = _said(entry.description)
    return f"- {what}{kind}" + (f": {said}" if said else "")


def _said(text: str) -> str:
    return escape(" ".join((text or "").split()))


def _class(name: str, cls: Any, found: Any, module: str) -> str:
    parts = [f"### `class {name}` {{ #{_anchor(module, name)} }}", _docstring(cls.docstring)]
    values = getattr(found, "__members__", None)
    if values:
        parts.append("Values: " + ", ".join(code(v) for v in values) + ".")
        return "\n\n".join(parts)
    fields = {f["name"]: f for f in found.fields()} if hasattr(found, "fields") else {}
    rows = [
        (code(f["name"]), code(_shorter(f["type"])), default_text(f["default"]), escape(f["doc"]))
        for f in fields.values()
    ]
    for word, member in cls.members.items():
        if word not in fields and member.is_attribute and not word.startswith("_"):
            rows.append(
                (
                    code(word),
                    code(_shorter(member.annotation)),
                    "",
                    _said(member.docstring.value if member.docstring else ""),
                )
            )
    if rows:
        parts.append(table(("field", "type", "default", "meaning"), rows))
    for word, member in cls.members.items():
        shown = not word.startswith("_") or (word == "__init__" and not fields)
        if member.is_function and shown and not (fields and word in STANDARD | {"validate"}):
            text = _function(name if word == "__init__" else word, member, module, "####")
            parts.append(text)
    return "\n\n".join(parts)
