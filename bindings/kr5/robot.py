"""Readings and commands of a robot, what turns sensors into readings, and a loopback robot for tests."""

from ._kr5.robot import *  # noqa: F403
