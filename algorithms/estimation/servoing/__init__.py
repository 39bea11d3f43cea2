"""A hand that is guided by the images of two cameras which are not calibrated (section 14.6)."""

from .scene import GraspRun, VisualScene, random_scene, simulate_grasp
from .status import GraspStage, VisualStatus
from .steps import GraspSettings, GraspState, GraspStep, VisualErrors, grasp_step, visual_error

__all__ = [
    "GraspRun",
    "GraspSettings",
    "GraspStage",
    "GraspState",
    "GraspStep",
    "VisualErrors",
    "VisualScene",
    "VisualStatus",
    "grasp_step",
    "random_scene",
    "simulate_grasp",
    "visual_error",
]
