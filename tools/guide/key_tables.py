"""Tables of the keys of a file, made from what reads it: field lists of the library, pydantic models of the command."""

import importlib
import inspect
import types
import typing
from collections.abc import Sequence
from typing import Any, Literal

from guide_markdown import anchor, cell_text, code, escape, table

HEADS = ("key", "value", "without it", "meaning")
NONE = "–"
POSE = "pose: 4 × 4 matrix or `x y z roll pitch yaw`"
WORDS = {"float": "number", "int": "integer", "str": "text", "bool": "`true` or `false`"}


def find(name: str) -> Any:
    """What a dotted name names, such as `kr5.cell.Cell`."""
    parts = name.split(".")
    for k in range(len(parts), 0, -1):
        try:
            found = importlib.import_module(".".join(parts[:k]))
        except ModuleNotFoundError:
            continue
        for part in parts[k:]:
            found = getattr(found, part)
        return found
    raise LookupError(f"there is no {name}")


class StructTables:
    """Tables of a struct of the library and of the structs in it."""

    def __init__(self, title: str, level: int = 3):
        self.title, self.level = title, level
        self.parts: list[str] = []
        self.headings: dict[str, str] = {}  # of each struct

    def add(self, struct: Any, path: str = "", skip: tuple[str, ...] = ()) -> None:
        heading = f"`{path}`" if path else self.title
        self.headings.setdefault(_full_name(struct), heading)
        rows, inner = [], []
        for field in struct.fields():
            if field["name"] in skip:
                continue
            key = field.get("key", field["name"])
            value, nested = self._value(field, f"{path}.{key}" if path else key)
            if nested:
                inner.append(nested)
            without = "**required**" if field.get("required") else default_text(field["default"])
            rows.append((code(key), value, without, escape(field["doc"])))
        self.parts.append(f"{'#' * self.level} {heading}\n\n{_first_line(struct)}\n\n{table(HEADS, rows)}")
        for child, name in inner:
            self.add(child, name)

    def _value(self, field: dict[str, Any], path: str) -> tuple[str, tuple[Any, str] | None]:
        """The kind of value in words, and the struct in it with its path."""
        kind = field["type"].removesuffix(" | None")
        listed = kind.startswith("list[")
        item = kind[5:-1] if listed else kind
        if field["choices"]:
            return " or ".join(code(c) for c in field["choices"]), None
        if item in WORDS:
            return (f"list of {WORDS[item].replace('`', '')}s" if listed else WORDS[item]), None
        if item.endswith("Effects"):
            return "map, see [effects](../effects.md)", None
        if item == "numpy.ndarray":
            default = field["default"]
            pose = field["name"].startswith("T_") or (isinstance(default, list) and len(default) == 4)
            numbers = f"{len(default)} numbers" if isinstance(default, list) and default else "list of numbers"
            return (POSE if pose else numbers), None
        if item.startswith("kr5."):
            struct = find(item)
            if not hasattr(struct, "fields"):
                return f"list of {struct.__name__}", None
            name = path + ("[ ]" if listed else "")
            new = _full_name(struct) not in self.headings
            shown = self.headings.setdefault(_full_name(struct), f"`{name}`")
            text = f"{'list of maps' if listed else 'map'}, see [{shown}](#{anchor(shown)})"
            return text, ((struct, name) if new else None)
        return cell_text(item), None


def _full_name(struct: Any) -> str:
    return f"{struct.__module__}.{struct.__qualname__}"


def _first_line(struct: Any) -> str:
    return escape(inspect.cleandoc(struct.__doc__ or "").split("\n\n")[0].split("\nFields")[0])


def default_text(default: Any) -> str:
    if default is None or default == "" or default == []:
        return NONE
    if isinstance(default, dict):
        return "its defaults"
    if isinstance(default, list):
        if isinstance(default[0], list):
            return "identity"
        return code(" ".join(f"{v:g}" if isinstance(v, (int, float)) else str(v) for v in default))
    if isinstance(default, bool):
        return code(str(default).lower())
    return code(f"{default:g}" if isinstance(default, float) else default)


def struct_tables(name: str, title: str, skip: tuple[str, ...] = (), level: int = 3) -> str:
    """Tables of a struct of the library by its dotted name."""
    tables = StructTables(title, level)
    tables.add(find(name), skip=skip)
    return "\n\n".join(tables.parts)


def model_tables(name: str, title: str, level: int = 3) -> str:
    """Tables of a pydantic model of the command and of the models in it."""
    parts: list[str] = []
    headings = {_full_name(find(name)): title}
    waiting = [find(name)]
    while waiting:
        model = waiting.pop(0)
        rows = []
        for field_name, field in model.model_fields.items():
            key = field.alias or field_name
            for child in _models_in(field.annotation):
                if _full_name(child) not in headings:
                    headings[_full_name(child)] = f"`{key}`"
                    waiting.append(child)
            without = "**required**" if field.is_required() else default_text(_plain(field.default))
            rows.append(
                (code(key), annotation_text(field.annotation, headings), without, escape(field.description or ""))
            )
        parts.append(
            f"{'#' * level} {headings[_full_name(model)]}\n\n{escape(_own_doc(model))}\n\n{table(HEADS, rows)}"
        )
    return "\n\n".join(parts)


def _own_doc(model: Any) -> str:
    own = model.__dict__.get("__doc__")
    return inspect.cleandoc(own) if own else ""


def _plain(value: Any) -> Any:
    return value.model_dump() if hasattr(value, "model_dump") else value


def _models_in(annotation: Any) -> list[Any]:
    """The models in an annotation."""
    if hasattr(annotation, "model_fields"):
        return [annotation]
    return [m for a in typing.get_args(annotation) for m in _models_in(a)]


def annotation_text(annotation: Any, headings: dict[str, str]) -> str:
    """The kind of value in words; `headings` are those of the models."""
    origin, args = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is typing.Annotated:
        return annotation_text(args[0], headings)
    if origin in (typing.Union, types.UnionType):
        return " or ".join(dict.fromkeys(annotation_text(a, headings) for a in args if a is not type(None)))
    if origin is Literal:
        return " or ".join(code(a) for a in args)
    if origin in (list, tuple, Sequence):
        return f"list of {_plural(annotation_text(args[0], headings))}"
    if origin is dict or annotation is dict:
        return "map"
    if hasattr(annotation, "model_fields"):
        heading = headings[_full_name(annotation)]
        return f"map, see [{heading}](#{anchor(heading)})"
    if annotation is Any:
        return "any"
    return WORDS.get(getattr(annotation, "__name__", ""), cell_text(annotation))


def _plural(text: str) -> str:
    first, comma, rest = text.partition(",")
    return f"{first}s{comma}{rest}" if first.isalpha() else text
