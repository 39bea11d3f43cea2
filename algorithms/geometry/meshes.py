"""Triangle meshes: checks of arguments, first intersections of rays, and what surrounds points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import pga3

from ..arguments import Reals, as_given, finite, moderate, real_array
from ..precision import NEGLIGIBLE

PAIRS = 1 << 18
"""Maximum number of pairs of rays and triangles in one call of the kernel."""

_RAYS = np.array([[0.351, 0.642, 0.682], [-0.573, 0.271, 0.774], [0.436, -0.823, 0.364]])
"""Directions that are not parallel to the faces and edges of usual objects."""

Integers = NDArray[np.intp]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class MeshHit:
    """The result of `hit_mesh`."""

    distance: Reals
    """(...) Distance in units of the length of the direction, at least 0. Infinite if the ray hits nothing."""
    face: NDArray[np.intp]
    """(...) The index of the first triangle that the ray hits, the lowest one of several; -1 if there is none."""
    weights: Reals
    """(..., 3) Barycentric coordinates of the point in the triangle; NaN if there is none."""

    @property
    def hits(self) -> NDArray[np.bool_]:
        """Whether the ray hits a triangle."""
        return self.face >= 0


def hit_mesh(origins: ArrayLike, directions: ArrayLike, vertices: ArrayLike, faces: ArrayLike) -> MeshHit:
    """Return the first intersections of rays with the triangles of a mesh, from either side.

    Parameters
    ----------
    origins, directions : array_like, (..., 3)
        Rays; leading axes broadcast. A direction of length 0 hits nothing.
    vertices : array_like, (n, 3)
    faces : array_like of int, (m, 3)
        Indices of the three vertices of each triangle.

    Returns
    -------
    MeshHit
        A ray in the plane of a triangle does not hit that triangle, but the adjacent ones. An edge belongs to both of
        its triangles, so that no ray passes through a closed mesh.

    Raises
    ------
    TypeError, ValueError
        If arguments have wrong shapes or types, vertices are not finite, or faces refer to missing ones.

    Notes
    -----
    Every ray is tested against every triangle, at about 5 ns per pair. For millions of triangles use a tree instead.
    """
    starts = real_array(origins, "origins", (3,), "points")
    along = real_array(directions, "directions", (3,), "directions")
    corners = finite(real_array(vertices, "vertices", (-1, 3), "vertices as rows"), "vertices")
    numbers = as_given(faces, "faces")
    if corners.ndim != 2:
        raise ValueError(f"vertices: shape {corners.shape}; expected one mesh, (n, 3)")
    if numbers.ndim != 2 or numbers.shape[1] != 3 or (numbers.size and numbers.dtype.kind not in "iu"):
        raise ValueError(
            f"faces: shape {numbers.shape} of {numbers.dtype}; expected three integers for each triangle, (m, 3)"
        )
    if numbers.size and not (numbers.min() >= 0 and numbers.max() < len(corners)):
        raise ValueError(f"faces: vertices {numbers.min()} to {numbers.max()}; expected 0 to {len(corners) - 1}")
    try:
        starts, along = np.broadcast_arrays(starts, along)
    except ValueError:
        message = f"origins, directions: shapes {starts.shape} and {along.shape}; expected leading axes that broadcast"
        raise ValueError(message) from None
    leading, a, b, c = starts.shape[:-1], *(corners[numbers.astype(np.intp)[:, k]] for k in range(3))
    p, d = starts.reshape(-1, 1, 3), along.reshape(-1, 1, 3)
    kind = np.result_type(p, d, corners)
    distance, face = np.full(len(p), np.inf, kind), np.full(len(p), -1, np.intp)
    weights = np.full((len(p), 3), np.nan, kind)
    step = max(1, PAIRS // max(1, len(a)))
    for first in range(0, len(p) if len(a) else 0, step):
        block = slice(first, first + step)
        with np.errstate(all="ignore"):
            reached, inside = pga3.hit_ray_triangle(p[block], d[block], a, b, c)
        # Comparisons with NaN are false, so that triangles parallel to the ray are not hit.
        t = np.where((reached >= 0) & (reached < np.inf) & (inside >= 0).all(-1), reached, np.inf)
        best = t.argmin(-1)
        rows = np.arange(len(t))
        found = t[rows, best] < np.inf
        distance[block] = t[rows, best]
        face[block] = np.where(found, best, -1)
        weights[block] = np.where(found[:, None], inside[rows, best], np.nan)
    return MeshHit(distance.reshape(leading), face.reshape(leading), weights.reshape(*leading, 3))


def winding_numbers(points: Reals, vertices: Reals, faces: Integers) -> Integers:
    """Return how many times a closed mesh, of one solid or several, surrounds points.

    It is 0 outside of all solids. The solids may overlap, and a surface may intersect itself.

    Parameters
    ----------
    points : array, (k, 3)
        Not on the surface.
    vertices : array, (n, 3)
    faces : array of int, (m, 3)
        Each edge occurs equally often in both directions.

    Returns
    -------
    array of int, (k,)
        Positive where normals point outwards, and negative where they point inwards.

    Notes
    -----
    The number is how often a ray leaves the mesh, less how often it enters. A ray through an edge of a face may be
    counted twice. Hence two other rays are counted for points whose first one passes an edge, and the median is taken.
    """
    # Near the mesh, areas of shadows are precise wherever the origin is.
    middle = vertices.mean(0) if len(vertices) else np.zeros(3)
    points, vertices = points - middle, vertices - middle
    found, sure = _crossings(points, _RAYS[0], vertices, faces)
    doubtful = np.flatnonzero(~sure)
    if len(doubtful):
        others = [_crossings(points[doubtful], ray, vertices, faces)[0] for ray in _RAYS[1:]]
        found[doubtful] = np.median([found[doubtful], *others], axis=0)
    return found


def _crossings(points: Reals, along: Reals, vertices: Reals, faces: Integers) -> tuple[Integers, Flags]:
    """Return how often rays of one direction leave a mesh, less how often they enter, and which pass no edge, (k,)."""
    found, sure = np.zeros(len(points), np.intp), np.ones(len(points), bool)
    # A ray meets only faces whose shadows along it have its own within their bounds.
    across = np.linalg.svd(along[None])[2][1:]
    shadows, feet = across @ vertices.T, points @ across.T
    bounds = [each(*(side[k] for k in faces.T)) for side in shadows for each in (_least, _most)]
    step = max(1, PAIRS // max(len(faces), 1))
    for first in range(0, len(points), step):
        u, v = feet[first : first + step, :, None].swapaxes(0, 1)
        ray, face = np.nonzero((u >= bounds[0]) & (u <= bounds[1]) & (v >= bounds[2]) & (v <= bounds[3]))
        a, b, c = vertices[faces[face]].swapaxes(0, 1)
        with np.errstate(all="ignore"):
            t, inside = pga3.hit_ray_triangle(points[first + ray], along, a, b, c)
        least = inside.min(-1)
        met = (least >= 0) & (t > 0) & (t < np.inf)
        signs = np.sign(np.cross(b[met] - a[met], c[met] - a[met]) @ along)
        found[first : first + step] = np.bincount(ray[met], signs, len(u))
        sure[first + ray[~(np.abs(least) > NEGLIGIBLE)]] = False
    return found, sure


def _least(a: Reals, b: Reals, c: Reals) -> Reals:
    return np.asarray(np.minimum(np.minimum(a, b), c))


def _most(a: Reals, b: Reals, c: Reals) -> Reals:
    return np.asarray(np.maximum(np.maximum(a, b), c))


def checked_mesh(vertices: ArrayLike, faces: ArrayLike, name: str) -> tuple[Reals, Integers]:
    """Return vertices and faces as arrays if their shapes, types and values are valid."""
    points = finite(real_array(vertices, f"{name}: vertices", (-1, 3), "vertices as rows"), f"{name}: vertices")
    moderate(points.reshape(-1, 3), f"{name}: vertices")
    numbers = as_given(faces, f"{name}: faces")
    if points.ndim != 2:
        raise ValueError(f"{name}: vertices: shape {points.shape}; expected one mesh, (n, 3)")
    if numbers.size == 0:
        return points.astype(np.float64), np.zeros((0, 3), np.intp)
    if numbers.ndim != 2 or numbers.shape[1] != 3:
        raise ValueError(f"{name}: faces: shape {numbers.shape}; expected three integers for each triangle, (m, 3)")
    if numbers.dtype.kind not in "iu":
        raise TypeError(f"{name}: faces: dtype {numbers.dtype}; expected integers")
    if numbers.min() < 0 or numbers.max() >= len(points):
        raise ValueError(f"{name}: faces: vertices {numbers.min()} to {numbers.max()}; expected 0 to {len(points) - 1}")
    return points.astype(np.float64), numbers.astype(np.intp)


def is_closed(faces: Integers) -> bool:
    """Determine whether each edge occurs equally often in both directions."""
    count = int(faces.max()) + 1
    # Short integers are sorted in half the time.
    short = faces.astype(np.uint32) if count < 2**16 else faces
    ends = np.roll(short, -1, 1).ravel()
    starts = short.ravel()
    return bool(np.array_equal(np.sort(starts * count + ends), np.sort(ends * count + starts)))
