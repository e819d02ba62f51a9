"""KUKA's RobotSensorInterface: telegrams, files for the controller, the link, results between computers."""

from ._kr5.rsi import *  # noqa: F403
