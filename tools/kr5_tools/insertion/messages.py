"""How an insertion ended, in words, and what a user can do about it."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from types import SimpleNamespace

    import kr5.sim

# Reason: what happened, what to do.
REASONS = {
    "none": ("it did not end", "allow more time"),
    "peg_too_wide": (
        "the assumed peg is wider than the assumed bore",
        "a larger --clearance, or correct peg.radius and tube.inner_radius of the cell",
    ),
    "unstable_gain": (
        "a gain of the force loop is too high for the delay of the loop",
        "lower contact.stiffness or a quicker servo.tool in the cell",
    ),
    "no_contact": (
        "no contact at the assumed height of the face of the tube",
        "check tube.T_B_T of the cell, and --offset: the tube must be under the peg",
    ),
    "obstructed": (
        "the peg touched something above the assumed face of the tube",
        "look for what is in the way; check tube.T_B_T of the cell",
    ),
    "profile_flat": ("the profile of the turn shows no direction to the hole", "tilt the peg more (--tilt 15)"),
    "no_drop": (
        "the peg slid to its limit without dropping into the bore",
        (
            "the fit of the whole profile (--strategy profile_fit), a tilt near 15 degrees, or an --offset within one"
            " radius of the peg"
        ),
    ),
    "blocked": (
        "the peg found the mouth of the bore but did not go deeper",
        "more --clearance, or another drive (--insert-by)",
    ),
    "force": (
        "the force on the peg exceeded its limit",
        "see the plot of forces (-o PAGE.html): a contact at too high a speed, or a jammed peg",
    ),
    "torque": (
        "the torque on the peg exceeded its limit",
        "see the plot of forces (-o PAGE.html): a jammed peg; use more --clearance",
    ),
    "current": ("a motor current exceeded its limit", "check for a posture near a singularity with kr5 replay"),
    "sensor_dead": (
        "the force sensor repeated exactly the same values for too long",
        "check its connection; in simulation, give the cell noise.force",
    ),
    "sensor_saturated": ("the force sensor is saturated", "a slower contact, or a sensor with a larger range"),
    "peg_lost": ("the gripper reports that it holds no part", "check grip and magazine"),
    "out_of_reach": (
        "the arm ran out of joint range",
        "move the tube (tube.T_B_T of the cell) into reach, or tilt less",
    ),
    "time_out": ("the time limit was exceeded", "check which phase takes too long"),
}


def ending_text(peg: "kr5.sim.PegOutcome | SimpleNamespace") -> tuple[str, str]:
    """Whether a peg is in, and the rest of that sentence; one more on what to do about one that is not."""
    phase, reason, number = str(peg.phase), str(peg.reason), peg.attempts
    if peg.inserted:
        return "inserted", f"at attempt {number}, {1e3 * peg.depth:.1f} mm deep, after {peg.time:.1f} s."
    if reason == "inserted":
        return (
            "not inserted",
            (
                f"the controller assumed it to be in after the {phase} phase (attempt {number}), but its bottom is"
                f" {1e3 * peg.depth:.1f} mm below the face and not in the bore. Possible remedy: see its path"
                " (-o PAGE.html); correct tube.T_B_T of the cell or --offset."
            ),
        )
    what, remedy = REASONS.get(reason, (reason, "see the plots (-o PAGE.html)"))
    return "not inserted", f"{what} in the {phase} phase (attempt {number}). Possible remedy: {remedy}."


def ending_sentence(number: int, peg: "kr5.sim.PegOutcome | SimpleNamespace") -> str:
    """How a peg ended; pegs are numbered from 1."""
    word, text = ending_text(peg)
    return f"Peg {number} {word}{' ' if peg.inserted else ': '}{text}"
