"""Filters for rotations and rigid motions: rotors of G(3) and motors of G(3,0,1).

Errors are small motions in the frame of reference, applied after the estimate: ``exp(-b/2) R`` for a rotor and
``exp(-x/2) M`` for a motor, where b and x are what `covariance` refers to. Covariances are passed as upper triangles,
row by row. Measurements that are not finite change nothing.
"""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, array, assemble, fold, kernel, scan, select, sqrt
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
from gacompiler.specs.families.orientation import (
    STATE,
    STATES,
    TURN,
    Carry,
    Doubt,
    Settings,
    of_unit_length,
    orientation_step_of,
    packed,
    plane,
    reading,
    rows_of,
    unpacked,
    vector_of,
)

EVEN = VGA3.EVEN
VECTOR, VECTORS, NUMBERS = array(SCALAR, 3), array(SCALAR, "n", 3), array(SCALAR, "n")
TINY = Fraction(1, 10**60)


# Orientation of an inertial sensor.


@kernel(
    rotor=EVEN, acceleration=VECTOR, covariance=array(SCALAR, size_of_triangle(STATES)),
    knows_north=SCALAR, settings=array(SCALAR, len(Settings._fields)), returns=STATE,
)  # fmt: skip
def orientation_start(rotor, acceleration, covariance, knows_north, settings):
    """Compute the state of `orientation_filter` before the first sample.

    Parameters
    ----------
    rotor
        From the sensor's frame to the frame of reference, whose third axis points upwards.
    acceleration
        The mean of the first accelerations, in the frame of the sensor.
    covariance
        Of the rotation, the bias and the horizontal velocity.
    knows_north
        1 if the heading is that of the magnetic field, 0 if it is arbitrary until a field is measured.
    settings
        As in `Settings`.
    """
    zero, reference = (0, 0, 0), (0, 0, knows_north - 1)
    doubt = Doubt(zero, 0, zero, zero, zero, 0, zero, zero, zero, 0, (0, 0), (0, 0))
    delay = (0, Settings(*settings).delay_prior)
    carry = Carry(
        rotor, zero, (0, 0), tuple(covariance), 0, zero, tuple(acceleration), 0, zero, zero, zero, delay, zero,
        reference, (0, 0), 0, doubt,
    )  # fmt: skip
    return packed(carry)


@kernel(
    rate=VECTOR, acceleration=VECTOR, field=VECTOR, dt=SCALAR, state=STATE,
    settings=array(SCALAR, len(Settings._fields)), returns=STATE,
)  # fmt: skip
def orientation_step(rate, acceleration, field, dt, state, settings):
    """Compute the state of `orientation_filter` after one more sample."""
    return packed(orientation_step_of(unpacked(state), rate, acceleration, field, dt, Settings(*settings)))


@kernel(
    state=STATE, settings=array(SCALAR, len(Settings._fields)),
    returns=(EVEN, VECTOR, array(SCALAR, 3, 3), array(SCALAR, 10)),
)  # fmt: skip
def orientation_reading(state, settings):
    """Compute the rotor, the bias, the covariance and the conditions of a state, as `orientation_filter` does."""
    return reading(unpacked(state), Settings(*settings))


@kernel(
    rates=VECTORS, accelerations=VECTORS, fields=VECTORS, dt=NUMBERS, state=STATE,
    settings=array(SCALAR, len(Settings._fields)),
    returns=(array(EVEN, "n"), array(SCALAR, "n", 3), array(SCALAR, "n", 3), array(SCALAR, "n", 10)),
)  # fmt: skip
def orientation_filter(rates, accelerations, fields, dt, state, settings):
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
    state
        Before the first sample, as from `orientation_start`.
    settings
        As in `Settings`.

    Returns
    -------
    rotors
    biases
    variances
        Of the errors of rotation about the axes of the frame of reference.
    conditions
        Whether the sensor is at rest, the delay of the field, its squared relative distance from the mean, whether
        rates were at the limit of their range, the squared change of the velocity within `WINDOW`, the odds that the
        velocity, the heading or the turning of the field contradicts the settings, whether the rate or the acceleration
        is finite, and how many rates, accelerations and fields were finite so far.
    """
    s = Settings(*settings)

    def read(carry):
        rotor, bias, spread, conditions = reading(carry, s)
        return rotor, bias, tuple(spread[k][k] for k in TURN), conditions

    def step(carry, rate, acceleration, field, time):
        after = orientation_step_of(carry[0], rate, acceleration, field, time, s)
        return after, read(after)

    start = unpacked(state)
    return scan(step, (start, read(start)), rates, accelerations, fields, dt)[1]


@kernel(rates=VECTORS, accelerations=VECTORS, fields=VECTORS, dt=NUMBERS, returns=(VECTOR, VECTOR))
def mean_directions(rates, accelerations, fields, dt):
    """Compute the sums of accelerations and fields in the sensor's frame before the first sample.

    The sensor is turned by the rates alone. Over seconds the sum of accelerations points upwards, even in motion.
    """

    def added(carry, rate, acceleration, field, time):
        rotor, up, north = carry
        rotor = of_unit_length(rotor * ga.exp(-time / 2 * plane(choose(are_finite(rate), rate, (0, 0, 0)))))
        matrix = rows_of(rotor)
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
    predicted = [dot(row, vector) for row in rows_of(rotor)]
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
        half = rows_of(ga.exp(-plane(error) / 4))
        return triangle(congruent(half, square(spread, 3)))

    # The second time, at the result of the first, from where the error of the prediction is the opposite.
    first, _, _ = linearised(rotor, (0, 0, 0), tuple(covariance))
    now = of_unit_length(ga.exp(-plane(first) / 2) * rotor)
    error, spread, numbers = linearised(now, tuple(-x for x in first), turned(first, covariance))
    return of_unit_length(ga.exp(-plane(error) / 2) * now), spread, numbers


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
        columns = [vector_of(w) * one - one * vector_of(v) for one in basis]
        state, rows = [now[name] for name in EVEN.blades], square(spread, 4)
        for name in odd:
            row = [select(usable, column[name], 0) for column in columns]
            state, rows, _ = measured(state, rows, row, -dot(row, state), variance)
        scale = 1 / sqrt(dot(state, state))
        unit = [scale * x for x in state]
        projection = [[scale * (int(j == k) - unit[j] * unit[k]) for k in range(4)] for j in range(4)]
        return assemble(VGA3, dict(zip(EVEN.blades, unit, strict=True))), triangle(congruent(projection, rows))

    return fold(taken, (rotor, tuple(covariance)), vectors, seen)
