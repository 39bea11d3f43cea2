"""The projective plane in the exterior algebra of homogeneous coordinates.

Points are (x, y, w) and lines ``a x + b y + c w = 0`` are (a, b, c), both vectors. The join of two points and the meet
of two lines are the dual of their outer product; a bracket, the outer product of three, is a determinant. A conic is
the six numbers (a, b, c, d, e, f) of ``a x**2 + b x y + c y**2 + d x w + e y w + f w**2 = 0``.
"""

import gacompiler as ga
from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import orthogonal

PROJECTIVE2 = orthogonal(3, name="PROJECTIVE2")
VECTOR = PROJECTIVE2.layout("VECTOR", "e1 e2 e3")
MATRIX, PIXEL, CONIC = array(SCALAR, 3, 3), array(SCALAR, 2), array(SCALAR, 6)
INVARIANTS = array(SCALAR, 5)
NAMES = ("e1", "e2", "e3")
NEXT = ((1, 2), (2, 0), (0, 1))


def _bracket(a, b, c):
    return (a ^ b ^ c)["e123"]


@kernel(a=VECTOR, b=VECTOR, c=VECTOR)
def bracket(a, b, c):
    """Compute the determinant of three points, or of three lines, as rows; 0 if they are collinear, or concurrent."""
    return _bracket(a, b, c)


@kernel(a=VECTOR, b=VECTOR, returns=VECTOR)
def join_points(a, b):
    """Compute the line through two points, or the point in which two lines meet; 0 if they coincide."""
    return ga.undual(a ^ b)


@kernel(matrix=MATRIX, pixel=PIXEL, returns=PIXEL)
def transform_point(matrix, pixel):
    """Transform a point of the plane by a homography; division by 0 if its image is at infinity."""
    x, y, w = (row[0] * pixel[0] + row[1] * pixel[1] + row[2] for row in matrix)
    return x / w, y / w


@kernel(matrix=array(VECTOR, 3), returns=array(VECTOR, 3))
def line_homography(matrix):
    """Compute the matrix for lines of a homography of points given by its rows: its outermorphism, the cofactors."""
    return tuple(ga.undual(matrix[k] ^ matrix[m]) for k, m in NEXT)


@kernel(pixel=PIXEL, partner=PIXEL, returns=array(SCALAR, 2, 9))
def homography_equations(pixel, partner):
    """Compute the coefficients of a homography H, row by row, in two entries of the equation ``x' x H x = 0``."""
    x, (u, v) = (*pixel, 1), partner
    nothing = (0, 0, 0)
    return (*nothing, *(-a for a in x), *(v * a for a in x)), (*x, *nothing, *(-u * a for a in x))


@kernel(points=array(SCALAR, 4, 2))
def cross_ratio_on_line(points):
    """Compute the cross-ratio {0, 1; 2, 3} of four points (x, w) of a line."""

    def bracket_of(i, j):
        return points[i][0] * points[j][1] - points[j][0] * points[i][1]

    return bracket_of(0, 2) * bracket_of(1, 3) / (bracket_of(0, 3) * bracket_of(1, 2))


@kernel(points=array(VECTOR, 5))
def cross_ratio_of_lines(points):
    """Compute the cross-ratio {1, 2; 3, 4} of the lines that join point 0 with each of the other four points."""

    def bracket_of(i, j):
        return _bracket(points[0], points[i], points[j])

    return bracket_of(1, 3) * bracket_of(2, 4) / (bracket_of(1, 4) * bracket_of(2, 3))


@kernel(a=INVARIANTS, b=INVARIANTS, deviations_a=INVARIANTS, deviations_b=INVARIANTS, variance=SCALAR, floor=SCALAR)
def unlikeness(a, b, deviations_a, deviations_b, variance, floor):
    """Compute minus twice the log-likelihood that two sets of five invariants are those of the same points.

    It is the sum of the squared differences divided by their noise variances and of the logarithms of these variances:
    `variance` times the squared deviations, which are those for noise of 1, plus `floor`.
    """
    total, product = 0, 1
    for x, y, p, q in zip(a, b, deviations_a, deviations_b, strict=True):
        noise = variance * (p * p + q * q) + floor
        total, product = total + (x - y) * (x - y) / noise, product * noise
    return total + ga.log(product)


@kernel(points=array(VECTOR, 5), returns=CONIC)
def conic_from_points(points):
    """Compute the conic through five points: all x with ``[acx] [bdx] [ade] [bce] = [adx] [bcx] [ace] [bde]``.

    All six numbers are 0 if four points are collinear or two coincide; then the conic is not unique.
    """
    a, b, c, d, e = points
    rows = [[ga.undual(p ^ q)[name] for name in NAMES] for p, q in ((a, c), (b, d), (a, d), (b, c))]
    left, right = _bracket(a, d, e) * _bracket(b, c, e), _bracket(a, c, e) * _bracket(b, d, e)

    def term(i, j):
        (p, q, r, s) = rows
        if i == j:
            return left * p[i] * q[i] - right * r[i] * s[i]
        return left * (p[i] * q[j] + p[j] * q[i]) - right * (r[i] * s[j] + r[j] * s[i])

    return term(0, 0), term(0, 1), term(1, 1), term(0, 2), term(1, 2), term(2, 2)


@kernel(points=array(VECTOR, 6))
def pascal_bracket(points):
    """Compute the bracket of the intersections of opposite sides of a hexagon; 0 if it is on a conic (Pascal)."""
    a, b, c, d, e, f = points

    def meet(p, q, r, s):
        return ga.undual(ga.undual(p ^ q) ^ ga.undual(r ^ s))

    return _bracket(meet(a, b, d, e), meet(b, c, e, f), meet(c, d, f, a))


@kernel(homography=MATRIX, returns=array(SCALAR, 2, 6))
def circular_point_equations(homography):
    """Compute the real and imaginary part of a conic's equation at the image of a circular point.

    The results are the coefficients of the six numbers of the conic. A homography from a plane to its image takes the
    circular point (1, i, 0) to ``h1 + i h2``.
    """
    a, b = ([row[k] for row in homography] for k in (0, 1))

    def part(i, j, real):
        if real:
            return a[i] * a[j] - b[i] * b[j]
        return a[i] * b[j] + a[j] * b[i]

    places = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))
    return tuple(tuple(part(i, j, real) for i, j in places) for real in (True, False))
