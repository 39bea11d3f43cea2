"""Filters that estimate a motor of G(3,0,1) from lines, points and planes.

A measured object is the moved object ``m x ~m`` of a model, with noise. The error of a motor is a bivector x in the
frame of reference: the true motor is ``exp(-x/2) m``. Covariances refer to the coefficients of x in the order of lines,
e12 e13 e23 e01 e02 e03, and are passed as upper triangles, row by row. Lines and planes need not be unit; what is not
finite is not used.

The residuals of a line are the deviations of its direction, and of its moment about the point of the predicted line
that is closest to the origin, both along two directions orthogonal to the line. These four numbers determine a line, so
that their covariance is regular; that of the six coefficients is not.
"""

from fractions import Fraction
from typing import Any, NamedTuple

import gacompiler as ga
from gacompiler import SCALAR, array, assemble, fold, iterate, kernel, scan, select, sqrt, total
from gacompiler.algebra.catalog import PGA3
from gacompiler.specs.families.covariances import (
    UNMEASURED,
    are_finite,
    choose,
    congruent,
    cross,
    dot,
    measured,
    size_of_triangle,
    square,
    triangle,
)
from gacompiler.specs.families.frames import across

MOTOR, EVEN, LINE, POINT, PLANE = PGA3.MOTOR, PGA3.EVEN, PGA3.LINE, PGA3.POINT, PGA3.PLANE
TANGENT, COVARIANCE, PAIR = array(SCALAR, 6), array(SCALAR, size_of_triangle(6)), array(SCALAR, 2)
TINY = Fraction(1, 10**200)
BASIS = [PGA3.multivector({name: 1}) for name in LINE.blades]
SMALLEST_SINE = Fraction(1, 10**9)
HALF_TURN = 3
"""The length of the change between nearly opposite vectors, in an arbitrary direction."""
STEPS = 30
"""Maximum number of linearisations of an update."""


# Residuals and their derivatives.


def _direction(line):
    return line["e23"], -line["e13"], line["e12"]


def _moment(line):
    return line["e01"], line["e02"], line["e03"]


def _bivector(numbers):
    return assemble(PGA3, dict(zip(LINE.blades, numbers, strict=True)))


def _coefficients(bivector):
    return tuple(bivector[name] for name in LINE.blades)


def _row(turning, moving):
    """Return the derivatives of ``turning . w + moving . v`` by the error: rotation w, translation v of the origin."""
    return turning[2], -turning[1], turning[0], *moving


def _scaled(factor, vector):
    return tuple(factor * x for x in vector)


def _minus(a, b):
    return tuple(x - y for x, y in zip(a, b, strict=True))


def _unit(direction, more):
    size = dot(direction, direction)
    scale = 1 / sqrt(select(size > 0, size, 1))
    return _scaled(scale, direction), _scaled(scale, more), size > 0


def _turn(d, e, u, v):
    """Return the components, along u and v, of the change from the unit vector d to e, as long as their angle.

    Unlike the difference of the vectors, it does not become small again for angles of more than 90 degrees.
    """
    a, b = dot(u, e), dot(v, e)
    sine, cosine = sqrt(a * a + b * b), dot(d, e)
    is_small = sine < SMALLEST_SINE
    factor = select(is_small, 1, ga.atan2(sine, cosine) / select(is_small, 1, sine))
    return select(is_small * (cosine < 0), HALF_TURN, factor * a), factor * b


def _of_line(motor, model, seen):
    """Return residuals and rows of a line, those of the direction first, and whether the line can be used."""
    predicted = ga.sandwich(motor, model)
    d, m, one = _unit(_direction(predicted), _moment(predicted))
    e, n, two = _unit(_direction(seen), _moment(seen))
    u, v = across(d)
    place = cross(d, m)
    own = _minus(n, cross(place, e))
    residuals = *_turn(d, e, u, v), dot(u, own), dot(v, own)
    # A rotation w changes d by w x d, whose part along u is w . v, and the moment by what the place moves, times d.
    rows = (
        _row(v, (0, 0, 0)),
        _row(_scaled(-1, u), (0, 0, 0)),
        _row(cross(place, v), v),
        _row(_scaled(-1, cross(place, u)), _scaled(-1, u)),
    )
    return residuals, rows, one * two * are_finite((*e, *n, *d, *m))


def _of_point(motor, model, seen):
    predicted = ga.sandwich(motor, model)
    p, q = ([point[name] for name in POINT.blades] for point in (predicted, seen))
    axes = [tuple(int(j == k) for j in range(3)) for k in range(3)]
    return _minus(q, p), tuple(_row(cross(p, axis), axis) for axis in axes), are_finite((*p, *q))


def _of_plane(motor, model, seen):
    predicted = ga.sandwich(motor, model)
    d, (h,), one = _unit([predicted[name] for name in ("e1", "e2", "e3")], (predicted["e0"],))
    e, (g,), two = _unit([seen[name] for name in ("e1", "e2", "e3")], (seen["e0"],))
    u, v = across(d)
    residuals = *_turn(d, e, u, v), g - h * dot(d, e)
    # With n . x + h = 0, a translation t changes h by -n . t.
    rows = _row(v, (0, 0, 0)), _row(_scaled(-1, u), (0, 0, 0)), _row((0, 0, 0), _scaled(-1, d))
    return residuals, rows, one * two * are_finite((*e, *d, g, h))


LINES, POINTS, PLANES = (_of_line, 2), (_of_point, 0), (_of_plane, 2)


# Updates.


class Found(NamedTuple):
    """The error by all measurements so far, its covariance, the sum of squares of innovations, and their number."""

    error: Any
    covariance: Any
    square: Any
    used: Any


def _taken(found, motor, model, seen, kind, variances, gate):
    """Take the residuals of an object, one after the other, unless their sum of squares exceeds the gate."""
    equations, n_directions = kind
    residuals, rows, usable = equations(motor, model, seen)
    state, covariance, squares = list(found.error), square(found.covariance, 6), 0
    for k, (residual, row) in enumerate(zip(residuals, rows, strict=True)):
        innovation = select(usable, residual - dot(row, state), 0)
        variance = select(usable, variances[int(k >= n_directions)], UNMEASURED)
        state, covariance, part = measured(state, covariance, row, innovation, variance)
        squares = squares + part
    takes = usable * (squares <= gate)
    after = Found(tuple(state), triangle(covariance), found.square + squares, found.used + 1)
    return Found(*(
        choose(takes, new, old) if isinstance(new, tuple) else select(takes, new, old)
        for new, old in zip(after, found, strict=True)
    ))  # fmt: skip


def _adjoint(motor):
    """Return the rows of the matrix that moves bivectors."""
    columns = [_coefficients(ga.sandwich(motor, one)) for one in BASIS]
    return [list(row) for row in zip(*columns, strict=True)]


def _retracted(error, motor):
    """Return ``exp(-x/2) m``, with the rounding errors of its norm and of the Study condition removed."""
    return _normal(ga.exp(-_bivector(error) / 2) * motor)


def _normal(motor):
    """Project an almost unit even element to the unit motors."""
    even = motor * ~motor
    size = even["1"]
    factor = 1 / sqrt(size)
    pseudoscalar = PGA3.multivector({"e0123": 1})
    return factor * (motor - even["e0123"] / (2 * size) * pseudoscalar * motor)


class Iterate(NamedTuple):
    """A linearisation: its motor, the result, the sum of squares at the prediction, and whether a further one helps."""

    motor: Any
    last: Any
    covariance: Any
    predicted_square: Any
    square: Any
    used: Any
    first: Any
    settled: Any


def _updated(kind, motor, covariance, model, seen, variances, gate, start):
    """Return the result of an iterated update that begins at the motor `start`."""
    prior = square(covariance, 6)

    def linearised(now):
        # The prior error of a motor at exp(-x/2) m is -x; its covariance moves by the left Jacobian of the group, for
        # which the adjoint of half the motion is a second-order approximation with determinant 1.
        between = now.motor * ~motor
        error = _coefficients(-2 * ga.log(between))
        half = _adjoint(ga.exp(-_bivector(error) / 4))
        begun = Found(_scaled(-1, error), triangle(congruent(half, prior)), 0, 0)
        found = fold(lambda f, a, b: _taken(f, now.motor, a, b, kind, variances, gate), begun, model, seen)
        step = found.error
        turned = dot(step[:3], step[:3])
        spread = square(found.covariance, 6)
        smallest = sum(spread[k][k] for k in range(3))
        return Iterate(
            _retracted(step, now.motor), step, found.covariance,
            select(now.first, found.square, now.predicted_square), found.square, found.used, 0,
            100 * turned * turned < smallest,
        )  # fmt: skip

    begun = Iterate(start, (0,) * 6, tuple(covariance), 0, 0, 0, 1, 0)
    found, settled, steps = iterate(linearised, begun, lambda old, new: new.settled, STEPS)
    return found.motor, found.covariance, (found.predicted_square, found.square, found.used, settled, steps)


_PRIOR = {"motor": MOTOR, "covariance": COVARIANCE}
_NOISE = {"variances": PAIR, "gate": SCALAR, "start": MOTOR}
_RESULT = (MOTOR, COVARIANCE, array(SCALAR, 5))


@kernel(**_PRIOR, model=array(LINE, "n"), seen=array(LINE, "n"), **_NOISE, returns=_RESULT)
def update_by_lines(motor, covariance, model, seen, variances, gate, start):
    """Update a motor by measured lines, with as many linearisations as their curvature requires.

    Parameters
    ----------
    motor, covariance
        The prediction.
    model, seen
        Lines of the model, and measured.
    variances
        Of directions, in rad2, and of moments about a point of the line.
    gate
        Objects of which the sum of squared innovations, divided by their variances, exceeds this are left out.
    start
        The motor of the first linearisation, normally the prediction.

    Returns
    -------
    motor, covariance
        The estimate.
    numbers
        The sum of squared innovations at the first and at the last linearisation, how many objects were used, whether
        the iteration converged, and the number of linearisations.
    """
    return _updated(LINES, motor, covariance, model, seen, variances, gate, start)


@kernel(**_PRIOR, model=array(POINT, "n"), seen=array(POINT, "n"), **_NOISE, returns=_RESULT)
def update_by_points(motor, covariance, model, seen, variances, gate, start):
    """Update a motor by measured points, as `update_by_lines` does; the second variance is that of coordinates."""
    return _updated(POINTS, motor, covariance, model, seen, variances, gate, start)


@kernel(**_PRIOR, model=array(PLANE, "n"), seen=array(PLANE, "n"), **_NOISE, returns=_RESULT)
def update_by_planes(motor, covariance, model, seen, variances, gate, start):
    """Update a motor by measured planes, as `update_by_lines` does; the second variance is that of distances."""
    return _updated(PLANES, motor, covariance, model, seen, variances, gate, start)


@kernel(motor=MOTOR, model=LINE, seen=LINE, returns=(array(SCALAR, 4), array(SCALAR, 4, 6)))
def line_equations(motor, model, seen):
    """Compute the residuals of a line, and the derivatives of the predicted line by the error of the motor."""
    residuals, rows, _ = _of_line(motor, model, seen)
    return residuals, rows


@kernel(motor=MOTOR, model=POINT, seen=POINT, returns=(array(SCALAR, 3), array(SCALAR, 3, 6)))
def point_equations(motor, model, seen):
    """Compute the residuals of a point, and the derivatives of the predicted point by the error of the motor."""
    residuals, rows, _ = _of_point(motor, model, seen)
    return residuals, rows


@kernel(motor=MOTOR, model=PLANE, seen=PLANE, returns=(array(SCALAR, 3), array(SCALAR, 3, 6)))
def plane_equations(motor, model, seen):
    """Compute the residuals of a plane, and the derivatives of the predicted plane by the error of the motor."""
    residuals, rows, _ = _of_plane(motor, model, seen)
    return residuals, rows


def _information(kind, motor, model, variances):
    equations, n_directions = kind

    def of(each_model):
        _, rows, usable = equations(motor, each_model, ga.sandwich(motor, each_model))
        weights = [select(usable, 1 / variances[int(k >= n_directions)], 0) for k in range(len(rows))]
        return tuple(
            sum(w * row[i] * row[j] for w, row in zip(weights, rows, strict=True))
            for i in range(6)
            for j in range(i, 6)
        )

    return total(of, model)


@kernel(motor=MOTOR, model=array(LINE, "n"), variances=PAIR, returns=COVARIANCE)
def information_of_lines(motor, model, variances):
    """Compute the information about the error of a motor in lines of a model, an inverse covariance."""
    return _information(LINES, motor, model, variances)


@kernel(motor=MOTOR, model=array(POINT, "n"), variances=PAIR, returns=COVARIANCE)
def information_of_points(motor, model, variances):
    """Compute the information about the error of a motor in points of a model, an inverse covariance."""
    return _information(POINTS, motor, model, variances)


@kernel(motor=MOTOR, model=array(PLANE, "n"), variances=PAIR, returns=COVARIANCE)
def information_of_planes(motor, model, variances):
    """Compute the information about the error of a motor in planes of a model, an inverse covariance."""
    return _information(PLANES, motor, model, variances)


# Motions between measurements.


def _plus(a, b):
    return tuple(x + y for x, y in zip(a, b, strict=True))


@kernel(motor=MOTOR, covariance=COVARIANCE, motion=MOTOR, noise=COVARIANCE, returns=(MOTOR, COVARIANCE))
def predict_by_motion(motor, covariance, motion, noise):
    """Predict a motor after a known motion in the frame of reference, with a covariance of its error."""
    moved = triangle(congruent(_adjoint(motion), square(covariance, 6)))
    return _normal(motion * motor), _plus(moved, noise)


JOINT = array(SCALAR, size_of_triangle(12))


@kernel(
    motor=MOTOR,
    twist=LINE,
    covariance=JOINT,
    dt=SCALAR,
    noise=COVARIANCE,
    twist_noise=COVARIANCE,
    returns=(MOTOR, JOINT),
)
def predict_by_twist(motor, twist, covariance, dt, noise, twist_noise):
    """Predict a motor that moves with a twist: ``exp(-dt/2 v) m``.

    The covariance is that of the errors of the motor and of the twist; noise is added per unit of time.
    """
    motion = ga.exp(-dt / 2 * twist)
    by_error = _adjoint(motion)
    by_twist = [[dt * x for x in row] for row in _adjoint(ga.exp(-dt / 4 * twist))]
    rows = square(covariance, 12)
    half = [list(row) for row in rows]
    for i in range(6):
        for k in range(12):
            half[i][k] = dot([*by_error[i], *by_twist[i]], [row[k] for row in rows])
    after = [list(row) for row in half]
    for j in range(12):
        for i in range(6):
            after[j][i] = dot([*by_error[i], *by_twist[i]], half[j])
    steps = [square(noise, 6), square(twist_noise, 6)]
    for i in range(6):
        for j in range(6):
            after[i][j] = after[i][j] + dt * steps[0][i][j]
            after[6 + i][6 + j] = after[6 + i][6 + j] + dt * steps[1][i][j]
    return _normal(motion * motor), triangle(after)


# Recordings of one line at a time.


@kernel(
    motor=MOTOR, covariance=COVARIANCE, model=array(LINE, "n"), seen=array(LINE, "n"), noise=array(SCALAR, "n", 21),
    variances=PAIR, gate=SCALAR, returns=(array(MOTOR, "n"), array(SCALAR, "n", 21), array(SCALAR, "n", 2)),
)  # fmt: skip
def filter_lines(motor, covariance, model, seen, noise, variances, gate):
    """Estimate a motor in a random walk from one line at a time, each linearised once.

    `noise` is what the covariance grows by before each line. Returns motors, covariances, and for each line its squared
    innovation and whether it was used.
    """

    def step(carry, a, b, more):
        now, spread, _ = carry
        begun = Found((0,) * 6, _plus(spread, more), 0, 0)
        found = _taken(begun, now, a, b, LINES, variances, gate)
        half = _adjoint(ga.exp(-_bivector(found.error) / 4))
        after = triangle(congruent(half, square(found.covariance, 6)))
        return _retracted(found.error, now), after, (found.square, found.used)

    return scan(step, (motor, tuple(covariance), (0, 0)), model, seen, noise)


# The linear filter on the coefficients of a motor.


class Linear(NamedTuple):
    """The coefficients of a motor, and their covariance."""

    motor: Any
    covariance: Any


@kernel(motor=EVEN, covariance=array(SCALAR, 36), model=array(LINE, "n"), seen=array(LINE, "n"), variance=SCALAR,
        returns=(EVEN, array(SCALAR, 36)))  # fmt: skip
def update_linear_by_lines(motor, covariance, model, seen, variance):
    """Update the eight coefficients of a motor by the linear equations ``m x - y m = 0`` for lines x measured as y.

    All eight numbers have the same variance. After each line, the motor is projected to the Study quadric, and the
    covariance by the derivative of the projection (sections 18.6.1 to 18.6.4 of the book).
    """
    blades = MOTOR.blades
    basis = [PGA3.multivector({name: 1}) for name in blades]

    def taken(carry, x, y):
        columns = [one * x - y * one for one in basis]
        state, spread = [carry.motor[name] for name in blades], square(carry.covariance, 8)
        usable = are_finite((*_coefficients(x), *_coefficients(y)))
        for name in blades:
            row = [column[name] for column in columns]
            row = [select(usable, entry, 0) for entry in row]
            state, spread, _ = measured(state, spread, row, -dot(row, state), variance)
        even = assemble(PGA3, dict(zip(blades, state, strict=True)))
        projection = _projection(state)
        return Linear(_normal(even), triangle(congruent(projection, spread)))

    return fold(taken, Linear(motor, tuple(covariance)), model, seen)


def _projection(state):
    """Return the derivatives of the Study projection ``r / |r|, d - (r . d) r`` with fixed normalised r, d."""
    # Order 1 e12 e13 e23 | e01 e02 e03 e0123; the Study condition pairs 1 e0123, -e12 e03, e13 e02, -e23 e01.
    r, partner = state[:4], (7, 6, 5, 4)
    size = dot(r, r)
    unit = _scaled(1 / sqrt(size), r)
    signs = (1, -1, 1, -1)
    normal = [0] * 8
    for k in range(4):
        normal[partner[k]] = signs[k] * unit[k]
    d = [state[k] for k in range(8)]
    scale = 1 / sqrt(size)
    rows = [[0] * 8 for _ in range(8)]
    for i in range(4):
        for j in range(4):
            rows[i][j] = scale * (int(i == j) - unit[i] * unit[j])
    for i in range(4, 8):
        for j in range(4, 8):
            rows[i][j] = scale * (int(i == j) - normal[i] * normal[j])
        for j in range(4):
            # Turning r turns the direction along which the dual part is projected.
            rows[i][j] = scale * (-normal[i] * signs[j] * scale * d[partner[j]] - scale * d[i] * unit[j])
    return rows
