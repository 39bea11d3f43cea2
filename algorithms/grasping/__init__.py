"""Grasps of objects by a hand with three fingers (sections 14.6 and 20.2 to 20.7)."""

from .grasp_loop import GuidedGrasp, LoopStatus, guided_grasp
from .hands import BARRETT_BH280, BARRETT_OPENRAVE, Hand, HandTable, hand_of_table
from .planning import Grasp, GraspPlan, plan_grasps
from .pose_estimation import PoseEstimate, estimate_pose
from .pose_models import ObjectModel, View
from .pose_status import PoseStatus
from .quality import contact_wrenches, grasp_quality
from .scene import Scene, SceneCamera, SceneObject, simulate
from .status import GraspStatus

__all__ = [
    "BARRETT_BH280",
    "BARRETT_OPENRAVE",
    "Grasp",
    "GraspPlan",
    "GraspStatus",
    "GuidedGrasp",
    "Hand",
    "HandTable",
    "LoopStatus",
    "ObjectModel",
    "PoseEstimate",
    "PoseStatus",
    "Scene",
    "SceneCamera",
    "SceneObject",
    "View",
    "contact_wrenches",
    "estimate_pose",
    "grasp_quality",
    "guided_grasp",
    "hand_of_table",
    "plan_grasps",
    "simulate",
]
