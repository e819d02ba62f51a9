"""Effects no catalogue names, to see whether a diagnosis says so: what they sit on, and which magnitudes make sense."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from . import unknown_contact as contact
from . import unknown_drives as drives
from . import unknown_sensors as sensors
from .catalogue import ALL, ARM, SENSOR, components, joints, only
from .truth import Truth


@dataclass(frozen=True)
class Unknown:
    """`bend(truth, target, magnitude, rng)` sets it."""

    id: str
    targets: Callable[[dict], list[str]]
    span: tuple[float, float]
    bend: Callable[[Truth, str, float, np.random.Generator], None]
    kinds: tuple[str, ...]


CAMERA, LASER, TUBE = only("camera"), only("laser"), only("tube")
UNKNOWN = [
    Unknown("position_friction", joints, (0.02, 3), drives.position_friction, ARM),
    Unknown("asymmetric_friction", joints, (0.02, 3), drives.asymmetric_friction, ARM),
    Unknown("quadratic_drag", joints, (0.02, 10), drives.quadratic_drag, ARM),
    Unknown("dahl_friction", joints, (0.05, 3), drives.dahl_friction, ARM),
    Unknown("break_away", joints, (0.05, 3), drives.break_away, ARM),
    Unknown("cable_jerk", joints, (0.1, 40), drives.cable_jerk, ARM),
    Unknown("current_dead_zone", joints, (0.02, 2), drives.current_dead_zone, ARM),
    Unknown("current_saturation", joints, (0.02, 0.8), drives.current_saturation, ARM),
    Unknown("current_steps", joints, (0.05, 2), drives.current_steps, ARM),
    Unknown("encoder_interpolation", joints, (1e-5, 5e-3), drives.encoder_interpolation, ARM),
    Unknown("servo_overshoot", joints, (1e-4, 0.3), drives.servo_overshoot, ARM),
    Unknown("rate_limit", joints, (0.01, 0.7), drives.rate_limit, ARM),
    Unknown("stamp_jitter", only("drives"), (1e-5, 5e-3), drives.stamp_jitter, ARM),
    Unknown("slosh", only("tool"), (0.01, 2), sensors.slosh, ARM),
    Unknown("ft_hysteresis", components, (0.5, 60), sensors.ft_hysteresis, SENSOR),
    Unknown("ft_warming", components, (0.01, 3), sensors.ft_warming, SENSOR),
    Unknown("ft_quadratic", components, (0.01, 3), sensors.ft_quadratic, SENSOR),
    Unknown("ft_turned", only("force_torque"), (1e-3, 0.4), sensors.ft_turned, SENSOR),
    Unknown("link_bending", only("links"), (1e-5, 2e-2), sensors.link_bending, ALL),
    Unknown("base_flex", only("base"), (1e-5, 1e-2), sensors.base_flex, ALL),
    Unknown("walking_base", only("base"), (1e-4, 2e-2), sensors.walking_base, ALL),
    Unknown("thin_prism", CAMERA, (1e-4, 0.5), sensors.thin_prism, ("views",)),
    Unknown("higher_distortion", CAMERA, (1e-4, 0.05), sensors.higher_distortion, ("views",)),
    Unknown("rolling_shutter", CAMERA, (0.02, 5), sensors.rolling_shutter, ("views",)),
    Unknown("corner_bias", CAMERA, (0.05, 5), sensors.corner_bias, ("views",)),
    Unknown("laser_fan", LASER, (1e-3, 0.2), sensors.laser_fan, ("scan",)),
    Unknown("laser_bow", LASER, (2e-5, 3e-3), sensors.laser_bow, ("scan",)),
    Unknown("second_reflection", LASER, (1e-4, 5e-2), sensors.second_reflection, ("scan",)),
    Unknown("contact_hysteresis", only("contact"), (0.005, 0.8), contact.contact_hysteresis, ("press",)),
    Unknown("contact_creep", only("contact"), (0.005, 0.8), contact.contact_creep, ("press",)),
    Unknown("stick_slip", only("contact"), (0.02, 3), contact.stick_slip, ("profile",)),
    Unknown("oval_tube", TUBE, (1e-4, 0.05), contact.oval_tube, ("profile",)),
    Unknown("burr", TUBE, (2e-5, 2e-3), contact.burr, ("profile",)),
    Unknown("grip_slip", only("gripper"), (2e-5, 2e-3), contact.grip_slip, ("profile",)),
    Unknown("path_creep", only("servo"), (1e-3, 0.6), contact.path_creep, ("step", "press")),
    Unknown("path_rate_limit", only("servo"), (5e-3, 0.5), contact.path_rate_limit, ("step", "press")),
]
UNKNOWN_BY_ID = {kind.id: kind for kind in UNKNOWN}
