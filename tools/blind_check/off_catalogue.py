"""Effects no catalogue names, to see whether a diagnosis says so: what they sit on, and which magnitudes make sense."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from . import off_catalogue_contact as contact
from . import off_catalogue_drives as drives
from . import off_catalogue_sensors as sensors
from .catalogue import ALL, ARM, SENSOR, components, joints, single_target
from .truth import Truth


@dataclass(frozen=True)
class OffCatalogueEffect:
    """`bend(truth, target, magnitude, rng)` sets it."""

    id: str
    targets: Callable[[dict], list[str]]
    span: tuple[float, float]
    bend: Callable[[Truth, str, float, np.random.Generator], None]
    kinds: tuple[str, ...]


CAMERA, LASER, TUBE = single_target("camera"), single_target("laser"), single_target("tube")
OFF_CATALOGUE = [
    OffCatalogueEffect("asymmetric_friction", joints, (0.02, 3), drives.asymmetric_friction, ARM),
    OffCatalogueEffect("dahl_friction", joints, (0.05, 3), drives.dahl_friction, ARM),
    OffCatalogueEffect("break_away", joints, (0.05, 3), drives.break_away, ARM),
    OffCatalogueEffect("cable_jerk", joints, (0.1, 40), drives.cable_jerk, ARM),
    OffCatalogueEffect("current_dead_zone", joints, (0.02, 2), drives.current_dead_zone, ARM),
    OffCatalogueEffect("current_saturation", joints, (0.02, 0.8), drives.current_saturation, ARM),
    OffCatalogueEffect("current_steps", joints, (0.05, 2), drives.current_steps, ARM),
    OffCatalogueEffect("encoder_interpolation", joints, (1e-5, 5e-3), drives.encoder_interpolation, ARM),
    OffCatalogueEffect("servo_overshoot", joints, (1e-4, 0.3), drives.servo_overshoot, ARM),
    OffCatalogueEffect("rate_limit", joints, (0.01, 0.7), drives.rate_limit, ARM),
    OffCatalogueEffect("stamp_jitter", single_target("drives"), (1e-5, 5e-3), drives.stamp_jitter, ARM),
    OffCatalogueEffect("slosh", single_target("tool"), (0.01, 2), sensors.slosh, ARM),
    OffCatalogueEffect("ft_hysteresis", components, (0.5, 60), sensors.ft_hysteresis, SENSOR),
    OffCatalogueEffect("ft_warming", components, (0.01, 3), sensors.ft_warming, SENSOR),
    OffCatalogueEffect("ft_quadratic", components, (0.01, 3), sensors.ft_quadratic, SENSOR),
    OffCatalogueEffect("ft_turned", single_target("force_torque"), (1e-3, 0.4), sensors.ft_turned, SENSOR),
    OffCatalogueEffect("link_bending", single_target("links"), (1e-5, 2e-2), sensors.link_bending, ALL),
    OffCatalogueEffect("base_flex", single_target("base"), (1e-5, 1e-2), sensors.base_flex, ALL),
    OffCatalogueEffect("walking_base", single_target("base"), (1e-4, 2e-2), sensors.walking_base, ALL),
    OffCatalogueEffect("thin_prism", CAMERA, (1e-4, 0.5), sensors.thin_prism, ("views",)),
    OffCatalogueEffect("higher_distortion", CAMERA, (1e-4, 0.05), sensors.higher_distortion, ("views",)),
    OffCatalogueEffect("rolling_shutter", CAMERA, (0.02, 5), sensors.rolling_shutter, ("views",)),
    OffCatalogueEffect("corner_bias", CAMERA, (0.05, 5), sensors.corner_bias, ("views",)),
    OffCatalogueEffect("laser_fan", LASER, (1e-3, 0.2), sensors.laser_fan, ("scan",)),
    OffCatalogueEffect("laser_bow", LASER, (2e-5, 3e-3), sensors.laser_bow, ("scan",)),
    OffCatalogueEffect("second_reflection", LASER, (1e-4, 5e-2), sensors.second_reflection, ("scan",)),
    OffCatalogueEffect(
        "contact_hysteresis", single_target("contact"), (0.005, 0.8), contact.contact_hysteresis, ("press",)
    ),
    OffCatalogueEffect("contact_creep", single_target("contact"), (0.005, 0.8), contact.contact_creep, ("press",)),
    OffCatalogueEffect("stick_slip", single_target("contact"), (0.02, 3), contact.stick_slip, ("profile",)),
    OffCatalogueEffect("oval_tube", TUBE, (1e-4, 0.05), contact.oval_tube, ("profile",)),
    OffCatalogueEffect("burr", TUBE, (2e-5, 2e-3), contact.burr, ("profile",)),
    OffCatalogueEffect("grip_slip", single_target("gripper"), (2e-5, 2e-3), contact.grip_slip, ("profile",)),
    OffCatalogueEffect("path_creep", single_target("servo"), (1e-3, 0.6), contact.path_creep, ("step", "press")),
    OffCatalogueEffect(
        "path_rate_limit", single_target("servo"), (5e-3, 0.5), contact.path_rate_limit, ("step", "press")
    ),
]
OFF_CATALOGUE_BY_ID = {kind.id: kind for kind in OFF_CATALOGUE}
