"""Scenes of objects and hands for the page of evidence: poses of objects, guided grasps, and plans of grasps."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from algorithms.grasping import (
    ALLEGRO,
    BARRETT_BH280,
    BARRETT_OPENRAVE,
    FRANKA_HAND,
    ROBOTIQ_2F_85,
    Grasp,
    GraspPlan,
    GraspStatus,
    Hand,
    LoopStatus,
    guided_grasp,
    hand_from_urdf,
    hand_of_table,
    plan_grasps,
    plan_grasps_in_view,
)
from algorithms.kinematics import Robot
from algorithms.kinematics.collisions import plane_obstacle
from algorithms.vision import Camera
from algorithms.vision.objects import ObjectModel, PoseEstimate, PoseStatus, View, estimate_pose
from algorithms.vision.objects.pose_record import bounds_of
from generated import pga3

from .evidence_scenes import Trial, rotation, row
from .force_closure import is_closed_by_forces


def _motor(turn: np.ndarray, shift: np.ndarray) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, shift
    return np.asarray(pga3.motor_from_matrix(matrix))


def _cameras(rng: np.random.Generator, count: int, near: float, far: float) -> list[Camera]:
    """Cameras at random places that look at points near the origin."""
    found = []
    for _ in range(count):
        turn = rotation(rng, np.pi)
        back = turn @ [0, 0, -rng.uniform(near, far)] + rng.uniform(-0.03, 0.03, 3)
        found.append(Camera.from_intrinsics((1150.0, 1140.0), (500.0, 390.0), _motor(turn, back)))
    return found


def _object(rng: np.random.Generator) -> ObjectModel:
    """An object of about a decimetre: points, a wedge of edges and corners, or points and spheres."""
    kind = rng.integers(3)
    if kind == 0:
        return ObjectModel.of(points=rng.normal(0, 0.05, (int(rng.integers(5, 15)), 3)))
    if kind == 1:
        a, b, c = rng.uniform(0.05, 0.15, 3)
        corners = np.array([[0, 0, 0], [a, 0, 0], [0, b, 0], [0, 0, c], [a, 0, c], [0.2 * a, b, c]])
        pairs = (0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)
        corners -= corners.mean(0)
        return ObjectModel.of(points=corners, edges=[[corners[i], corners[j]] for i, j in pairs])
    balls = np.column_stack([rng.uniform(-0.08, 0.08, (3, 3)), rng.uniform(0.01, 0.03, 3)])
    return ObjectModel.of(points=rng.uniform(-0.08, 0.08, (int(rng.integers(2, 6)), 3)), spheres=balls)


def _outline(camera: Camera, centre: np.ndarray, radius: float, angles: np.ndarray) -> np.ndarray:
    """Pixels of the silhouette of a sphere: where its tangent cone touches it."""
    eye = np.asarray(pga3.move_point(camera.pose, np.zeros(3)))
    axis = centre - eye
    away = np.linalg.norm(axis)
    axis /= away
    x = np.cross(axis, [0.8, -0.5, 0.3])
    x /= np.linalg.norm(x)
    sine = radius / away
    round_ = np.cos(angles)[:, None] * x + np.sin(angles)[:, None] * np.cross(axis, x)
    return np.asarray(camera.project(centre - radius * sine * axis + radius * np.sqrt(1 - sine**2) * round_))


def _view(
    rng: np.random.Generator, model: ObjectModel, truth: np.ndarray, camera: Camera, error: str, most: int = 19
) -> View:
    """What a camera sees, for a stated noise of 0.4 pixels."""
    per, wrong = int(rng.integers(max(3, most // 3), most + 1)), rng.uniform(0, 0.5)

    def noisy(pixels: np.ndarray) -> np.ndarray:
        if error == "wrong":
            off = rng.random(len(pixels)) < wrong
            return np.asarray(
                pixels + 0.4 * rng.normal(size=pixels.shape) + off[:, None] * rng.normal(0, 30, (len(pixels), 2))
            )
        if error == "student":
            return np.asarray(pixels + 0.4 * rng.standard_t(3, pixels.shape))
        scale = 1.0 if error == "stated" else rng.uniform(1.5, 2)
        return np.asarray(pixels + 0.4 * scale * rng.normal(size=pixels.shape))

    edges, balls, t = [], [], np.linspace(0.02, 0.98, per)[:, None]
    for ends in pga3.move_point(truth, model.edges) if len(model.edges) else ():
        edges.append(camera.project(ends[0] + t * (ends[1] - ends[0])))
    for ball in model.balls:
        centre = pga3.move_point(truth, ball[:3].copy())
        balls.append(_outline(camera, centre, ball[3], rng.uniform(0, 2 * np.pi) + 2 * np.pi * t[:, 0]))
    return View(
        camera,
        points=noisy(camera.project(pga3.move_point(truth, model.points))) if len(model.points) else None,
        edges=(np.repeat(np.arange(len(edges)), per), noisy(np.concatenate(edges))) if edges else None,
        balls=(np.repeat(np.arange(len(balls)), per), noisy(np.concatenate(balls))) if balls else None,
    )


def _judged(found: PoseEstimate, truth: np.ndarray, model: ObjectModel) -> Trial:
    """Right if rotation and displacement are within their bounds."""
    if found.status != PoseStatus.OK:
        return Trial(False, False)
    own, true = (np.asarray(pga3.motor_to_matrix(each)) for each in (found.motor, truth))
    turned = own[:3, :3].T @ true[:3, :3]
    sine = np.linalg.norm([turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]]) / 2
    angle = np.arctan2(sine, (np.trace(turned) - 1) / 2)
    shift = np.linalg.norm((own - true) @ np.append(model.centre, 1))
    return Trial(True, bool(angle < found.bounds[0] and shift < found.bounds[1]))


def _pose(rng: np.random.Generator, error: str) -> Trial:
    model = _object(rng)
    truth = _motor(rotation(rng, np.pi), rng.uniform(-0.02, 0.02, 3))
    views = [_view(rng, model, truth, c, error) for c in _cameras(rng, int(rng.integers(1, 4)), 0.5, 1.5)]
    return _judged(estimate_pose(model, views, noise=0.4, tolerance=(0.05, 0.2 * model.size)), truth, model)


@row("`estimate_pose`", "points, edges and spheres, one to three cameras, tolerance 3 degrees", good=True)
def pose_good(rng: np.random.Generator) -> Trial:
    return _pose(rng, "stated")


@row("`estimate_pose`", "the same with 1.5 to 2 times the noise that is stated")
def pose_understated(rng: np.random.Generator) -> Trial:
    return _pose(rng, "more")


@row("`estimate_pose`", "the same with Student's noise of three degrees of freedom")
def pose_student(rng: np.random.Generator) -> Trial:
    return _pose(rng, "student")


@row("`estimate_pose`", "the same with up to half of the pixels wrong, 30 pixels off")
def pose_wrong(rng: np.random.Generator) -> Trial:
    return _pose(rng, "wrong")


def _with_wrong_points(rng: np.random.Generator, least: int, near: float, far: float, flat: float) -> Trial:
    """Some 30 to 60 % of the points are off, in random directions."""
    n = int(rng.integers(least, 41))
    points = rng.uniform(-0.06, 0.06, (n, 3))
    points[:, 2] *= rng.random() >= flat
    model = ObjectModel.of(points=points)
    truth = _motor(rotation(rng, np.pi), rng.uniform(-0.02, 0.02, 3))
    camera = _cameras(rng, 1, 0.6, 1.0)[0]
    pixels = camera.project(pga3.move_point(truth, points)) + rng.normal(0, 0.4, (n, 2))
    off = rng.permutation(n)[: int(rng.uniform(0.3, 0.6) * n)]
    angles = rng.uniform(0, 2 * np.pi, len(off))
    size = rng.uniform(near, far, len(off))
    pixels[off] += size[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    found = estimate_pose(model, View(camera, points=pixels), noise=0.4, tolerance=(0.2, model.size))
    return _judged(found, truth, model)


@row("`estimate_pose`", "20 to 40 points of one image, 30 to 60 % of them 20 to 100 pixels off", good=True)
def pose_consensus(rng: np.random.Generator) -> Trial:
    return _with_wrong_points(rng, 20, 20, 100, 0.0)


@row("`estimate_pose`", "8 to 40 points, half of them in a plane, 30 to 60 % of them 2 to 10 pixels off")
def pose_near(rng: np.random.Generator) -> Trial:
    return _with_wrong_points(rng, 8, 2, 10, 0.5)


def _symmetric(rng: np.random.Generator) -> Trial:
    """A ball, two balls or a cylinder, whose centre and axis are compared; its ends may be exchanged."""
    kind, up = int(rng.integers(3)), np.array([0, 0, rng.uniform(0.03, 0.08)])
    sizes = rng.uniform(0.01, 0.03, 2)
    ends = np.array([-up, up])
    if kind == 2:
        model = ObjectModel.of(cylinders=[[*-up, *up, sizes[0]]])
    else:
        model = ObjectModel.of(spheres=np.column_stack([[0 * up] if kind == 0 else ends, sizes[: kind + 1]]))
    truth = _motor(rotation(rng, np.pi), rng.uniform(-0.02, 0.02, 3))
    there, views = np.asarray(pga3.move_point(truth, ends)), []
    scale = 0.4 * rng.uniform(1.5, 2)
    for camera in _cameras(rng, int(rng.integers(1, 4)), 0.5, 1.5):
        if kind < 2:
            views.append(_view(rng, model, truth, camera, "more", 40))
            continue
        n = int(rng.integers(12, 41))
        eye = np.asarray(pga3.move_point(camera.pose, np.zeros(3))) - there[0]
        axis = (there[1] - there[0]) / np.linalg.norm(there[1] - there[0])
        away = eye - (eye @ axis) * axis
        far = np.linalg.norm(away)
        if far < 2 * sizes[0]:
            return Trial(False, False)
        x, y = away / far, np.cross(axis, away / far)
        cosine = sizes[0] / far
        sides = sizes[0] * (cosine * x + np.array([[-1.0], [1.0]]) * np.sqrt(1 - cosine**2) * y)
        t, angles = rng.uniform(0, 1, (2, n, 1)), rng.uniform(0, 2 * np.pi, (2, n, 1))
        tubes = there[0] + sides[:, None] + t * (there[1] - there[0])
        rims = there[:, None] + sizes[0] * (np.cos(angles) * x + np.sin(angles) * y)
        seen = [np.asarray(camera.project(each.reshape(-1, 3))) for each in (tubes, rims)]
        seen = [each + scale * rng.normal(size=each.shape) for each in seen]
        views.append(View(camera, tubes=(np.zeros(2 * n, int), seen[0]), rims=(np.repeat([0, 1], n), seen[1])))
    found = estimate_pose(model, views, noise=0.4, tolerance=(0.05, 0.2 * model.size))
    if found.status not in (PoseStatus.OK, PoseStatus.SYMMETRIC):
        return Trial(False, False)
    turn, shift = bounds_of(found.determined)
    own = np.asarray(pga3.move_point(found.motor, ends))
    right = np.linalg.norm(pga3.move_point(found.motor, model.centre) - pga3.move_point(truth, model.centre)) < shift
    if kind:
        angle = np.arcsin(min(np.linalg.norm(np.cross(own[1] - own[0], there[1] - there[0])) / (4 * up @ up), 1.0))
        right = right and angle < turn
    return Trial(True, bool(right))


@row("`estimate_pose`", "a ball, two balls or a cylinder, 1.5 to 2 times the noise that is stated")
def pose_symmetric(rng: np.random.Generator) -> Trial:
    return _symmetric(rng)


_RADIUS, _ACCURACY = 0.035, 1e-3
_BALL = ObjectModel.of(spheres=[[0, 0, 0, _RADIUS]])
_HOME = np.array([0.0, -1.2, 1.5, -0.5, 1.0, 0.0])


@lru_cache(maxsize=1)
def _held() -> tuple[Robot, GraspPlan]:
    """A UR5, and grasps of a ball."""
    return Robot.named("ur5"), plan_grasps(*_round(_RADIUS))


def _round(radius: float) -> tuple[np.ndarray, np.ndarray]:
    """A sphere as a mesh."""
    u, v = np.meshgrid(np.linspace(0, np.pi, 13), np.arange(24) * np.pi / 12, indexing="ij")
    places = radius * np.stack([np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)], -1).reshape(-1, 3)
    first = (24 * np.arange(12)[:, None] + np.arange(24)).ravel()
    right = (24 * np.arange(12)[:, None] + (np.arange(24) + 1) % 24).ravel()
    faces = np.concatenate([np.stack([first, first + 24, right], 1), np.stack([right, first + 24, right + 24], 1)])
    places, same = np.unique(places.round(12), axis=0, return_inverse=True)
    faces = same.reshape(-1)[faces]
    return places, faces[(faces != np.roll(faces, 1, 1)).all(1)]


def _grasped(rng: np.random.Generator, cameras: list[Camera]) -> Trial:
    robot, plan = _held()
    place = np.array([0.45, 0.1, 0.2]) + rng.uniform(-0.05, 0.05, 3)
    truth = _motor(rotation(rng, np.pi), place)
    there = [
        Camera(one.intrinsics, np.asarray(pga3.motor_product(_motor(np.eye(3), place), one.pose))) for one in cameras
    ]
    views = [_view(rng, _BALL, truth, one, "stated", 60) for one in there]
    found = guided_grasp(robot, _HOME, _BALL, views, plan, noise=0.4, accuracy=_ACCURACY, trials=0)
    if found.status == LoopStatus.POSE_UNKNOWN or not found.estimate.is_found:
        return Trial(False, False)
    return Trial(True, bool(np.linalg.norm(pga3.move_point(found.estimate.motor, np.zeros(3)) - place) < _ACCURACY))


@row("`guided_grasp`", "a ball seen by one camera, 0.5 to 5 m away, accuracy of a millimetre", slow=True)
def grasp_far(rng: np.random.Generator) -> Trial:
    return _grasped(rng, _cameras(rng, 1, 0.5, 5))


@row("`guided_grasp`", "a ball seen by three cameras, 0.4 to 0.8 m away", good=True, slow=True)
def grasp_near(rng: np.random.Generator) -> Trial:
    return _grasped(rng, _cameras(rng, 3, 0.4, 0.8))


def _solids(rng: np.random.Generator, apart: float) -> tuple[np.ndarray, np.ndarray, list[tuple[np.ndarray, ...]]]:
    """Two or three solids as one mesh; and of each its centre, axes, and half lengths, or a radius."""
    vertices, faces, solids = [], [], []
    for k in range(int(rng.integers(2, 4))):
        turn, centre = rotation(rng, np.pi), rng.uniform(-1, 1, 3) * [0.02, 0.02, 0.02] + [apart * k, 0, 0]
        if rng.random() < 0.5:
            places, corners = _round(rng.uniform(0.015, 0.035))
            half = np.linalg.norm(places, axis=1).max(keepdims=True)
        else:
            half = rng.uniform(0.01, 0.04, 3)
            signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
            places, corners = signs * half, _BOX
        faces.append(corners + sum(map(len, vertices)))
        vertices.append(places @ turn.T + centre)
        solids.append((centre, turn, half))
    return np.concatenate(vertices), np.concatenate(faces), solids


_BOX = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
     [1, 5, 7], [1, 7, 3]])  # fmt: skip


def _depth(point: np.ndarray, solid: tuple[np.ndarray, ...]) -> float:
    """How far inside of a solid a point is; of balls, less by what the mesh is smaller."""
    centre, turn, half = solid
    local = (point - centre) @ turn
    return float(0.97 * half[0] - np.linalg.norm(local)) if len(half) == 1 else float((half - np.abs(local)).min())


def _planned(rng: np.random.Generator, apart: float) -> Trial:
    vertices, faces, solids = _solids(rng, apart)
    plan = plan_grasps(vertices, faces, int(rng.integers(1, 4)))
    if plan.status != GraspStatus.OK:
        return Trial(False, False)
    return Trial(True, max(_depth(point, one) for one in solids for point in plan[0].contacts) < 1e-4)


@row("`plan_grasps`", "two or three boxes and balls that overlap; wrong: a contact inside of one")
def plan_overlapping(rng: np.random.Generator) -> Trial:
    return _planned(rng, 0.0)


_PAD = 0.003
"""The largest torque of a soft fingertip for a force of 1, in metres."""
_ROUND_FACES = 64
"""The number of sides of round shapes: their meshes are less than a thousandth of the radius off."""


@lru_cache(maxsize=1)
def _hands() -> tuple[Hand, ...]:
    """Two models of a hand with three fingers, two grippers, and a hand with four fingers."""
    return (
        hand_of_table(BARRETT_BH280),
        hand_of_table(BARRETT_OPENRAVE),
        hand_from_urdf(FRANKA_HAND, torsion=_PAD),
        hand_from_urdf(ROBOTIQ_2F_85, torsion=_PAD),
        hand_from_urdf(ALLEGRO, approach=[1, 0, 0]),
    )


def _revolved(profile: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The closed surface of revolution about z of a profile (radius, z) that begins and ends on the axis."""
    angles = 2 * np.pi * np.arange(_ROUND_FACES) / _ROUND_FACES
    inner = profile[1:-1]
    rings = np.stack([inner[:, None, 0] * np.cos(angles), inner[:, None, 0] * np.sin(angles)], -1)
    heights = np.broadcast_to(inner[:, None, 1:], (*rings.shape[:2], 1))
    places = np.concatenate([rings, heights], -1).reshape(-1, 3)
    vertices = np.concatenate([places, [[0, 0, profile[0, 1]], [0, 0, profile[-1, 1]]]])
    k = np.arange(_ROUND_FACES)
    after, last = (k + 1) % _ROUND_FACES, len(places) - _ROUND_FACES
    faces = [np.stack([np.full_like(k, len(places)), after, k], -1)]
    for level in range(len(inner) - 1):
        a, b = level * _ROUND_FACES + k, level * _ROUND_FACES + after
        faces += [np.stack([a, b, b + _ROUND_FACES], -1), np.stack([a, b + _ROUND_FACES, a + _ROUND_FACES], -1)]
    faces.append(np.stack([np.full_like(k, len(places) + 1), last + k, last + after], -1))
    return vertices, np.concatenate(faces)


def _shape(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A box, a can, a capsule or a spindle of 2 to 6 cm: its mesh, and half lengths, a radius and a half length."""
    kind, thin = int(rng.integers(4)), rng.uniform(0.01, 0.03)
    if kind == 0:
        half = np.array([thin, thin * rng.uniform(1, 1.5), rng.uniform(0.02, 0.07)])
        return np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half, _BOX, half
    long = rng.uniform(0.015, 0.06)
    if kind == 1:
        return *_revolved(np.array([[0, -long], [thin, -long], [thin, long], [0, long]])), np.array([thin, long])
    angles = np.linspace(0, np.pi / 2, 24)
    arc = np.stack([np.sin(angles), -np.cos(angles)], -1)
    if kind == 2:
        lower = thin * arc + [0, -long]
        return *_revolved(np.concatenate([lower, (lower * [1, -1])[::-1]])), np.array([thin, long, 0, 0])
    half = np.concatenate([arc, (arc[:-1] * [1, -1])[::-1]]) * [thin, long]
    return *_revolved(half), np.array([thin, long, 0, 0, 0])


def _off(points: np.ndarray, shape: np.ndarray) -> np.ndarray:
    """How far points are from the surface of a shape; of a spindle, to first order."""
    r, z = np.hypot(points[:, 0], points[:, 1]), np.abs(points[:, 2])
    if len(shape) == 5:
        value = (r / shape[0]) ** 2 + (z / shape[1]) ** 2 - 1
        return np.asarray(value / (2 * np.hypot(r / shape[0] ** 2, z / shape[1] ** 2)))
    if len(shape) == 4:
        return np.asarray(np.hypot(r, np.maximum(z - shape[1], 0)) - shape[0])
    apart = np.abs(points) - shape if len(shape) == 3 else np.stack([r - shape[0], z - shape[1]], -1)
    return np.asarray(np.linalg.norm(np.maximum(apart, 0), axis=1) + np.minimum(apart.max(1), 0))


@row(
    "`plan_grasps`",
    "boxes, cans, capsules and spindles, five hands; wrong: no force closure, or off the surface",
    good=True,
)
def plan_by_hands(rng: np.random.Generator) -> Trial:
    vertices, faces, shape = _shape(rng)
    hand = _hands()[int(rng.integers(5))]
    turn, shift = rotation(rng, np.pi), rng.uniform(-1, 1, 3)
    plan = plan_grasps(vertices @ turn.T + shift, faces, int(rng.integers(1, 4)), hand=hand)
    if plan.status != GraspStatus.OK:
        return Trial(False, False)
    for grasp in plan:
        tips = pga3.move_point(grasp.motor, hand.fingertips(grasp.joints)[grasp.fingers])
        good = (
            np.abs(_off((grasp.contacts - shift) @ turn, shape)).max() < 5e-4
            and is_closed_by_forces(grasp.contacts, grasp.normals, hand.torsion)
            and np.abs(tips - grasp.contacts - hand.tips.radii[grasp.fingers, None] * grasp.normals).max() < 1e-5
            and (hand.limits[:, 0] <= grasp.joints).all()
            and (grasp.joints <= hand.limits[:, 1]).all()
        )
        if not good:
            return Trial(True, False)
    return Trial(True, True)


@row(
    "`plan_grasps`",
    "flat boxes of 7 to 15 mm on a table, a gripper; wrong: as above, or the hand is below the table",
    good=True,
)
def plan_flat(rng: np.random.Generator) -> Trial:
    half = np.array([rng.uniform(0.01, 0.035), rng.uniform(0.01, 0.06), rng.uniform(0.0035, 0.0075)])
    shift = np.array([*rng.uniform(-0.5, 0.5, 2), half[2]])
    angle = rng.uniform(-np.pi, np.pi)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    vertices = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half @ turn.T + shift
    hand, table = _hands()[3], plane_obstacle([0, 0, 1], [0, 0, 0])
    plan = plan_grasps(vertices, _BOX, hand=hand, obstacles=[table], margin=5e-4)
    if plan.status != GraspStatus.OK:
        return Trial(False, False)
    for grasp in plan:
        ends = pga3.move_point(grasp.motor, hand.placed_capsules(np.stack([grasp.joints, grasp.open_joints])))
        good = (
            np.abs(_off((grasp.contacts - shift) @ turn, half)).max() < 1e-6
            and is_closed_by_forces(grasp.contacts, grasp.normals, hand.torsion)
            and (ends[..., 2].min(-1) > hand.radii).all()
        )
        if not good:
            return Trial(True, False)
    return Trial(True, True)


_Boxes = list[tuple[np.ndarray, np.ndarray]]
"""The centre and half lengths of boxes along the axes."""


def furniture(rng: np.random.Generator) -> _Boxes:
    """A chair, a shelf or a plate of 5 to 50 cm, whose boards are thin and whose faces are few and large."""
    kind, size, thin = int(rng.integers(3)), rng.uniform(0.05, 0.25), rng.uniform(0.0015, 0.008)
    deep = size * rng.uniform(0.3, 1)
    if kind == 0:
        leg, high = rng.uniform(0.006, 0.02), size * rng.uniform(0.5, 2)
        place = np.array([size - leg, deep - leg, -high])
        legs = [(place * [i, j, 1], np.array([leg, leg, high])) for i in (-1, 1) for j in (-1, 1)]
        back = np.array([0, deep - thin, high]), np.array([size, thin, high])
        return [(np.zeros(3), np.array([size, deep, thin])), *legs, back]
    if kind == 1:
        high, count = size * rng.uniform(0.5, 2), int(rng.integers(2, 6))
        boards = [(np.array([0, 0, z]), np.array([size, deep, thin])) for z in np.linspace(-high, high, count)]
        return boards + [(np.array([x, 0, 0]), np.array([thin, deep, high])) for x in (-size, size)]
    return [(np.zeros(3), np.array([size, deep, thin]))]


def placed_boxes(boxes: _Boxes, turn: np.ndarray, shift: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The mesh of turned and displaced boxes."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    vertices = np.concatenate([centre + corners * half for centre, half in boxes])
    return vertices @ turn.T + shift, np.concatenate([_BOX + 8 * k for k in range(len(boxes))])


def deepest(grasp: Grasp, hand: Hand, boxes: _Boxes, turn: np.ndarray, shift: np.ndarray) -> float:
    """How far a hand is inside boxes at some moments, by points of its axes: at most half a millimetre too little."""
    shares = np.linspace(0, 1, 33)[:, None]
    closing = hand.placed_capsules(grasp.open_joints + shares * (grasp.joints - grasp.open_joints))
    arriving = closing[:1] - 0.08 * shares[:, :, None, None] * hand.approach
    ends = pga3.move_point(grasp.motor, np.concatenate([closing, arriving]))
    ends = (ends - shift) @ turn
    found = -np.inf
    for k, radius in enumerate(hand.radii):
        start, stop = ends[:, k, 0], ends[:, k, 1]
        along = np.linspace(0, 1, 2 + int(1000 * np.linalg.norm(stop - start, axis=1).max()))[:, None, None]
        points = start + along * (stop - start)
        for centre, half in boxes:
            apart = np.abs(points - centre) - half
            gaps = np.linalg.norm(np.maximum(apart, 0), axis=-1) + np.minimum(apart.max(-1), 0)
            found = max(found, float(radius - gaps.min()))
    return found


@row(
    "`plan_grasps`",
    "chairs, shelves and plates of boards, five hands; wrong: the hand is more than 2 mm inside, also while it moves",
)
def plan_furniture(rng: np.random.Generator) -> Trial:
    boxes, hand = furniture(rng), _hands()[int(rng.integers(5))]
    place = rotation(rng, np.pi), rng.uniform(-1, 1, 3)
    plan = plan_grasps(*placed_boxes(boxes, *place), int(rng.integers(1, 4)), hand=hand)
    if plan.status != GraspStatus.OK:
        return Trial(False, False)
    return Trial(True, max(deepest(grasp, hand, boxes, *place) for grasp in plan) < 0.002)


def _box_in_view(rng: np.random.Generator) -> tuple[Camera, np.ndarray, np.ndarray, np.ndarray, float]:
    """A camera, its depths and the pixels of a box on a table, half of its lengths, and the noise."""
    half = np.array([rng.uniform(0.015, 0.035), rng.uniform(0.02, 0.05), rng.uniform(0.02, 0.06)])
    azimuth, elevation = rng.uniform(0, 2 * np.pi), rng.uniform(np.radians(20), np.radians(65))
    away = np.array([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])
    z = -away
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    middle = np.array([0, 0, half[2]])
    eye = middle + rng.uniform(0.4, 0.6) * away
    pose = _motor(np.column_stack([x, np.cross(z, x), z]), eye)
    camera = Camera.from_intrinsics(600.0, (319.5, 239.5), pose)
    rays = np.asarray(camera.directions(np.stack(np.meshgrid(np.arange(640), np.arange(480)), -1).astype(float)))
    ahead = rays / rays[..., 2:] @ np.column_stack([x, np.cross(z, x), z]).T
    with np.errstate(all="ignore"):
        ends = np.stack([(side * half - (eye - middle)) / ahead for side in (-1, 1)])
        near, far = ends.min(0).max(-1), ends.max(0).min(-1)
        table = np.where(ahead[..., 2] < 0, -eye[2] / ahead[..., 2], np.inf)
    own, noise = near < far, rng.uniform(0.0005, 0.0015)
    return camera, np.where(own, near, table) + rng.normal(0, noise, own.shape), own, half, noise


@row(
    "`plan_grasps_in_view`",
    "boxes on a table, half of them hidden, stated to be symmetric; wrong: a contact more than a fingertip off, or "
    "no force closure",
    slow=True,
)
def plan_hidden(rng: np.random.Generator) -> Trial:
    camera, depth, own, half, noise = _box_in_view(rng)
    hand, table = _hands()[2], plane_obstacle([0, 0, 1], [0, 0, 0])
    plan = plan_grasps_in_view(camera, depth, own, hand=hand, obstacles=[table], noise=noise, symmetric=True)
    if plan.status != GraspStatus.OK:
        return Trial(False, False)
    for grasp in plan:
        local = grasp.contacts - [0, 0, half[2]]
        side = np.argmax(np.abs(grasp.normals), axis=1)
        normals = np.sign(grasp.normals[range(2), side])[:, None] * np.eye(3)[side]
        off = (local * normals).sum(1) - half[side]
        places = local - off[:, None] * normals
        ends = np.asarray(pga3.move_point(grasp.motor, hand.placed_capsules(grasp.joints)))
        t = np.linspace(0, 1, 20)[:, None, None]
        points = ends[:, 0] + t * (ends[:, 1] - ends[:, 0])
        good = (
            (off > -0.001).all()
            and (off < hand.tips.radii.min()).all()
            and (np.abs(places) < half + 1e-9).all()
            and is_closed_by_forces(places, normals, hand.torsion)
            and _is_clear(points, hand.radii - 0.003, half)
            and (ends[..., 2].min(-1) > hand.radii - 0.003).all()
        )
        if not good:
            return Trial(True, False)
    return Trial(True, True)


def _is_clear(points: np.ndarray, radii: np.ndarray, half: np.ndarray) -> bool:
    """Return whether points (20, c, 3) are farther from a box on a table than radii (c,)."""
    beyond = np.abs(points - [0, 0, half[2]]) - half
    away = np.linalg.norm(np.maximum(beyond, 0), axis=-1) + np.minimum(beyond.max(-1), 0)
    return bool((away > radii).all())
