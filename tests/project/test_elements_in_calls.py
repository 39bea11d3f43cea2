"""Public functions that no call of `test_elements_everywhere` reaches, with elements of every layout."""

from __future__ import annotations

import pickle
import warnings
from typing import Any

import elements_everywhere
import numpy as np
import pytest

from algorithms import mapping, vision
from algorithms.kinematics import Robot
from algorithms.kinematics.collisions import capsule_obstacle, mesh_obstacle, plane_obstacle

RNG = np.random.default_rng(3)
POINTS = RNG.normal(size=(12, 3))
NORMALS = POINTS[:6] / np.linalg.norm(POINTS[:6], axis=-1, keepdims=True)
SPHERE = RNG.normal(size=(60, 3))
SPHERE /= np.linalg.norm(SPHERE, axis=-1, keepdims=True)
SIDE = np.linspace(0, 1, 30)
BOX = np.concatenate([np.stack([SIDE, 0 * SIDE], -1), np.stack([1 + 0 * SIDE, SIDE], -1)])
WALLS = np.array([[[0.0, 0], [1, 0]], [[1, 0], [1, 2]]])
INTRINSICS = np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]])
PLACES = [np.array([0.1, 0.2, 5]), np.array([-1, 0.2, 5]), np.array([-0.1, 0.9, 5]), np.array([0.5, -0.5, 6])]
TURNS = [np.linalg.qr(np.eye(3) + 0.2 * RNG.normal(size=(3, 3)))[0] for _ in PLACES]
CAMERAS = [INTRINSICS @ np.c_[turn, place] for turn, place in zip(TURNS, PLACES, strict=True)]
PIXELS = [(h := np.c_[POINTS, np.ones(12)] @ camera.T)[:, :2] / h[:, 2:] for camera in CAMERAS]
FUNDAMENTAL = vision.fundamental_matrix(PIXELS[0], PIXELS[1])
HOMOGRAPHY = np.array([[1, 0.1, 3], [0, 1.1, 2], [1e-4, 0, 1]])
CUBE = np.pad(np.ones((4, 4, 4), bool), 1)
EDGES = np.array([1.0, 1.0, 2.0])
MOTOR = np.array([1.0, 0, 0, 0, 0.1, 0, 0, 0])
POSE = np.array([np.cos(0.3), np.sin(0.3), 0.2, 0.3])
ARM = Robot.named("puma560")
SEGMENTS = np.stack([POINTS, POINTS + 1], 1)
CAPSULE, PLANE = capsule_obstacle([0, 0, 0], [0, 0, 1], 0.5), plane_obstacle([0, 0, 1], [0, 0, 0])
MESH = mesh_obstacle(np.eye(4)[:, :3], [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])

CALLS: dict[str, tuple[Any, ...]] = {
    "estimation.orientation": (0.1 * POINTS, POINTS),
    "grasping.contact_forces": (NORMALS, -NORMALS, np.array([0, 0, 0, 0, 0, 1.0]), 0.5, 8, np.zeros(3)),
    "kinematics.Robot.forward": (ARM, np.full(6, 0.3)),
    "kinematics.Robot.inverse": (ARM, ARM.forward(np.full(6, 0.3))),
    "kinematics.Robot.with_base": (ARM, MOTOR),
    "kinematics.collisions.CapsuleObstacle.clearance": (CAPSULE, SEGMENTS, np.ones(12)),
    "kinematics.collisions.CapsuleObstacle.contains": (CAPSULE, POINTS),
    "kinematics.collisions.CapsuleObstacle.moved": (CAPSULE, MOTOR),
    "kinematics.collisions.MeshObstacle.clearance": (MESH, SEGMENTS, np.ones(12)),
    "kinematics.collisions.MeshObstacle.contains": (MESH, POINTS),
    "kinematics.collisions.PlaneObstacle.clearance": (PLANE, SEGMENTS, np.ones(12)),
    "kinematics.collisions.PlaneObstacle.contains": (PLANE, POINTS),
    "mapping.MapObject.moved": (mapping.MapObject.box([1, 0, 0, 0], 1, 2), POSE),
    "mapping.fit_box": (BOX, 0.01, np.array([-1.0, 3])),
    "mapping.pose_in_space": (POSE, 0.4),
    "mapping.wall_recall_precision": (WALLS, WALLS),
    "registration.estimate_normals": (SPHERE,),
    "registration.refine": (SPHERE, SPHERE + 0.001, MOTOR, 0.2),
    "shapes.filled": (np.array([[3.0, 3, 3, 2]]), (6, 6, 6), EDGES),
    "shapes.fit_balls": (CUBE, 0.95, EDGES),
    "shapes.march": (CUBE, 2, EDGES),
    "shapes.marching_cubes": (CUBE.astype(float), 0.5, EDGES),
    "shapes.marching_spheres": (CUBE, 2, EDGES),
    "shapes.maximal_balls": (CUBE, 0.95, EDGES),
    "shapes.neural_gas": (SPHERE, 10),
    "shapes.segment": (100.0 * CUBE, np.array([3, 3, 3]), EDGES),
    "shapes.union_of_spheres": (CUBE, EDGES),
    "vision.camera_centre": (POINTS, PIXELS[0]),
    "vision.complete_points": (*PIXELS[:3], FUNDAMENTAL),
    "vision.epipoles": (FUNDAMENTAL,),
    "vision.homography": (PIXELS[0], PIXELS[1]),
    "vision.motions_of_plane": (HOMOGRAPHY, INTRINSICS),
    "vision.poses_of_three_points": (POINTS[:3], PIXELS[0][:3], INTRINSICS),
    "vision.quadrifocal_tensor": tuple(CAMERAS),
    "wavelets.similarity_versor": (np.array([1.0, 2, 3]), np.array([np.cos(0.3), np.sin(0.3), 0, 0]), 2.0),
}
"""Arguments of each function of a chapter, and of each method."""


@pytest.mark.parametrize("name", CALLS)
def test_element_is_what_the_function_takes_or_refused(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    warnings.simplefilter("ignore")
    module, _, function = f"algorithms.{name}".rpartition(".")
    place, _, owner = module.rpartition(".")
    key = (place, owner, function) if owner[0].isupper() else (module, function, "")
    monkeypatch.setattr(elements_everywhere, "RECORDED", {key: [((), pickle.dumps((CALLS[name], {})))]})
    found = elements_everywhere.examined()
    assert not found["wrong"] and found["pairs"].total() > 0
