"""How a controller counts its axes beside the joints of a cell, in words and numbers for people."""

import math

import kr5.robot
from kr5 import rsi

from kr5_tools.cli.numbers import format_number

MAPPING_COLUMNS = ["axis", "direction", "zero [deg]"]
ARM_AXES = 6


def find_mapping(
    seen: rsi.LinkObservations, layout: rsi.TelegramLayout, model: kr5.robot.SensorModel
) -> rsi.AxisMappingResult | None:
    """Directions and zeros of the controller's axes by what it told; None where that cannot be asked: for another arm,
    or a layout without axis values or pose."""
    joints = model.arm.joints
    if len(joints) != ARM_AXES or any(str(joint.type) != "revolute" for joint in joints):
        return None
    rows = rsi.axis_pose_rows(seen, layout)
    return rsi.find_axis_mapping(rows, model) if rows else None


def mapping_sentence(result: rsi.AxisMappingResult) -> str:
    """What the search says."""
    sentence = STATUS_WORDS[str(result.status)]
    if str(result.status) == "not_moved":
        sentence = f"{', '.join(result.unmoved)} did not move; {sentence}"
    if result.mappings and not result.frames_known:
        sentence += (
            f"; active tool and base are not those of the cell, which leaves the zeros of"
            f" {' and '.join(result.free_zeros)} open"
        )
    return sentence


def mapping_text(mapping: rsi.AxisMapping) -> str:
    """Directions and zeros as one line of YAML [-, rad]."""
    sign = ", ".join(f"{value:.0f}" for value in mapping.axes.sign)
    zero = ", ".join(f"{float(value)!r}" for value in mapping.axes.zero)
    return f"{{sign: [{sign}], zero: [{zero}]}}"


def settings_text(mapping: rsi.AxisMapping) -> str:
    """The file that tells it to the commands of this group, by --settings."""
    return f"format: kr5-rsi-settings/1\naxes: {mapping_text(mapping)}  # [-], [rad]; a file for --settings"


def mapping_rows(mapping: rsi.AxisMapping) -> list[list[object]]:
    """A row an axis."""
    return [
        [f"A{i + 1}", "as the joint" if sign > 0 else "turned", format_number(math.degrees(zero))]
        for i, (sign, zero) in enumerate(zip(mapping.axes.sign, mapping.axes.zero))
    ]


def is_as_joints(mapping: rsi.AxisMapping) -> bool:
    """Whether the controller counts as the joints do."""
    return bool((mapping.axes.sign == 1).all() and (mapping.axes.zero == 0).all())


STATUS_WORDS = {
    "found": "directions and zeros of the axes follow from the poses told",
    "ambiguous": "several directions and zeros fit the poses told; move all axes farther while listening",
    "not_moved": "directions and zeros are sure only once each axis moves by 10 degrees or more while listening",
    "nothing_fits": "no directions, and no zeros at quarter turns, make the axis values fit the poses told; the arm is"
    " another one than that of the cell",
    "too_few_rows": "too few different postures came to find directions and zeros of the axes; move the arm while"
    " listening",
}
