"""Poses with an unknown focal length: of a camera that sees four points, and between two cameras with the same one.

Pixels are relative to the principal point, and they are square: the point (x, y, z) of the frame of a camera has the
pixel ``f (x, y) / z``. A camera is the matrix ``diag(f, f, 1) [R | t]``, which takes the frame of the points to
homogeneous pixels.
"""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, array, kernel, maximum, minimum, select, sqrt, total
from gacompiler.algebra.catalog import PGA3
from gacompiler.specs.families.covariances import cross, dot
from gacompiler.specs.families.descents import descend, truncated_equations
from gacompiler.specs.families.essential import nonzero, null_space
from gacompiler.specs.families.focal import products_of_views
from gacompiler.specs.families.poses import matrix_of_pose, moved_pose
from gacompiler.specs.families.quadrics import common_points, point_of_root, quadric
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
GENERIC = tuple(
    tuple(Fraction(x, 11) for x in row) for row in ((1, -2, -4, -10), (2, 1, -10, 4), (4, 10, 1, -2), (10, -4, 2, 1))
)
"""An orthogonal matrix after which usual scenes, such as points with z = 0, have no special coordinates."""
ALL = 10**20
"""A squared distance of pixels beyond which no limit is meant."""


@kernel(
    places=array(SCALAR, 4, 3), pixels=array(SCALAR, 4, 2),
    returns=(array(SCALAR, 8), array(SCALAR, 3, 13), array(SCALAR, 4, 3, 4)),
)  # fmt: skip
def equations_of_four(places, pixels):
    """Compute the polynomial of degree 8 whose real roots give the cameras that see four points in given pixels.

    The pixels are eight linear equations for the 3 x 4 entries of a camera, which leave sums of four matrices. The
    first two rows of its left part have the same length and are orthogonal, also to the last one. Of these four
    quadrics, three determine the camera (P4Pf, which has one equation more than unknowns); the fourth is left out.

    Parameters
    ----------
    places, pixels
        Both of the order of 1.

    Returns
    -------
    coefficients
        Those after the first one, which is 1.
    pencil
        For three equations, the polynomials in z of x, y and 1, in ascending powers.
    basis
        The four matrices, of which 1, x, y and z are the factors.
    """
    rows = []
    for place, (u, v) in zip(places, pixels, strict=True):
        whole = (*place, 1)
        rows.append((*whole, *(0 for _ in whole), *(-u * x for x in whole)))
        rows.append((*(0 for _ in whole), *whole, *(-v * x for x in whole)))
    solutions = null_space(rows)
    mixed = [[dot(weights, column) for column in transposed(solutions)] for weights in GENERIC]
    basis = [(b[:4], b[4:8], b[8:]) for b in mixed]

    def of(i, j):
        return quadric(lambda a, b: dot(basis[a][i][:3], basis[b][j][:3]))

    def difference(a, b):
        return dot(basis[a][0][:3], basis[b][0][:3]) - dot(basis[a][1][:3], basis[b][1][:3])

    coefficients, pencil = common_points([of(0, 1), quadric(difference), of(0, 2)])
    return coefficients, pencil, tuple(basis)


@kernel(
    z=SCALAR, pencil=array(SCALAR, 3, 13), basis=array(SCALAR, 4, 3, 4), places=array(SCALAR, 4, 3),
    returns=(POSE, SCALAR),
)  # fmt: skip
def camera_of_root(z, pencil, basis, places):
    """Compute the camera from a root of `equations_of_four`, and 1 if all points are in front of it, else 0."""
    factors = point_of_root(z, pencil)
    rows = [[dot(factors, [b[i][k] for b in basis]) for k in range(4)] for i in range(3)]
    last = unit(cross(rows[0][:3], rows[1][:3]))
    scale = 1 / nonzero(dot(last, rows[2][:3]))
    one, two = ([scale * x for x in row] for row in rows[:2])
    across = cross(last, one[:3])
    far = scale * rows[2][3]
    nearest = dot(last, places[0])
    for place in places[1:]:
        nearest = minimum(nearest, dot(last, place))
    return ((*one[:3], one[3]), (*across, two[3]), (*last, far)), select(nearest + far > 0, 1, 0)


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
