"""KUKA's RobotSensorInterface: telegrams, files for the controller, the link, an emulated controller, results
between computers."""

from ._kr5.rsi import *  # noqa: F403
