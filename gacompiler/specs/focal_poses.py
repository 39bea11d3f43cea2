"""Poses with an unknown focal length: of a camera that sees five points, and between two cameras with the same one.

Pixels are relative to the principal point, and they are square: the point (x, y, z) of the frame of a camera has the
pixel ``f (x, y) / z``. A camera is the matrix ``diag(f, f, 1) [R | t]``, which takes the frame of the points to
homogeneous pixels.
"""

import gacompiler as ga
from gacompiler import SCALAR, array, kernel, maximum, minimum, select, sqrt, total
from gacompiler.algebra.catalog import PGA3
from gacompiler.specs.families.covariances import cross, dot
from gacompiler.specs.families.descents import descend, truncated_equations
from gacompiler.specs.families.essential import nonzero, null_space, times
from gacompiler.specs.families.focal import products_of_views
from gacompiler.specs.families.poses import matrix_of_pose, moved_pose
from gacompiler.specs.families.rotations import quaternion_of_matrix
from gacompiler.specs.families.sights import rotor_of, translator_of
from gacompiler.specs.families.two_views import (
    applied,
    derivatives,
    moved,
    parts,
    rotation_matrix,
    sampson,
    sampson_sums,
    transposed,
    unit,
)

MOTOR, THREE, POSE = PGA3.MOTOR, array(SCALAR, 3, 3), array(SCALAR, 3, 4)
PIXELS = array(SCALAR, "n", 2, shared=True)
OWN_PIXELS, OWN_PLACES = array(SCALAR, "n", 2), array(SCALAR, "n", 3)
ALL = 10**20
"""A squared distance of pixels beyond which no limit is meant."""


def _conic(first, second):
    """Return the polynomials in y of the powers of x in the product of two vectors ``x a + y b + c``, ascending."""
    (a, b, c), (p, q, r) = first, second
    return [
        [dot(c, r), dot(b, r) + dot(c, q), dot(b, q)],
        [dot(a, r) + dot(c, p), dot(a, q) + dot(b, p)],
        [dot(a, p)],
    ]


def _difference(one, two):
    return [[a - b for a, b in zip(p, q, strict=True)] for p, q in zip(one, two, strict=True)]


def _minus(a, b):
    n = max(len(a), len(b))
    padded = [[*p, *(0 for _ in range(n - len(p)))] for p in (a, b)]
    return [x - y for x, y in zip(*padded, strict=True)]


def _at(polynomial, x):
    value = polynomial[-1]
    for coefficient in polynomial[-2::-1]:
        value = value * x + coefficient
    return value


@kernel(places=array(SCALAR, 5, 3), pixels=array(SCALAR, 5, 2), returns=(array(SCALAR, 4, 3, 4), array(SCALAR, 4)))
def cameras_of_five(places, pixels):
    """Compute the cameras that see five points in given pixels, in space or on a plane.

    The directions of the pixels from the principal point are five linear equations for the first two rows of the
    camera, which do not depend on the focal length. These rows are orthogonal and of the same length, so that they are
    the common points of two conics. The focal length and the depth then follow from linear equations. Kukelova,
    Bujnak and Pajdla, *Real-time solution to the absolute pose problem with unknown radial distortion and focal
    length*, ICCV 2013. For complex solutions, which noise makes of double ones, the real part is used.

    Parameters
    ----------
    places, pixels
        Both of the order of 1.

    Returns
    -------
    cameras
    is_there
        1 if all points are in front of the camera, else 0.
    """
    rows = [
        (*(v * x for x in (*place, 1)), *(-u * x for x in (*place, 1)))
        for place, (u, v) in zip(places, pixels, strict=True)
    ]
    basis = null_space(rows)
    first, second = [b[:3] for b in basis], [b[4:7] for b in basis]
    (c, b, (a,)), (r, q, (p,)) = _conic(first, second), _difference(_conic(first, first), _conic(second, second))
    low, middle = _minus([a * x for x in r], [p * x for x in c]), _minus([a * x for x in q], [p * x for x in b])
    high = _minus(times(b, r), times(q, c))
    quartic = _minus(times(low, low), times(middle, high))
    roots, _, _ = ga.quartic_roots(*quartic[::-1])
    cameras, there = [], []
    for y in roots:
        x = -_at(low, y) / nonzero(_at(middle, y))
        whole = [x * i + y * j + k for i, j, k in zip(*basis, strict=True)]
        size = 1 / nonzero(sqrt(dot(whole[:3], whole[:3])))
        one, two = [size * i for i in whole[:4]], [size * i for i in whole[4:]]
        last = unit(cross(one[:3], two[:3]))
        across = cross(last, one[:3])
        rotation = one[:3], across, last
        sums = [0, 0, 0, 0, 0]
        seen = []
        for place, (u, v) in zip(places, pixels, strict=True):
            beside = dot(one, (*place, 1)), dot(across, place) + two[3]
            radius = u * u + v * v
            along, depth = u * beside[0] + v * beside[1], dot(last, place)
            seen.append(depth)
            for k, term in enumerate(
                (along * along, -along * radius, radius * radius, along * depth * radius, -radius * depth * radius)
            ):
                sums[k] = sums[k] + term
        scale = 1 / nonzero(sums[0] * sums[2] - sums[1] * sums[1])
        focal = scale * (sums[2] * sums[3] - sums[1] * sums[4])
        far = scale * (sums[0] * sums[4] - sums[1] * sums[3])
        sign = select(focal < 0, -1, 1)
        length = sign * focal
        upper = [
            [sign * length * i for i in (*row, shift)]
            for row, shift in zip(rotation[:2], (one[3], two[3]), strict=True)
        ]
        cameras.append((*(tuple(row) for row in upper), (*last, far)))
        nearest = seen[0]
        for depth in seen[1:]:
            nearest = minimum(nearest, depth)
        there.append(select(nearest + far > 0, select(length > 0, 1, 0), 0))
    return tuple(cameras), tuple(there)


@kernel(
    camera=POSE, places=OWN_PLACES, pixels=OWN_PIXELS, limit=SCALAR, at_most=SCALAR,
    returns=(POSE, SCALAR, array(SCALAR, 28), array(SCALAR, 4)),
)  # fmt: skip
def descend_camera(camera, places, pixels, limit, at_most):
    """Find the pose and focal length near those of a camera with the least squares of distances in pixels.

    Steps of Levenberg and Marquardt are by a rotation vector that follows the pose, by a translation in units of the
    distance of the origin from the camera, and by the logarithm of the focal length. Points behind the camera count as
    `limit`, unless it is 1e20 or more: all points are used then, and those behind have the images that formulas give.

    Returns
    -------
    pose
        [R | t]
    focal
    triangle
        The upper triangle of the normal equations, by a step.
    numbers
        The sum of truncated squares, 1 if a minimum was reached, else 0, the number of steps, and the sum that linear
        equations at the pose would leave.
    """
    length = sqrt(dot(camera[0][:3], camera[0][:3]) / nonzero(dot(camera[2][:3], camera[2][:3])))
    last = unit(camera[2][:3])
    inverse = 1 / nonzero(length)
    rotation_rows = [[inverse * x for x in row[:3]] for row in camera[:2]] + [last]
    beyond = select(limit < ALL, 2 * limit, 0)

    def equations(state):
        rotation, shift, focal = rotation_matrix(state[:4]), state[4:7], state[7]
        size = sqrt(dot(shift, shift))

        def of(place, pixel):
            x, y, z = (a + s for a, s in zip(applied(rotation, place), shift, strict=True))
            depth = nonzero(z)
            u, v = x / depth, y / depth
            image = focal * u, focal * v
            off = [a - b for a, b in zip(image, pixel, strict=True)]
            square = dot(off, off) + select(z > 0, 0, beyond)
            nearness = focal * size / depth
            turned = ((-v * image[0], focal + u * image[0], -image[1]), (-focal - v * image[1], u * image[1], image[0]))
            shifted = ((nearness, 0, -u * nearness), (0, nearness, -v * nearness))
            change = [(*a, *b, c) for a, b, c in zip(turned, shifted, image, strict=True)]
            return truncated_equations(tuple(zip(*change, strict=True)), off, square, limit)

        return total(of, places, pixels)

    def stepped(state, step):
        return *moved_pose(state[:7], step[:6]), state[7] * ga.exp(maximum(minimum(step[6], 1), -1))

    offset = [inverse * camera[0][3], inverse * camera[1][3], camera[2][3]]
    found = descend((*quaternion_of_matrix(rotation_rows), *offset, length), 7, equations, stepped, at_most)
    pose = matrix_of_pose(found.state[:7])
    return pose, found.state[7], found.table, (found.cost, found.ended, found.steps, found.cost - found.gain)


# Two views.


@kernel(first=array(SCALAR, 6, 2), second=array(SCALAR, 6, 2), returns=(array(SCALAR, 3, 10, 10), array(SCALAR, 3, 9)))
def equations_of_six(first, second):
    """Compute the equations of the fundamental matrices of six pairs with an unknown focal length f.

    Six pairs leave matrices ``x X + y Y + Z``. With the matrix ``diag(1, 1, w)`` and ``w = 1 / f^2``, the conditions of
    an essential matrix are ten cubic equations in x and y whose coefficients are polynomials in w. Kukelova, Bujnak and
    Pajdla, *Polynomial eigenvalue solutions to the 5-pt and 6-pt relative pose problems*, BMVC 2008.

    Parameters
    ----------
    first, second
        Pixels in units of the order of the focal length.

    Returns
    -------
    equations
        The coefficients of 1, w and w^2, each those of the monomials x^3, x^2 y, x y^2, y^3, x^2, x y, y^2, x, y and 1
        in the ten equations.
    basis
        X, Y and Z, of norm 1.
    """
    pairs = [[unit((*p, 1)) for p in six] for six in (first, second)]
    basis = null_space([[b * a for b in y for a in x] for x, y in zip(*pairs, strict=True)])
    return products_of_views(basis), tuple(basis)


def _with_focal_length(matrices, focal):
    """Return fundamental matrices of pixels for directions, and the derivative of the first by the logarithm of f."""
    inverse = 1 / focal
    scales = (inverse, inverse, 1)
    scaled = [[[s * r * x for s, x in zip(scales, row, strict=True)] for r, row in zip(scales, m, strict=True)]
              for m in matrices]  # fmt: skip
    powers = (1, 1, 0)
    change = [[-(a + b) * x for b, x in zip(powers, row, strict=True)]
              for a, row in zip(powers, scaled[0], strict=True)]  # fmt: skip
    return scaled, change


@kernel(
    m=MOTOR, focal=SCALAR, first=PIXELS, second=PIXELS, limit=SCALAR, at_most=SCALAR,
    returns=(MOTOR, SCALAR, array(SCALAR, 21), array(SCALAR, 3)),
)  # fmt: skip
def descend_motion_and_focal(m, focal, first, second, limit, at_most):
    """Find the motion and focal length near others with the least squares of Sampson distances, each at most `limit`.

    Parameters
    ----------
    m
        A unit motor with a translation of length 1, from the frame of the first camera to that of the second.
    limit
        Squared distances are truncated here, so that pairs beyond it have no influence.
    at_most
        The maximum number of steps, by Levenberg and Marquardt.

    Returns
    -------
    motor
    focal
    triangle
        The upper triangle of the normal equations, by a rotation vector that follows the motor, by two tangents of the
        translation, and by the logarithm of the focal length.
    numbers
        The sum of truncated squares, 1 if a minimum was reached, else 0, and the number of steps.
    """
    quaternion, shift = parts(m)
    identity = ((1, 0, 0), (0, 1, 0), (0, 0, 1))

    def equations(state):
        matrices, change = _with_focal_length(derivatives(state[:4], state[4:7], identity, identity), state[7])
        fundamental, *changes = matrices
        back = transposed(fundamental)

        def of(x, y):
            return sampson_sums(sampson(fundamental, back, x, y), x, y, [*changes, change], limit)

        return total(of, first, second)

    def stepped(state, step):
        turned, t = moved(state[:4], state[4:7], step)
        return (*turned, *t, state[7] * ga.exp(maximum(minimum(step[5], 1), -1)))

    found = descend((*quaternion, *shift, focal), 6, equations, stepped, at_most)
    motion = translator_of(found.state[4:7]) * rotor_of(found.state[:4])
    return motion, found.state[7], found.table, (found.cost, found.ended, found.steps)
