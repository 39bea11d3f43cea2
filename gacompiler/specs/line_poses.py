"""Poses of a camera from points and lines: three of them, and poses near others with the least truncated squares.

A pose [R | t] takes the frame of the points to that of the camera. An item is a point or a line of space, and what the
camera sees of it. Seven numbers are its place, a second place of a line, and 1 for a point or 0 for a line. Four
numbers are two pixels: both ends of what is seen of a line, or twice the pixel of a point. The offset of a line are the
distances of both pixels from its image.
"""

from fractions import Fraction

from gacompiler import SCALAR, array, each, kernel, maximum, minimum, select, sqrt, total
from gacompiler.specs.families.covariances import choose, cross, dot
from gacompiler.specs.families.descents import TINY, UNKNOWN, descend, truncated_equations
from gacompiler.specs.families.essential import nonzero
from gacompiler.specs.families.poses import matrix_of_pose, moved_pose
from gacompiler.specs.families.quadrics import common_points, point_of_root
from gacompiler.specs.families.rotations import quaternion_of_matrix
from gacompiler.specs.families.two_views import applied, product, rotation_matrix, transposed

THREE, POSE, NUMBERS = array(SCALAR, 3, 3), array(SCALAR, 3, 4), array(SCALAR, "n")
ITEMS, PIXELS = array(SCALAR, "n", 7, shared=True), array(SCALAR, "n", 4, shared=True)
OWN_ITEMS, OWN_PIXELS = array(SCALAR, "n", 7), array(SCALAR, "n", 4)
ALL = 10**20
"""A squared distance of pixels beyond which no limit is meant."""
GENERIC = tuple(tuple(Fraction(x, 15) for x in row) for row in ((-5, -14, -2), (-10, 5, -10), (10, -2, -11)))
"""A rotation for which no solution of usual scenes is a half turn, which has no parameters."""


def _quadric(m):
    """Return the coefficients of x^2, y^2, xy, and the polynomials in z of x, y and 1, of an equation of rotations.

    The rotation is that of the quaternion ``(1, x, y, z)``, times its square.
    """
    a, b, c = m
    squares = a[0] - b[1] - c[2], b[1] - a[0] - c[2], 2 * (a[1] + b[0])
    return squares, (
        [2 * (c[1] - b[2]), 2 * (a[2] + c[0])],
        [2 * (a[2] - c[0]), 2 * (b[2] + c[1])],
        [a[0] + b[1] + c[2], 2 * (b[0] - a[1]), c[2] - a[0] - b[1]],
    )


@kernel(first=THREE, second=THREE, third=THREE, returns=(array(SCALAR, 8), array(SCALAR, 3, 13)))
def rotation_polynomial(first, second, third):
    """Compute the polynomial of degree 8 whose real roots give the rotations R that solve three linear equations.

    The sums of products of the entries of R with those of each matrix vanish. For a quaternion these are three
    quadrics, of which the common points are sought.

    Returns
    -------
    coefficients
        Those after the first one, which is 1.
    pencil
        For three equations, the polynomials in z of x, y and 1, in ascending powers.
    """
    turned = [product(m, transposed(GENERIC)) for m in (first, second, third)]
    return common_points([_quadric(m) for m in turned])


@kernel(z=SCALAR, pencil=array(SCALAR, 3, 13), returns=THREE)
def rotation_of_root(z, pencil):
    """Compute the rotation from a root of `rotation_polynomial`."""
    return product(rotation_matrix(point_of_root(z, pencil)), GENERIC)


def _parts(pose):
    return [row[:3] for row in pose], [row[3] for row in pose]


def _placed(rotation, shift, place):
    return tuple(a + s for a, s in zip(applied(rotation, place), shift, strict=True))


def _offset(rotation, shift, k, dual, item, pixels):
    """Return the two offsets of an item, their derivatives by a step in the unit 1, and if it is in front."""
    one, other, is_point = _placed(rotation, shift, item[:3]), _placed(rotation, shift, item[3:6]), item[6]
    depth = nonzero(one[2])
    u, v = one[0] / depth, one[1] / depth
    point = [dot(row, (u, v, 1)) - p for row, p in zip(k[:2], pixels[:2], strict=True)]
    nearness = 1 / depth
    change = [
        (-u * v, 1 + u * u, -v, nearness, 0, -u * nearness),
        (-1 - v * v, u * v, u, 0, nearness, -v * nearness),
    ]
    point_slopes = [[dot(row[:2], column) for column in zip(*change, strict=True)] for row in k[:2]]
    along = [b - a for a, b in zip(one, other, strict=True)]
    normal = cross(one, other)
    line = applied(dual, normal)
    size = maximum(line[0] * line[0] + line[1] * line[1], TINY)
    inverse = 1 / sqrt(size)
    axes = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    changes = [applied(dual, cross(axis, normal)) for axis in axes]
    changes += [applied(dual, cross(axis, along)) for axis in axes]
    lines, line_slopes = [], []
    for p in (pixels[:2], pixels[2:]):
        off = inverse * dot(line, (*p, 1))
        lines.append(off)
        line_slopes.append([
            inverse * (dot(d, (*p, 1)) - off * inverse * (line[0] * d[0] + line[1] * d[1])) for d in changes
        ])  # fmt: skip
    front = select(is_point > 0, one[2], maximum(one[2], other[2]))
    off = choose(is_point > 0, tuple(point), tuple(lines))
    slopes = [choose(is_point > 0, tuple(a), tuple(b)) for a, b in zip(point_slopes, line_slopes, strict=True)]
    return off, slopes, front


def _square(rotation, shift, k, dual, item, pixels):
    off, _, front = _offset(rotation, shift, k, dual, item, pixels)
    return select(front > 0, dot(off, off), UNKNOWN)


@kernel(pose=POSE, k=THREE, dual=THREE, items=OWN_ITEMS, pixels=OWN_PIXELS, returns=NUMBERS)
def item_squares(pose, k, dual, items, pixels):
    """Compute squared offsets of items in a pose; 1e30 behind the camera. `dual` is the inverse of the transposed K."""
    rotation, shift = _parts(pose)
    return each(lambda x, y: _square(rotation, shift, k, dual, x, y), items, pixels)


@kernel(pose=POSE, k=THREE, dual=THREE, items=ITEMS, pixels=PIXELS, limit=SCALAR, returns=SCALAR)
def truncated_item_squares(pose, k, dual, items, pixels, limit):
    """Sum `item_squares`, each at most `limit`."""
    rotation, shift = _parts(pose)
    return total(lambda x, y: minimum(_square(rotation, shift, k, dual, x, y), limit), items, pixels)


@kernel(
    pose=POSE, k=THREE, dual=THREE, items=OWN_ITEMS, pixels=OWN_PIXELS, limit=SCALAR, at_most=SCALAR,
    returns=(POSE, array(SCALAR, 21), array(SCALAR, 4)),
)  # fmt: skip
def descend_item_pose(pose, k, dual, items, pixels, limit, at_most):
    """Find the pose near another with the least `item_squares`, each at most `limit`.

    Steps and results are those of `camera_poses.descend_pose`.
    """
    start, offset = _parts(pose)
    beyond = select(limit < ALL, 2 * limit, 0)

    def equations(state):
        rotation, shift = rotation_matrix(state[:4]), state[4:]
        unit = sqrt(dot(shift, shift))

        def of(item, pixel):
            off, slopes, front = _offset(rotation, shift, k, dual, item, pixel)
            square = dot(off, off) + select(front > 0, 0, beyond)
            scaled = [(*row[:3], *(unit * x for x in row[3:])) for row in slopes]
            return truncated_equations(tuple(zip(*scaled, strict=True)), off, square, limit)

        return total(of, items, pixels)

    found = descend((*quaternion_of_matrix(start), *offset), 6, equations, moved_pose, at_most)
    result = matrix_of_pose(found.state)
    return result, found.table, (found.cost, found.ended, found.steps, found.cost - found.gain)
