"""Nodes of a neural gas as motors: cells of samples, motions of nodes, circles and normals of their neighbours.

A node of a contour is a motor of G(2,0,1), a node of a surface one of G(3,0,1). It takes the origin to the place of the
node, and the last coordinate axis to its unit normal, so that it transports any entity that is given at the origin.
"""

import gacompiler as ga
from gacompiler import SCALAR, array, each, gather, index, kernel, scan, scatter
from gacompiler.algebra.catalog import CGA2, PGA2, PGA3
from gacompiler.specs import cga2, pga2, pga3
from gacompiler.specs.families.plane_based import coordinates

PAIRS, TRIPLES, NUMBERS = array(SCALAR, "n", 2), array(SCALAR, "n", 3), array(SCALAR, "n")
SMALL = 1e-200
"""Below the square of any length."""

circle_from_points = cga2.circle_from_points.function
motor_between_planes = pga3.motor_between_planes.function
motor_between_lines = pga2.motor_between_lines.function


# Cells of samples.


@kernel(
    samples=array(SCALAR, "s", 3), weights=array(SCALAR, "s"), winner=index("s", into="n"), nodes=TRIPLES,
    returns=(TRIPLES, NUMBERS, NUMBERS),
)  # fmt: skip
def sums_of_cells(samples, weights, winner, nodes):
    """Sum over the samples of each node: weighted differences from the node, weights, and weighted squared distances.

    Parameters
    ----------
    samples, weights
    winner
        For each sample the node that is nearest to it.
    nodes
        Places of nodes.
    """

    def of(p, weight, node):
        difference = tuple(a - b for a, b in zip(p, node, strict=True))
        square = sum(d * d for d in difference)
        return tuple(weight * d for d in difference), weight, weight * square

    return scatter(each(of, samples, weights, gather(nodes, winner)), winner, nodes[0])


# Motions of nodes.


@kernel(motors=array(PGA3.MOTOR, "n"), places=TRIPLES, normals=TRIPLES, returns=array(PGA3.MOTOR, "n"))
def moved_surface_nodes(motors, places, normals):
    """Turn each node about its place by the smallest rotation to its new unit normal, and translate it to its place."""

    def of(m, p, n):
        plane = ga.sandwich(m, PGA3.multivector({"e3": 1}))
        at = coordinates(ga.sandwich(m, PGA3.multivector({"e123": 1})))
        offset = sum(a * b for a, b in zip(at, n, strict=True))
        towards = ga.assemble(PGA3, {"e1": n[0], "e2": n[1], "e3": n[2], "e0": -offset})
        shift = tuple(a - b for a, b in zip(p, at, strict=True))
        translator = ga.assemble(PGA3, {"1": 1, "e01": -shift[0] / 2, "e02": -shift[1] / 2, "e03": -shift[2] / 2})
        return translator * motor_between_planes(plane, towards) * m

    return each(of, motors, places, normals)


@kernel(motors=array(PGA2.MOTOR, "n"), places=PAIRS, normals=PAIRS, returns=array(PGA2.MOTOR, "n"))
def moved_contour_nodes(motors, places, normals):
    """Turn each node about its place by the smallest rotation to its new unit normal, and translate it to its place."""

    def of(m, p, n):
        line = ga.sandwich(m, PGA2.multivector({"e2": 1}))
        at = coordinates(ga.sandwich(m, PGA2.multivector({"e12": 1})))
        towards = ga.assemble(PGA2, {"e1": n[0], "e2": n[1], "e0": -(at[0] * n[0] + at[1] * n[1])})
        translator = ga.assemble(PGA2, {"1": 1, "e01": (at[0] - p[0]) / 2, "e02": (at[1] - p[1]) / 2})
        return translator * motor_between_lines(line, towards) * m

    return each(of, motors, places, normals)


# Contours.


@kernel(points=PAIRS, before=index("n", into="n"), after=index("n", into="n"), returns=(PAIRS, NUMBERS))
def circles_of_neighbours(points, before, after):
    """Compute the unit normal and the curvature of the circle through each point and its two neighbours.

    The normal is to the right of the direction of the contour, thus outside of a counter-clockwise one, where the
    curvature of a convex contour is positive.
    """

    def of(a, b, c):
        # Relative to the point, so that nothing is lost far from the origin, and neighbours may be equal.
        one, three = ([u - v for u, v in zip(p, b, strict=True)] for p in (a, c))
        circle = ga.polarity(circle_from_points(*(ga.assemble(CGA2, _embedded(p)) for p in (one, (0, 0), three))))
        # The dual circle is a multiple of ``centre + e0 + ... einf``: a line has no e0, and its normal is what remains.
        weight, x, y = circle["e0"], circle["e1"], circle["e2"]
        square = x * x + y * y
        length = ga.sqrt(ga.select(square > SMALL, square, 1))
        return (-x / length, -y / length), weight / length

    return each(of, gather(points, before), points, gather(points, after))


def _embedded(p):
    return {"e1": p[0], "e2": p[1], "e0": 1, "einf": (p[0] * p[0] + p[1] * p[1]) / 2}


@kernel(
    samples=array(SCALAR, "s", 2), first=index("s", into="n"), second=index("s", into="n"), nodes=PAIRS,
    returns=(array(SCALAR, "s"), array(SCALAR, "s")),
)  # fmt: skip
def distances_from_chords(samples, first, second, nodes):
    """Compute for each sample the squared distance from the chord of two nodes, and the position along it in [0, 1]."""

    def of(p, a, b):
        along = (b[0] - a[0], b[1] - a[1])
        square = along[0] * along[0] + along[1] * along[1]
        product = (p[0] - a[0]) * along[0] + (p[1] - a[1]) * along[1]
        t = ga.maximum(0, ga.minimum(1, product / ga.select(square > SMALL, square, 1)))
        x, y = p[0] - a[0] - t * along[0], p[1] - a[1] - t * along[1]
        return x * x + y * y, t

    return each(of, samples, gather(nodes, first), gather(nodes, second))


# Surfaces.

TRIANGLE = {name: index("t", into="n") for name in ("a", "b", "c")}


@kernel(points=TRIPLES, **TRIANGLE, returns=TRIPLES)
def normals_of_triangles(points, a, b, c):
    """Sum the planes of triangles onto their corners: normals of corners, times twice the area of their triangles."""

    def of(p, q, r):
        plane = _point(p) & _point(q) & _point(r)
        return tuple(plane[name] for name in ("e1", "e2", "e3"))

    onto = points[0]
    normals = each(of, *(gather(points, corner) for corner in (a, b, c)))
    return scatter(normals, c, onto, scatter(normals, b, onto, scatter(normals, a, onto)))


def _point(p):
    return ga.assemble(PGA3, {"e123": 1, "e023": -p[0], "e013": p[1], "e012": -p[2]})


@kernel(points=TRIPLES, normals=TRIPLES, a=index("e", into="n"), b=index("e", into="n"), returns=(NUMBERS, NUMBERS))
def curvatures_of_edges(points, normals, a, b):
    """Sum over the edges from a to b of each point a the curvature of the sphere that is tangent at a and contains b.

    Returns
    -------
    curvatures
        Positive where the surface is convex.
    counts
        The number of edges.
    """

    def of(p, q, n):
        d = tuple(y - x for x, y in zip(p, q, strict=True))
        square = sum(x * x for x in d)
        return -2 * sum(x * y for x, y in zip(d, n, strict=True)) / ga.select(square > SMALL, square, 1), 1

    return scatter(each(of, gather(points, a), gather(points, b), gather(normals, a)), a, points[0])


# Flow of gradient vectors.


@kernel(lower=NUMBERS, middle=NUMBERS, upper=NUMBERS, right=NUMBERS, returns=NUMBERS)
def solve_tridiagonal(lower, middle, upper, right):
    """Solve a tridiagonal system by elimination without pivoting, as for diagonally dominant matrices.

    Parameters
    ----------
    lower, middle, upper
        Row i is ``lower[i] x[i - 1] + middle[i] x[i] + upper[i] x[i + 1]``; the first `lower` and the last `upper`
        are not used.
    right
        The right-hand side.
    """

    def forward(carry, a, b, c, d):
        ratio, value = carry
        scale = 1 / (b - a * ratio)
        return c * scale, (d - a * value) * scale

    ratios, values = scan(forward, (0, 0), lower, middle, upper, right)
    return scan(lambda x, ratio, value: value - ratio * x, 0, ratios, values, reverse=True)
