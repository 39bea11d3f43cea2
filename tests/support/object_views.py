"""Objects in front of cameras, and their pixels by formulas that share no code with the library."""

from __future__ import annotations

from typing import Any

import numpy as np

from algorithms.vision.camera import Camera
from algorithms.vision.objects import ObjectModel, View
from generated import pga3

Array = np.ndarray[Any, Any]
BOX = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * [0.04, 0.06, 0.03]
BOX_EDGES = [[a, b] for k, a in enumerate(BOX) for b in BOX[k + 1 :] if (a != b).sum() == 1]
KINDS = ("4 points", "6 points", "20 points", "plane", "wires", "box", "spheres", "can", "mixed")
"""Objects of `random_model`."""


def motor(turn: Any, shift: Any = (0.0, 0.0, 0.0)) -> Array:
    """Return a motor from a rotation vector and a translation."""
    return np.asarray(pga3.motor_from_rotation_vector_translation(np.array(turn, float), np.array(shift, float)))


def ball_silhouette(camera: Camera, centre: Array, radius: float, angles: Array) -> Array:
    """Pixels of the silhouette by the tangent cone, from the circle in which it touches the sphere."""
    origin = pga3.move_point(camera.pose, np.zeros(3))
    to = centre - origin
    far = np.linalg.norm(to)
    axis = to / far
    x = np.cross(axis, [0.3, 0.5, 0.8])
    x /= np.linalg.norm(x)
    y = np.cross(axis, x)
    middle, size = centre - axis * radius**2 / far, radius * np.sqrt(1 - (radius / far) ** 2)
    return camera.project(middle + size * (np.cos(angles)[:, None] * x + np.sin(angles)[:, None] * y))


def tube_silhouette(camera: Camera, ends: Array, radius: float, t: Array) -> Array | None:
    """Pixels of both sides of a cylinder: points at which the normal is orthogonal to the line of sight."""
    axis = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    origin = pga3.move_point(camera.pose, np.zeros(3))
    to = ends[0] - origin
    across = to - (to @ axis) * axis
    far = np.linalg.norm(across)
    if far < 1.05 * radius:
        return None
    u = across / far
    v = np.cross(axis, u)
    s = np.sqrt(1 - (radius / far) ** 2)
    rows = [ends[0] + np.outer(t, ends[1] - ends[0]) + radius * (-radius / far * u + sign * s * v) for sign in (1, -1)]
    return camera.project(np.concatenate(rows))


def rim_image(camera: Camera, rim: Array, angles: Array) -> Array:
    """Pixels of a circle."""
    x = np.cross(rim[3:6], [0.3, 0.5, 0.8])
    x /= np.linalg.norm(x)
    y = np.cross(rim[3:6], x)
    return camera.project(rim[:3] + rim[6] * (np.cos(angles)[:, None] * x + np.sin(angles)[:, None] * y))


def pixels_of(model: ObjectModel, truth: Array, camera: Camera, n: int = 40) -> dict[str, tuple[Array, Array]]:
    """Return for each kind of element the indices of elements and their exact pixels, `n` on each."""
    angles, t = np.linspace(0, 2 * np.pi, n, endpoint=False), np.linspace(0.03, 0.97, n)
    parts: dict[str, list[tuple[int, Array]]] = {kind: [] for kind in ("points", "edges", "balls", "tubes", "rims")}
    for k, p in enumerate(model.points):
        parts["points"].append((k, camera.project(pga3.move_point(truth, p))[None]))
    for k, (a, b) in enumerate(pga3.move_point(truth, model.edges) if len(model.edges) else ()):
        parts["edges"].append((k, camera.project(a + t[:, None] * (b - a))))
    for k, ball in enumerate(model.balls):
        centre = pga3.move_point(truth, ball[:3])
        parts["balls"].append((k, ball_silhouette(camera, centre, ball[3], angles)))
    for k, tube in enumerate(model.tubes):
        sides = tube_silhouette(camera, pga3.move_point(truth, tube[:6].reshape(2, 3)), tube[6], t)
        if sides is not None:
            parts["tubes"].append((k, sides))
    for k, rim in enumerate(model.rims):
        moved = np.array([*pga3.move_point(truth, rim[:3]), *pga3.move_direction(truth, rim[3:6]), rim[6]])
        parts["rims"].append((k, rim_image(camera, moved, angles)))
    return {
        kind: (np.concatenate([np.full(len(p), k) for k, p in found]), np.concatenate([p for _, p in found]))
        for kind, found in parts.items()
        if found
    }


def view_of(
    model: ObjectModel, truth: Array, camera: Camera, rng: np.random.Generator, *,
    noise: float = 0.3, wrong: float = 0.0, hidden: float = 0.0, n: int = 40,
) -> View:  # fmt: skip
    """Return a view with noise, a part `wrong` of pixels 10 to 80 pixels off, and a part `hidden` not seen.

    Points are hidden one by one, and pixels of edges and silhouettes in runs, as another object hides them.
    """
    found: dict[str, Any] = {}
    for kind, (rows, exact) in pixels_of(model, truth, camera, n).items():
        pixels = exact + rng.normal(0, noise, exact.shape)
        off = rng.permutation(len(pixels))[: int(wrong * len(pixels))]
        angles = rng.uniform(0, 2 * np.pi, len(off))
        pixels[off] += rng.uniform(10, 80, len(off))[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
        if kind == "points":
            pixels[rng.permutation(len(pixels))[: int(hidden * len(pixels))]] = np.nan
            found[kind] = pixels
        else:
            keep = np.ones(len(pixels), bool)
            for row in np.unique(rows):
                own = np.flatnonzero(rows == row)
                first = rng.integers(len(own))
                keep[np.roll(own, -first)[: int(hidden * len(own))]] = False
            found[kind] = (rows[keep], pixels[keep])
    return View(camera, **found)


def looking(at: Array, place: Array, turn: float = 0.0) -> Array:
    """Return the pose of a camera at a place that looks at a point, turned about its axis."""
    z = (at - place) / np.linalg.norm(at - place)
    x = np.cross(z, [0.12, 0.31, 0.9])
    x /= np.linalg.norm(x)
    whole = np.eye(4)
    whole[:3, :3], whole[:3, 3] = np.column_stack([x, np.cross(z, x), z]), place
    return np.asarray(pga3.motor_product(pga3.motor_from_matrix(whole), motor((0, 0, turn))))


def random_cameras(rng: np.random.Generator, at: Array, count: int) -> list[Camera]:
    """Return cameras 0.6 to 1 m from a point, at most 60 degrees apart, that look at places near it."""
    first = rng.normal(size=3)
    found = []
    for _ in range(count):
        direction = first / np.linalg.norm(first) + 0.5 * rng.uniform(-1, 1, 3) * bool(found)
        place = at + direction / np.linalg.norm(direction) * rng.uniform(0.6, 1.0)
        pose = looking(at + rng.uniform(-0.03, 0.03, 3), place, rng.uniform(0, 6))
        found.append(Camera.from_intrinsics(900.0, (320.0, 240.0), pose))
    return found


def random_model(kind: str, rng: np.random.Generator) -> ObjectModel:
    """Return an object of about a decimetre, of one of `KINDS`."""
    places = rng.uniform(-0.06, 0.06, (20, 3))
    if kind.endswith("points"):
        return ObjectModel.of(points=places[: int(kind.split()[0])])
    if kind == "plane":
        return ObjectModel.of(points=places[: rng.integers(4, 12)] * [1, 1, 0])
    if kind == "wires":
        return ObjectModel.of(edges=BOX_EDGES)
    if kind == "box":
        return ObjectModel.of(points=BOX, edges=BOX_EDGES)
    balls = np.column_stack([rng.uniform(-0.06, 0.06, (4, 3)), rng.uniform(0.01, 0.03, 4)])
    tube = [*rng.uniform(-0.01, 0.01, 3), 0, 0, 0.01, rng.uniform(0.02, 0.04)]
    tube[5] += rng.uniform(0.06, 0.14)
    if kind == "spheres":
        return ObjectModel.of(spheres=balls[: rng.integers(1, 5)])
    if kind == "can":
        return ObjectModel.of(cylinders=[tube])
    if kind == "mixed":
        return ObjectModel.of(
            points=places[: rng.integers(0, 4)], spheres=np.add(balls[:1], [0.05, 0, 0, 0]), cylinders=[tube]
        )
    raise ValueError(f"{kind}; expected one of {KINDS}")
