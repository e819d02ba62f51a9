"""A diagnosis with what its file says beside it: what was diagnosed, when, and by which command."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import kr5.gap
from kr5.files.paths import shown_name
from kr5.models.mujoco_check import MujocoCheck

FORMATS = ("kr5-gap/2", "kr5-gap/1")


@dataclass(frozen=True)
class DiagnosisFile:
    """A kr5.gap.Diagnosis and the keys of its result file."""

    found: kr5.gap.Diagnosis
    input: dict[str, Any] = field(default_factory=dict)
    created: str = ""
    version: str = ""
    command: str = ""
    mujoco: MujocoCheck | None = None  # what MuJoCo says of the model that was written
    written: dict[str, str] = field(default_factory=dict)  # files with the causes in them: model, cell

    @property
    def of_logs(self) -> bool:
        """Whether logs and a model were compared, not a recording."""
        return "logs" in self.input

    @property
    def noise_declared(self) -> bool:
        """Whether the model declares the noise of its sensors, as a cell does and the description of a robot not."""
        return not self.of_logs or Path(self.input.get("model", "")).suffix.lower() in (".yaml", ".yml")


def diagnosis_of(found: kr5.gap.Diagnosis, result: dict[str, Any]) -> DiagnosisFile:
    """A diagnosis with the keys of its result."""
    keys = {key: result[key] for key in ("created", "version", "command") if result.get(key)}
    mujoco = MujocoCheck.from_dict(result["mujoco"]) if result.get("mujoco") else None
    written = dict(result.get("written", {}))
    return DiagnosisFile(found, dict(result.get("input", {})), **keys, mujoco=mujoco, written=written)


def read_diagnosis(file: Path) -> DiagnosisFile:
    """Reads the result file of a diagnosis, of this format or the one before it."""
    from kr5.files import documents, results

    data = results.read_result(file, *FORMATS)
    text = documents.read_text(file, "a diagnosis written by kr5 gap diagnose")
    return diagnosis_of(kr5.gap.diagnosis_from_json(text, shown_name(file)), data)
