"""Grasps of objects by a hand with three fingers (sections 20.2 to 20.7)."""

from ..moved import moved
from .forces import ContactForces, ForceStatus, contact_forces
from .grasp_loop import GuidedGrasp, LoopStatus, guided_grasp, scene_obstacles
from .hands import BARRETT_BH280, BARRETT_OPENRAVE, Cover, Hand, HandTable, hand_of_table
from .planning import Grasp, GraspPlan, plan_grasps
from .quality import contact_wrenches, grasp_quality
from .status import GraspStatus

__all__ = [
    "BARRETT_BH280",
    "BARRETT_OPENRAVE",
    "ContactForces",
    "Cover",
    "ForceStatus",
    "Grasp",
    "GraspPlan",
    "GraspStatus",
    "GuidedGrasp",
    "Hand",
    "HandTable",
    "LoopStatus",
    "contact_forces",
    "contact_wrenches",
    "grasp_quality",
    "guided_grasp",
    "hand_of_table",
    "plan_grasps",
    "scene_obstacles",
]

__getattr__ = moved(
    __name__,
    {
        "algorithms.estimation.servoing": """
            GraspRun GraspSettings GraspStage GraspState GraspStep VisualErrors VisualScene VisualStatus
            grasp_step random_scene simulate_grasp visual_error
        """,
        "algorithms.fuzzy": """
            And Conclusion FuzzyOutput FuzzySet FuzzyStatus FuzzyVariable Is Mamdani Not Or Rule
            grasp_controller
        """,
        "algorithms.kinematics.collisions": """
            ArmCapsules CapsuleObstacle MeshObstacle Obstacle PlaneObstacle UR5_CAPSULES arm_capsules
            capsule_obstacle mesh_obstacle plane_obstacle
        """,
        "algorithms.vision.objects": """
            ImageSettings ImageStatus MeasuredEdges MeasuredSilhouettes ObjectModel PoseEstimate PoseStatus
            Scene SceneCamera SceneObject TrackStatus TrackedPose View estimate_pose measure_edges
            measure_silhouettes scene_image simulate textured_background track_pose
        """,
    },
)
