"""`kr5 gap` as a person runs it: in a folder, with its JSON."""

import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass
class Answer:
    """What the command answered."""

    code: int
    data: dict[str, Any]
    said: str
    seconds: float
    memory: float = 0.0  # at most [GiB]

    @property
    def causes(self) -> list[tuple[str, str]]:
        return sorted((c["effect"], c["target"]) for c in self.data.get("causes", []))

    @property
    def refusal(self) -> str:
        """The last line that it said, where it gave no answer."""
        if self.code == 0:
            return ""
        said = self.said.strip()
        return said.splitlines()[-1][:200] if said else f"ended with code {self.code}, without a word"


def run_gap(command: str, folder: Path, *words: Any) -> Answer:
    """`kr5 gap COMMAND` in a folder."""
    file = folder / "answer.json"
    file.unlink(missing_ok=True)
    start = time.monotonic()
    with tempfile.TemporaryFile("w+") as said:
        process = subprocess.Popen(
            [sys.executable, "-m", "kr5_tools", "gap", command, *map(str, words), "--json", file.name],
            cwd=folder,
            stdout=said,
            stderr=subprocess.STDOUT,
        )
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        text = said.read()
    data = json.loads(file.read_text()) if process.returncode == 0 and file.is_file() else {}
    return Answer(process.returncode, data, text, time.monotonic() - start, used.ru_maxrss / (1 << 20))
