"""Rigid registration of clouds of points: joint space, sums over correspondences, and steps of a refinement.

A motion with the rotor R and the translation t takes x to x' if ``x' R - R x = t R``. This equation is linear in the
rotor. Its vector part gives three planes: the coefficient of e1 contains only three coefficients of the rotor, whose
factors are the coordinates of a point of the first joint space, and the same for e2 and e3. All correspondences of one
motion are on the same three planes, whose normals are coefficients of one rotor. The trivector part is a plane of
displacements, orthogonal to the axis of the screw.

Points and motors are those of G(3,0,1), as in the module `pga3`. A small motion that follows a motor m is the bivector
B of ``exp(B) m``.
"""

import gacompiler as ga
from gacompiler import SCALAR, array, assemble, each, gather, index, kernel, sqrt, total
from gacompiler.algebra.catalog import PGA3, VGA3
from gacompiler.specs.families.covariances import dot, square

POINT, PLANE, MOTOR = PGA3.POINT, PGA3.PLANE, PGA3.MOTOR
BIVECTOR, ROTOR = PGA3.LINE, VGA3.ROTOR
VECTOR, TRIPLE = array(SCALAR, 3), array(SCALAR, 3, 3)
POINTS, NUMBERS = array(SCALAR, "n", 3), array(SCALAR, "n")
SOURCE = array(SCALAR, "n", 3, shared=True)
TARGET, TARGET_WEIGHTS = array(SCALAR, "m", 3, shared=True), array(SCALAR, "m", shared=True)
NEAREST = index("n", into="m")
AXES = ("e1", "e2", "e3")
TRIVECTOR = "e123"
UNUSED = {"e1": "e23", "e2": "e13", "e3": "e12"}
"""The blade of the rotor that is not in the coefficient of each vector: their product has grade 3."""


def _rows(x, y):
    """Return, for each blade of ``y R - R x``, the factors of the four coefficients of R."""
    one, two = (assemble(VGA3, dict(zip(AXES, p, strict=True))) for p in (x, y))
    columns = [two * basis - basis * one for basis in (VGA3.multivector({b: 1}) for b in ROTOR.blades)]
    return {name: [column[name] for column in columns] for name in (*AXES, TRIVECTOR)}


def _joint_blades(axis):
    return [k for k, blade in enumerate(ROTOR.blades) if blade != UNUSED[axis]]


def _place(p):
    return PGA3.multivector({"e123": 1}) + assemble(PGA3, dict(zip(POINT.blades, p, strict=True)))


def _numbers(point):
    return [point[name] for name in POINT.blades]


def _between(p, q):
    """Return the translator from one normalised point to another."""
    return (1 + q * ~p) / 2


# Joint space.


@kernel(x=VECTOR, y=VECTOR, returns=TRIPLE)
def joint_points(x, y):
    """Compute the points of a correspondence ``x -> y`` in the three joint spaces.

    They are ``(y1 - x1, +-(x2 + y2), +-(x3 + y3))`` and so on: a difference for the coordinate itself, and sums for the
    other two, in the order of the coefficients of the rotor.
    """
    rows = _rows(x, y)
    return tuple(tuple(rows[axis][k] for k in _joint_blades(axis)) for axis in AXES)


@kernel(m=MOTOR, returns=array(SCALAR, 3, 4))
def joint_planes(m):
    """Compute the planes of the three joint spaces on which all correspondences of a unit motor are.

    Each is ``(a, b, c, d)`` with ``a u + b v + c w + d = 0`` for the points (u, v, w) of `joint_points`; a, b and c are
    coefficients of the rotor.
    """
    shift = _numbers(ga.sandwich(m, PGA3.multivector({"e123": 1})))
    rotor = [m[name] for name in ROTOR.blades]
    rows = _rows((0, 0, 0), shift)
    return tuple((*(rotor[k] for k in _joint_blades(axis)), -dot(rows[axis], rotor)) for axis in AXES)


@kernel(x=VECTOR, y=VECTOR, m=MOTOR, returns=SCALAR)
def screw_plane_value(x, y, m):
    """Compute the trivector part of ``y R - R x - t R``: 0 if the displacement has the component of the screw.

    It is the sine of half the angle times the difference of the displacement along the axis.
    """
    shift = _numbers(ga.sandwich(m, PGA3.multivector({"e123": 1})))
    rotor = [m[name] for name in ROTOR.blades]
    return dot(_rows(x, y)[TRIVECTOR], rotor) - dot(_rows((0, 0, 0), shift)[TRIVECTOR], rotor)


@kernel(p=VECTOR, q=VECTOR, points=POINTS, targets=POINTS, returns=(NUMBERS, NUMBERS))
def lengths_of_pairs(p, q, points, targets):
    """Compute the lengths from `p` to points and from `q` to their matches, which a rigid motion leaves equal.

    This is the rigidity constraint of joint space: the difference of two joint points, multiplied as displacement and
    sum, is ``|y - q|**2 - |x - p|**2``.
    """

    def lengths(x, y):
        one, two = ([a - b for a, b in zip(*pair, strict=True)] for pair in ((x, p), (y, q)))
        return sqrt(dot(one, one)), sqrt(dot(two, two))

    return each(lengths, points, targets)


# Rotors from correspondences.


def _form(x, y):
    """Return the upper triangle of the square of ``y R - R x`` as a quadratic form of R."""
    rows = list(_rows(x, y).values())
    return [sum(row[i] * row[j] for row in rows) for i in range(4) for j in range(i, 4)]


@kernel(points=POINTS, targets=POINTS, weights=NUMBERS, returns=(VECTOR, VECTOR))
def means_of_matches(points, targets, weights):
    """Compute the weighted means of points and of their matches; they are 0 if all weights are."""

    def of(x, y, w):
        return tuple(w * v for v in x), tuple(w * v for v in y), w

    x, y, weight = total(of, points, targets, weights)
    divisor = ga.select(weight > 0, weight, 1)
    return tuple(v / divisor for v in x), tuple(v / divisor for v in y)


@kernel(points=POINTS, targets=POINTS, weights=NUMBERS, x=VECTOR, y=VECTOR, returns=array(SCALAR, 4, 4))
def form_of_matches(points, targets, weights, x, y):
    """Sum the squares of ``q R - R p`` as a quadratic form of the rotor R, where p and q are relative to `x` and `y`.

    If these are the means, the eigenvector of the smallest eigenvalue is the rotor of least squares, the common normal
    of the joint planes.
    """

    def of(p, q, w):
        one, two = ([a - b for a, b in zip(*pair, strict=True)] for pair in ((p, x), (q, y)))
        return tuple(w * f for f in _form(one, two))

    form = square(list(total(of, points, targets, weights)), 4)
    return tuple(map(tuple, form))


@kernel(rotor=array(SCALAR, 4), x=VECTOR, y=VECTOR, returns=MOTOR)
def motor_of_rotor(rotor, x, y):
    """Compute the motor with a given unit rotor that takes the point `x` to the point `y`."""
    turn = assemble(PGA3, dict(zip(ROTOR.blades, rotor, strict=True)))
    return _between(ga.sandwich(turn, _place(x)), _place(y)) * turn


@kernel(point=VECTOR, direction=VECTOR, returns=BIVECTOR)
def turn_about_line(point, direction):
    """Compute the bivector B of rotations ``exp(t B)`` about the line through a point with a unit direction.

    Its Euclidean part has the norm 1.
    """
    ideal = assemble(PGA3, dict(zip(POINT.blades, direction, strict=True)))
    return _place(point) & ideal


# Refinement.


@kernel(
    motor=MOTOR, points=SOURCE, weights=NUMBERS, targets=TARGET, directions=TARGET, across=TARGET_WEIGHTS,
    along=TARGET_WEIGHTS, nearest=NEAREST, scale=SCALAR,
    returns=(array(SCALAR, 21), array(SCALAR, 6), array(SCALAR, 2)),
)  # fmt: skip
def alignment_sums(motor, points, weights, targets, directions, across, along, nearest, scale):
    """Sum the normal equations of the motor that moves points to points, planes or lines.

    The squared distance of a moved point is ``across * off**2 + along * (direction . off)**2``: across and along are 1
    and 0 for a point, 0 and 1 for a plane with its normal, 1 and -1 for a line with its direction.

    Parameters
    ----------
    motor
        The current motor.
    points, weights
        The points that it moves; the weights of those without a neighbour are 0.
    targets, directions, across, along
        Points, unit vectors, and factors of the squared distances.
    nearest
        For each point, the row of its neighbour.
    scale
        The distance at which neighbours lose three quarters of their weight.

    Returns
    -------
    information, slope
        The upper triangle of the matrix by the coefficients of a bivector B of ``exp(B) motor``, and the derivatives of
        half the sum of squares.
    numbers
        The sum of weights, and that of squared distances with them.
    """
    generators = [PGA3.multivector({name: 1}) for name in BIVECTOR.blades]

    def of(x, w, y, u, a, b):
        moved = ga.sandwich(motor, _place(x))
        off = [p - q for p, q in zip(_numbers(moved), y, strict=True)]
        rows = [_numbers(g * moved - moved * g) for g in generators]
        own = dot(u, off)
        far = a * dot(off, off) + b * own * own
        ratio = 1 / (1 + far / (scale * scale))
        weight = w * ratio * ratio
        inner = [dot(u, row) for row in rows]
        table = tuple(
            weight * (a * dot(rows[i], rows[j]) + b * inner[i] * inner[j]) for i in range(6) for j in range(i, 6)
        )
        slope = tuple(weight * (a * dot(row, off) + b * i * own) for row, i in zip(rows, inner, strict=True))
        return table, slope, weight, weight * far

    near = gather((targets, directions, across, along), nearest)
    table, slope, weight, squares = total(of, points, weights, *near)
    return table, slope, (weight, squares)
