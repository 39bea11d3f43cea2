"""Kalman filters and smoothers for states and measurements of any length.

Covariances are symmetric to the last bit. Correlated noise of a measurement is factorised as ``L D L^T``, and the
numbers that are independent then are taken one after the other, which gives the result of a joint update. Numbers of a
measurement that are not finite are left out.
"""

import gacompiler as ga
from gacompiler import (
    SCALAR,
    array,
    each,
    fold,
    gather,
    index,
    kernel,
    matrices,
    pick,
    row_numbers,
    scan,
    select,
    total,
    transpose,
)
from gacompiler.specs.families.covariances import are_finite

STATE, SPREAD = array(SCALAR, "n"), array(SCALAR, "n", "n")
SEEN, ROWS, NOISE = array(SCALAR, "m"), array(SCALAR, "m", "n"), array(SCALAR, "m", "m")
GATES = array(SCALAR, 2)
SIZES = (2, 1), (4, 2), (6, 3)
"""Lengths of states and measurements for which recordings have a kernel without inner loops, which is faster."""
STATES, SPREADS = array(SCALAR, "t", "n"), array(SCALAR, "t", "n", "n")
SYSTEM = index("t", into="s")


def _mirrored(rows):
    """Return the symmetric array that has the upper triangle of some rows of known length."""
    rows = matrices.entries(rows)
    n = range(len(rows))
    return matrices.fixed(tuple(tuple(rows[min(j, k)][max(j, k)] for k in n) for j in n))


def _plus(a, b):
    return each(lambda x, y: x + y, a, b)


def _minus(a, b):
    return each(lambda x, y: x - y, a, b)


def _symmetric(matrix):
    """Return a matrix whose entries are equal to those on the other side of the diagonal, which differ by rounding."""
    return each(lambda row, column: each(lambda x, y: (x + y) / 2, row, column), matrix, transpose(matrix))


def _congruent(matrix, covariance, noise, symmetric=_symmetric):
    """Return ``F P F^T + Q``, made symmetric by a function."""
    half = each(lambda row: matrices.times(covariance, row), matrix)
    moved = each(lambda row, own: _plus(matrices.times(matrix, row), own), half, noise)
    return symmetric(moved)


def _innovation(measurement, state, rows):
    return _minus(measurement, matrices.times(rows, state))


def _masked(seen, innovation, rows, noise):
    """Return a measurement in which numbers that were not measured depend on no state and on no other number."""
    numbers = row_numbers(noise)

    def entry(used, other, x, j, k):
        return select(used, select(other, x, 0), select(ga.equal(j, k), 1, 0))

    return (
        each(lambda used, x: select(used, x, 0), seen, innovation),
        each(lambda used, row: each(lambda x: select(used, x, 0), row), seen, rows),
        each(
            lambda used, row, j: each(lambda other, x, k: entry(used, other, x, j, k), seen, row, numbers),
            seen, noise, numbers,
        ),
    )  # fmt: skip


def _updated(state, covariance, innovation, rows, noise, gates):
    """Return a state and its covariance after a measurement, the squared innovation, and how many numbers are used.

    The covariance of the innovation is eliminated row by row, together with that of the measurement and the state, so
    that rows are independent. The first gate applies to each of them, the second one to their sum.
    """
    seen = each(lambda x: are_finite([x]), innovation)
    innovation, rows, noise = _masked(seen, innovation, rows, noise)
    sides = each(lambda row: matrices.times(covariance, row), rows)
    spread = each(lambda side, own: _plus(matrices.times(rows, side), own), sides, noise)
    numbers = row_numbers(noise)

    def gain(x, variance):
        """Return the inverse of the variance of a number, or 0 if the number is not used."""
        divisor = select(variance > 0, variance, 1)
        return select(variance > 0, select(x * x <= gates[0] * divisor, 1 / divisor, 0), 0)

    def eliminated(carry, k):
        spread, sides, innovation = carry
        pivots, side, x = pick(spread, k, 0), pick(sides, k, 0), pick(innovation, k, 0)
        scale = gain(x, pick(pivots, k, 0))
        factors = each(lambda row, i: select(i > k, scale * pick(row, k, 0), 0), spread, numbers)
        return (
            each(lambda row, f: each(lambda y, pivot: y - f * pivot, row, pivots), spread, factors),
            each(lambda row, f: each(lambda y, other: y - f * other, row, side), sides, factors),
            each(lambda y, f: y - f * x, innovation, factors),
        )

    spread, sides, innovation = fold(eliminated, (spread, sides, innovation), numbers)
    variances = each(lambda row, k: pick(row, k, 0), spread, numbers)
    gains = each(gain, innovation, variances)
    # A product with the gain first, which is 0 for a number that is not used: the square of that may overflow.
    scaled = each(lambda x, g: x * g, innovation, gains)
    square = total(lambda x, y: x * y, innovation, scaled)
    count = total(lambda used, g: select(g > 0, used, 0), seen, gains)
    whole = select(square <= gates[1], 1, 0)
    steps = each(lambda y: select(whole, y, 0), scaled)
    # The Joseph form (I - k h^T) P (I - k h^T)^T + k v k^T, for a gain k that is a multiple of the side P h.
    factors = each(lambda g, v: whole * (g * (2 - g * v)), gains, variances)
    columns = transpose(sides)
    return (
        _plus(state, matrices.times(columns, steps)),
        each(
            lambda row, a: each(lambda x, b: x - total(lambda f, y, z: f * (y * z), factors, a, b), row, columns),
            covariance, columns,
        ),
        square, count * whole,
    )  # fmt: skip


@kernel(state=STATE, covariance=SPREAD, transition=SPREAD, noise=SPREAD, shift=STATE)
def predict(state, covariance, transition, noise, shift):
    """Predict a state and its covariance: ``F x + s`` and ``F P F^T + Q``."""
    return _plus(matrices.times(transition, state), shift), _congruent(transition, covariance, noise)


@kernel(state=STATE, covariance=SPREAD, measurement=SEEN, rows=ROWS, noise=NOISE, gates=GATES)
def update(state, covariance, measurement, rows, noise, gates):
    """Update a state by a measurement ``z = H x + v``.

    The first gate is for the squared innovation of each independent number, divided by its variance; the second one
    is for the sum of those that are used. Returns the state, its covariance, the innovation ``z - H x``, this sum, and
    how many numbers are used: none if the sum exceeds its gate.
    """
    innovation = _innovation(measurement, state, rows)
    after, spread, square, count = _updated(state, covariance, innovation, rows, noise, gates)
    return after, spread, innovation, square, count


@kernel(
    state=STATE, covariance=SPREAD, measurements=array(SCALAR, "t", "m"), shifts=STATES,
    transitions=array(SCALAR, "s", "n", "n"), processes=array(SCALAR, "s", "n", "n"),
    rows=array(SCALAR, "s", "m", "n"), noises=array(SCALAR, "s", "m", "m"), system=SYSTEM, gates=GATES,
)  # fmt: skip
def filter_recording(state, covariance, measurements, shifts, transitions, processes, rows, noises, system, gates):
    """Filter a recording: predict and update for every row of measurements, with the matrices that `system` names.

    Returns states and covariances after and before each measurement, innovations, their squares divided by their
    covariances, and how many numbers are used.
    """

    def step(carry, measurement, shift, transition, process, rows, noise):
        before = _plus(matrices.times(transition, carry[0]), shift)
        spread = _congruent(transition, carry[1], process)
        after, kept, square, count = _updated(
            before, spread, _innovation(measurement, before, rows), rows, noise, gates
        )
        return after, kept, before, spread, square, count

    rows = gather(rows, system)
    named = gather(transitions, system), gather(processes, system), rows, gather(noises, system)
    start = state, covariance, state, covariance, 0, 0
    after, kept, before, spread, square, count = scan(step, start, measurements, shifts, *named)
    return after, kept, before, spread, each(_innovation, measurements, before, rows), square, count


def _layouts(n):
    """Return the arrays of a state, a covariance, and recordings of both."""
    return [array(SCALAR, *lengths) for lengths in ((n,), (n, n), ("t", n), ("t", n, n))]


def _filter_of(n, m):
    """Return the kernel of recordings with constant matrices, for one length of states and one of measurements."""

    def run(state, covariance, measurements, shifts, transition, process, rows, noise, gates):
        transition, rows, process, noise = (
            matrices.fixed(transition),
            matrices.fixed(rows),
            _mirrored(process),
            _mirrored(noise),
        )

        def step(carry, measurement, shift):
            before = _plus(matrices.times(transition, matrices.fixed(carry[0])), matrices.fixed(shift))
            spread = _congruent(transition, _mirrored(carry[1]), process, _mirrored)
            innovation = _innovation(matrices.fixed(measurement), before, rows)
            after, kept, square, count = _updated(before, spread, innovation, rows, noise, gates)
            return *map(matrices.entries, (after, kept, before, spread, innovation)), square, count

        return scan(step, (state, covariance, state, covariance, (0,) * m, 0, 0), measurements, shifts)

    run.__name__ = run.__qualname__ = f"filter_recording_{n}_{m}"
    run.__doc__ = f"Do what `filter_recording` does, for {n} states, {m} measured and matrices that do not change."
    state, spread, states, spreads = _layouts(n)
    seen, numbers = array(SCALAR, "t", m), array(SCALAR, "t")
    return kernel(
        state=state, covariance=spread, measurements=seen, shifts=states, transition=spread, process=spread,
        rows=array(SCALAR, m, n), noise=array(SCALAR, m, m), gates=GATES,
        returns=(states, spreads, states, spreads, seen, numbers, numbers),
    )(run)  # fmt: skip


filter_recording_2_1, filter_recording_4_2, filter_recording_6_3 = (_filter_of(*size) for size in SIZES)


def _smoothed(
    later, later_spread, state, covariance, following, spread, goes_on, transition, symmetric=_symmetric
):  # fmt: skip
    """Return a state and its covariance given the smoothed next state and the prediction of that."""
    lower, variances, failed = matrices.ldlt(spread)
    indefinite = total(lambda x: select(x > 0, 0, 1), variances)
    uses = goes_on * select(failed < 0, select(indefinite > 0, 0, 1), 0)

    def gain(row):
        # A row of G = P F^T / P': the solution of P' g = F p for the row p of P.
        right = matrices.solve_lower(lower, matrices.times(transition, row))
        scaled = each(lambda x, d: x / select(d > 0, d, 1), right, variances)
        return matrices.solve_upper(transpose(lower), scaled)

    gains = each(gain, covariance)
    change = _minus(later, following)
    spread_change = each(_minus, later_spread, spread)
    half = each(lambda row: matrices.times(spread_change, row), gains)
    moved = symmetric(each(lambda row: matrices.times(gains, row), half))
    after = each(lambda x, more: x + select(uses, more, 0), state, matrices.times(gains, change))
    return after, each(lambda row, more: each(lambda x, y: x + select(uses, y, 0), row, more), covariance, moved)


@kernel(
    states=STATES, covariances=SPREADS, predicted=STATES, predicted_covariances=SPREADS, ahead=array(SCALAR, "t"),
    last=STATE, last_covariance=SPREAD, transitions=array(SCALAR, "s", "n", "n"), system=SYSTEM,
)  # fmt: skip
def smooth(states, covariances, predicted, predicted_covariances, ahead, last, last_covariance, transitions, system):
    """Smooth a filtered recording backwards (Rauch, Tung and Striebel 1965).

    `states` and `covariances` are those after the measurement of each row. `predicted` and `predicted_covariances` are
    those of the next row before its measurement, by the transition to it; the last row of each is a state itself and
    its covariance, with `ahead` 0 there and 1 in other rows.
    """
    return scan(
        lambda carry, *row: _smoothed(*carry, *row), (last, last_covariance), states, covariances, predicted,
        predicted_covariances, ahead, gather(transitions, system), reverse=True,
    )  # fmt: skip


def _smooth_of(n):
    """Return the kernel that smooths recordings with one transition, for one length of states."""

    def run(states, covariances, predicted, predicted_covariances, ahead, last, last_covariance, transition):
        transition = matrices.fixed(transition)

        def back(carry, state, covariance, following, spread, goes_on):
            state, following, later = map(matrices.fixed, (state, following, carry[0]))
            covariance, spread, later_spread = map(_mirrored, (covariance, spread, carry[1]))
            found = _smoothed(later, later_spread, state, covariance, following, spread, goes_on, transition, _mirrored)
            return tuple(map(matrices.entries, found))

        rows = states, covariances, predicted, predicted_covariances, ahead
        return scan(back, (last, last_covariance), *rows, reverse=True)

    run.__name__ = run.__qualname__ = f"smooth_{n}"
    run.__doc__ = f"Do what `smooth` does, for {n} states and a transition that does not change."
    state, spread, states, spreads = _layouts(n)
    return kernel(
        states=states, covariances=spreads, predicted=states, predicted_covariances=spreads,
        ahead=array(SCALAR, "t"), last=state, last_covariance=spread, transition=spread, returns=(states, spreads),
    )(run)  # fmt: skip


smooth_2, smooth_4, smooth_6 = (_smooth_of(n) for n, _ in SIZES)


@kernel(state=STATE, covariance=SPREAD, distance=SCALAR)
def sigma_points(state, covariance, distance):
    """Compute points at a distance from a state, in its standard deviations, in n independent directions.

    Returns the offsets of the points, the points, and those opposite to them. The directions are the columns of the
    Cholesky factor of the covariance.
    """
    lower, variances, _ = matrices.ldlt(covariance)
    offsets = each(
        lambda column, variance: each(lambda x: x * distance * ga.sqrt(select(variance > 0, variance, 0)), column),
        transpose(lower), variances,
    )  # fmt: skip
    return offsets, each(lambda row: _plus(state, row), offsets), each(lambda row: _minus(state, row), offsets)


@kernel(
    offsets=SPREAD, forward=array(SCALAR, "n", "m"), backward=array(SCALAR, "n", "m"), distance=SCALAR,
)  # fmt: skip
def linearise(offsets, forward, backward, distance):
    """Compute the linear function that fits the values of a function at the `sigma_points` of a state best.

    The values are differences from the value at the state, as is the mean that is returned first. Also returns the
    derivatives (m, n) and the covariance of what is not linear. It is positive semidefinite if the square of the
    distance is at least n.
    """
    weight = 1 / (distance * distance)
    half = each(lambda x, y: each(lambda a, b: (a - b) / 2, x, y), forward, backward)
    bent = each(lambda x, y: each(lambda a, b: (a + b) / 2, x, y), forward, backward)
    rows = each(lambda column: matrices.solve_upper(offsets, column), transpose(half))
    mean = each(lambda column: weight * total(lambda x: x, column), transpose(bent))
    # The weights of the state and of all directions have the sum 1.
    columns = transpose(bent)
    squares = each(lambda column: each(lambda x: weight * x, matrices.times(columns, column)), columns)
    rest = each(lambda row, x: each(lambda a, y: a - x * y, row, mean), squares, mean)
    return mean, rows, rest
