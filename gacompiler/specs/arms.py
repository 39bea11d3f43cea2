"""Inverse kinematics of serial arms in plane-based geometric algebra G(3,0,1), from geometric subproblems.

Every joint is a rotation about a line or a translation along it. A point that is invariant under the distal joints
determines the first angles, a line the next, a plane the last: the rendezvous method (Bayro-Corrochano, *Geometric
Computing*, 2010, 11.4). Each step is an equation ``a cos(q) + b sin(q) = c``, whose coefficients are joins and products
of points, lines and planes, and which has two solutions.

Each pair of solutions is returned with its discriminant ``1 - c**2 / (a**2 + b**2)``, the squared sine of half the
angle between the two. It is negative, down to -1, if there is no solution; then both are the angle with the least
error. It is 0 if the solutions coincide, or if all angles are equally good. Angles are in radians, in [-pi, pi].
"""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import CGA3, PGA3
from gacompiler.specs import pga3
from gacompiler.specs.families.plane_based import coordinates, direction_of_line, foot_on_unit_line

POINT, DIRECTION, LINE, PLANE, MOTOR = PGA3.POINT, PGA3.DIRECTION, PGA3.LINE, PGA3.PLANE, PGA3.MOTOR
UNIT_LINE = PGA3.UNIT_LINE
ORIGIN = PGA3.multivector({"e123": 1})
PAIR, PROFILE = array(SCALAR, 2), array(SCALAR, 2, 3)
BRANCHES = array(SCALAR, 2, 3)
BOTH = (1, -1)
"""The sides of the two solutions of an equation; functions that have these as a parameter compute one for each."""
TINY = Fraction(1, 10**24)
"""Squared lengths up to this value are treated as rounding errors."""

ON_AXIS = Fraction(1, 10**14)
"""Squared sines up to this value determine an angle to a few digits only."""


def _dot(a, b):
    """Return the inner product of the directions of two lines."""
    return ga.scalar_product(a, ~b)


def _inner(a, b):
    """Return the inner product of two directions."""
    return sum(x * y for x, y in zip(coordinates(a), coordinates(b), strict=True))


def _circle(line, p):
    """Return centre, radius and tangent of the circle of `p`: ``centre + cos(q) radius + sin(q) tangent``."""
    centre = foot_on_unit_line(p, line)
    return centre, p - centre, ga.commutator(p, line)


def _line_circle(line, x):
    """Return the same decomposition for the direction of a line `x`."""
    centre = _dot(line, x) * line
    return centre, x - centre, ga.commutator(x, line)


def _unit(cosine, sine):
    """Return cosine and sine of the angle of a pair of numbers; of the angle 0 if both are 0."""
    length = ga.sqrt(cosine * cosine + sine * sine)
    nothing = length <= 0
    safe = ga.select(nothing, 1, length)
    return ga.select(nothing, 1, cosine / safe), sine / safe


def _angles(a, b, c, sides=BOTH):
    """Return unnormalised (cosine, sine) of the solutions of ``a cos + b sin = c``, and the discriminant."""
    size = a * a + b * b
    gap = size - c * c
    root = ga.sqrt(ga.maximum(gap, 0))
    solutions = [(a * c - side * (b * root), b * c + side * (a * root)) for side in sides]
    every = size + c * c <= TINY
    return *solutions, ga.select(every, 0, ga.maximum(gap / ga.maximum(size, TINY), -1))


def _line_turn(line, x, y):
    """Return unnormalised (cosine, sine) of the angle about a line from the direction of `x` to that of `y`."""
    # From the components orthogonal to the line, to avoid cancellation if they are small.
    u, v = ga.commutator(x, line), ga.commutator(y, line)
    return _dot(u, v), _dot(line, ga.commutator(v, u))


def _line_turned(line, x, unit):
    """Return the direction of the line `x` rotated about a line by an angle given as (cosine, sine)."""
    centre, radius, tangent = _line_circle(line, x)
    return centre + unit[0] * radius + unit[1] * tangent


def _back(unit):
    """Return the opposite angle."""
    return unit[0], -unit[1]


def _plane_turn(line, p, q):
    """Return unnormalised (cosine, sine) of the angle about a line from the plane `p` through it to `q`."""
    return ga.scalar_product(p, q), _dot(p ^ q, line)


def _angle(turn):
    return ga.atan2(turn[1], turn[0])


@kernel(a=SCALAR, b=SCALAR, c=SCALAR, returns=(PAIR, SCALAR))
def turns_of_sum(a, b, c):
    """Solve ``a cos(q) + b sin(q) = c``: both angles q, and the discriminant."""
    first, second, discriminant = _angles(a, b, c)
    return (_angle(first), _angle(second)), discriminant


@kernel(known=PROFILE, wanted=PROFILE, returns=(array(SCALAR, 4, 2), array(SCALAR, 4)))
def turns_of_two_sums(known, wanted):
    """Solve two equations ``a cos(p) + b sin(p) + c = d cos(q) + e sin(q) + f``, the first without q.

    The rows of `known` are (a, b, c), the rows of `wanted` are (d, e, f). Returns the angles (p, q) of four branches,
    for each p both values of q in turn, and for each branch the smaller discriminant.
    """
    return two_sums(known, wanted)


def two_sums(known, wanted, first=BOTH, second=BOTH):
    """Compute `turns_of_two_sums` for sides of both solutions."""
    (a, b, c), (x, y, z) = known
    *solutions, gap = _angles(a, b, wanted[0][2] - c, first)
    branches, gaps = [], []
    for solution in solutions:
        cosine, sine = _unit(*solution)
        *others, gap_second = _angles(wanted[1][0], wanted[1][1], x * cosine + y * sine + z - wanted[1][2], second)
        branches += [(_angle(solution), _angle(turn)) for turn in others]
        gaps += [ga.minimum(gap, gap_second)] * len(second)
    return tuple(branches), tuple(gaps)


@kernel(a=SCALAR, b=SCALAR, c=SCALAR, returns=(PAIR, SCALAR))
def slides_of_quadratic(a, b, c):
    """Solve ``a t**2 + b t + c = 0``: both slides t, ascending, and a scaled discriminant.

    The discriminant is ``1 - 4 a c / b**2``, scaled. If it is negative, both results are the minimiser of the absolute
    value of the polynomial. If `a` is 0, both are the single root.
    """
    (low, high), _, number = ga.quadratic_roots(a, b, c)
    size = b * b + ga.absolute(4 * a * c)
    discriminant = (b * b - 4 * a * c) / ga.maximum(size, TINY)
    return (low, ga.select(ga.equal(number, 1), low, high)), discriminant


@kernel(p=array(SCALAR, 2, 2), s=PAIR, returns=(array(SCALAR, 4), array(SCALAR, 4)))
def turns_of_ellipse(p, s):
    """Compute the angles, at most four, at which an ellipse ``p (cos(q), sin(q)) + s`` meets the unit circle.

    They are found from the quartic in the tangent of half the angle, measured from a direction far from all solutions.

    Returns the angles, and for each the imaginary part of its tangent, which is 0 if the angle is real.
    """
    (a, b), (c, d) = p
    x, y = s
    # |p u + s|**2 - 1 = two_c cos(2 q) + two_s sin(2 q) + one_c cos(q) + one_s sin(q) + rest
    cc, ss, cs = a * a + c * c, b * b + d * d, a * b + c * d
    two_c, two_s = (cc - ss) / 2, cs
    one_c, one_s = 2 * (a * x + c * y), 2 * (b * x + d * y)
    rest = (cc + ss) / 2 + x * x + y * y - 1
    long, short = Fraction(4, 5), Fraction(3, 5)
    best, cosine, sine = ga.absolute(two_c - one_c + rest), 1, 0
    for u, v in ((-1, 0), (0, 1), (0, -1), (long, short), (-long, short), (long, -short), (-long, -short)):
        value = two_c * (u * u - v * v) + two_s * (2 * u * v) - one_c * u - one_s * v + rest
        better = ga.absolute(value) > best
        best = ga.select(better, ga.absolute(value), best)
        cosine, sine = ga.select(better, u, cosine), ga.select(better, v, sine)
    cosine_two, sine_two = cosine * cosine - sine * sine, 2 * sine * cosine
    two_c, two_s = two_c * cosine_two + two_s * sine_two, two_s * cosine_two - two_c * sine_two
    one_c, one_s = one_c * cosine + one_s * sine, one_s * cosine - one_c * sine
    real, imaginary, _ = ga.quartic_roots(
        two_c - one_c + rest, 2 * one_s - 4 * two_s, 2 * rest - 6 * two_c, 2 * one_s + 4 * two_s, two_c + one_c + rest
    )
    angles = []
    for t in real:
        u, v = 1 - t * t, 2 * t
        angles.append(ga.atan2(v * cosine + u * sine, u * cosine - v * sine))
    return tuple(angles), imaginary


@kernel(line=UNIT_LINE, a=POINT, b=POINT, returns=SCALAR)
def turn_between_points(line, a, b):
    """Compute the angle about a normalised line from the point `a` to the point `b`; 0 for points on the line."""
    return _angle(_plane_turn(line, a & line, b & line))


@kernel(line=UNIT_LINE, p=POINT, q=SCALAR, returns=POINT)
def turned_point(line, p, q):
    """Rotate the point `p` about a normalised line by an angle."""
    centre, radius, tangent = _circle(line, p)
    return centre + ga.cos(q) * radius + ga.sin(q) * tangent


@kernel(line=UNIT_LINE, a=LINE, b=LINE, returns=SCALAR)
def turn_between_lines(line, a, b):
    """Compute the angle about a normalised line from the direction of `a` to that of `b`, as seen along it."""
    return _angle(_line_turn(line, a, b))


@kernel(line=UNIT_LINE, p=POINT, plane=PLANE, returns=(PAIR, SCALAR))
def turns_to_plane(line, p, plane):
    """Compute both angles about a normalised line that take the point `p` into a plane, and the discriminant."""
    return to_plane(line, p, plane)


def to_plane(line, p, plane, sides=BOTH):
    """Compute `turns_to_plane` for the given sides."""
    centre, radius, tangent = _circle(line, p)
    *solutions, discriminant = _angles(plane & radius, plane & tangent, -(plane & centre), sides)
    return tuple(map(_angle, solutions)), discriminant


@kernel(line=UNIT_LINE, p=POINT, centre=POINT, distance=SCALAR, returns=(PAIR, SCALAR))
def turns_to_sphere(line, p, centre, distance):
    """Compute both angles about a normalised line that take `p` to a distance from a centre, and the discriminant."""
    middle, radius, tangent = _circle(line, p)
    away = middle - centre
    first, second, discriminant = _angles(
        2 * _inner(away, radius),
        2 * _inner(away, tangent),
        distance * distance - _inner(away, away) - _inner(radius, radius),
    )
    return (_angle(first), _angle(second)), discriminant


@kernel(axis=UNIT_LINE, base=POINT, line=UNIT_LINE, p=POINT, returns=PROFILE)
def circle_profile(axis, base, line, p):
    """Compute height and squared distance of the point `p` on its circle about a line, invariant about an axis.

    Both are measured from the point `base` of the axis, and given as numbers (a, b, c) with ``a cos(q) + b sin(q) +
    c``.
    """
    centre, radius, tangent = _circle(line, p)
    up, away = direction_of_line(axis), centre - base
    return (
        (_inner(radius, up), _inner(tangent, up), _inner(away, up)),
        (2 * _inner(away, radius), 2 * _inner(away, tangent), _inner(away, away) + _inner(radius, radius)),
    )


@kernel(axis=UNIT_LINE, base=POINT, line=UNIT_LINE, p=POINT, returns=PROFILE)
def segment_profile(axis, base, line, p):
    """Compute height and squared distance, as in `circle_profile`, of the point `p` sliding along a line.

    The numbers are (a, b, c) with ``a t**2 + b t + c``.
    """
    along, up, away = direction_of_line(line), direction_of_line(axis), p - base
    return (0, _inner(along, up), _inner(away, up)), (1, 2 * _inner(away, along), _inner(away, away))


@kernel(first=DIRECTION, second=DIRECTION, line=UNIT_LINE, p=POINT, returns=PROFILE)
def circle_shadow(first, second, line, p):
    """Compute two coordinates of `p` on its circle about a line: (a, b, c) with ``a cos(q) + b sin(q) + c``."""
    centre, radius, tangent = _circle(line, p)
    away = centre - ORIGIN
    return tuple(tuple(_inner(x, d) for x in (radius, tangent, away)) for d in (first, second))


@kernel(first=DIRECTION, second=DIRECTION, line=UNIT_LINE, p=POINT, returns=PROFILE)
def segment_shadow(first, second, line, p):
    """Compute two coordinates of the point `p` sliding along a line: numbers (0, b, c) with ``b t + c``."""
    along, away = direction_of_line(line), p - ORIGIN
    return tuple((0, _inner(along, d), _inner(away, d)) for d in (first, second))


@kernel(first=UNIT_LINE, second=UNIT_LINE, a=LINE, b=LINE, returns=(PAIR, PAIR, SCALAR))
def turns_about_two_axes(first, second, a, b):
    """Compute the angles about two axes that rotate the direction of the line `a` to that of `b`.

    The rotation about the second axis is applied first. Returns both branches (angle about the first axis, angle about
    the second), and the discriminant.
    """
    return about_two_axes(first, second, a, b)


def about_two_axes(first, second, a, b, sides=BOTH):
    """Compute `turns_about_two_axes` for the given sides."""
    centre, radius, tangent = _line_circle(second, a)
    *solutions, discriminant = _angles(
        _dot(first, radius), _dot(first, tangent), _dot(first, b) - _dot(first, centre), sides
    )
    branches = []
    for solution in solutions:
        cosine, sine = _unit(*solution)
        x = centre + cosine * radius + sine * tangent
        branches.append((_angle(_line_turn(first, x, b)), _angle(solution)))
    return *branches, discriminant


@kernel(first=UNIT_LINE, second=UNIT_LINE, third=UNIT_LINE, m=MOTOR, returns=(BRANCHES, SCALAR))
def wrist_turns(first, second, third, m):
    """Compute the angles about three axes through a point whose rotations compose to the rotation `m`.

    The rotation about the third axis is applied first. The line of the third axis, which is invariant under its own
    rotation, determines the angles of the first and second; the plane of second and third axis determines the angle of
    the third. Returns both branches as rows, and the discriminant.
    """
    return about_three_axes(first, second, third, m)


def about_three_axes(first, second, third, m, sides=BOTH):
    """Compute `wrist_turns` for the given sides."""
    goal = m * third * ~m
    centre, radius, tangent = _line_circle(second, third)
    *solutions, discriminant = _angles(
        _dot(first, radius), _dot(first, tangent), _dot(first, goal) - _dot(first, centre), sides
    )
    branches = []
    for solution, side in zip(solutions, sides, strict=True):
        cosine, sine = _unit(*solution)
        x, onward = centre + cosine * radius + sine * tangent, cosine * tangent - sine * radius
        # If it is on the first axis up to rounding, use its direction of motion instead.
        on_axis = ga.norm_squared(ga.commutator(x, first)) <= ON_AXIS
        turn = _line_turn(first, ga.select(on_axis, side * onward, x), goal)
        unit = _unit(*turn)
        middle = _line_turn(second, third, _line_turned(first, goal, _back(unit)))
        last = _line_turn(third, ~m * _line_turned(first, second, unit) * m, second)
        branches.append((_angle(turn), _angle(middle), _angle(last)))
    return tuple(branches), discriminant


@kernel(first=UNIT_LINE, second=UNIT_LINE, third=UNIT_LINE, m=MOTOR, returns=(BRANCHES, SCALAR))
def planar_turns(first, second, third, m):
    """Compute the angles about three parallel axes whose rotations compose to the planar motion `m`.

    The rotation about the third axis is applied first. A point of the third axis determines the first two angles, and a
    direction the sum of all three. Returns both branches as rows, and the discriminant.
    """
    return about_parallel_axes(first, second, third, m)


def about_parallel_axes(first, second, third, m, sides=BOTH):
    """Compute `planar_turns` for the given sides."""
    p = foot_on_unit_line(ORIGIN, third)
    goal = (m * p * ~m) & first
    centre, radius, tangent = _circle(second, p)
    base, across, around = centre & first, radius & first, tangent & first
    *solutions, discriminant = _angles(
        2 * ga.scalar_product(base, across),
        2 * ga.scalar_product(base, around),
        ga.norm_squared(goal) - ga.norm_squared(base) - ga.norm_squared(across),
        sides,
    )
    moved = m * radius * ~m
    whole = _inner(radius, moved), _inner(direction_of_line(first), _cross(radius, moved))
    branches = []
    for solution in solutions:
        elbow = _unit(*solution)
        shoulder = _plane_turn(first, base + elbow[0] * across + elbow[1] * around, goal)
        last = _less(_less(whole, shoulder), elbow)
        branches.append((_angle(shoulder), _angle(solution), _angle(last)))
    return tuple(branches), discriminant


def _less(turn, other):
    """Return the difference of two angles, all as unnormalised (cosine, sine)."""
    return turn[0] * other[0] + turn[1] * other[1], turn[1] * other[0] - turn[0] * other[1]


def _cross(a, b):
    """Return the cross product of two directions."""
    x, y = coordinates(a), coordinates(b)
    names = ("e032", "e013", "e021")
    return ga.assemble(PGA3, {names[k]: x[k - 2] * y[k - 1] - x[k - 1] * y[k - 2] for k in range(3)})


@kernel(shoulder=POINT, wrist=POINT, hinge=LINE, returns=MOTOR)
def elbow_frame(shoulder, wrist, hinge):
    """Compute the frame at the shoulder with x towards the wrist and the hinge's direction in its xy plane, y > 0.

    The result is NaN if that direction is along x, or if the wrist coincides with the shoulder.
    """
    line = ga.normalize(shoulder & wrist)
    return pga3.motor_from_flag(shoulder, line, ga.normalize(line & direction_of_line(hinge)))


@kernel(p=POINT, line=LINE, returns=array(SCALAR, 14))
def point_and_tangent(p, line):
    """Compute the conformal point of `p` and its tangent along a line: numbers that motions transform linearly.

    The result contains the coefficients e1, e2, e3, einf of ``P = e0 + p + p^2/2 einf``, then the bivector of `P` and
    the direction at it.
    """
    x, d = coordinates(p), coordinates(direction_of_line(line))
    names = ("e1", "e2", "e3")
    square, along = (sum(a * b for a, b in zip(x, y, strict=True)) for y in (x, d))
    point = ga.assemble(CGA3, {"e0": 1, "einf": square / 2, **dict(zip(names, x, strict=True))})
    tangent = point ^ ga.assemble(CGA3, {"einf": along, **dict(zip(names, d, strict=True))})
    return (*(point[name] for name in (*names, "einf")), *(tangent[name] for name in CGA3.POINT_PAIR.blades))


# Conditions that a motor takes one object to another are linear in the motor: null vectors of these matrices.


ODD = (*PLANE.blades, "e123", *DIRECTION.blades)


def _constraint(a, b, blades):
    """Return the matrix of ``x -> x a - b x`` on the coefficients of a motor."""
    columns = [x * a - b * x for x in (PGA3.multivector({name: 1}) for name in MOTOR.blades)]
    return tuple(tuple(column[name] for column in columns) for name in blades)


@kernel(a=POINT, b=POINT, returns=array(SCALAR, 8, 8))
def constraint_of_points(a, b):
    """Compute the matrix of ``x -> x a - b x``: its null vectors are the motors that take the point `a` to `b`."""
    return _constraint(a, b, ODD)


@kernel(a=LINE, b=LINE, returns=array(SCALAR, 8, 8))
def constraint_of_lines(a, b):
    """Compute the matrix of ``x -> x a - b x``: its null vectors are the motors that take the line `a` to `b`."""
    return _constraint(a, b, MOTOR.blades)


@kernel(a=PLANE, b=PLANE, returns=array(SCALAR, 8, 8))
def constraint_of_planes(a, b):
    """Compute the matrix of ``x -> x a - b x``: its null vectors are the motors that take the plane `a` to `b`."""
    return _constraint(a, b, ODD)
