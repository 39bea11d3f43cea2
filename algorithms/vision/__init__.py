"""Cameras, their calibration and pose, the geometry of several views, projective invariants and depth."""

from .bal import BalProblem, read_bal, write_bal
from .batch import BatchEstimate, fundamental_matrices, homographies, localizations
from .bundle import bundle_adjust
from .bundle_descent import BundleStep
from .bundle_problem import BundleProblem
from .bundle_results import BundleAdjustment, Observations
from .calibrate import PlaneCalibration, calibrate_by_pascal, calibrate_from_planes
from .calibrations import MOTORCYCLE
from .camera import Camera
from .camera_files import read_camera, write_camera
from .colmap import ColmapCamera, ColmapImage, ColmapModel, ColmapPoint, read_colmap, write_colmap
from .completion import camera_centre, complete_points, projective_depths
from .conics import ConicThroughPoints, conic_through_points
from .distortion import Distortion
from .endoscope import calibrate_endoscope
from .essential import essential_matrices, motions_of_essential
from .factorization import Factorization, factorize
from .focal_localization import FocalLocalization, localize_unknown_focal
from .focal_motions import FocalMotion, relative_pose_unknown_focal
from .hand_eye import hand_eye, hand_eye_from_poses
from .hand_eye_results import HandEye, HandEyeOfPoses, HandEyeStatus
from .invariants import cross_ratio, invariants_3d, invariants_3d_deviation, p2_invariants, permutation_invariant
from .landmarks import LandmarkMap, Recognition
from .localization import localize
from .localization_results import Localization
from .many_views import metric_upgrade, triangulate_views
from .minimal_poses import cameras_of_four_points, poses_of_three_points
from .navigation import LandmarkPose, localize_by_landmarks
from .omnidirectional import OmnidirectionalCamera, conic_value
from .plane_motions import PlaneMotions, motions_of_plane
from .planes import homography, robust_homography
from .rectification import Rectification, rectify
from .relative_pose import RelativePose, relative_pose
from .rigs import localize_rig
from .robust import RobustEstimate
from .robust_fundamental import robust_fundamental_matrix
from .status import DegenerateError, VisionStatus
from .stereo import RectifiedPair
from .stereo_calibration import StereoCalibration, calibrate_stereo
from .tensors import (
    epipoles_of_tensor,
    quadrifocal_tensor,
    transfer_line,
    transfer_point,
    trifocal_tensor,
)
from .triangulation import Triangulation, triangulate, triangulation
from .two_views import (
    epipolar_distance,
    epipolar_lines,
    epipoles,
    fundamental_matrix,
    sampson_distance,
)
from .undistortion import undistort_image

__all__ = [
    "MOTORCYCLE",
    "BalProblem",
    "BatchEstimate",
    "BundleAdjustment",
    "BundleProblem",
    "BundleStep",
    "Camera",
    "ColmapCamera",
    "ColmapImage",
    "ColmapModel",
    "ColmapPoint",
    "ConicThroughPoints",
    "DegenerateError",
    "Distortion",
    "Factorization",
    "FocalLocalization",
    "FocalMotion",
    "HandEye",
    "HandEyeOfPoses",
    "HandEyeStatus",
    "LandmarkMap",
    "LandmarkPose",
    "Localization",
    "Observations",
    "OmnidirectionalCamera",
    "PlaneCalibration",
    "PlaneMotions",
    "Recognition",
    "Rectification",
    "RectifiedPair",
    "RelativePose",
    "RobustEstimate",
    "StereoCalibration",
    "Triangulation",
    "VisionStatus",
    "bundle_adjust",
    "calibrate_by_pascal",
    "calibrate_endoscope",
    "calibrate_from_planes",
    "calibrate_stereo",
    "camera_centre",
    "cameras_of_four_points",
    "complete_points",
    "conic_through_points",
    "conic_value",
    "cross_ratio",
    "epipolar_distance",
    "epipolar_lines",
    "epipoles",
    "epipoles_of_tensor",
    "essential_matrices",
    "factorize",
    "fundamental_matrices",
    "fundamental_matrix",
    "hand_eye",
    "hand_eye_from_poses",
    "homographies",
    "homography",
    "invariants_3d",
    "invariants_3d_deviation",
    "localizations",
    "localize",
    "localize_by_landmarks",
    "localize_rig",
    "localize_unknown_focal",
    "metric_upgrade",
    "motions_of_essential",
    "motions_of_plane",
    "p2_invariants",
    "permutation_invariant",
    "poses_of_three_points",
    "projective_depths",
    "quadrifocal_tensor",
    "read_bal",
    "read_camera",
    "read_colmap",
    "rectify",
    "relative_pose",
    "relative_pose_unknown_focal",
    "robust_fundamental_matrix",
    "robust_homography",
    "sampson_distance",
    "transfer_line",
    "transfer_point",
    "triangulate",
    "triangulate_views",
    "triangulation",
    "trifocal_tensor",
    "undistort_image",
    "write_bal",
    "write_camera",
    "write_colmap",
]
