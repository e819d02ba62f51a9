"""What a command needs of a table."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from kr5.logs.units import UNITS

LARGEST = {"angle": 12.57, "length": 20.0}  # two turns of a joint [rad]; farther than a cell reaches [m]
OTHER_UNIT = {"angle": "deg", "length": "mm"}  # of numbers too large for SI


@dataclass(frozen=True)
class Role:
    """A quantity of a table: one column, or with `counted` one for each joint, motor or axis (q1, q2, …)."""

    name: str  # of its column; of counted ones without the number
    what: str  # in words
    quantity: str | tuple[str, ...] = "none"  # of which its units are, see log_import/units.py; the first is usual
    also: tuple[str, ...] = ()  # other names of the column
    counted: bool = False
    needed: bool = True
    may_lack: bool = False  # rows may have no number: NaN
    may_skip: bool = False  # some of the counted columns may be absent: NaN
    option: str = ""  # of the command, that names the columns
    unit_option: str = ""  # of the command, that says their unit; by default that of the quantity
    each: tuple[str, ...] = ()  # of counted ones, the quantity of each, where they differ: sliding joints
    follows: str = ""  # role in whose unit it is, of speeds a second, unless the names say another
    largest: float | None = None  # in SI, above which the unit is another one; by default that of the quantity

    @property
    def quantities(self) -> tuple[str, ...]:
        return (self.quantity,) if isinstance(self.quantity, str) else self.quantity

    @property
    def usual_unit(self) -> str:
        """The SI unit of its quantity."""
        return next(iter(UNITS[self.quantities[0]]))

    def of_kind(self, quantity: str) -> "Role":
        """The same, of one of the quantities of its columns."""
        return replace(self, quantity=quantity, each=())

    def columns_in_words(self) -> str:
        """`q1, q2, …`."""
        return f"{self.name}1, {self.name}2, …" if self.counted else self.name


@dataclass(frozen=True)
class TextRole:
    """A column of words, or of numbers that only name something."""

    name: str
    what: str
    also: tuple[str, ...] = ()
    needed: bool = True
    option: str = ""


@dataclass(frozen=True)
class PointsRole:
    """Points of a row: x y z, or of several x1 y1 z1 x2 …"""

    name: str = "points"
    what: str = "measured points"
    needed: bool = True
    instead: str = ""  # role of poses where these are not needed
    option: str = ""


@dataclass(frozen=True)
class PoseRole:
    """A pose a row: x, y, z and a rotation in one of the forms of kr5.calibration.RotationForm."""

    name: str = "pose"
    what: str = "a pose"
    prefix: str = ""  # of its columns, such as robot_
    needed: bool = True
    strict: bool = True  # numbers that contradict every unit are refused
    guess_units: bool = True


@dataclass(frozen=True)
class Units:
    """Units that the options of a command state; None: found."""

    length: str | None = None
    angle: str | None = None
    of_role: dict[str, str] = field(default_factory=dict)

    def stated(self, role: Role) -> str | None:
        if role.name in self.of_role:
            return self.of_role[role.name]
        return {"length": self.length, "angle": self.angle}.get(role.quantities[0])


def joints_role(joints: Sequence[object] | None = None, needed: bool = True) -> Role:
    """Joint values, of which sliding joints have lengths."""
    kinds = tuple("length" if str(getattr(j, "type", "")) == "prismatic" else "angle" for j in joints or ())
    return Role(
        "q",
        "joint values",
        "angle",
        also=("theta", "joint", "axis", "j"),
        counted=True,
        needed=needed,
        option="--joints",
        each=kinds if "length" in kinds else (),
    )


TIME = Role("t", "time", "time", also=("time", "timestamp", "stamp", "secs", "seconds"))
RUN = Role("run", "number of the run", needed=False)
SPEEDS = Role("qd", "speeds of the joints", ("turn rate", "speed"), counted=True, needed=False, follows="q")
TORQUES = Role("tau", "torques of the joints", ("torque", "force"), ("torque", "effort"), counted=True, needed=False)
CURRENTS = Role("i", "currents of the motors", "current", ("current",), counted=True, needed=False)
OPTIONAL_TIME = replace(TIME, needed=False)
AnyRole = Role | TextRole | PointsRole | PoseRole
