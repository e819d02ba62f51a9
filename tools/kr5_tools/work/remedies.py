"""What a person does about a job that has stopped, or cannot go on."""

from pathlib import Path

from kr5 import job

STOPS = {
    "force": "look what the tool pressed on, and whether the tube stands where the cell says",
    "torque": "look what the tool pressed on, and whether the tube stands where the cell says",
    "current": "look whether the arm is blocked, and whether the tool is heavier than the cell says",
    "sensor_dead": "check the cable and the supply of the force sensor",
    "sensor_saturated": "free the tool, and check the range of the force sensor",
    "speed": "check the limits of motion against those of the stop",
    "workspace": "move the arm back into its workspace",
    "time_out": "look what the phase waited for: its limits stand in `kr5 job phases`",
    "lost_link": "check the link to the controller",
    "operator": "a person stopped it",
    "journal": "check that the disk has room, and that the journal can be written",
    "obstructed": "take away what the tool met, and look whether stand and tube stand where the cell says",
    "unreachable": "move bin, stand or tube nearer to the arm",
    "robot": "read on the controller why the robot stands",
    "cell_fault": "make the cell as it is believed: gripper, load, joints, workspace",
    "exhausted": "look why the phase failed that often: its outcomes stand in `kr5 job show`",
}

CELL_FAULTS = {
    "numbers": "a reading holds no finite numbers; check link, drives and force sensor",
    "joints": "the joints are outside their limits: degrees where radians are expected, or another arm?",
    "pose": (
        "the robot tells another pose of its tool than its joints give by the arm of the cell; compare signs and zeros"
        " of the axes, the tool and the base on the controller with the cell (`kr5 rsi doctor --cell`)"
    ),
    "workspace": "the tool is outside the workspace; move the arm back into it",
    "loaded": "something pushes the tool; free it, and check the weight of the tool in the cell",
    "grip": "the gripper holds something, or nothing, otherwise than the journal says",
    "station": "a pellet is on the stand that should not be; take it away",
    "tube": (
        "a pellet stands out of the tube or is stuck in it, or more are in it than can be; take it out, or push it in"
        " and count with --in-tube N"
    ),
}

FINDINGS = {
    "pose_invalid": "the robot tells no pose; check the link and the drives",
    "grip_unexpected": "the gripper holds something that the journal does not know; take it out",
    "station_occupied": "a pellet is on the stand that should not be; take it away",
    "tube_count": "the tube holds another number of pellets than can be; count again",
    "tube_stuck": "a pellet stands out of the tube or is stuck in it; take it out, or push it in",
    "station_unseen": "look whether a pellet is on the stand, and say it with --stand full or --stand empty",
    "tube_unseen": "count the pellets in the tube, and say it with --in-tube N",
}


def words(value: object) -> str:
    return str(value).replace("_", " ")


def release_command(journal: Path | None) -> str:
    """What releases the stop of a job."""
    return f'`kr5 job release {journal} --person "NAME"`'


def stop_text(state: job.JobState, journal: Path | None) -> str:
    """Why the arm stands, and what leads on."""
    remedy = CELL_FAULTS.get(str(state.cell_fault)) or STOPS[str(state.stop)]
    text = f"Stopped by {words(state.stop)} in the phase {words(state.stopped_in)}: {remedy}."
    if journal is None:
        return text
    return f"{text} Then release it with {release_command(journal)}, and start again."


def refusal_text(decision: job.RestartDecision, journal: Path | None) -> str:
    """Why a job cannot go on, and what leads on."""
    if decision.status == job.RestartStatus.Latched:
        return (
            f"The job is stopped by {words(decision.stop)}: {STOPS[str(decision.stop)]}. A person releases it with"
            f" {release_command(journal)}."
        )
    return f"The job cannot go on: {FINDINGS[str(decision.finding)]}."
