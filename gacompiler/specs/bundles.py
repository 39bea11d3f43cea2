"""Bundle adjustment: images of points in cameras with lenses, their derivatives, and the elimination of the points.

A camera is the motor from its frame to that of the world. It moves by ``m exp(B)``; the six coefficients are a rotation
vector and a translation in the frame of the camera. Points move by three coordinates, and lenses by their numbers:
``fx, fy, cx, cy``, the skew, and the coefficients of the distortion. The compiler derives all derivatives.

Parameters of cameras and lenses are in blocks of six. A coupling is a point with a block: the sum of products of
derivatives by both, over the observations that depend on them.
"""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, array, assemble, each, gather, index, jvp, kernel, scatter, select
from gacompiler.algebra.catalog import PGA3
from gacompiler.specs.families.lens_models import N_BROWN, N_FISHEYE, brown, fisheye_of_direction

MOTOR, PLACE, PIXEL = PGA3.MOTOR, array(SCALAR, 3), array(SCALAR, 2)
DIRECTION = ("e032", "e013", "e021")
N_PINHOLE, N_BLOCK = 5, 6
BY_CAMERA, BY_POINT = array(SCALAR, 2, N_BLOCK), array(SCALAR, 2, 3)
COUPLING, SYMMETRIC = array(SCALAR, 6, 3), array(SCALAR, 6)
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


def _equations(name, motor, point, lens, pixel, weight, moves, kind, scale, curved):
    """Return the weighed residual, its derivatives by camera and point, the squared distance, and what follows."""
    place, by_axis = _columns(_BY_POINT, (motor, point), _units(3))
    value, by_place = _columns(_BY_PLACE[name], (place, lens), _units(3))
    off = tuple(weight * (a - b) for a, b in zip(value, pixel, strict=True))
    square = off[0] * off[0] + off[1] * off[1]
    influence, left = _influence(square, kind, scale, curved)
    root = ga.sqrt(influence)
    share = (1 - left) / select(square > TINY, square, 1)

    def bent(column):
        along = share * (off[0] * column[0] + off[1] * column[1])
        return tuple(weight * root * (x - along * r) for x, r in zip(column, off, strict=True))

    by_place = [bent(column) for column in by_place]
    by_camera, by_point = _chain(by_place, _motions(place)), _chain(by_place, by_axis)
    rest = tuple(root / left * x for x in off)
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


# Normal equations.


def _dot(a, b):
    return sum(x * y for x, y in zip(a[1:], b[1:], strict=True)) + a[0] * b[0]


def _product(a, b):
    """Return the product of the transposed matrix `a` with `b`, both given by rows."""
    left, right = tuple(zip(*a, strict=True)), tuple(zip(*b, strict=True))
    return tuple(tuple(_dot(x, y) for y in right) for x in left)


@kernel(
    by_point=array(SCALAR, "k", 2, 3), residual=array(SCALAR, "k", 2), point=index("k", into="points"),
    zero=array(SCALAR, "points"), returns=(array(SCALAR, "points", 6), array(SCALAR, "points", 3)),
)  # fmt: skip
def point_sums(by_point, residual, point, zero):
    """Sum the upper triangles of products of derivatives by points, and the gradients."""

    def of(rows, rest):
        columns = tuple(zip(*rows, strict=True))
        square = tuple(_dot(columns[i], columns[j]) for i in range(3) for j in range(i, 3))
        return square, tuple(_dot(column, rest) for column in columns)

    squares, gradients = each(of, by_point, residual)
    return scatter(squares, point, zero), scatter(gradients, point, zero)


@kernel(
    by_block=array(SCALAR, "k", 2, 6), residual=array(SCALAR, "k", 2), block=index("k", into="blocks"),
    zero=array(SCALAR, "blocks"), returns=array(SCALAR, "blocks", 6),
)  # fmt: skip
def block_gradients(by_block, residual, block, zero):
    """Sum the gradients by blocks of six parameters."""
    return scatter(each(lambda rows, rest: tuple(_dot(c, rest) for c in zip(*rows, strict=True)), by_block, residual),
                   block, zero)  # fmt: skip


@kernel(
    first=array(SCALAR, "k", 2, 6), second=array(SCALAR, "k", 2, 6), pair=index("k", into="pairs"),
    zero=array(SCALAR, "pairs"), returns=array(SCALAR, "pairs", 6, 6),
)  # fmt: skip
def block_products(first, second, pair, zero):
    """Sum the products of derivatives by two blocks, for pairs of blocks."""
    return scatter(each(_product, first, second), pair, zero)


@kernel(
    by_block=array(SCALAR, "k", 2, 6), by_point=array(SCALAR, "k", 2, 3), coupling=index("k", into="couplings"),
    zero=array(SCALAR, "couplings"), returns=array(SCALAR, "couplings", 6, 3),
)  # fmt: skip
def coupling_sums(by_block, by_point, coupling, zero):
    """Sum the products of derivatives by a block and by a point."""
    return scatter(each(_product, by_block, by_point), coupling, zero)


@kernel(square=SYMMETRIC, gradient=array(SCALAR, 3), damping=SCALAR, returns=(SYMMETRIC, array(SCALAR, 3)))
def point_root(square, gradient, damping):
    """Compute the inverse of the Cholesky factor L of the equations of a point, and the product with its gradient.

    Parameters
    ----------
    square
        The upper triangle, row by row.
    gradient
    damping
        The relative increment of the diagonal. Coordinates without influence are not changed by the solution.

    Returns
    -------
    inverse
        The lower triangle of the inverse of L, row by row; a row of zeros for a pivot that is not positive.
    reduced
        The inverse times the gradient.
    """
    xx, xy, xz, yy, yz, zz = square
    more = 1 + damping
    a = _inverse_root(xx * more)
    ba, ca = xy * a, xz * a
    b = _inverse_root(yy * more - ba * ba)
    cb = (yz - ba * ca) * b
    c = _inverse_root(zz * more - ca * ca - cb * cb)
    ib = -b * ba * a
    ic = -c * (ca * a + cb * ib)
    inverse = (a, ib, b, ic, -c * cb * b, c)
    g = gradient
    return inverse, (a * g[0], ib * g[0] + b * g[1], ic * g[0] + inverse[4] * g[1] + c * g[2])


def _inverse_root(pivot):
    usable = pivot > TINY
    return select(usable, 1 / ga.sqrt(select(usable, pivot, 1)), 0)


@kernel(coupling=COUPLING, inverse=SYMMETRIC, returns=COUPLING)
def scaled_coupling(coupling, inverse):
    """Multiply a coupling by the transposed inverse root of its point."""
    a, ib, b, ic, cb, c = inverse
    return tuple((a * x, ib * x + b * y, ic * x + cb * y + c * z) for x, y, z in coupling)


COUPLINGS = array(SCALAR, "couplings", 6, 3)


@kernel(
    coupling=COUPLINGS, first=index("products", into="couplings"), second=index("products", into="couplings"),
    pair=index("products", into="pairs"), zero=array(SCALAR, "pairs"), returns=array(SCALAR, "pairs", 6, 6),
)  # fmt: skip
def eliminated_points(coupling, first, second, pair, zero):
    """Sum the products of scaled couplings of the same point, for pairs of blocks: what elimination subtracts."""

    def of(a, b):
        return tuple(tuple(_dot(x, y) for y in b) for x in a)

    return scatter(each(of, gather(coupling, first), gather(coupling, second)), pair, zero)


@kernel(
    coupling=COUPLINGS, block=index("couplings", into="blocks"), point=index("couplings", into="points"),
    reduced=array(SCALAR, "points", 3), zero=array(SCALAR, "blocks"), returns=array(SCALAR, "blocks", 6),
)  # fmt: skip
def eliminated_gradients(coupling, block, point, reduced, zero):
    """Sum the products of scaled couplings with the reduced gradients of their points."""
    rows = each(lambda a, g: tuple(_dot(row, g) for row in a), coupling, gather(reduced, point))
    return scatter(rows, block, zero)


@kernel(
    coupling=COUPLINGS, block=index("couplings", into="blocks"), point=index("couplings", into="points"),
    change=array(SCALAR, "blocks", 6), reduced=array(SCALAR, "points", 3), inverse=array(SCALAR, "points", 6),
    zero=array(SCALAR, "points"), returns=array(SCALAR, "points", 3),
)  # fmt: skip
def point_changes(coupling, block, point, change, reduced, inverse, zero):
    """Compute the changes of points from those of the blocks of parameters: the back substitution."""

    def of(a, d):
        return tuple(_dot(column, d) for column in zip(*a, strict=True))

    sums = scatter(each(of, coupling, gather(change, block)), point, zero)

    def solved(s, g, root):
        a, ib, b, ic, cb, c = root
        x, y, z = (-(p + q) for p, q in zip(s, g, strict=True))
        return a * x + ib * y + ic * z, b * y + cb * z, c * z

    return each(solved, sums, reduced, inverse)


@kernel(
    coupling=COUPLINGS, first=index("products", into="couplings"), second=index("products", into="couplings"),
    pair=index("products", into="pairs"), point=index("products", into="points"), share=array(SCALAR, "products"),
    covariance=array(SCALAR, "pairs", 6, 6), zero=array(SCALAR, "points"), returns=array(SCALAR, "points", 6),
)  # fmt: skip
def spread_of_points(coupling, first, second, pair, point, share, covariance, zero):
    """Sum the covariances of blocks, seen through scaled couplings: what the parameters of cameras add to points.

    `share` is 1 for products of a coupling with itself and 2 for others. The sums are upper triangles, row by row.
    """

    def of(a, b, c, times):
        middle = [tuple(_dot(row, column) for column in zip(*b, strict=True)) for row in c]
        left = tuple(zip(*a, strict=True))
        full = [[_dot(x, y) for y in zip(*middle, strict=True)] for x in left]
        return tuple(times * HALF * (full[i][j] + full[j][i]) for i in range(3) for j in range(i, 3))

    rows = each(of, gather(coupling, first), gather(coupling, second), gather(covariance, pair), share)
    return scatter(rows, point, zero)
