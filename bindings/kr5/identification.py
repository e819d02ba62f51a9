"""Identification of an arm's dynamics, drives and sensors from its logs."""

from ._kr5.identification import *  # noqa: F403
