"""Models of spheres: spheres through points, spheres fitted to points, and soft assignments of balls, in G(4,1).

A ball is a row of four numbers, its centre and its radius. Its dual sphere in G(4,1) is ``S = c - r**2/2 einf``, where
c is the conformal point of the centre. The square of a difference of two dual spheres is the squared distance of their
centres and does not contain the radii, because they are in the coefficient of the null vector ``einf`` alone. The cost
of a pair of balls therefore adds the squared difference of the lengths of S and S', which are the radii.
"""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, array, each, kernel, total
from gacompiler.algebra.catalog import CGA3
from gacompiler.specs.families.conformal_space import ConformalSpace

POINT = CGA3.POINT
COORDINATES, BALL = array(SCALAR, 3), array(SCALAR, 4)
BALLS, NUMBERS = array(SCALAR, "m", 4, shared=True), array(SCALAR, "m", shared=True)
EINF = CGA3.basis()[4]
HALF = Fraction(1, 2)
AXES = ("e1", "e2", "e3")
space = ConformalSpace(CGA3)


def _dual_sphere(ball):
    x, y, z, r = ball
    return space.point(x, y, z) - r * r / 2 * EINF


@kernel(a=POINT, b=POINT, c=POINT, d=POINT, returns=(COORDINATES, SCALAR, SCALAR))
def circumsphere(a, b, c, d):
    """Compute the sphere through four points, the dual of ``a ^ b ^ c ^ d``.

    Returns
    -------
    centre
    radius_squared
    volume
        Six times the signed volume of the tetrahedron. If it is 0, there is no sphere, and the other results are those
        of a weight of 1.
    """
    dual = (a ^ b ^ c ^ d) * CGA3.pseudoscalar
    volume = dual["e0"]
    weight = ga.select((volume <= 0) * (volume >= 0), 1, volume)
    centre = tuple(dual[axis] / weight for axis in AXES)
    return centre, ga.scalar_product(dual, dual) / (weight * weight), volume


@kernel(ball=BALL, points=array(SCALAR, "n", 3), returns=BALL)
def ball_of_points(ball, points):
    """Fit a sphere to points near the surface of a ball, by one linear solve in conformal space.

    The sphere S minimises the sum of the squares of ``X . S``, which are those of the power of the points, with the
    coefficient of e0 fixed to 1. The given ball is the origin and the unit of the solve, and has the weight of one
    point in it, so that the solution exists and remains near the ball where the points do not determine it.
    """
    x, y, z, r = ball

    def row(point):
        u = tuple((p - c) / r for p, c in zip(point, (x, y, z), strict=True))
        half = (u[0] * u[0] + u[1] * u[1] + u[2] * u[2]) / 2
        # ``X . S`` is the product of these with the centre and s, minus half, where s is the coefficient of -einf.
        values = (*u, -1)
        products = tuple(values[i] * values[j] for i in range(4) for j in range(i, 4))
        return products, tuple(v * half for v in values)

    products, sums = total(row, points)
    matrix = [[None] * 4 for _ in range(4)]
    pairs = [(i, j) for i in range(4) for j in range(i, 4)]
    for (i, j), value in zip(pairs, products, strict=True):
        matrix[i][j] = matrix[j][i] = value + (1 if i == j else 0)
    # For the ball itself, centre 0 and radius 1, s is -1/2.
    right = (*sums[:3], sums[3] - HALF)
    (a, b, c, s), _ = ga.solve_symmetric(matrix, right)
    square = ga.maximum(a * a + b * b + c * c - 2 * s, 0)
    return x + r * a, y + r * b, z + r * c, r * ga.sqrt(square)


@kernel(ball=BALL, others=BALLS, scale=SCALAR, weight=SCALAR, returns=array(SCALAR, "m"))
def affinities(ball, others, scale, weight):
    """Compute ``exp(-cost/scale)`` of a ball with each of m balls.

    The cost is ``(S - S')**2 + weight (r - r')**2``, where S and S' are the dual spheres.
    """
    own, radius = _dual_sphere(ball), ball[3]

    def affinity(other):
        between, gap = own - _dual_sphere(other), radius - other[3]
        return ga.exp(-(ga.scalar_product(between, between) + weight * gap * gap) / scale)

    return each(affinity, others)


@kernel(row=array(SCALAR, "m"), columns=NUMBERS, others=BALLS, outlier=SCALAR, returns=(SCALAR, SCALAR, BALL))
def balanced_row(row, columns, others, outlier):
    """Scale a row of affinities by factors of columns so that it sums to 1, with the affinity of an outlier.

    Returns
    -------
    factor
        The factor of the row.
    matched
        The sum of the scaled row without the outlier.
    mean
        The sum of the balls with the weights of the scaled row, divided by `matched`.
    """

    def part(value, column, other):
        share = value * column
        return share, tuple(share * x for x in other)

    matched, sums = total(part, row, columns, others)
    factor = 1 / (matched + outlier)
    safe = ga.select(matched <= 0, 1, matched)
    return factor, matched * factor, tuple(x / safe for x in sums)
