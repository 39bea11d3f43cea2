"""Public functions that no call of `test_elements_everywhere` reaches, with elements of every layout."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import elements_everywhere
import numpy as np
import pytest

from algorithms import calculus, estimation, fuzzy, gestures, learning, mapping, shapes, vision, wavelets
from algorithms.kinematics import Robot
from algorithms.kinematics.collisions import capsule_obstacle, mesh_obstacle, plane_obstacle
from algorithms.vision import objects

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


def linear(x: Any) -> tuple[Any, Any]:
    """A motion or a measurement that changes nothing, and its derivative."""
    return np.asarray(x, float), np.eye(len(x))


def same(x: Any) -> Any:
    return x


def vectors(x: Any) -> Any:
    """The field x of vectors in the plane, with all blades."""
    return calculus.embed(x, 2, 1)


def still(_: float) -> Any:
    return np.zeros(3)


def scan() -> mapping.Scan:
    return mapping.Scan(5 + np.cos(np.linspace(0, 12, 90)), -np.pi, np.pi / 45, 30.0)


def matches() -> list[mapping.Match]:
    beams = np.linspace(-np.pi / 2, np.pi / 2, 181)
    corner = np.minimum(3 / np.maximum(np.abs(np.sin(beams)), 1e-9), 4 / np.maximum(np.cos(beams), 1e-9))
    one = mapping.Scan(corner, -np.pi / 2, np.pi / 180, 30.0)
    return 2 * [mapping.match_scans(one, one)]


def plan() -> mapping.FloorPlan:
    corners = np.array([[0.0, 0], [6, 0], [6, 4], [0, 4]])
    return mapping.FloorPlan.from_walls(np.stack([corners, np.roll(corners, -1, 0)], 1))


def pair_of_spheres() -> shapes.SphereRegistration:
    balls = np.c_[np.random.default_rng(0).uniform(0, 10, (12, 3)), np.full(12, 1.0)]
    return shapes.register_spheres(balls, balls + np.eye(4)[0], surfaces=False)


def sphere_samples() -> tuple[Any, Any, Any]:
    """An image, its directions, and three versors."""
    return np.ones(60), SPHERE, wavelets.sphere_versor(np.tile([1.0, 0, 0, 0], (3, 1)), np.array([1.0, 2, 3]))


def rectified() -> vision.Rectification:
    other = vision.Camera.from_intrinsics((500, 500), (15, 10), MOTOR)
    return vision.rectify(vision.Camera.from_intrinsics((500, 500), (15, 10)), other, (30, 20))


TRIFOCAL = vision.trifocal_tensor(*CAMERAS[:3])
VIEWS = [vision.Camera.from_intrinsics((500, 500), (320, 240), motor) for motor in (MOTOR, MOTOR + 0.5 * np.eye(8)[4])]
PAIR = vision.RectifiedPair(700.0, (320.0, 240.0), 2.0, 0.12)
IMAGE = np.hypot(*(np.mgrid[:40, :50] - np.array([20, 25])[:, None, None])) < 12
SOUND = 1 + np.cos(np.add.outer(np.arange(40.0), 0.3 * np.arange(20.0)))
HANDS = RNG.integers(0, 255, (4, 40, 40))
NETWORK = learning.Network([learning.Linear(2)], "G(3)")
FURTHER: dict[str, Callable[[], tuple[Any, ...]]] = {
    "calculus.cauchy_integral": lambda: (
        calculus.box_mesh((2, 2), np.ones(2)).boundary(), vectors, np.full((3, 2), 0.5), 4
    ),
    "calculus.dirac_spinors": lambda: (np.arange(8.0).reshape(2, 4),),
    "calculus.precess": lambda: (np.array([1.0, 0, 0, 0]), still, np.arange(3.0)),
    "estimation.ExtendedKalmanFilter.predict": lambda: (
        estimation.ExtendedKalmanFilter([0.0, 0], np.eye(2)), linear, np.eye(2)
    ),
    "estimation.ExtendedKalmanFilter.update": lambda: (
        estimation.ExtendedKalmanFilter([0.0, 0], np.eye(2)), np.ones(2), linear, np.eye(2)
    ),
    "estimation.LinearMotorFilter.predict": lambda: (estimation.LinearMotorFilter(MOTOR, np.eye(8)), np.eye(8)),
    "estimation.MotorSmoother.add_state": lambda: (estimation.MotorSmoother(1.0), 0.0, MOTOR, np.ones(3), np.ones(6)),
    "estimation.UnscentedKalmanFilter.predict": lambda: (
        estimation.UnscentedKalmanFilter([0.0, 0], np.eye(2)), same, np.eye(2)
    ),
    "estimation.UnscentedKalmanFilter.update": lambda: (
        estimation.UnscentedKalmanFilter([0.0, 0], np.eye(2)), np.ones(2), same, np.eye(2)
    ),
    "evidence.checked_scores": lambda: (np.arange(6.0), 6),
    "fuzzy.FuzzySet.membership": lambda: (fuzzy.FuzzySet("low", "triangle", (0, 1, 2)), np.arange(4.0)),
    "fuzzy.Mamdani.cuts": lambda: (fuzzy.grasp_controller(), np.zeros((2, len(fuzzy.grasp_controller().inputs)))),
    "fuzzy.Mamdani.strengths": lambda: (fuzzy.grasp_controller(), np.zeros((2, len(fuzzy.grasp_controller().inputs)))),
    "gestures.HandClassifier.predict": lambda: (gestures.train_hands(HANDS, [0, 0, 1, 1]), HANDS),
    "gestures.train_hands": lambda: (HANDS, np.array([0, 0, 1, 1])),
    "kinematics.Robot.with_armature": lambda: (ARM, np.ones(6)),
    "kinematics.Robot.with_limits": lambda: (ARM, np.tile([-1.0, 1], (6, 1))),
    "kinematics.collisions.MeshObstacle.moved": lambda: (MESH, MOTOR),
    "kinematics.collisions.PlaneObstacle.moved": lambda: (PLANE, MOTOR),
    "kinematics.inverse.inverse": lambda: (ARM, ARM.forward(np.full(6, 0.3))),
    "learning.CliffordSVC.score": lambda: (
        learning.CliffordSVC("scalar").fit(POINTS, np.arange(12) % 2), POINTS, np.arange(12) % 2
    ),
    "learning.CliffordSVR.score": lambda: (
        learning.CliffordSVR("scalar").fit(POINTS, POINTS[:, 0]), POINTS, POINTS[:, 0]
    ),
    "learning.Network.inputs": lambda: (NETWORK, np.ones((2, 1, 8))),
    "learning.Network.targets": lambda: (NETWORK, np.ones((2, 2, 8)), 2),
    "learning.confusion_matrix": lambda: (np.array([0, 1, 1]), np.array([0, 1, 0]), np.array([0, 1])),
    "mapping.LineLocalizer.move": lambda: (
        mapping.LineLocalizer(plan().segments, POSE, np.full(3, 1e-3)), POSE, np.full(3, 1e-3)
    ),
    "mapping.Relocator.add": lambda: (mapping.Relocator(plan().segments), scan(), POSE),
    "mapping.add_scans": lambda: (
        estimation.MotorGraph(), np.array([0, 1]), np.array([1, 2]), matches(), {"mount": MOTOR}
    ),
    "mapping.fit_circle": lambda: (np.c_[np.cos(np.arange(9.0)), np.sin(np.arange(9.0))], 0.01),
    "mapping.fit_solid": lambda: (SPHERE, np.tile([1e-6, 0, 0, 1e-6, 0, 1e-6], (60, 1)), mapping.SolidKind.SPHERE),
    "mapping.follow": lambda: (mapping.PlanarPath.through(np.array([[0.0, 0], [4, 0], [4, 4]]), 0.5), POSE),
    "mapping.match_scans": lambda: (scan(), scan(), POSE),
    "mapping.simulate_log": lambda: (plan(), np.tile([1.0, 0, 3, 2], (3, 1))),
    "mapping.simulate_scan": lambda: (plan(), np.array([1.0, 0, 1, 1])),
    "mapping.stereo_lines": lambda: (
        PAIR, np.array([[[300.0, 200], [310, 300]]]), np.array([[[290.0, 200], [300, 300]]]), MOTOR
    ),
    "mapping.stereo_points": lambda: (PAIR, np.array([[300.0, 200], [310, 300]]), np.array([10.0, 12]), MOTOR),
    "motors.nlerp": lambda: (MOTOR, np.array([np.cos(0.3), np.sin(0.3), 0, 0, 0, 0, 0, 0]), np.linspace(0, 1, 3)),
    "motors.sclerp": lambda: (MOTOR, np.array([np.cos(0.3), np.sin(0.3), 0, 0, 0, 0, 0, 0]), np.linspace(0, 1, 3)),
    "registration.separate_motions": lambda: (SPHERE, SPHERE + 0.1),
    "shapes.SphereRegistration.unwarp": lambda: (pair_of_spheres(), POINTS),
    "shapes.SphereRegistration.warp_balls": lambda: (pair_of_spheres(), np.c_[POINTS, np.ones(12)]),
    "shapes.contour": lambda: (IMAGE.astype(float),),
    "shapes.neural_gas_of_image": lambda: (IMAGE.astype(float), 20),
    "shapes.warp_volume": lambda: (CUBE.astype(float), pair_of_spheres(), (6, 6, 6)),
    "speech.vowel_features": lambda: (SOUND,),
    "speech.word_features": lambda: (SOUND,),
    "speech.word_image": lambda: (SOUND,),
    "speech.word_quaternions": lambda: (SOUND,),
    "vision.OmnidirectionalCamera.from_intrinsics": lambda: (
        vision.OmnidirectionalCamera, (500.0, 500.0), (320.0, 240.0), 0.5, MOTOR
    ),
    "vision.Rectification.image": lambda: (rectified(), np.ones((20, 30)), 0),
    "vision.epipoles_of_tensor": lambda: (TRIFOCAL,),
    "vision.essential_matrices": lambda: (*PIXELS[:2], INTRINSICS),
    "vision.metric_upgrade": lambda: (vision.factorize(np.array(PIXELS)), np.array(PIXELS), np.array([320.0, 240])),
    "vision.motions_of_essential": lambda: (INTRINSICS.T @ FUNDAMENTAL @ INTRINSICS,),
    "vision.objects.Scene.with_pose": lambda: (
        objects.Scene((), (objects.SceneObject("one", objects.ObjectModel.of(POINTS), MOTOR),)), "one", MOTOR
    ),
    "vision.triangulate_views": lambda: (VIEWS, np.array([each.project(POINTS + 9) for each in VIEWS])),
    "vision.trifocal_tensor": lambda: tuple(CAMERAS[:3]),
    "wavelets.isphere_wavelet": lambda: (np.ones(3), SPHERE[:5], sphere_samples()[2]),
    "wavelets.sphere_wavelet": sphere_samples,
    "wavelets.shrink": lambda: (POINTS[:, 0], np.full(12, 0.1)),
}  # fmt: skip
"""As `CALLS`, of which some take time to prepare; a dict at the end has keywords."""


def key_of(name: str) -> tuple[str, str, str]:
    """Return the module, function or class, and method of a name."""
    module, _, function = f"algorithms.{name}".rpartition(".")
    place, _, owner = module.rpartition(".")
    return (place, owner, function) if owner[0].isupper() else (module, function, "")


@pytest.mark.parametrize("name", [*CALLS, *FURTHER])
def test_element_is_what_the_function_takes_or_refused(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    warnings.simplefilter("ignore")
    key = key_of(name)
    arguments = FURTHER[name]() if name in FURTHER else CALLS[name]
    named = arguments[-1] if isinstance(arguments[-1], dict) else {}
    given = arguments[: len(arguments) - bool(named)]
    monkeypatch.setattr(elements_everywhere, "RECORDED", {key: [((), (given, named))]})
    found = elements_everywhere.examined()
    assert not found["wrong"] and (found["pairs"].total() or found["arrays"]), found
