"""The unified model of omnidirectional cameras in conformal geometry: a unit sphere about the viewpoint.

A point X is projected to the point P in which its ray from the centre of the sphere meets the sphere. The line from the
pole N = (0, 0, -mirror) through P meets the plane ``z = 1 - mirror`` in the image (x, y), in the units of a perspective
camera with focal length 1. `mirror` is 1 for a parabolic mirror, less for a hyperbolic one and 0 without a mirror.
"""

import gacompiler as ga
from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import CGA3
from gacompiler.specs.families.conformal_space import ConformalSpace

CIRCLE = CGA3.CIRCLE
PLACE, IMAGE = array(SCALAR, 3), array(SCALAR, 2)
space = ConformalSpace(CGA3)
E3, E0, EINF = CGA3.basis()[2:]

PSEUDOSCALAR = "e0123inf"
DUAL_SPHERE = E0 - EINF / 2
"""The unit sphere about the origin."""


@kernel(mirror=SCALAR, least=SCALAR, place=PLACE, returns=IMAGE)
def project_place(mirror, least, place):
    """Project a point of space to the image (x, y).

    Division by 0 if the point is the viewpoint or the z component of its direction is at most `least`.
    """
    x, y, z = place
    length = ga.sqrt(x * x + y * y + z * z)
    w = ga.select(least * length < z, z + mirror * length, 0)
    return x / w, y / w


@kernel(mirror=SCALAR, image=IMAGE, returns=PLACE)
def lift_image(mirror, image):
    """Compute the point of the unit sphere with a given image; NaN outside the image of a mirror beyond 1."""
    x, y = image
    square = x * x + y * y
    scale = (mirror + ga.sqrt(1 + (1 - mirror * mirror) * square)) / (1 + square)
    return scale * x, scale * y, scale - mirror


@kernel(a=PLACE, b=PLACE, returns=CIRCLE)
def circle_of_line(a, b):
    """Compute the great circle in which the sphere meets the plane through its centre and the line of two points."""
    plane = E0 ^ space.point(*a) ^ space.point(*b) ^ EINF
    return ga.left_contraction(DUAL_SPHERE, plane)


@kernel(a=PLACE, b=PLACE, returns=CIRCLE)
def parabolic_image_of_line(a, b):
    """Compute the image circle, in the plane ``z = 0``, of the line through two points for a parabolic mirror.

    The inversion in the sphere about (0, 0, -1) through the equator takes the unit sphere to that plane.
    """
    plane = E0 ^ space.point(*a) ^ space.point(*b) ^ EINF
    inversion = E0 - E3 - EINF / 2
    return ga.sandwich(inversion, ga.left_contraction(DUAL_SPHERE, plane))


@kernel(mirror=SCALAR, a=PLACE, b=PLACE, returns=array(SCALAR, 6))
def image_conic_of_line(mirror, a, b):
    """Compute the conic of `projective2` that contains the images of the points of a line, for any mirror.

    With the normal n of the plane through the centre and ``s = n . (x, y, 1)`` it is ``mirror**2 n3 (n3 (1 + x**2 +
    y**2) - 2 s) = (1 - mirror**2) s**2``.
    """
    n = tuple(a[k] * b[m] - a[m] * b[k] for k, m in ((1, 2), (2, 0), (0, 1)))
    square = mirror * mirror
    rest, round_part = 1 - square, square * n[2] * n[2]
    return (
        round_part - rest * n[0] * n[0],
        -2 * rest * n[0] * n[1],
        round_part - rest * n[1] * n[1],
        -2 * n[0] * n[2],
        -2 * n[1] * n[2],
        -n[2] * n[2],
    )


@kernel(points=array(SCALAR, 5, 3))
def cross_ratio_of_rays(points):
    """Compute the cross-ratio {1, 2; 3, 4} of the planes through the viewpoint, point 0 and each of the other points.

    Brackets are outer products of the origin, three points and the point at infinity.
    """
    first = E0 ^ space.point(*points[0])

    def bracket_of(i, j):
        return (first ^ space.point(*points[i]) ^ space.point(*points[j]) ^ EINF)[PSEUDOSCALAR]

    return bracket_of(1, 3) * bracket_of(2, 4) / (bracket_of(1, 4) * bracket_of(2, 3))
