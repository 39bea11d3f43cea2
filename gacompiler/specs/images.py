"""Image operations: optical flow from the phases of complex bands, medians, interpolation.

The bands of a pixel are eight numbers: a quaternion, and the complex numbers of two waves, as computed by
`algorithms.wavelets`. Lengths are in pixels, phases in radians.
"""

import gacompiler as ga
from gacompiler import SCALAR, array, each, gather, index, kernel, window

BANDS, DERIVATIVES, EQUATIONS = array(SCALAR, 8), array(SCALAR, 4, 2), array(SCALAR, 6)
MOTION, SIDES, STEP = array(SCALAR, 2), array(SCALAR, 4), array(SCALAR, 10)
OVERRELAXATION = 1.7


def _change_of_phase(a, b):
    return ga.atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1])


def _planes(bands):
    """Return the complex bands of a quaternionic band and of two waves."""
    w, x, y, z, *waves = bands
    return (w + z, x - y), (w - z, x + y), tuple(waves[:2]), tuple(waves[2:])


@kernel(west=BANDS, east=BANDS, north=BANDS, south=BANDS, returns=DERIVATIVES)
def phase_derivatives(west, east, north, south):
    """Compute the derivatives of the phases of four complex bands with respect to x and y, in radians per pixel.

    They are half the phase difference between opposite neighbours of the pixel. The bands are a quaternion, which
    represents two complex numbers as in `quaternion.pack_two_sided`, and two further complex numbers, real parts first.
    """
    west, east, north, south = (_planes(bands) for bands in (west, east, north, south))
    return tuple((_change_of_phase(west[k], east[k]) / 2, _change_of_phase(north[k], south[k]) / 2) for k in range(4))


@kernel(first=BANDS, derivatives=DERIVATIVES, second=BANDS, floor=array(SCALAR, 4), returns=EQUATIONS)
def phase_equations(first, derivatives, second, floor):
    """Compute the weighted normal equations for the motion (u, v) between two images from four complex bands.

    Bands z of the first image and z' of the second one, and the derivatives k of the phases of z, are as in
    `phase_derivatives`; each band gives the equation ``k . (u, v) = -arg(z' / z)``. Results are sums of xx, xy and yy
    of the matrix, of the right-hand sides x and y, and of the squared change of phase, weighted by ``|z z'|``. Bands in
    which z or z' is smaller than `floor` or the change exceeds 2 have weight 0.
    """
    sums = (0,) * 6
    for a, b, gradient, least in zip(_planes(first), _planes(second), derivatives, floor, strict=True):
        angle = _change_of_phase(a, b)
        size, other = a[0] * a[0] + a[1] * a[1], b[0] * b[0] + b[1] * b[1]
        small = ga.minimum(size, other) < least * least
        weight = ga.select(small, 0, ga.select(ga.absolute(angle) <= 2, ga.sqrt(size * other), 0))
        x, y = weight * gradient[0], weight * gradient[1]
        terms = x * gradient[0], x * gradient[1], y * gradient[1], -x * angle, -y * angle, weight * angle * angle
        sums = tuple(before + term for before, term in zip(sums, terms, strict=True))
    return sums


@kernel(sums=EQUATIONS, ridge=SCALAR, returns=array(SCALAR, 3))
def solve_motion(sums, ridge):
    """Solve normal equations as in `phase_equations` for the motion u, v, with a confidence from 0 to 1.

    `ridge`, positive, is added to the diagonal, so that the motion is 0 without equations. With the smaller eigenvalue
    e of the matrix and the residual sum of squares r, the confidence is ``e / (e + r + ridge)``.
    """
    xx, xy, yy, x, y, square = sums
    half, across = (xx - yy) / 2, xy
    least = (xx + yy) / 2 - ga.sqrt(half * half + across * across)
    a, c = xx + ridge, yy + ridge
    determinant = a * c - xy * xy
    u, v = (c * x - xy * y) / determinant, (a * y - xy * x) / determinant
    least, left = ga.maximum(least, 0), ga.maximum(square - u * x - v * y, 0)
    return u, v, least / (least + left + ridge)


@kernel(
    sums=EQUATIONS,
    before=MOTION,
    motion=MOTION,
    west=MOTION,
    east=MOTION,
    north=MOTION,
    south=MOTION,
    stiffness=SIDES,
    noise=array(SCALAR, 3),
    returns=STEP,
)
def relaxation_step(sums, before, motion, west, east, north, south, stiffness, noise):
    """Compute the coefficients of `relaxed_motion` at a pixel: a step of iteratively reweighted least squares.

    `sums` are those of `phase_equations` for the increment of the motion `before`. Their weight is ``noise[0] / (1 +
    noise[1] r)`` with the squared residual r of the present motion; the weight of the difference d to a neighbour is
    ``stiffness / sqrt(1 + noise[2] |d|^2)``. If no weight is positive, the motion is 0.
    """
    xx, xy, yy, bx, by, square = sums
    u, v = motion[0] - before[0], motion[1] - before[1]
    left = square - 2 * (bx * u + by * v) + xx * u * u + 2 * xy * u * v + yy * v * v
    weight = noise[0] / (1 + noise[1] * ga.maximum(left, 0))
    sides = []
    for neighbour, stiff in zip((west, east, north, south), stiffness, strict=True):
        du, dv = neighbour[0] - motion[0], neighbour[1] - motion[1]
        sides.append(stiff / ga.sqrt(1 + noise[2] * (du * du + dv * dv)))
    total = sides[0] + sides[1] + sides[2] + sides[3]
    a, b, c = weight * xx + total, weight * xy, weight * yy + total
    x = weight * (bx + xx * before[0] + xy * before[1])
    y = weight * (by + xy * before[0] + yy * before[1])
    determinant = a * c - b * b
    known = determinant > 0
    factor = OVERRELAXATION / ga.select(known, determinant, 1)
    a, b, c = factor * a, factor * b, factor * c
    return (ga.select(known, 1 - OVERRELAXATION, 1), a, b, c, x, y, *sides)


@kernel(motion=MOTION, west=MOTION, east=MOTION, north=MOTION, south=MOTION, step=STEP, returns=MOTION)
def relaxed_motion(motion, west, east, north, south, step):
    """Compute the motion of a pixel after a step of successive overrelaxation; `step` is that of `relaxation_step`."""
    keep, a, b, c, x, y, *sides = step
    for neighbour, side in zip((west, east, north, south), sides, strict=True):
        x, y = x + side * neighbour[0], y + side * neighbour[1]
    return keep * motion[0] + c * x - b * y, keep * motion[1] + a * y - b * x


TABLE = array(SCALAR, "m", 4, shared=True)


def _cubic_weights(t):
    """Return the cubic B-spline at t + 1, t, t - 1 and t - 2."""
    s = 1 - t
    before, after = s * s * s / 6, t * t * t / 6
    return before, (4 - t * t * (6 - 3 * t)) / 6, (4 - s * s * (6 - 3 * s)) / 6, after


@kernel(
    first=TABLE,
    second=TABLE,
    third=TABLE,
    fourth=TABLE,
    place=index("n", into="m"),
    x=array(SCALAR, "n"),
    y=array(SCALAR, "n"),
)
def cubic_samples(first, second, third, fourth, place, x, y):
    """Interpolate an image by cubic splines, x and y from 0 to 1 after the second of four columns and rows.

    The tables contain four neighbours of the spline coefficients for each place, one table for each row.
    """

    def sample(x, y, *numbers):
        across, down = _cubic_weights(x), _cubic_weights(y)
        lines = (sum((across[k] * numbers[4 * row + k] for k in range(4)), 0) for row in range(4))
        return sum((weight * line for weight, line in zip(down, lines, strict=True)), 0)

    tables = (gather(column, place) for table in (first, second, third, fourth) for column in table)
    return each(sample, x, y, *tables)


@kernel(
    upper=TABLE,
    lower=TABLE,
    place=index("n", into="m"),
    x=array(SCALAR, "n"),
    y=array(SCALAR, "n"),
    returns=array(SCALAR, "n", 2),
)
def motion_samples(upper, lower, place, x, y):
    """Interpolate a field of motions linearly, x and y from 0 to 1 after the first of two columns and rows.

    The tables contain u of two neighbours and v of both for each place, one table for each row.
    """

    def sample(x, y, *numbers):
        lines = [numbers[k] + x * (numbers[k + 1] - numbers[k]) for k in (0, 2, 4, 6)]
        return lines[0] + y * (lines[2] - lines[0]), lines[1] + y * (lines[3] - lines[1])

    return each(sample, x, y, *(gather(column, place) for table in (upper, lower) for column in table))


def _merge_exchange(size):
    """Return pairs of places to compare and exchange in order to sort numbers.

    Batcher's merge exchange (Knuth, *The Art of Computer Programming* 3, 5.2.2 M).
    """
    pairs = []
    top = p = 1 << (size - 1).bit_length() - 1
    while p > 0:
        q, r, d = top, 0, p
        while True:
            pairs += [(i, i + d) for i in range(size - d) if i & p == r]
            if q == p:
                break
            d, q, r = q - p, q >> 1, p
        p >>= 1
    return pairs


def _median_network():
    """Return pairs of 5 x 5 places, row by row, after whose exchanges the median is in the middle.

    Columns are sorted, then rows; then most numbers have more than 12 others that are not larger, or not smaller, and
    the median is that of the rest. Pairs that never change anything are removed, by testing all cases of zeros and ones
    with sorted columns (Knuth, 5.3.4 Z), one bit each.
    """
    sort = _merge_exchange(5)
    rest = [5 * i + j for i in range(5) for j in range(5) if max((i + 1) * (j + 1), (5 - i) * (5 - j)) <= 13]
    pairs = [(5 * row + i, 5 * row + j) for row in range(5) for i, j in sort]
    pairs += [(rest[i], rest[j]) for i, j in _merge_exchange(len(rest))]
    bits = [
        sum(1 << case for case in range(6**5) if case // 6**column % 6 <= row)
        for row in range(5)
        for column in range(5)
    ]
    found = [(5 * i + column, 5 * j + column) for column in range(5) for i, j in sort]
    for i, j in pairs:
        if bits[i] & ~bits[j]:
            found.append((i, j))
            bits[i], bits[j] = bits[i] & bits[j], bits[i] | bits[j]
    return found


def _median_of_25(pixels):
    """Return the median of 5 x 5 numbers."""
    values = [number for row in pixels for number in row]
    for i, j in _median_network():
        a, b = values[i], values[j]
        values[i], values[j] = ga.select(a < b, a, b), ga.select(a < b, b, a)
    return values[12]


@kernel(image=array(SCALAR, "n", "m"))
def medians(image):
    """Compute the medians of 5 x 5 pixels, which smooth a field of motions and preserve its discontinuities.

    Pixels outside the image are the nearest ones of the image.
    """
    return each(lambda row: each(_median_of_25, row), window(image, 5, 5, boundary="nearest"))
