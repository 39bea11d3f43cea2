"""Inverse kinematics of serial arms: all configurations that reach a pose."""

from .redundant import elbow_angle
from .self_motion import SelfMotion, self_motions
from .solutions import Solutions, Status
from .solve import inverse, single_pose

__all__ = ["SelfMotion", "Solutions", "Status", "elbow_angle", "inverse", "self_motions", "single_pose"]
