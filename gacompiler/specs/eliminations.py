"""Elimination of all variables but one for general arms with six joints, as in `algorithms.kinematics`.

Six joints reach a goal: ``E1 ... E6 = G``. A point of the axis of one joint, with the axis as its tangent, is invariant
under this joint. Three consecutive joints move it to where the other two and the goal move it. Its 14 numbers in
conformal geometry transform linearly under motions, so that both sides are polynomials of degree one in cosine and
sine of each angle. The variables of the two joints occur in eight monomials. Reflections that make these triangular
leave six equations in the three variables (Raghavan and Roth, *J. Mechanical Design* 115:502, 1993). For every value of
the first one, the six equations and their products with the second variable are homogeneous in twelve monomials. Their
determinant, divided by factors without zeros, is a trigonometric polynomial of degree 8. It is found from 17 values,
and has 16 zeros.

The kernels are in one file because both of the first two reduce the six equations.
"""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, array, each, equal, fold, iterate, kernel, matrices, pick, select, total
from gacompiler.algebra.catalog import PGA3
from gacompiler.specs import arms
from gacompiler.specs.reaching import HALF_TURN, _inward, _motion

LINE, POINT, MOTOR = PGA3.LINE, PGA3.POINT, PGA3.MOTOR
NUMBERS = 14
"""Numbers of a point with a tangent, of which the first `PAIRS` are made triangular by the monomials of two joints."""
PAIRS, LEFT = 8, 6
PAIR, SIDE = array(SCALAR, "e", NUMBERS), array(SCALAR, "t", "t", 3, NUMBERS)
JOINTS = array(SCALAR, "j", shared=True)
STEP = Fraction(1, 2**22)
"""Distance of the values from which the slope of the determinant is computed, in radians."""
LONGEST = Fraction(1, 64)
"""Longer steps indicate that there is no zero nearby."""
TINY = Fraction(1, 10**30)
"""Pivots of zero are replaced by this number, which is small beside rounding errors."""
NOISE = Fraction(1, 2**43)
"""Rounding errors of the polynomial, relative to the sum of its coefficients: a thousand, of determinants and sums."""
UNLUCKY = 16
"""The errors of the polynomial are this many times those at the checks, all of them, with a probability of 1e-4."""
MOST_STEPS = 100
"""Maximum number of steps for the zeros. About ten suffice."""


def _dot(x, y):
    return sum(a * b for a, b in zip(x, y, strict=True))


def _triangular(pivots, others, start, width=LEFT):
    """Reflect columns of arrays until the pivots, from row `start` on, are triangular; also return their determinant.

    The columns are tuples of numbers. Columns of `NUMBERS` are reflected together with rows of triples of them. The
    present row is counted in the state, so that the loops from different first rows share their text.
    """

    def step(state, k):
        pivots, others, value, at = state
        column = pick(pivots, k, (0,) * width)
        rest = sum(select(at < i, x * x, 0) for i, x in enumerate(column))
        lead = sum(select(equal(at, i), x, 0) for i, x in enumerate(column))
        is_done = rest <= TINY * TINY
        size = ga.sqrt(select(is_done, 1, lead * lead + rest))
        factor = select(is_done, 0, 1 / (size * (size + ga.absolute(lead))))
        signed = select(lead < 0, -size, size)
        first = lead + signed
        v = tuple(select(at < i, x, select(equal(at, i), first, 0)) for i, x in enumerate(column))

        def reflected(row):
            share = factor * _dot(row, v)
            return tuple(x - share * y for x, y in zip(row, v, strict=True))

        def all_reflected(rows):
            return each(lambda parts: tuple(map(reflected, parts)), rows)

        moved = tuple(each(all_reflected if width == NUMBERS else reflected, rows) for rows in others)
        return each(reflected, pivots), moved, value * select(is_done, lead, signed), at + 1

    return fold(step, (pivots, others, 1, start), ga.row_numbers(pivots))[:3]


def _combined(weights, blocks, start):
    """Return the columns of the monomials of two variables for 1, cosine and sine of the first one, from a number on.

    Each is three tuples, for the powers of the second variable.
    """

    def combined(rows):
        return total(lambda w, row: tuple(tuple(w * x for x in part[start:]) for part in row), weights, rows)

    return each(combined, blocks)


def _six_equations(columns):
    """Reduce the twelve equations to triangular columns of two powers, and also return their determinant."""
    low, middle, high = (each(lambda parts, k=k: parts[k][-LEFT:], columns) for k in range(3))
    _, (own, following), value_low = _triangular(low, (middle, high), 0)
    _, (before, last), value_high = _triangular(high, (low, middle), 0)
    one = each(lambda a, b: (*a[3:], *b[3:]), own, before)
    two = each(lambda a, b: (*a[3:], *b[3:]), following, last)
    one, (two,), value_one = _triangular(one, (two,), 0)
    two, _, value_two = _triangular(two, (), 3)
    return one, two, value_low * value_high * value_one * value_two


@kernel(
    goal=MOTOR, centre=array(SCALAR, 2), pair=array(SCALAR, "e", "n", shared=True),
    constant=array(SCALAR, "n", shared=True), before=array(MOTOR, "n", shared=True),
    after=array(MOTOR, "n", shared=True), point=POINT, line=LINE,
    side=array(SCALAR, "t", "t", 3, NUMBERS, shared=True), shares=array(SCALAR, "t", "t", 3, shared=True),
    samples=array(SCALAR, "s", 2, shared=True), guesses=array(SCALAR, "r", 2, shared=True),
    waves=array(SCALAR, "p", "s", 2, shared=True), checks=array(SCALAR, "k", 2, shared=True),
    returns=(PAIR, SIDE, array(SCALAR, "r", 4)),
)  # fmt: skip
def eliminated(
    goal, centre, pair, constant, before, after, point, line, side, shares, samples, guesses, waves, checks
):  # fmt: skip
    """Reduce the equations of a goal to six in three variables, and find the values of the first one.

    Parameters
    ----------
    goal
        The motion of all joints together.
    centre
        A complex number c inside the unit circle. The map of z to ``(z + c) / (1 + ~c z)``, with the conjugate of c,
        moves the sample points on the unit circle towards it. The polynomial is accurate relative to its largest value,
        so that zeros that are close to each other need samples close to them.
    pair, constant
        Coefficients of the eight monomials but the constant, and of the constant, from nine values.
    before, after
        Motions of the two joints at the nine values: the point is moved by ``~before goal ~after``.
    point, line
        The point and its tangent.
    side
        Coefficients of the three joints: a row for each power of the third variable, in it one for 1, cosine and sine
        of the first variable, and in it one for each power of the second variable.
    shares
        Coefficients of the constant 1 in the same monomials.
    samples
        Cosine and sine of the sample angles.
    guesses
        Complex numbers at which the search for zeros begins.
    waves
        The table of the discrete Fourier transform, from the coefficient of the highest power on: one row more than
        there are guesses, since a polynomial has as many zeros as its degree.
    checks
        Cosine and sine of further angles, at which the polynomial is compared with the determinant.

    Returns
    -------
    pair, side
        The same coefficients after the reflections that make those of the pair triangular.
    zeros
        For each zero: the first variable; its imaginary part, before the map; whether it is real; and whether this is
        in doubt. A zero is real if no other one is nearer to its conjugate. If it is not, but the polynomial at its
        real part is a rounding error, or as small as its errors at the checks, it is in doubt.
    """

    def moved(left, right):
        motion = ~left * goal * ~right
        return arms.point_and_tangent(motion * point * ~motion, motion * line * ~motion)

    values = each(moved, before, after)

    def combined(row):
        return total(lambda w, value: tuple(w * x for x in value), row, values)

    offset = combined(constant)

    def less(parts, weights):
        return tuple(
            tuple(a - w * b for a, b in zip(part, offset, strict=True)) for part, w in zip(parts, weights, strict=True)
        )

    side = each(lambda rows, own: each(less, rows, own), side, shares)
    pair, (side,), _ = _triangular(each(combined, pair), (side,), 0, NUMBERS)
    three = ga.row_numbers(side)
    centre = matrices.Complex(*centre)

    def height(cosine, sine):
        z, scale = _mapped(matrices.Complex(cosine, sine), centre)
        square = scale * scale
        fourth = square * square
        columns = _combined(_array(three, (1, z.real, z.imaginary)), side, PAIRS)
        return _six_equations(columns)[2] * fourth * fourth

    heights = each(lambda sample: height(*sample), samples)
    coefficients = each(lambda wave: total(lambda w, x: (w[0] * x, w[1] * x), wave, heights), waves)

    def mapped(angle, *others):
        z, _ = _mapped(matrices.Complex(ga.cos(angle), ga.sin(angle)), centre)
        return (ga.atan2(z.imaginary, z.real), *others)

    def away(sample):
        value, _, _ = _values(coefficients, matrices.Complex(*sample))
        return ga.absolute(_size(value) - ga.absolute(height(*sample)))

    noise = UNLUCKY * fold(lambda most, sample: ga.maximum(most, away(sample)), 0, checks)
    return pair, side, each(mapped, *_zeros(coefficients, guesses, noise))


def _mapped(z, centre):
    """Return the image of a point of the unit circle, and the squared length of the denominator."""
    above = matrices.Complex(z.real + centre.real, z.imaginary + centre.imaginary)
    below = matrices.complex_product(z, matrices.Complex(centre.real, -centre.imaginary))
    back = matrices.Complex(1 + below.real, -below.imaginary)
    scale = back.real * back.real + back.imaginary * back.imaginary
    found = matrices.complex_product(above, back)
    return matrices.Complex(found.real / scale, found.imaginary / scale), scale


def _size(z):
    return ga.sqrt(z.real * z.real + z.imaginary * z.imaginary)


def _values(coefficients, z):
    """Return a polynomial, its slope, and the sum of the sizes of its terms."""
    size = _size(z)

    def horner(state, c):
        value, slope, bound = state
        up, along = matrices.complex_product(value, z), matrices.complex_product(slope, z)
        return (
            matrices.Complex(up.real + c[0], up.imaginary + c[1]),
            matrices.Complex(along.real + value.real, along.imaginary + value.imaginary),
            bound * size + ga.absolute(c[0]) + ga.absolute(c[1]),
        )

    return fold(horner, (matrices.Complex(0, 0), matrices.Complex(0, 0), 0), coefficients)


def _zeros(coefficients, guesses, noise):
    """Return zeros of a trigonometric polynomial as in `eliminated`, before the map, by the method of Aberth."""
    numbers = ga.row_numbers(guesses)

    def values(z):
        return _values(coefficients, z)

    def step(state):
        return matrices.aberth_step(state[0], numbers, values, 64)

    (points, _), _, _ = iterate(step, (guesses, 1), lambda _, new: new[1] <= 0, at_most=MOST_STEPS)
    angle = each(lambda z: ga.atan2(z[1], z[0]), points)
    away = each(lambda z: ga.log(z[0] * z[0] + z[1] * z[1]) / 2, points)

    def is_real(own, own_away, i):
        value, _, bound = values(matrices.Complex(ga.cos(own), ga.sin(own)))

        def is_conjugate(other, other_away, j):
            chord = 2 * ga.sin((own - other) / 2)
            square = chord * chord + (own_away + other_away) * (own_away + other_away)
            return select(equal(i, j), 0, select(square < 4 * own_away * own_away, 1, 0))

        is_apart = total(is_conjugate, angle, away, numbers) > 0
        return select(is_apart, 0, 1), select(
            is_apart, select(_size(value) < ga.maximum(NOISE * bound, noise), 1, 0), 0
        )

    return angle, away, *each(is_real, angle, away, numbers)


@kernel(
    goal=MOTOR, angles=array(SCALAR, "c"), sharpened=SCALAR, pair=PAIR, side=SIDE, slides=array(SCALAR, 5, shared=True),
    places=JOINTS, origins=JOINTS, axes=array(LINE, "j", shared=True), turns=JOINTS, last=SCALAR, line=PGA3.UNIT_LINE,
    across=LINE, returns=array(SCALAR, "c", "j"),
)  # fmt: skip
def branches_of_angles(
    goal, angles, sharpened, pair, side, slides, places, origins, axes, turns, last, line, across
):  # fmt: skip
    """Compute the configurations that belong to zeros of `eliminated`.

    Parameters
    ----------
    goal
        The motion of all joints together.
    angles
        Values of the first variable.
    sharpened
        The largest number of Newton steps that sharpen each of them first, with values of the determinant near it.
    pair, side
        As returned by `eliminated`.
    slides
        For the two joints and the three others, 1 if the joint is prismatic, else 0.
    places
        For each joint, its place in this order; 5 for the joint under which the point is invariant.
    origins
        The value of each joint at which its variable is 0.
    axes, turns
        The joints, as in `reaching`.
    last, line, across
        The number and the axis of the joint under which the point is invariant, and a line that is not parallel to it.
    """
    three = ga.row_numbers(side)

    def columns_at(angle, start):
        return _combined(_array(three, (1, ga.cos(angle), ga.sin(angle))), side, start)

    def sharper(angle):
        def height(k):
            value = _six_equations(columns_at(angle + (k - 1) * STEP, PAIRS))[2]
            return select(equal(k, 1), value, 0), (k - 1) * value

        value, rise = total(height, three)
        step = 2 * STEP * value / select(equal(rise, 0), 1, rise)
        return angle - ga.minimum(ga.maximum(step, -LONGEST), LONGEST)

    def branch(angle):
        angle, _, _ = iterate(sharper, angle, lambda old, new: ga.absolute(new - old) < STEP * STEP, at_most=sharpened)
        columns = columns_at(angle, 0)
        one, two, _ = _six_equations(columns)
        vector = _null_vector(one, two)
        fourth, powers = _variable(slides[3], [(vector[k], vector[3 + k]) for k in range(3)])
        fifth, powers_of_fifth = _variable(slides[4], [(vector[k], vector[k + 1]) for k in (0, 1, 3, 4)])

        def shared(w, parts):
            return tuple(w * _dot(powers, numbers) for numbers in zip(*(part[:PAIRS] for part in parts), strict=True))

        right = total(shared, _array(three, powers_of_fifth), columns)
        singles = _back(pair, right, PAIRS - 1, (0,) * PAIRS)[1]
        first = select(slides[0] > 0, singles[2], ga.atan2(singles[5], singles[2]))
        second = select(slides[1] > 0, singles[0], ga.atan2(singles[1], singles[0]))
        known = (first, second, angle, fourth, fifth)

        def placed(place, origin):
            return origin + sum(select(equal(place, i), x, 0) for i, x in enumerate(known))

        q = each(placed, places, origins)
        numbers = ga.row_numbers(q)
        head = _motion(each(lambda x, i: select(i < last, x, 0), q, numbers), axes, turns)
        tail = _motion(each(lambda x, i: select(i > last, x, 0), q, numbers), axes, turns)
        rest = ~head * goal * ~tail
        own = arms.turn_between_lines(line, across, (rest * across * ~rest).grade(2))
        return each(lambda x, i: select(equal(i, last), own, x), q, numbers)

    return each(branch, angles)


@kernel(
    q=array(SCALAR, "b", "n"), off=array(SCALAR, "b"), axes=array(LINE, "n", shared=True),
    turns=array(SCALAR, "n", shared=True), size=SCALAR, close=SCALAR, same=SCALAR, flat=SCALAR,
    returns=(array(SCALAR, "b"), array(SCALAR, "b")),
)  # fmt: skip
def distinct_branches(q, off, axes, turns, size, close, same, flat):
    """Find the configurations that reach a goal and differ from each other, and those where branches coincide.

    Parameters
    ----------
    q, off
        Configurations, and the distances of their motors from the goal.
    axes, turns, size
        The arm, as in `reaching`.
    close
        A configuration reaches the goal if its distance is less than this.
    same
        Configurations are the same if no joint differs by this much or more. The one with the smallest distance is
        kept.
    flat
        Branches coincide if the determinant of the normalised twists of the joints is at most this.

    Returns
    -------
    kept, gap
        1 or 0 for each configuration: whether it is a branch, and 0 if it coincides with another one.
    """
    numbers = ga.row_numbers(off)

    def is_kept(own, own_off, i):
        def is_better(other, other_off, j):
            def farthest(most, a, b, turn):
                away = a - b
                rest = away - 2 * HALF_TURN * ga.floor(away / (2 * HALF_TURN) + Fraction(1, 2))
                return ga.maximum(most, ga.absolute(select(turn > 0, rest, away)))

            is_first = select(other_off < own_off, 1, select(equal(other_off, own_off), select(j < i, 1, 0), 0))
            return select(fold(farthest, 0, own, other, turns) < same, is_first, 0)

        return select(own_off < close, select(total(is_better, q, off, numbers) > 0, 0, 1), 0)

    def gap(own):
        rates = each(lambda rate: _normalized(rate), _inward(own, axes, turns, size)[1])
        return select(ga.absolute(_triangular(rates, (), 0)[2]) > flat, 1, 0)

    return each(is_kept, q, off, numbers), each(gap, q)


def _normalized(numbers):
    length = ga.sqrt(_dot(numbers, numbers))
    return tuple(x / length for x in numbers)


def _array(numbers, values):
    """Return an array of three values."""
    return each(lambda k: select(equal(k, 0), values[0], select(equal(k, 1), values[1], values[2])), numbers)


def _variable(slides, pairs):
    """Return a variable from pairs in the ratio 1 to it, or to the tangent of half the angle, and its powers."""
    along, square = sum(a * b for a, b in pairs), sum(a * a for a, _ in pairs)
    angle = ga.atan2(2 * along, square - sum(b * b for _, b in pairs))
    slide = along / select(square > 0, square, 1)
    cosine, sine = ga.cos(angle), ga.sin(angle)
    powers = (
        select(slides > 0, 1, (1 + cosine) / 2),
        select(slides > 0, slide, sine / 2),
        select(slides > 0, slide * slide, (1 - cosine) / 2),
    )
    return select(slides > 0, slide, angle), powers


def _at(values, at):
    return sum(select(equal(at, i), x, 0) for i, x in enumerate(values))


def _safe(pivot):
    return select(ga.absolute(pivot) > TINY, pivot, TINY)


def _back(columns, right, last, found):
    """Solve triangular equations for the unknowns of columns, back from row `last`; also return what remains."""

    def solved(state, column):
        right, found, at = state
        value = _at(right, at) / _safe(_at(column[: len(right)], at))
        return (
            tuple(x - value * c for x, c in zip(right, column, strict=False)),
            tuple(select(equal(at, i), value, x) for i, x in enumerate(found)),
            at - 1,
        )

    return fold(solved, (right, found, last), columns, reverse=True)[:2]


def _null_vector(one, two):
    """Return the vector of six numbers that triangular columns take nearest to 0, by one step of inverse iteration."""

    def solved(state, column):
        found, at = state
        value = (1 - _dot(column, found)) / _safe(_at(column, at))
        return tuple(select(equal(at, i), value, x) for i, x in enumerate(found)), at + 1

    right, _ = fold(solved, fold(solved, ((0,) * LEFT, 0), one), two)
    right, found = _back(two, right, LEFT - 1, (0,) * LEFT)
    return _back(one, right, LEFT // 2 - 1, found)[1]
