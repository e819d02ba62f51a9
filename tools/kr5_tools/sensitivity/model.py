"""Models whose sensitivity is asked for, as any worker can evaluate them: a function of Python, or an arm."""

import functools
import importlib
import sys
import types
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from kr5.files.documents import read_text

Numbers = np.ndarray[Any, np.dtype[np.float64]]


class ModelError(Exception):
    """What a model does that it must not, in words for its author."""


class Model(Protocol):
    """Outputs (samples x outputs) of inputs (samples x inputs), and what tells it from another model."""

    def evaluate(self, inputs: Numbers) -> Numbers: ...

    def describe(self) -> dict[str, Any]: ...


@dataclass(frozen=True)
class ArmModel:
    """Errors of the flange of an arm of which parameters are off."""

    cell: str  # text of the cell file
    parameters: tuple[tuple[int, str], ...]  # joint from 0, parameter
    posture: tuple[float, ...]  # [rad or m]
    joints_vary: bool

    def evaluate(self, inputs: Numbers) -> Numbers:
        return np.asarray(_arm(self).errors(inputs))

    def describe(self) -> dict[str, Any]:
        return {"cell": self.cell, "posture": list(self.posture), "parameters": [list(p) for p in self.parameters]}


@functools.lru_cache(maxsize=4)
def _arm(model: ArmModel) -> Any:
    import kr5.cell
    from kr5.kinematics import DeviatedArm, JointParameter

    return DeviatedArm(
        nominal=kr5.cell.parse_cell(model.cell).nominal_chain(),
        parameters=[JointParameter(joint=joint, parameter=name) for joint, name in model.parameters],
        q=list(model.posture),
        joints_vary=model.joints_vary,
    )


@dataclass(frozen=True)
class FunctionModel:
    """A function of Python: of one sample (an array of its inputs) unless it is vectorized. It gives a number, a list
    of numbers or, by sample, a map from names to numbers."""

    where: str  # module, or name of a file
    text: str  # of that file; of a module none
    function: str
    vectorized: bool
    names: tuple[str, ...]  # of the inputs

    @property
    def label(self) -> str:
        return f"{self.where}:{self.function}"

    def evaluate(self, inputs: Numbers) -> Numbers:
        if self.vectorized:
            found = self._call(inputs, inputs[0])
            rows = self._numbers(found, inputs[0])
            rows = rows[:, None] if rows.ndim == 1 else rows
            if rows.ndim != 2 or len(rows) != len(inputs):
                raise ModelError(
                    f"{self.label}: gave an array of shape {rows.shape} for {len(inputs)} samples; expected"
                    " (samples,) or (samples, outputs)"
                )
        else:
            one_by_one = [self._flat(self._call(x.copy(), x), x) for x in inputs]
            counts = [len(row) for row in one_by_one]
            if len(set(counts)) > 1:
                odd = next(k for k, count in enumerate(counts) if count != counts[0])
                raise ModelError(
                    f"{self.label}: gave {counts[0]} outputs, then {counts[odd]} at {self._at(inputs[odd])}"
                )
            rows = np.array(one_by_one)
        bad = np.argwhere(~np.isfinite(rows))
        if len(bad):
            row, column = (int(k) for k in bad[0])
            raise ModelError(
                f"{self.label}: output {column + 1} is {rows[row, column]} at {self._at(inputs[row])}; an output must"
                " be finite over the whole range of the inputs"
            )
        return rows

    def output_names(self, sample: Numbers) -> list[str]:
        """Names of the outputs, where the function gives a map."""
        found = None if self.vectorized else self._call(sample.copy(), sample)
        return [str(name) for name in found] if isinstance(found, dict) else []

    def describe(self) -> dict[str, Any]:
        return {"model": self.label, "text": self.text, "vectorized": self.vectorized}

    def _call(self, argument: Numbers, sample: Numbers) -> Any:
        function = _function(self.where, self.text, self.function)
        try:
            return function(argument)
        except Exception as error:  # whatever the user's code raises is the user's to mend
            raise ModelError(f"{self.label}: raised {type(error).__name__}: {error} at {self._at(sample)}") from None

    def _flat(self, found: object, sample: Numbers) -> Numbers:
        if isinstance(found, dict):
            found = list(found.values())
        row = np.atleast_1d(self._numbers(found, sample))
        if row.ndim != 1 or not len(row):
            raise ModelError(
                f"{self.label}: gave an array of shape {row.shape} for one sample; expected a number, a list or a map"
                " (or is it --vectorized?)"
            )
        return row

    def _numbers(self, found: object, sample: Numbers) -> Numbers:
        try:
            return np.asarray(found, dtype=np.float64)
        except (TypeError, ValueError):
            raise ModelError(f"{self.label}: gave {found!r:.60} at {self._at(sample)}; expected numbers") from None

    def _at(self, sample: Numbers) -> str:
        shown = ", ".join(f"{name} = {value:.9g}" for name, value in list(zip(self.names, sample))[:8])
        return shown + (", …" if len(self.names) > 8 else "") + " (SI)"


@functools.lru_cache(maxsize=4)
def _function(where: str, text: str, name: str) -> Callable[..., Any]:
    """The function of a module, or of the text of a file, which may be on another machine."""
    try:
        if text:
            module = types.ModuleType(Path(where).stem)
            module.__file__ = where
            sys.modules.setdefault(module.__name__, module)
            folder = str(Path(where).resolve().parent)
            if folder not in sys.path:
                sys.path.append(folder)
            exec(compile(text, where, "exec"), module.__dict__)  # the user's own program
        else:
            if "" not in sys.path:
                sys.path.append("")
            module = importlib.import_module(where)
    except Exception as error:
        raise ModelError(f"{where}: cannot be imported ({type(error).__name__}: {error})") from None
    function = getattr(module, name, None)
    if not callable(function):
        raise ModelError(f"{where}: has no function {name!r}")
    return function  # type: ignore[no-any-return]


def model_file(given: str | None) -> Path | None:
    """The file of a model; nothing where a module or no model is named."""
    where = (given or "").rpartition(":")[0]
    return Path(where) if where.endswith(".py") else None


def function_model(given: str, vectorized: bool, names: tuple[str, ...]) -> FunctionModel:
    """The model that `MODULE:FUNCTION` or `FILE.py:FUNCTION` names."""
    where, colon, function = given.rpartition(":")
    if not colon or not where or not function.isidentifier():
        raise ModelError(f"found {given!r}, expected MODULE:FUNCTION or FILE.py:FUNCTION")
    file = model_file(given)
    text = read_text(file, "a Python file") if file else ""
    if file and not text.strip():
        raise ModelError(f"{where}: is empty")
    _function(where, text, function)
    return FunctionModel(where, text, function, vectorized, names)
