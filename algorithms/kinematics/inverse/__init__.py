"""Inverse kinematics of serial arms: all configurations that reach a pose."""

from .redundant import elbow_angle
from .solutions import Solutions, Status
from .solve import inverse

__all__ = ["Solutions", "Status", "elbow_angle", "inverse"]
