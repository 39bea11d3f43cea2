"""Grasps of objects by a hand with three fingers (sections 14.6 and 20.2 to 20.7)."""

from .hands import BARRETT_BH280, BARRETT_OPENRAVE, Hand, HandTable, hand_of_table
from .planning import Grasp, GraspPlan, plan_grasps
from .pose_estimation import PoseEstimate, estimate_pose
from .pose_models import ObjectModel, View
from .pose_status import PoseStatus
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
    "ObjectModel",
    "PoseEstimate",
    "PoseStatus",
    "View",
    "contact_wrenches",
    "estimate_pose",
    "grasp_quality",
    "hand_of_table",
    "plan_grasps",
]
