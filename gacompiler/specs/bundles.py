"""Bundle adjustment: images of points and lines in cameras with lenses, their derivatives, and the elimination of both.

A camera is the motor from its frame to that of the world. It moves by ``m exp(B)``; the six coefficients are a rotation
vector and a translation in the frame of the camera. Points move by three coordinates, lines by four: two points of each
move across it. Lenses move by their numbers: ``fx, fy, cx, cy``, the skew, and the coefficients of the distortion. The
compiler derives all derivatives.

Parameters of cameras and lenses are in blocks of six. A coupling is a point or line with a block: the sum of products
of derivatives by both, over the observations that depend on them.
"""

from fractions import Fraction
from typing import Any

import gacompiler as ga
from gacompiler import SCALAR, array, assemble, each, gather, index, jvp, kernel, scatter, select
from gacompiler.algebra.catalog import PGA3
from gacompiler.specs.families.covariances import cross, dot
from gacompiler.specs.families.lens_models import N_BROWN, N_FISHEYE, brown, fisheye_of_direction

MOTOR, PLACE, PIXEL = PGA3.MOTOR, array(SCALAR, 3), array(SCALAR, 2)
DIRECTION = ("e032", "e013", "e021")
N_PINHOLE, N_BLOCK = 5, 6
BY_CAMERA, BY_POINT = array(SCALAR, 2, N_BLOCK), array(SCALAR, 2, 3)
LENSES = {"pinhole": N_PINHOLE, "brown": N_PINHOLE + N_BROWN, "fisheye": N_PINHOLE + N_FISHEYE}
"""Numbers of a lens, by its model."""
TINY = Fraction(1, 10**300)
HALF = Fraction(1, 2)
MOTIONS = (("e23", -1), ("e13", 1), ("e12", -1), ("e01", -1), ("e02", -1), ("e03", -1))
"""The bivectors of which half moves a camera: by a rotation about its x, y and z axis, and by a translation along."""


@kernel(motor=MOTOR, point=PLACE, returns=PLACE)
def place_in_camera(motor, point):
    """Compute the coordinates of a point in the frame of a camera."""
    at = assemble(PGA3, {"e123": 1, **dict(zip(DIRECTION, point, strict=True))})
    moved = ~motor * at * motor
    return tuple(moved[name] for name in DIRECTION)


def _pixel(lens, x, y):
    fx, fy, cx, cy, skew = lens[:N_PINHOLE]
    return fx * x + skew * y + cx, fy * y + cy


@kernel(place=PLACE, lens=array(SCALAR, LENSES["pinhole"]), returns=PIXEL)
def pinhole_pixel(place, lens):
    """Compute the pixel of a point in the frame of the camera; division by 0 in the plane of its centre."""
    x, y, z = place
    return _pixel(lens, x / z, y / z)


@kernel(place=PLACE, lens=array(SCALAR, LENSES["brown"]), returns=PIXEL)
def brown_pixel(place, lens):
    """Compute the pixel of a point with the distortion k1 k2 p1 p2 k3 k4 k5 k6 of OpenCV."""
    x, y, z = place
    return _pixel(lens, *brown(x / z, y / z, lens[N_PINHOLE:]))


@kernel(place=PLACE, lens=array(SCALAR, LENSES["fisheye"]), returns=PIXEL)
def fisheye_pixel(place, lens):
    """Compute the pixel of a point in any direction with the fisheye lens k1 k2 k3 k4 of OpenCV."""
    x, y, z = place
    return _pixel(lens, *fisheye_of_direction(x, y, z, lens[N_PINHOLE:]))


PIXELS = {"pinhole": pinhole_pixel, "brown": brown_pixel, "fisheye": fisheye_pixel}


def _units(n):
    return [tuple(int(i == k) for i in range(n)) for k in range(n)]


def _columns(derived, arguments, tangents):
    """Return the value of a kernel and the columns of its derivatives along tangents of one parameter."""
    found = [derived.function(*arguments, tangent) for tangent in tangents]
    return found[0][0], [column for _, column in found]


_BY_MOTOR, _BY_POINT = jvp(place_in_camera, "motor"), jvp(place_in_camera, "point")
_BY_PLACE, _BY_LENS = ({name: jvp(pixel, wrt) for name, pixel in PIXELS.items()} for wrt in ("place", "lens"))


def _motions(place):
    """Return the derivatives of a place in the frame of the camera by the six motions of the camera."""
    bivectors = [sign * HALF * PGA3.multivector({name: 1}) for name, sign in MOTIONS]
    return _columns(_BY_MOTOR, (PGA3.multivector({"1": 1}), place), bivectors)[1]


def _chain(by_place, columns):
    """Return the derivatives of two numbers by what moves a place: the columns of a matrix product."""
    rows = tuple(zip(*by_place, strict=True))
    return [tuple(sum(a * b for a, b in zip(row, column, strict=True)) for row in rows) for column in columns]


def _influence(square, kind, scale, curved):
    """Return the influence of an observation, and the part of its equation along the residual that curvature leaves.

    The influence is the derivative of the loss by the squared distance s. The loss of the kind 0 is s itself; that of
    the kind 1 is Huber's, which grows with the distance from `scale` on; that of the kind 2 is Cauchy's, ``scale**2
    log(1 + s / scale**2)``. The curvature of the loss along the residual is the influence times ``1 - b``, b from 0 to
    `curved`, of which the equation gets the root.
    """
    limit = scale * scale
    far = square > limit
    huber = select(far, scale / ga.sqrt(select(far, square, 1)), 1)
    is_robust, is_cauchy = kind > HALF, kind > Fraction(3, 2)
    influence = select(is_cauchy, limit / (limit + square), select(is_robust, huber, 1))
    bend = select(is_cauchy, 2 * square / (limit + square), select(is_robust, far, 0))
    return influence, ga.sqrt(1 - ga.minimum(bend, curved))


def _matrix(columns, factor):
    return tuple(tuple(factor * column[row] for column in columns) for row in range(2))


SEEN = {"pixel": PIXEL, "weight": SCALAR, "moves": SCALAR, "kind": SCALAR, "scale": SCALAR, "curved": SCALAR}
"""Parameters of an observation: 1 / standard deviation or 0, whether the point may move, and the loss."""


def _bent(off, square, weight, kind, scale, curved):
    """Return the residual for offsets in deviations, and a function that weighs a derivative of the offsets."""
    influence, left = _influence(square, kind, scale, curved)
    root = ga.sqrt(influence)
    share = (1 - left) / select(square > TINY, square, 1)

    def bent(column):
        along = share * (off[0] * column[0] + off[1] * column[1])
        return tuple(weight * root * (x - along * r) for x, r in zip(column, off, strict=True))

    return tuple(root / left * x for x in off), bent


def _equations(name, motor, point, lens, pixel, weight, moves, kind, scale, curved):
    """Return the weighed residual, its derivatives by camera and point, the squared distance, and what follows."""
    place, by_axis = _columns(_BY_POINT, (motor, point), _units(3))
    value, by_place = _columns(_BY_PLACE[name], (place, lens), _units(3))
    off = tuple(weight * (a - b) for a, b in zip(value, pixel, strict=True))
    square = off[0] * off[0] + off[1] * off[1]
    rest, bent = _bent(off, square, weight, kind, scale, curved)
    by_place = [bent(column) for column in by_place]
    by_camera, by_point = _chain(by_place, _motions(place)), _chain(by_place, by_axis)
    return (rest, _matrix(by_camera, 1), _matrix(by_point, moves), square), place, bent


def _lens_equations(name, motor, point, lens, pixel, weight, moves, kind, scale, curved):
    """Return what `_equations` returns, with the derivatives by the numbers of the lens."""
    found, place, bent = _equations(name, motor, point, lens, pixel, weight, moves, kind, scale, curved)
    columns = _columns(_BY_LENS[name], (place, lens), _units(LENSES[name]))[1]
    return *found, _matrix([bent(column) for column in columns], 1)


EQUATIONS = (PIXEL, BY_CAMERA, BY_POINT, SCALAR)
SUMMARY = """Compute the equation of an observation, by the parameters of the camera{and_lens} and the point.

    Parameters
    ----------
    motor, point, lens
    pixel, weight
        Where the point was seen, and the inverse standard deviation, or 0 for no equation.
    moves
        1, or 0 if the point is fixed.
    kind, scale
        The loss: 0 for squares, 1 for Huber's, 2 for Cauchy's, and its scale in standard deviations.
    curved
        0 for the derivatives of weighed squares; up to this part, less than 1, the curvature of the loss is subtracted
        (Triggs' correction).

    Returns
    -------
    residual, by_camera, by_point
        The residual and its derivatives, in standard deviations, times the root of the influence of the observation.
        Their product is the gradient of half the loss, whatever `curved` is.
    square
        The squared distance in standard deviations.{by_lens}
    """


def _kernels(name):
    """Return the kernels of squared distances and depths, of equations, and of equations with those of the lens."""
    definition, n = PIXELS[name], LENSES[name]
    lens, by_lens = array(SCALAR, n), array(SCALAR, 2, n)

    def distances(motor, point, lens, pixel, weight):
        place = place_in_camera.function(motor, point)
        off = tuple(weight * (a - b) for a, b in zip(definition.function(place, lens), pixel, strict=True))
        return off[0] * off[0] + off[1] * off[1], place[2]

    def equations(motor, point, lens, pixel, weight, moves, kind, scale, curved):
        return _equations(name, motor, point, lens, pixel, weight, moves, kind, scale, curved)[0]

    def lens_equations(motor, point, lens, pixel, weight, moves, kind, scale, curved):
        return _lens_equations(name, motor, point, lens, pixel, weight, moves, kind, scale, curved)

    distances.__doc__ = "Compute the squared distance of a pixel from the image, in deviations, and the depth."
    equations.__doc__ = SUMMARY.format(and_lens="", by_lens="")
    more = "\n    by_lens\n        The derivatives by the numbers of the lens."
    lens_equations.__doc__ = SUMMARY.format(and_lens=", its lens", by_lens=more)
    for function in (distances, equations, lens_equations):
        function.__name__ = function.__qualname__ = f"{name}_{function.__name__}"
    camera = {"motor": MOTOR, "point": PLACE, "lens": lens}
    return (
        kernel(**camera, pixel=PIXEL, weight=SCALAR, returns=(SCALAR, SCALAR))(distances),
        kernel(**camera, **SEEN, returns=EQUATIONS)(equations),
        kernel(**camera, **SEEN, returns=(*EQUATIONS, by_lens))(lens_equations),
    )


pinhole_distances, pinhole_equations, pinhole_lens_equations = _kernels("pinhole")
brown_distances, brown_equations, brown_lens_equations = _kernels("brown")
fisheye_distances, fisheye_equations, fisheye_lens_equations = _kernels("fisheye")


# Lines.

ENDS, ACROSS = array(SCALAR, 2, 3), array(SCALAR, 2, 3)
PINHOLE = array(SCALAR, N_PINHOLE)


@kernel(first=PLACE, second=PLACE, lens=PINHOLE, pixels=array(SCALAR, 2, 2), returns=PIXEL)
def line_offsets(first, second, lens, pixels):
    """Compute the signed distances of two pixels from the image of the line through two points in the camera's frame.

    They are not finite for a line through the centre of the camera.
    """
    fx, fy, _, _, skew = lens
    x, y, _ = normal = cross(first, second)
    size = ga.sqrt((x / fx) ** 2 + ((y - skew / fx * x) / fy) ** 2)
    return tuple(dot(normal, _ray(lens, pixel)) / size for pixel in pixels)


def _ray(lens, pixel):
    fx, fy, cx, cy, skew = lens
    y = (pixel[1] - cy) / fy
    return (pixel[0] - cx - skew * y) / fx, y, 1


_OFFSETS_BY = {wrt: jvp(line_offsets, wrt) for wrt in ("first", "second", "lens")}


def _seen_line(motor, ends, lens, pixels):
    """Return both ends of a line in the frame of a camera, and the offsets of the pixels."""
    first, second = (place_in_camera.function(motor, end) for end in ends)
    return first, second, line_offsets.function(first, second, lens, pixels)


@kernel(motor=MOTOR, ends=ENDS, lens=PINHOLE, pixels=array(SCALAR, 2, 2), weight=SCALAR, returns=(SCALAR, SCALAR))
def line_distances(motor, ends, lens, pixels, weight):
    """Compute the sum of the squared distances of two pixels from the image of a line, in deviations, and a depth.

    The depth is the least one of the points of the line that are seen at the places of its image next to the pixels.
    """
    first, second, off = _seen_line(motor, ends, lens, pixels)
    normal = cross(first, second)
    along = tuple(b - a for a, b in zip(first, second, strict=True))
    depths = [dot(normal, normal) / dot(cross(_ray(lens, pixel), along), normal) for pixel in pixels]
    return weight * weight * dot(off, off), ga.minimum(*depths)


def _line_equations(motor, ends, across, lens, pixels, weight, kind, scale, curved):
    """Return what `_equations` does, for two pixels of a line."""
    first, second, off = _seen_line(motor, ends, lens, pixels)
    off = tuple(weight * x for x in off)
    square = dot(off, off)
    rest, bent = _bent(off, square, weight, kind, scale, curved)
    places = {"first": first, "second": second}
    arguments = first, second, lens, pixels
    by_place = {name: [bent(x) for x in _columns(_OFFSETS_BY[name], arguments, _units(3))[1]] for name in places}
    of_both = [_chain(by_place[name], _motions(place)) for name, place in places.items()]
    by_camera = [tuple(map(sum, zip(*columns, strict=True))) for columns in zip(*of_both, strict=True)]
    by_line = []
    for end, columns in zip(ends, by_place.values(), strict=True):
        by_line += _chain(columns, _columns(_BY_POINT, (motor, end), across)[1])
    return (rest, _matrix(by_camera, 1), _matrix(by_line, 1), square), arguments, bent


SEEN_LINE = {
    "motor": MOTOR, "ends": ENDS, "across": ACROSS, "lens": PINHOLE, "pixels": array(SCALAR, 2, 2),
    **{name: SCALAR for name in ("weight", "kind", "scale", "curved")},
}  # fmt: skip
LINE_EQUATIONS = (PIXEL, BY_CAMERA, array(SCALAR, 2, 4), SCALAR)
LINE_SUMMARY = """Compute the equations of two pixels of a line, by the parameters of the camera{and_lens} and the line.

    Parameters
    ----------
    motor
    ends, across
        Two points of the line, and two unit vectors orthogonal to it, along which both move.
    lens, pixels
        The lens has no distortion.
    weight, kind, scale, curved
        As of `pinhole_equations`, for the sum of both squared distances.

    Returns
    -------
    residual, by_camera, by_line, square{by_lens}
        As of `pinhole_equations`; the square is the sum for both pixels.
    """


def _line_kernels():
    """Return the kernels of equations of lines, and of those with the derivatives by the lens."""

    def line_equations(motor, ends, across, lens, pixels, weight, kind, scale, curved):
        return _line_equations(motor, ends, across, lens, pixels, weight, kind, scale, curved)[0]

    def line_lens_equations(motor, ends, across, lens, pixels, weight, kind, scale, curved):
        found, arguments, bent = _line_equations(motor, ends, across, lens, pixels, weight, kind, scale, curved)
        columns = _columns(_OFFSETS_BY["lens"], arguments, _units(N_PINHOLE))[1]
        return *found, _matrix([bent(column) for column in columns], 1)

    line_equations.__doc__ = LINE_SUMMARY.format(and_lens="", by_lens="")
    line_lens_equations.__doc__ = LINE_SUMMARY.format(and_lens=", its lens", by_lens=", by_lens")
    return (
        kernel(**SEEN_LINE, returns=LINE_EQUATIONS)(line_equations),
        kernel(**SEEN_LINE, returns=(*LINE_EQUATIONS, array(SCALAR, 2, N_PINHOLE)))(line_lens_equations),
    )


line_equations, line_lens_equations = _line_kernels()


# Normal equations.


def _product(a, b):
    """Return the product of the transposed matrix `a` with `b`, both given by rows."""
    left, right = tuple(zip(*a, strict=True)), tuple(zip(*b, strict=True))
    return tuple(tuple(dot(x, y) for y in right) for x in left)


@kernel(
    by_block=array(SCALAR, "k", 2, 6), residual=array(SCALAR, "k", 2), block=index("k", into="blocks"),
    zero=array(SCALAR, "blocks"), returns=array(SCALAR, "blocks", 6),
)  # fmt: skip
def block_gradients(by_block, residual, block, zero):
    """Sum the gradients by blocks of six parameters."""
    return scatter(each(lambda rows, rest: tuple(dot(c, rest) for c in zip(*rows, strict=True)), by_block, residual),
                   block, zero)  # fmt: skip


@kernel(
    first=array(SCALAR, "k", 2, 6), second=array(SCALAR, "k", 2, 6), pair=index("k", into="pairs"),
    zero=array(SCALAR, "pairs"), returns=array(SCALAR, "pairs", 6, 6),
)  # fmt: skip
def block_products(first, second, pair, zero):
    """Sum the products of derivatives by two blocks, for pairs of blocks."""
    return scatter(each(_product, first, second), pair, zero)


def _triangle(n):
    """Return the places of the upper triangle of a matrix, row by row."""
    return [(i, j) for i in range(n) for j in range(i, n)]


def _inverse_root(pivot):
    usable = pivot > TINY
    return select(usable, 1 / ga.sqrt(select(usable, pivot, 1)), 0)


def _inverse_factor(square, more, n):
    """Return the rows of the inverse of the Cholesky factor of a matrix whose diagonal is multiplied by `more`."""
    entry = dict(zip(_triangle(n), square, strict=True))
    factor, pivots = dict[tuple[int, int], Any](), []
    for j in range(n):
        pivots.append(_inverse_root(entry[j, j] * more - sum(factor[j, k] * factor[j, k] for k in range(j))))
        for i in range(j + 1, n):
            factor[i, j] = (entry[j, i] - sum(factor[i, k] * factor[j, k] for k in range(j))) * pivots[j]
    inverse = [[0] * n for _ in range(n)]
    for j in range(n):
        inverse[j][j] = pivots[j]
        for i in range(j + 1, n):
            inverse[i][j] = -pivots[i] * sum(factor[i, k] * inverse[k][j] for k in range(j, i))
    return [row[: i + 1] for i, row in enumerate(inverse)]


def _rows(packed, n):
    """Return the rows of a lower triangle."""
    return [packed[i * (i + 1) // 2 : (i + 1) * (i + 2) // 2] for i in range(n)]


def _elimination(one, n):
    """Return the kernels that eliminate points or lines of n parameters from the normal equations."""
    many, size = f"{one}s", n * (n + 1) // 2
    by_item, coupling_of_one, table = array(SCALAR, "k", 2, n), array(SCALAR, 6, n), array(SCALAR, "couplings", 6, n)
    of_block, of_item = index("couplings", into="blocks"), index("couplings", into=many)
    either, zero, triangle = index("products", into="couplings"), array(SCALAR, many), array(SCALAR, size)
    gradients, triangles = array(SCALAR, many, n), array(SCALAR, many, size)

    def named(function, name, summary, **parameters):
        function.__name__ = function.__qualname__ = name
        function.__doc__ = summary
        return kernel(**parameters)(function)

    def sums(derivatives, residual, item, zero):
        def of(rows, rest):
            columns = tuple(zip(*rows, strict=True))
            square = tuple(dot(columns[i], columns[j]) for i, j in _triangle(n))
            return square, tuple(dot(column, rest) for column in columns)

        squares, found = each(of, derivatives, residual)
        return scatter(squares, item, zero), scatter(found, item, zero)

    def coupling_sums(by_block, derivatives, coupling, zero):
        return scatter(each(_product, by_block, derivatives), coupling, zero)

    def root(square, gradient, damping):
        rows = _inverse_factor(square, 1 + damping, n)
        inverse = tuple(x for row in rows for x in row)
        return inverse, tuple(sum(a * g for a, g in zip(row, gradient, strict=False)) for row in rows)

    def scaled(coupling, inverse):
        rows = _rows(inverse, n)
        return tuple(
            tuple(sum(a * x for a, x in zip(row, entries, strict=False)) for row in rows) for entries in coupling
        )

    def eliminated(coupling, first, second, pair, zero):
        def of(a, b):
            return tuple(tuple(dot(x, y) for y in b) for x in a)

        return scatter(each(of, gather(coupling, first), gather(coupling, second)), pair, zero)

    def eliminated_gradients(coupling, block, item, reduced, zero):
        rows = each(lambda a, g: tuple(dot(row, g) for row in a), coupling, gather(reduced, item))
        return scatter(rows, block, zero)

    def changes(coupling, block, item, change, reduced, inverse, zero):
        def of(a, d):
            return tuple(dot(column, d) for column in zip(*a, strict=True))

        sums = scatter(each(of, coupling, gather(change, block)), item, zero)

        def solved(s, g, packed):
            rows, known = _rows(packed, n), [-(p + q) for p, q in zip(s, g, strict=True)]
            return tuple(sum(rows[i][j] * known[i] for i in range(j, n)) for j in range(n))

        return each(solved, sums, reduced, inverse)

    def spread(coupling, first, second, pair, item, share, covariance, zero):
        def of(a, b, c, times):
            middle = [tuple(dot(row, column) for column in zip(*b, strict=True)) for row in c]
            left = tuple(zip(*a, strict=True))
            full = [[dot(x, y) for y in zip(*middle, strict=True)] for x in left]
            return tuple(times * HALF * (full[i][j] + full[j][i]) for i, j in _triangle(n))

        rows = each(of, gather(coupling, first), gather(coupling, second), gather(covariance, pair), share)
        return scatter(rows, item, zero)

    return (
        named(
            sums, f"{one}_sums", f"Sum the upper triangles of products of derivatives by {many}, and the gradients.",
            derivatives=by_item, residual=array(SCALAR, "k", 2), item=index("k", into=many), zero=zero,
            returns=(triangles, gradients),
        ),
        named(
            coupling_sums, f"{one}_couplings", f"Sum the products of derivatives by a block and by a {one}.",
            by_block=array(SCALAR, "k", 2, 6), derivatives=by_item, coupling=index("k", into="couplings"),
            zero=array(SCALAR, "couplings"), returns=table,
        ),
        named(
            root, f"{one}_root", ROOT.format(one=one),
            square=triangle, gradient=array(SCALAR, n), damping=SCALAR, returns=(triangle, array(SCALAR, n)),
        ),
        named(
            scaled, f"scaled_{one}_coupling", f"Multiply a coupling by the transposed inverse root of its {one}.",
            coupling=coupling_of_one, inverse=triangle, returns=coupling_of_one,
        ),
        named(
            eliminated, f"eliminated_{many}",
            f"Sum the products of scaled couplings of the same {one}, for pairs of blocks: what elimination subtracts.",
            coupling=table, first=either, second=either, pair=index("products", into="pairs"),
            zero=array(SCALAR, "pairs"), returns=array(SCALAR, "pairs", 6, 6),
        ),
        named(
            eliminated_gradients, f"eliminated_{one}_gradients",
            f"Sum the products of scaled couplings with the reduced gradients of their {many}.",
            coupling=table, block=of_block, item=of_item, reduced=gradients, zero=array(SCALAR, "blocks"),
            returns=array(SCALAR, "blocks", 6),
        ),
        named(
            changes, f"{one}_changes",
            f"Compute the changes of {many} from those of the blocks of parameters: the back substitution.",
            coupling=table, block=of_block, item=of_item, change=array(SCALAR, "blocks", 6), reduced=gradients,
            inverse=triangles, zero=zero, returns=gradients,
        ),
        named(
            spread, f"spread_of_{many}", SPREAD.format(many=many),
            coupling=table, first=either, second=either, pair=index("products", into="pairs"),
            item=index("products", into=many), share=array(SCALAR, "products"),
            covariance=array(SCALAR, "pairs", 6, 6), zero=zero, returns=triangles,
        ),
    )  # fmt: skip


ROOT = """Compute the inverse of the Cholesky factor L of the equations of a {one}, and the product with its gradient.

    Parameters
    ----------
    square
        The upper triangle, row by row.
    gradient
    damping
        The relative increment of the diagonal. Parameters without influence are not changed by the solution.

    Returns
    -------
    inverse
        The lower triangle of the inverse of L, row by row; a row of zeros for a pivot that is not positive.
    reduced
        The inverse times the gradient.
    """
SPREAD = """Sum the covariances of blocks, seen through scaled couplings: what the parameters of cameras add to {many}.

    `share` is 1 for products of a coupling with itself and 2 for others. The sums are upper triangles, row by row.
    """
(
    point_sums, point_couplings, point_root, scaled_point_coupling, eliminated_points, eliminated_point_gradients,
    point_changes, spread_of_points,
) = _elimination("point", 3)  # fmt: skip
(
    line_sums, line_couplings, line_root, scaled_line_coupling, eliminated_lines, eliminated_line_gradients,
    line_changes, spread_of_lines,
) = _elimination("line", 4)  # fmt: skip
