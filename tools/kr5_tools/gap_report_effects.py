"""What a person should know of each effect of the catalogue beyond its one line there: its name in words, in which columns
it shows, and what to do about it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class EffectWords:
    name: str
    shows: str  # in which columns
    mend: str  # what to look at in the real cell


CURRENT = "the current of its joint"
POSE = "everything that depends on where the tool is: poses, views, scans"
WRENCH = "this component of the wrench, in every experiment that records it"
PATH = "z of step and press"
PROFILE = "z and the wrench of profiles"
EFFECTS = {
    "coulomb_friction": EffectWords("Coulomb friction", f"{CURRENT}: a step where the motion reverses, the same at any speed",
                                    "Put the level into the cell. If it has risen, look at brake, seals and grease."),
    "viscous_friction": EffectWords("viscous friction", f"{CURRENT}: grows in proportion to the speed",
                                    "Put the slope into the cell; it follows the temperature of the grease."),
    "stribeck_friction": EffectWords("Stribeck friction", f"{CURRENT}: extra effort at low speed, gone at high speed",
                                     "Put it into the cell. Slow motions and reversals suffer most; look at the lubrication."),
    "load_friction": EffectWords("friction that grows with the load", f"{CURRENT}: larger where the gear carries more torque",
                                 "Put the coefficient into the cell; a worn gear has more of it."),
    "thermal_friction": EffectWords("friction that falls as the gear warms",
                                    f"{CURRENT}: fades over the session, against the motion",
                                    "Warm the robot up before recording, or keep the effect in the cell."),
    "joint_elasticity": EffectWords("joint elasticity",
                                    "poses, views and scans by the sag under gravity; currents and wrench by vibration",
                                    "Put the stiffness into the cell; the sag follows posture and payload."),
    "backlash": EffectWords("backlash",
                            "poses, views and scans where the load of the joint changes side; blows at reversals in the wrench",
                            "Approach targets from one side; have the gear's play measured."),
    "torque_constant": EffectWords("motor torque constant", f"{CURRENT}: in proportion to the whole torque",
                                   "Put the constant into the cell; check the scale of the logged current."),
    "rotor_inertia": EffectWords("rotor inertia", f"{CURRENT}: in proportion to its acceleration",
                                 "Put the inertia into the cell."),
    "cable_spring": EffectWords("pull of the dress pack", f"{CURRENT}: in proportion to the joint angle",
                                "Look how hoses and cables hang; route them with slack, or keep the spring in the cell."),
    "torque_ripple": EffectWords("torque ripple", f"{CURRENT}: periodic in the joint angle",
                                 "Put it into the cell; a damaged tooth or bearing grows."),
    "wrist_coupling": EffectWords("coupling between motors and joints",
                                  "the current of its motor: follows the torque of another joint",
                                  "Correct the structure matrix in the cell."),
    "payload": EffectWords("unknown payload", "wrench at rest and in motion, and currents of the joints that carry it",
                           "Weigh what hangs on the tool, cables too, and enter its mass and centre of mass."),
    "base_tilt": EffectWords("tilt of the base", "currents and wrench, since gravity leans, and all poses",
                             "Level the base, or set its tilt in the cell."),
    "encoder_offset": EffectWords("joint zero", f"{POSE}; currents a little, by gravity",
                                  "Master the joint again, or set the offset in the cell."),
    "link_length": EffectWords("link length", POSE, "Put the length into the cell: this is a calibration of the arm."),
    "link_twist": EffectWords("link twist", POSE, "Put the angle into the cell: this is a calibration of the arm."),
    "transmission_error": EffectWords("transmission error", f"{POSE}: periodic in the joint angle",
                                      "Put amplitude and phase into the cell; the gear is eccentric."),
    "tool_offset": EffectWords("tool offset", "measured poses; views and scans stay as they are",
                               "Calibrate the tool tip again: `kr5 calibrate tool`; see whether the tool is bent or loose."),
    "thermal_growth": EffectWords("growth of the warm links", f"{POSE}: builds up over the session",
                                  "Warm the robot up before precise work."),
    "current_delay": EffectWords("late logging of the currents", "all currents: in proportion to how fast they change",
                                 "Put position and current on one clock in the log."),
    "joint_servo": EffectWords("bandwidth of the axis", "measured position and current of its joint, where the motion changes",
                               "Read the servo's gains, or set the bandwidth in the cell."),
    "joint_delay": EffectWords("delay of motion commands", "all measured positions: in proportion to the speed",
                               "Look at the path from the controller to the drives; set the delay in the cell."),
    "tool_servo": EffectWords("bandwidth of the path correction", PATH, "Set the bandwidth in the cell, or tune the correction."),
    "tool_damping": EffectWords("damping of the path correction", PATH, "Set the damping in the cell, or tune the correction."),
    "tool_delay": EffectWords("delay of the path correction", PATH,
                              "Look at cycle and network of the correction; set the delay in the cell."),
    "ft_bias": EffectWords("offset of the force sensor", WRENCH, "Tare the sensor before each run."),
    "ft_drift": EffectWords("drift of the force sensor", f"{WRENCH}, growing with time",
                            "Let the sensor warm up; tare it more often."),
    "ft_gain": EffectWords("scale of the force sensor", f"{WRENCH}, in proportion to the load",
                           "Calibrate the sensor with a known weight."),
    "ft_crosstalk": EffectWords("crosstalk of the force sensor", f"{WRENCH}, in proportion to another one",
                                "Set the sensor's calibration matrix; look at its mounting screws."),
    "ft_lag": EffectWords("filter of the force sensor", "the whole wrench where it changes fast",
                          "Read the sensor's filter, or set its time constant in the cell."),
    "camera_focal": EffectWords("focal length", "u and v of views: grows away from the middle of the image",
                                "Calibrate the camera again: `kr5 calibrate camera`."),
    "lens_distortion": EffectWords("lens distortion", "u and v of views: largest near the corners of the image",
                                   "Calibrate the camera again: `kr5 calibrate camera`."),
    "hand_eye": EffectWords("camera mount", "u and v of views",
                            "Calibrate where the camera sits: `kr5 calibrate hand-eye`; see whether it is loose."),
    "laser_mount": EffectWords("scanner mount", "z of scans", "Calibrate where the scanner sits; see whether it is loose."),
    "laser_bias": EffectWords("range error of the scanner", "z of scans: grows away from the best stand-off",
                              "Scan at the stand-off the maker names."),
    "laser_lag": EffectWords("late profiles", "z of scans on slopes: in proportion to the scanning speed",
                             "Trigger the scanner by the robot's position, or set the lag."),
    "contact_stiffness": EffectWords("contact stiffness", "fz of press, z of profiles",
                                     "Put the stiffness into the cell: it is that of bench, tool and arm together."),
    "contact_hardening": EffectWords("hardening contact", "fz of press, z of profiles: more the deeper",
                                     "Put it into the cell; pads and seats harden under load."),
    "contact_friction": EffectWords("contact friction", "the wrench of profiles, across the peg",
                                    "Put the coefficient into the cell; clean peg and tube."),
    "gripper_compliance": EffectWords("compliance of the grip", "fz of press, z and the wrench of profiles",
                                      "Look at jaws and springs of the gripper."),
    "tube_tilt": EffectWords("tilt of the tube", f"{PROFILE}: once a turn", "Straighten the tube in its holder, or set its tilt."),
    "tube_shift": EffectWords("place of the tube", PROFILE, "Measure where the tube stands, or set its place."),
    "tube_radius": EffectWords("bore of the tube", PROFILE, "Measure the bore: this may be another tube."),
}


def words_of(effect: str) -> EffectWords:
    """The words of an effect; those of one that no catalogue names say no more than its name."""
    return EFFECTS.get(effect) or EffectWords(effect.replace("_", " "), "", "")
