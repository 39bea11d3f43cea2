"""Sequential minimal optimisation for support vector machines with multivectors, and Clifford-Gabor kernels.

A machine has one variable for each sample and component. The samples are arranged in blocks of as many samples as there
are lanes, a power of two. Each lane has its own best candidates, so that the loops over lanes run in vectors, and the
best of all lanes follows at the end. Samples that fill up the last block have equal bounds.
"""

import gacompiler as ga
from gacompiler import SCALAR, array, each, equal, fold, iterate, kernel, least, pick, row_numbers, select

FAR = float(2**100)
"""What takes a variable at a bound out of the selection."""

NUMBERS = array(SCALAR, "n")
SAMPLES = array(SCALAR, "blocks", "lanes")
VARIABLES = array(SCALAR, "m", "blocks", "lanes")
PAIRS = array(SCALAR, "m", "m")


@kernel(
    gram=array(SCALAR, "samples", "size", "blocks", "lanes"),
    diagonal=SAMPLES, variables=VARIABLES, gradient=VARIABLES, lower=VARIABLES, upper=VARIABLES,
    numbers=SAMPLES, lanes=array(SCALAR, "lanes"), blades=PAIRS, signs=PAIRS,
    width=SCALAR, tolerance=SCALAR, floor=SCALAR, at_most=SCALAR,
)  # fmt: skip
def steps_of_pairs(
    gram, diagonal, variables, gradient, lower, upper, numbers, lanes, blades, signs, width, tolerance, floor, at_most
):
    """Minimise the dual objective by steps that increase one variable and decrease another one as much.

    A step increases the variable with the least derivative, in the component that violates the conditions of optimality
    most, and decreases the one with which the objective falls most.

    Parameters
    ----------
    gram
        The kernels of samples, as multivectors.
    diagonal
        The scalar parts of the kernels of samples with themselves.
    variables, gradient
        At the start. The gradient is the derivative of the objective, without the penalty of the tube.
    lower, upper
        Bounds of the variables.
    numbers, lanes
        The numbers of samples in the order of blocks, and those of lanes.
    blades, signs
        For components c and l, the blade and the sign of ``<e_c K e_l^-1>``, which is a coefficient of K.
    width
        The half width of the tube.
    tolerance
        The difference between the greatest derivative by a decrease and the least one by an increase at which the steps
        end.
    floor
        The least curvature.
    at_most
        The number of steps after which they end.

    Returns
    -------
    variables, gradient
        At the end.
    gap
        The difference of derivatives at the end, the greatest of all components.
    is_optimal
        Whether it is at most `tolerance`.
    steps
        The number of steps.
    """
    share = 1 / ga.count_rows(lambda k: 1, lanes)

    def rise(b, high):
        return select(b >= high, FAR, select(b >= 0, width, -width))

    def fall(b, low):
        return select(b <= low, -FAR, select(b > 0, width, -width))

    def at(rows, k):
        block = ga.floor(k * share)
        return pick(pick(rows, block, 0), k - block / share, 0)

    def improved(carry, *rows):
        def one(least_yet, number, most_yet, b, g, k, low, high):
            value = g + rise(b, high)
            is_better = value < least_yet
            most = ga.maximum(most_yet, g + fall(b, low))
            return select(is_better, value, least_yet), select(is_better, k, number), most

        return each(one, *carry, *rows)

    def ends(b, g, low, high):
        """Return the least derivative by an increase, its variable, and the greatest derivative by a decrease."""
        nothing = each(lambda k: (FAR, -1, -FAR), lanes)
        lowest, firsts, highest = fold(improved, nothing, b, g, numbers, low, high)
        found, lane = least(lambda value: value, lowest)
        return found, pick(firsts, lane, 0), fold(lambda a, b: ga.maximum(a, b), -FAR, highest)

    def worst(lowest, first, highest):
        _, c = least(lambda low, high: low - high, lowest, highest)
        return c, pick(lowest, c, 0), pick(first, c, 0), pick(highest, c, 0)

    def step(state):
        variables, gradient, c, lowest, first, _ = state
        gains = pick(gram, first, 0)
        row, own = pick(gains, 0, 0), at(diagonal, first)
        b, g, low, high = (pick(rows, c, 0) for rows in (variables, gradient, lower, upper))

        def scored(carry, *rows):
            def one(score, number, k, b, g, low, x, d):
                slope = ga.maximum(g + fall(b, low) - lowest, 0)
                value = -slope * slope / ga.maximum(own + d - 2 * x, floor)
                is_better = value < score
                return select(is_better, value, score), select(is_better, k, number)

            return each(one, *carry, *rows)

        scores, seconds = fold(scored, each(lambda k: (0, -1), lanes), numbers, b, g, low, row, diagonal)
        _, lane = least(lambda score: score, scores)
        second = pick(seconds, lane, 0)
        losses = pick(gram, second, 0)
        old, other, least_other = at(b, first), at(b, second), at(low, second)
        room = select(old < 0, select(width > 0, 0, at(high, first)), at(high, first)) - old
        space = other - select(other > 0, select(width > 0, 0, least_other), least_other)
        slope = at(g, second) + fall(other, least_other) - lowest
        curvature = ga.maximum(own + at(diagonal, second) - 2 * at(row, second), floor)
        size = ga.maximum(ga.minimum(ga.minimum(slope / curvature, room), space), 0)
        up = select(equal(size, room), old + room, old + size)
        down = select(equal(size, space), other - space, other - size)

        def component(b, g, own_number, blade, sign, low, high):
            change, is_own = size * sign, equal(own_number, c)
            raised, lowered = select(is_own, first, -1), select(is_own, second, -1)

            def new(b, g, k, gain, loss):
                variable = select(equal(k, raised), up, select(equal(k, lowered), down, b))
                return variable, g + change * (gain - loss)

            rows = b, g, numbers, pick(gains, blade, 0), pick(losses, blade, 0)
            b, g = each(lambda *block: each(new, *block), *rows)
            return b, g, *ends(b, g, low, high)

        rows = variables, gradient, row_numbers(lower), pick(blades, c, 0), pick(signs, c, 0), lower, upper
        variables, gradient, *found = each(component, *rows)
        return variables, gradient, *worst(*found)

    start = variables, gradient, *worst(*each(ends, variables, gradient, lower, upper))
    end, is_optimal, steps = iterate(step, start, lambda old, new: new[5] - new[3] <= tolerance, at_most)
    return end[0], end[1], end[5] - end[3], is_optimal, steps


@kernel(squares=NUMBERS, phases=NUMBERS, width=SCALAR)
def gabor_values(squares, phases, width):
    """Evaluate Clifford-Gabor kernels ``exp(-width s) (cos p + u sin p)``, with a unit u whose square is -1.

    Parameters
    ----------
    squares, phases
        The squared distances s of samples, and the phases p of their differences.
    width
        The factor of squares.

    Returns
    -------
    real, imaginary
        The scalar part, and the coefficient of u.
    """

    def value(s, p):
        size = ga.exp(-width * s)
        return size * ga.cos(p), size * ga.sin(p)

    return each(value, squares, phases)
