"""Grasps of a hand with three fingers: meshes, contacts, wrenches, the kinematics of the hand, and its clearance.

Points, lines and motors are those of G(3,0,1), as in the module `pga3`. A contact force is a line: the join of the
point of contact with the direction of the force. A twist is a line as well, and the point at x moves with the
commutator of the twist and the point.

The nine joints of a hand are given in the order finger by finger, from the palm to the tip. `axes` are their lines in
the rest position. The variables of the hand are the spread, which rotates the first joint of each finger, and the bends
of the fingers, each of which rotates the second and third joint; `ratios` are the factors of these rotations.
"""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, array, assemble, each, fold, gather, index, iterate, kernel, solve_symmetric, sqrt, total
from gacompiler.algebra.catalog import PGA3
from gacompiler.specs.families.covariances import dot

LINE, MOTOR, POINT = PGA3.LINE, PGA3.MOTOR, PGA3.POINT
VECTOR, TRIPLE = array(SCALAR, 3), array(SCALAR, 3, 3)
FINGERS, JOINTS, VARIABLES = 3, 9, 4
Q, AXES, RATIOS = array(SCALAR, VARIABLES), array(SCALAR, JOINTS, 6), array(SCALAR, JOINTS)
LIMITS = array(SCALAR, VARIABLES, 2)
POINTS = array(SCALAR, "n", 3, shared=True)
VERTICES, CORNER = array(SCALAR, "v", 3, shared=True), index("m", into="v")
TWISTS = array(SCALAR, "d", 6, shared=True)
TINY, FAR = Fraction(1, 10**30), float(2**100)
STEPS = 8
"""Maximum number of steps of `preshape`; where more do not converge, rounding errors grow without bound."""
EXACT = Fraction(1, 10**11)
"""The error of a side of the triangle of the fingertips, in metres, at which `preshape` stops."""
LONGEST = Fraction(1, 2)
"""The largest change of a variable in one step, in rad."""
DAMPING = Fraction(1, 10**8)
SIDES = ((0, 1), (1, 2), (2, 0))


def _place(p):
    return PGA3.multivector({"e123": 1}) + assemble(PGA3, dict(zip(POINT.blades, p, strict=True)))


def _coordinates(point):
    return tuple(point[name] for name in POINT.blades)


def _line(numbers):
    return assemble(PGA3, dict(zip(LINE.blades, numbers, strict=True)))


def _minus(a, b):
    return tuple(x - y for x, y in zip(a, b, strict=True))


def _cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


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
        normal = _cross(_minus(b, a), _minus(c, a))
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


# The hand.


def _rotation(angle, axis):
    return ga.cos(angle / 2) - ga.sin(angle / 2) * axis


@kernel(q=Q, axes=AXES, ratios=RATIOS, returns=array(SCALAR, JOINTS, 8))
def hand_links(q, axes, ratios):
    """Compute the motors that take the nine links from the rest position to the variables `q`."""
    motors = []
    for finger in range(FINGERS):
        motor = 1
        for joint in range(3 * finger, 3 * finger + 3):
            motor = motor * _rotation(ratios[joint] * q[0 if joint == 3 * finger else finger + 1], _line(axes[joint]))
            motors.append(motor)
    return tuple(tuple(m[name] for name in MOTOR.blades) for m in motors)


def _fingertip(finger, q, axes, ratios, tips):
    """Return a fingertip, and its velocities by the spread and by the bend of the finger."""
    spread, bend, last = (_line(axes[3 * finger + k]) for k in range(3))
    angles = [ratios[3 * finger] * q[0], *(ratios[3 * finger + k] * q[finger + 1] for k in (1, 2))]
    # Lines and points are moved by the last joint first, so that no product of motors is needed.
    outer = ga.sandwich(_rotation(angles[2], last), _place(tips[finger]))
    by_last = ga.commutator(outer, last)
    inner = _rotation(angles[1], bend)
    middle = ga.sandwich(inner, outer)
    by_bend = ratios[3 * finger + 1] * ga.commutator(middle, bend) + ratios[3 * finger + 2] * ga.sandwich(
        inner, by_last
    )
    base = _rotation(angles[0], spread)
    tip = ga.sandwich(base, middle)
    by_spread = ratios[3 * finger] * ga.commutator(tip, spread)
    return _coordinates(tip), _coordinates(by_spread), _coordinates(ga.sandwich(base, by_bend))


@kernel(q=Q, axes=AXES, ratios=RATIOS, tips=TRIPLE, sides=VECTOR, limits=LIMITS, returns=(Q, SCALAR), loops=True)
def preshape(q, axes, ratios, tips, sides, limits):
    """Compute variables of the hand for which the fingertips form a triangle with given sides.

    The steps are the shortest ones that correct the sides to first order. Four variables and three sides leave one
    degree of freedom: the result is near the start.

    Parameters
    ----------
    q
        The start.
    axes, ratios
        The kinematic table.
    tips
        The fingertips in the rest position.
    sides
        The lengths from the first to the second tip, from the second to the third, and from the third to the first.
    limits
        The lowest and the highest value of each variable.

    Returns
    -------
    q
        The variables.
    error
        The largest error of a side before the last step.
    """

    def step(state):
        old, _ = state
        poses = [_fingertip(finger, old, axes, ratios, tips) for finger in range(FINGERS)]
        off, rows = [], []
        for k, (a, b) in enumerate(SIDES):
            gap = _minus(poses[a][0], poses[b][0])
            off.append((dot(gap, gap) / sides[k] - sides[k]) / 2)
            row = [0] * VARIABLES
            row[0] = dot(gap, _minus(poses[a][1], poses[b][1])) / sides[k]
            row[a + 1] = dot(gap, poses[a][2]) / sides[k]
            row[b + 1] = -dot(gap, poses[b][2]) / sides[k]
            rows.append(row)
        matrix = [[dot(rows[i], rows[j]) + (DAMPING if i == j else 0) for j in range(3)] for i in range(3)]
        pull, _ = solve_symmetric(matrix, off)
        new = []
        for v in range(VARIABLES):
            change = -sum(rows[k][v] * pull[k] for k in range(3))
            bounded = ga.minimum(ga.maximum(change, -LONGEST), LONGEST)
            new.append(ga.minimum(ga.maximum(old[v] + bounded, limits[v][0]), limits[v][1]))
        error = ga.maximum(ga.absolute(off[0]), ga.maximum(ga.absolute(off[1]), ga.absolute(off[2])))
        return tuple(new), error

    (found, error), _, _ = iterate(step, (tuple(q), FAR), lambda _, new: new[1] < EXACT, STEPS)
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
