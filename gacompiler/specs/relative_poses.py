"""Relative poses of two calibrated cameras: five points, motions of an essential matrix, and least squares.

A point with the directions x and x' in two cameras fits an essential matrix E if ``x' E x = 0``. ``E = [t] R`` for the
motion ``R X + t`` from the first camera to the second, whose translation has no known length: it is 1 here. A motion is
the motor of G(3,0,1) that rotates by R and then translates by t, as in the module `pga3`.

Residuals are Sampson distances in pixels, and steps are in the five-dimensional manifold of motions. Pixels are
relative to a point of the image, such as the principal point; `left` and `right` are the inverses of the matrices K of
both cameras, for these coordinates.
"""

from fractions import Fraction
from typing import Any, NamedTuple

import gacompiler as ga
from gacompiler import SCALAR, array, each, iterate, kernel, maximum, minimum, select, sqrt, total
from gacompiler.algebra.catalog import PGA3
from gacompiler.frontend.equations import nonzero
from gacompiler.specs.families.covariances import choose, cross, dot, square
from gacompiler.specs.families.essential import constraints, eliminated, minus, null_space, pencil, times
from gacompiler.specs.families.rotations import quaternion_of_matrix
from gacompiler.specs.families.sights import DIRECTION, place_of, rotor_of, translator_of

MOTOR = PGA3.MOTOR
THREE, FIVE = array(SCALAR, 3, 3), array(SCALAR, 5, 2)
PIXELS, NUMBERS = array(SCALAR, "n", 2, shared=True), array(SCALAR, "n")
ROOT_TWO = 2**0.5
FIRST_DAMPING, LEAST_DAMPING, LARGEST_DAMPING = Fraction(1, 10**4), Fraction(1, 10**12), 10**8
"""Damping relative to the diagonal: at the start, where it has no effect, and where steps are shorter than rounding."""
SETTLED = Fraction(1, 10**14)
"""The part of the sum of squares by which a step must be expected to decrease it: less is rounding."""
ROUNDING = Fraction(1, 10**22)
"""A sum of squares of pixels below this is rounding."""
TINY = Fraction(1, 10**40)
UNKNOWN = 10**30
"""The sum of squares before the first step."""


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
    pairs = [[_unit((*p, 1)) for p in five] for five in (first, second)]
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


def _unit(vector):
    size = sqrt(dot(vector, vector))
    return tuple(x / size for x in vector)


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


def _matrix(quaternion):
    """Return the matrix of the rotation by a unit quaternion."""
    w, x, y, z = quaternion
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def _product(a, b):
    columns = tuple(zip(*b, strict=True))
    return tuple(tuple(dot(row, column) for column in columns) for row in a)


def _transposed(a):
    return tuple(zip(*a, strict=True))


def _applied(matrix, vector):
    return tuple(dot(row, vector) for row in matrix)


def _crossed(vector, matrix):
    """Return the matrix of which each column is the cross product of a vector and a column."""
    return _transposed([cross(vector, column) for column in _transposed(matrix)])


def _parts(m):
    """Return the quaternion and the translation of a unit motor."""
    moved = ga.sandwich(m, place_of((0, 0, 0)))
    return (m["1"], -m["e23"], m["e13"], -m["e12"]), tuple(moved[name] for name in DIRECTION)


@kernel(essential=THREE, returns=(MOTOR, MOTOR, MOTOR, MOTOR))
def motions_of_essential(essential):
    """Compute the four motions of an essential matrix of norm ``sqrt(2)``, with translations of length 1.

    The first two have the same rotation and opposite translations, and so have the last two, whose rotation is followed
    by a half turn about the translation (Horn, *Recovering Baseline and Orientation from Essential Matrix*, 1990).
    """
    columns = _transposed(essential)
    best = cross(columns[0], columns[1])
    longest = dot(best, best)
    for i, j in ((0, 2), (1, 2)):
        other = cross(columns[i], columns[j])
        size = dot(other, other)
        best, longest = choose(size > longest, other, best), maximum(size, longest)
    t = tuple(x / sqrt(nonzero(longest)) for x in best)
    cofactors = tuple(cross(essential[k], essential[m]) for k, m in ((1, 2), (2, 0), (0, 1)))
    turned = _crossed(t, essential)
    found = []
    for sign in (-1, 1):
        rotation = [[c + sign * x for c, x in zip(*rows, strict=True)] for rows in zip(cofactors, turned, strict=True)]
        rotor = rotor_of(quaternion_of_matrix(rotation))
        found += [translator_of(t) * rotor, translator_of([-x for x in t]) * rotor]
    return tuple(found)


@kernel(m=MOTOR, returns=THREE)
def essential_of_motion(m):
    """Compute the essential matrix of a unit motor."""
    quaternion, t = _parts(m)
    return _crossed(t, _matrix(quaternion))


@kernel(m=MOTOR, returns=array(SCALAR, 3))
def translation_of_motion(m):
    """Compute the translation of a unit motor, which rotates first."""
    return _parts(m)[1]


# Residuals.


def _sampson(fundamental, back, x, y):
    """Return the Sampson distance of a pair, its square's divisor, and the two epipolar lines."""
    line, other = _applied(fundamental, (*x, 1)), _applied(back, (*y, 1))
    size = line[0] * line[0] + line[1] * line[1] + other[0] * other[0] + other[1] * other[1]
    return line[0] * y[0] + line[1] * y[1] + line[2], size, line, other


@kernel(fundamental=THREE, first=PIXELS, second=PIXELS, limit=SCALAR, returns=SCALAR)
def truncated_squares(fundamental, first, second, limit):
    """Sum the squared Sampson distances of pairs of pixels, each at most `limit`."""
    back = _transposed(fundamental)

    def of(x, y):
        off, size, _, _ = _sampson(fundamental, back, x, y)
        return minimum(off * off / maximum(size, TINY), limit)

    return total(of, first, second)


@kernel(fundamental=THREE, first=PIXELS, second=PIXELS, returns=NUMBERS)
def squared_distances(fundamental, first, second):
    """Compute the squared Sampson distance of each pair of pixels."""
    back = _transposed(fundamental)

    def of(x, y):
        off, size, _, _ = _sampson(fundamental, back, x, y)
        return off * off / maximum(size, TINY)

    return each(of, first, second)


@kernel(fundamental=THREE, first=PIXELS, second=PIXELS, returns=array(SCALAR, "n", 4))
def epipolar_normals(fundamental, first, second):
    """Compute for each pair, as a point (x, y, x', y'), the unit normal of the pairs that fit F."""
    back = _transposed(fundamental)

    def of(x, y):
        _, size, line, other = _sampson(fundamental, back, x, y)
        inverse = 1 / sqrt(maximum(size, TINY))
        return tuple(inverse * a for a in (other[0], other[1], line[0], line[1]))

    return each(of, first, second)


class _Descent(NamedTuple):
    """The motion with the least sum of squares so far, the next one, and the normal equations of the former."""

    quaternion: Any
    shift: Any
    next_quaternion: Any
    next_shift: Any
    table: Any
    slope: Any
    cost: Any
    damping: Any
    done: Any


def _tangents(t):
    """Return two unit vectors orthogonal to a unit vector and to each other (Duff et al., JCGT 6, 2017)."""
    x, y, z = t
    sign = select(z < 0, -1, 1)
    a = -1 / (sign + z)
    b = x * y * a
    return (1 + sign * x * x * a, sign * b, -sign * x), (b, sign + y * y * a, -y)


def _moved(quaternion, shift, step):
    """Return a motion after a small rotation and a step of its translation on the sphere."""
    w, x, y, z = quaternion
    a, b, c = (s / 2 for s in step[:3])
    turned = (
        w - a * x - b * y - c * z,
        x + a * w + b * z - c * y,
        y + b * w + c * x - a * z,
        z + c * w + a * y - b * x,
    )
    u, v = _tangents(shift)
    moved = tuple(s + step[3] * p + step[4] * q for s, p, q in zip(shift, u, v, strict=True))
    return _unit(turned), _unit(moved)


def _derivatives(quaternion, shift, left, right):
    """Return the fundamental matrix of a motion, and its derivatives by rotations and by the two tangents."""
    rotation, down = _matrix(quaternion), _transposed(right)
    axes = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    matrices = [_crossed(shift, rotation), *(_crossed(shift, _crossed(axis, rotation)) for axis in axes)]
    matrices += [_crossed(u, rotation) for u in _tangents(shift)]
    return [_product(_product(down, each_), left) for each_ in matrices]


def _sampson_sums(distance, x, y, changes, limit):
    """Return the normal equations of one pair within the limit, and its truncated square."""
    off, size, line, other = distance
    inverse = 1 / sqrt(maximum(size, TINY))
    residual = off * inverse
    weight = select(residual * residual < limit, 1, 0)
    part = residual * inverse
    near = [(a - part * b) * inverse for a, b in zip((*y, 1), (line[0], line[1], 0), strict=True)]
    far = [part * inverse * b for b in other[:2]]
    outer = [[n * a for a in (*x, 1)] for n in near]
    for i, j in ((0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1)):
        outer[i][j] = outer[i][j] - far[j] * (*y, 1)[i]
    entries = [entry for row in outer for entry in row]
    rows = [dot([entry for row in change for entry in row], entries) for change in changes]
    table = tuple(weight * rows[i] * rows[j] for i in range(5) for j in range(i, 5))
    return (*table, *(weight * row * residual for row in rows), minimum(residual * residual, limit))


def _equations(quaternion, shift, left, right, first, second, limit):
    """Return the normal equations of pairs within the limit, and the sum of truncated squares."""
    fundamental, *changes = _derivatives(quaternion, shift, left, right)
    back = _transposed(fundamental)

    def of(x, y):
        return _sampson_sums(_sampson(fundamental, back, x, y), x, y, changes, limit)

    return total(of, first, second)


def _equations_in_front(quaternion, shift, left, right, onto, first, second, limit):
    """Return what `_equations` does, for pairs of points that are in front of the cameras or at infinity."""
    fundamental, *changes = _derivatives(quaternion, shift, left, right)
    back, rotation = _transposed(fundamental), _matrix(quaternion)

    def of(x, y):
        off, size, line, other = _sampson(fundamental, back, x, y)
        _, _, in_front = _met(rotation, shift, left, right, x, y, off / maximum(size, TINY), line, other)
        own = _sampson_sums((off, size, line, other), x, y, changes, limit)
        table, slope, square_ = _transfer_sums(rotation, left, onto, x, y, limit)
        wide = [0] * 15
        for k, position in enumerate((0, 1, 2, 5, 6, 9)):
            wide[position] = table[k]
        return choose(in_front > 0, own, (*wide, *slope, 0, 0, square_))

    return total(of, first, second)


def _step_of(table, slope, damping):
    """Return the damped step, and the decrease of the sum of squares that it is expected to cause."""
    matrix = square(table, len(slope))
    damped = [list(row) for row in matrix]
    for k in range(len(slope)):
        damped[k][k] = matrix[k][k] * (1 + damping) + TINY
    step, _ = ga.solve_symmetric(damped, slope)
    return [-x for x in step], dot(step, slope)


def _descended(m, equations, at_most):
    """Return the motion to which steps from a motor lead, the normal equations there, and numbers of the descent."""
    quaternion, shift = _parts(m)

    def body(now):
        sums = equations(now.next_quaternion, now.next_shift)
        better = sums[20] < now.cost
        old = (*now.quaternion, *now.shift, *now.table, *now.slope, now.cost)
        kept = choose(better, (*now.next_quaternion, *now.next_shift, *sums), old)
        damping = select(better, maximum(now.damping / 10, LEAST_DAMPING), now.damping * 10)
        q, t, table, slope, cost = kept[:4], kept[4:7], kept[7:22], kept[22:27], kept[27]
        step, gain = _step_of(table, slope, damping)
        ended = select(gain <= SETTLED * cost + ROUNDING, 1, select(damping > LARGEST_DAMPING, 1, 0))
        next_q, next_t = _moved(q, t, step)
        return _Descent(q, t, next_q, next_t, table, slope, cost, damping, ended)

    start = _Descent(quaternion, shift, quaternion, shift, (0,) * 15, (0,) * 5, UNKNOWN, 10 * FIRST_DAMPING, 0)
    found, ended, steps = iterate(body, start, lambda _, new: new.done > 0, at_most)
    return translator_of(found.shift) * rotor_of(found.quaternion), found.table, (found.cost, ended, steps)


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
        return _equations(quaternion, shift, left, right, first, second, limit)

    return _descended(m, equations, at_most)


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
        return _equations_in_front(quaternion, shift, left, right, onto, first, second, limit)

    return _descended(m, equations, at_most)


@kernel(m=MOTOR, step=array(SCALAR, 5), returns=MOTOR)
def move_motion(m, step):
    """Compute the motion after a step: a rotation vector, and a change of the translation along its tangents."""
    quaternion, shift = _parts(m)
    quaternion, shift = _moved(quaternion, shift, step)
    return translator_of(shift) * rotor_of(quaternion)


@kernel(t=array(SCALAR, 3), returns=(array(SCALAR, 3), array(SCALAR, 3)))
def tangents_of_direction(t):
    """Compute two unit vectors that are orthogonal to a unit vector and to each other."""
    return _tangents(t)


# Rotations.


def _transfer(rotation, left, onto, x, y):
    """Return the offset of a pixel from its partner under a rotation, the inverse of its covariance, and the place.

    The covariance is that of noise in both images.
    """
    ray = _applied(left, (*x, 1))
    turned = _applied(rotation, ray)
    depth = select(turned[2] > 0, turned[2], 1)
    place = turned[0] / depth, turned[1] / depth
    columns = [_applied(rotation, column) for column in _transposed(left)[:2]]
    inner = [[(c[k] - place[k] * c[2]) / depth for c in columns] for k in (0, 1)]
    change = _product([row[:2] for row in onto[:2]], inner)
    off = [dot(row, (*place, 1)) - b for row, b in zip(onto[:2], y, strict=True)]
    a, b = 1 + dot(change[0], change[0]), dot(change[0], change[1])
    c = 1 + dot(change[1], change[1])
    scale = 1 / (a * c - b * b)
    return off, (c * scale, -b * scale, a * scale), (*place, turned[2])


def _met(rotation, t, left, right, x, y, part, line, other):
    """Return the depth at which the lines of sight of the nearest pair meet, the first line, and if it is in front."""
    ray = _applied(left, (x[0] - part * other[0], x[1] - part * other[1], 1))
    sight = _applied(right, (y[0] - part * line[0], y[1] - part * line[1], 1))
    turned = _applied(rotation, ray)
    aa, ab, bb = dot(turned, turned), dot(turned, sight), dot(sight, sight)
    at, bt = dot(turned, t), dot(sight, t)
    normal = cross(turned, sight)
    inverse = 1 / maximum(dot(normal, normal), TINY)
    depth, depth_there = (ab * bt - bb * at) * inverse, (aa * bt - ab * at) * inverse
    return depth, ray, select(depth > 0, select(depth_there > 0, 1, 0), 0)


def _form(weights, a, b):
    xx, xy, yy = weights
    return xx * a[0] * b[0] + xy * (a[0] * b[1] + a[1] * b[0]) + yy * a[1] * b[1]


def _transfer_sums(rotation, left, onto, x, y, limit):
    """Return the normal equations of one pair by a rotation, if it is within the limit, and its truncated square."""
    off, weights, (u, v, depth) = _transfer(rotation, left, onto, x, y)
    found = select(depth > 0, _form(weights, off, off), 2 * limit)
    weight = select(found < limit, 1, 0)
    moved = ((-u * v, 1 + u * u, -v), (-1 - v * v, u * v, u))
    rows = _transposed(_product([row[:2] for row in onto[:2]], moved))
    table = tuple(weight * _form(weights, rows[i], rows[j]) for i in range(3) for j in range(i, 3))
    return table, tuple(weight * _form(weights, row, off) for row in rows), minimum(found, limit)


class _Turning(NamedTuple):
    quaternion: Any
    next_quaternion: Any
    table: Any
    slope: Any
    cost: Any
    damping: Any
    done: Any


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
    quaternion, _ = _parts(m)

    def sums(q):
        rotation = _matrix(q)
        return total(lambda x, y: _transfer_sums(rotation, left, onto, x, y, limit), first, second)

    def body(now):
        table, slope, cost = sums(now.next_quaternion)
        better = cost < now.cost
        kept = choose(
            better, (*now.next_quaternion, *table, *slope, cost), (*now.quaternion, *now.table, *now.slope, now.cost)
        )  # fmt: skip
        damping = select(better, maximum(now.damping / 10, LEAST_DAMPING), now.damping * 10)
        step, gain = _step_of(kept[4:10], kept[10:13], damping)
        w, x, y, z = kept[:4]
        a, b, c = (s / 2 for s in step)
        turned = _unit(
            (w - a * x - b * y - c * z, x + a * w + b * z - c * y, y + b * w + c * x - a * z, z + c * w + a * y - b * x)
        )
        small = select(gain <= SETTLED * kept[13] + ROUNDING, 1, select(damping > LARGEST_DAMPING, 1, 0))
        return _Turning(kept[:4], turned, kept[4:10], kept[10:13], kept[13], damping, small)

    start = _Turning(quaternion, quaternion, (0,) * 6, (0,) * 3, UNKNOWN, 10 * FIRST_DAMPING, 0)
    found, ended, _ = iterate(body, start, lambda _, new: new.done > 0, at_most)
    return rotor_of(found.quaternion), found.table, (found.cost, ended)


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
    quaternion, t = _parts(m)
    rotation = _matrix(quaternion)
    fundamental = _product(_product(_transposed(right), _crossed(t, rotation)), left)
    back = _transposed(fundamental)

    def of(x, y):
        off, size, line, other = _sampson(fundamental, back, x, y)
        size = maximum(size, TINY)
        part = off / size
        depth, ray, in_front = _met(rotation, t, left, right, x, y, part, line, other)
        gap, weights, (_, _, ahead) = _transfer(rotation, left, onto, x, y)
        far = select(ahead > 0, _form(weights, gap, gap), UNKNOWN)
        return part * off, far, tuple(depth * r for r in ray), in_front

    return each(of, first, second)


@kernel(m=MOTOR, left=THREE, onto=THREE, first=PIXELS, returns=array(SCALAR, "n", 2))
def turned_pixels(m, left, onto, first):
    """Compute the pixels of the second image in which points at infinity appear, by the rotation of a motor."""
    rotation = _matrix(_parts(m)[0])

    def of(x):
        turned = _applied(rotation, _applied(left, (*x, 1)))
        return tuple(dot(row, turned) / turned[2] for row in onto[:2])

    return each(of, first)
