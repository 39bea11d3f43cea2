"""Grasps of objects by hands with two or more fingers (sections 20.2 to 20.7)."""

from ..moved import moved
from .barrett import BARRETT_BH280, BARRETT_OPENRAVE, Cover, HandTable, hand_of_table
from .forces import ContactForces, ForceStatus, contact_forces
from .grasp_loop import GuidedGrasp, LoopStatus, guided_grasp, scene_obstacles
from .hand_texts import ALLEGRO, FRANKA_HAND, ROBOTIQ_2F_85
from .hands import Capsules, Fingertips, Hand
from .planning import Grasp, GraspPlan, plan_grasps
from .quality import contact_wrenches, grasp_quality
from .status import GraspStatus
from .touching import ClosedHand, ClosingStatus, close_hand
from .urdf_hands import hand_from_urdf
from .view_plans import plan_grasps_in_view

__all__ = [
    "ALLEGRO",
    "BARRETT_BH280",
    "BARRETT_OPENRAVE",
    "FRANKA_HAND",
    "ROBOTIQ_2F_85",
    "Capsules",
    "ClosedHand",
    "ClosingStatus",
    "ContactForces",
    "Cover",
    "Fingertips",
    "ForceStatus",
    "Grasp",
    "GraspPlan",
    "GraspStatus",
    "GuidedGrasp",
    "Hand",
    "HandTable",
    "LoopStatus",
    "close_hand",
    "contact_forces",
    "contact_wrenches",
    "grasp_quality",
    "guided_grasp",
    "hand_from_urdf",
    "hand_of_table",
    "plan_grasps",
    "plan_grasps_in_view",
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
    {
        "algorithms.estimation.servoing": """
            visual_grasping=steps visual_pictures=pictures visual_scene=scene visual_status=status
        """,
        "algorithms.fuzzy": """
            fuzzy=mamdani fuzzy_base=base fuzzy_inputs=inputs fuzzy_pictures=pictures fuzzy_program=program
            fuzzy_ramps=ramps fuzzy_rules=rules fuzzy_sets=sets fuzzy_status=status fuzzy_tables=tables fuzzy_text=text
            fuzzy_workspace=workspace
        """,
        "algorithms.kinematics.collisions": "arm_capsules arm_paths clear_motion moving_arm obstacles",
        "algorithms.vision.objects": """
            edge_measurement image_arguments image_status image_tracking pictures_of_images pictures_of_scenes
            pose_estimation pose_features pose_images pose_judgement pose_minima pose_models pose_pictures pose_record
            pose_starts pose_status predicted_curves scene scene_images scene_silhouettes silhouette_fits
            silhouette_starts silhouette_views silhouettes surface_rays tracked_errors
        """,
    },
)
