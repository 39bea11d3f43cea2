"""Arms as capsules, obstacles, and motions that are clear of them at every moment."""

from .arm_capsules import UR5_CAPSULES, ArmCapsules, arm_capsules
from .described import capsules_from_urdf
from .obstacles import (
    CapsuleObstacle,
    MeshObstacle,
    Obstacle,
    PlaneObstacle,
    capsule_obstacle,
    mesh_obstacle,
    plane_obstacle,
)

__all__ = [
    "UR5_CAPSULES",
    "ArmCapsules",
    "CapsuleObstacle",
    "MeshObstacle",
    "Obstacle",
    "PlaneObstacle",
    "arm_capsules",
    "capsule_obstacle",
    "capsules_from_urdf",
    "mesh_obstacle",
    "plane_obstacle",
]
