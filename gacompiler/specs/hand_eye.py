"""Hand-eye calibration by unit motors of G(3,0,1): ``a x = x b`` and ``a x = z b``.

A pose ``a`` takes the frame of the hand to that of its base, ``b`` the frame of the camera to that of the target, and
``x`` the frame of the camera to that of the hand; ``z`` takes the frame of the target to that of the base. Motors have
the signs that make the scalar part of a misfit positive. Coefficients with e0 are half of lengths.

Kernels of one motion or pose come first, then sums over all of them and the Gauss-Newton steps. Conditions are 1 if
they hold and 0 otherwise; the product of two conditions is their conjunction. All kernels are in one file because a
file makes a module.
"""

from fractions import Fraction
from typing import Any, NamedTuple

import gacompiler as ga
from gacompiler import SCALAR, absolute, array, each, fold, gather, index, iterate, jacobian, kernel, least, total
from gacompiler.algebra.catalog import PGA3
from gacompiler.specs import pga3

MOTOR, EVEN, BIVECTOR = PGA3.MOTOR, PGA3.EVEN, PGA3.LINE
MOTORS, NUMBERS = array(EVEN, "n"), array(SCALAR, "n")
POINT, VECTOR = PGA3.POINT, array(SCALAR, 3)
POSE_ROWS = array(SCALAR, "n", 3, 13)
ROTOR_BLADES = PGA3.ROTOR.blades
ONE, PSEUDOSCALAR = PGA3.multivector({"1": 1}), PGA3.multivector({"e0123": 1})
FAR_BLADES = tuple(name for name in MOTOR.blades if name not in ROTOR_BLADES)
TINY = Fraction(1, 10**60)
NEVER_ZERO = Fraction(1, 10**300)
DAMPING = Fraction(1, 10**14)
"""Increment of the pivots, relative to the trace."""
SMALL, FINITE = Fraction(1, 2**1000), 2**60
"""Numbers count as finite if the sum of their absolute values times SMALL is at most FINITE."""
STEPS = 6
"""Maximal number of Gauss-Newton steps for fitting motions."""


@kernel(u=EVEN, v=EVEN, returns=MOTOR)
def null_motor(u, v):
    """Compute the unit motor in the plane of two even elements with the largest rotational part.

    If the elements are orthonormal and span X and its product with the pseudoscalar, the result is X. Its scalar part
    is nonnegative.
    """

    def inner(a, b):
        return sum(a[name] * b[name] for name in ROTOR_BLADES)

    uu, uv, vv = inner(u, u), inner(u, v), inner(v, v)
    gap = uu - vv
    long = ga.sqrt(gap * gap + 4 * uv * uv) + ga.select(gap < 0, -gap, gap)
    none = long < TINY
    first = ga.select(none, 1, ga.select(gap < 0, 2 * uv, long))
    second = ga.select(none, 0, ga.select(gap < 0, long, 2 * uv))
    even = first * u + second * v
    study = even * ~even
    size = study["1"]
    motor = even * (1 - study["e0123"] / (2 * size) * PSEUDOSCALAR) / ga.sqrt(size)
    return ga.select(motor["1"] < 0, -1, 1) * motor


@kernel(a=MOTOR, b=MOTOR, returns=(SCALAR, SCALAR))
def screw_misfit(a, b):
    """Compute the difference between two motions that should be conjugate: the same screw about different lines.

    Returns ``sin((alpha - beta) / 2)`` of their angles, and half the difference of their translations along the axis,
    each multiplied by the sine of half the angle. Both vanish if ``a x = x b`` for some motor x (the screw congruence
    theorem; Chen, CVPR 1991). The signs of the motors do not matter, nor does the sign of the pitch, which for a half
    turn depends on the sign of the motor.
    """
    sines = [ga.sqrt(sum(m[name] * m[name] for name in ROTOR_BLADES[1:])) for m in (a, b)]
    cosines, pitches = ([ga.select(m[name] < 0, -m[name], m[name]) for m in (a, b)] for name in ("1", "e0123"))
    return cosines[1] * sines[0] - cosines[0] * sines[1], pitches[0] - pitches[1]


@kernel(a=MOTOR, b=MOTOR, x=MOTOR, returns=BIVECTOR)
def misfit(a, b, x):
    """Compute the bivector part of ``~(x b) a x``: minus half of the residual rotation and translation."""
    return (~b * (~x * a * x)).grade(2)


@kernel(a=MOTOR, b=MOTOR, x=MOTOR, z=MOTOR, frame=MOTOR, returns=BIVECTOR)
def misfit_of_poses(a, b, x, z, frame):
    """Compute the bivector part of ``~(z b) a x`` relative to a frame: minus half of the residual motion.

    `frame` takes that frame to the camera's; translations are those of the frame's origin.
    """
    return (~frame * (~b * (~z * (a * x))) * frame).grade(2)


_OF_MOTIONS = [jacobian(misfit, "x", "right")]
_OF_POSES = [jacobian(misfit_of_poses, name, "right") for name in ("x", "z")]


def _rows(value, matrices):
    """Return the rows of derivatives, followed by the value: those of the rotation, and those of the translation."""
    # Tangents are along e12 e13 e23 e10 e20 e30, the coefficients of a bivector those of e01 e02 e03.
    signs = (1, 1, 1, -1, -1, -1)
    rows = [
        (*(sign * entry for matrix in matrices for sign, entry in zip(signs, matrix[k], strict=True)), value[name])
        for k, name in enumerate(BIVECTOR.blades)
    ]
    return tuple(rows[:3]), tuple(rows[3:])


@kernel(a=MOTOR, b=MOTOR, x=MOTOR, returns=(array(SCALAR, 3, 7), array(SCALAR, 3, 7)))
def misfit_equations(a, b, x):
    """Compute the derivatives of `misfit` by the coefficients of B in ``x exp(B)``, with the misfit as last column.

    The rows are those of the rotation, e12 e13 e23, and of the translation, e01 e02 e03.
    """
    ((value, by_x),) = (each.function(a, b, x) for each in _OF_MOTIONS)
    return _rows(value, [by_x])


@kernel(a=MOTOR, b=MOTOR, x=MOTOR, z=MOTOR, frame=MOTOR, returns=(array(SCALAR, 3, 13), array(SCALAR, 3, 13)))
def misfit_of_poses_equations(a, b, x, z, frame):
    """Compute the derivatives of `misfit_of_poses` by B and C in ``x exp(B)`` and ``z exp(C)``.

    The last column is the misfit. The rows are those of the rotation, e12 e13 e23, and of the translation, e01 e02 e03.
    """
    (value, by_x), (_, by_z) = (each.function(a, b, x, z, frame) for each in _OF_POSES)
    return _rows(value, [by_x, by_z])


# Input data.


def _length_squared(values):
    return sum(x * x for x in values)


def _part(motor, blades):
    return [motor[name] for name in blades]


def _rotor_product(m, n):
    """Return the scalar product of the rotational parts of two motors."""
    return sum(x * y for x, y in zip(_part(m, ROTOR_BLADES), _part(n, ROTOR_BLADES), strict=True))


def _are_finite(values):
    return SMALL * sum(map(absolute, values)) <= FINITE


def _farthest(motors, found):
    """Return the maximum of a number and of the finite absolute values of the coefficients of motors with e0."""
    for m in motors:
        for x in _part(m, FAR_BLADES):
            found = ga.select(_are_finite([x]) * (absolute(x) > found), absolute(x), found)
    return found


@kernel(a=MOTORS, b=MOTORS, rounding=SCALAR)
def first_not_unit(a, b, rounding):
    """Find the first row of `a`, or else of `b` after these, that is finite and not a unit motor; -1 if none.

    Translations are compared with the largest of both: what is below `rounding` may be a rounding error of others.
    """

    largest = fold(lambda found, m, n: _farthest((m, n), found), 0, a, b)

    def is_right(m):
        square, far = (_length_squared(_part(m, blades)) for blades in (ROTOR_BLADES, FAR_BLADES))
        study = m["1"] * m["e0123"] - m["e12"] * m["e03"] + m["e13"] * m["e02"] - m["e23"] * m["e01"]
        is_unit = (absolute(square - 1) <= Fraction(1, 1000)) * (absolute(study) <= largest / 1000 + rounding)
        return ga.select(_are_finite([square, far]), is_unit, 1)

    def first(motors):
        score, row = least(is_right, motors)
        return ga.select(score < 1, row, -1)

    row, row_b = first(a), first(b)
    count = total(lambda _: 1, a)
    return ga.select(row >= 0, row, ga.select(row_b >= 0, count + row_b, -1))


@kernel(poses=array(MOTOR, "n"), first=index("m", into="n"), second=index("m", into="n"), returns=array(MOTOR, "m"))
def motions_between(poses, first, second):
    """Compute the motions between pairs of poses."""
    return each(lambda before, after: ~before * after, gather(poses, first), gather(poses, second))


@kernel(
    motions=array(MOTOR, "n"), first=index("m", into="n"), second=index("m", into="n"), third=index("m", into="n"),
    bound=SCALAR,
)  # fmt: skip
def motions_close(motions, first, second, third, bound):
    """Test, for all triples, whether the third motion is, up to sign, the inverse of the first times the second.

    The tolerance is `bound` for rotations, and `bound` relative to the largest translation for translations.
    """
    far = fold(lambda found, m: _farthest((m,), found), 0, motions)

    def misses(p, q, r):
        between = ~p * q
        sign = ga.select(_rotor_product(between, r) < 0, -1, 1)
        close = 1
        for name in MOTOR.blades:
            limit = bound if name in ROTOR_BLADES else bound * far
            close = close * (absolute(sign * between[name] - r[name]) <= limit)
        return 1 - close

    missed = total(misses, *(gather(motions, table) for table in (first, second, third)))
    return missed <= 0


@kernel(a=array(MOTOR, "n"), b=array(MOTOR, "n"), rounding=SCALAR, returns=(array(SCALAR, "n", 2), SCALAR, SCALAR))
def screws(a, b, rounding):
    """Compute `screw_misfit` of all motions, whether none of them rotates, and the mean square of translations.

    A motion counts as not rotating if its angle is at most `rounding`, in radians.
    """
    count, far, turning = total(
        lambda m, n: (
            1,
            _length_squared(_part(m, FAR_BLADES)) + _length_squared(_part(n, FAR_BLADES)),
            1 - _is_still(m, rounding) * _is_still(n, rounding),
        ),
        a,
        b,
    )
    return each(screw_misfit.function, a, b), turning <= 0, 2 * far / count


def _is_still(motor, rounding):
    return 4 * _length_squared(_part(motor, ROTOR_BLADES[1:])) <= rounding * rounding


class Scaled(NamedTuple):
    """Motors in the unit of length in which their coefficients with e0 have size 1, with `b` in the sign of `a`."""

    a: Any
    b: Any
    unit: Any
    finite: Any
    count: Any


def _in_own_lengths(a, b):
    """Scale motors to their own unit of length; return the identity for all if a number is not finite."""

    def sums(m, n):
        numbers = [*_part(m, MOTOR.blades), *_part(n, MOTOR.blades)]
        far = _length_squared([*_part(m, FAR_BLADES), *_part(n, FAR_BLADES)])
        return SMALL * sum(map(absolute, numbers)), far, 1

    size, far, count = total(sums, a, b)
    finite = size <= FINITE
    unit = ga.select(finite * (far > 0), ga.sqrt(ga.select(finite * (far > 0), far / (4 * count), 1)), 1)

    def scaled(m, sign):
        numbers = {name: m[name] * (sign if name in ROTOR_BLADES else sign / unit) for name in MOTOR.blades}
        still = {name: int(name == "1") for name in MOTOR.blades}
        return ga.assemble(PGA3, {name: ga.select(finite, numbers[name], still[name]) for name in MOTOR.blades})

    def both(m, n):
        same = m["1"] * n["1"] + m["e0123"] * n["e0123"] / (unit * unit)
        return scaled(m, 1), scaled(n, ga.select(same >= 0, 1, -1))

    one, two = each(both, a, b)
    return Scaled(one, two, unit, finite, count)


@kernel(
    a=MOTORS, b=MOTORS, half_turn=SCALAR, same_axis=SCALAR,
    returns=(MOTORS, MOTORS, NUMBERS, SCALAR, SCALAR, array(SCALAR, 2), SCALAR, SCALAR, array(SCALAR, 8, 8)),
)  # fmt: skip
def equations_of_motions(a, b, half_turn, same_axis):
    """Scale motions to their own unit of length, and sum ``E^T E`` for the matrices E of ``a x - x b``.

    ``a x = x b`` preserves the scalar and the pseudoscalar part, which determines the sign of `b`. Near half turns
    noise may reverse the sign: these motions are excluded if the others are sufficient, and are not `clear`.

    Returns
    -------
    a, b
        The motions scaled by the unit, with consistent signs.
    clear
        Flags of the motions that are included in the sum.
    unit
        The root mean square of coefficients with e0.
    finite
        Whether all numbers are finite; if not, all motions are the identity.
    axes
        The sum of squared sines of half the angles, and that of their components along the common axis direction.
    parallel
        Whether these differ by at most the fraction `same_axis` squared, or no motion rotates by more than that.
    is_regular
        Whether all numbers are finite, and all motions clear.
    equations
        The sum of ``E^T E``, a matrix of 8 rows.
    """
    motions = _in_own_lengths(a, b)
    enough = total(lambda m: absolute(m["1"]) >= 5 * half_turn, motions.a)
    needed = ga.maximum(3, motions.count / 2 - Fraction(1, 2))  # rounded down for odd counts, which no count is between
    bound = ga.select(enough >= needed, 5 * half_turn, half_turn)
    clear = each(lambda m: absolute(m["1"]) >= bound, motions.a)

    def products(m, n, used):
        matrix = pga3.motor_equation.function(m, n)
        columns = list(zip(*matrix, strict=True))
        return tuple(
            tuple(used * sum(x * y for x, y in zip(p, q, strict=True)) for q in columns) for p in columns
        )  # fmt: skip

    equations = total(products, motions.a, motions.b, clear)
    axes = total(lambda m: _triangle([_part(m, ROTOR_BLADES[1:])]), motions.a)
    table = _square(axes, 3)
    size = table[0][0] + table[1][1] + table[2][2]
    along = ga.eigenvalues_symmetric(table)[2]
    square = same_axis * same_axis
    # Rounding errors spread the axes of motions about one axis; a smaller fraction would not detect them.
    rounding = Fraction(1, 2**47)
    parallel = ga.maximum(4 * size <= motions.count * square, size - along <= ga.maximum(square, rounding) * size)
    is_regular = motions.finite * (motions.count <= total(lambda used: used, clear))
    found = motions.a, motions.b, clear, motions.unit, motions.finite
    return *found, (size, along), parallel, is_regular, equations


def _triangle(rows):
    """Return the upper triangle of the sum of products of rows with themselves, in one sequence."""
    width = range(len(rows[0]))
    return tuple(sum(row[j] * row[k] for row in rows) for j in width for k in width if j <= k)


def _square(triangle, size):
    """Return the rows of a symmetric matrix from its upper triangle."""
    entries = iter(triangle)
    upper = {(j, k): next(entries) for j in range(size) for k in range(j, size)}
    return [[upper[min(j, k), max(j, k)] for k in range(size)] for j in range(size)]


# Gauss-Newton steps for motions.


class Descent(NamedTuple):
    """The state of the iteration for a motor."""

    motor: Any
    turn: Any
    """The sum of squares of residual rotations, before the last step."""
    shift: Any
    parallel: Any
    steps: Any
    done: Any


def _misfits(a, b, x):
    """Return the misfits of motions at their ends and at their starts, and the sums of squared translations."""
    rest = each(lambda m, n: misfit.function(m, n, x), a, b)
    before = each(lambda n, line: n * line * ~n, b, rest)
    shifts = total(
        lambda p, q: tuple(_length_squared(_part(line, BIVECTOR.blades[3:])) for line in (p, q)), rest, before
    )
    return rest, before, shifts


@kernel(a=array(MOTOR, "n"), b=array(MOTOR, "n"), x=MOTOR, returns=array(SCALAR, 2))
def misfit_of_motions(a, b, x):
    """Compute the root mean squares of residual rotations and translations.

    The translations are taken at the end of the motions at which they are smaller.
    """
    rest, before, (after_square, before_square) = _misfits(a, b, x)
    count, *turns = total(
        lambda *lines: (1, *(_length_squared(_part(line, BIVECTOR.blades[:3])) for line in lines)), rest, before
    )
    back = before_square < after_square
    squares = ga.select(back, turns[1], turns[0]), ga.select(back, before_square, after_square)
    return tuple(2 * ga.sqrt(square / count) for square in squares)


@kernel(
    a=array(MOTOR, "n"), b=array(MOTOR, "n"), clear=NUMBERS, first=EVEN, second=EVEN, unit=SCALAR,
    axes=array(SCALAR, 2),
    parallel=SCALAR, most=SCALAR, least_change=SCALAR, rounding=SCALAR, open_angle=SCALAR,
    returns=(EVEN, array(SCALAR, 2), SCALAR, SCALAR),
)  # fmt: skip
def fitted_to_motions(
    a, b, clear, first, second, unit, axes, parallel, most, least_change, rounding, open_angle
):  # fmt: skip
    """Fit a motor to motions by Gauss-Newton steps, starting from the last two singular vectors.

    Parameters
    ----------
    a, b, clear, unit, axes, parallel
        As returned by `equations_of_motions`.
    first, second
        Orthonormal elements that span the motor and its product with the pseudoscalar.
    most
        Maximal number of steps, up to 6.
    least_change, rounding
        Iteration stops if the predicted relative decrease of the sum of squares is at most `least_change`, or if the
        mean square is at most `rounding`.
    open_angle
        Axes count as parallel if the noise leaves a rotation about them uncertain by more than this angle.

    Returns
    -------
    motor
        In the unit of length of the caller, with nonnegative scalar part.
    residual
        The root mean squares of residual rotations and translations.
    parallel
    largest
        The largest sine of half the angle of a motion.
    """
    count = total(lambda _: 1, a)
    start = null_motor.function(first, second)

    def signed(m, n, used):
        return ga.select(ga.maximum(used, _rotor_product(m * start, start * n) >= 0), 1, -1) * n

    b = each(signed, a, b, clear)
    _, _, (after_square, before_square) = _misfits(a, b, start)
    back = before_square < after_square
    # The noise is assigned to the end at which it is least; seen from there, the motions are inverted.
    one, two = each(lambda m, n: (ga.select(back, ~m, m), ga.select(back, ~n, n)), a, b)
    open_square = ga.maximum(1 / (open_angle * open_angle), 6 * count)

    def step(now):
        turns, shifts = each(lambda m, n: misfit_equations.function(m, n, now.motor), one, two)
        sums = [_square(total(_triangle, rows), 7) for rows in (turns, shifts)]
        turn, shift = (table[6][6] for table in sums)
        is_open = turn * open_square > (3 * count - 3) * (axes[0] - axes[1])
        parallel = ga.maximum(now.parallel, (now.steps <= 0) * is_open)
        floor = Fraction(1, 10**4) * (turn + shift) + NEVER_ZERO
        weight = ga.select(count > 2, ga.maximum(turn, floor) / ga.maximum(shift, floor), 1)
        table = [[p + weight * q for p, q in zip(*rows, strict=True)] for rows in zip(*sums, strict=True)]
        damping = DAMPING * sum(table[k][k] for k in range(6)) + NEVER_ZERO
        matrix = [[table[j][k] + (damping if j == k else 0) for k in range(6)] for j in range(6)]
        right = [row[6] for row in table[:6]]
        solution, _ = ga.solve_symmetric(matrix, right)
        less = sum(x * y for x, y in zip(solution, right, strict=True))
        stops = ga.maximum(parallel, now.steps >= most)
        by = ga.select(stops, 0, -1)
        bivector = ga.assemble(PGA3, {name: by * x for name, x in zip(BIVECTOR.blades, solution, strict=True)})
        cost = table[6][6]
        done = ga.maximum(stops, ga.maximum(less <= least_change * cost, cost <= rounding * count))
        return Descent(now.motor * ga.exp(bivector), turn, shift, parallel, now.steps + 1, done)

    found, _, _ = iterate(step, Descent(start, 0, 0, parallel, 0, 0), lambda _, new: new.done > 0, STEPS + 1)
    sign = ga.select(found.motor["1"] >= 0, 1, -1)
    motor = {name: sign * (1 if name in ROTOR_BLADES else unit) * found.motor[name] for name in MOTOR.blades}
    sine = fold(lambda most, m: ga.maximum(most, _length_squared(_part(m, ROTOR_BLADES[1:]))), 0, a)
    roots = 2 * ga.sqrt(found.turn / count), 2 * unit * ga.sqrt(found.shift / count)
    return ga.assemble(PGA3, motor), roots, found.parallel, ga.sqrt(sine)


# Gauss-Newton steps for poses, whose noise is unknown.


@kernel(a=MOTORS, b=MOTORS, x=EVEN, returns=(MOTORS, MOTORS, EVEN, EVEN, SCALAR, SCALAR))
def start_of_poses(a, b, x):
    """Scale poses and `x` to their own unit of length, and compute the mean ``z`` of ``a x ~b`` as a start.

    Returns
    -------
    a, b, x, z
        The signs of `b` are chosen so that all ``a x ~b`` agree.
    unit
        The root mean square of coefficients with e0.
    finite
        Whether all numbers are finite; if not, all motors are the identity.
    """
    poses = _in_own_lengths(a, b)
    numbers = {name: x[name] / (1 if name in ROTOR_BLADES else poses.unit) for name in MOTOR.blades}
    still = {name: int(name == "1") for name in MOTOR.blades}
    x = ga.assemble(PGA3, {name: ga.select(poses.finite, numbers[name], still[name]) for name in MOTOR.blades})
    worlds = each(lambda m, n: m * x * ~n, poses.a, poses.b)

    def kept(found, world):
        return ga.select(_length_squared(_part(found, ROTOR_BLADES)) > 0, found, world)

    first = fold(kept, PGA3.multivector({}), worlds)
    signs = each(lambda world: ga.select(_rotor_product(world, first) < 0, -1, 1), worlds)
    mean = total(lambda world, sign: sign * world, worlds, signs)
    b = each(lambda n, sign: sign * n, poses.b, signs)
    return poses.a, b, x, pga3.normalize_motor.function(mean), poses.unit, poses.finite


@kernel(motions=array(BIVECTOR, "n"), returns=VECTOR)
def still_point(motions):
    """Compute the point that small motions of a frame, given as bivectors, displace least in total.

    It is regularised towards the origin: the weight is as if each motion had a translation for a point at unit
    distance.
    """

    def sums(motion):
        p, q, r, *shift = _part(motion, BIVECTOR.blades)
        columns = ((0, p, q), (-p, 0, r), (-q, -r, 0))  # the moment is as linear in the rotation as in the point
        slope = tuple(-sum(x * y for x, y in zip(column, shift, strict=True)) for column in columns)
        products = tuple(sum(x * y for x, y in zip(m, n, strict=True)) for m in columns for n in columns)
        return products, slope, _length_squared(shift), 1

    products, slope, size, count = total(sums, motions)
    pull = 2 * size / (3 * count) + Fraction(1, 10**30)
    matrix = [[products[3 * j + k] + (pull if j == k else 0) for k in range(3)] for j in range(3)]
    return ga.solve_symmetric(matrix, slope)[0]


@kernel(
    a=array(MOTOR, "n"), b=array(MOTOR, "n"), x=MOTOR, z=MOTOR, place=POINT,
    returns=(POSE_ROWS, POSE_ROWS, POINT, array(POINT, "n")),
)  # fmt: skip
def rows_of_poses(a, b, x, z, place):
    """Compute the rows of `misfit_of_poses_equations` in the frame of the camera, and two points there.

    Returns
    -------
    turns, shifts
    hand
        The origin of the hand.
    seen
        `place`, a point of the target.
    """
    turns, shifts = each(lambda m, n: misfit_of_poses_equations.function(m, n, x, z, ONE), a, b)
    return turns, shifts, ~x * PGA3.multivector({"e123": 1}) * x, each(lambda n: ~n * place * n, b)


@kernel(x=MOTOR, z=MOTOR, step=array(SCALAR, 2, 6), returns=(MOTOR, MOTOR))
def moved(x, z, step):
    """Compute the motors ``x exp(B)`` and ``z exp(C)``, the parameters of `misfit_of_poses_equations`."""
    b, c = (ga.assemble(PGA3, dict(zip(BIVECTOR.blades, row, strict=True))) for row in step)
    return x * ga.exp(b), z * ga.exp(c)


class Noise(NamedTuple):
    """The variances of rotations of the hand, of rotations of the camera, and of translations."""

    hand: Any
    camera: Any
    shift: Any

    @property
    def turn(self):
        """The variance of residual rotations."""
        return self.hand + self.camera


def _at_point(point, turn):
    """Return the translation e01 e02 e03, at a point, of a rotation about the origin, e12 e13 e23."""
    (x, y, z), (p, q, r) = point, turn
    return -y * p - z * q, x * p - z * r, x * q + y * r


def _about_point(point, shift):
    """Return the transpose of `_at_point`, as a function of the translation."""
    (x, y, z), (u, v, w) = point, shift
    return x * v - y * u, x * w - z * u, y * w - z * v


def _seen_from(hand, seen, noise):
    """Return the displacement between the origins, and the point where rotation and translation are uncorrelated."""
    arm = [s - h for s, h in zip(seen, hand, strict=True)]
    return arm, [h + noise.camera / noise.turn * x for h, x in zip(hand, arm, strict=True)]


def _moved_to(point, turn, shift):
    """Return a translation at a point from that at the origin."""
    return tuple(x + y for x, y in zip(shift, _at_point(point, turn), strict=True))


def _across(arm, noise):
    """Return the weight of translations orthogonal to the arm, which both rotations affect."""
    return 1 / (noise.shift + noise.hand * noise.camera / noise.turn * _length_squared(arm))


def _last(rows):
    return [row[-1] for row in rows]


_ROWS = {"turns": POSE_ROWS, "shifts": POSE_ROWS, "hand": VECTOR, "seen": array(SCALAR, "n", 3)}


@kernel(**_ROWS, variances=VECTOR)
def weighed_squares(turns, shifts, hand, seen, variances):
    """Compute the sum of squared residuals, in the last columns, weighted by the inverse of their covariance."""
    noise = Noise(*variances)

    def square(turn_rows, shift_rows, place):
        arm, centre = _seen_from(hand, place, noise)
        turn = _last(turn_rows)
        shift = _moved_to(centre, turn, _last(shift_rows))
        along = sum(x * y for x, y in zip(shift, arm, strict=True))
        part = along * along / ga.maximum(_length_squared(arm), TINY)
        rest = (_length_squared(shift) - part) * _across(arm, noise)
        return _length_squared(turn) / noise.turn + part / noise.shift + rest

    return total(square, turns, shifts, seen)


@kernel(
    **_ROWS, variances=VECTOR, is_first=SCALAR, damping=array(SCALAR, "k", shared=True),
    returns=(array(SCALAR, 12), SCALAR, VECTOR, SCALAR, VECTOR, array(SCALAR, 2)),
)  # fmt: skip
def likely_step(turns, shifts, hand, seen, variances, is_first, damping):
    """Compute the Gauss-Newton step towards the most likely poses, and new variances.

    In the noise model, the hand rotates about its origin and the camera about the target; translations have noise of
    their own. Each variance is multiplied by the ratio of its part of the sum of squares to the expected part, given
    the number of unknowns (restricted maximum likelihood); a variance of 0 remains 0.

    Parameters
    ----------
    turns, shifts, hand, seen
        As returned by `rows_of_poses`.
    variances
        Variances of rotations of the hand, of rotations of the camera, and of translations.
    is_first
        Whether only ratios of the variances are known.
    damping
        The increment of the pivot of each of the twelve unknowns, relative to the trace.

    Returns
    -------
    step
        The step, 0 if the sums are not finite.
    goes_on
        Whether the sums are finite and either it is the first step, or the step or the change of the variances is not
        small.
    used
        The variances on which the step is based.
    cost
        The weighted sum of squares before the step.
    found
        The new variances.
    squares
        The sums of squares of rotations and of translations.
    """
    turn_square, shift_square, count = total(
        lambda p, q: (_length_squared(_last(p)), _length_squared(_last(q)), 1), turns, shifts
    )
    given = Noise(*variances)
    scale = ga.select(is_first > 0, (turn_square / (3 * count) + Fraction(1, 10**32)) / given.turn, 1)
    noise = Noise(scale * given.hand, scale * given.camera, given.shift)

    def at_centre(p, q, place):
        return _length_squared(_moved_to(_seen_from(hand, place, noise)[1], _last(p), _last(q)))

    at_first = total(at_centre, turns, shifts, seen) / (3 * count) + Fraction(1, 10**32)
    shift = ga.select(is_first > 0, at_first, noise.shift)
    noise = Noise(noise.hand, noise.camera, ga.maximum(shift, Fraction(1, 10**6) * (noise.turn + shift)))

    def centred(p, q, place):
        """Return the rows of translations at the centre, and the whitening weights across the arm and along it."""
        arm, centre = _seen_from(hand, place, noise)
        turned, shifted = zip(*p, strict=True), zip(*q, strict=True)
        columns = [_moved_to(centre, turn, shift) for turn, shift in zip(turned, shifted, strict=True)]
        return tuple(zip(*columns, strict=True)), tuple(arm), _across(arm, noise)

    rows, arms, weights = each(centred, turns, shifts, seen)

    def by_cause(p, q, arm, across):
        """Return whitened rows with respect to a rotation of the hand, a rotation of the camera, and a translation.

        The sums of their squares, each times its variance, are the normal equations.
        """
        along = (1 / noise.shift - across) / ga.maximum(_length_squared(arm), TINY)
        columns = list(zip(*q, strict=True))
        about = [_about_point(arm, column) for column in columns]
        parts = []
        for by in (noise.camera / noise.turn, -noise.hand / noise.turn):
            parts.append(tuple(
                tuple(p[j][k] / noise.turn + by * across * about[k][j] for k in range(13)) for j in range(3)
            ))  # fmt: skip
        dots = [along * sum(x * y for x, y in zip(arm, column, strict=True)) for column in columns]
        parts.append(tuple(tuple(across * q[j][k] + arm[j] * dots[k] for k in range(13)) for j in range(3)))
        return tuple(parts)

    of_hand, of_camera, of_shift = each(by_cause, turns, rows, arms, weights)
    tables = [total(_triangle, part) for part in (of_hand, of_camera, of_shift)]
    lever, sides = total(lambda arm, across: (2 * across * _length_squared(arm), 2 * across), arms, weights)
    table = tuple(sum(v * x for v, x in zip(noise, entries, strict=True)) for entries in zip(*tables, strict=True))
    symmetric = _square(table, 13)
    trace, cost = sum(symmetric[k][k] for k in range(12)), symmetric[12][12]

    def swept(entries, damped):
        """Apply the sweep operator (Goodnight 1979) to the first unknown, which then becomes the last.

        After all sweeps the matrix contains the negative inverse, and the last column the solution of the equations.
        """
        matrix = _square(entries, 13)
        pivot = 1 / (matrix[0][0] + damped * trace + NEVER_ZERO)
        row = [x * pivot for x in matrix[0]]
        rest = [[matrix[j][k] - matrix[0][j] * row[k] for k in range(13)] for j in range(13)]
        order = [*range(1, 12), 0, 12]

        def entry(j, k):
            j, k = min(order[j], order[k]), max(order[j], order[k])
            return rest[j][k] if j else row[k] if k else -pivot

        return tuple(entry(j, k) for j in range(13) for k in range(j, 13))

    inverse = _square(fold(swept, table, damping), 13)
    size = SMALL * sum(absolute(inverse[k][12]) for k in range(12))
    is_known = size <= FINITE
    step = [ga.select(is_known, -inverse[k][12], 0) for k in range(12)]
    less = -sum(x * symmetric[k][12] for k, x in enumerate(step))
    after = [*step, 1]
    shares = (noise.camera / noise.turn, noise.hand / noise.turn)
    fixed = [3 * count / noise.turn + share * share * lever for share in shares]
    fixed.append(count / noise.shift + sides)
    found = []
    for variance, entries, own in zip(noise, tables, fixed, strict=True):
        part = _square(entries, 13)
        explained = sum(after[j] * part[j][k] * after[k] for j in range(13) for k in range(13))
        expected = own + sum(inverse[j][k] * part[j][k] for j in range(12) for k in range(12))
        # For few poses without redundancy, the degrees of freedom that remain are rounding errors.
        enough = expected > Fraction(1, 10**9)
        found.append(ga.select(enough, variance * explained / ga.select(enough, expected, 1), variance))
    smallest = Fraction(1, 10**6) * sum(found) + Fraction(1, 10**32)
    turn = found[0] + found[1]
    few = turn < smallest
    raised = smallest / noise.turn
    new = Noise(
        ga.select(few, raised * noise.hand, found[0]),
        ga.select(few, raised * noise.camera, found[1]),
        ga.maximum(found[2], smallest),
    )
    is_settled = (less <= Fraction(1, 1000)) * _is_near(new.shift, noise.shift) * _is_near(new.turn, noise.turn)
    goes_on = is_known * ga.maximum(is_first > 0, 1 - is_settled)
    return tuple(step), goes_on, tuple(noise), cost, tuple(new), (turn_square, shift_square)


def _is_near(a, b):
    """Return whether two positive numbers differ by less than a tenth of their size, by their logarithms."""
    bound = Fraction(11051709180756477, 10**16)  # exp(1 / 10)
    return (a < bound * b) * (b < bound * a)
