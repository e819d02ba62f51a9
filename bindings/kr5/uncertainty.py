"""What a covariance or a count allows one to say."""

from ._kr5.uncertainty import *  # noqa: F403
