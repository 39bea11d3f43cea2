"""Serial arms on their way to a pose: damped least squares on motors, with loops over the joints.

The tables describe the arm at the zero configuration: `axes` are the joints' unit lines, lines at infinity for
prismatic joints, and `turns` is 1 for a revolute joint and 0 for a prismatic one. A goal is the motion of all joints
together. Lengths are compared with angles by `size`, a length of the order of the arm's reach.

A descent is the method of Levenberg and Marquardt. Its damping is proportional to the squared error (Yamashita and
Fukushima 2001), so that it converges quadratically also to a continuum of configurations. A step is computed from a
triangular factor of the Jacobian that Givens rotations update joint by joint, so that singular values are accurate to
all digits of the largest one, rather than to half of them as in normal equations.
"""

import math
from fractions import Fraction
from functools import reduce
from typing import Any, NamedTuple

from gacompiler import (
    SCALAR,
    absolute,
    array,
    cos,
    each,
    equal,
    floor,
    fold,
    iterate,
    kernel,
    maximum,
    minimum,
    scan,
    select,
    sin,
    sqrt,
)
from gacompiler.algebra.catalog import PGA3
from gacompiler.specs import pga3

LINE, MOTOR = PGA3.LINE, PGA3.MOTOR
VARIABLES = array(SCALAR, "n")
NUMBERS, AXES = array(SCALAR, "n", shared=True), array(LINE, "n", shared=True)
SIX = range(6)
HALF_TURN = Fraction(math.pi)

START = Fraction(1, 100)
"""Initial damping relative to the squared error."""
FLOOR = Fraction(1, 10**22)
"""Smallest damping, relative to the squared size: singular values up to its root, 1e-11, count as rounding errors."""
CEILING = 10**6
"""A descent ends if no step with a damping up to this many times the squared size reduces the error."""
SETTLED = 1 - Fraction(1, 10**7)
"""A descent ends if a step reduces the error by a smaller factor than this."""


CLOSE = Fraction(1, 2**26)
"""Errors below this, relative to the size, may grow: close to a singularity, the first step leads beyond the goal, and
the next ones back. It is the root of the rounding errors, because the error of a step is quadratic."""
ROUNDING = Fraction(1, 2**46)
"""A descent ends if an error up to this, relative to the size, is not halved: 64 rounding errors."""


class State(NamedTuple):
    """A descent: variables, error as six numbers, rates of the joints, the norm of the error, damping, whether it has
    ended, and the variables with the smallest norm so far."""

    q: Any
    left: Any
    rates: Any
    error: Any
    damping: Any
    done: Any
    best: Any
    least: Any


def _moved(q, axis, turn):
    """Compute the motor of a joint."""
    half = q / 2
    return select(turn > 0, cos(half), 1) - select(turn > 0, sin(half), half) * axis


def _numbers(twist, size):
    """Return angular velocity times size, and linear velocity."""
    direction = (twist["e23"], -twist["e13"], twist["e12"])
    return (*(size * x for x in direction), *(twist[name] for name in ("e01", "e02", "e03")))


def _inward(q, axes, turns, size):
    """Compute for each joint the motion from it to the last link, and its rates in the frame of the last link."""

    def inward(carry, angle, axis, turn):
        tail, _ = carry
        rate = ~tail * axis * tail
        return _moved(angle, axis, turn) * tail, _numbers(rate.grade(2), size)

    return scan(inward, (1, (0,) * 6), q, axes, turns, reverse=True)


def _errors(q, axes, turns, goal, size):
    """Compute the remaining twist to the goal, the rates of the joints, and the norm of the twist."""
    tails, rates = _inward(q, axes, turns, size)
    whole = fold(lambda _, tail: tail, 1, tails, reverse=True)
    rest = ~whole * goal
    rest = select(rest["1"] < 0, -1, 1) * rest
    left = _numbers(pga3.motor_to_twist(rest), size)
    return left, rates, sqrt(sum(x * x for x in left))


def _step(rates, left, damping):
    """Return the damped least-squares solution of ``sum(x_j rates_j) = left``, the shortest one.

    The rates above a diagonal matrix have the factors Q R. The solution consists of the first rows of ``Q R^-T left``;
    the rotations that make up Q are applied again in reverse.
    """
    root = sqrt(damping)
    corner = tuple(tuple(root if i == j else 0 for j in range(i, 6)) for i in SIX)

    def rotated(carry, row):
        triangle, _ = carry
        rows, below, turns = [list(r) for r in triangle], list(row), []
        for i in SIX:
            pivot, beside = rows[i][0], below[i]
            length = sqrt(pivot * pivot + beside * beside)
            c, s = pivot / length, beside / length
            rows[i][0] = length
            for j in range(i + 1, 6):
                above = rows[i][j - i]
                rows[i][j - i] = c * above + s * below[j]
                below[j] = c * below[j] - s * above
            turns.append((c, s))
        return tuple(tuple(r) for r in rows), tuple(turns)

    triangles, turns = scan(rotated, (corner, ((1, 0),) * 6), rates)
    triangle = fold(lambda _, last: last, corner, triangles)
    ahead: list[Any] = []
    for i in SIX:
        ahead.append((left[i] - sum(triangle[j][i - j] * ahead[j] for j in range(i))) / triangle[i][0])

    def rotated_back(carry, turn):
        upper, own = list(carry[0]), 0
        for i in reversed(SIX):
            c, s = turn[i]
            upper[i], own = c * upper[i] - s * own, s * upper[i] + c * own
        return tuple(upper), own

    return scan(rotated_back, (tuple(ahead), 0), turns, reverse=True)[1]


def _motion(q, axes, turns):
    return fold(lambda motion, *joint: motion * _moved(*joint), 1, q, axes, turns)


def difference(made, goal, size):
    """Return the largest difference between coefficients of two motors of any sign, of lengths in units of size / 2."""
    near, far = [], []
    for name in MOTOR.blades:
        scale = 2 / size if "0" in name else 1
        near.append(scale * absolute(made[name] - goal[name]))
        far.append(scale * absolute(made[name] + goal[name]))
    return minimum(reduce(maximum, near), reduce(maximum, far))


@kernel(matrix=array(SCALAR, 4, 4), returns=(MOTOR, SCALAR))
def motor_of_pose(matrix):
    """Convert a homogeneous matrix to a motor, as `pga3.motor_from_matrix`, and say how far it is from a rigid motion.

    That is the largest difference between an entry, but those of the translation, and that of the motor.
    """
    motor = pga3.motor_from_matrix(matrix)
    made = pga3.motor_to_matrix(motor)
    away = [absolute(made[i][j] - matrix[i][j]) for i in range(4) for j in range(4) if i == 3 or j < 3]
    return motor, reduce(maximum, away)


@kernel(matrix=array(SCALAR, 4, 4), tool=MOTOR, returns=(MOTOR, SCALAR))
def goal_of_pose(matrix, tool):
    """Compute the motion that takes a tool to a homogeneous matrix, and `motor_of_pose`'s distance of the matrix."""
    motor, away = motor_of_pose(matrix)
    return motor * ~tool, away


@kernel(q=VARIABLES, axes=AXES, turns=NUMBERS)
def motion_of_joints(q, axes, turns):
    """Compute the motion of all joints together."""
    return _motion(q, axes, turns)


@kernel(q=VARIABLES, goal=MOTOR, axes=AXES, turns=NUMBERS, size=SCALAR)
def distance_to_goal(q, goal, axes, turns, size):
    """Compute the largest difference between coefficients of the motion of all joints and a goal or its negative.

    Coefficients of the translation are in units of half of `size`.
    """
    return distance(q, goal, axes, turns, size)


def distance(q, goal, axes, turns, size):
    """Compute `distance_to_goal`."""
    return difference(_motion(q, axes, turns), goal, size)


@kernel(q=VARIABLES, axes=AXES, turns=NUMBERS, size=SCALAR, returns=array(SCALAR, "n", 6))
def rates_of_joints(q, axes, turns, size):
    """Compute the twists of the joints in the frame of the last link: angular velocity times `size`, and linear."""
    return _inward(q, axes, turns, size)[1]


def _descent(start, move, goal, axes, turns, size, enough, at_most):
    """Descend from a configuration; ``move(q, rates, left, damping)`` returns the next configuration."""
    left, rates, error = _errors(start, axes, turns, goal, size)

    def step(old):
        damping = maximum(old.damping * old.error * old.error, FLOOR * size * size)
        trial = move(old.q, old.rates, old.left, damping)
        left, rates, error = _errors(trial, axes, turns, goal, size)
        better = error < maximum(old.error, CLOSE * size)
        slow = select(better, error > SETTLED * maximum(old.error, CLOSE * size), damping > CEILING * size * size)
        ended = select(old.error > ROUNDING * size, slow, 2 * error > old.error)
        return State(
            each(lambda a, b: select(better, a, b), trial, old.q),
            tuple(select(better, a, b) for a, b in zip(left, old.left, strict=True)),
            each(lambda a, b: tuple(select(better, x, y) for x, y in zip(a, b, strict=True)), rates, old.rates),
            select(better, error, old.error),
            old.damping * select(error < old.error, Fraction(1, 10), 10),
            select(minimum(error, old.error) <= enough, 1, ended),
            each(lambda a, b: select(error < old.least, a, b), trial, old.best),
            minimum(error, old.least),
        )

    begun = State(start, left, rates, error, START, 0, start, error)
    found, _, _ = iterate(step, begun, lambda old, new: new.done > 0, at_most)
    return found.best, found.least, difference(_motion(found.best, axes, turns), goal, size)


ARM = {"axes": AXES, "turns": NUMBERS, "size": SCALAR, "enough": SCALAR, "at_most": SCALAR}


@kernel(q=VARIABLES, goal=MOTOR, **ARM, returns=(VARIABLES, SCALAR, SCALAR))
def descend(q, goal, axes, turns, size, enough, at_most):
    """Move the variables until the arm reaches a goal, or to a local minimum of the distance, in `at_most` steps.

    Returns the variables, the norm of the remaining twist, with angles times `size`, and the largest difference between
    coefficients of the motors. An error up to `enough` ends the descent.
    """

    def move(q, rates, left, damping):
        return each(lambda x, dx: x + dx, q, _step(rates, left, damping))

    return _descent(q, move, goal, axes, turns, size, enough, at_most)


@kernel(q=VARIABLES, goal=MOTOR, low=NUMBERS, high=NUMBERS, **ARM, returns=(VARIABLES, SCALAR, SCALAR))
def descend_inside(q, goal, low, high, axes, turns, size, enough, at_most):
    """Move the variables as `descend` does, within the limits `low` and `high`.

    Joints that a step would move beyond a limit are moved to it, and the step of the others is computed again.
    """

    def inside(x, least, most):
        return minimum(maximum(x, least), most)

    def move(q, rates, left, damping):
        wish = each(lambda x, dx: x + dx, q, _step(rates, left, damping))
        bounded = each(inside, wish, low, high)
        held = each(lambda x, b: select(equal(x, b), 0, 1), wish, bounded)
        used = each(lambda b, x, h: h * (b - x), bounded, q, held)
        taken = fold(
            lambda sums, dx, rate: tuple(s + dx * r for s, r in zip(sums, rate, strict=True)), (0,) * 6, used, rates
        )
        rest = tuple(a - b for a, b in zip(left, taken, strict=True))
        free = each(lambda rate, h: tuple((1 - h) * r for r in rate), rates, held)
        change = _step(free, rest, damping)
        return each(
            lambda b, x, dx, h, least, most: select(h > 0, b, inside(x + dx, least, most)),
            bounded, q, change, held, low, high,
        )  # fmt: skip

    return _descent(each(inside, q, low, high), move, goal, axes, turns, size, enough, at_most)


def _within(q, low, high, wanted, turns, slack):
    whole = 2 * HALF_TURN
    wish = floor((wanted - q) / whole + Fraction(1, 2))
    fewest, most = -floor((q + slack - low) / whole), floor((high + slack - q) / whole)
    inside = select(fewest <= most, minimum(maximum(wish, fewest), most), wish)
    q = select(turns > 0, q + whole * inside, q)
    q = select(q < low, select(q >= low - slack, low, q), q)
    return select(q > high, select(q <= high + slack, high, q), q)


def _inside(q, low, high):
    return select(q >= low, select(q <= high, 1, 0), 0)


@kernel(**dict.fromkeys(("q", "low", "high", "wanted", "turns", "slack"), SCALAR), returns=(SCALAR, SCALAR))
def brought_within_limits(q, low, high, wanted, turns, slack):
    """Return a joint variable within its limits if a whole number of turns brings it there, and whether it is there.

    Parameters
    ----------
    q, low, high
        The variable and its limits, which may be infinite.
    wanted
        Of several numbers of turns, the one that brings the variable nearest to this value is taken.
    turns
        1 if whole turns may be added; 0 for slides, and for joints that are held.
    slack
        Variables beyond a limit by up to this much, by rounding, are set to the limit.
    """
    q = _within(q, low, high, wanted, turns, slack)
    return q, _inside(q, low, high)


BRANCHES, OF_BRANCHES = array(SCALAR, "b", "n"), array(SCALAR, "b")
FAR = 10**30
"""Larger than any squared distance of configurations."""
JUDGED = {
    "turns": NUMBERS, "free": NUMBERS, "low": NUMBERS, "high": NUMBERS, "slack": SCALAR,
    "right": SCALAR, "exact": SCALAR, "rough": SCALAR, "no_root": SCALAR, "coincide": SCALAR, "missing": SCALAR,
}  # fmt: skip


class Judged(NamedTuple):
    """A branch: its variables, and 1 or 0 for whether it is valid, within limits, singular, and in doubt."""

    q: Any
    valid: Any
    within: Any
    singular: Any
    doubtful: Any


def judged(
    q, gap, away, wanted, turns, free, low, high, slack, right, exact, rough, no_root, coincide, missing
):  # fmt: skip
    """Judge one branch, at a distance from the goal, as `judged_branches`."""
    valid = select(away <= right, 1, 0)
    singular = select(absolute(gap) <= coincide, 1, 0)
    polishable = select(away > exact, select(away < rough, select(gap > no_root, 1, 0), 0), 0)
    doubtful = maximum(polishable, singular * select(away >= rough, select(away < FAR, 1, 0), 0))

    def placed(x, least, most, wish, turn, moves):
        # The atan2 of -0 and a negative number is -pi.
        turns = moves * turn
        x = select(equal(x, -HALF_TURN), HALF_TURN * (2 * turns - 1), x)
        return _within(x, least, most, wish, turns, moves * slack)

    moved = each(placed, q, low, high, wanted, turns, free)
    within = fold(lambda all_of, x, least, most: all_of * _inside(x, least, most), valid, moved, low, high)
    return Judged(each(lambda x: select(valid > 0, x, missing), moved), valid, within, singular, doubtful)


def _preferred(moved, valid, within, singular, doubtful, wanted, near):
    some = fold(maximum, 0, within)

    def preferred(state, branch, reaches, inside):
        best, score = state
        away = fold(lambda sum, x, other: sum + (x - other) * (x - other), 0, branch, wanted)
        own = select(select(some > 0, inside, reaches) > 0, select(near > 0, away, 0), FAR)
        return each(lambda x, y: select(own < score, x, y), branch, best), select(own < score, own, score)

    best, _ = fold(preferred, (wanted, 2 * FAR), moved, valid, within)
    is_singular = fold(lambda any_of, reaches, alike: maximum(any_of, reaches * alike), 0, valid, singular)
    return best, is_singular, 1 - fold(maximum, 0, valid) * (1 - fold(maximum, 0, doubtful))


@kernel(
    q=VARIABLES, gap=SCALAR, goal=MOTOR, wanted=VARIABLES, axes=AXES, size=SCALAR, **JUDGED,
    returns=(VARIABLES, SCALAR, SCALAR, SCALAR, SCALAR),
)  # fmt: skip
def judged_branch(
    q, gap, goal, wanted, axes, size, turns, free, low, high, slack, right, exact, rough, no_root, coincide, missing
):  # fmt: skip
    """Judge one of the branches as `judged_branches`, before any is preferred.

    Returns the variables, and 1 or 0 for whether the branch is valid, within the limits, singular, and in doubt.
    """
    return tuple(judged(
        q, gap, distance(q, goal, axes, turns, size), wanted, turns, free, low, high, slack, right, exact, rough,
        no_root, coincide, missing,
    ))  # fmt: skip


@kernel(
    q=BRANCHES, **dict.fromkeys(("valid", "within", "singular", "doubtful"), OF_BRANCHES), wanted=VARIABLES,
    near=SCALAR, returns=(VARIABLES, SCALAR, SCALAR),
)  # fmt: skip
def preferred_branch(q, valid, within, singular, doubtful, wanted, near):
    """Return what `judged_branches` says of all branches: the best, and whether one is singular or in doubt."""
    return _preferred(q, valid, within, singular, doubtful, wanted, near)


@kernel(
    q=BRANCHES, gap=OF_BRANCHES, off=OF_BRANCHES, wanted=VARIABLES, near=SCALAR, **JUDGED,
    returns=(BRANCHES, OF_BRANCHES, OF_BRANCHES, VARIABLES, SCALAR, SCALAR),
)  # fmt: skip
def judged_branches(
    q, gap, off, wanted, near, turns, free, low, high, slack, right, exact, rough, no_root, coincide, missing
):  # fmt: skip
    """Judge the branches that a closed form returns for a goal.

    Parameters
    ----------
    q, gap, off
        Branches, their discriminants, and the distances of their motors from the goal, as of `distance_to_goal`.
    wanted, near
        If `near` is positive, angles are brought near to those of `wanted`, and branches near to it are preferred.
    free
        1 for each joint whose variable may be changed, 0 for those that are held.
    slack
        Variables beyond a limit by up to this much, by rounding, are set to the limit.
    right
        A branch is valid if its motor differs from the goal by at most this.
    exact, rough, no_root
        Branches that differ by more than `exact` and less than `rough` are in doubt, unless their discriminant is at
        most `no_root`.
    coincide
        Branches whose discriminants are at most this are singular. They are in doubt if they differ by `rough` or more.
    missing
        The variables of branches that are not valid, such as NaN.

    Returns
    -------
    q
        The branches within limits, where whole turns bring them there.
    valid, within
        For each branch, 1 or 0: whether it reaches the goal, and whether it does so within the limits.
    best
        The valid branch to prefer, within the limits if there is one.
    singular, doubtful
        1 or 0: whether a valid branch is singular; whether a branch is in doubt, or none is valid.
    """

    def one(branch, root, away):
        return tuple(judged(
            branch, root, away, wanted, turns, free, low, high, slack, right, exact, rough, no_root, coincide, missing
        ))  # fmt: skip

    moved, valid, within, singular, doubtful = each(one, q, gap, off)
    return moved, valid, within, *_preferred(moved, valid, within, singular, doubtful, wanted, near)
