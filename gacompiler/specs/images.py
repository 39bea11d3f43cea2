"""Image operations: optical flow, disparities, medians, interpolation. Lengths are in pixels.

The kernels of one module are defined in one file, which is long.
"""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, array, each, fold, gather, index, kernel, pick, scan, total, window

IMAGE, NODES = array(SCALAR, "h", "w"), array(SCALAR, "n", "m")
LIST = array(SCALAR, "k")
PIXELS = array(SCALAR, "p")
REACH = 5
"""Distance in pixels of the farthest pixels that `pair_means` uses."""
NEAR = 6
"""Distance of the farthest pixels that `averaged` uses."""


def _sum(numbers):
    first, *rest = numbers
    for number in rest:
        first = first + number
    return first


def _symmetric(taps, numbers):
    """Return the sum of an odd number of numbers times symmetric taps, given from the middle one on."""
    middle = len(numbers) // 2
    pairs = (taps[k] * (numbers[middle - k] + numbers[middle + k]) for k in range(1, middle + 1))
    return _sum([taps[0] * numbers[middle], *pairs])


def _slope(far, near, nearer, farther):
    """Return the derivative at the middle of four neighbours, of third degree."""
    return (8 * (nearer - near) - (farther - far)) / 12


@kernel(image=NODES)
def slopes(image):
    """Compute derivatives along rows and along columns, of third degree; beyond the edges, the image is mirrored."""
    steps = -2, -1, 1, 2
    across = each(lambda row: each(_slope, *window(row, steps)), image)
    return across, each(lambda *rows: each(_slope, *rows), *window(image, steps))


@kernel(image=NODES, fine=array(SCALAR, 4), coarse=array(SCALAR, 8))
def band(image, fine, coarse):
    """Compute the difference of two filters with symmetric taps, given from the middle one on; edges are mirrored."""

    def both(*numbers):
        return _symmetric(fine, numbers[4:-4]), _symmetric(coarse, numbers)

    def line(fine_row, coarse_row):
        return each(
            lambda *numbers: _symmetric(fine, numbers[:7]) - _symmetric(coarse, numbers[7:]),
            *window(fine_row, 7), *window(coarse_row, 15),
        )  # fmt: skip

    return each(line, *each(lambda *rows: each(both, *rows), *window(image, 15)))


def _difference(factors, numbers):
    """Return the sum of factors times the differences of the numbers after and before the middle one."""
    return _sum(factor * (numbers[4 + k] - numbers[4 - k]) for k, factor in enumerate(factors, 1))


SLOPE = Fraction(4, 5), -Fraction(1, 5), Fraction(4, 105), -Fraction(1, 280)
TWIST = -Fraction(61, 180), Fraction(169, 720), -Fraction(1, 20), Fraction(7, 1440)
"""Factors of differences of neighbours that give the first and third factors of a Taylor series."""


@kernel(image=NODES)
def jets(image):
    """Compute the polynomial of second degree that is nearest to the image within half a pixel of each pixel.

    Of Taylor series of third degree, from differences of nine neighbours, it has the least mean squared difference: it
    contains 3/20 x for x^3 and x/12 for x y^2. The results are the factors of 1, x, y, x^2, x y and y^2. Beyond the
    edges, the image is mirrored.
    """

    def slope(*numbers):
        return _difference(SLOPE, numbers)

    def nearest(*numbers):
        return _difference([a + b * Fraction(3, 20) for a, b in zip(SLOPE, TWIST, strict=True)], numbers)

    def bend(*numbers):
        factors = -Fraction(205, 144), Fraction(4, 5), -Fraction(1, 10), Fraction(4, 315), -Fraction(1, 1120)
        return _symmetric(factors, numbers)

    def line(*rows):
        near, down, curved = (each(function, *rows) for function in (nearest, slope, bend))

        def pixel(near, *numbers):
            y, yy, here = numbers[:9], numbers[9:18], numbers[18:]
            x = nearest(*here) + slope(*yy) / 12
            return here[4], x, near + bend(*y) / 12, bend(*here), slope(*y), yy[4]

        return each(pixel, near, *window(down, 9), *window(curved, 9), *window(rows[4], 9))

    return each(line, *window(image, 9))


@kernel(u=NODES, v=NODES, rows=array(SCALAR, "n"), columns=array(SCALAR, "m"), last=array(SCALAR, 2))
def motion_ends(u, v, rows, columns, last):
    """Compute where motions (u, v) of places in a grid of `rows` and `columns` end.

    `last` contains the last column and row of the image. The results are the row and column of the nearest pixel, the
    distances from it along rows and columns, and 1 inside the image, but 0 beyond it.
    """
    right, bottom = last

    def end(row, column, u, v):
        x, y = column + u, row + v
        beyond = ga.minimum(ga.minimum(x, right - x), ga.minimum(y, bottom - y)) < -0.5
        x, y = ga.minimum(ga.maximum(x, 0), right), ga.minimum(ga.maximum(y, 0), bottom)
        i, j = ga.floor(y + 0.5), ga.floor(x + 0.5)
        return i, j, x - j, y - i, ga.select(beyond, 0, 1)

    return each(lambda row, us, vs: each(lambda *one: end(row, *one), columns, us, vs), rows, u, v)


@kernel(
    one=PIXELS, x=PIXELS, y=PIXELS, xx=PIXELS, xy=PIXELS, yy=PIXELS, place=index("k", into="p"), right=LIST, down=LIST,
    known=LIST, first=LIST, first_x=LIST, first_y=LIST,
)  # fmt: skip
def motion_terms(one, x, y, xx, xy, yy, place, right, down, known, first, first_x, first_y):
    """Compute the terms of normal equations for a correction of the motion between two images.

    The first six arguments are the `jets` of the second image. Each motion ends at a distance `right` and `down` from a
    pixel `place`, where the second image has the value and the gradient of this polynomial; `first`, `first_x` and
    `first_y` are those of the first image. With the mean g of both gradients, and with the difference d, the results
    are the products g g^T (xx, xy, yy), -g d (x, y) and d d, times `known`.
    """

    def terms(x, y, known, first, first_x, first_y, one, to_x, to_y, xx, xy, yy):
        along, down = to_x + x * xx + y * xy, to_y + y * yy
        difference = one + x * along + y * down - first
        gx, gy = (first_x + along + x * xx) / 2, (first_y + down + y * yy + x * xy) / 2
        wx, wy, wd = known * gx, known * gy, known * difference
        return wx * gx, wx * gy, wy * gy, -(wx * difference), -(wy * difference), wd * difference

    return each(terms, right, down, known, first, first_x, first_y, *gather((one, x, y, xx, xy, yy), place))


def _of_steps(taps, steps, numbers):
    """Return the sum of numbers times symmetric taps, which are given from the middle one on; one tap for each step."""
    return _sum([taps[abs(step)] * number for step, number in zip(steps, numbers, strict=True)])


@kernel(even=NODES, odd=NODES, taps=array(SCALAR, NEAR + 1))
def averaged(even, odd, taps):
    """Filter pixels in even rows and columns, and others in odd ones, along both axes, at the former.

    The taps are symmetric, given from the middle one on. Beyond the edges, the last pixels are repeated.
    """

    def filtered(pixels, steps):
        places = [step // 2 for step in steps]
        rows = window(pixels, places, boundary="nearest")
        low = each(lambda *rows: each(lambda *numbers: _of_steps(taps, steps, numbers), *rows), *rows)
        return each(
            lambda row: each(
                lambda *numbers: _of_steps(taps, steps, numbers), *window(row, places, boundary="nearest")
            ),
            low,
        )

    both = filtered(even, range(-NEAR, NEAR + 1, 2)), filtered(odd, range(1 - NEAR, NEAR, 2))
    return each(lambda *rows: each(lambda a, b: a + b, *rows), *both)


@kernel(even=NODES, odd=NODES, taps=array(SCALAR, REACH + 1))
def pair_means(even, odd, taps):
    """Filter an image along both axes with symmetric taps, given from the middle one on, at its even rows.

    `even` and `odd` contain its even and odd rows. Beyond the edges, the last pixels are repeated.
    """
    evens = window(even, range(-(REACH // 2), REACH // 2 + 1), boundary="nearest")
    odds = window(odd, range(-(REACH // 2) - 1, REACH // 2 + 1), boundary="nearest")
    rows = [array for pair in zip(odds, evens, strict=False) for array in pair] + [odds[-1]]
    low = each(lambda *rows: each(lambda *numbers: _symmetric(taps, numbers), *rows), *rows)
    return each(
        lambda row: each(lambda *numbers: _symmetric(taps, numbers), *window(row, 2 * REACH + 1, boundary="nearest")),
        low,
    )


@kernel(sums=array(SCALAR, 6), ridge=SCALAR, returns=array(SCALAR, 2))
def motion_evidence(sums, ridge):
    """Compute the least residual sum of squares of normal equations as in `motion_terms`, and the smaller eigenvalue.

    `ridge`, positive, is added to the diagonal for the residual.
    """
    xx, xy, yy, x, y, square = sums
    half, across = (xx - yy) / 2, xy
    least = (xx + yy) / 2 - ga.sqrt(half * half + across * across)
    a, c = xx + ridge, yy + ridge
    determinant = a * c - xy * xy
    u, v = (c * x - xy * y) / determinant, (a * y - xy * x) / determinant
    return ga.maximum(square - u * x - v * y, 0), ga.maximum(least, 0)


def _weights(sums, before, motion, stiffness, noise):
    """Return the coefficients of `_swept`: the inverse matrices, the right-hand sides, and weights of neighbours."""

    def side(stiff, u, v, other_u, other_v):
        du, dv = other_u - u, other_v - v
        return stiff / ga.sqrt(1 + noise[2] * (du * du + dv * dv))

    def line(xx, xy, yy, bx, by, square, pu, pv, un, us, usouth, vn, vs, vsouth, east, north, south):
        def node(a, b, c, x, y, rr, pu, pv, un, u, us, vn, v, vs, east, north, south, west, uw, ue, vw, ve):
            du, dv = u - pu, v - pv
            left = rr - 2 * (x * du + y * dv) + a * du * du + 2 * b * du * dv + c * dv * dv
            weight = noise[0] / (1 + noise[1] * ga.maximum(left, 0))
            to_east, to_south = side(east, u, v, ue, ve), side(south, u, v, us, vs)
            total = to_east + to_south + side(west, u, v, uw, vw) + side(north, u, v, un, vn)
            right, down = weight * (x + a * pu + b * pv), weight * (y + b * pu + c * pv)
            a, b, c = weight * a + total, weight * b, weight * c + total
            determinant = a * c - b * b
            known = determinant > 0
            factor = ga.select(known, 1, 0) / ga.select(known, determinant, 1)
            return factor * c, -(factor * b), factor * a, right, down, to_east, to_south

        return each(
            node, xx, xy, yy, bx, by, square, pu, pv, un, us, usouth, vn, vs, vsouth, east, north, south,
            *window(east, (-1,), boundary="constant", value=0), *window(us, (-1, 1), boundary="nearest"),
            *window(vs, (-1, 1), boundary="nearest"),
        )  # fmt: skip

    u, v = motion
    east, south = stiffness
    return each(
        line, *sums, *before, *window(u, 3, boundary="nearest"), *window(v, 3, boundary="nearest"), east,
        *window(south, (-1, 0), boundary="constant", value=0),
    )  # fmt: skip


def _swept(coefficients, motion, factor):
    """Return the motion after every node moved by `factor` times the way to the solution of its equations."""

    def line(xx, xy, yy, x, y, east, north_s, south_s, un, us, us_south, vn, vs, vs_south):
        def node(a, b, c, x, y, east, north, south, un, u, usouth, vn, v, vsouth, west, uw, ue, vw, ve):
            x = x + east * ue + west * uw + south * usouth + north * un
            y = y + east * ve + west * vw + south * vsouth + north * vn
            return u + factor * (a * x + b * y - u), v + factor * (b * x + c * y - v)

        return each(
            node, xx, xy, yy, x, y, east, north_s, south_s, un, us, us_south, vn, vs, vs_south,
            *window(east, (-1,), boundary="constant", value=0), *window(us, (-1, 1), boundary="nearest"),
            *window(vs, (-1, 1), boundary="nearest"),
        )  # fmt: skip

    *equations, east, south = coefficients
    u, v = motion
    return each(
        line, *equations, east, *window(south, (-1, 0), boundary="constant", value=0),
        *window(u, 3, boundary="nearest"), *window(v, 3, boundary="nearest"),
    )  # fmt: skip


@kernel(
    xx=NODES, xy=NODES, yy=NODES, bx=NODES, by=NODES, square=NODES, u=NODES, v=NODES, start_u=NODES, start_v=NODES,
    east=NODES, south=NODES, noise=array(SCALAR, 3), rounds=array(SCALAR, "r"), factors=array(SCALAR, "k"),
)  # fmt: skip
def relaxed_motion(xx, xy, yy, bx, by, square, u, v, start_u, start_v, east, south, noise, rounds, factors):
    """Compute a smooth motion that satisfies normal equations, by iteratively reweighted least squares.

    The sums are those of `motion_terms` for the increment of the motion (u, v). Their weight is ``noise[0] / (1 +
    noise[1] r)`` with the squared residual r of the present motion; the weight of the difference d to the neighbour in
    the east or south is ``stiffness / sqrt(1 + noise[2] |d|^2)``, and `east` and `south` are the stiffness. If no
    weight is positive, the motion is 0. For each of `rounds`, of which only the length matters, weights are computed,
    and one step of relaxation follows for each of its `factors`.
    """
    sums = xx, xy, yy, bx, by, square

    def weighted(motion, _):
        coefficients = _weights(sums, (u, v), motion, (east, south), noise)
        return fold(lambda motion, factor: _swept(coefficients, motion, factor), motion, factors)

    return fold(weighted, (start_u, start_v), rounds)


@kernel(
    first=array(SCALAR, "n", "m", shared=True),
    second=array(SCALAR, "n", "m", shared=True),
    row=array(SCALAR, "k"),
    column=array(SCALAR, "k"),
    u=array(SCALAR, "k"),
    v=array(SCALAR, "k"),
    down=array(SCALAR, "r"),
    across=array(SCALAR, "r"),
    weights=array(SCALAR, "r"),
    last=array(SCALAR, 2),
    most=SCALAR,
)
def motion_costs(first, second, row, column, u, v, down, across, weights, last, most):
    """Compute the squared difference of two images around pixels for given motions, averaged with weights.

    `down` and `across` are the distances of the neighbours, and `last` contains the last column and row that are read
    in the second image without neighbours. Every square is at most `most`. Places outside both images are 0.
    """

    def cost(row, column, u, v):
        x = ga.minimum(ga.maximum(column + u, 0), last[0])
        y = ga.minimum(ga.maximum(row + v, 0), last[1])
        left, top = ga.floor(x), ga.floor(y)
        x, y = x - left, y - top

        def square(dy, dx, weight):
            upper, lower = pick(second, top + dy, 0), pick(second, top + dy + 1, 0)
            above, below = (
                pick(line, left + dx, 0) + x * (pick(line, left + dx + 1, 0) - pick(line, left + dx, 0))
                for line in (upper, lower)
            )
            d = pick(pick(first, row + dy, 0), column + dx, 0) - above - y * (below - above)
            return weight * ga.minimum(d * d, most)

        return total(square, down, across, weights)

    return each(cost, row, column, u, v)


APART = 3
"""Distance of the places of `bends`."""


@kernel(u=NODES, v=NODES)
def bends(u, v):
    """Compute how far a motion is from linear: the squared second difference of places that are `APART` apart.

    The results are for differences along rows, along columns, and along the diagonals to the right and to the left.
    Beyond the edges, the motion is that of the last places.
    """
    steps = -APART, 0, APART

    def squares(*numbers):
        us, vs = numbers[:9], numbers[9:]

        def square(a, b):
            du, dv = us[a] + us[b] - 2 * us[4], vs[a] + vs[b] - 2 * vs[4]
            return du * du + dv * dv

        return square(3, 5), square(1, 7), square(0, 8), square(2, 6)

    def line(*rows):
        return each(squares, *(number for row in rows for number in window(row, steps, boundary="nearest")))

    return each(line, *window(u, steps, boundary="nearest"), *window(v, steps, boundary="nearest"))


TABLE = array(SCALAR, "m", 4, shared=True)


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


def _median_of_9(pixels):
    """Return the median of 3 x 3 numbers.

    Columns are sorted; the median is that of the largest of the least, the median of the middle and the least of the
    largest numbers (Smith, *Dr. Dobb's Journal* 21(5), 1996).
    """

    def ordered(a, b):
        return ga.minimum(a, b), ga.maximum(a, b)

    def sorted_three(a, b, c):
        a, b = ordered(a, b)
        b, c = ordered(b, c)
        a, b = ordered(a, b)
        return a, b, c

    least, middle, largest = zip(*(sorted_three(*column) for column in zip(*pixels, strict=True)), strict=True)
    return sorted_three(
        ga.maximum(ga.maximum(least[0], least[1]), least[2]),
        sorted_three(*middle)[1],
        ga.minimum(ga.minimum(largest[0], largest[1]), largest[2]),
    )[1]


@kernel(image=array(SCALAR, "n", "m"))
def medians(image):
    """Compute the medians of 3 x 3 pixels, which smooth a field of motions and preserve its discontinuities.

    Pixels outside the image are the nearest ones of the image.
    """
    return each(lambda row: each(_median_of_9, row), window(image, 3, 3, boundary="nearest"))


AROUND = 7
"""Rows and columns of the neighbourhood whose deviation is the unit of `contrasts`."""
HUGE = 10**9
"""More than any cost."""


@kernel(image=IMAGE, ridge=SCALAR)
def contrasts(image, ridge):
    """Compute an image relative to the mean and the deviation of 7 x 7 neighbours, and differences of neighbours.

    The differences are those of the next and the previous pixel of the result, along rows and along columns. `ridge`,
    positive, is added to the variance. Beyond the edges, the image is mirrored.
    """

    def sums(*numbers):
        return _sum(numbers), _sum([number * number for number in numbers])

    def pixel(here, *numbers):
        mean, square = _sum(numbers[:AROUND]) / AROUND**2, _sum(numbers[AROUND:]) / AROUND**2
        return (here - mean) / ga.sqrt(ga.maximum(square - mean * mean, 0) + ridge)

    def difference(before, after):
        return after - before

    first, second = each(lambda *rows: each(sums, *rows), *window(image, AROUND))
    relative = each(
        lambda here, *lines: each(pixel, here, *(one for line in lines for one in window(line, AROUND))),
        image, first, second,
    )  # fmt: skip
    across = each(lambda row: each(difference, *window(row, (-1, 1))), relative)
    down = each(lambda *rows: each(difference, *rows), *window(relative, (-1, 1)))
    return relative, across, down


def _next_costs(previous, left, right, levels, walls, penalties):
    """Return the costs (d, w) of a row from those of the row before; see `costs_from_above`."""
    small, large, hidden = penalties

    def moved(plane):
        # One column further for each level. The first and last columns meet, but there are walls between them.
        start = each(lambda value: value, *window(plane, (1,), boundary="wrap"))
        return scan(lambda row, _: each(lambda value: value, *window(row, (-1,), boundary="wrap")), start, levels)

    def message(least, below, here, above):
        return ga.minimum(ga.minimum(ga.minimum(below, above) + small, here) - least, large)

    def line(wall, below, here, above, *there):
        def cost(wall, before, same, after, *numbers):
            pairs = zip(numbers[:2], numbers[2:], strict=True)
            difference = _sum([ga.absolute(one - other) for one, other in pairs])
            return (before + same + after) * Fraction(1, 3) + ga.select(wall > 0, hidden, difference)

        messages = each(message, least, below, here, above)
        return each(cost, wall, *window(messages, 3, boundary="nearest"), *left, *there)

    start = each(lambda number: HUGE + 0 * number, left[0])
    least = fold(lambda least, row: each(ga.minimum, least, row), start, previous)
    return each(line, walls, *window(previous, 3, boundary="nearest"), *(moved(plane) for plane in right))


VIEWS = {name: IMAGE for name in ("left_across", "left_down", "right_across", "right_down")}
LEVELS, WALLS, PENALTIES = array(SCALAR, "d"), array(SCALAR, "d", "w"), array(SCALAR, 3)


@kernel(**VIEWS, levels=LEVELS, walls=WALLS, penalties=PENALTIES)
def costs_from_above(left_across, left_down, right_across, right_down, levels, walls, penalties):
    """Compute the costs of all levels (disparities) from a pixel and from those above it in a cone of 90 degrees.

    The own cost of a pair is the sum of the absolute differences of two numbers, results of `contrasts`. The cost of
    a level is the sum of the own one and of the mean of messages from the three nearest pixels of the row above. A
    message is the least cost of the neighbour, in excess of that of its best level, if the level remains, changes by
    one at the cost ``penalties[0]``, or changes arbitrarily at the cost ``penalties[1]``.

    `levels` are the numbers 0, 1, ..., and level k pairs column x with column ``x - k`` of the right image, cyclically.
    `walls` are 1e9 where that column does not exist, and 0 elsewhere. Where it does not, the own cost is
    ``penalties[2]``.
    """

    def row(previous, *planes):
        return _next_costs(previous, planes[:2], planes[2:], levels, walls, penalties)

    nothing = each(lambda line: each(lambda wall: 0 * wall, line), walls)
    return scan(row, nothing, left_across, left_down, right_across, right_down)


@kernel(above=array(SCALAR, "h", "d", "w"), **VIEWS, levels=LEVELS, walls=WALLS, penalties=PENALTIES)
def best_levels(above, left_across, left_down, right_across, right_down, levels, walls, penalties):
    """Compute the best level of each pixel, from costs from above and the same costs from below.

    `above` is the result of `costs_from_above` for the other arguments. The results are the least sum of both costs and
    its level, the least sum at levels that differ by two or more, and the level that is best for each pixel of the
    right image. Sums of 1e9 and more mean that there is no such level.
    """

    def row(carry, above, *planes):
        costs = _next_costs(carry[0], planes[:2], planes[2:], levels, walls, penalties)

        def better(carry, level, line):
            def lower(least, number, cost):
                return ga.minimum(cost, least), ga.select(cost < least, level, number)

            return each(lower, *carry, line)

        def of_right(carry, level, line):
            return better(tuple(window(part, (1,), boundary="wrap")[0] for part in carry), level, line)

        def elsewhere(second, level, line):
            def far(second, best, cost):
                return ga.minimum(ga.select(ga.absolute(level - best) < 2, HUGE, cost), second)

            return each(far, second, number, line)

        both = each(lambda *lines: each(lambda up, down, wall: up + down + wall, *lines), above, costs, walls)
        huge, none = each(lambda wall: HUGE + 0 * wall, wall), each(lambda wall: 0 * wall, wall)
        least, number = fold(better, (huge, none), levels, both)
        second = fold(elsewhere, huge, levels, both)
        _, partner = fold(of_right, (huge, none), levels, both, reverse=True)
        return costs, least, number, second, partner

    wall = pick(walls, 0, 0)
    none = each(lambda wall: 0 * wall, wall)
    nothing = each(lambda line: each(lambda wall: 0 * wall, line), walls)
    planes = left_across, left_down, right_across, right_down
    return scan(row, (nothing, none, none, none, none), above, *planes, reverse=True)[1:]


@kernel(left=IMAGE, right=IMAGE, numbers=IMAGE, columns=array(SCALAR, "w"), last=SCALAR, weight=SCALAR)
def refined_numbers(left, right, numbers, columns, last, weight):
    """Refine disparities, which are whole `numbers`, to fractions of pixels.

    Column x of `left` is compared with column ``x - number`` of `right`. The difference, after smoothing along rows,
    and the mean slope there give a linear equation for the fraction (Lucas and Kanade, *IJCAI* 1981:674). The fraction
    of least squares is that of the 5 x 5 neighbours whose numbers differ by at most one, and of the equation that it is
    0, which has the given weight. It is at most 1. `columns` are numbers from 0 to `last`; equations that need values
    beyond an edge are left out.
    """

    def smooth(row):
        return each(lambda a, b, c: (a + 2 * b + c) / 4, *window(row, 3, boundary="mirror"))

    def slopes(row):
        return each(_slope, *window(row, (-2, -1, 1, 2), boundary="mirror"))

    def line(here, there, row):
        first, second = smooth(here), smooth(there)
        far = slopes(second)

        def terms(column, number, value, slope):
            place = column - number
            other, other_slope = pick(second, place, 0), pick(far, place, 0)
            inside = ga.minimum(ga.minimum(column, last - column), ga.minimum(place, last - place)) > 2
            mean = ga.select(inside, (slope + other_slope) / 2, 0)
            return mean * mean, mean * (other - value)

        return each(terms, columns, row, first, slopes(first))

    def fraction(number, squares, products, around):
        rest, sum = weight, 0
        for lines in zip(squares, products, around, strict=True):
            for square, product, other in zip(*lines, strict=True):
                distance = other - number
                known = ga.select(ga.absolute(distance) < 2, square, 0)
                rest = rest + known
                sum = sum + known * distance + ga.select(ga.absolute(distance) < 2, product, 0)
        return number + ga.maximum(ga.minimum(sum / rest, 1), -1)

    squares, products = each(line, left, right, numbers)
    windows = (window(part, 5, 5, boundary="mirror") for part in (squares, products, numbers))
    return each(lambda *rows: each(fraction, *rows), numbers, *windows)
