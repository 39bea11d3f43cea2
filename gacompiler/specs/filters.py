"""Filters of signals and images, one result at a time.

The numbers that a filter sees are a window: a shifted view of an array for each of its places, so that nothing is copied.
"""

from gacompiler import SCALAR, array, kernel

REACH = 10
WINDOW, HALF = array(SCALAR, 2 * REACH + 1), array(SCALAR, REACH + 1)


def _folded(window, sign):
    middle = len(window) // 2
    return [window[middle - k] + sign * window[middle + k] for k in range(1, middle + 1)]


def _sum(weights, numbers):
    total = weights[0] * numbers[0]
    for weight, number in zip(weights[1:], numbers[1:], strict=True):
        total = total + weight * number
    return total


def _half(taps, sign):
    """The middle tap and those after it, of the symmetric or antisymmetric part of taps."""
    return [taps[REACH], *((taps[REACH + k] + sign * taps[REACH - k]) / 2 for k in range(1, REACH + 1))]


@kernel(window=WINDOW, taps=WINDOW, returns=SCALAR)
def symmetric_filter(window, taps):
    """A filter with symmetric taps, of which the middle one and those after it are given."""
    return _sum(_half(taps, 1), [window[REACH], *_folded(window, 1)])


@kernel(window=WINDOW, taps=array(SCALAR, 3, 2*REACH + 1), returns=array(SCALAR, 3))
def three_filters(window, taps):
    both = [window[REACH], *_folded(window, 1)]
    even, odd, low = taps
    return _sum(_half(even, 1), both), _sum(_half(odd, -1)[1:], _folded(window, -1)), _sum(_half(low, 1), both)


@kernel(window=WINDOW, taps=array(SCALAR, 2, 2*REACH + 1), returns=array(SCALAR, 2))
def even_and_odd_filter(window, taps):
    even, odd = taps
    return _sum(_half(even, 1), [window[REACH], *_folded(window, 1)]), _sum(_half(odd, -1)[1:], _folded(window, -1))


def _pair(x, taps):
    return tuple(_sum(row, x) for row in taps)


@kernel(window=array(SCALAR, 2), taps=array(SCALAR, 2, 2), returns=array(SCALAR, 2))
def filter_pair_2(window, taps):
    return _pair(window, taps)


@kernel(window=array(SCALAR, 4), taps=array(SCALAR, 2, 4), returns=array(SCALAR, 2))
def filter_pair_4(window, taps):
    return _pair(window, taps)


@kernel(window=array(SCALAR, 6), taps=array(SCALAR, 2, 6), returns=array(SCALAR, 2))
def filter_pair_6(window, taps):
    return _pair(window, taps)


@kernel(window=array(SCALAR, 8), taps=array(SCALAR, 2, 8), returns=array(SCALAR, 2))
def filter_pair_8(window, taps):
    return _pair(window, taps)


@kernel(window=array(SCALAR, 10), taps=array(SCALAR, 2, 10), returns=array(SCALAR, 2))
def filter_pair_10(window, taps):
    return _pair(window, taps)


@kernel(sums=array(SCALAR, 2), window=array(SCALAR, 8), taps=array(SCALAR, 2, 8), returns=array(SCALAR, 2))
def filter_more(sums, window, taps):
    a, b = _pair(window, taps)
    return sums[0] + a, sums[1] + b


PAIR = array(SCALAR, 2)


@kernel(uv=PAIR, west=PAIR, east=PAIR, north=PAIR, south=PAIR, weights=array(SCALAR, 9), returns=PAIR)
def relaxed(uv, west, east, north, south, weights):
    x, y, xx, xy, yy, *weights = weights
    p, q = (sum((w * n for w, n in zip(weights, numbers, strict=True)), 0) for numbers in zip(west, east, north, south, strict=True))
    u, v = uv
    return xx * p + xy * q + x - 0.7 * u, xy * p + yy * q + y - 0.7 * v
