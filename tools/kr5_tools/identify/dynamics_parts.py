"""Motions as an identification of dynamics takes them: one part to fit, one to check."""

from dataclasses import dataclass
from typing import Any

import kr5.identification
import numpy as np
from kr5 import identification

from kr5_tools.identify.motion_logs import MotionLogs, require_usable

SHOWN_SAMPLES = 1500  # of each part, in the result file


@dataclass
class Part:
    """The conditioned logs of the fit, or of the check."""

    parts: list[Any]

    @property
    def findings(self) -> list[Any]:
        return [f for p in self.parts for f in p.findings]

    def measured(self) -> np.ndarray:
        """Torques as logged, samples x joints."""
        return np.vstack([p.tau_measured for p in self.parts])


def condition_parts(motions: MotionLogs, options: kr5.identification.ConditioningOptions) -> tuple[Part, Part]:
    """Both parts conditioned alike; ends with every error that is found."""
    fit = [identification.condition_log(log, options) for log in motions.fit]
    alike = identification.conditioning_like(fit, options)
    check = [identification.condition_log(log, alike) for log in motions.check]
    require_usable([*fit, *check])
    return Part(fit), Part(check)
