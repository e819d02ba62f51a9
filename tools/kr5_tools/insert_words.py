"""How an insertion ended, in words, and what a user can do about it."""

from typing import Any

# Reason: what happened, what to do.
REASONS = {
    "none": ("it did not come to an end", "give it more time"),
    "peg_too_wide": ("the peg is wider than the bore, as both are believed", "a larger --clearance, or mend peg.radius and tube.inner_radius of the cell"),
    "unstable_gain": ("a gain of the force loop is more than the delay of the loop bears", "lower contact.stiffness or a quicker servo.tool in the cell"),
    "no_contact": ("nothing was touched where the face of the tube should be", "check tube.T_B_T of the cell, and --offset: the tube must be under the peg"),
    "profile_flat": ("what was felt all round showed no direction to the hole", "tilt the peg more (--tilt 15)"),
    "no_drop": ("it slid as far as it may and never dropped into the bore",
                "the fit of the whole profile (--strategy felt), a tilt near 15 degrees, or an --offset within one radius of the peg"),
    "blocked": ("it found the mouth of the bore and went no deeper", "more --clearance, or another way to push (--insert-by)"),
    "force": ("the force on the peg passed its limit", "look at the plot of forces (-o PAGE.html): a touch that is too fast, or a peg that jams"),
    "torque": ("the torque on the peg passed its limit", "look at the plot of forces (-o PAGE.html): the peg jams; more --clearance"),
    "current": ("a motor current passed its limit", "look for a posture near a singularity: kr5 replay shows it"),
    "sensor_dead": ("the force sensor told the same to the last bit for too long", "check its connection; in simulation, give the cell noise.force"),
    "sensor_saturated": ("the force sensor is at its limit", "a gentler touch, or a sensor of more range"),
    "peg_lost": ("the grip says it holds nothing", "check grip and magazine"),
    "out_of_reach": ("the arm cannot follow: no posture within its limits", "move the tube (tube.T_B_T of the cell) into reach, or tilt less"),
    "time_out": ("it took longer than it may", "look at the phases above for the one that takes too long"),
}


def ending(peg: Any) -> tuple[str, str]:
    """Whether a peg is in, and a sentence on it; one more on what to do about one that is not."""
    phase, reason, number = str(peg.phase), str(peg.reason), peg.attempts
    if peg.inserted:
        return "inserted", f"at attempt {number}, {1e3 * peg.depth:.1f} mm deep, after {peg.time:.1f} s."
    if reason == "inserted":
        return "not inserted", (f"believed to be in after phase {phase}, but the peg's bottom is {1e3 * peg.depth:.1f} mm below the face and not where it "
                                "should be. What may help: look at its path (-o PAGE.html); mend tube.T_B_T of the cell or --offset.")
    what, remedy = REASONS.get(reason, (reason, "look at the plots (-o PAGE.html)"))
    attempts = f"{number} attempt" + ("s" if number != 1 else "")
    return "not inserted", f"after {attempts}, last in phase {phase}: {what}. What may help: {remedy}."
