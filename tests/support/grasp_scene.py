"""A UR5 with a hand, a box and two cameras, for tests of the loop from images to a grasp."""

import numpy as np

from algorithms.kinematics import Robot
from algorithms.vision import Camera, Distortion
from algorithms.vision.objects.pose_models import ObjectModel
from algorithms.vision.objects.scene import Scene, SceneCamera, SceneObject
from generated import pga3
from tests.support.scans import box

TARGET = np.array([0.4, 0.1, 0.15])
HOME = np.array([0.0, -1.2, 1.5, -0.5, 1.0, 0.0])
VERTICES, FACES = box(0.05, 0.07, 0.09)
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * VERTICES.max(0)
EDGES = [[a, b] for k, a in enumerate(CORNERS) for b in CORNERS[k + 1 :] if (a != b).sum() == 1]
MODEL = ObjectModel.of(points=CORNERS, edges=EDGES)


def motor(turn, shift):
    return pga3.motor_from_rotation_vector_translation(np.array(turn, float), np.array(shift, float))


MOUNT = motor((0, 0, 0), (0, 0, 0.05))


def looking(at, place):
    """The pose of a camera at a place that looks at a point, with the image upright."""
    z = (np.array(at) - place) / np.linalg.norm(np.array(at) - place)
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    whole = np.eye(4)
    whole[:3, :3], whole[:3, 3] = np.column_stack([x, np.cross(z, x), z]), place
    return pga3.motor_from_matrix(whole)


def cameras(distortion=0.0):
    places = np.array([1.0, -0.3, 0.6]), np.array([0.9, 0.5, 0.6])
    return tuple(
        SceneCamera(
            Camera.from_intrinsics(
                1000.0,
                (320.0, 240.0),
                looking(TARGET, place),
                distortion=Distortion("brown", (distortion,)) if distortion else None,
            )
        )
        for place in places
    )


def pose(rng):
    return motor(rng.normal(size=3), TARGET + rng.uniform(-0.05, 0.05, 3))


def scene(at, more=(), distortion=0.0):
    thing = SceneObject("box", MODEL, at, VERTICES, FACES)
    return Scene(cameras(distortion), (thing, *more), Robot.named("ur5"), HOME)
