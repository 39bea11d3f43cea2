"""Fuzzy inference: strengths of rules, numbers for unions of clipped sets (Mamdani), and means of functions (Sugeno).

A set is given by its membership at the places of a grid, and is linear between them. Rule bases are data. The
conditions of rules are a program for an accumulator and a stack: each step has a literal, which is the membership of an
input in a set or one minus it. The steps for a set of an output end with its strength, the largest weighted strength of
the rules that conclude it.

The union of the clipped sets of an output is taken at the places of the grid, and at the points where a set crosses its
strength, and is linear between them. A set has at most two such points, as memberships rise and then fall: one on its
rising flank and one on its falling flank. As a function of the strength, such a point is a sum of ramps, one for each
linear piece of the flank, so that it is computed without a search. If a flank does not reach the strength, the point is
an end of the flank, which is a place of the grid and changes nothing.

Coordinates of outputs are in units of the grid: the places are 0, 1, 2 and so on. All kernels are in one file because a
module is generated from one spec.
"""

from typing import Any, NamedTuple

import gacompiler as ga
from gacompiler import SCALAR, array, each, fold, gather, index, kernel, scan, select, total, transpose, vjp

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


def _lesser(a, b):
    """Return the smaller of two finite numbers; `minimum` also passes on NaN, which takes three times as long."""
    return select(a < b, a, b)


def _greater(a, b):
    return select(a > b, a, b)


def _shared(length, *shape):
    return array(SCALAR, length, *shape, shared=True)


def _numbers(length):
    return array(SCALAR, length)


@kernel(
    x=_numbers("inputs"), ranges=_shared("inputs", 5), returns=(_numbers("inputs"), _numbers("inputs"), SCALAR),
)  # fmt: skip
def rows_of_inputs(x, ranges):
    """Replace inputs by the nearest ones in their ranges, and find their rows in a table of all places of all inputs.

    Parameters
    ----------
    x
        Inputs; NaN counts as the lower end of the range.
    ranges
        For each input, the ends of the range, the number of places per unit, and the first and the last row.

    Returns
    -------
    clipped
        The inputs in the ranges.
    rows
        Numbers whose integral parts are the rows of the places below.
    inside
        Whether all inputs were in their ranges.
    """

    def row(value, numbers):
        low, high, scale, first, last = numbers
        clipped = select(value > low, _lesser(value, high), low)
        return clipped, _lesser((clipped - low) * scale + first, last), (value >= low) * (value <= high)

    found = each(row, x, ranges)
    inside = fold(lambda all, one: all * one[2], 1, found)
    return each(lambda one: one[0], found), each(lambda one: one[1], found), inside


@kernel(
    x=_numbers("inputs"), rows=array(SCALAR, "rows", 2), place=index("inputs", into="rows"),
    member=index("sets", into="rows"), variable=index("sets", into="inputs"), literal=index("steps", into="sets"),
    program=_shared("steps", len(Step._fields)), ends=index("terms", into="steps"), returns=_numbers("terms"),
)  # fmt: skip
def strengths(x, rows, place, member, variable, literal, program, ends):
    """Compute the strengths that a program ends with.

    Parameters
    ----------
    x
        The inputs.
    rows
        For each input, the place of the grid below it, and for each set the membership of this place and the slope of
        the membership above it.
    place
        For each input, the row of its place.
    member, variable
        For each set of the inputs, its row and its input.
    literal
        For each step, the set of its literal.
    program
        The steps.
    ends
        The step after which each strength is the first element of the stack.
    """
    offsets = each(lambda value, row: value - row[0], x, gather(rows, place))
    members = each(lambda row, offset: row[0] + row[1] * offset, gather(rows, member), gather(offsets, variable))

    def run(stack, member, row):
        step = Step(*row)
        first, second = stack[0], select(step.pop, stack[1], step.plus + step.sign * member)
        found = (
            step.load * second + step.least * _lesser(first, second) + step.greatest * _greater(first, second)
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


strengths_vjp_x = vjp(strengths, "x")

_MEANS = {
    "strengths": _numbers("rules"), "x": _numbers("inputs"), "constants": _shared("rules"),
    "slopes": _shared("rules", "inputs"),
}  # fmt: skip


def _shares(strengths):
    """Return the largest of some strengths, and shares by which all are weighted, with the sum 1 or 0."""
    highest = fold(_greater, 0, strengths)
    # Quotients by the largest strength neither underflow nor lose digits if all strengths are tiny.
    quotients = each(lambda own: own / select(highest > 0, highest, 1), strengths)
    sum = total(lambda own: own, quotients)
    return highest, each(lambda own: own / select(sum > 0, sum, 1), quotients)


def _functions(x, constants, slopes):
    def function(constant, row):
        return constant + total(lambda slope, value: slope * value, row, x)

    return each(function, constants, slopes)


def _mean(shares, functions):
    # A rule that does not fire changes nothing, even if its function overflows.
    return total(lambda share, value: select(share > 0, share * value, 0), shares, functions)


@kernel(**_MEANS, returns=(SCALAR, SCALAR))
def mean_of_functions(strengths, x, constants, slopes):
    """Compute the mean of affine functions of the inputs, weighted by the strengths of rules.

    Parameters
    ----------
    strengths
        The weighted strength of each rule.
    x
        The inputs.
    constants, slopes
        For each rule, the value of its function where all inputs are 0, and its derivative with respect to each input.

    Returns
    -------
    mean
        0 if all strengths are 0.
    highest
        The largest strength.
    """
    highest, shares = _shares(strengths)
    return _mean(shares, _functions(x, constants, slopes)), highest


@kernel(**_MEANS, returns=(_numbers("rules"), _numbers("inputs")))
def slopes_of_mean(strengths, x, constants, slopes):
    """Compute the derivatives of `mean_of_functions` with respect to the strengths and to the inputs.

    Parameters
    ----------
    strengths, x, constants, slopes
        As for `mean_of_functions`.

    Returns
    -------
    by_strength, by_input
        0 if all strengths are 0.
    """
    _, shares = _shares(strengths)
    values, sum = _functions(x, constants, slopes), total(lambda own: own, strengths)
    mean, divisor = _mean(shares, values), select(sum > 0, sum, 1)
    by_strength = each(lambda value: select(sum > 0, (value - mean) / divisor, 0), values)
    by_input = each(lambda column: total(lambda share, slope: share * slope, shares, column), transpose(slopes))
    return by_strength, by_input


_RAMPS = {
    "ramps": _shared("ramps", 3), "term": index("ramps", into="terms"), "start": index("points", into="ramps"),
    "end": index("points", into="ramps"), "flanks": _shared("points", 4),
}  # fmt: skip


class Flank(NamedTuple):
    """The rising or the falling flank of a set."""

    low: Any
    high: Any
    """The memberships at its ends."""
    base: Any
    """The place of its lower end."""
    least: Any
    """The largest distance at which a point coincides with the lower end."""


def _crossings(levels, ramps, term, start, end, flanks):
    """Return the points where sets cross levels, from sums of ramps over all flanks."""

    def add(sum, level, ramp):
        height, rise, run = ramp
        return sum + _lesser(_greater(level - height, 0), rise) * run

    def point(row, before, after):
        flank, offset = Flank(*row), after - before
        return flank.base + select(ga.absolute(offset) > flank.least, offset, 0)

    sums = scan(add, 0, gather(levels, term), ramps)
    return each(point, flanks, gather(sums, start), gather(sums, end))


@kernel(cuts=_numbers("terms"), **_RAMPS, returns=_numbers("points"))
def crossing_points(cuts, ramps, term, start, end, flanks):
    """Compute the points where sets cross their strengths: those of all rising flanks, and of all falling ones.

    Parameters
    ----------
    cuts
        The strengths of the sets.
    ramps, term
        For each linear piece of a flank, in the order of its heights, the least height, the rise, and the width divided
        by the rise, which is negative on falling flanks; and the set.
    start, end
        For each point, the ramp before the first one of its flank, and the last one.
    flanks
        For each point, its flank.
    """
    return _crossings(cuts, ramps, term, start, end, flanks)


def _clipped(scaled, cut, height):
    return select(scaled, cut * height, _lesser(cut, height))


def _heights(cuts, peaks, scaled):
    """Return the largest memberships of clipped sets, and the largest one of their union."""
    heights = each(lambda cut, peak: _clipped(scaled, cut, peak), cuts, peaks)
    return heights, fold(_greater, 0, heights)


@kernel(
    cuts=_numbers("terms"), peaks=_shared("terms"), scaled=SCALAR, **_RAMPS, left=index("terms", into="points"),
    right=index("terms", into="points"), returns=(SCALAR, SCALAR, SCALAR),
)  # fmt: skip
def ends_of_maximum(cuts, peaks, scaled, ramps, term, start, end, flanks, left, right):
    """Compute the maximum of a union, and the least and the greatest of the points where it is reached.

    Parameters
    ----------
    cuts
        The strengths of the sets.
    peaks
        The largest membership of each set.
    scaled
        Whether sets are multiplied by their strengths and not clipped.
    ramps, term, start, end, flanks
        As for `crossing_points`.
    left, right
        For each set, the points of its rising and of its falling flank.
    """
    levels = each(lambda cut, peak: select(scaled, peak, cut), cuts, peaks)
    points = _crossings(levels, ramps, term, start, end, flanks)
    heights, highest = _heights(cuts, peaks, scaled)

    def widen(found, height, a, b):
        least, greatest = found
        hit = height >= highest
        return select(hit, _lesser(least, a), least), select(hit, _greater(greatest, b), greatest)

    least, greatest = fold(widen, (FAR, -FAR), heights, gather(points, left), gather(points, right))
    return highest, least, greatest


@kernel(
    cuts=_numbers("terms"), peaks=_shared("terms"), scaled=SCALAR, tolerance=SCALAR, points=_numbers("points"),
    grid=_numbers("points"), left=index("terms", into="points"), right=index("terms", into="points"),
    turn_term=index("turns", into="terms"), turn_flags=_shared("turns", 2), cover_point=index("covers", into="points"),
    cover_term=index("covers", into="terms"), same=_shared("covers"), ends=index("points", into="covers"),
    first=index("couples", into="points"), second=index("couples", into="points"), last=_shared("couples", 2),
    returns=(SCALAR, SCALAR),
)  # fmt: skip
def mean_of_maximum(
    cuts, peaks, scaled, tolerance, points, grid, left, right, turn_term, turn_flags, cover_point, cover_term, same,
    ends, first, second, last,
):  # fmt: skip
    """Compute the maximum of a union, and the mean of the places and points where it is reached.

    Parameters
    ----------
    cuts, peaks, scaled
        As for `ends_of_maximum`.
    tolerance
        Distance up to which points count as one.
    points
        The points where sets cross their strengths, or where their peaks end if they are scaled.
    grid
        The nearest places of the grid to the right of the points of rising flanks, and to the left of the others.
    left, right
        For each set, the points of its rising and of its falling flank.
    turn_term, turn_flags
        As many turns as there are sets, each with all sets; whether a row opens its turn, and whether it closes it.
    cover_point, cover_term, same, ends
        Each point with all sets; whether the previous row is of the same point, and the last row of each point.
    first, second, last
        Each point with all points before it, and with itself at the end; whether the couple is the first one of its
        point, and whether it is the last.
    """
    heights, highest = _heights(cuts, peaks, scaled)

    def interval(height, a, b, first_place, last_place):
        hit = height >= highest
        return (
            select(hit, a - tolerance, FAR), select(hit, b + tolerance, -FAR),
            select(hit, first_place, FAR), select(hit, last_place, -FAR),
        )  # fmt: skip

    intervals = each(
        interval, heights, gather(points, left), gather(points, right), gather(grid, left), gather(grid, right)
    )

    # The places of the grid in the union of the intervals: each turn adds those of the interval that begins first of
    # the intervals that are not yet covered.
    def sweep(found, interval, flags):
        covered, begin, end, count, sum = found
        opens, closes = flags
        begin, end = select(opens, FAR, begin), select(opens, -FAR, end)
        nearer = (interval[3] > covered) * (interval[2] < begin)
        begin, end = select(nearer, interval[2], begin), select(nearer, interval[3], end)
        a = _greater(begin, covered + 1)
        adds = closes * (end > covered)
        more = select(adds, end - a + 1, 0)
        return select(adds, end, covered), begin, end, count + more, sum + select(adds, (a + end) / 2, 0) * more

    *_, count, sum = fold(sweep, (-1, FAR, -FAR, 0, 0), gather(intervals, turn_term), turn_flags)

    def cover(found, point, interval, continues):
        inside = (point >= interval[0]) * (point <= interval[1])
        return select(inside, 1, found * continues)

    covers = gather(scan(cover, 0, gather(points, cover_point), gather(intervals, cover_term), same), ends)
    off_grid = each(
        lambda cover, point, place: (point, cover * (ga.absolute(point - place) > tolerance)), covers, points, grid
    )

    def add(found, point, other, flags):
        alone, count, sum = found
        opens, closes = flags
        alone = select(opens, 1, alone)
        alone = select((1 - closes) * (ga.absolute(point[0] - other[0]) <= tolerance), 0, alone)
        hit = closes * alone * point[1]
        return alone, count + hit, sum + hit * point[0]

    _, count, sum = fold(add, (1, count, sum), gather(off_grid, first), gather(off_grid, second), last)
    return highest, sum / count


class Sample(NamedTuple):
    """The memberships of one place of the grid of an output in two sets."""

    height: Any
    other: Any
    same: Any
    """Whether the previous row is of the same place."""
    area: Any
    """The weight of the place in the area, and 0 unless this is the last row of the place."""
    moment: Any
    """The same for the first moment."""


_GRID = {
    "samples": _shared("samples", len(Sample._fields)), "term": index("samples", into="terms"),
    "other": index("samples", into="terms"), "scaled": SCALAR,
}  # fmt: skip


def _larger(scaled, cut, other_cut, sample):
    return _greater(_clipped(scaled, cut, sample.height), _clipped(scaled, other_cut, sample.other))


@kernel(cuts=_numbers("terms"), **_GRID, returns=(SCALAR, SCALAR))
def area_on_grid(cuts, samples, term, other, scaled):
    """Compute the area and the first moment of a union that is linear between the places of a grid.

    Parameters
    ----------
    cuts
        The strengths of the sets.
    samples, term, other
        Memberships of the places, and their sets.
    scaled
        Whether sets are multiplied by their strengths and not clipped.
    """

    def add(sums, cut, other_cut, row):
        sample = Sample(*row)
        top, area, moment = sums
        top = _greater(sample.same * top, _larger(scaled, cut, other_cut, sample))
        return top, area + sample.area * top, moment + sample.moment * top

    _, area, moment = fold(add, (0, 0, 0), gather(cuts, term), gather(cuts, other), samples)
    return area, moment


@kernel(
    cuts=_numbers("terms"), **_GRID, ends=index("places", into="samples"), final=index("one", into="samples"),
    returns=(SCALAR,) * 5,
)  # fmt: skip
def half_on_grid(cuts, samples, term, other, scaled, ends, final):
    """Find the interval of the grid in which a union that is linear between the places reaches half of its area.

    Parameters
    ----------
    cuts, term, other, scaled
        As for `area_on_grid`.
    samples
        As for `area_on_grid`, with areas of half an interval for the first place, and of an interval for the others.
    ends
        The last row of each place.
    final
        The last row.

    Returns
    -------
    place
        The left end of the interval.
    before
        The area to the left of the interval.
    left_top, right_top
        The union at its ends.
    area
        The whole area.
    """

    def add(sums, cut, other_cut, row):
        sample = Sample(*row)
        top, area = sums
        top = _greater(sample.same * top, _larger(scaled, cut, other_cut, sample))
        return top, area + sample.area * top

    sums = scan(add, (0, 0), gather(cuts, term), gather(cuts, other), samples)
    whole = fold(lambda _, row: row[1] - row[0] / 2, 0, gather(sums, final))
    half = whole / 2

    def advance(found, row):
        top, area = row
        # The sum up to a place includes half an interval to its right.
        area = area - top / 2
        place, before, left_top, right_top, below = found
        right_top = select(below, top, right_top)
        below = select(area < half, below, 0)
        return place + below, select(below, area, before), select(below, top, left_top), right_top, below

    place, before, left_top, right_top, _ = fold(advance, (-1, 0, 0, 0, 1), gather(sums, ends))
    return place, before, left_top, right_top, whole


def _area(width, left, right):
    return width * (left + right) / 2


def _moment(a, b, left, right):
    return (b - a) * (a * (2 * left + right) + b * (left + 2 * right)) / 6


class Point(NamedTuple):
    """A point where a set crosses its strength."""

    place: Any
    top: Any
    """The union there."""
    left: Any
    """The place of the grid to the left."""
    left_top: Any
    right_top: Any
    """The union at the places of the grid on both sides."""


_POINTS = {
    "points": _numbers("points"), "cells": _numbers("points"), "left_heights": _numbers("pairs"),
    "right_heights": _numbers("pairs"), "pair_point": index("pairs", into="points"),
    "pair_term": index("pairs", into="terms"), "same": _shared("pairs"), "ends": index("points", into="pairs"),
    "own": index("points", into="terms"), "flanks": _shared("points", 4), "first": index("couples", into="points"),
    "second": index("couples", into="points"), "flags": _shared("couples", 2), "final": index("points", into="couples"),
}  # fmt: skip


def _points(cuts, points, cells, left_heights, right_heights, pair_point, pair_term, same, ends, own, flanks):
    """Return the rows of points where sets cross their strengths."""

    def tops(found, point, cell, cut, a, b, continues):
        heights = a, a + (b - a) * (point - cell), b
        return tuple(
            _greater(continues * top, _lesser(cut, height)) for top, height in zip(found, heights, strict=True)
        )

    rows = scan(
        tops, (0, 0, 0), gather(points, pair_point), gather(cells, pair_point), gather(cuts, pair_term), left_heights,
        right_heights, same,
    )  # fmt: skip

    # Near the foot of a flank, the membership at the point has larger rounding errors than the strength.
    def point(place, left, top, cut, row):
        flank = Flank(*row)
        exists = (ga.absolute(place - flank.base) > 0) * (cut > flank.low) * (cut <= flank.high)
        return Point(place, select(exists, _greater(top[1], cut), top[1]), left, top[0], top[2])

    return each(point, points, cells, gather(rows, ends), gather(cuts, own), flanks)


def _insertions(rows, first, second, flags, final):
    """Return the points with their neighbours among the points before them and the places of the grid."""

    def narrow(found, row, other, flags):
        opens, differs = flags
        p, q = Point(*row), Point(*other)
        a, a_top, b, b_top = found
        a, a_top = select(opens, p.left, a), select(opens, p.left_top, a_top)
        b, b_top = select(opens, p.left + 1, b), select(opens, p.right_top, b_top)
        before = differs * (q.place >= a) * (q.place <= p.place)
        after = differs * (q.place <= b) * (q.place > p.place)
        a, a_top = select(before, q.place, a), select(before, q.top, a_top)
        b, b_top = select(after, q.place, b), select(after, q.top, b_top)
        return a, a_top, b, b_top

    found = scan(narrow, (0,) * 4, gather(rows, first), gather(rows, second), flags)
    return rows, gather(found, final)


def _more(p, a, a_top, b, b_top):
    return _area(p.place - a, a_top, p.top) + _area(b - p.place, p.top, b_top) - _area(b - a, a_top, b_top)


@kernel(cuts=_numbers("terms"), **_POINTS, returns=(SCALAR, SCALAR))
def area_by_points(
    cuts, points, cells, left_heights, right_heights, pair_point, pair_term, same, ends, own, flanks, first, second,
    flags, final,
):  # fmt: skip
    """Compute how much the points where sets cross their strengths add to the area and the first moment.

    Parameters
    ----------
    cuts
        The strengths of the sets.
    points, cells
        The points, and the places of the grid to the left.
    left_heights, right_heights, pair_point, pair_term
        For each pair of a point and a set, the memberships of the places on both sides.
    same, ends
        Whether the previous pair is of the same point, and the last pair of each point.
    own, flanks
        The set and the flank of each point.
    first, second, flags, final
        Each point with all points before it, and the first point with itself; whether the couple is the first one of
        its point, and whether the points differ; and the last couple of each point.
    """
    rows = _points(cuts, points, cells, left_heights, right_heights, pair_point, pair_term, same, ends, own, flanks)

    def insert(found, row, neighbours):
        area, moment = found
        p, (a, a_top, b, b_top) = Point(*row), neighbours
        turn = (
            _moment(a, p.place, a_top, p.top) + _moment(p.place, b, p.top, b_top) - _moment(a, b, a_top, b_top)
        )  # fmt: skip
        return area + _more(p, *neighbours), moment + turn

    return fold(insert, (0, 0), *_insertions(rows, first, second, flags, final))


@kernel(
    cuts=_numbers("terms"), **_POINTS, step_point=index("steps", into="points"), step_flags=_shared("steps", 2),
    place=SCALAR, before=SCALAR, left_top=SCALAR, right_top=SCALAR, area=SCALAR, returns=(SCALAR, SCALAR),
)  # fmt: skip
def bisector(
    cuts, points, cells, left_heights, right_heights, pair_point, pair_term, same, ends, own, flanks, first, second,
    flags, final, step_point, step_flags, place, before, left_top, right_top, area,
):  # fmt: skip
    """Compute the point that divides the area of a union into halves.

    Parameters
    ----------
    cuts, points, cells, left_heights, right_heights, pair_point, pair_term, same, ends, own, flanks
        As for `area_by_points`.
    first, second, flags, final
        As for `area_by_points`.
    step_point, step_flags
        One step more than there may be points in the interval, each with all points; whether a row opens its step, and
        whether it closes it.
    place, before, left_top, right_top, area
        An interval of the grid and the area to its left, the union at its ends, and the whole area, all without the
        points.

    Returns
    -------
    bisector
    found
        Whether it is in the interval, and the steps were enough.
    """
    rows = _points(cuts, points, cells, left_heights, right_heights, pair_point, pair_term, same, ends, own, flanks)

    def insert(found, row, neighbours):
        left, whole = found
        p = Point(*row)
        more = _more(p, *neighbours)
        return left + select(p.left < place, more, 0), whole + more

    left, whole = fold(insert, (0, 0), *_insertions(rows, first, second, flags, final))
    rest = (area + whole) / 2 - before - left

    # Each step goes to the next point in the interval, or to its right end.
    def walk(found, row, flags):
        at, top, rest, done, following, following_top = found
        opens, closes = flags
        p = Point(*row)
        following, following_top = select(opens, place + 1, following), select(opens, right_top, following_top)
        nearer = (p.place > at) * (p.place < following)
        following, following_top = select(nearer, p.place, following), select(nearer, p.top, following_top)
        width = following - at
        piece = _area(width, top, following_top)
        done = select(closes * (piece >= rest), 1, done)
        moves = closes * (1 - done)
        return (
            select(moves, following, at), select(moves, following_top, top), select(moves, rest - piece, rest), done,
            following, following_top,
        )  # fmt: skip

    at, top, rest, done, following, following_top = fold(
        walk, (place, left_top, rest, 0, place + 1, right_top), gather(rows, step_point), step_flags
    )
    width, rise = following - at, following_top - top
    root = ga.sqrt(_greater(top * top + 2 * select(width > 0, rise / select(width > 0, width, 1), 0) * rest, 0))
    divisor = top + root
    return at + 2 * rest / select(divisor > 0, divisor, 1), done * (rest >= 0)
