"""Command line options made from the field list of a struct: name, type, default and help are written once, in C++."""

import functools
import inspect
from collections.abc import Callable
from typing import Annotated, Any, Literal

import typer

SCALARS = {"float": float, "int": int, "bool": bool, "str": str}


def _parameter(field: dict[str, Any]) -> inspect.Parameter:
    name, kind = field["name"], field["type"].removesuffix(" | None")
    if field["choices"]:
        annotation: Any = Literal[tuple(field["choices"])]
    elif kind in SCALARS:
        annotation = SCALARS[kind]
    else:
        raise TypeError(f"{name} is of type {field['type']}, which no option can give: leave it out with skip=")
    default = field["default"]
    shown = (
        ""
        if default is None or default == ""
        else f"  [dim](default: {str(default).lower() if kind == 'bool' else default})[/dim]"
    )
    text = field["doc"].replace("[", r"\[") + shown
    flag = name.replace("_", "-")
    flags = f"--{flag}/--no-{flag}" if kind == "bool" else f"--{flag}"
    option = typer.Option(flags, help=text, show_default=False, rich_help_panel="Settings")
    return inspect.Parameter(
        name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=Annotated[annotation | None, option]
    )


def options_from(
    struct: Any, skip: tuple[str, ...] = (), argument: str = "options"
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Gives a command one --flag for every field of `struct`; the command gets them as the keyword argument named.

    @app.command()
    @options_from(kr5.calibration.HandEyeOptions, skip=("start",))
    def hand_eye(folder: Path, options: kr5.calibration.HandEyeOptions): ...

    Flags that are not given leave the struct's own default. A command that takes several structs names the `argument`
    of each, and skips what two of them share."""
    added = [_parameter(f) for f in struct.fields() if f["name"] not in skip]

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        signature = inspect.signature(command, eval_str=True)
        own = [p for p in signature.parameters.values() if p.name != argument]
        if len(own) == len(signature.parameters):
            raise TypeError(f"{command.__name__} has no argument '{argument}'")

        @functools.wraps(command)
        def with_options(**given: Any) -> Any:
            chosen = {p.name: given.pop(p.name) for p in added}
            given[argument] = struct(**{name: value for name, value in chosen.items() if value is not None})
            return command(**given)

        keyword_only = [p.replace(kind=inspect.Parameter.KEYWORD_ONLY) for p in own]
        with_options.__dict__["__signature__"] = signature.replace(parameters=[*keyword_only, *added])
        del with_options.__wrapped__
        with_options.__annotations__ = {p.name: p.annotation for p in [*keyword_only, *added]}
        return with_options

    return decorate
