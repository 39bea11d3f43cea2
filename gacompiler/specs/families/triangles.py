"""Triangles of points in space."""

from gacompiler.specs.families.covariances import cross
from gacompiler.specs.families.two_views import product, transposed, unit


def frame_of(triangle):
    """Return orthonormal axes, as rows, of a triangle: its first edge, the normal of this in its plane, the normal."""
    edge, other = [[b - a for a, b in zip(triangle[0], p, strict=True)] for p in triangle[1:]]
    x = unit(edge)
    z = unit(cross(x, other))
    return x, cross(z, x), z


def pose_between(places, points):
    """Return the pose [R | t], as rows, that takes a triangle to a congruent one."""
    rotation = product(transposed(frame_of(points)), frame_of(places))
    middle, centre = (
        [sum(column[1:], column[0]) / 3 for column in zip(*each_, strict=True)] for each_ in (places, points)
    )
    shift = [x - sum(a * b for a, b in zip(row, middle, strict=True)) for x, row in zip(centre, rotation, strict=True)]
    return tuple((*row, s) for row, s in zip(rotation, shift, strict=True))
