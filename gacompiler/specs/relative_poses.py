"""Relative poses of two calibrated cameras: five points, motions of an essential matrix, and least squares.

A point with the directions x and x' in two cameras fits an essential matrix E if ``x' E x = 0``. ``E = [t] R`` for the
motion ``R X + t`` from the first camera to the second, whose translation has no known length: it is 1 here. A motion is
the motor of G(3,0,1) that rotates by R and then translates by t, as in the module `pga3`.

Residuals are Sampson distances in pixels, and steps are in the five-dimensional manifold of motions. Pixels are
relative to a point of the image, such as the principal point; `left` and `right` are the inverses of the matrices K of
both cameras, for these coordinates.
"""

import math

import gacompiler as ga
from gacompiler import SCALAR, array, each, kernel, maximum, minimum, select, sqrt, total
from gacompiler.algebra.catalog import PGA3
from gacompiler.specs.families.covariances import choose, cross, dot
from gacompiler.specs.families.descents import TINY, UNKNOWN, descend
from gacompiler.specs.families.essential import constraints, eliminated, minus, nonzero, null_space, pencil, times
from gacompiler.specs.families.rotations import quaternion_of_matrix
from gacompiler.specs.families.sights import rotor_of, translator_of
from gacompiler.specs.families.two_views import (
    applied,
    crossed,
    descended,
    form,
    met,
    moved,
    normal_equations,
    normal_equations_in_front,
    parts,
    product,
    rotation_matrix,
    sampson,
    tangents,
    transfer,
    transfer_sums,
    transposed,
    turned_by,
    unit,
)

MOTOR = PGA3.MOTOR
THREE, FIVE = array(SCALAR, 3, 3), array(SCALAR, 5, 2)
PIXELS, NUMBERS = array(SCALAR, "n", 2, shared=True), array(SCALAR, "n")
ROOT_TWO = math.sqrt(2)


@kernel(first=FIVE, second=FIVE, returns=(array(SCALAR, 10), array(SCALAR, 3, 13), array(SCALAR, 4, 9)))
def five_point_polynomial(first, second):
    """Compute the polynomial of degree 10 whose real roots give the essential matrices of five pairs of directions.

    Parameters
    ----------
    first, second
        The directions (x, y, 1) of five points in both cameras.

    Returns
    -------
    coefficients
        Those after the first one, which is 1.
    pencil
        For three equations, the factors of x, y and 1, each a polynomial in z, in descending powers.
    basis
        Four matrices X, Y, Z, W. The essential matrices are ``x X + y Y + z Z + W``.
    """
    pairs = [[unit((*p, 1)) for p in five] for five in (first, second)]
    basis = null_space([[b * a for b in y for a in x] for x, y in zip(*pairs, strict=True)])
    e, f, g, h, i, j = eliminated(constraints(basis))
    equations = [pencil(*rows) for rows in ((e, f), (g, h), (i, j))]
    (a, b, c), (d, u, v), (p, q, r) = equations
    parts = (times(minus(times(d, q), times(u, p)), c), times(minus(times(p, b), times(q, a)), v),
             times(minus(times(a, u), times(b, d)), r))  # fmt: skip
    first_, *others = [x + y + z for x, y, z in zip(*parts, strict=True)]
    scale = 1 / nonzero(first_)
    rows = tuple(tuple(x for part in row for x in part) for row in equations)
    return tuple(scale * x for x in others), rows, tuple(basis)


def _value(polynomial, z):
    found = polynomial[0]
    for x in polynomial[1:]:
        found = found * z + x
    return found


@kernel(z=SCALAR, pencil=array(SCALAR, 3, 13), basis=array(SCALAR, 4, 9), returns=THREE)
def essential_of_root(z, pencil, basis):
    """Compute the essential matrix of norm ``sqrt(2)`` from a root of `five_point_polynomial`."""
    rows = [tuple(_value(row[begin:end], z) for begin, end in ((0, 4), (4, 8), (8, 13))) for row in pencil]
    best, longest = cross(rows[0], rows[1]), None
    longest = dot(best, best)
    for i, j in ((0, 2), (1, 2)):
        other = cross(rows[i], rows[j])
        size = dot(other, other)
        best, longest = choose(size > longest, (*other, size), (*best, longest))[:3], ga.maximum(size, longest)
    x, y, w = best
    factors = (x, y, z * w, w)
    scale = ROOT_TWO / sqrt(dot(factors, factors))
    entries = [scale * dot(factors, column) for column in zip(*basis, strict=True)]
    return tuple(tuple(entries[3 * k : 3 * k + 3]) for k in range(3))


# Motions.


@kernel(essential=THREE, returns=(MOTOR, MOTOR, MOTOR, MOTOR))
def motions_of_essential(essential):
    """Compute the four motions of an essential matrix of norm ``sqrt(2)``, with translations of length 1.

    The first two have the same rotation and opposite translations, and so have the last two, whose rotation is followed
    by a half turn about the translation (Horn, *Recovering Baseline and Orientation from Essential Matrix*, 1990).
    """
    columns = transposed(essential)
    best = cross(columns[0], columns[1])
    longest = dot(best, best)
    for i, j in ((0, 2), (1, 2)):
        other = cross(columns[i], columns[j])
        size = dot(other, other)
        best, longest = choose(size > longest, other, best), maximum(size, longest)
    t = tuple(x / sqrt(nonzero(longest)) for x in best)
    cofactors = tuple(cross(essential[k], essential[m]) for k, m in ((1, 2), (2, 0), (0, 1)))
    turned = crossed(t, essential)
    found = []
    for sign in (-1, 1):
        rotation = [[c + sign * x for c, x in zip(*rows, strict=True)] for rows in zip(cofactors, turned, strict=True)]
        rotor = rotor_of(quaternion_of_matrix(rotation))
        found += [translator_of(t) * rotor, translator_of([-x for x in t]) * rotor]
    return tuple(found)


@kernel(m=MOTOR, returns=THREE)
def essential_of_motion(m):
    """Compute the essential matrix of a unit motor."""
    quaternion, t = parts(m)
    return crossed(t, rotation_matrix(quaternion))


@kernel(m=MOTOR, returns=array(SCALAR, 3))
def translation_of_motion(m):
    """Compute the translation of a unit motor, which rotates first."""
    return parts(m)[1]


# Residuals.


@kernel(fundamental=THREE, first=PIXELS, second=PIXELS, limit=SCALAR, returns=SCALAR)
def truncated_squares(fundamental, first, second, limit):
    """Sum the squared Sampson distances of pairs of pixels, each at most `limit`."""
    back = transposed(fundamental)

    def of(x, y):
        off, size, _, _ = sampson(fundamental, back, x, y)
        return minimum(off * off / maximum(size, TINY), limit)

    return total(of, first, second)


@kernel(fundamental=THREE, first=PIXELS, second=PIXELS, returns=NUMBERS)
def squared_distances(fundamental, first, second):
    """Compute the squared Sampson distance of each pair of pixels."""
    back = transposed(fundamental)

    def of(x, y):
        off, size, _, _ = sampson(fundamental, back, x, y)
        return off * off / maximum(size, TINY)

    return each(of, first, second)


@kernel(fundamental=THREE, first=PIXELS, second=PIXELS, returns=array(SCALAR, "n", 4))
def epipolar_normals(fundamental, first, second):
    """Compute for each pair, as a point (x, y, x', y'), the unit normal of the pairs that fit F."""
    back = transposed(fundamental)

    def of(x, y):
        _, size, line, other = sampson(fundamental, back, x, y)
        inverse = 1 / sqrt(maximum(size, TINY))
        return tuple(inverse * a for a in (other[0], other[1], line[0], line[1]))

    return each(of, first, second)


@kernel(
    m=MOTOR, left=THREE, right=THREE, first=PIXELS, second=PIXELS, limit=SCALAR, at_most=SCALAR,
    returns=(MOTOR, array(SCALAR, 15), array(SCALAR, 3)),
)  # fmt: skip
def descend_motion(m, left, right, first, second, limit, at_most):
    """Find the motion near another with the least squares of Sampson distances, each at most `limit`.

    Parameters
    ----------
    m
        A unit motor with a translation of length 1.
    limit
        Squared distances are truncated here, so that pairs beyond it have no influence.
    at_most
        The maximum number of steps, by Levenberg and Marquardt.

    Returns
    -------
    motor
    triangle
        The upper triangle of the normal equations, by a rotation vector that follows the motor and by two tangents of
        the translation, those of `tangents_of_direction`.
    numbers
        The sum of truncated squares, 1 if a minimum was reached, else 0, and the number of steps.
    """

    def equations(quaternion, shift):
        return normal_equations(quaternion, shift, left, right, first, second, limit)

    return descended(m, equations, at_most)


@kernel(
    m=MOTOR, left=THREE, right=THREE, onto=THREE, first=PIXELS, second=PIXELS, limit=SCALAR, at_most=SCALAR,
    returns=(MOTOR, array(SCALAR, 15), array(SCALAR, 3)),
)  # fmt: skip
def descend_motion_in_front(m, left, right, onto, first, second, limit, at_most):
    """Find what `descend_motion` does if points must be in front of both cameras.

    The distance of a pair whose point would be behind a camera is that from the nearest pair of a point at infinity.

    Parameters
    ----------
    onto
        The matrix K of the second camera. The other parameters and the results are those of `descend_motion`.
    """

    def equations(quaternion, shift):
        return normal_equations_in_front(quaternion, shift, left, right, onto, first, second, limit)

    return descended(m, equations, at_most)


@kernel(m=MOTOR, step=array(SCALAR, 5), returns=MOTOR)
def move_motion(m, step):
    """Compute the motion after a step: a rotation vector, and a change of the translation along its tangents."""
    quaternion, shift = parts(m)
    quaternion, shift = moved(quaternion, shift, step)
    return translator_of(shift) * rotor_of(quaternion)


@kernel(t=array(SCALAR, 3), returns=(array(SCALAR, 3), array(SCALAR, 3)))
def tangents_of_direction(t):
    """Compute two unit vectors that are orthogonal to a unit vector and to each other."""
    return tangents(t)


# Rotations.


@kernel(
    m=MOTOR, left=THREE, onto=THREE, first=PIXELS, second=PIXELS, limit=SCALAR, at_most=SCALAR,
    returns=(MOTOR, array(SCALAR, 6), array(SCALAR, 2)),
)  # fmt: skip
def descend_rotation(m, left, onto, first, second, limit, at_most):
    """Find the rotation near that of a motor with the least squared distances of pairs without parallax.

    Parameters
    ----------
    m
        A unit motor, of which only the rotation is used.
    left, onto
        The inverse of the matrix K of the first camera, and the matrix K of the second.
    limit, at_most
        As in `descend_motion`. A point behind the second camera counts as `limit`.

    Returns
    -------
    motor
        A rotation.
    triangle
        The upper triangle of the normal equations, by a rotation vector that follows it.
    numbers
        The sum of truncated squares, and 1 if a minimum was reached, else 0.
    """
    quaternion, _ = parts(m)

    def sums(state):
        rotation = rotation_matrix(state)
        table, slope, cost = total(lambda x, y: transfer_sums(rotation, left, onto, x, y, limit), first, second)
        return (*table, *slope, cost)

    found = descend(quaternion, 3, sums, turned_by, at_most)
    return rotor_of(found.state), found.table, (found.cost, found.ended)


@kernel(
    m=MOTOR, left=THREE, right=THREE, onto=THREE, first=PIXELS, second=PIXELS,
    returns=(NUMBERS, NUMBERS, array(SCALAR, "n", 3), NUMBERS),
)  # fmt: skip
def explain_pairs(m, left, right, onto, first, second):
    """Compute how well a motion explains each pair of pixels, and the point that they show.

    Returns
    -------
    squares
        Squared Sampson distances from the nearest pair whose lines of sight meet.
    far
        Squared Sampson distances from the nearest pair that shows a point at infinity; 1e30 behind the second camera.
    points
        The points in which the lines of sight of the nearest pairs meet, in the frame of the first camera.
    in_front
        1 if the point is in front of both cameras, else 0.
    """
    quaternion, t = parts(m)
    rotation = rotation_matrix(quaternion)
    fundamental = product(product(transposed(right), crossed(t, rotation)), left)
    back = transposed(fundamental)

    def of(x, y):
        off, size, line, other = sampson(fundamental, back, x, y)
        size = maximum(size, TINY)
        part = off / size
        depth, ray, in_front = met(rotation, t, left, right, x, y, part, line, other)
        gap, weights, (_, _, ahead) = transfer(rotation, left, onto, x, y)
        far = select(ahead > 0, form(weights, gap, gap), UNKNOWN)
        return part * off, far, tuple(depth * r for r in ray), in_front

    return each(of, first, second)


@kernel(m=MOTOR, left=THREE, onto=THREE, first=PIXELS, returns=array(SCALAR, "n", 2))
def turned_pixels(m, left, onto, first):
    """Compute the pixels of the second image in which points at infinity appear, by the rotation of a motor."""
    rotation = rotation_matrix(parts(m)[0])

    def of(x):
        turned = applied(rotation, applied(left, (*x, 1)))
        return tuple(dot(row, turned) / turned[2] for row in onto[:2])

    return each(of, first)
