"""Grasps of objects by a hand with three fingers (sections 14.6 and 20.2 to 20.7)."""

from .hands import BARRETT_BH280, BARRETT_OPENRAVE, Hand, HandTable, hand_of_table
from .planning import Grasp, GraspPlan, plan_grasps
from .quality import contact_wrenches, grasp_quality
from .status import GraspStatus

__all__ = [
    "BARRETT_BH280",
    "BARRETT_OPENRAVE",
    "Grasp",
    "GraspPlan",
    "GraspStatus",
    "Hand",
    "HandTable",
    "contact_wrenches",
    "grasp_quality",
    "hand_of_table",
    "plan_grasps",
]
