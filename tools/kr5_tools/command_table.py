"""Every command of `kr5`: its module, what `kr5 --help` says of it, and the results that it writes."""

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import NamedTuple


class CommandEntry(NamedTuple):
    """A command. Its module, in `kr5_tools`, has `app`, a typer.Typer: with one command and no callback it is that
    command, otherwise a group of commands. `results`: the formats of its results, which `kr5 report` shows, with the
    titles of their pages."""

    module: str
    help: str
    results: Mapping[str, str] = MappingProxyType({})


COMMANDS: dict[str, CommandEntry | dict[str, CommandEntry]] = {
    "demo": CommandEntry("demo", "Demonstration of the main commands on data with known truth."),
    "cell": CommandEntry("cell.command", "Cells and recordings: check, tables, drawings, URDF."),
    "dataset": CommandEntry("dataset.command", "Description of a folder of images and robot poses."),
    "detect": CommandEntry("targets.detect", "Detection of targets in images.", {"kr5-detection/1": "Detection"}),
    "target": CommandEntry("targets.command", "Targets to print, and their points."),
    "render": CommandEntry("targets.render", "Rendered image of targets with known truth."),
    "calibrate": {
        "camera": CommandEntry(
            "calibrate.camera",
            "Camera: lens and sensor, from images of a target.",
            {"kr5-camera/1": "Camera calibration"},
        ),
        "hand-eye": CommandEntry(
            "calibrate.hand_eye",
            "Hand-eye: pose of the camera on the flange or in the base.",
            {"kr5-hand-eye/1": "Hand-eye calibration"},
        ),
        "cell": CommandEntry(
            "calibrate.cell",
            "Camera, hand-eye, marker map, arm and line scanner in one solve.",
            {"kr5-cell-calibration/1": "Calibration of a cell"},
        ),
        "tool": CommandEntry(
            "calibrate.tool", "Tool centre point in the flange frame.", {"kr5-tool/1": "Tool centre point"}
        ),
        "kinematics": CommandEntry(
            "calibrate.kinematics",
            "Arm: DH parameters, from measured postures.",
            {"kr5-kinematics/1": "Kinematic calibration"},
        ),
        "postures": CommandEntry(
            "calibrate.posture_plan",
            "Postures to measure for a calibration of the arm.",
            {"kr5-postures/1": "Postures for a calibration"},
        ),
        "laser": CommandEntry(
            "calibrate.laser",
            "Line scanner on the flange, from profiles of a tip, spheres or planes.",
            {"kr5-laser/1": "Line scanner"},
        ),
        "laser-study": CommandEntry(
            "calibrate.laser_study",
            "Error of a scanner against stand-off and scanning speed.",
            {"kr5-laser-study/1": "Scanning: stand-off and speed"},
        ),
        "map": CommandEntry(
            "calibrate.marker_map",
            "Marker map: poses of markers relative to each other.",
            {"kr5-marker-map/1": "Marker map"},
        ),
        "timed": CommandEntry(
            "calibrate.timed",
            "Hand-eye from pose streams with two clocks.",
            {"kr5-timed-hand-eye/1": "Hand-eye calibration with clocks"},
        ),
    },
    "identify": {
        "axes": CommandEntry(
            "identify.axes",
            "Joint axes and DH parameters, from joints moved one at a time.",
            {"kr5-axes/1": "Joint axes"},
        ),
        "gravity": CommandEntry(
            "identify.gravity",
            "Gravity model from slow motions; current limits of passive compliance.",
            {"kr5-gravity/1": "Gravity model"},
        ),
        "excitation": CommandEntry(
            "identify.excitation",
            "Exciting motion for the identification of an arm's dynamics.",
            {"kr5-excitation/1": "Exciting motion"},
        ),
        "drives": CommandEntry(
            "identify.drives",
            "Structure matrix, gear ratios and couplings, from encoders and joint angles.",
            {"kr5-drives/1": "Drives of an arm"},
        ),
        "elasticity": CommandEntry(
            "identify.elasticity",
            "Stiffness and play of the gears, from angles on both sides of them.",
            {"kr5-elasticity/1": "Elasticity of the joints"},
        ),
        "dynamics": CommandEntry(
            "identify.dynamics",
            "Dynamic parameters and friction, from a motion with currents or torques.",
            {"kr5-dynamics/1": "Dynamics of an arm"},
        ),
        "payload": CommandEntry(
            "identify.payload",
            "Load at the flange, from motions with it and without.",
            {"kr5-payload/1": "Payload of an arm"},
        ),
        "study": CommandEntry(
            "identify.study",
            "Noise study of the identification of joint axes: devices, noises, arcs.",
            {"kr5-axes-study/1": "Noise study of joint axes"},
        ),
        "servo": CommandEntry(
            "identify.servo", "Servo of the path correction or of joints, from a response.", {"kr5-servo/1": "Servo"}
        ),
        "servos": CommandEntry(
            "identify.servos",
            "Torque servos, friction and inertias of all joints, from commands.",
            {"kr5-servos/1": "Torque servos of an arm"},
        ),
        "contact": CommandEntry(
            "identify.contact", "Stiffness of a contact, and the force loop on it.", {"kr5-contact/1": "Contact"}
        ),
        "force-torque": CommandEntry(
            "identify.force_torque",
            "Force sensor and the tool below it.",
            {"kr5-force-torque/1": "Force/torque sensor"},
        ),
    },
    "bin": {
        "empty": CommandEntry(
            "picking.empty",
            "Simulated bin emptied pick by pick, with a picture of every decision.",
            {"kr5-bin-run/1": "Bins emptied"},
        ),
        "simulate": CommandEntry("picking.simulate", "Simulated bin of cylinders with scan, picture and truth."),
    },
    "repeatability": CommandEntry(
        "repeatability.command",
        "Pose repeatability and accuracy after ISO 9283.",
        {"kr5-repeatability/1": "Pose repeatability"},
    ),
    "workspace": CommandEntry(
        "workspace.command", "Workspace of an arm: reach and manipulability.", {"kr5-workspace/1": "Workspace"}
    ),
    "record": CommandEntry("simulation.record", "Recording of a simulated cell."),
    "recording": CommandEntry("recording.command", "Recordings from logs of a real cell."),
    "job": CommandEntry("work.command", "Jobs from bin to tube: state machine, journal, release of a stop."),
    "insert": CommandEntry(
        "insertion.command", "Simulated insertion of a peg into a tube.", {"kr5-insertion/1": "Insertion"}
    ),
    "sweep": {
        "insertion": CommandEntry(
            "sweep.command",
            "Insertions over tilts and clearances: success rates and times.",
            {"kr5-sweep/1": "Sweep of insertions"},
        ),
    },
    "sensitivity": CommandEntry(
        "sensitivity.command",
        "Sensitivity of a model or an arm: Sobol's indices with intervals.",
        {"kr5-sensitivity/1": "Sensitivity"},
    ),
    "uncertainty": CommandEntry(
        "uncertainty.command",
        "Uncertainty through chains of poses, of camera, scanner and both fused.",
        {"kr5-uncertainty/1": "Uncertainty"},
    ),
    "pick": CommandEntry(
        "picking.pick",
        "Poses of the cylinders in a scanned bin, and the order to pick them.",
        {"kr5-pick/1": "Picks from a bin"},
    ),
    "run": CommandEntry("work.run", "The job from bin to tube in a simulated cell, with journal and restart."),
    "rsi": CommandEntry("rsi.command", "KUKA controllers over the RobotSensorInterface."),
    "scene": CommandEntry(
        "simulation.scene", "Scenes in DART with expected results.", {"kr5-scene-result/1": "Result of a scene"}
    ),
    "gap": CommandEntry(
        "gap.command",
        "Gap between simulation and recording: measurement, causes, next experiment.",
        {
            "kr5-gap/2": "Diagnosis",
            "kr5-gap/1": "Diagnosis, as versions before 0.3 wrote it",
            "kr5-gap-measure/1": "Gap between simulation and recording",
            "kr5-gap-comparison/1": "Difference between recordings",
            "kr5-gap-plan/1": "Next experiment",
            "kr5-gap-explanation/1": "Explanation of a verdict or an effect",
        },
    ),
    "replay": CommandEntry("simulation.replay", "Page with a recording or a protocol in 3D and its signals."),
    "report": CommandEntry("report.command", "Self-contained page of a result file."),
}
GROUP_HELP = {
    "bin": "Simulated bins of cylinders.",
    "calibrate": "Calibrations with uncertainty and verdict.",
    "identify": "Identification of an arm: axes, dynamics, drives, servos, sensors and contacts.",
    "sweep": "Many simulated runs over a grid of conditions.",
}


def entries() -> Iterator[CommandEntry]:
    """Of all commands, those of groups included."""
    for entry in COMMANDS.values():
        yield from entry.values() if isinstance(entry, dict) else [entry]


def result_titles() -> dict[str, str]:
    """The title of every format of a result."""
    return {name: title for entry in entries() for name, title in entry.results.items()}
