"""Reader of YAML and JSON documents: bounded, checked against a model, with errors of one line.

Text that is not UTF-8, keys that stand twice, deep nesting and aliases that unfold to huge documents are refused. Of
the first mistake the error says file, line, field, what was found and what was expected."""

import difflib
import json
import os
import re
import stat
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, NoReturn, TypeVar, get_args, get_origin

import yaml
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError
from pydantic_core import ErrorDetails

import kr5

MAX_BYTES = 64 << 20
MAX_DEPTH = 64
MAX_NODES = 1_000_000  # aliases unfolded
MAX_SHOWN = 60  # characters of what was found


class Document(BaseModel):
    """Base of the models: no unknown keys, no conversion between types, no number that is none."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


class OpenDocument(Document):
    """Base of the models of files that may hold more than what is read."""

    model_config = ConfigDict(extra="allow")


Model = TypeVar("Model", bound=Document)


def _is_pose_matrix(rows: list[list[float]]) -> list[list[float]]:
    if [len(row) for row in rows] != [4] * 4:
        raise ValueError("a 4 x 4 matrix")
    return rows


PositiveNumber = Annotated[float, Field(gt=0)]
Pose = Annotated[list[float], Field(min_length=6, max_length=6, description="x y z roll pitch yaw [m, rad]")]
PoseMatrix = Annotated[list[list[float]], AfterValidator(_is_pose_matrix)]


def check_names(names: list[str]) -> None:
    """For validators: refuses a name that stands twice."""
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ValueError(f"found two named {display_value(twice)}, expected a unique name for each")


def check_readable(file: Path | str, expected: str = "") -> None:
    """Raises kr5.FileError for a device, a pipe or a socket, which may have no end; for what is not there, too."""
    wanted = f"; expected {expected}" if expected else ""
    try:
        mode = os.stat(file).st_mode
    except OSError as error:
        raise kr5.FileError(file, f"{error.strerror or error}{wanted}") from error
    except ValueError as error:  # a NUL in the name
        raise kr5.FileError(str(file)[:60], f"{error}{wanted}") from error
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
        device = stat.S_ISCHR(mode) or stat.S_ISBLK(mode)
        raise kr5.FileError(file, f"is a {'device' if device else 'pipe or a socket'}{wanted or '; expected a file'}")


def read_text(file: Path | str, expected: str = "", max_bytes: int = MAX_BYTES) -> str:
    """The text of a UTF-8 file of bounded size. `expected`: what the file should be, for the error."""
    wanted = f"; expected {expected}" if expected else ""
    check_readable(file, expected)
    try:
        with Path(file).open("rb") as stream:
            data = stream.read(max_bytes + 1)
    except OSError as error:
        raise kr5.FileError(file, f"{error.strerror or error}{wanted}") from error
    if len(data) > max_bytes:
        raise kr5.FileError(file, f"is larger than {max_bytes / (1 << 20):g} MiB{wanted}")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise kr5.FileError(
            file, f"is not UTF-8 text (byte {error.start} is 0x{data[error.start]:02x}){wanted}"
        ) from error


def read_yaml(file: Path | str, expected: str = "", max_bytes: int = MAX_BYTES) -> Any:
    """The content of a YAML file (JSON included)."""
    return parse_yaml(read_text(file, expected, max_bytes), file, expected)


def read_json(file: Path | str, expected: str = "", max_bytes: int = MAX_BYTES) -> Any:
    """The content of a JSON file."""
    return parse_json(read_text(file, expected, max_bytes), file, expected)


def read_document(file: Path | str, model: type[Model], expected: str = "") -> Model:
    """The content of a YAML or JSON file as its model says it."""
    text = read_text(file, expected)
    parse = parse_json if str(file).lower().endswith(".json") else parse_yaml
    return validate_document(parse(text, file, expected), model, file, text)


def parse_json(text: str, source: Path | str, expected: str = "") -> Any:
    """The content of a JSON text; `source` names it in errors."""
    wanted = f"; expected {expected}" if expected else ""
    try:
        _check_json_depth(text)
        return json.loads(text, object_pairs_hook=_unique_keys, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise kr5.FileError(source, f"is not valid JSON ({error}){wanted}") from error


def parse_yaml(text: str, source: Path | str, expected: str = "") -> Any:
    """The content of a YAML text; `source` names it in errors."""
    wanted = f"; expected {expected}" if expected else ""
    try:
        _check_yaml_size(text)
        return yaml.load(text, Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else None
        problem = str(error.problem or error.context)
        if "nesting depth" in problem:  # a limit of newer parsers, far above ours
            problem = f"nested deeper than {MAX_DEPTH} levels"
        raise kr5.FileError(source, f"is not valid YAML ({problem}){wanted}", line=line) from error
    # What constructors of single values raise: dates and numbers that are none, tags without a value.
    except (yaml.YAMLError, ValueError, TypeError, AttributeError, LookupError, RecursionError) as error:
        raise kr5.FileError(source, f"is not valid YAML ({' '.join(str(error).split())[:200]}){wanted}") from error


def validate_document(
    data: object, model: type[Model], source: Path | str, text: str = "", at: tuple[int | str, ...] = ()
) -> Model:
    """The document as its model. `text`, where it is known, gives the line of a mistake; `at` is where in it the data
    stand."""
    try:
        return model.model_validate(data)
    except ValidationError as error:
        errors = error.errors(include_url=False)
        path = _path_in(data, errors[0]["loc"])
        field, problem = _explain([e for e in errors if _path_in(data, e["loc"]) == path], path, model)
        fail_at(source, [*at, *field], problem, text, line_of=[*at, *path])


def fail_at(
    source: Path | str,
    path: Sequence[int | str],
    problem: str,
    text: str = "",
    line_of: Sequence[int | str] | None = None,
) -> NoReturn:
    """Raises the error of one field of a document, on the line of that field or of another."""
    line = _line_of(text, line_of or path)
    raise kr5.FileError(source, problem, line=line, field=name_of_field(path))


class _Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """YAML whose keys stand once, and whose numbers are those of YAML 1.2 (1e-3 is one)."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode) and key.tag != "tag:yaml.org,2002:merge":
                if key.value in seen:
                    raise yaml.constructor.ConstructorError(
                        None, None, f"the key '{key.value}' occurs twice", key.start_mark
                    )
                seen.add(key.value)
        return super().construct_mapping(node, deep)  # type: ignore[no-any-return]


# OpenCV's matrices are read as what they hold.
_Loader.add_constructor(
    "tag:yaml.org,2002:opencv-matrix", lambda loader, node: loader.construct_mapping(node, deep=True)
)
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"^[-+]?(\d+(\.\d*)?|\.\d+)[eE][-+]?\d+$"), list("-+.0123456789")
)


def _problem(event: yaml.Event, text: str) -> yaml.MarkedYAMLError:
    error = yaml.MarkedYAMLError(problem=text)
    error.problem_mark = event.start_mark  # type: ignore[assignment]  # that of libyaml has the same members
    return error


def _check_yaml_size(text: str) -> None:
    """Bounds nesting and, with every alias unfolded, the number of nodes."""
    nodes = 0
    sizes: dict[str, int] = {}
    open_nodes: list[tuple[str | None, int]] = []
    for event in yaml.parse(text, Loader=_Loader):
        if isinstance(event, yaml.AliasEvent):
            if event.anchor not in sizes:
                raise _problem(event, f"the alias '{event.anchor}' refers to itself")
            nodes += sizes[event.anchor]
        elif isinstance(event, yaml.NodeEvent):
            nodes += 1
            if isinstance(event, yaml.CollectionStartEvent):
                open_nodes.append((event.anchor, nodes))
            elif event.anchor:
                sizes[event.anchor] = 1
        elif isinstance(event, yaml.CollectionEndEvent):
            anchor, begin = open_nodes.pop()
            if anchor:
                sizes[anchor] = nodes - begin + 1
        if len(open_nodes) > MAX_DEPTH:
            raise _problem(event, f"nested deeper than {MAX_DEPTH} levels")
        if nodes > MAX_NODES:
            raise _problem(event, f"more than {MAX_NODES} values, aliases unfolded")


def _check_json_depth(text: str) -> None:
    depth = 0
    for found in re.finditer(r'"(?:[^"\\]|\\.)*+"|[\[\]{}]', text, re.DOTALL):
        mark = found[0]
        if mark in "[{":
            depth += 1
            if depth > MAX_DEPTH:
                raise ValueError(f"nested deeper than {MAX_DEPTH} levels")
        elif mark in "]}":
            depth -= 1


def _unique_keys(pairs: list[tuple[str, object]]) -> dict[str, Any]:
    out = dict(pairs)
    if len(out) < len(pairs):
        names = [name for name, _ in pairs]
        raise ValueError(f"the key '{next(n for n in names if names.count(n) > 1)}' occurs twice")
    return out


def _refuse_constant(name: str) -> float:
    raise ValueError(f"{name} is not a number")


def _path_in(document: object, location: tuple[int | str, ...]) -> list[int | str]:
    """The location of a mistake without what names a branch of the model and not a place in the data."""
    path: list[int | str] = []
    here = document
    for k, step in enumerate(location):
        if isinstance(here, (dict, list)):
            inside = dict(enumerate(here)) if isinstance(here, list) else here
            if step in inside:
                here = inside[step]
            elif k < len(location) - 1 or isinstance(here, list):
                continue
        else:
            continue
        path.append(step)
    return path


def name_of_field(path: Sequence[int | str]) -> str:
    """A place in a document in words: experiments[2].columns.q."""
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in path).removeprefix(".")


def _line_of(text: str, path: Sequence[int | str]) -> int | None:
    """The line on which a field stands, or the map it is missing from."""
    if not text or len(text) > 1 << 20:
        return None
    try:
        node = yaml.compose(text, Loader=_Loader)
    except yaml.YAMLError:  # JSON that is no YAML
        return None
    line = None
    for step in path:
        if isinstance(node, yaml.MappingNode):
            pair = next(
                ((k, v) for k, v in node.value if isinstance(k, yaml.ScalarNode) and k.value == str(step)), None
            )
            if pair is None:
                break
            line, node = pair[0].start_mark.line + 1, pair[1]
        elif isinstance(node, yaml.SequenceNode) and isinstance(step, int) and step < len(node.value):
            node = node.value[step]
            line = node.start_mark.line + 1
    return line or (node.start_mark.line + 1 if node is not None else None)


EXPECTED = {
    "float_type": "a number",
    "finite_number": "a finite number",
    "int_type": "a whole number",
    "bool_type": "true or false",
    "int_from_float": "a whole number",
    "string_type": "a text",
    "list_type": "a list",
    "sequence_type": "a list",
    "dict_type": "a map",
    "model_type": "a map",
}


def _explain(errors: list[ErrorDetails], path: list[int | str], model: type[BaseModel]) -> tuple[list[int | str], str]:
    """The field, and what was found and expected there; several errors are those of the forms it may have."""
    kind, context = errors[0]["type"], errors[0].get("ctx", {})
    fields = _fields_at(model, path)
    if kind == "extra_forbidden":
        known = [field.alias or key for key, field in fields.items()]
        near = difflib.get_close_matches(str(path[-1]), known, 1, 0.6)
        return path[:-1], f"unknown key '{path[-1]}', expected {near[0] if near else ', '.join(known)}"
    description = next((f.description for key, f in fields.items() if path and path[-1] in (f.alias, key)), None)
    if kind == "missing":
        return path, "is missing" + (f"; expected {description}" if description else "")
    if kind in ("too_short", "too_long"):
        bound, least = ("at least", "min_length") if kind == "too_short" else ("at most", "max_length")
        expected = f"{bound} {context[least]}" + (f" ({description})" if description else "")
        return path, f"found {context['actual_length']} entries, expected {expected}"
    if kind == "value_error" and str(context["error"]).startswith("found "):  # says both by itself
        return path, str(context["error"])
    expected = " or ".join(dict.fromkeys(_expected(error) for error in errors))
    return path, f"found {display_value(errors[0]['input'])}, expected {expected}" + (
        f" ({description})" if description else ""
    )


def _expected(error: ErrorDetails) -> str:
    """What an error says was expected."""
    kind, context = error["type"], error.get("ctx", {})
    if kind == "value_error":
        return str(context["error"])
    if kind == "literal_error":
        return str(context["expected"]).replace("'", "")
    words = {"gt": "more than", "ge": "at least", "lt": "less than", "le": "at most"}
    bound = next((f"{text} {context[key]:g}" for key, text in words.items() if key in context), None)
    return bound or EXPECTED.get(kind, error["msg"].removeprefix("Input should be "))


def display_value(value: object) -> str:
    """A value as a document says it, cut to one short line."""
    try:
        text = (
            json.dumps(value, ensure_ascii=False)
            if isinstance(value, (dict, list, bool)) or value is None
            else repr(value)
        )
    except (TypeError, ValueError):
        text = repr(value)
    return text if len(text) <= MAX_SHOWN else text[: MAX_SHOWN - 1] + "…"


def _fields_at(model: type[BaseModel], path: list[int | str]) -> dict[str, Any]:
    """The fields of the model that holds the last step of a path."""
    here: Any = model
    for step in path[:-1]:
        here = _step_into(here, step)
    found = next((m for m in _models_in(here)), None)
    return dict(found.model_fields) if found else {}


def _models_in(annotation: object) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    elif get_origin(annotation) not in (list, dict, Literal):
        for argument in get_args(annotation):
            yield from _models_in(argument)


def _step_into(annotation: object, step: int | str) -> Any:
    for model in _models_in(annotation):
        for key, field in model.model_fields.items():
            if step in (key, field.alias):
                return field.annotation
    if get_origin(annotation) in (list, dict):
        return get_args(annotation)[-1]
    return next((found for a in get_args(annotation) if (found := _step_into(a, step)) is not None), None)
