"""Places and directions of elements of an object in closed form, from their silhouettes in single images.

A pixel is a ray from the centre of its camera. The rays that touch a sphere, or meet a circle, form a cone of the
second degree; those that touch a cylinder are in two planes. With a known radius, these determine the centre of the
sphere, the axis of the cylinder, and two possible centres and normals of the circle.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from generated import pga3

from ...arguments import Reals
from ...precision import ROUNDING, TINY
from .pose_models import Measurements, ObjectModel

_ROUNDS = 8
"""Number of rounds of least squares with weights by the residuals of the previous round."""
_FEWEST = {"balls": 4, "tubes": 6, "rims": 6, "edges": 2}
"""Fewest pixels from which a feature is computed."""
_MONOMIALS = np.triu_indices(3)
"""The places of the coefficients of a conic in its matrix."""


class Constraint(NamedTuple):
    """A point of the object is at a place of the world, apart from displacements that a matrix annihilates."""

    matrix: Reals
    """(3, 3) A projection."""
    point: Reals
    place: Reals
    """(3), or (2, 3) for the two places of a circle."""
    normal: Reals | None = None
    """(3) Of a circle, in the frame of the object."""
    normals: Reals | None = None
    """(2, 3) Of a circle, in the world, for each of the two places; the sign is unknown."""


class Features(NamedTuple):
    """What silhouettes of single elements determine."""

    constraints: list[Constraint]
    axes: list[tuple[Reals, Reals]]
    """Directions of cylinders in the frame of the object and in the world, of unknown sign, most pixels first."""
    circles: list[tuple[Reals, Reals]]
    """Normals of circles in the frame of the object, and the two possible ones (2, 3) in the world."""
    centres: list[tuple[Reals, Reals]]
    """Centres of spheres in the frame of the object and in the world."""


def features(model: ObjectModel, seen: Measurements) -> Features:
    """Return what the silhouettes of single elements determine in each image."""
    found = Features([], [], [], [])
    counts: list[int] = []
    for k, camera in enumerate(seen.cameras):
        for kind in seen.kinds:
            here = seen.of[kind].cameras == k
            rows, rays = seen.of[kind].rows[here], camera.rays(seen.of[kind].pixels[here])
            for row in np.unique(rows):
                _add(found, counts, model, kind, int(row), rays[rows == row], camera.centre)
    order = np.argsort(counts)[::-1]
    return found._replace(axes=[found.axes[k] for k in order])


def _add(found: Features, counts: list[int], model: ObjectModel, kind: str, row: int, rays: Reals, eye: Reals) -> None:
    """Add what the rays of one element in one image determine."""
    if kind == "points":
        found.constraints.extend(on_line(ray, model.points[row], eye) for ray in rays)
    if len(rays) < _FEWEST.get(kind, len(rays) + 1):
        return
    if kind == "edges":
        normal = _normal(rays)
        found.constraints.append(Constraint(np.outer(normal, normal), model.edges[row, 0], eye))
    elif kind == "balls":
        place = ball_of_rays(rays, float(model.balls[row, 3]))
        if place is not None:
            found.constraints.append(Constraint(np.eye(3), model.balls[row, :3], eye + place))
            found.centres.append((model.balls[row, :3], eye + place))
    elif kind == "tubes":
        tube = tube_of_rays(rays, float(model.tubes[row, 6]))
        if tube is not None:
            axis, place = tube
            found.constraints.append(on_line(axis, model.tubes[row, :3], eye + place))
            along = model.tubes[row, 3:6] - model.tubes[row, :3]
            found.axes.append((along / np.linalg.norm(along), axis))
            counts.append(len(rays))
    elif kind == "rims":
        circle = circle_of_rays(rays, float(model.rims[row, 6]))
        normal, point = model.rims[row, 3:6], model.rims[row, :3]
        if circle is not None:
            places, normals = circle
            found.constraints.append(Constraint(np.eye(3), point, eye + places, normal, normals))
            found.circles.append((normal, normals))
        else:
            found.constraints.append(on_line(rays.mean(0), point, eye))


def on_line(ray: Reals, point: Reals, place: Reals) -> Constraint:
    """Return the constraint that a point of the object is on the line through a place in a direction."""
    return Constraint(np.eye(3) - np.outer(ray, ray) / (ray @ ray), point, place)


def poses_of_rotations(rotations: Reals, translations: Reals) -> Reals:
    """Return motors (b, 8) of rotations (b, 3, 3) and translations (b, 3)."""
    whole = np.tile(np.eye(4), (len(rotations), 1, 1))
    whole[:, :3, :3], whole[:, :3, 3] = rotations, translations
    return np.asarray(pga3.motor_from_matrix(whole))


def places_of_rotations(rotations: Reals, constraints: list[Constraint]) -> Reals | None:
    """Return the translations (b, 3) that best agree with constraints for rotations (b, 3, 3); None if they are open.

    Given the rotation, every constraint is linear in the translation.
    """
    total = sum((one.matrix for one in constraints), np.zeros((3, 3)))
    if np.linalg.eigvalsh(total)[0] < 1e-3:
        return None
    right = np.zeros((len(rotations), 3))
    for one in constraints:
        place = one.place
        if one.normal is not None and one.normals is not None:
            aligned = np.abs((rotations @ one.normal) @ one.normals.T)
            place = one.place[aligned.argmax(1)]
        right += (place - rotations @ one.point) @ one.matrix
    return np.asarray(np.linalg.solve(total, right.T).T)


def ball_of_rays(rays: Reals, radius: float) -> Reals | None:
    """Return the centre (3) of a sphere from unit rays (n, 3) that touch it, relative to their common origin.

    A ray d touches the sphere with centre c if ``(c . d)^2 = c . c - radius^2``, which is linear in a multiple of c.
    """
    weights = np.ones(len(rays))
    for _ in range(_ROUNDS):
        u = np.linalg.lstsq(rays * weights[:, None], weights, rcond=None)[0]
        weights = _less_weight(rays @ u - 1)
    excess = float(u @ u) - 1
    return np.asarray(u * radius / np.sqrt(excess)) if excess > 0 else None


def tube_of_rays(rays: Reals, radius: float) -> tuple[Reals, Reals] | None:
    """Return the unit direction and a point of a cylinder's axis from unit rays (n, 3) that touch it; None if one side.

    The two tangent planes meet in the direction of the axis, and the distance of the axis from both is the radius.
    """
    values, vectors = np.linalg.eigh(_cone(rays))
    if not values[0] < 0 < values[2]:
        return None
    long, short = np.sqrt(values[2]) * vectors[:, 2], np.sqrt(-values[0]) * vectors[:, 0]
    normals = np.array([long + short, long - short])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    for _ in range(2):
        nearer = np.abs(rays @ normals.T).argmin(1)
        if min(np.bincount(nearer, minlength=2)) < _FEWEST["tubes"] // 2:
            return None
        normals = np.array([_normal(rays[nearer == side]) for side in (0, 1)])
    axis = np.cross(normals[0], normals[1])
    size = float(np.linalg.norm(axis))
    if size < 1e-9:
        return None
    axis /= size
    # In the plane orthogonal to the axis, the planes are two rays from the origin, and the axis is between them.
    middle = rays.mean(0)
    sides = np.cross(axis, normals)
    sides *= np.where(sides @ middle < 0, -1.0, 1.0)[:, None]
    bisector = sides[0] + sides[1]
    length = float(np.linalg.norm(bisector))
    sine = float(np.linalg.norm(sides[0] - sides[1])) / 2
    return (axis, bisector * (radius / (length * sine))) if length > 1e-9 and sine > 1e-9 else None


def circle_of_rays(rays: Reals, radius: float) -> tuple[Reals, Reals] | None:
    """Return the two possible centres (2, 3) and unit normals (2, 3) of a circle from unit rays (n, 3) that meet it.

    The planes that cut a cone of the second degree in circles are orthogonal to the plane of its largest and its
    negative eigenvalue (Forsyth et al., *IEEE PAMI* 13:971, 1991).
    """
    values, vectors = np.linalg.eigh(_cone(rays))
    if values[1] < 0:
        values, vectors = -values[::-1], vectors[:, ::-1]
    small, middle, large = values
    if not small < 0 < 1e-9 * large < middle:
        return None
    across, along = np.sqrt((large - middle) / (large - small)), np.sqrt((middle - small) / (large - small))
    away = middle * radius / np.sqrt(-large * small)
    places, normals = [], []
    for sign in (1, -1):
        normal = sign * across * vectors[:, 2] + along * vectors[:, 0]
        place = away * (sign * small / middle * across * vectors[:, 2] + large / middle * along * vectors[:, 0])
        places.append(place if place @ rays.mean(0) > 0 else -place)
        normals.append(normal)
    return np.array(places), np.array(normals)


def _cone(rays: Reals) -> Reals:
    """Return the symmetric matrix (3, 3) of the cone of the second degree nearest to rays.

    Rays are first mapped by a linear map such that they spread equally, so that no coefficient dominates.
    """
    values, vectors = np.linalg.eigh(rays.T @ rays)
    root = (vectors / np.sqrt(np.maximum(values, ROUNDING * values[-1]))).T
    mapped = rays @ root.T
    mapped /= np.linalg.norm(mapped, axis=1, keepdims=True)
    i, j = _MONOMIALS
    rows = mapped[:, i] * mapped[:, j] * np.where(i == j, 1.0, 2.0)
    weights = np.ones(len(rows))
    for _ in range(_ROUNDS):
        solution = np.linalg.svd(rows * weights[:, None], full_matrices=len(rows) < 6)[2][-1]
        weights = _less_weight(rows @ solution)
    matrix = np.zeros((3, 3))
    matrix[i, j] = matrix[j, i] = solution
    cone = root.T @ matrix @ root
    return np.asarray(cone / max(float(np.abs(cone).max()), TINY))


def _normal(rays: Reals) -> Reals:
    """Return the unit normal of the plane through the origin nearest to rays."""
    weights = np.ones(len(rays))
    for _ in range(_ROUNDS):
        normal = np.linalg.svd(rays * weights[:, None])[2][-1]
        weights = _less_weight(rays @ normal)
    return np.asarray(normal)


def _less_weight(residuals: Reals) -> Reals:
    """Return the square roots of robust weights: residuals far above the median have little influence."""
    scale = 3 * float(np.median(np.abs(residuals)))
    return np.asarray(1 / (1 + np.square(residuals / max(scale, 1e-15))))
