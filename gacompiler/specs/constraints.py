"""Robots whose links are held: closed loops, and contacts with the ground, as constraints on twists.

The joints are those of `gacompiler.specs.robots`. A row of a constraint is a wrench of unit size, a line ``W`` through
a point of one link. The power ``W & (V - V')`` is to be zero, where ``V`` is the twist of that link and ``V'`` that of
the other, to which the wrench is fixed, or of the ground. The forces of constraints are multiples of these wrenches,
exerted by the other link on the first. Tables of the rows:

    owners      the joint that carries the first link
    points      the point of the row, in the frame of that joint
    marks       a direction of the first link, in that frame
    others      the joint that carries the other link; any joint if that is the ground
    grounded    1 if the other link is the ground, otherwise 0
    forces, torques     the wrench: its force, and its torque about the point, in the frame of the other link
    targets     where the point is to be, in that frame
    bearings    a direction of the other link that is to be perpendicular to the mark
    known       1 if there is such a target, otherwise 0
    held        for each pair of a row and a joint that moves one of its links: the row
    movers      the joint
    places_of   its coordinate
    factors     its ratio, negative for the other link
    lifted      the rows that the ground exerts on links of a floating base
    lifted_freedoms     the freedoms of the base, for each
"""

from fractions import Fraction
from typing import Any, NamedTuple

from gacompiler import (
    SCALAR,
    absolute,
    array,
    assemble,
    commutator,
    each,
    equal,
    fold,
    gather,
    index,
    kernel,
    matrices,
    maximum,
    pick,
    row_numbers,
    scan,
    scatter,
    select,
    sqrt,
    total,
)
from gacompiler.algebra.catalog import PGA3
from gacompiler.specs import robots
from gacompiler.specs.families.covariances import cross, dot
from gacompiler.specs.robots import Motion, Pose

POINTS, NUMBERS = array(SCALAR, "r", 3, shared=True), array(SCALAR, "r", shared=True)
ROWS = {
    "owners": index("r", into="n"),
    "points": POINTS,
    "marks": POINTS,
    "others": index("r", into="n"),
    "grounded": NUMBERS,
    "forces": POINTS,
    "torques": POINTS,
    "targets": POINTS,
    "bearings": POINTS,
    "known": NUMBERS,
    "held": index("p", into="r"),
    "movers": index("p", into="n"),
    "places_of": index("p", into="m"),
    "factors": array(SCALAR, "p", shared=True),
    "lifted": index("l", into="r"),
    "lifted_freedoms": index("l", 6, into="m"),
}

DEPENDENT = Fraction(1, 2**26)
"""A row depends on those before it if less than this part of its terms remains: half of the digits."""

ROUNDED = robots.NO_INERTIA / DEPENDENT
"""The part of a distance from the base of which half of the digits are right, in spite of its rounding errors."""


class Row(NamedTuple):
    """A row of a constraint in the base frame, and the sizes of the terms of its numbers, which may cancel.

    Attributes
    ----------
    wrench, place : the wrench, and the point at which it acts
    reach : the length of the links between the base and this point
    drift, gap : the acceleration without that of the rates, and the violation; their sizes follow
    """

    wrench: Any
    place: Any
    reach: Any
    drift: Any
    gap: Any
    drift_terms: Any
    gap_terms: Any


class Extent(NamedTuple):
    """Bounds for a link: the length of links from the base to it, and its angular and linear speeds."""

    reach: Any
    spin: Any
    speed: Any


def _velocity(twist, place):
    """Return the velocity of a point that moves with a twist."""
    return robots._plus(robots._moment(twist), cross(robots._direction(twist), place))


def _length(vector):
    return sqrt(dot(vector, vector))


def _terms(turns, force, torque, distance, reach):
    """Return the size of the terms of the power of a wrench of unit size on a twist of unit size.

    Rounding errors do not decrease with the distance between both, but grow with that from the base.
    """
    pushes, twists = dot(force, force), dot(torque, torque)
    return turns * (twists + pushes * (distance + ROUNDED * reach)) + (1 - turns) * pushes


def _ground(q, base):
    """Compute the pose of the world in the frame of the base."""

    def of_world(_, *motor):
        pose = robots._pose_of_base(*motor)
        return Pose(~pose.rotor, tuple(-x for x in robots.rotated(~pose.rotor, pose.place)))

    return fold(of_world, Pose(assemble(PGA3, {"1": 1}), (0, 0, 0)), *gather(q, base))


def _row(pose, motion, extent, other, other_motion, other_extent, point, mark, force, torque, target, bearing, known):
    place = robots._plus(pose.place, robots.rotated(pose.rotor, point))
    along, turn = robots.rotated(other.rotor, force), robots.rotated(other.rotor, torque)
    velocity = _velocity(motion.twist, place)
    # The other link's velocity is taken at the point, which moves with the first link.
    apart = robots._minus(velocity, _velocity(other_motion.twist, place))
    spin = robots._direction(other_motion.twist)
    rate = robots._plus(_velocity(motion.rate, place), cross(robots._direction(motion.twist), velocity))
    other_rate = robots._plus(_velocity(other_motion.rate, place), cross(spin, velocity))
    turned = robots._minus(robots._direction(motion.twist), spin)
    turning = robots._minus(robots._direction(motion.rate), robots._direction(other_motion.rate))
    drift = dot(along, robots._minus(rate, other_rate)) + dot(cross(spin, along), apart)
    drift = drift + dot(turn, turning) + dot(cross(spin, turn), turned)
    away = robots._minus(place, robots._plus(other.place, robots.rotated(other.rotor, target)))
    tilt = dot(robots.rotated(pose.rotor, mark), robots.rotated(other.rotor, bearing))
    wrench = robots._line(along, robots._plus(cross(place, along), turn))
    # The sizes of both links are added, since their motions may cancel.
    arm, apart = _length(point), _length(robots._minus(place, other.place))
    reach = extent.reach + arm + other_extent.reach
    fast = extent.spin + other_extent.spin
    speeds = extent.speed + extent.spin * arm + other_extent.speed + other_extent.spin * apart
    pushes, far = dot(force, force), ROUNDED * reach
    drift_terms = fast * (pushes * (speeds + far * fast) + dot(torque, torque) * fast)
    gap_terms = known * (pushes * (apart + _length(target) + far) + dot(mark, mark))
    return Row(wrench, place, reach, drift, known * (dot(along, away) + tilt), drift_terms, gap_terms)


TREE = {"parents": robots.PARENTS, **robots.JOINTS, **robots.COORDINATES}


@kernel(
    q=robots.POSITIONS, qd=robots.VALUES, **TREE, **ROWS, **robots.BASE, **robots.FREEDOMS,
    returns=(
        array(SCALAR, "r", "m"), array(SCALAR, "r"), array(SCALAR, "r"),
        array(SCALAR, "r", "m"), array(SCALAR, "r"), array(SCALAR, "r"),
    ),
)  # fmt: skip
def constraint_rows(
    q, qd, parents, variables, ratios, offsets, places, screws, turns, coordinates,
    owners, points, marks, others, grounded, forces, torques, targets, bearings, known,
    held, movers, places_of, factors, lifted, lifted_freedoms, base, freedoms,
):  # fmt: skip
    """Compute the matrix of constraints, their accelerations at constant rates, and what they are violated by.

    The product of the matrix and the rates are the velocities that are to vanish. Violations are lengths, and sines of
    angles: cosines of angles between marks and bearings, which are to be right. Three more results, in the same order,
    are the sizes of the terms of which each of these numbers is the sum, for judging what remains of them.
    """
    own = robots.own_poses(q, variables, ratios, offsets, places, screws, turns)
    poses = robots.in_base(own, parents)
    axes = each(robots.to_parent, poses, screws)

    def outward(carrier, axis, speed, ratio):
        turned = ratio * speed * axis
        return Motion(carrier.twist + turned, carrier.rate + commutator(turned, carrier.twist))

    still = robots._NO_LINE
    start = Motion(robots._twist_of_base(qd, freedoms), still)
    motions = scan(outward, start, axes, gather(qd, coordinates), ratios, parents=parents)
    world = _ground(q, base)

    def farther(carrier, pose, speed, ratio, turn):
        length, fast = _length(pose.place), absolute(ratio * speed)
        return Extent(
            carrier.reach + length,
            carrier.spin + turn * fast,
            carrier.speed + carrier.spin * length + (1 - turn) * fast,
        )  # fmt: skip

    nearest = Extent(0, _length(robots._direction(start.twist)), _length(robots._moment(start.twist)))
    extents = scan(farther, nearest, own, gather(qd, coordinates), ratios, turns, parents=parents)

    def of_row(pose, motion, extent, other, other_motion, other_extent, is_grounded, *numbers):
        def chosen(ground, link):
            return select(is_grounded > 0, ground, link)

        rotor = assemble(PGA3, {name: chosen(world.rotor[name], other.rotor[name]) for name in PGA3.ROTOR.blades})
        other = Pose(rotor, tuple(chosen(x, y) for x, y in zip(world.place, other.place, strict=True)))
        moves = 1 - is_grounded
        moved = Motion(moves * other_motion.twist, moves * other_motion.rate)
        return _row(pose, motion, extent, other, moved, Extent(*(moves * x for x in other_extent)), *numbers)

    rows = each(
        of_row, *gather((poses, motions, extents), owners), *gather((poses, motions, extents), others),
        grounded, points, marks, forces, torques, targets, bearings, known,
    )  # fmt: skip
    acting, moving = (rows.wrench, rows.place, rows.reach, forces, torques), gather(axes, movers)
    wrenches, *numbers = gather(acting, held)

    def term(pose, turn, factor, place, reach, force, torque):
        away = _length(robots._minus(place, pose.place))
        return absolute(factor) * _terms(turn, force, torque, away, reach)

    entries = each(lambda axis, wrench, factor: factor * (axis & wrench), moving, wrenches, factors)
    sizes = each(term, gather(poses, movers), gather(turns, movers), factors, *numbers)
    matrix, terms = (scatter(x, (held, places_of), (known, qd)) for x in (entries, sizes))

    def terms_of_base(place, reach, force, torque):
        return tuple(_terms(turn, force, torque, _length(place), reach) for turn in (1, 1, 1, 0, 0, 0))

    wrenches, *numbers = gather(acting, lifted)
    powers, sizes = each(robots.powers_of, wrenches), each(terms_of_base, *numbers)
    for power, size, freedom in zip(powers, sizes, lifted_freedoms, strict=True):
        matrix = scatter(power, (lifted, freedom), (known, qd), start=matrix)
        terms = scatter(size, (lifted, freedom), (known, qd), start=terms)
    return matrix, rows.drift, rows.gap, terms, rows.drift_terms, rows.gap_terms


def inner(x, y):
    """Return the sum of the products of two arrays of scalars."""
    return total(lambda a, b: a * b, x, y)


class Projection(NamedTuple):
    """A vector on its way to all equations, and what has been found of them.

    Attributes
    ----------
    equations : what remains of the equations, as columns: nothing of those up to the present one
    upper : their products with the given equations, an upper triangular matrix
    x, steps : the vector, and its steps along the equations
    squared : the squared length of the first vector, and of all steps
    count : the number of independent equations
    left : the largest contradiction of dependent equations, relative to their terms
    """

    equations: Any
    upper: Any
    x: Any
    steps: Any
    squared: Any
    count: Any
    left: Any


def projected(equations, wanted, start, least, sizes, scales):
    """Move a vector to the nearest one that satisfies ``equations^T x = wanted``.

    The equations, which are columns, are made orthonormal one by one (Gram and Schmidt, Golub and Van Loan, *Matrix
    Computations*, 5.2.8), and the vector is moved along each. `sizes` are the squared sizes of the terms of the
    equations, `scales` those of the right-hand sides, both of which may cancel. An equation of which less than the part
    `least` of its size remains is left out, since it may be only a rounding error. The inner loops are over equations,
    which vector lanes share.
    """
    numbers = row_numbers(wanted)
    zeros = each(lambda _: 0, wanted)
    squares = total(lambda row: each(lambda c: c * c, row), equations)

    def step(old, k):
        column = each(lambda row: pick(row, k, 0), old.equations)
        left, value = inner(column, column), pick(wanted, k, 0)
        size = pick(squares, k, 0) + pick(sizes, k, 0)
        keeps = left > least * least * size
        scale = select(keeps, 1, 0) / sqrt(select(keeps, left, 1))
        unit = each(lambda y: scale * y, column)
        products = total(lambda row, u: each(lambda c: u * c, row), old.equations, unit)
        along = each(lambda c, j: select(j < k, 0, c), products, numbers)
        gap = value - inner(each(lambda row: pick(row, k, 0), equations), old.x)
        length = gap * scale
        terms = absolute(value) + sqrt(size * old.squared) + pick(scales, k, 0)
        contradiction = select(keeps, 0, absolute(gap) / select(terms > 0, terms, 1))
        return Projection(
            each(lambda row, u: each(lambda c, y: c - y * u, row, along), old.equations, unit),
            each(lambda row, i: each(lambda y, z: select(equal(i, k), z, y), row, along), old.upper, numbers),
            each(lambda y, z: y + length * z, old.x, unit),
            each(lambda y, i: select(equal(i, k), length, y), old.steps, numbers),
            old.squared + length * length,
            old.count + select(keeps, 1, 0),
            maximum(old.left, contradiction),
        )  # fmt: skip

    squared = inner(start, start)
    return fold(step, Projection(equations, each(lambda _: zeros, wanted), start, zeros, squared, 0, 0), numbers)


def eliminated(mass, columns, force):
    """Eliminate the variables below the diagonal of a symmetric matrix, in its own columns and in others.

    With ``mass = L D L^T``, the results are ``D L^T``, ``L^-1 columns`` and ``L^-1 force``. Multiples of
    pivot rows that are divided first are subtracted in place, from whole rows, without conditions in the inner loops.
    """
    numbers = row_numbers(mass)

    def step(old, k):
        above, others, value = (pick(part, k, 0) for part in old)
        pivot = pick(above, k, 0)
        inverse = select(equal(pivot, 0), 0, 1 / select(equal(pivot, 0), 1, pivot))
        above, others = (each(lambda x: inverse * x, row) for row in (above, others))

        def reduced(row, own, right, i):
            factor = select(i > k, pick(row, k, 0), 0)
            return (
                each(lambda x, y: x - factor * y, row, above),
                each(lambda x, y: x - factor * y, own, others),
                right - factor * (inverse * value),
            )

        return each(reduced, *old, numbers)

    return fold(step, (mass, columns, force), numbers)


@kernel(
    mass=array(SCALAR, "m", "m"), force=array(SCALAR, "m"), rows=array(SCALAR, "r", "m"), wanted=array(SCALAR, "r"),
    terms=array(SCALAR, "r", "m"), scales=array(SCALAR, "r"),
    largest=array(SCALAR, "m", shared=True),
    returns=(array(SCALAR, "m"), array(SCALAR, "r"), SCALAR, SCALAR, array(SCALAR, "r", "r"), array(SCALAR, "r")),
)  # fmt: skip
def constrained(mass, force, rows, wanted, terms, scales, largest):
    """Compute the accelerations under forces and constraints, ``mass a = force + rows^T multipliers, rows a = wanted``.

    Of all accelerations that satisfy the constraints, they are the nearest to those of the free robot, by the kinetic
    energy of the difference (Gauss). Returns the accelerations, the multipliers, which are 0 for dependent rows, the
    number of independent rows, the largest contradiction of dependent rows, relative to its terms, and the arguments of
    `smallest_multipliers`. `terms` and `scales` are the sizes of the terms of `rows` and `wanted`. All are NaN if a
    pivot of the mass matrix is zero up to the rounding errors of `largest`, the largest inertias of the variables.
    """
    upper, columns, free = eliminated(mass, matrices.transpose(rows), force)
    pivots = each(lambda row, i: pick(row, i, 0), upper, row_numbers(upper))

    def root(pivot, most):
        moves = pivot > robots.NO_INERTIA * most
        return sqrt(select(moves, pivot, 0)) / select(moves, 1, 0)

    # In coordinates in which the kinetic energy is the sum of squares, the nearest accelerations are a projection.
    roots = each(root, pivots, largest)
    inverses = each(lambda size: 1 / size, roots)
    white = each(lambda row, scale: each(lambda x: scale * x, row), columns, inverses)
    # Columns of the inverse mass matrix are at least as long as the inverse pivots.
    sizes = total(
        lambda column, scale: each(lambda x: (scale * x) * (scale * x), column), matrices.transpose(terms), inverses
    )
    began = each(lambda x, scale: scale * x, free, inverses)
    found = projected(white, wanted, began, DEPENDENT, sizes, scales)
    accelerations = matrices.solve_upper(upper, each(lambda x, size: x * size, found.x, roots))
    multipliers = matrices.solve_upper(found.upper, found.steps)
    return accelerations, multipliers, found.count, found.left, found.upper, found.steps


@kernel(upper=array(SCALAR, "r", "r"), steps=array(SCALAR, "r"), returns=array(SCALAR, "r"))
def smallest_multipliers(upper, steps):
    """Compute the multipliers of `constrained` with the smallest sum of squares, if some rows depend on others.

    `upper` are the products of independent rows with all rows, and `steps` what the multipliers must add up to.
    """
    zeros = each(lambda _: 0, steps)
    return projected(matrices.transpose(upper), steps, zeros, 0, zeros, zeros).x


@kernel(
    rows=array(SCALAR, "u", "r"), wanted=array(SCALAR, "u"),
    terms=array(SCALAR, "u", "r"), scales=array(SCALAR, "u"),
    returns=(array(SCALAR, "r"), SCALAR, SCALAR),
)  # fmt: skip
def balanced(rows, wanted, terms, scales):
    """Compute the multipliers with the smallest sum of squares that satisfy ``rows multipliers = wanted``.

    `terms` and `scales` are the sizes of the terms of `rows` and `wanted`, which may cancel.
    Returns the multipliers, the number of independent rows, and the largest contradiction of dependent rows.
    """
    columns = matrices.transpose(rows)
    sizes = each(lambda row: inner(row, row), terms)
    found = projected(columns, wanted, each(lambda _: 0, columns), DEPENDENT, sizes, scales)
    return found.x, found.count, found.left
