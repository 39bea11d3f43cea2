"""Mamdani inference: strengths of fuzzy sets by the rules of a rule base, and numbers for unions of clipped sets.

A set is given by its membership at the places of a grid, and is linear between them. Rule bases are data. The
conditions of rules are a program for an accumulator and a stack: each step has a literal, which is the membership of an
input in a set or one minus it. The steps for a set of an output end with its strength, the largest weighted strength of
the rules that conclude it.

The union of the clipped sets of an output is taken at the places of the grid, and at the points where a set crosses its
strength, and is linear between them. A set has at most two such points, as memberships rise and then fall.
"""

from typing import Any, NamedTuple

import gacompiler as ga
from gacompiler import SCALAR, array, each, fold, gather, index, kernel, scan, scatter, select

DEPTH = 6
"""Number of intermediate results that a condition may need at once, with the strength of earlier rules."""
FAR = 10**30


class Step(NamedTuple):
    """One step of a program, a row of zeros and ones apart from `sign` and `weight`."""

    plus: Any
    sign: Any
    """The literal is ``plus + sign * membership``."""
    weight: Any
    """What the result is multiplied by."""
    push: Any
    """Whether the result becomes a new element of the stack."""
    pop: Any
    """Whether the operand is the second element of the stack, which is removed, and not the literal."""
    load: Any
    least: Any
    greatest: Any
    product: Any
    either: Any
    complement: Any
    """Which of the operations computes the result."""


class Sample(NamedTuple):
    """The membership of one place of the grid of an output in one set."""

    height: Any
    same: Any
    """Whether the previous sample is of the same place."""
    area: Any
    """The weight of the place in the area, and 0 unless this is the last sample of the place."""
    moment: Any
    """The same for the first moment."""


def _shared(length, *shape):
    return array(SCALAR, length, *shape, shared=True)


def _numbers(length):
    return array(SCALAR, length)


@kernel(
    offsets=_numbers("inputs"), heights=_numbers("sets"), slopes=_numbers("sets"),
    variable=index("sets", into="inputs"), literal=index("steps", into="sets"),
    program=_shared("steps", len(Step._fields)), ends=index("terms", into="steps"), returns=_numbers("terms"),
)  # fmt: skip
def strengths(offsets, heights, slopes, variable, literal, program, ends):
    """Compute the strengths that a program ends with.

    Parameters
    ----------
    offsets
        How far each input is from the place of the grid below it.
    heights, slopes
        The membership of that place in each set of the inputs, and the slope of the membership above it.
    variable
        For each set, its input.
    literal
        For each step, the set of its literal.
    program
        The steps.
    ends
        The step after which each strength is the first element of the stack.
    """
    members = each(lambda offset, height, slope: height + slope * offset, gather(offsets, variable), heights, slopes)

    def run(stack, member, row):
        step = Step(*row)
        first, second = stack[0], select(step.pop, stack[1], step.plus + step.sign * member)
        found = (
            step.load * second + step.least * ga.minimum(first, second) + step.greatest * ga.maximum(first, second)
            + step.product * (first * second) + step.either * (first + second - first * second)
            + step.complement * (1 - first)
        )  # fmt: skip
        found = step.weight * found
        pushed, popped = [found, *stack[:-1]], [found, *stack[2:], 0]
        kept = [found, *stack[1:]]
        rows = zip(pushed, popped, kept, strict=True)
        return tuple(select(step.push, a, select(step.pop, b, c)) for a, b, c in rows)

    stacks = scan(run, (0,) * DEPTH, gather(members, literal), program)
    return each(lambda first: first, gather(stacks[0], ends))


@kernel(
    cuts=_numbers("terms"), heights=_shared("samples"), falling=_shared("samples"),
    term=index("samples", into="terms"), flank=index("samples", into="flanks"), zero=_shared("flanks"),
    returns=_numbers("flanks"),
)  # fmt: skip
def counts_on_flanks(cuts, heights, falling, term, flank, zero):
    """Count the samples of rising flanks that are below the strength of their set, and of falling ones that are not.

    Parameters
    ----------
    cuts
        The strengths of the sets.
    heights, falling, term, flank
        For each sample of a flank, its membership, whether the flank falls, the set, and the flank.
    zero
        Zeros.
    """

    def counted(cut, height, falls):
        below = height < cut
        return select(falls, 1 - below, below)

    return scatter(each(counted, gather(cuts, term), heights, falling), flank, zero)


def _area(width, left, right):
    return width * (left + right) / 2


def _moment(a, b, left, right):
    return (b - a) * (a * (2 * left + right) + b * (left + 2 * right)) / 6


class Point(NamedTuple):
    """A point where a set crosses its strength, between two neighbouring places of the grid."""

    place: Any
    top: Any
    """The union there."""
    left: Any
    left_top: Any
    right: Any
    right_top: Any
    """The places of the grid on both sides, and the union there."""


_POINTS = {
    "exists": _numbers("points"), "left": _numbers("points"), "right": _numbers("points"), "start": _numbers("points"),
    "run": _numbers("points"), "own": index("points", into="terms"), "left_heights": _numbers("pairs"),
    "right_heights": _numbers("pairs"), "pair_point": index("pairs", into="points"),
    "pair_term": index("pairs", into="terms"), "same": _shared("pairs"), "ends": index("points", into="pairs"),
}  # fmt: skip


def _points(
    cuts, exists, left, right, start, run, own, left_heights, right_heights, pair_point, pair_term, same, ends
):  # fmt: skip
    """Return the rows of points where sets cross their strengths."""
    places = each(lambda a, height, slope, cut: a + (cut - height) * slope, left, start, run, gather(cuts, own))
    ends_of_cells = each(lambda a, b, p: (a, (p - a) / (b - a)), left, right, places)

    def tops(found, cell, cut, a, b, continues):
        heights = a, a + (b - a) * cell[1], b
        return tuple(
            ga.maximum(continues * top, ga.minimum(cut, height)) for top, height in zip(found, heights, strict=True)
        )

    rows = scan(
        tops, (0, 0, 0), gather(ends_of_cells, pair_point), gather(cuts, pair_term), left_heights, right_heights, same
    )

    def point(place, a, b, cut, present, top):
        return Point(place, ga.maximum(top[1], present * cut), a, top[0], b, top[2])

    return each(point, places, left, right, gather(cuts, own), exists, gather(rows, ends))


@kernel(cuts=_numbers("terms"), **_POINTS, returns=(_numbers("points"),) * 4)
def crossing_points(
    cuts, exists, left, right, start, run, own, left_heights, right_heights, pair_point, pair_term, same, ends
):  # fmt: skip
    """Compute the points where sets cross their strengths, and the union there.

    Parameters
    ----------
    cuts
        The strengths of the sets.
    exists
        Whether a flank of a set crosses its strength; otherwise `run` is 0.
    left, right
        The places of the grid on both sides.
    start, run
        The membership at the left place, and the inverse of the slope.
    own
        The set of each point.
    left_heights, right_heights, pair_point, pair_term
        For each pair of a point and a set, the memberships of the places on both sides.
    same
        Whether the previous pair is of the same point.
    ends
        The last pair of each point.

    Returns
    -------
    places, tops
        The points, and the union there.
    left_tops, right_tops
        The union at the places on both sides.
    """
    points = _points(
        cuts, exists, left, right, start, run, own, left_heights, right_heights, pair_point, pair_term, same, ends
    )  # fmt: skip
    return points.place, points.top, points.left_top, points.right_top


@kernel(
    cuts=_numbers("terms"), samples=_shared("samples", len(Sample._fields)), term=index("samples", into="terms"),
    scaled=SCALAR, returns=(SCALAR, SCALAR),
)  # fmt: skip
def area_on_grid(cuts, samples, term, scaled):
    """Compute the area and the first moment of a union that is linear between the places of a grid.

    Parameters
    ----------
    cuts
        The strengths of the sets.
    samples, term
        Memberships of the places, and their sets.
    scaled
        Whether sets are multiplied by their strengths and not clipped.
    """

    def add(sums, cut, row):
        sample = Sample(*row)
        top, area, moment = sums
        top = ga.maximum(sample.same * top, select(scaled, cut * sample.height, ga.minimum(cut, sample.height)))
        return top, area + sample.area * top, moment + sample.moment * top

    _, area, moment = fold(add, (0, 0, 0), gather(cuts, term), samples)
    return area, moment


@kernel(
    cuts=_numbers("terms"), **_POINTS, first=index("couples", into="points"), second=index("couples", into="points"),
    last=_shared("couples", 2), limit=SCALAR, returns=(SCALAR, SCALAR),
)  # fmt: skip
def area_by_points(
    cuts, exists, left, right, start, run, own, left_heights, right_heights, pair_point, pair_term, same, ends, first,
    second, last, limit,
):  # fmt: skip
    """Compute how much the points where sets cross their strengths add to the area and the first moment.

    Parameters
    ----------
    limit
        Only points count whose neighbour to the right on the grid is at most this place.
    first, second
        Each point with all points before it; a point comes with itself at the end.
    last
        Whether the couple is the first one of its point, and whether it is the last.
    """
    points = _points(
        cuts, exists, left, right, start, run, own, left_heights, right_heights, pair_point, pair_term, same, ends
    )  # fmt: skip

    def insert(found, row, other, flags):
        opens, closes = flags
        p, q = Point(*row), Point(*other)
        a, a_top, b, b_top, area, moment = found
        a, a_top = select(opens, p.left, a), select(opens, p.left_top, a_top)
        b, b_top = select(opens, p.right, b), select(opens, p.right_top, b_top)
        inside = 1 - closes
        before = inside * (q.place >= a) * (q.place <= p.place)
        after = inside * (q.place <= b) * (q.place > p.place)
        a, a_top = select(before, q.place, a), select(before, q.top, a_top)
        b, b_top = select(after, q.place, b), select(after, q.top, b_top)
        more = _area(p.place - a, a_top, p.top) + _area(b - p.place, p.top, b_top) - _area(b - a, a_top, b_top)
        turn = _moment(a, p.place, a_top, p.top) + _moment(p.place, b, p.top, b_top) - _moment(a, b, a_top, b_top)
        counts = closes * (p.right <= limit)
        return a, a_top, b, b_top, area + counts * more, moment + counts * turn

    found = fold(insert, (0,) * 6, gather(points, first), gather(points, second), last)
    return found[4], found[5]


@kernel(
    cuts=_numbers("terms"), samples=_shared("samples", 4), term=index("samples", into="terms"), scaled=SCALAR,
    target=SCALAR, returns=(SCALAR, SCALAR, SCALAR, SCALAR),
)  # fmt: skip
def place_of_area(cuts, samples, term, scaled, target):
    """Find the interval of the grid in which the area of a union reaches a target.

    Parameters
    ----------
    cuts
        The strengths of the sets.
    samples, term
        Memberships of the places, whether the previous sample is of the same place, whether this is the last sample of
        the place, and the width of the interval to its left; and their sets.
    scaled
        Whether sets are multiplied by their strengths and not clipped.
    target
        The area.

    Returns
    -------
    place
        The index of the right end of the interval, or -1.
    before
        The area to the left of the interval.
    left_top, right_top
        The union at its ends.
    """

    def add(found, cut, row):
        height, same, closes, width = row
        top, previous, area, number, place, before, left_top, right_top = found
        top = ga.maximum(same * top, select(scaled, cut * height, ga.minimum(cut, height)))
        whole = area + closes * _area(width, previous, top)
        hit = closes * (width > 0) * (place < 0) * (whole >= target)
        return (
            top, select(closes, top, previous), whole, number + closes, select(hit, number, place),
            select(hit, area, before), select(hit, previous, left_top), select(hit, top, right_top),
        )  # fmt: skip

    return fold(add, (0, 0, 0, 0, -1, 0, 0, 0), gather(cuts, term), samples)[4:]


@kernel(
    cuts=_numbers("terms"), samples=_shared("samples", 4), term=index("samples", into="terms"),
    peaks=_shared("terms"), places=_numbers("points"), tops=_numbers("points"), left=_numbers("points"),
    right=_numbers("points"), left_tops=_numbers("points"), right_tops=_numbers("points"),
    first=index("couples", into="points"), second=index("couples", into="points"),
    last=_shared("couples", 2), scaled=SCALAR, tolerance=SCALAR, returns=(SCALAR, SCALAR, SCALAR),
)  # fmt: skip
def places_of_maximum(
    cuts, samples, term, peaks, places, tops, left, right, left_tops, right_tops, first, second, last, scaled, tolerance
):  # fmt: skip
    """Compute the mean, the least and the greatest of the places and points where a union has its maximum.

    Parameters
    ----------
    cuts
        The strengths of the sets.
    samples, term
        Memberships of the places, whether the previous sample is of the same place, whether this is the last sample of
        the place, and the place; and their sets.
    peaks
        The largest membership of each set.
    places, tops, left, right, left_tops, right_tops
        The points where sets cross their strengths, the union there, and the same for the places of the grid on both
        sides.
    first, second, last
        As for `area_by_points`.
    scaled
        Whether sets are multiplied by their strengths and not clipped.
    tolerance
        Distance up to which points count as one.
    """

    def clipped(cut, height):
        return select(scaled, cut * height, ga.minimum(cut, height))

    highest = fold(lambda most, cut, peak: ga.maximum(most, clipped(cut, peak)), 0, cuts, peaks)

    def add(found, cut, row):
        height, same, closes, place = row
        top, count, sum, least, greatest = found
        top = ga.maximum(same * top, clipped(cut, height))
        hit = closes * (top >= highest)
        least = select(hit, ga.minimum(least, place), least)
        return top, count + hit, sum + hit * place, least, select(hit, ga.maximum(greatest, place), greatest)

    _, *on_grid = fold(add, (0, 0, 0, FAR, -FAR), gather(cuts, term), samples)
    points = each(lambda *row: row, places, tops, left, right, left_tops, right_tops)

    def insert(found, row, other, flags):
        opens, closes = flags
        place, top, a, b, a_top, b_top = row
        alone, count, sum, least, greatest = found
        alone = select(opens, 1, alone)
        alone = select((1 - closes) * (ga.absolute(place - other[0]) <= tolerance), 0, alone)
        known = (place - a <= tolerance) * (a_top >= highest) + (b - place <= tolerance) * (b_top >= highest)
        hit = closes * alone * (top >= highest) * (known < 1)
        least = select(hit, ga.minimum(least, place), least)
        return alone, count + hit, sum + hit * place, least, select(hit, ga.maximum(greatest, place), greatest)

    _, count, sum, least, greatest = fold(insert, (1, *on_grid), gather(points, first), gather(points, second), last)
    return sum / count, least, greatest
