"""The orientation of an inertial sensor: the state of its filter, and what a sample changes in it."""

from fractions import Fraction
from typing import Any, NamedTuple

import gacompiler as ga
from gacompiler import SCALAR, absolute, array, assemble, select, sqrt
from gacompiler.algebra.catalog import VGA3
from gacompiler.specs.families.covariances import (
    UNMEASURED,
    are_finite,
    choose,
    cross,
    dot,
    measured,
    size_of_triangle,
    square,
    triangle,
)

EVEN = VGA3.EVEN
TINY = Fraction(1, 10**60)


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
    return_time: Any
    """s. Mean velocities and headings over times as long are independent."""


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
    finite: Any
    """Whether the rate, the acceleration and the field of the last sample are finite."""
    delay: Any
    follows: Any
    """Sums of the products of the changes of the field and of those by the rates, of the squares of the latter, and of
    the squares of the differences."""
    reference: Any
    relied: Any
    """The mean of the vertical and the horizontal field, with the gains of the heading as weights."""
    distance: Any
    doubt: Any


class Doubt(NamedTuple):
    """What the samples so far say about the range of the gyroscope, about gaps, and about an impossible motion."""

    counts: Any
    """The numbers of finite rates, accelerations and fields."""
    square: Any
    """rad2/s2. The sum of the squares of rates."""
    peaks: Any
    """rad/s. The largest magnitude of each coordinate of the rate."""
    equal: Any
    """For how many successive samples the magnitude has been the largest."""
    limited: Any
    """Whether the largest magnitudes were at the limit of the measuring range."""
    lasted: Any
    """s. The time since the last known rate."""
    drift: Any
    """m/s. The accelerations of the last moments, without gravity, integrated over WINDOW."""
    sums: Any
    """The sums of innovations, divided by their variances: of the velocity along x and y, and of the heading."""
    weights: Any
    """The sums of the inverses of these variances."""
    summed: Any
    """s. The time of these sums."""
    excess: Any
    """While the odds of the velocity are positive: the sum of the squares of its means, divided by their variances, and
    the number of these."""
    odds: Any
    """The largest logarithms of the odds that means of velocities, or headings, have twice the stated variance."""


SIZES = (4, 3, 2, size_of_triangle(8), 1, 3, 3, 1, 3, 3, 3, 2, 3, 3, 2, 1, 3, 1, 3, 3, 3, 1, 3, 3, 3, 1, 2, 2)
"""Numbers of the fields of `Carry`, and of those of `Doubt` at its end."""
STATE = array(SCALAR, sum(SIZES))
STATES = 8
"""Rotation about x, y, z, bias of x, y, z, velocity along x, y."""
TURN, BIAS, VELOCITY = range(3), range(3, 6), range(6, 8)
AT_REST = Fraction(1, 10**4)
"""m2/s. The velocity at rest is 0 up to this."""
WINDOW = 2
"""s. A motion in reach changes its velocity within this time by at most twice the largest speed. A wrong tilt of more
than half a right angle that lasts as long is detected; this was not tuned on recordings."""
FASTEST_AT_REST = 2
"""rad/s. The least measuring range of gyroscopes is 125 degrees per second: equal rates below this are no limit."""
EQUAL = 3
"""From a probability: noise does not give the largest rate in as many successive samples."""
ANY_HEADING = Fraction(329, 100)
"""rad2. The variance of a uniformly distributed heading, pi**2 / 3, rounded."""
HALF_LOG_2 = Fraction(34657, 100000)
LIKELY = 36
"""From a probability: the square of a normal number is larger with that of `evidence.gates.UNLIKELY`."""
CONTRADICTED = Fraction(69078, 10000)
"""From a probability: odds exceed this for right noise at a given time with that of `evidence.status.WRONG`."""
BRIDGED = Fraction(1, 10)
"""s. Rates change little within a time as short, so that missing samples are bridged by others."""


def plane(v):
    """Return the bivector of rotations about a vector."""
    return assemble(VGA3, {"e12": v[2], "e13": -v[1], "e23": v[0]})


def vector_of(v):
    """Return the vector with three coordinates."""
    return assemble(VGA3, {"e1": v[0], "e2": v[1], "e3": v[2]})


def rows_of(rotor):
    """Return the rows of the matrix of a rotor."""
    columns = [rotor * VGA3.multivector({name: 1}) * ~rotor for name in ("e1", "e2", "e3")]
    return [[column[name] for column in columns] for name in ("e1", "e2", "e3")]


def of_unit_length(rotor):
    """Return a rotor divided by its length."""
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


def packed(carry):
    """Return the numbers of a `Carry`."""
    rotor = tuple(carry.rotor[name] for name in EVEN.blades)
    rest = (*carry[1:-1], *carry.doubt)
    return sum((tuple(x) if isinstance(x, (tuple, list)) else (x,) for x in rest), rotor)


def unpacked(numbers):
    """Return the `Carry` with given numbers."""
    remaining = iter(numbers)
    parts = [tuple(next(remaining) for _ in range(size)) for size in SIZES]
    rotor, *fields = [part[0] if len(part) == 1 else part for part in parts]
    n = len(Carry._fields) - 2
    multivector = assemble(VGA3, dict(zip(EVEN.blades, rotor, strict=True)))
    return Carry._make([multivector, *fields[:n], Doubt._make(fields[n:])])


def _compared(doubt, innovations, accuracies, dt, longest):
    """Return the `Doubt` after a sample with innovations of these inverse variances.

    Innovations of the stated noise are independent, so that their weighted mean has the inverse of the sum of weights
    as variance, over any time. That of a wrong scale, a delay, or a lasting acceleration does not decrease so. The odds
    are Page's cumulative sums (*Biometrika* 41:100, 1954), as in `algorithms.evidence.gates.Record`.
    """
    sums = [a + b * w for a, b, w in zip(doubt.sums, innovations, accuracies, strict=True)]
    weights = [a + w for a, w in zip(doubt.weights, accuracies, strict=True)]
    summed = doubt.summed + dt
    is_long = summed >= longest
    squares = [a * a / b for a, b in zip(sums, weights, strict=True)]
    gains = (squares[0] + squares[1]) / 4 - 2 * HALF_LOG_2, squares[2] / 4 - HALF_LOG_2
    most = 2 * CONTRADICTED
    odds = [select(is_long, ga.minimum(ga.maximum(a + b, 0), most), a) for a, b in zip(doubt.odds, gains, strict=True)]
    squared, n = doubt.excess
    more = (squared + squares[0] + squares[1], n + 2)
    excess = choose(is_long, choose(odds[0] > 0, more, (0, 0)), doubt.excess)
    keep = 1 - is_long
    kept = {"sums": tuple(keep * x for x in sums), "weights": tuple(keep * x for x in weights)}
    return doubt._replace(**kept, summed=keep * summed, excess=tuple(excess), odds=tuple(odds))


def _doubted(doubt, rate, finite, dt):
    """Return the `Doubt` after a sample whose rate is held in gaps, and what this adds to the variance of the rotation.

    The rate in a gap is as large as the others were on average, and beyond the range as much above the limit as below.
    In a gap that has lasted for t, the rotation grows by the rate times t, its variance by the square.
    """
    sizes, has_rate = [absolute(x) for x in rate], finite[0]
    counts = tuple(n + one for n, one in zip(doubt.counts, finite, strict=True))
    peaks, equal, limited, at_limit = [], [], [], 0
    for size, peak, count, was in zip(sizes, doubt.peaks, doubt.equal, doubt.limited, strict=True):
        more = select(size > peak, 1, select(size < peak, 0, count + 1)) * has_rate
        now = (more >= EQUAL) * (more < counts[0]) * (size >= FASTEST_AT_REST)
        peaks.append(ga.maximum(size, peak))
        equal.append(more)
        limited.append(select(size > peak, 0, ga.maximum(was, now)))
        at_limit = ga.maximum(at_limit, now)
    total = doubt.square + select(has_rate, dot(rate, rate), 0)
    unknown = ga.maximum(at_limit, 1 - has_rate)
    begins = select(at_limit, EQUAL * dt, dt)
    lasted = select(unknown, select(doubt.lasted > 0, doubt.lasted + dt, begins), 0)
    square = select(at_limit, dot(peaks, peaks), total / ga.maximum(counts[0], 1))
    widening = select(lasted > BRIDGED, square * dt * (2 * lasted - dt), 0)
    after = doubt._replace(
        counts=counts, square=total, peaks=tuple(peaks), equal=tuple(equal), limited=tuple(limited), lasted=lasted
    )
    return after, widening


def reading(carry, settings):
    """Return the rotor, the bias, the covariance of the rotation, and the conditions of `orientation_filter`.

    If the mean field is not the one that the heading relies on, either may be disturbed, and its third component, which
    turns the heading, by as much as the two others on average. Noise is as large as mean velocities lately show, if
    that is more than stated.
    """
    doubt, rows = carry.doubt, square(carry.covariance, STATES)
    above, below = carry.delay
    delay = above / below
    # The share of a turning that the field follows is 1, but less than a half if axes are not those of the rates.
    product, turned, surplus = carry.follows
    missing = turned / 2 - product
    is_turned = (missing > 0) * (3 * doubt.counts[2] * missing * missing > LIKELY * turned * surplus)
    conditions = (
        carry.quiet > settings.rest_time,
        select(absolute(delay) < settings.delay_limit, delay, 0),
        carry.distance,
        ga.maximum(ga.maximum(*doubt.limited[:2]), doubt.limited[2]),
        dot(doubt.drift, doubt.drift),
        ga.maximum(ga.maximum(*doubt.odds), is_turned * 2 * CONTRADICTED),
        ga.maximum(*carry.finite[:2]),
        *doubt.counts,
    )
    up, horizontal, known_for = carry.reference
    away = carry.relied[0] - up, carry.relied[1] - horizontal
    changed = ga.minimum(dot(away, away) / (2 * horizontal * horizontal + TINY), ANY_HEADING)
    rows[2][2] = rows[2][2] + select(known_for > 0, changed, 0)
    squared, n = doubt.excess
    ratio = select(n > 0, ga.maximum(squared, n) / (n + TINY), 1)
    spread = tuple(tuple(ratio * rows[j][k] for k in TURN) for j in TURN)
    return carry.rotor, carry.bias, spread, conditions


def orientation_step_of(carry, rate, acceleration, field, dt, settings):
    """Return the `Carry` after a sample."""
    s, per_time = settings, 1 / dt
    finite = has_rate, has_acceleration, has_field = tuple(map(are_finite, (rate, acceleration, field)))
    rate = choose(has_rate, rate, carry.last_rate)
    acceleration = choose(has_acceleration, acceleration, carry.mean_acceleration)
    field = choose(has_field, field, carry.last_field)
    turning = [a - b for a, b in zip(rate, carry.bias, strict=True)]
    rotor = carry.rotor * ga.exp(-dt / 2 * plane(turning))
    matrix = rows_of(rotor)
    covariance = _predicted(square(carry.covariance, STATES), matrix, dt, s.gravity)
    doubt, widening = _doubted(carry.doubt, rate, finite, dt)
    noise = dt * (s.rate_noise + s.rate_scale * dot(turning, turning))
    for i in range(3):
        covariance[i][i] = covariance[i][i] + noise + widening
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
    innovations, accuracies = [], []
    for k in VELOCITY:
        innovations.append(state[k])
        accuracies.append(1 / (covariance[k][k] + variance))
        state, covariance, _ = measured(state, covariance, _one(k), -state[k], variance)
    variance = select(rests, s.rest_noise * per_time, UNMEASURED)
    for k in BIAS:
        at_rest = mean_rate[k - 3] - carry.bias[k - 3]
        state, covariance, _ = measured(state, covariance, _one(k), at_rest - state[k], variance)

    # The field changes by ``-rate x field``. If it is late by a time, the difference is that time the change of rates.
    both = has_field * carry.finite[2]
    middle = [(a + b) / 2 for a, b in zip(field, carry.last_field, strict=True)]
    mean = [(a + b) / 2 - bias for a, b, bias in zip(rate, carry.last_rate, carry.bias, strict=True)]
    change = [(a - b) * per_time for a, b in zip(field, carry.last_field, strict=True)]
    turned = cross(mean, middle)
    surplus = [a + b for a, b in zip(change, turned, strict=True)]
    found = dot(turned, turned) - dot(turned, surplus), dot(turned, turned), dot(surplus, surplus)
    follows = [a + select(both, b, 0) for a, b in zip(carry.follows, found, strict=True)]
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
    is_new = usable * (known_for < 0)
    covariance[2][2] = covariance[2][2] + select(is_new, ANY_HEADING, 0)
    known_for = ga.maximum(known_for, 0)
    away = (up - old_up, horizontal - old_horizontal)
    distance = dot(away, away) / (old_up * old_up + old_horizontal * old_horizontal + TINY)
    weight = dt / (dt + ga.minimum(s.reference_time, known_for))
    renewed = (old_up + weight * away[0], old_horizontal + weight * away[1], known_for + dt)
    reference = choose(usable, renewed, carry.reference)
    ahead = 2 * east / (select(north > 0, north, 0) + horizontal + TINY)
    heading = select(usable, select(north > 0, ahead, select(east < 0, -2, 2)), 0)
    variance = select(usable, (s.heading + s.disturbance * distance) * per_time, UNMEASURED)
    innovations.append(heading - state[2])
    accuracies.append(1 / (covariance[2][2] + variance))
    gain = select(reference[2] > dt, covariance[2][2] * accuracies[2], 1) * usable
    relied = [a + gain * (b - a) for a, b in zip(carry.relied, (up, horizontal), strict=True)]
    state, covariance, _ = measured(state, covariance, _one(2), heading - state[2], variance, corrected=(2,))

    doubt = _compared(doubt, innovations, accuracies, dt, s.return_time)
    kept = WINDOW / (WINDOW + dt)
    drift = [kept * (v + dt * select(has_acceleration, f, 0)) for v, f in zip(doubt.drift, extra, strict=True)]
    return Carry(
        of_unit_length((1 - plane(state[:3]) / 2) * rotor),
        tuple(a + b for a, b in zip(carry.bias, state[3:6], strict=True)),
        tuple(state[6:]),
        triangle(covariance),
        level,
        tuple(mean_rate),
        tuple(mean_acceleration),
        quiet,
        rate,
        field,
        finite,
        (above, below),
        tuple(follows),
        reference,
        tuple(relied),
        distance,
        doubt._replace(drift=tuple(drift)),
    )
