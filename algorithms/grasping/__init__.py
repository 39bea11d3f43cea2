"""Grasps of objects by a hand with three fingers (sections 14.6 and 20.2 to 20.7)."""

from .arm_capsules import UR5_CAPSULES, ArmCapsules, arm_capsules
from .edge_measurement import MeasuredEdges, measure_edges
from .fuzzy import FuzzyOutput, Mamdani, grasp_controller
from .fuzzy_rules import And, Conclusion, Is, Not, Or, Rule
from .fuzzy_sets import FuzzySet, FuzzyVariable
from .fuzzy_status import FuzzyStatus
from .grasp_loop import GuidedGrasp, LoopStatus, guided_grasp, scene_obstacles
from .hands import BARRETT_BH280, BARRETT_OPENRAVE, Cover, Hand, HandTable, hand_of_table
from .image_status import ImageStatus
from .image_tracking import TrackedPose, TrackStatus, track_pose
from .obstacles import (
    CapsuleObstacle,
    MeshObstacle,
    Obstacle,
    PlaneObstacle,
    capsule_obstacle,
    mesh_obstacle,
    plane_obstacle,
)
from .planning import Grasp, GraspPlan, plan_grasps
from .pose_estimation import PoseEstimate, estimate_pose
from .pose_models import ObjectModel, View
from .pose_status import PoseStatus
from .quality import contact_wrenches, grasp_quality
from .scene import Scene, SceneCamera, SceneObject, simulate
from .scene_images import ImageSettings, scene_image, textured_background
from .silhouette_views import MeasuredSilhouettes, measure_silhouettes
from .status import GraspStatus
from .visual_grasping import GraspSettings, GraspState, GraspStep, VisualErrors, grasp_step, visual_error
from .visual_scene import GraspRun, VisualScene, random_scene, simulate_grasp
from .visual_status import GraspStage, VisualStatus

__all__ = [
    "BARRETT_BH280",
    "BARRETT_OPENRAVE",
    "UR5_CAPSULES",
    "And",
    "ArmCapsules",
    "CapsuleObstacle",
    "Conclusion",
    "Cover",
    "FuzzyOutput",
    "FuzzySet",
    "FuzzyStatus",
    "FuzzyVariable",
    "Grasp",
    "GraspPlan",
    "GraspRun",
    "GraspSettings",
    "GraspStage",
    "GraspState",
    "GraspStatus",
    "GraspStep",
    "GuidedGrasp",
    "Hand",
    "HandTable",
    "ImageSettings",
    "ImageStatus",
    "Is",
    "LoopStatus",
    "Mamdani",
    "MeasuredEdges",
    "MeasuredSilhouettes",
    "MeshObstacle",
    "Not",
    "ObjectModel",
    "Obstacle",
    "Or",
    "PlaneObstacle",
    "PoseEstimate",
    "PoseStatus",
    "Rule",
    "Scene",
    "SceneCamera",
    "SceneObject",
    "TrackStatus",
    "TrackedPose",
    "View",
    "VisualErrors",
    "VisualScene",
    "VisualStatus",
    "arm_capsules",
    "capsule_obstacle",
    "contact_wrenches",
    "estimate_pose",
    "grasp_controller",
    "grasp_quality",
    "grasp_step",
    "guided_grasp",
    "hand_of_table",
    "measure_edges",
    "measure_silhouettes",
    "mesh_obstacle",
    "plan_grasps",
    "plane_obstacle",
    "random_scene",
    "scene_image",
    "scene_obstacles",
    "simulate",
    "simulate_grasp",
    "textured_background",
    "track_pose",
    "visual_error",
]
