"""What each kind of model has a place for: the one table from which all writers say what they hold and what is lost."""

from dataclasses import dataclass

from kr5.models.kinds import NAMES, Kind

# Fields of a cell, by how their path begins.
GEOMETRY = ("robot.T_B_0", "robot.dh", "tool.T_F_E")
MASSES = ("robot.links", "tool.mass")
FRICTION = ("drives.friction",)
ROTORS = "drives.rotor_inertia"
SERVO = "servo.torque["
DELAY = "servo.joint"  # of all servos, of torque or position


@dataclass(frozen=True)
class Form:
    """What a kind of model holds of a cell."""

    fields: tuple[str, ...]  # paths, by how they begin
    servo: tuple[str, ...] = ()  # fields of a torque servo
    springs: bool = False  # whether a joint may have one
    gravity: bool = False  # whether the model states it
    limits: str = ""  # what differs in a servo that is held, in words

    @property
    def rotors(self) -> bool:
        return ROTORS in self.fields

    def holds(self, path: str) -> bool:
        """Whether a field has a place; it is named as the folding of effects names it: `servo.torque[2].damping`."""
        if path.startswith(self.fields):
            return True
        name = "delay" if path == DELAY else path.rpartition(".")[2] if path.startswith(SERVO) else ""
        return name in self.servo


GAINS = ("stiffness", "damping", "torque_limit")
FORMS = {
    Kind.URDF: Form((*GEOMETRY, *MASSES, *FRICTION)),
    Kind.MJCF: Form((*GEOMETRY, *MASSES, *FRICTION, ROTORS), GAINS, springs=True, gravity=True),
    Kind.SDF: Form(
        (*GEOMETRY, *MASSES, *FRICTION),
        (*GAINS, "integral"),
        springs=True,
        limits="the damping of the servos stands in that of the joints, for the controller of Gazebo damps the error"
        " and not the joint: torque limits do not hold for it",
    ),
    Kind.DRAKE: Form((*GEOMETRY, *MASSES, "drives.friction.viscous", ROTORS), GAINS, springs=True),
    Kind.ISAAC: Form(
        (*FRICTION, ROTORS),
        (*GAINS, "stall_torque", "no_load_speed", "delay"),
        limits="friction is stated as a torque, which Isaac Sim takes from version 5.0 on",
    ),
    Kind.CELL: Form(("",), springs=True, gravity=True),
}
# What others are, in words.
FIELD_WORDS = {
    "robot.T_B_0": "the place of the base",
    "robot.dh": "the lengths of links and the zeros of joints",
    "robot.links": "the masses of links",
    "tool.T_F_E": "the tool tip",
    "tool.mass": "the mass of the tool",
    "drives.friction.coulomb": "dry friction of a joint",
    "drives.torque_constant": "the torque constant of a motor",
    "drives.rotor_inertia": "the inertia of a rotor",
    "drives.structure": "the coupling of motors and joints",
    "drives.friction": "friction of a joint",
    "servo": "the servo of a joint or a path",
    "camera": "a camera",
    "laser": "a line scanner",
    "contact": "the contact of the tool",
    "tube": "a tube",
}


def lost_field_reason(kind: Kind, path: str) -> str:
    """Why a field of a cell is not in a model, in words."""
    words = next(words for start, words in FIELD_WORDS.items() if path.startswith(start))
    return f"{NAMES[kind]} has no place for {words}"
