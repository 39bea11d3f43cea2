"""Grasps: meshes, contacts, wrenches, postures of any hand, and its clearance.

Points, lines and motors are those of G(3,0,1), as in the module `pga3`. A contact force is a line: the join of the
point of contact with the direction of the force. A twist is a line as well, and the point at x moves with the
commutator of the twist and the point.

A hand is a tree of joints on a palm, with the tables of `gacompiler.specs.robots`.
"""

from fractions import Fraction

import gacompiler as ga
from gacompiler import (
    SCALAR,
    array,
    assemble,
    each,
    equal,
    fold,
    gather,
    index,
    iterate,
    kernel,
    matrices,
    row_numbers,
    select,
    sqrt,
    total,
    transpose,
)
from gacompiler.algebra.catalog import PGA3
from gacompiler.specs import robots
from gacompiler.specs.families.covariances import cross, dot

LINE, POINT = PGA3.LINE, PGA3.POINT
VECTOR, TRIPLE = array(SCALAR, 3), array(SCALAR, 3, 3)
VARIABLES, LIMITS = array(SCALAR, "m"), array(SCALAR, "m", shared=True)
POINTS = array(SCALAR, "n", 3, shared=True)
VERTICES, CORNER = array(SCALAR, "v", 3, shared=True), index("m", into="v")
TWISTS = array(SCALAR, "d", 6, shared=True)
TINY, FAR = Fraction(1, 10**30), float(2**100)
STEPS = 8
"""Maximum number of steps of `preshape`; where more do not converge, rounding errors grow without bound."""
EXACT = Fraction(1, 10**11)
"""The error of a distance between fingertips, in metres, at which `preshape` stops."""
LONGEST = Fraction(1, 2)
"""The largest change of a variable in one step, in radians, or in metres if it is that of a slide."""
DAMPING = Fraction(1, 10**8)
SIDES = ((0, 1), (1, 2), (2, 0))


def _product_of_rows(x, y):
    """Compute the sum of the products of two arrays."""
    return total(lambda a, b: a * b, x, y)


def _place(p):
    return PGA3.multivector({"e123": 1}) + assemble(PGA3, dict(zip(POINT.blades, p, strict=True)))


def _coordinates(point):
    return tuple(point[name] for name in POINT.blades)


def _line(numbers):
    return assemble(PGA3, dict(zip(LINE.blades, numbers, strict=True)))


def _minus(a, b):
    return tuple(x - y for x, y in zip(a, b, strict=True))


# Meshes.


@kernel(
    vertices=VERTICES, i=CORNER, j=CORNER, k=CORNER,
    returns=(array(SCALAR, "m", 3), SCALAR, VECTOR, array(SCALAR, 6)),
)  # fmt: skip
def mesh_moments(vertices, i, j, k):
    """Compute the area vectors of the triangles of a mesh, and the moments of the volume inside.

    The volume is a sum over the tetrahedra of the triangles and the origin, with signs.

    Returns
    -------
    areas
        For each triangle, its normal times its area.
    volume, first
        The volume, and its first moments.
    second
        The second moments, the upper triangle of a matrix.
    """

    def of(a, b, c):
        normal = cross(_minus(b, a), _minus(c, a))
        six = dot(a, normal)
        middle = tuple(x + y + z for x, y, z in zip(a, b, c, strict=True))
        second = tuple(
            six * (middle[p] * middle[q] + a[p] * a[q] + b[p] * b[q] + c[p] * c[q])
            for p in range(3)
            for q in range(p, 3)
        )
        return tuple(x / 2 for x in normal), (six, tuple(six * x for x in middle), second)

    corners = gather(vertices, i), gather(vertices, j), gather(vertices, k)
    areas = each(lambda a, b, c: of(a, b, c)[0], *corners)
    volume, first, second = total(lambda a, b, c: of(a, b, c)[1], *corners)
    return areas, volume / 6, tuple(x / 24 for x in first), tuple(x / 120 for x in second)


# Contacts.


@kernel(p=POINT, n=VECTOR, u=VECTOR, v=VECTOR, friction=SCALAR, cosine=SCALAR, sine=SCALAR, returns=LINE)
def contact_wrench(p, n, u, v, friction, cosine, sine):
    """Compute the wrench of a force on the edge of a friction cone: the join of the contact with the force.

    Parameters
    ----------
    p
        The point of contact.
    n, u, v
        The outward unit normal, and two unit tangents.
    friction
        The coefficient of friction.
    cosine, sine
        Of the angle of the edge about the normal.

    Returns
    -------
    LINE
        The force, whose normal part is 1, as a line. Its moment is that about the origin.
    """
    force = [friction * (cosine * a + sine * b) - c for a, b, c in zip(u, v, n, strict=True)]
    return p & assemble(PGA3, dict(zip(POINT.blades, force, strict=True)))


def _support(twist, contacts, normals, friction):
    """Return the greatest power of a unit of normal force at one of three contacts, and its derivatives."""
    columns = [PGA3.multivector({name: 1}) for name in LINE.blades]
    most, slope = -FAR, [0] * len(columns)
    for p, n in zip(contacts, normals, strict=True):
        point = _place(p)
        velocity = _coordinates(ga.commutator(point, twist))
        along = dot(n, velocity)
        across = [v - along * x for v, x in zip(velocity, n, strict=True)]
        size = sqrt(dot(across, across) + TINY)
        force = [friction * t / size - x for t, x in zip(across, n, strict=True)]
        power = friction * size - along
        rows = [dot(force, _coordinates(ga.commutator(point, column))) for column in columns]
        slope = [ga.select(power > most, row, old) for row, old in zip(rows, slope, strict=True)]
        most = ga.maximum(most, power)
    return most, slope


def _size(numbers):
    return sqrt(dot(numbers, numbers) + TINY)


def _lower(best, numbers, triple):
    """Return the lower of a support found so far and that of a twist, with the coefficients of its twist."""
    least, twist = best
    value = _support(_line(numbers), *triple)[0]
    return ga.minimum(least, value), tuple(
        ga.select(value < least, x, old) for x, old in zip(numbers, twist, strict=True)
    )


@kernel(contacts=TRIPLE, normals=TRIPLE, friction=SCALAR, twists=TWISTS, returns=SCALAR)
def quality_bound(contacts, normals, friction, twists):
    """Compute an upper bound of the quality of three contacts: the least support of their wrenches over some twists.

    The quality is the least support over all twists of norm 1. The bound is the least over given twists, to which the
    rotations about the lines through two contacts are added, because two of the contacts do not resist them.

    Parameters
    ----------
    contacts
        Points relative to the centre of mass, in units of the length by which torques are divided.
    normals
        Outward unit normals.
    friction
        The coefficient of friction.
    twists
        Lines whose six coefficients have the norm 1.
    """
    triple = contacts, normals, friction
    least = FAR
    for numbers in _joins(contacts):
        least = ga.minimum(least, _support(_line(numbers), *triple)[0])
    return fold(lambda low, numbers: ga.minimum(low, _support(_line(numbers), *triple)[0]), least, twists)


def _joins(contacts):
    """Return the unit twists that rotate about lines through two contacts, in both directions."""
    for a, b in SIDES:
        join = _place(contacts[a]) & _place(contacts[b])
        numbers = [join[name] for name in LINE.blades]
        size = _size(numbers)
        for sign in (1, -1):
            yield tuple(sign * x / size for x in numbers)


@kernel(contacts=TRIPLE, normals=TRIPLE, friction=SCALAR, twists=TWISTS, shares=array(SCALAR, "s", shared=True))
def refined_bound(contacts, normals, friction, twists, shares):
    """Compute a lower bound than `quality_bound` by a descent from the best of the twists.

    Parameters
    ----------
    contacts, normals, friction, twists
        As in `quality_bound`.
    shares
        The lengths of the steps along the negative direction of the subgradient.
    """
    triple = contacts, normals, friction
    least, start = fold(lambda low, numbers: _lower(low, numbers, triple), (FAR, (0, 0, 0, 0, 0, 0)), twists)

    def step(state, share):
        low, twist = state
        value, slope = _support(_line(twist), *triple)
        # The part of the subgradient along the sphere of unit twists.
        slope = [s - value * t for s, t in zip(slope, twist, strict=True)]
        scale = share / _size(slope)
        moved = [t - scale * s for t, s in zip(twist, slope, strict=True)]
        size = _size(moved)
        return ga.minimum(low, value), tuple(x / size for x in moved)

    return fold(step, (least, start), shares)[0]


@kernel(
    point=VECTOR, normal=VECTOR, points=POINTS, normals=array(SCALAR, "n", 3, shared=True),
    friction=SCALAR, size=SCALAR, most=SCALAR, returns=(SCALAR, SCALAR),
)  # fmt: skip
def partner(point, normal, points, normals, friction, size, most):
    """Find the sample that, with a given one, is held best by two soft fingers.

    The line between the contacts must be inside both friction cones (Nguyen, 1988). The sum of two squares is least: of
    the slope of the line relative to that of the cones, because steep forces may slip, and of the distance of the
    line from the centre of mass relative to the size, because weights far from the line turn the object.

    Parameters
    ----------
    point, normal
        A sample, relative to the centre of mass, and the outward unit normal.
    points, normals
        The samples among which the partner is found.
    friction
        The coefficient of friction.
    size
        The size of the object.
    most
        The largest distance of the contacts.

    Returns
    -------
    cost
        The least sum of squares; beyond 1e30 if no sample is a partner.
    number
        The row of the partner.
    """
    own = dot(point, point)

    def closer(state, q, n, number):
        low, found = state
        gap = _minus(q, point)
        square = dot(gap, gap)
        along = ga.minimum(-dot(gap, normal), dot(gap, n))
        slope = (square / (along * along + TINY) - 1) / (friction * friction)
        product = dot(point, q)
        lever = (own * dot(q, q) - product * product) / ((square + TINY) * size * size)
        cost = select(ga.minimum(ga.minimum(along, 1 - slope), most * most - square) > 0, slope + lever, FAR)
        return ga.minimum(low, cost), select(cost < low, number, found)

    return fold(closer, (FAR, 0), points, normals, row_numbers(points))


# The hand.


def _velocity(axis, place):
    """Compute the velocity of a point that a joint moves with its twist at unit speed."""
    turning, moment = (axis["e23"], -axis["e13"], axis["e12"]), (axis["e01"], axis["e02"], axis["e03"])
    return tuple(x + y for x, y in zip(moment, cross(turning, place), strict=True))


@kernel(
    q=VARIABLES, sides=array(SCALAR, "s"), parents=robots.PARENTS,
    **robots.JOINTS | {"variables": index("n", into="m")},
    tips=index("f", into="n"), centres=array(SCALAR, "f", 3, shared=True),
    moved=index("p", into="f"), movers=index("p", into="n"), shares=array(SCALAR, "m", "p", shared=True),
    starts=index("s", into="f"), ends=index("s", into="f"), signs=array(SCALAR, "s", "p", shared=True),
    low=LIMITS, high=LIMITS, returns=(VARIABLES, SCALAR),
)  # fmt: skip
def preshape(
    q, sides, parents, variables, ratios, offsets, places, screws, turns,
    tips, centres, moved, movers, shares, starts, ends, signs, low, high,
):  # fmt: skip
    """Compute variables of the hand for which some distances between fingertips are given.

    The steps are the shortest ones that correct the distances to first order. A hand has mostly more variables than
    distances: the result is near the start.

    Parameters
    ----------
    q
        The start.
    sides
        The distances, such as the sides of a triangle.
    parents, variables, ratios, offsets, places, screws, turns
        The joints.
    tips, centres
        The joint that carries each fingertip, and its centre in the frame of this joint.
    moved, movers
        Pairs of a fingertip and a joint that moves it.
    shares
        For each variable and pair the ratio of the joint if it follows the variable, otherwise 0.
    starts, ends
        The fingertips of each distance.
    signs
        For each distance and pair 1 if the fingertip is the first of the distance, -1 if it is the second, otherwise 0.
    low, high
        Limits of the variables.

    Returns
    -------
    q
        The variables.
    error
        The largest error of a distance before the last step.
    """

    def step(state):
        old, _ = state
        own = robots.own_poses(old, variables, ratios, offsets, places, screws, turns)
        poses = robots.in_base(own, parents)
        axes = each(robots.to_parent, poses, screws)

        def placed(pose, centre):
            return tuple(x + y for x, y in zip(pose.place, robots.rotated(pose.rotor, centre), strict=True))

        points = each(placed, gather(poses, tips), centres)
        velocities = each(_velocity, gather(axes, movers), gather(points, moved))
        gaps = each(_minus, gather(points, starts), gather(points, ends))
        off = each(lambda gap, side: (dot(gap, gap) / side - side) / 2, gaps, sides)

        def row(gap, side, sign):
            speeds = each(lambda s, v: s * dot(gap, v) / side, sign, velocities)
            return each(lambda share: _product_of_rows(share, speeds), shares)

        rows = each(row, gaps, sides, signs)
        numbers = row_numbers(off)
        matrix = each(
            lambda one, i: each(
                lambda other, j: _product_of_rows(one, other) + select(equal(i, j), DAMPING, 0), rows, numbers
            ),
            rows, numbers,
        )  # fmt: skip
        pull = matrices.solve_positive(matrix, off)[0]
        changes = each(lambda column: _product_of_rows(column, pull), transpose(rows))

        def moved_within(x, change, least, most):
            bounded = ga.minimum(ga.maximum(change, -LONGEST), LONGEST)
            return ga.minimum(ga.maximum(x - bounded, least), most)

        error = fold(lambda most, x: ga.maximum(most, ga.absolute(x)), 0, off)
        return each(moved_within, old, changes, low, high), error

    (found, error), _, _ = iterate(step, (q, FAR), lambda _, new: new[1] < EXACT, STEPS)
    return found, error


def _square_from_axis(start, end):
    """Return a function of a point: the square of its distance from the segment between two points."""
    along = _minus(end, start)
    scale = 1 / (dot(along, along) + TINY)

    def square(p):
        off = _minus(p, start)
        share = ga.minimum(ga.maximum(dot(off, along) * scale, 0), 1)
        gap = [x - share * d for x, d in zip(off, along, strict=True)]
        return dot(gap, gap)

    return square


@kernel(points=POINTS, start=VECTOR, end=VECTOR, radius=SCALAR, returns=SCALAR)
def capsule_clearance(points, start, end, radius):
    """Compute the least distance of points from a capsule, negative inside.

    Parameters
    ----------
    points
        Points of the surface of an object.
    start, end
        The ends of the axis of the capsule; a sphere if they are equal.
    radius
        The radius.
    """
    square = _square_from_axis(start, end)
    return sqrt(fold(lambda low, p: ga.minimum(low, square(p)), FAR, points)) - radius


@kernel(point=VECTOR, start=VECTOR, end=VECTOR, radius=SCALAR, returns=SCALAR)
def capsule_gap(point, start, end, radius):
    """Compute the distance of a point from a capsule, negative inside.

    Parameters
    ----------
    point
        A point.
    start, end, radius
        As in `capsule_clearance`.
    """
    return sqrt(_square_from_axis(start, end)(point)) - radius
