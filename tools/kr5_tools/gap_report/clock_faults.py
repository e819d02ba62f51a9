"""Columns that were logged late or early, as a diagnosis warns of them: in a sentence, and with the remedy."""

import re
from dataclasses import dataclass

from kr5_tools.cli.numbers import format_number

WARNING = re.compile(r"([\w ]+): logged ([\d.]+) \+- ([\d.]+) ms (late|early) relative to the other columns")
FAMILIES = {"joint torques": "tau", "motor currents": "i", "joint angles": "q"}  # others are of the wrench


@dataclass(frozen=True)
class ClockFault:
    columns: str  # in words
    delay: float  # after the other columns [s]
    std: float  # [s]

    @property
    def text(self) -> str:
        verb, when = "were" if self.columns in FAMILIES else "was", "late" if self.delay > 0 else "early"
        value, std = (format_number(1e3 * x, 1e3 * self.std) for x in (abs(self.delay), self.std))
        return f"the {self.columns} {verb} logged {value} ± {std} ms {when} relative to the other columns"

    @property
    def entry(self) -> str:
        """Of a map of logs."""
        return f"columns.{FAMILIES.get(self.columns, 'wrench')}.delay"

    def remedy(self, source: str, of_logs: bool) -> str:
        """What to do about it. `source`: what was diagnosed, as a command takes it; `of_logs`: with a model."""
        if of_logs:
            return (
                f"Correct the times of the {self.columns}, and diagnose again: `kr5 gap diagnose {source}"
                f" --set {self.entry}={self.delay:.3g}`."
            )
        return (
            f"Correct the times of the {self.columns}, and diagnose again: {self.entry.replace('.delay', '')}:"
            f" {{delay: {self.delay:.3g}}} in the map from which the recording was imported, or the time stamps at"
            " their source."
        )


def clock_faults(warnings: list[str]) -> list[ClockFault]:
    found = [m for m in map(WARNING.match, warnings) if m]
    return [ClockFault(m[1], (1e-3 if m[4] == "late" else -1e-3) * float(m[2]), 1e-3 * float(m[3])) for m in found]
