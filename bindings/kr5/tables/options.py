"""What the options of a command say of its tables."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import kr5
from kr5.logs.episodes import parse_episodes
from kr5.tables.pose_list import PoseList, read_pose_list
from kr5.tables.read_table import read_table
from kr5.tables.roles import AnyRole, Units
from kr5.tables.table import Table


@dataclass
class TableOptions:
    """Names of columns, separated by commas, and units; None: found in the file. `notes`: how the tables were read."""

    columns: str | None = None
    joints: str | None = None
    position: str | None = None
    convention: str | None = None
    length: str | None = None
    angle: str | None = None
    point: str | None = None
    episodes: str = ""  # of a data set, one of them
    notes: list[str] = field(default_factory=list)

    def read(self, file: Path, roles: Sequence[AnyRole], joints: int | None = None) -> Table:
        """The table of a file; `joints`: their number, where it is known."""
        given = {"q": self.joints, "points": self.position, "point": self.point}
        if self.position and len(self.position.split(",")) == 3:
            given["pose"] = self.position
        table = read_table(
            file,
            roles,
            Units(self.length, self.angle),
            self.convention,
            columns=self.columns,
            given={name: text for name, text in given.items() if text},
            counts={} if joints is None else dict.fromkeys(("q", "qd", "tau", "i"), joints),
            episode=self._episode(),
        )
        self.tell(table.notes)
        return table

    def read_poses(self, file: Path, strict: bool = True, guess_units: bool = True) -> PoseList:
        """The poses of a file."""
        units = Units(self.length, self.angle)
        out = read_pose_list(file, units, self.convention, self.columns, strict=strict, guess_units=guess_units)
        self.tell(out.notes)
        return out

    def _episode(self) -> int | None:
        numbers = parse_episodes(self.episodes) if self.episodes else []
        if len(numbers) > 1:
            raise kr5.InvalidArgument(f"--episodes: found {self.episodes}, expected one: this command reads one log")
        return numbers[0] if numbers else None

    def tell(self, notes: Sequence[str]) -> None:
        self.notes += [note for note in notes if note not in self.notes]

    def joint_names(self, count: int) -> list[str]:
        """Names of the joints' columns; of a pattern as many as are asked for."""
        pattern = self.joints or "q{}"
        if "{}" in pattern and "," not in pattern:
            return [pattern.replace("{}", str(k + 1)) for k in range(count)]
        return pattern.split(",")
