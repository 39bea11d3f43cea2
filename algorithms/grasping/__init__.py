"""Grasps of objects by a hand with three fingers (sections 14.6 and 20.2 to 20.7)."""

from .status import GraspStatus

__all__ = ["GraspStatus"]
