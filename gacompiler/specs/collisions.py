"""Clearances of capsules: between each other, from triangles, and from planes.

A capsule is the set of points whose distance from a segment, its axis, is at most a radius; a sphere if the ends of the
axis are equal. Clearances are distances of surfaces: negative if bodies intersect. Points and planes are those of
G(3,0,1), as in the module `pga3`: the signed distance of a point from a plane is their join.
"""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, array, fold, kernel, select, sqrt
from gacompiler.algebra.catalog import PGA3
from gacompiler.specs.families.covariances import cross, dot

POINT, PLANE = PGA3.POINT, PGA3.PLANE
VECTOR = array(SCALAR, 3)
TRIANGLES = array(SCALAR, "m", 3, 3, shared=True)
PLANES = array(SCALAR, "k", 4, shared=True)
TINY, FAR = Fraction(1, 10**30), float(2**100)


def _minus(a, b):
    return tuple(x - y for x, y in zip(a, b, strict=True))


def _share(x):
    return ga.minimum(ga.maximum(x, 0), 1)


def _square_of_segments(p, d, q, e):
    """Return the squared distance of the segments from p to p + d and from q to q + e."""
    off = _minus(p, q)
    dd, ee, de, dr, er = dot(d, d), dot(e, e), dot(d, e), dot(d, off), dot(e, off)
    # Nearest points of the lines, then of each segment to the point of the other: exact after both are bounded.
    s = _share((de * er - dr * ee) / (dd * ee - de * de + TINY))
    t = _share((de * s + er) / (ee + TINY))
    s = _share((de * t - dr) / (dd + TINY))
    gap = [x + s * a - t * b for x, a, b in zip(off, d, e, strict=True)]
    return dot(gap, gap)


def _square_of_triangle(p, d, corners):
    """Return the squared distance of the segment from p to p + d from a triangle."""
    a, b, c = corners
    edges = _minus(b, a), _minus(c, b), _minus(a, c)
    normal = cross(edges[0], edges[1])
    square = dot(normal, normal)
    least = _square_of_segments(p, d, a, edges[0])
    least = ga.minimum(least, _square_of_segments(p, d, b, edges[1]))
    least = ga.minimum(least, _square_of_segments(p, d, c, edges[2]))
    # The point of the segment that is nearest to the plane: if it is above the triangle, nothing else is nearer.
    height, slope = dot(normal, _minus(p, a)), dot(normal, d)
    s = _share(-height / select(slope * slope > TINY * square, slope, 1))
    nearest = [x + s * y for x, y in zip(p, d, strict=True)]
    sides = [dot(cross(normal, e), _minus(nearest, v)) for e, v in zip(edges, corners, strict=True)]
    inside = ga.minimum(sides[0], ga.minimum(sides[1], sides[2]))
    away = height + s * slope
    return select((inside >= 0) * (square > TINY), ga.minimum(least, away * away / (square + TINY)), least)


@kernel(start=VECTOR, end=VECTOR, other_start=VECTOR, other_end=VECTOR, radii=SCALAR, returns=SCALAR)
def capsule_pair_clearance(start, end, other_start, other_end, radii):
    """Compute the distance of two capsules, negative if they intersect.

    Parameters
    ----------
    start, end
        The ends of the axis of a capsule.
    other_start, other_end
        The ends of the axis of the other one.
    radii
        The sum of both radii.
    """
    square = _square_of_segments(start, _minus(end, start), other_start, _minus(other_end, other_start))
    return sqrt(square) - radii


@kernel(triangles=TRIANGLES, start=VECTOR, end=VECTOR, radius=SCALAR, returns=SCALAR)
def capsule_triangle_clearance(triangles, start, end, radius):
    """Compute the least distance of a capsule from triangles, negative if its surface meets one of them.

    Parameters
    ----------
    triangles
        The corners of each triangle. Triangles without area are segments or points.
    start, end
        The ends of the axis of the capsule.
    radius
        The radius.
    """
    along = _minus(end, start)
    least = fold(lambda low, corners: ga.minimum(low, _square_of_triangle(start, along, corners)), FAR, triangles)
    return sqrt(least) - radius


@kernel(planes=PLANES, start=POINT, end=POINT, radius=SCALAR, returns=SCALAR)
def capsule_plane_clearance(planes, start, end, radius):
    """Compute the least distance of a capsule above planes, negative if a part of it is below one of them.

    Parameters
    ----------
    planes
        Unit planes e1, e2, e3, e0, whose normals point to the side of the capsule.
    start, end
        The ends of the axis of the capsule.
    radius
        The radius.
    """

    def height(plane):
        whole = ga.assemble(PGA3, dict(zip(PLANE.blades, plane, strict=True)))
        return ga.minimum((whole & start)["1"], (whole & end)["1"])

    return fold(lambda low, plane: ga.minimum(low, height(plane)), FAR, planes) - radius
