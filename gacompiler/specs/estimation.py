"""Filters for rotations and rigid motions: rotors of G(3) and motors of G(3,0,1).

Errors are small motions in the frame of reference, applied after the estimate: ``exp(-b/2) R`` for a rotor and
``exp(-x/2) M`` for a motor, where b and x are what `covariance` refers to. Covariances are passed as upper triangles,
row by row. Measurements that are not finite change nothing.
"""

from fractions import Fraction
from typing import Any, NamedTuple

import gacompiler as ga
from gacompiler import SCALAR, absolute, array, assemble, fold, kernel, scan, select, sqrt
from gacompiler.algebra.catalog import VGA3
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

EVEN = VGA3.EVEN
VECTOR, VECTORS, NUMBERS = array(SCALAR, 3), array(SCALAR, "n", 3), array(SCALAR, "n")
TINY = Fraction(1, 10**60)


# Orientation of an inertial sensor.


class Settings(NamedTuple):
    """Settings of `orientation_filter`; those named after noise are variances, or variances times seconds."""

    gravity: Any
    """m/s2"""
    rate_noise: Any
    """rad2/s. Noise of the angular rate at rest."""
    rate_scale: Any
    """s. Noise of the angular rate in relation to its square, for errors of scale and of axes."""
    bias_walk: Any
    """rad2/s3"""
    velocity: Any
    """m2/s. How close to 0 the mean velocity is, at least."""
    velocity_share: Any
    """s3. The same in relation to the mean square of accelerations."""
    level_time: Any
    """s. Time constant of that mean."""
    rest_rate: Any
    """rad2/s2. Largest square of deviations of the angular rate from its mean at rest."""
    rest_acceleration: Any
    """m2/s4. The same for accelerations."""
    rest_time: Any
    """s. How long the sensor must be quiet to be at rest."""
    rest_noise: Any
    """rad2/s. Noise of the bias as measured at rest."""
    heading: Any
    """rad2 s. Noise of the heading by the magnetic field."""
    disturbance: Any
    """rad2 s. The same in relation to the squared relative change of the field."""
    reference_time: Any
    """s. Time constant of the mean field."""
    delay_prior: Any
    """1/s4. The weight of a delay of 0 in the estimated delay of the magnetometer."""
    delay_limit: Any
    """s. Larger delays count as 0."""


class Carry(NamedTuple):
    """The state of `orientation_filter` between two samples."""

    rotor: Any
    bias: Any
    velocity: Any
    covariance: Any
    level: Any
    mean_rate: Any
    mean_acceleration: Any
    quiet: Any
    last_rate: Any
    last_field: Any
    has_field: Any
    delay: Any
    reference: Any


STATES = 8
"""Rotation about x, y, z, bias of x, y, z, velocity along x, y."""
TURN, BIAS, VELOCITY = range(3), range(3, 6), range(6, 8)
AT_REST = Fraction(1, 10**4)
"""m2/s. The velocity at rest is 0 up to this."""


def _plane(v):
    """Return the bivector of rotations about a vector."""
    return assemble(VGA3, {"e12": v[2], "e13": -v[1], "e23": v[0]})


def _vector(v):
    return assemble(VGA3, {"e1": v[0], "e2": v[1], "e3": v[2]})


def _matrix(rotor):
    """Return the rows of the matrix of a rotor."""
    columns = [rotor * VGA3.multivector({name: 1}) * ~rotor for name in ("e1", "e2", "e3")]
    return [[column[name] for column in columns] for name in ("e1", "e2", "e3")]


def _of_unit_length(rotor):
    numbers = [rotor[name] for name in EVEN.blades]
    return (1 / sqrt(dot(numbers, numbers))) * rotor


def _predicted(covariance, matrix, dt, gravity):
    """Return the covariance after a time step: biases turn the rotor, and wrong tilts accelerate."""

    def changed(rows):
        after = [list(row) for row in rows]
        for k in range(STATES):
            for i in TURN:
                after[i][k] = rows[i][k] - dt * sum(matrix[i][j] * rows[3 + j][k] for j in range(3))
            after[6][k] = rows[6][k] + dt * gravity * rows[1][k]
            after[7][k] = rows[7][k] - dt * gravity * rows[0][k]
        return after

    return changed(list(zip(*changed(covariance), strict=True)))


def _one(k):
    return [int(j == k) for j in range(STATES)]


def _orientation_step(carry, rate, acceleration, field, dt, settings):
    s, per_time = settings, 1 / dt
    has_rate, has_acceleration, has_field = are_finite(rate), are_finite(acceleration), are_finite(field)
    rate = choose(has_rate, rate, carry.last_rate)
    acceleration = choose(has_acceleration, acceleration, carry.mean_acceleration)
    field = choose(has_field, field, carry.last_field)
    turning = [a - b for a, b in zip(rate, carry.bias, strict=True)]
    rotor = carry.rotor * ga.exp(-dt / 2 * _plane(turning))
    matrix = _matrix(rotor)
    covariance = _predicted(square(carry.covariance, STATES), matrix, dt, s.gravity)
    noise = dt * (s.rate_noise + s.rate_scale * dot(turning, turning))
    for i in range(3):
        covariance[i][i] = covariance[i][i] + noise
        covariance[3 + i][3 + i] = covariance[3 + i][3 + i] + dt * s.bias_walk

    # The mean velocity of what is carried about is near 0, more so if the accelerations are small.
    force = [dot(row, acceleration) for row in matrix]
    moved = [v + dt * f for v, f in zip(carry.velocity, force[:2], strict=True)]
    state = [0] * 6 + list(choose(has_acceleration, moved, carry.velocity))
    extra = (force[0], force[1], force[2] - s.gravity)
    level = carry.level + dt / (dt + s.level_time) * (dot(extra, extra) - carry.level)
    share = dt / (dt + s.rest_time / 2)
    mean_rate = [a + share * (b - a) for a, b in zip(carry.mean_rate, rate, strict=True)]
    mean_acceleration = [a + share * (b - a) for a, b in zip(carry.mean_acceleration, acceleration, strict=True)]
    off_rate = [a - b for a, b in zip(rate, mean_rate, strict=True)]
    off_acceleration = [a - b for a, b in zip(acceleration, mean_acceleration, strict=True)]
    is_quiet = (
        (dot(off_rate, off_rate) < s.rest_rate)
        * (dot(mean_rate, mean_rate) < 4 * s.rest_rate)
        * (dot(off_acceleration, off_acceleration) < s.rest_acceleration)
        * has_rate
        * has_acceleration
    )
    quiet = select(is_quiet, carry.quiet + dt, 0)
    rests = quiet > s.rest_time
    spread = select(rests, AT_REST, s.velocity + s.velocity_share * level)
    variance = select(has_acceleration, spread * per_time, UNMEASURED)
    for k in VELOCITY:
        state, covariance, _ = measured(state, covariance, _one(k), -state[k], variance)
    variance = select(rests, s.rest_noise * per_time, UNMEASURED)
    for k in BIAS:
        at_rest = mean_rate[k - 3] - carry.bias[k - 3]
        state, covariance, _ = measured(state, covariance, _one(k), at_rest - state[k], variance)

    # The field changes by ``-rate x field``. If it is late by a time, the difference is that time the change of rates.
    both = has_field * carry.has_field
    middle = [(a + b) / 2 for a, b in zip(field, carry.last_field, strict=True)]
    mean = [(a + b) / 2 - bias for a, b, bias in zip(rate, carry.last_rate, carry.bias, strict=True)]
    change = [(a - b) * per_time for a, b in zip(field, carry.last_field, strict=True)]
    surplus = [a + b for a, b in zip(change, cross(mean, middle), strict=True)]
    by_delay = cross([(a - b) * per_time for a, b in zip(rate, carry.last_rate, strict=True)], middle)
    size = 1 / (dot(field, field) + TINY)
    above = carry.delay[0] + select(both, dot(surplus, by_delay) * size, 0)
    below = carry.delay[1] + select(both, dot(by_delay, by_delay) * size, 0)
    delay = above / below
    delay = select(absolute(delay) < s.delay_limit, delay, 0)
    turn = [-delay * w for w in turning]
    first = cross(turn, field)
    now = [a + b + c / 2 for a, b, c in zip(field, first, cross(turn, first), strict=True)]

    # Only the heading is corrected by the field, so that magnets cannot tilt the estimate or change the bias.
    east, north, up = (dot(row, now) for row in matrix)
    horizontal = sqrt(east * east + north * north)
    usable = has_field * (horizontal > 0)
    old_up, old_horizontal, known_for = carry.reference
    away = (up - old_up, horizontal - old_horizontal)
    distance = dot(away, away) / (old_up * old_up + old_horizontal * old_horizontal + TINY)
    weight = dt / (dt + ga.minimum(s.reference_time, known_for))
    renewed = (old_up + weight * away[0], old_horizontal + weight * away[1], known_for + dt)
    reference = choose(usable, renewed, carry.reference)
    ahead = 2 * east / (select(north > 0, north, 0) + horizontal + TINY)
    heading = select(usable, select(north > 0, ahead, select(east < 0, -2, 2)), 0)
    variance = select(usable, (s.heading + s.disturbance * distance) * per_time, UNMEASURED)
    state, covariance, _ = measured(state, covariance, _one(2), heading - state[2], variance, corrected=(2,))

    after = Carry(
        _of_unit_length((1 - _plane(state[:3]) / 2) * rotor),
        tuple(a + b for a, b in zip(carry.bias, state[3:6], strict=True)),
        tuple(state[6:]),
        triangle(covariance),
        level,
        tuple(mean_rate),
        tuple(mean_acceleration),
        quiet,
        rate,
        field,
        has_field,
        (above, below),
        reference,
    )
    return after, tuple(covariance[k][k] for k in TURN), (rests, delay, distance)


@kernel(
    rates=VECTORS, accelerations=VECTORS, fields=VECTORS, dt=NUMBERS, rotor=EVEN, bias=VECTOR,
    acceleration=VECTOR, covariance=array(SCALAR, size_of_triangle(STATES)), reference=VECTOR,
    settings=array(SCALAR, len(Settings._fields)),
    returns=(array(EVEN, "n"), array(SCALAR, "n", 3), array(SCALAR, "n", 3), array(SCALAR, "n", 3)),
)  # fmt: skip
def orientation_filter(
    rates, accelerations, fields, dt, rotor, bias, acceleration, covariance, reference, settings,
):  # fmt: skip
    """Estimate the orientation of an inertial sensor with an error-state Kalman filter.

    The errors are a rotation, the bias of the gyroscope, and a horizontal velocity that is 0 on average. The velocity
    takes the part that low-pass filters have elsewhere: for a constant gain, the tilt follows the accelerations of the
    frame of reference through a Butterworth filter of second order. The magnetic field corrects the heading alone, with
    less weight the more the field differs from its mean. Its delay is estimated, because it changes in proportion to
    the angular rate.

    Parameters
    ----------
    rates, accelerations, fields
        Of the sensor, in its frame; accelerations contain the reaction to gravity.
    dt
        The time since the previous sample.
    rotor
        From the sensor's frame before the first sample to the frame of reference, whose third axis points upwards.
    bias
        Of the rates.
    acceleration
        The mean of the first accelerations, in the frame of the sensor.
    covariance
        Of the rotation, the bias and the horizontal velocity.
    reference
        The vertical and the horizontal component of the field, and for how long they are known.
    settings
        As in `Settings`.

    Returns
    -------
    rotors
    biases
    variances
        Of the errors of rotation about the axes of the frame of reference.
    conditions
        Whether the sensor is at rest, the delay of the field, and its squared relative distance from the mean.
    """
    s, zero = Settings(*settings), (0, 0, 0)
    start = Carry(
        rotor, tuple(bias), (0, 0), tuple(covariance), 0, zero, tuple(acceleration), 0, zero, zero, 0,
        (0, s.delay_prior), tuple(reference),
    )  # fmt: skip
    rows = scan(
        lambda carry, rate, acceleration, field, time: _orientation_step(carry[0], rate, acceleration, field, time, s),
        (start, zero, zero),
        rates, accelerations, fields, dt,
    )  # fmt: skip
    found, variances, conditions = rows
    return found.rotor, found.bias, variances, conditions


@kernel(rates=VECTORS, accelerations=VECTORS, fields=VECTORS, dt=NUMBERS, returns=(VECTOR, VECTOR))
def mean_directions(rates, accelerations, fields, dt):
    """Compute the sums of accelerations and fields in the sensor's frame before the first sample.

    The sensor is turned by the rates alone. Over seconds the sum of accelerations points upwards, even in motion.
    """

    def added(carry, rate, acceleration, field, time):
        rotor, up, north = carry
        rotor = _of_unit_length(rotor * ga.exp(-time / 2 * _plane(choose(are_finite(rate), rate, (0, 0, 0)))))
        matrix = _matrix(rotor)
        sums = []
        for total, vector in ((up, acceleration), (north, field)):
            own = choose(are_finite(vector), vector, (0, 0, 0))
            sums.append(tuple(a + dot(row, own) for a, row in zip(total, matrix, strict=True)))
        return rotor, *sums

    _, up, north = fold(added, (VGA3.multivector({"1": 1}), (0, 0, 0), (0, 0, 0)), rates, accelerations, fields, dt)
    return up, north


# Rotors from vectors.


def _taken(carry, vector, seen, variance, gate):
    rotor, error, covariance, numbers = carry
    predicted = [dot(row, vector) for row in _matrix(rotor)]
    usable = are_finite((*seen, *predicted))
    state, spread, squares = list(error), square(covariance, 3), 0
    for k in range(3):
        axis = [int(j == k) for j in range(3)]
        row = cross(predicted, axis)
        innovation = select(usable, seen[k] - predicted[k] - dot(row, state), 0)
        state, spread, part = measured(state, spread, row, innovation, select(usable, variance, UNMEASURED))
        squares = squares + part
    takes = usable * (squares <= gate)
    return (
        rotor,
        choose(takes, state, error),
        choose(takes, triangle(spread), covariance),
        (numbers[0] + select(takes, squares, 0), numbers[1] + takes),
    )


@kernel(
    rotor=EVEN, covariance=array(SCALAR, 6), vectors=VECTORS, seen=VECTORS, variance=SCALAR, gate=SCALAR,
    returns=(EVEN, array(SCALAR, 6), array(SCALAR, 2)),
)  # fmt: skip
def update_by_vectors(rotor, covariance, vectors, seen, variance, gate):
    """Update a rotor by measured vectors ``r v ~r``, with noise of the same variance in each coordinate.

    Vectors are linearised at the prediction and again at the result. The covariance is that of a rotation about the
    axes of the frame of reference. The numbers are the sum of squared
    innovations, each divided by its variance, and how many vectors are used.
    """

    def linearised(at, error, spread):
        start = (at, error, spread, (0, 0))
        return fold(lambda c, v, w: _taken(c, v, w, variance, gate), start, vectors, seen)[1:]

    def turned(error, spread):
        half = _matrix(ga.exp(-_plane(error) / 4))
        return triangle(congruent(half, square(spread, 3)))

    # The second time, at the result of the first, from where the error of the prediction is the opposite.
    first, _, _ = linearised(rotor, (0, 0, 0), tuple(covariance))
    now = _of_unit_length(ga.exp(-_plane(first) / 2) * rotor)
    error, spread, numbers = linearised(now, tuple(-x for x in first), turned(first, covariance))
    return _of_unit_length(ga.exp(-_plane(error) / 2) * now), spread, numbers


@kernel(
    rotor=EVEN, covariance=array(SCALAR, 10), vectors=VECTORS, seen=VECTORS, variance=SCALAR,
    returns=(EVEN, array(SCALAR, 10)),
)  # fmt: skip
def update_linear_by_vectors(rotor, covariance, vectors, seen, variance):
    """Update the four coefficients of a rotor by the linear equations ``w r - r v = 0`` for vectors v measured as w.

    The equations have the same variance. After each vector, the rotor is normalised, and the covariance is projected by
    the derivative of that (section 18.5.3 of the book).
    """
    basis = [VGA3.multivector({name: 1}) for name in EVEN.blades]
    odd = ("e1", "e2", "e3", "e123")

    def taken(carry, v, w):
        now, spread = carry
        usable = are_finite((*v, *w))
        columns = [_vector(w) * one - one * _vector(v) for one in basis]
        state, rows = [now[name] for name in EVEN.blades], square(spread, 4)
        for name in odd:
            row = [select(usable, column[name], 0) for column in columns]
            state, rows, _ = measured(state, rows, row, -dot(row, state), variance)
        scale = 1 / sqrt(dot(state, state))
        unit = [scale * x for x in state]
        projection = [[scale * (int(j == k) - unit[j] * unit[k]) for k in range(4)] for j in range(4)]
        return assemble(VGA3, dict(zip(EVEN.blades, unit, strict=True))), triangle(congruent(projection, rows))

    return fold(taken, (rotor, tuple(covariance)), vectors, seen)
