"""The file of a model's uncertain inputs: distributions and units. The model gets SI."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import kr5
from kr5.files.documents import Document, PositiveNumber, check_names, fail_at, read_document
from kr5.logs.units import UNITS
from pydantic import Field, field_validator, model_validator

KNOWN_UNITS = {unit: factor for units in UNITS.values() for unit, factor in units.items()}
FIELDS = {
    "normal": {"mean", "sigma"},
    "truncated_normal": {"mean", "sigma", "truncation"},
    "uniform": {"low", "high"},
}


def _check_unit(unit: str) -> str:
    if unit not in KNOWN_UNITS:
        raise ValueError(f"found {unit!r}, expected one of {', '.join(KNOWN_UNITS)}")
    return unit


class InputEntry(Document):
    name: str = Field(min_length=1)
    distribution: Literal["normal", "truncated_normal", "uniform"]
    mean: float | None = Field(None, description="mean of a normal input")
    sigma: PositiveNumber | None = Field(None, description="standard deviation of a normal input, before it is cut off")
    truncation: PositiveNumber | None = Field(None, description="standard deviations at which it is cut off")
    low: float | None = Field(None, description="lower end of a uniform input")
    high: float | None = Field(None, description="upper end of a uniform input")
    unit: str = Field("-", description="unit of the numbers")

    _unit = field_validator("unit")(_check_unit)

    @model_validator(mode="after")
    def _fields_of_the_distribution(self) -> "InputEntry":
        wanted = FIELDS[self.distribution]
        for name in sorted(set().union(*FIELDS.values())):
            if (getattr(self, name) is not None) != (name in wanted):
                raise ValueError(
                    f"found {'no' if name in wanted else 'a'} {name}, expected {', '.join(sorted(wanted))}"
                    f" of the distribution {self.distribution}"
                )
        if self.low is not None and self.high is not None and not self.low < self.high:
            raise ValueError(f"found low {self.low:g} and high {self.high:g}, expected low below high")
        return self


class OutputEntry(Document):
    name: str = Field(min_length=1)
    unit: str = Field("-", description="unit in tables and plots; the model gives SI")

    _unit = field_validator("unit")(_check_unit)


class InputsFile(Document):
    inputs: list[InputEntry] = Field(min_length=1, max_length=1000)
    outputs: list[OutputEntry] | None = None

    @field_validator("inputs")
    @classmethod
    def _unique(cls, inputs: list[InputEntry]) -> list[InputEntry]:
        check_names([entry.name for entry in inputs])
        return inputs


@dataclass(frozen=True)
class Quantity:
    """Name and unit of an input or an output; `factor` takes the unit to SI."""

    name: str
    unit: str = "-"

    @property
    def factor(self) -> float:
        return KNOWN_UNITS[self.unit]


def read_inputs(file: Path) -> tuple[list[Any], list[Quantity], list[Quantity]]:
    """The inputs in SI (kr5.uncertainty.UncertainInput), their units, and the outputs that the file names."""
    document = read_document(file, InputsFile, "the uncertain inputs of a model, a list `inputs`")
    inputs = [_in_si(entry) for entry in document.inputs]
    for k, item in enumerate(inputs):
        try:
            item.validate()
        except ValueError as error:
            fail_at(file, ["inputs", k], str(error))
    outputs = [Quantity(entry.name, entry.unit) for entry in document.outputs or ()]
    if len({q.name for q in outputs}) < len(outputs):
        raise kr5.FileError(file, "two have one name", field="outputs")
    return inputs, [Quantity(entry.name, entry.unit) for entry in document.inputs], outputs


def _in_si(entry: InputEntry) -> Any:
    from kr5.uncertainty import UncertainInput

    factor = KNOWN_UNITS[entry.unit]
    if entry.distribution == "uniform":
        assert entry.low is not None and entry.high is not None
        return UncertainInput(name=entry.name, law="uniform", low=factor * entry.low, high=factor * entry.high)
    assert entry.mean is not None and entry.sigma is not None
    return UncertainInput(
        name=entry.name,
        mean=factor * entry.mean,
        sigma=factor * entry.sigma,
        truncation=entry.truncation or float("inf"),
    )
