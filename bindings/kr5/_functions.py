"""Functions of an extension as functions of the Python module that users import: pydoc takes the former for methods of
an internal class of pybind11, and `inspect` finds no arguments of theirs."""

import functools
import inspect
import re
from collections.abc import Callable, Iterator
from typing import Any

OPEN, CLOSE = "([{<", ")]}>"


class _Default:
    """A default value as the extension documents it."""

    def __init__(self, text: str) -> None:
        self.text = text

    def __repr__(self) -> str:
        return self.text


def as_python_functions(namespace: dict[str, Any]) -> None:
    """Replaces the functions of an extension in the namespace of a module."""
    for name, value in list(namespace.items()):
        if inspect.isbuiltin(value) and not name.startswith("_"):
            namespace[name] = _as_function(value, name, namespace["__name__"])


def _as_function(function: Callable[..., Any], name: str, module: str) -> Callable[..., Any]:
    def call(*args: Any, **kwargs: Any) -> Any:
        return function(*args, **kwargs)

    functools.update_wrapper(call, function, assigned=("__doc__",))
    call.__name__ = call.__qualname__ = name
    call.__module__ = module
    if signature := _signature(function.__doc__ or ""):
        call.__signature__ = signature  # type: ignore[attr-defined]
    return call


def _signature(doc: str) -> inspect.Signature | None:
    """Of the first line of a docstring, such as `f(a: int, b: float = 1.0) -> int`; None where it tells none."""
    head = re.match(r"\w+\((.*)\)(?: -> .*)?$", doc.split("\n", 1)[0])
    if not head:
        return None
    parameters, kind = [], inspect.Parameter.POSITIONAL_OR_KEYWORD
    for text in _split(head[1]):
        if text == "/":
            parameters = [p.replace(kind=inspect.Parameter.POSITIONAL_ONLY) for p in parameters]
        elif text == "*":
            kind = inspect.Parameter.KEYWORD_ONLY
        elif found := re.match(r"(\*{0,2})(\w+)", text):
            stars, name = found.groups()
            own = {"": kind, "*": inspect.Parameter.VAR_POSITIONAL, "**": inspect.Parameter.VAR_KEYWORD}[stars]
            default = _Default(text.split(" = ", 1)[1]) if " = " in text else inspect.Parameter.empty
            parameters.append(inspect.Parameter(name, own, default=default))
    try:
        return inspect.Signature(parameters)
    except ValueError:
        return None


def _split(text: str) -> Iterator[str]:
    """At commas outside of brackets."""
    depth, part = 0, ""
    for k, letter in enumerate(text):
        is_arrow = letter == ">" and text[k - 1 : k] == "-"
        depth += (letter in OPEN) - (letter in CLOSE and not is_arrow)
        if letter == "," and depth == 0:
            yield part.strip()
            part = ""
        else:
            part += letter
    if part.strip():
        yield part.strip()
