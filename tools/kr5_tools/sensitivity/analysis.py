"""One sensitivity analysis: a model with its inputs, evaluated row by row of the sample matrices, anywhere."""

import time
from dataclasses import dataclass
from typing import Any

import kr5.uncertainty
import numpy as np

from kr5_tools.sensitivity.inputs_file import Quantity
from kr5_tools.sensitivity.model import Model, ModelError, Numbers

SECONDS_OF_BATCH = 1.0  # of work: what a killed worker costs
MOST_ROWS = 1024  # of a batch, whose inputs are held at a time
LONG = 5.0  # [s] of work from which processes of their own pay


@dataclass(frozen=True)
class Analysis:
    """What is analysed. `inputs` are kr5.uncertainty.UncertainInput in SI."""

    name: str
    title: str
    text: str
    model: Model
    inputs: tuple[Any, ...]
    units: tuple[Quantity, ...]  # of the inputs
    outputs: tuple[Quantity, ...]
    resolution: float = 0.0  # standard deviation up to which an output counts as constant

    @property
    def free(self) -> list[int]:
        """Numbers of the inputs that have indices."""
        return [k for k, item in enumerate(self.inputs) if not item.averaged]

    @property
    def evaluations_of_row(self) -> int:
        return len(self.free) + 2


Row = tuple[int, Numbers]


def evaluate_rows(
    model: Model,
    inputs: tuple[kr5.uncertainty.UncertainInput, ...],
    options: kr5.uncertainty.SobolOptions,
    first: int,
    count: int,
) -> tuple[str, list[Row]]:
    """Outputs of rows of the design, each (free inputs + 2) x outputs, and the version of the library."""
    import kr5
    from kr5.uncertainty import sobol_design

    design = sobol_design(list(inputs), first, count, options)
    outputs = model.evaluate(np.ascontiguousarray(design))
    each = len(design) // count
    return kr5.__version__, [(first + k, outputs[k * each : (k + 1) * each]) for k in range(count)]


def probe(analysis: Analysis, options: kr5.uncertainty.SobolOptions) -> tuple[int, float]:
    """Number of outputs, and seconds an evaluation takes; complains of a model that cannot be evaluated."""
    begin = time.perf_counter()
    _, rows = evaluate_rows(analysis.model, analysis.inputs, options, 0, 1)
    seconds = (time.perf_counter() - begin) / analysis.evaluations_of_row
    count = rows[0][1].shape[1]
    if analysis.outputs and len(analysis.outputs) != count:
        raise ModelError(f"the model gives {count} outputs, but {len(analysis.outputs)} are named")
    return count, seconds


def split_rows(missing: list[int], each: int, workers: int, seconds: float) -> list[tuple[int, int]]:
    """First row and number of rows of batches of about SECONDS_OF_BATCH, so many that all workers end together."""
    size = int(SECONDS_OF_BATCH / max(seconds * each, 1e-9))
    size = max(1, min(size, MOST_ROWS, -(-len(missing) // (4 * workers)) if workers > 1 else MOST_ROWS))
    out: list[tuple[int, int]] = []
    for row in missing:
        first, count = out[-1] if out else (0, 0)
        if out and row == first + count and count < size:
            out[-1] = (first, count + 1)
        else:
            out.append((row, 1))
    return out
