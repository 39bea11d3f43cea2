"""Robots on their way to several tasks at once: damped least squares over the variables of a tree of joints.

The joints are those of `gacompiler.specs.robots`. A task concerns a point and a direction that a link carries, and a
place or a direction in the base frame. It is fulfilled where three numbers are zero, its rows times one of four
vectors; `kinds` is the number of the vector:

    0   from the point to the target
    1   from the direction to the target, which is a direction
    2   its first number is the radius less the distance of the point from the target; the others are zero
    3   from the direction to the unit vector that leads from the point to the target

The rows contain the weight of a task and, where only a part of a vector matters, a projection: to the normal of a
plane on which the point is to lie, for example. Tables of the tasks and of the variables:

    links       the joint whose link carries the point and the direction
    points      the points in the frame of that joint
    directions  the directions in that frame
    rows        three rows of three numbers
    radii
    joints      for each variable the joint by which it moves the tasks
    carried     for each variable and task the ratio of that joint if it moves the link, otherwise 0
    low, high   limits of the variables
    pulls       weights of the squared distances of the variables from those of `rest`

Errors are compared with `size`, a length of the order of the robot.
"""

from fractions import Fraction
from typing import Any, NamedTuple

from gacompiler import (
    SCALAR,
    array,
    each,
    equal,
    gather,
    index,
    iterate,
    kernel,
    matrices,
    maximum,
    minimum,
    row_numbers,
    select,
    sqrt,
    total,
)
from gacompiler.specs import robots
from gacompiler.specs.families.covariances import cross, dot
from gacompiler.specs.reaching import CEILING, CLOSE, ROUNDING, SETTLED, START

VALUES = array(SCALAR, "m")
FIXED = array(SCALAR, "m", shared=True)

FLOOR = Fraction(1, 2**44)
"""Smallest damping, relative to the squared size: the rounding errors of normal equations, which contain squares."""


class Equations(NamedTuple):
    """Normal equations of a step: the matrix, the right-hand side, and the root of the sum of squared errors."""

    matrix: Any
    right: Any
    error: Any


class State(NamedTuple):
    """A descent: variables and their equations, damping, whether it has ended, and the best variables so far."""

    q: Any
    equations: Any
    damping: Any
    done: Any
    best: Any
    least: Any


def _times(rows, vector):
    return tuple(dot(row, vector) for row in rows)


def _chosen(kind, *vectors):
    """Return the vector with the number `kind`."""
    found = vectors[-1]
    for k in reversed(range(len(vectors) - 1)):
        found = tuple(select(equal(kind, k), x, y) for x, y in zip(vectors[k], found, strict=True))
    return found


class Placed(NamedTuple):
    """The point and direction of a task in the base frame, the unit vector from the point to the target, its length."""

    place: Any
    along: Any
    toward: Any
    away: Any


def _placed(pose, point, direction, target):
    place = tuple(x + y for x, y in zip(pose.place, robots.rotated(pose.rotor, point), strict=True))
    gap = tuple(x - y for x, y in zip(target, place, strict=True))
    away = sqrt(dot(gap, gap))
    toward = tuple(x / select(away > 0, away, 1) for x in gap)
    return Placed(place, robots.rotated(pose.rotor, direction), toward, away)


def _left(placed, kind, target, radius):
    """Compute the vector of a task, which is zero where the task is fulfilled."""
    gap = tuple(placed.away * x for x in placed.toward)
    turn = tuple(x - y for x, y in zip(target, placed.along, strict=True))
    look = tuple(x - y for x, y in zip(placed.toward, placed.along, strict=True))
    return _chosen(kind, gap, turn, (radius - placed.away, 0, 0), look)


def _numbers(one, kind, target, radius, row):
    """Compute the three numbers of a task."""
    return _times(row, _left(one, kind, target, radius))


def _rate(axis, placed, kind):
    """Compute how fast the vector of a task decreases while a joint turns about an axis that moves the task's link."""
    turning, moment = (axis["e23"], -axis["e13"], axis["e12"]), (axis["e01"], axis["e02"], axis["e03"])
    velocity = tuple(x + y for x, y in zip(moment, cross(turning, placed.place), strict=True))
    turned = cross(turning, placed.along)
    nearer = dot(placed.toward, velocity)
    seen = tuple(
        x + (v - nearer * u) / select(placed.away > 0, placed.away, 1)
        for x, v, u in zip(turned, velocity, placed.toward, strict=True)
    )
    return _chosen(kind, velocity, turned, (-nearer, 0, 0), seen)


TREE = {"parents": robots.PARENTS, **robots.JOINTS, "variables": index("n", into="m")}
TASKS = {
    "links": index("k", into="n"),
    "kinds": array(SCALAR, "k", shared=True),
    "points": array(SCALAR, "k", 3, shared=True),
    "directions": array(SCALAR, "k", 3, shared=True),
    "rows": array(SCALAR, "k", 3, 3, shared=True),
    "radii": array(SCALAR, "k", shared=True),
}


def _poses(q, parents, *joints):
    return robots.in_base(robots.own_poses(q, *joints), parents)


@kernel(q=VALUES, targets=array(SCALAR, "k", 3), **TREE, **TASKS, returns=array(SCALAR, "k"))
def distances_to_tasks(
    q, targets, parents, variables, ratios, offsets, places, screws, turns,
    links, kinds, points, directions, rows, radii,
):  # fmt: skip
    """Compute the norm of the three numbers of each task."""
    poses = _poses(q, parents, variables, ratios, offsets, places, screws, turns)

    def distance(pose, kind, point, direction, row, radius, target):
        left = _numbers(_placed(pose, point, direction, target), kind, target, radius, row)
        return sqrt(dot(left, left))

    return each(distance, gather(poses, links), kinds, points, directions, rows, radii, targets)


def _inside(x, least, most):
    return minimum(maximum(x, least), most)


def _solved(matrix, right, damping):
    """Solve equations whose diagonal is increased by the damping."""
    own = row_numbers(right)
    damped = each(
        lambda row, i: each(lambda x, j: x + select(equal(i, j), damping, 0), row, own), matrix, own
    )  # fmt: skip
    return matrices.solve_positive(damped, right)[0]


def _moved(old, damping, low, high):
    """Return the variables after a damped step within the limits."""
    wish = each(lambda x, dx: x + dx, old.q, _solved(old.equations.matrix, old.equations.right, damping))
    bounded = each(_inside, wish, low, high)
    # Variables that the step would move beyond a limit are moved to it, and the step of the others is repeated.
    free = each(lambda x, b: select(equal(x, b), 1, 0), wish, bounded)
    used = each(lambda b, x, f: (1 - f) * (b - x), bounded, old.q, free)
    matrix = each(lambda row, f: each(lambda x, g: f * g * x, row, free), old.equations.matrix, free)
    taken = matrices.times(old.equations.matrix, used)
    right = each(lambda b, t, f: f * (b - t), old.equations.right, taken, free)
    change = _solved(matrix, right, damping)
    return each(
        lambda b, x, dx, f, least, most: select(f > 0, _inside(x + dx, least, most), b),
        bounded, old.q, change, free, low, high,
    )  # fmt: skip


def _judged(old, damping, trial, found, size, enough):
    """Return the state after a step to a trial with the given equations, which is kept if it is better."""
    before, error = old.equations.error, found.error
    better = error < maximum(before, CLOSE * size)
    slow = select(better, error > SETTLED * maximum(before, CLOSE * size), damping > CEILING * size * size)
    ended = select(before > ROUNDING * size, slow, 2 * error > before)

    def kept(a, b):
        return each(lambda x, y: select(better, x, y), a, b)

    return State(
        kept(trial, old.q),
        Equations(
            each(kept, found.matrix, old.equations.matrix),
            kept(found.right, old.equations.right),
            select(better, error, before),
        ),
        old.damping * select(error < before, Fraction(1, 10), 10),
        select(minimum(error, before) <= enough, 1, ended),
        each(lambda a, b: select(error < old.least, a, b), trial, old.best),
        minimum(error, old.least),
    )


@kernel(
    q=VALUES, targets=array(SCALAR, "k", 3), rest=VALUES, **TREE, **TASKS,
    joints=index("m", into="n"), carried=array(SCALAR, "m", "k", shared=True),
    low=FIXED, high=FIXED, pulls=FIXED, size=SCALAR, enough=SCALAR, at_most=SCALAR,
    returns=(VALUES, SCALAR),
)  # fmt: skip
def reach(
    q, targets, rest, parents, variables, ratios, offsets, places, screws, turns,
    links, kinds, points, directions, rows, radii, joints, carried, low, high, pulls, size, enough, at_most,
):  # fmt: skip
    """Move the variables within their limits until the tasks are fulfilled, or to a local minimum of their errors.

    Returns the variables, and the root of the sum of the squared numbers of the tasks and of the squared distances from
    `rest`, times `pulls`. An error up to `enough` ends the descent, which takes `at_most` steps.
    """

    def equations(q):
        poses = _poses(q, parents, variables, ratios, offsets, places, screws, turns)
        axes = gather(each(robots.to_parent, poses, screws), joints)
        placed = each(_placed, gather(poses, links), points, directions, targets)
        left = each(_numbers, placed, kinds, targets, radii, rows)

        def column(axis, shares):
            def entry(one, kind, row, share):
                return tuple(share * x for x in _times(row, _rate(axis, one, kind)))

            return each(entry, placed, kinds, rows, shares)

        columns = each(column, axes, carried)
        apart = each(lambda x, y: x - y, rest, q)
        own = row_numbers(q)

        def entries(first, i, pull):
            return each(
                lambda second, j: total(dot, first, second) + select(equal(i, j), pull, 0), columns, own
            )  # fmt: skip

        matrix = each(entries, columns, own, pulls)
        right = each(lambda one, pull, gap: total(dot, one, left) + pull * gap, columns, pulls, apart)
        error = total(dot, left, left) + total(lambda pull, gap: pull * gap * gap, pulls, apart)
        return Equations(matrix, right, sqrt(error))

    def step(old):
        damping = maximum(old.damping * old.equations.error * old.equations.error, FLOOR * size * size)
        trial = _moved(old, damping, low, high)
        return _judged(old, damping, trial, equations(trial), size, enough)

    start = each(_inside, q, low, high)
    begun = equations(start)
    found, _, _ = iterate(step, State(start, begun, START, 0, start, begun.error), lambda _, new: new.done > 0, at_most)
    return found.best, found.least
