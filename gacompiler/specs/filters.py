"""Filters of signals and images.

The input of a filter of one result at a time is its window: views of one array, each shifted by one place, so that
nothing is copied.
"""

from gacompiler import SCALAR, array, each, kernel, total, window

REACH = 10
WIDTH = 2 * REACH + 1
PAIR = array(SCALAR, 2)


def _sum(weights, numbers):
    total = weights[0] * numbers[0]
    for weight, number in zip(weights[1:], numbers[1:], strict=True):
        total = total + weight * number
    return total


def _even(window):
    """Return the middle number, and the sums of the numbers before and after it."""
    return [window[REACH], *(window[REACH - k] + window[REACH + k] for k in range(1, REACH + 1))]


@kernel(image=array(SCALAR, "n", "m"), taps=array(SCALAR, REACH + 1))
def smoothed(image, taps):
    """Filter an image along both axes with symmetric taps, given from the middle one on; its edges are mirrored."""

    def filtered(*numbers):
        return _sum(taps, _even(numbers))

    low = each(lambda *rows: each(filtered, *rows), *window(image, WIDTH))
    return each(lambda row: each(filtered, *window(row, WIDTH)), low)


def _split(window, taps):
    return tuple(_sum(row, window) for row in taps)


def _merged(low, high, taps):
    return tuple(_sum(row[0], low) + _sum(row[1], high) for row in taps)


@kernel(window=array(SCALAR, 2), taps=array(SCALAR, 2, 2), returns=PAIR)
def split_2(window, taps):
    """Apply two filters of 2 taps."""
    return _split(window, taps)


@kernel(window=array(SCALAR, 4), taps=array(SCALAR, 2, 4), returns=PAIR)
def split_4(window, taps):
    """Apply two filters of 4 taps."""
    return _split(window, taps)


@kernel(window=array(SCALAR, 6), taps=array(SCALAR, 2, 6), returns=PAIR)
def split_6(window, taps):
    """Apply two filters of 6 taps."""
    return _split(window, taps)


@kernel(window=array(SCALAR, 8), taps=array(SCALAR, 2, 8), returns=PAIR)
def split_8(window, taps):
    """Apply two filters of 8 taps."""
    return _split(window, taps)


@kernel(sums=PAIR, window=array(SCALAR, 8), taps=array(SCALAR, 2, 8), returns=PAIR)
def split_8_more(sums, window, taps):
    """Add eight more taps of two filters to their sums."""
    first, second = _split(window, taps)
    return sums[0] + first, sums[1] + second


@kernel(low=array(SCALAR, 1), high=array(SCALAR, 1), taps=array(SCALAR, 2, 2, 1), returns=PAIR)
def merge_1(low, high, taps):
    """Compute two adjacent samples of the sum of two bands, each filtered by every other one of 2 taps."""
    return _merged(low, high, taps)


@kernel(low=array(SCALAR, 2), high=array(SCALAR, 2), taps=array(SCALAR, 2, 2, 2), returns=PAIR)
def merge_2(low, high, taps):
    """Compute two adjacent samples of the sum of two bands, each filtered by every other one of 4 taps."""
    return _merged(low, high, taps)


@kernel(low=array(SCALAR, 3), high=array(SCALAR, 3), taps=array(SCALAR, 2, 2, 3), returns=PAIR)
def merge_3(low, high, taps):
    """Compute two adjacent samples of the sum of two bands, each filtered by every other one of 6 taps."""
    return _merged(low, high, taps)


@kernel(low=array(SCALAR, 4), high=array(SCALAR, 4), taps=array(SCALAR, 2, 2, 4), returns=PAIR)
def merge_4(low, high, taps):
    """Compute two adjacent samples of the sum of two bands, each filtered by every other one of 8 taps."""
    return _merged(low, high, taps)


@kernel(sums=PAIR, low=array(SCALAR, 4), high=array(SCALAR, 4), taps=array(SCALAR, 2, 2, 4), returns=PAIR)
def merge_4_more(sums, low, high, taps):
    """Add four more numbers of each band to the sums."""
    first, second = _merged(low, high, taps)
    return sums[0] + first, sums[1] + second


LINE = array(SCALAR, "n")
RESULTS = array(SCALAR, "m")


@kernel(signal=LINE)
def energy(signal):
    """Compute the sum of squares of the samples."""
    return total(lambda sample: sample * sample, signal)


def _both(rows, taps):
    """Return two filtered arrays from arrays of neighbouring samples."""
    return each(lambda *samples: each(lambda *numbers: _split(numbers, taps), *samples), *rows)


@kernel(signal=array(SCALAR, "n", "k"), taps=array(SCALAR, 2, 8), results=array(SCALAR, "m", "k"))
def filter_rows(signal, taps, results):
    """Apply two filters of 8 taps along the first axis; of `results`, only the lengths matter.

    Numbers beyond the end are 0.
    """
    return _both(window(signal, range(8), boundary="constant", onto=results), taps)


@kernel(
    low=array(SCALAR, "m", "k"), high=array(SCALAR, "m", "k"), signal=array(SCALAR, "n", "k"),
    taps=array(SCALAR, 2, 8),
)  # fmt: skip
def filter_rows_more(low, high, signal, taps):
    """Add eight more taps of two filters to their results."""
    first, second = _both(window(signal, range(8), boundary="constant", onto=low), taps)

    def sums(old, new):
        return each(lambda before, more: each(lambda a, b: a + b, before, more), old, new)

    return sums(low, first), sums(high, second)


def _at_every_second(signal, taps, results):
    """Return a pair of filtered numbers for each of `results`, from eight numbers at every second place."""
    neighbours = window(signal, range(8), boundary="constant", stride=2, onto=results)
    return each(lambda *numbers: _split(numbers, taps), *neighbours)


def _between(low, high, taps, results):
    """Return a pair of samples for each of `results`, from four numbers of either band."""
    neighbours = (*window(low, range(4), boundary="constant", onto=results),)
    neighbours += (*window(high, range(4), boundary="constant", onto=results),)
    return each(lambda *numbers: _merged(numbers[:4], numbers[4:], taps), *neighbours)


@kernel(signal=LINE, taps=array(SCALAR, 2, 8), results=RESULTS)
def split_line(signal, taps, results):
    """Apply two filters of 8 taps at every second number; of `results`, only the length matters.

    Numbers beyond the end are 0.
    """
    return _at_every_second(signal, taps, results)


@kernel(low=RESULTS, high=RESULTS, signal=LINE, taps=array(SCALAR, 2, 8))
def split_line_more(low, high, signal, taps):
    """Add eight more taps of two filters to their results."""
    first, second = _at_every_second(signal, taps, low)
    return each(lambda a, b: a + b, low, first), each(lambda a, b: a + b, high, second)


@kernel(low=LINE, high=LINE, taps=array(SCALAR, 2, 2, 4), results=RESULTS, returns=array(SCALAR, "m", 2))
def merge_line(low, high, taps, results):
    """Compute pairs of adjacent samples from two bands, each filtered by every other one of 8 taps.

    Of `results`, only the length matters. Numbers beyond the end are 0.
    """
    return _between(low, high, taps, results)


@kernel(
    sums=array(SCALAR, "m", 2),
    low=LINE,
    high=LINE,
    taps=array(SCALAR, 2, 2, 4),
    returns=array(SCALAR, "m", 2),
)
def merge_line_more(sums, low, high, taps):
    """Add four more numbers of each band to the samples."""
    first, second = _between(low, high, taps, each(lambda pair: pair[0], sums))
    return each(lambda pair, a, b: (pair[0] + a, pair[1] + b), sums, first, second)
