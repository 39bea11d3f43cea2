"""A UR5 with a Barrett hand, a scan of a real object with marked points on a table, and two cameras."""

import numpy as np

from algorithms.grasping import plan_grasps
from algorithms.kinematics import Robot
from algorithms.kinematics.collisions import mesh_obstacle, plane_obstacle
from algorithms.vision.objects import ObjectModel, Scene, SceneObject
from tests.support.grasp_scene import HOME, cameras, motor
from tests.support.scans import scan

MARKS = 60
MOUNT = motor((0, 0, 0), (0, 0, 0.0754))
"""The base of the hand is at the flange of the arm."""
TABLE = plane_obstacle([0, 0, 1], [0, 0, 0])
PLACE = np.array([0.42, 0.1, 0.0])


def marks(vertices, count=MARKS):
    """Return vertices that are far from each other."""
    chosen = [0]
    distance = np.linalg.norm(vertices - vertices[0], axis=1)
    for _ in range(count - 1):
        chosen.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(vertices - vertices[chosen[-1]], axis=1))
    return vertices[chosen]


def standing(vertices, rng):
    """Return a pose in which the object stands on the table, turned and displaced at random."""
    lowest = vertices[:, 2].min()
    shift = np.append(PLACE[:2] + rng.uniform(-0.08, 0.08, 2), 0.001 - lowest)
    return motor((0, 0, rng.uniform(-np.pi, np.pi)), shift)


def grasps_of(name):
    """Return grasps of all styles, the best first, and the mesh as an obstacle."""
    vertices, faces = scan(name)
    table = plane_obstacle([0, 0, 1], [0, 0, vertices[:, 2].min() - 0.001])
    plans = [plan_grasps(vertices, faces, style, count=6, obstacles=[table]) for style in (1, 2, 3)]
    found = [grasp for plan in plans for grasp in plan]
    return sorted(found, key=lambda one: -one.quality), mesh_obstacle(vertices, faces)


def scene_of(name, pose, more=()):
    vertices, faces = scan(name)
    model = ObjectModel.of(points=marks(vertices))
    return Scene(cameras(), (SceneObject(name, model, pose, vertices, faces), *more), Robot.named("ur5"), HOME), model
