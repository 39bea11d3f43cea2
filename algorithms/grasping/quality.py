"""Wrenches of contacts with friction, and the quality of a grasp after Ferrari and Canny."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import ArrayLike

from generated import grasping, pga3

from ..arguments import Reals, finite, finite_number, real_array
from ..precision import ROUNDING


def contact_wrenches(
    contacts: ArrayLike,
    normals: ArrayLike,
    friction: float = 0.5,
    edges: int = 8,
    centre: ArrayLike = (0.0, 0.0, 0.0),
    torsion: float = 0.0,
) -> Reals:
    """Return the wrenches of the forces on the edges of friction cones, as lines of G(3,0,1).

    Parameters
    ----------
    contacts : array_like, (c, 3)
    normals : array_like, (c, 3)
        Outward unit normals.
    friction : float
        The coefficient of friction, positive.
    edges : int
        The number of edges of each cone, at least 3.
    centre : array_like, (3,)
        The point about which moments are computed.
    torsion : float
        Of soft fingers, which resist torques about the normal: the largest torque for a normal force of 1, a length.

    Returns
    -------
    array, (c, edges, 6), or (c, edges + 2, 6) with torsion
        Each force has the normal component 1 and points into the object. The wrench is the join of the contact and the
        force; its first three coefficients are the force and the last three the moment, up to their order and signs.
        The last two rows of a soft finger are its normal force with the largest torque in either direction. All their
        combinations are within the ellipsoid of forces and torques at which a soft finger slips.

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or is not finite, a normal has no length, `friction` is not positive, `torsion`
        is negative, or there are too few edges.
    """
    p = finite(real_array(contacts, "contacts", (-1, 3), "points as rows"), "contacts")
    n = finite(real_array(normals, "normals", (-1, 3), "vectors as rows"), "normals")
    origin = finite(real_array(centre, "centre", (3,), "a point"), "centre")
    if p.ndim != 2 or p.shape != n.shape:
        raise ValueError(f"contacts, normals: shapes {p.shape} and {n.shape}; expected (c, 3) for both")
    if not finite_number(friction, "friction") > 0:
        raise ValueError(f"friction: {friction}; expected a positive number")
    if not finite_number(torsion, "torsion") >= 0:
        raise ValueError(f"torsion: {torsion}; expected a length of at least 0")
    if isinstance(edges, bool) or not isinstance(edges, (int, np.integer)) or edges < 3:
        raise ValueError(f"edges: {edges}; expected an integer of at least 3")
    size = np.linalg.norm(n, axis=1, keepdims=True)
    if not (size > 0).all():
        raise ValueError(f"normals: row {int(np.argmin(size))} has the length 0; expected vectors with a direction")
    n = n / size
    # Of equal components the first one, also with rounding errors.
    smallest = np.eye(3)[np.argmin(np.round(np.abs(n), 8), axis=1)]
    u = np.cross(n, smallest)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(n, u)
    angles = 2 * np.pi * np.arange(edges) / edges
    rows = ((p - origin)[:, None], n[:, None], u[:, None], v[:, None])
    found: Reals = grasping.contact_wrench(*rows, friction, np.cos(angles), np.sin(angles))
    if torsion == 0:
        return found
    pushed = np.stack([np.cross(p - origin, -n) + sign * torsion * n for sign in (1, -1)], 1)
    twisted = pga3.line_from_direction_moment(np.repeat(-n[:, None], 2, 1), pushed)
    return np.concatenate([found, twisted.astype(found.dtype)], 1)


def grasp_quality(
    contacts: ArrayLike,
    normals: ArrayLike,
    friction: float = 0.5,
    edges: int = 8,
    centre: ArrayLike = (0.0, 0.0, 0.0),
    length: float = 1.0,
    torsion: float = 0.0,
) -> float:
    """Compute the quality of a grasp: the largest wrench that it resists in every direction.

    It is the radius of the largest ball about the origin in the convex hull of the wrenches of `contact_wrenches`, with
    moments divided by `length` (Ferrari and Canny, 1992; the sum of the normal forces is 1). The grasp has force
    closure if the quality is positive.

    Parameters
    ----------
    contacts, normals, friction, edges, centre, torsion
        As in `contact_wrenches`.
    length : float
        The length by which moments are divided.

    Returns
    -------
    float
        0 if the grasp has no force closure.

    Raises
    ------
    TypeError, ValueError
        As in `contact_wrenches`, and if `length` is not positive.
    """
    if not finite_number(length, "length") > 0:
        raise ValueError(f"length: {length}; expected a positive number")
    wrenches = contact_wrenches(contacts, normals, friction, edges, centre, torsion).reshape(-1, 6)
    scaled = wrenches / np.array([1, 1, 1, length, length, length])
    planes = _facets(scaled)
    return 0.0 if planes is None else max(0.0, -float(planes[:, -1].max()))


def _facets(points: Reals) -> Reals | None:
    """Return the planes (f, 7) of the facets of the convex hull of points (n, 6); None if it has no volume."""
    # Without the merging of facets that lie in one plane up to rounding errors, Qhull is three times as fast. The
    # result is right if no point is outside a facet.
    for options in ("Q0", None):
        try:
            planes: Reals = scipy.spatial.ConvexHull(points, qhull_options=options).equations
        except (scipy.spatial.QhullError, ValueError):
            # Rounding errors, or the points span less than six dimensions.
            continue
        if options is None or (points @ planes[:, :-1].T + planes[:, -1]).max() < ROUNDING * np.abs(points).max():
            return planes
    return None
