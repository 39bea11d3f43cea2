"""Interacting particles: the motion of charges, and layers of networks whose messages are sums over pairs.

The state of a particle is its place and its velocity in space. A pair has one element in each of `first` and `second`,
the numbers of its particles. What a pair adds to its first particle, it subtracts from the second one, so that the sum
over all particles does not change. Networks of such layers commute with rotations, reflections and translations,
because their real numbers are computed from inner products of differences.
"""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, array, assemble, each, gather, index, kernel, log, scatter, sqrt, vjp
from gacompiler.algebra.catalog import VGA3

AXES = ("e1", "e2", "e3")
STATES, CHARGES = array(SCALAR, "n", 6), array(SCALAR, "n")
FIRST, SECOND = index("pairs", into="n"), index("pairs", into="n")
WEIGHTS = array(SCALAR, "pairs", 4)
SOFT = Fraction(1, 1000)
"""Added to squares, so that logarithms and quotients are finite."""
TINY = Fraction(1, 10**20)
"""Added to squared distances of charges; a particle has no force on itself."""
NEAR, LENGTH = Fraction(1, 100), Fraction(3, 10)
"""A squared distance below which messages for velocities are nearly constant, and the distance of unit messages."""
STRONGEST = 100
"""The bound of each coefficient of a force."""


def _vector(numbers):
    return assemble(VGA3, dict(zip(AXES, numbers, strict=True)))


def _differences(one, other):
    """Return the differences of places and of velocities."""
    return _vector(one[:3]) - _vector(other[:3]), _vector(one[3:]) - _vector(other[3:])


def _numbers(vector):
    return tuple(vector[name] for name in AXES)


def _negative(row):
    return tuple(-number for number in row)


def _exchanged(messages, first, second, state):
    """Add messages to the first particles of pairs, and subtract them from the second ones."""
    given = scatter(messages, first, state[0])
    return scatter(each(_negative, messages), second, state[0], given)


@kernel(state=STATES, charge=CHARGES, first=FIRST, second=SECOND, span=SCALAR, returns=STATES)
def charged_step(state, charge, first, second, span):
    """Compute the state of charges of unit mass after a short time: velocities from forces, then places.

    Charges of the same sign repel each other with the inverse square of their distance. Coefficients of forces are
    bounded by 100.
    """

    def force(one, other, p, q):
        d, _ = _differences(one, other)
        square = ga.norm_squared(d) + TINY
        return _numbers(p * q / (square * sqrt(square)) * d)

    messages = each(force, gather(state, first), gather(state, second), gather(charge, first), gather(charge, second))

    def moved(own, given):
        bounded = [ga.maximum(ga.minimum(number, STRONGEST), -STRONGEST) for number in given]
        velocity = [v + span * f for v, f in zip(own[3:], bounded, strict=True)]
        return (*(x + span * v for x, v in zip(own[:3], velocity, strict=True)), *velocity)

    return each(moved, state, _exchanged(messages, first, second, state))


@kernel(state=STATES, charge=CHARGES, first=FIRST, second=SECOND, returns=WEIGHTS)
def pair_invariants(state, charge, first, second):
    """Compute four real numbers of each pair that rotations and translations do not change.

    They are a third of the logarithms of the squared distance and of the squared relative velocity, the cosine of the
    angle between both, and the product of the charges.
    """

    def numbers(one, other, p, q):
        d, w = _differences(one, other)
        distance, speed = ga.norm_squared(d) + SOFT, ga.norm_squared(w) + SOFT
        return log(distance) / 3, log(speed) / 3, ga.scalar_product(d, w) / sqrt(distance * speed), p * q

    return each(numbers, gather(state, first), gather(state, second), gather(charge, first), gather(charge, second))


@kernel(state=STATES, weights=WEIGHTS, first=FIRST, second=SECOND, span=SCALAR, returns=STATES)
def pair_step(state, weights, first, second, span):
    """Compute the state after a step: velocities change by messages, places by the new velocities and by messages.

    Both messages of a pair are combinations of the directions of its distance and of its relative velocity. That for
    velocities is divided by the distance.
    """

    def message(one, other, weight):
        d, w = _differences(one, other)
        square = ga.norm_squared(d)
        along, across = d / sqrt(square + SOFT), w / sqrt(ga.norm_squared(w) + SOFT)
        kick = (weight[2] * along + weight[3] * across) * (LENGTH / sqrt(square + NEAR))
        return (*_numbers(weight[0] * along + weight[1] * across), *_numbers(kick))

    messages = each(message, gather(state, first), gather(state, second), weights)

    def moved(own, given):
        velocity = [v + span * g for v, g in zip(own[3:], given[3:], strict=True)]
        places = (x + span * (v + g) for x, v, g in zip(own[:3], velocity, given[:3], strict=True))
        return (*places, *velocity)

    return each(moved, state, _exchanged(messages, first, second, state))


pair_invariants_vjp_state, pair_invariants_vjp_charge = (vjp(pair_invariants, name) for name in ("state", "charge"))
pair_step_vjp_state, pair_step_vjp_weights = (vjp(pair_step, name) for name in ("state", "weights"))
