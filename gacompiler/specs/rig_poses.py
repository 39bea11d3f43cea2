"""Poses of a rig of cameras from points: three points, and poses near others with the least truncated squares.

A pose [R | t] takes the frame of the points to that of the rig. Each point is seen by a camera of the rig: a sight is
the pixel and the camera matrix ``K [R | t]``, row by row, from the frame of the rig to pixels.
"""

from gacompiler import SCALAR, array, each, kernel, minimum, select, total
from gacompiler.specs.families.covariances import cross, dot
from gacompiler.specs.families.descents import UNKNOWN, descend, truncated_equations
from gacompiler.specs.families.essential import nonzero, times
from gacompiler.specs.families.rotations import quaternion_of_matrix
from gacompiler.specs.families.triangles import pose_between
from gacompiler.specs.families.two_views import applied, rotation_matrix, turned_by

THREE, POSE, NUMBERS = array(SCALAR, 3, 3), array(SCALAR, 3, 4), array(SCALAR, "n")
SIGHT = 14
PLACES, SIGHTS = array(SCALAR, "n", 3, shared=True), array(SCALAR, "n", SIGHT, shared=True)
OWN_PLACES, OWN_SIGHTS = array(SCALAR, "n", 3), array(SCALAR, "n", SIGHT)
ALL = 10**20
"""A squared distance of pixels beyond which no limit is meant."""
NEWTON = 3
"""Steps that remove the rounding errors of a root."""


def _minus(a, b):
    return [x - y for x, y in zip(a, b, strict=True)]


def _sum(*polynomials):
    """Return the sum of polynomials, in ascending powers."""
    n = max(map(len, polynomials))
    return [sum(p[k] for p in polynomials if k < len(p)) for k in range(n)]


def _equations(places, centres, rays):
    """Return the equations of the depths of pairs of points, and the polynomials in the first depth of those with it.

    The distance of the points ``o + s d`` and ``p + u e`` is known: ``s^2 + u^2 + a s u + b s + c u + d = 0``.
    """
    found = []
    for i, j in ((0, 1), (0, 2), (1, 2)):
        apart, edge = _minus(centres[i], centres[j]), _minus(places[i], places[j])
        numbers = -2 * dot(rays[i], rays[j]), 2 * dot(rays[i], apart), -2 * dot(rays[j], apart)
        found.append((*numbers, dot(apart, apart) - dot(edge, edge)))
    return found


def _parts(equations):
    """Return the polynomials b, c, e, f, A, B, M in the first depth, and the number k.

    With the depths u and v of the other points, ``u^2 + b u + c = 0``, ``v^2 + e v + f = 0`` and
    ``v (k u + M) + A u + B = 0``.
    """
    first, second, (k, low, middle, rest) = equations
    (b, c), (e, f) = (((x[2], x[0]), (x[3], x[1], 1)) for x in (first, second))
    a = [low - b[0], -b[1]]
    m = [middle - e[0], -e[1]]
    return b, c, e, f, a, [rest - c[0] - f[0], -c[1] - f[1], -2], m, k


def _linear(parts):
    """Return the polynomials P and Q in the first depth with ``P u + Q = 0`` for the second depth u."""
    b, c, e, f, a, own, m, k = parts

    def scaled(factor, p):
        return [factor * x for x in p]

    square = times(a, a)
    mixed = _sum(times(a, m), scaled(k, own), scaled(-k, times(b, a)))
    p = _sum(
        scaled(2, times(a, own)), scaled(-1, times(b, square)), scaled(-1, times(e, mixed)),
        times(f, _sum(scaled(2 * k, m), scaled(-k * k, b))),
    )  # fmt: skip
    q = _sum(
        times(own, own), scaled(-1, times(c, square)),
        scaled(-1, times(e, _sum(times(own, m), scaled(-k, times(c, a))))),
        times(f, _sum(times(m, m), scaled(-k * k, c))),
    )  # fmt: skip
    return p, q


@kernel(places=THREE, centres=THREE, rays=THREE, returns=array(SCALAR, 8))
def depth_polynomial(places, centres, rays):
    """Compute the polynomial of degree 8 of the depth of the first of three points.

    Parameters
    ----------
    places
        Three points, whose distances are of the order of 1.
    centres, rays
        The centres of the cameras that see them, and unit vectors to them, in the frame of the rig.

    Returns
    -------
    coefficients
        Those after the first one, which is 1.
    """
    parts = _parts(_equations(places, centres, rays))
    p, q = _linear(parts)
    b, c = parts[:2]
    found = _sum(times(q, q), [-x for x in times(b, times(q, p))], times(c, times(p, p)))
    scale = 1 / nonzero(found[8])
    return tuple(scale * x for x in found[7::-1])


def _at(polynomial, x):
    value = polynomial[-1]
    for coefficient in polynomial[-2::-1]:
        value = value * x + coefficient
    return value


@kernel(depth=SCALAR, places=THREE, centres=THREE, rays=THREE, returns=(POSE, SCALAR))
def pose_of_depth(depth, places, centres, rays):
    """Compute the pose of a rig from a root of `depth_polynomial`.

    Returns
    -------
    pose
    is_there
        1 if all points are in front of their cameras, else 0.
    """
    equations = _equations(places, centres, rays)
    parts = _parts(equations)
    p, q = _linear(parts)
    _, _, _, _, a, own, m, k = parts
    other = -_at(q, depth) / nonzero(_at(p, depth))
    last = -(_at(a, depth) * other + _at(own, depth)) / nonzero(k * other + _at(m, depth))
    depths = [depth, other, last]
    for _ in range(NEWTON):
        values, rows = [], []
        for (i, j), (x, y, z, w) in zip(((0, 1), (0, 2), (1, 2)), equations, strict=True):
            s, u = depths[i], depths[j]
            values.append(s * s + u * u + x * s * u + y * s + z * u + w)
            row = [0, 0, 0]
            row[i], row[j] = 2 * s + x * u + y, 2 * u + x * s + z
            rows.append(row)
        columns = tuple(zip(*rows, strict=True))
        minors = [cross(columns[1], columns[2]), cross(columns[2], columns[0]), cross(columns[0], columns[1])]
        size = nonzero(dot(columns[0], minors[0]))
        depths = [s - dot(minor, values) / size for s, minor in zip(depths, minors, strict=True)]
    points = [
        [o + s * x for o, x in zip(centre, ray, strict=True)]
        for centre, s, ray in zip(centres, depths, rays, strict=True)
    ]
    there = select(depths[0] > 0, select(depths[1] > 0, select(depths[2] > 0, 1, 0), 0), 0)
    return pose_between(places, points), there


def _seen(rotation, shift, place, sight):
    """Return the offset of the image of a point from its pixel, the image, the depth, and the point in the rig."""
    point = [a + s for a, s in zip(applied(rotation, place), shift, strict=True)]
    rows = sight[2:6], sight[6:10], sight[10:14]
    x, y, z = (dot(row, (*point, 1)) for row in rows)
    depth = nonzero(z)
    image = x / depth, y / depth
    return [a - b for a, b in zip(image, sight[:2], strict=True)], image, z, point


def _pose(pose):
    return [row[:3] for row in pose], [row[3] for row in pose]


def _square(rotation, shift, place, sight):
    off, _, z, _ = _seen(rotation, shift, place, sight)
    return select(z > 0, dot(off, off), UNKNOWN)


@kernel(pose=POSE, places=OWN_PLACES, sights=OWN_SIGHTS, returns=NUMBERS)
def sight_squares(pose, places, sights):
    """Compute squared distances of pixels from the images of points in a pose; 1e30 behind the camera."""
    rotation, shift = _pose(pose)
    return each(lambda x, y: _square(rotation, shift, x, y), places, sights)


@kernel(pose=POSE, places=PLACES, sights=SIGHTS, limit=SCALAR, returns=SCALAR)
def truncated_sight_squares(pose, places, sights, limit):
    """Sum `sight_squares`, each at most `limit`."""
    rotation, shift = _pose(pose)
    return total(lambda x, y: minimum(_square(rotation, shift, x, y), limit), places, sights)


@kernel(
    pose=POSE, places=OWN_PLACES, sights=OWN_SIGHTS, limit=SCALAR, at_most=SCALAR,
    returns=(POSE, array(SCALAR, 21), array(SCALAR, 4)),
)  # fmt: skip
def descend_rig_pose(pose, places, sights, limit, at_most):
    """Find the pose of a rig near another with the least `sight_squares`, each at most `limit`.

    Steps of Levenberg and Marquardt are by a rotation vector and a translation that follow the pose. Points behind
    their cameras count as `limit`, unless it is 1e20 or more: all points are used then.

    Returns
    -------
    pose
    triangle
        The upper triangle of the normal equations, by a step.
    numbers
        The sum of truncated squares, 1 if a minimum was reached, else 0, the number of steps, and the sum that linear
        equations at the pose would leave.
    """
    start, offset = _pose(pose)
    beyond = select(limit < ALL, 2 * limit, 0)

    def equations(state):
        rotation, shift = rotation_matrix(state[:4]), state[4:]

        def of(place, sight):
            off, image, z, point = _seen(rotation, shift, place, sight)
            square = dot(off, off) + select(z > 0, 0, beyond)
            depth = nonzero(z)
            slopes = [
                [(a - p * c) / depth for a, c in zip(row, sight[10:13], strict=True)]
                for row, p in zip((sight[2:5], sight[6:9]), image, strict=True)
            ]
            rows = [(*cross(point, slope), *slope) for slope in slopes]
            return truncated_equations(tuple(zip(*rows, strict=True)), off, square, limit)

        return total(of, places, sights)

    def moved(state, step):
        turned = turned_by((1, 0, 0, 0), step[:3])
        after = applied(rotation_matrix(turned), state[4:])
        return (*turned_by(state[:4], step[:3]), *(a + s for a, s in zip(after, step[3:], strict=True)))

    found = descend((*quaternion_of_matrix(start), *offset), 6, equations, moved, at_most)
    rows = rotation_matrix(found.state[:4])
    result = tuple((*row, s) for row, s in zip(rows, found.state[4:], strict=True))
    return result, found.table, (found.cost, found.ended, found.steps, found.cost - found.gain)
