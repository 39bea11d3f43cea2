"""Random sets of different items, and cells by which items that repeat others are found."""

from fractions import Fraction

from gacompiler import SCALAR, array, each, equal, floor, fold, kernel, maximum, minimum, select, total, transpose

LARGEST = 8
"""The largest number of items of a set."""
HALF = Fraction(1, 2)
VAST = 10**300
"""More than any coordinate."""


@kernel(shares=array(SCALAR, LARGEST), count=SCALAR, returns=array(SCALAR, LARGEST))
def different(shares, count):
    """Compute different numbers below a count, of which all sets are equally likely, and so are those of the first few.

    They are the first ones of a shuffle: the number in a random place is exchanged with the last one that remains.

    Parameters
    ----------
    shares
        Independent random numbers between 0 and 1; 1 is excluded.
    count
        If it is less than eight, only as many of the results are different.
    """
    places = [floor(share * (count - k)) for k, share in enumerate(shares)]
    found = []
    for k, place in enumerate(places):
        number = place
        for j in range(k - 1, -1, -1):
            number = select(equal(number, places[j]), count - 1 - j, number)
        found.append(number)
    return tuple(found)


def _extent(rows):
    """Return the largest extent of points along an axis."""

    def bounds(found, x):
        return minimum(found[0], x), maximum(found[1], x)

    def wider(largest, column):
        low, high = fold(bounds, (VAST, -VAST), column)
        return maximum(largest, high - low)

    return fold(wider, 0, transpose(rows))


@kernel(
    first=array(SCALAR, "n", "d"), second=array(SCALAR, "n", "e"), width=SCALAR,
    first_factors=array(SCALAR, "d"), second_factors=array(SCALAR, "e"), returns=array(SCALAR, "n", 4),
)  # fmt: skip
def cell_numbers(first, second, width, first_factors, second_factors):
    """Compute numbers of the cells of items on both sides, without a shift and with one of half a cell on each side.

    A number is the sum of the coordinates of both cells, each times a factor.

    Parameters
    ----------
    first, second
        The coordinates of both sides of the items.
    width
        The width of a cell on the second side; on the first, it is in relation to the extents of the items.
    first_factors, second_factors
        Factors of which no whole multiples cancel.
    """
    here, there = _extent(first), _extent(second)
    ratio = select(minimum(here, there) > 0, here / select(there > 0, there, 1), 1)

    def numbers(row, factors, scale):
        return total(lambda x, f: (f * floor(x * scale), f * floor(x * scale + HALF)), row, factors)

    def of(one, two):
        (a, b), (c, d) = numbers(one, first_factors, 1 / (width * ratio)), numbers(two, second_factors, 1 / width)
        return a + c, b + d, a + d, b + c

    return each(of, first, second)
