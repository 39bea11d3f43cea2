"""Images of points, lines and planes in the camera of an arm, by matrices: for real or complex joint variables."""

from __future__ import annotations

from typing import Any

import numpy as np

from algorithms.estimation import image_of_line, image_of_plane, image_of_point
from algorithms.kinematics import Robot
from generated import pga3

Array = np.ndarray[Any, Any]
OPTICAL = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])
IMAGES = {"point": image_of_point, "line": image_of_line, "plane": image_of_plane}
IMAGE_SIZES = {"point": 2, "line": 2, "plane": 3}


def cross_matrix(v: Array) -> Array:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def camera_matrix(robot: Robot, q: Array, camera: Array) -> Array:
    """The pose of a camera by Rodrigues' formula, joint after joint."""
    found = np.eye(4, dtype=q.dtype)
    for joint, axis in enumerate(robot.axes):
        direction = np.array([axis[2], -axis[1], axis[0]])
        step = np.eye(4, dtype=q.dtype)
        if robot.kinds[joint].value == "revolute":
            turn = cross_matrix(direction)
            step[:3, :3] = np.eye(3) + np.sin(q[joint]) * turn + (1 - np.cos(q[joint])) * turn @ turn
            place = np.cross(direction, axis[3:])
            step[:3, 3] = place - step[:3, :3] @ place
        else:
            step[:3, 3] = q[joint] * direction
        found = found @ step
    return np.asarray(found @ pga3.motor_to_matrix(robot.tool) @ pga3.motor_to_matrix(camera))


def image_by_matrices(kind: str, matrix: Array, element: Array, mirror: float = 0.0) -> Array:
    """The image of an element of the base frame in a camera with the pose `matrix`.

    The image of a line is computed from two of its points, that of a plane from the depths of three rays.
    """
    turn, place = matrix[:3, :3], matrix[:3, 3]
    if kind == "point":
        x, y, z = turn.T @ (element - place)
        return np.array([x, y]) / (z + mirror * np.sqrt(x * x + y * y + z * z))
    if kind == "line":
        direction = np.array([element[2], -element[1], element[0]])
        foot = np.cross(direction, element[3:]) / (direction @ direction)
        near, far = (turn.T @ (p - place) for p in (foot, foot + direction))
        a, b, c = np.cross(near, far)
        size = np.sqrt(a * a + b * b)
        angle = np.arctan(b / a) + (np.pi if a.real < 0 else 0)
        return np.array([angle, -c / size])
    rays = np.array([[0.0, 0, 1], [1, 0, 1], [0, 1, 1]])
    normal, offset = element[:3], element[3]
    inverse = [-(normal @ (turn @ ray)) / (normal @ place + offset) for ray in rays]
    return np.array([inverse[1] - inverse[0], inverse[2] - inverse[0], inverse[0]])


def complex_step(kind: str, robot: Robot, q: Array, camera: Array, element: Array, mirror: float = 0.0) -> Array:
    """The Jacobian of an image by complex steps."""
    columns = []
    for joint in range(len(q)):
        moved = q.astype(complex)
        moved[joint] += 1e-30j
        columns.append(image_by_matrices(kind, camera_matrix(robot, moved, camera), element, mirror).imag / 1e-30)
    return np.stack(columns, -1)


def mount() -> Array:
    """The pose of a camera in the frame of an end effector."""
    return pga3.motor_from_rotation_vector_translation([0.2, -0.3, 0.1], [0.02, 0.01, 0.05])


def scene(rng: np.random.Generator, robot: Robot, q: Array, kind: str, camera: Array | None = None) -> Array:
    """Elements in front of the cameras of configurations (..., n)."""
    frame = robot.forward(q) if camera is None else pga3.motor_product(robot.forward(q), camera)
    shape = q.shape[:-1]
    seen = np.concatenate([rng.uniform(-0.5, 0.5, (*shape, 2)), np.ones((*shape, 1))], -1)
    point = pga3.move_point(frame, rng.uniform(0.5, 2, (*shape, 1)) * seen)
    if kind == "point":
        return np.asarray(point)
    direction = rng.normal(size=(*shape, 3))
    if kind == "line":
        return np.asarray(pga3.normalize_line(pga3.join_point_direction(point, direction)))
    return np.asarray(pga3.plane_from_point_normal(point, direction))
