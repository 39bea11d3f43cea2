"""Kalman filters and smoothers for states of up to twelve numbers.

The name of a kernel ends with the length of the state, and of the measurement where there is one. Smaller problems are
padded. Covariances are passed as upper triangles, row by row. Numbers of a measurement that are not finite are left
out. The functions that make the kernels are in this file because a file makes a module.
"""

from typing import Any, NamedTuple

import gacompiler as ga
from gacompiler import SCALAR, array, fold, kernel, scan, select
from gacompiler.specs.families.covariances import (
    are_finite,
    choose,
    congruent,
    dot,
    measured,
    size_of_triangle,
    square,
    triangle,
)

SIZES = ((2, 1), (4, 2), (6, 3))
STATES = (2, 4, 6, 12)


class Step(NamedTuple):
    """A state and its covariance after and before a measurement; the innovation, its square, and whether it is used."""

    state: Any
    covariance: Any
    predicted: Any
    predicted_covariance: Any
    innovation: Any
    square: Any
    used: Any


def _triangle_of(n):
    return array(SCALAR, size_of_triangle(n))


def _named(name, text):
    """Give a function the name under which the module has its kernel."""

    def named(function):
        function.__name__ = function.__qualname__ = name
        function.__doc__ = text
        return function

    return named


def _factorised(matrix):
    """Return the Cholesky factor of a symmetric matrix, the inverses of its diagonal, and whether it is definite."""
    n, is_definite = len(matrix), 1
    factor = [[0] * n for _ in range(n)]
    inverse = [0] * n
    for j in range(n):
        pivot = matrix[j][j] - dot(factor[j][:j], factor[j][:j])
        is_definite = is_definite * (pivot > 0)
        inverse[j] = 1 / ga.sqrt(select(pivot > 0, pivot, 1))
        factor[j][j] = pivot * inverse[j]
        for i in range(j + 1, n):
            factor[i][j] = (matrix[i][j] - dot(factor[i][:j], factor[j][:j])) * inverse[j]
    return factor, inverse, is_definite


def _forward(factor, inverse, column):
    """Solve ``L x = b``."""
    found: list[object] = []
    for j, b in enumerate(column):
        found.append((b - dot(factor[j][:j], found)) * inverse[j])
    return found


def _backward(factor, inverse, column):
    """Solve ``L^T x = b``."""
    n, found = len(column), [0] * len(column)
    for j in reversed(range(n)):
        found[j] = (column[j] - dot([factor[i][j] for i in range(j + 1, n)], found[j + 1 :])) * inverse[j]
    return found


def _updated(state, covariance, innovation, rows, noise, gate):
    """Return a state and its covariance (rows) after a measurement, the squared innovation, and whether it is used."""
    n, m = len(state), len(innovation)
    seen = [are_finite([x]) for x in innovation]
    innovation = [select(is_seen, x, 0) for is_seen, x in zip(seen, innovation, strict=True)]
    rows = [[select(is_seen, x, 0) for x in row] for is_seen, row in zip(seen, rows, strict=True)]
    noise = [[select(seen[j] * seen[k], noise[j][k], int(j == k)) for k in range(m)] for j in range(m)]
    side = [[dot(row, column) for column in covariance] for row in rows]
    spread = [[dot(side[j], rows[k]) + noise[j][k] for k in range(m)] for j in range(m)]
    factor, inverse, is_definite = _factorised(spread)
    white = _forward(factor, inverse, innovation)
    distance = dot(white, white)
    used = is_definite * (distance <= gate)
    # The gain, with one row for each number of the state.
    gains = [_backward(factor, inverse, _forward(factor, inverse, [each[k] for each in side])) for k in range(n)]
    after = [x + dot(gain, innovation) for x, gain in zip(state, gains, strict=True)]
    # The Joseph form (I - K H) P (I - K H)^T + K R K^T remains positive for inexact gains.
    kept = [[int(j == k) - dot(gains[j], [row[k] for row in rows]) for k in range(n)] for j in range(n)]
    first, second = congruent(kept, covariance), congruent(gains, noise)
    joseph = [[a + b for a, b in zip(x, y, strict=True)] for x, y in zip(first, second, strict=True)]
    return choose(used, after, state), choose(used, triangle(joseph), triangle(covariance)), distance, used


def _moved(state, covariance, transition, noise):
    n = len(state)
    moved = congruent(transition, square(covariance, n))
    noise = square(noise, n)
    after = [[a + b for a, b in zip(x, y, strict=True)] for x, y in zip(moved, noise, strict=True)]
    return tuple(dot(row, state) for row in transition), after


def _predict(n):
    @_named(f"predict_{n}", "Predict a state and its covariance: ``F x`` and ``F P F^T + Q``.")
    def predict(state, covariance, transition, noise):
        after, spread = _moved(state, covariance, transition, noise)
        return after, triangle(spread)

    return kernel(
        state=array(SCALAR, n), covariance=_triangle_of(n), transition=array(SCALAR, n, n), noise=_triangle_of(n),
        returns=(array(SCALAR, n), _triangle_of(n)),
    )(predict)  # fmt: skip


def _update(n, m):
    @_named(
        f"update_{n}_{m}",
        "Update a state by a measurement, from the innovation and its derivatives, in the Joseph form.\n\n"
        "The numbers are the square of the innovation divided by its covariance, and whether it is used: it is if the\n"
        "square does not exceed the gate and the covariance is definite.",
    )
    def update(state, covariance, innovation, rows, noise, gate):
        after, spread, distance, used = _updated(state, square(covariance, n), innovation, rows, square(noise, m), gate)
        return after, spread, (distance, used)

    return kernel(
        state=array(SCALAR, n), covariance=_triangle_of(n), innovation=array(SCALAR, m), rows=array(SCALAR, m, n),
        noise=_triangle_of(m), gate=SCALAR, returns=(array(SCALAR, n), _triangle_of(n), array(SCALAR, 2)),
    )(update)  # fmt: skip


def _update_in_sequence(n):
    @_named(
        f"update_in_sequence_{n}",
        "Update a state by independent numbers, one after the other, without the numbers that exceed the gate.\n\n"
        "The numbers returned are the sum of squared innovations, each divided by its variance, and how many are used.",
    )
    def update(state, covariance, innovations, rows, variances, gate):
        before = tuple(state)

        def taken(carry, innovation, row, variance):
            now, spread, numbers = carry
            seen = are_finite([innovation])
            changed = [a - b for a, b in zip(now, before, strict=True)]
            rest = select(seen, innovation, 0) - dot(row, changed)
            after, rows_after, part = measured(now, square(spread, n), row, rest, variance)
            used = seen * (part <= gate) * (part >= 0)
            kept = choose(used, triangle(rows_after), spread)
            return choose(used, after, now), kept, (numbers[0] + select(used, part, 0), numbers[1] + used)

        return fold(taken, (before, tuple(covariance), (0, 0)), innovations, rows, variances)

    return kernel(
        state=array(SCALAR, n), covariance=_triangle_of(n), innovations=array(SCALAR, "m"),
        rows=array(SCALAR, "m", n), variances=array(SCALAR, "m"), gate=SCALAR,
        returns=(array(SCALAR, n), _triangle_of(n), array(SCALAR, 2)),
    )(update)  # fmt: skip


def _filter(n, m):
    @_named(
        f"filter_{n}_{m}",
        "Filter a recording: predict and update for every row of measurements.\n\n"
        "Returns states and covariances after and before each measurement, innovations, their squares divided by\n"
        "their covariances, and whether they are used.",
    )
    def run(state, covariance, measurements, transition, process, rows, noise, gate):
        spread_of_noise = square(noise, m)

        def step(carry, measurement):
            predicted, spread = _moved(carry.state, carry.covariance, transition, process)
            innovation = [z - dot(row, predicted) for z, row in zip(measurement, rows, strict=True)]
            after, kept, distance, used = _updated(predicted, spread, innovation, rows, spread_of_noise, gate)
            return Step(after, kept, predicted, triangle(spread), tuple(innovation), distance, used)

        start = Step(tuple(state), tuple(covariance), tuple(state), tuple(covariance), (0,) * m, 0, 0)
        found = scan(step, start, measurements)
        return tuple(found)

    states, spreads = array(SCALAR, "t", n), array(SCALAR, "t", size_of_triangle(n))
    return kernel(
        state=array(SCALAR, n), covariance=_triangle_of(n), measurements=array(SCALAR, "t", m),
        transition=array(SCALAR, n, n), process=_triangle_of(n), rows=array(SCALAR, m, n), noise=_triangle_of(m),
        gate=SCALAR,
        returns=(states, spreads, states, spreads, array(SCALAR, "t", m), array(SCALAR, "t"), array(SCALAR, "t")),
    )(run)  # fmt: skip


def _smooth(n):
    @_named(
        f"smooth_{n}",
        "Smooth a filtered recording backwards (Rauch, Tung and Striebel 1965).\n\n"
        "`states` and `covariances` are those after the measurement of each row. `predicted` and\n"
        "`predicted_covariances` are those of the next row before its measurement, by the transition to it; the last\n"
        "row of each is a state itself and its covariance, with `ahead` 0 there and 1 in other rows.",
    )
    def smooth(states, covariances, predicted, predicted_covariances, ahead, last, last_covariance, transition):
        def back(carry, state, covariance, following, spread, goes_on):
            later, later_covariance = carry
            rows, next_rows = square(covariance, n), square(spread, n)
            factor, inverse, is_definite = _factorised(next_rows)
            # G = P F^T / P', by rows: each solves P' g = F p for a row p of P.
            gains = [
                _backward(factor, inverse, _forward(factor, inverse, [dot(row, p) for row in transition])) for p in rows
            ]
            uses = goes_on * is_definite
            change = [a - b for a, b in zip(later, following, strict=True)]
            spread_change = [
                [a - b for a, b in zip(x, y, strict=True)]
                for x, y in zip(square(later_covariance, n), next_rows, strict=True)
            ]
            moved = congruent(gains, spread_change)
            after = [x + select(uses, dot(gain, change), 0) for x, gain in zip(state, gains, strict=True)]
            kept = [a + select(uses, b, 0) for a, b in zip(covariance, triangle(moved), strict=True)]
            return tuple(after), tuple(kept)

        return scan(
            back, (tuple(last), tuple(last_covariance)), states, covariances, predicted, predicted_covariances, ahead,
            reverse=True,
        )  # fmt: skip

    rows, spreads = array(SCALAR, "t", n), array(SCALAR, "t", size_of_triangle(n))
    return kernel(
        states=rows, covariances=spreads, predicted=rows, predicted_covariances=spreads, ahead=array(SCALAR, "t"),
        last=array(SCALAR, n), last_covariance=_triangle_of(n), transition=array(SCALAR, n, n),
        returns=(rows, spreads),
    )(smooth)  # fmt: skip


predict_2, predict_4, predict_6, predict_12 = (_predict(n) for n in STATES)
update_in_sequence_2, update_in_sequence_4, update_in_sequence_6, update_in_sequence_12 = (
    _update_in_sequence(n) for n in STATES
)
update_2_1, update_4_2, update_6_3 = (_update(*s) for s in SIZES)
filter_2_1, filter_4_2, filter_6_3 = (_filter(*s) for s in SIZES)
smooth_2, smooth_4, smooth_6 = (_smooth(n) for n in STATES[:3])
