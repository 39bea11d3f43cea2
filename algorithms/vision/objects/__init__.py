"""Poses of objects: models, what cameras see of them, estimates from images, tracking, and simulated scenes."""

from .edge_measurement import MeasuredEdges, measure_edges
from .image_status import ImageStatus
from .image_tracking import TrackedPose, TrackStatus, track_pose
from .pose_estimation import PoseEstimate, estimate_pose
from .pose_models import ObjectModel, SharedErrors, View
from .pose_status import PoseStatus
from .scene import Scene, SceneCamera, SceneObject, simulate
from .scene_images import ImageSettings, scene_image, textured_background
from .silhouette_views import MeasuredSilhouettes, measure_silhouettes

__all__ = [
    "ImageSettings",
    "ImageStatus",
    "MeasuredEdges",
    "MeasuredSilhouettes",
    "ObjectModel",
    "PoseEstimate",
    "PoseStatus",
    "Scene",
    "SceneCamera",
    "SceneObject",
    "SharedErrors",
    "TrackStatus",
    "TrackedPose",
    "View",
    "estimate_pose",
    "measure_edges",
    "measure_silhouettes",
    "scene_image",
    "simulate",
    "textured_background",
    "track_pose",
]
