"""Clouds of points at surfaces, by planes and motors of G(3,0,1): planes of cells, and steps that align points.

A perturbation of a motor is a motion in its own frame, a rotation vector and a translation, as in `motor_graphs`.
"""

import gacompiler as ga
from gacompiler import SCALAR, array, assemble, kernel, pick, select, total
from gacompiler.algebra.catalog import PGA3
from gacompiler.specs.families.covariances import cross, square, triangle
from gacompiler.specs.families.plane_based import coordinates

MOTOR, POINT, PLANE = PGA3.MOTOR, PGA3.POINT, PGA3.PLANE
VECTOR, SIX, SURFACE = array(SCALAR, 3), array(SCALAR, 6), array(SCALAR, 5)
CONTINUES = 10
"""Points are on a plane if they spread along it by more than this times the variance across it and that of readings."""
NOTHING = (0, 0, 0, 0, 0)


@kernel(count=SCALAR, sums=VECTOR, products=SIX, centre=VECTOR, noise=SCALAR, returns=(VECTOR, SURFACE))
def plane_of_points(count, sums, products, centre, noise):
    """Fit a plane to the points of a cell.

    Parameters
    ----------
    count
        The number of points, at least 1.
    sums, products
        The sums of their coordinates relative to the centre, and of the products of these: xx, xy, xz, yy, yz, zz.
    centre
    noise
        The standard deviation of readings.

    Returns
    -------
    mean
        Of the points.
    surface
        The plane with a unit normal, e1 e2 e3 e0, and the variance of the tilt of the normal, in radians, about the
        direction in which points spread most: -1 if the points are not on a plane. Those along a line are not: they may
        be a ring of beams on a plane, which moves with the lidar.
    """
    offset = tuple(s / count for s in sums)
    pairs = triangle(tuple(tuple(a * b for b in offset) for a in offset))
    spread = square(tuple(p / count - q for p, q in zip(products, pairs, strict=True)), 3)
    values, vectors = ga.eigenvectors_symmetric(spread)
    least, middle = ga.maximum(values[0], 0) + noise * noise, values[1]
    is_plane = middle > CONTINUES * least
    mean = tuple(a + b for a, b in zip(offset, centre, strict=True))
    normal = tuple(row[0] for row in vectors)
    height = -sum(n * x for n, x in zip(normal, mean, strict=True))
    tilt = select(is_plane, least / (count * select(is_plane, middle, 1)), -1)
    return mean, (*normal, height, tilt)


@kernel(
    m=MOTOR, points=array(POINT, "n"), rows=array(SCALAR, "n"), surfaces=array(SCALAR, "k", 5), scale=SCALAR,
    returns=(array(SCALAR, 21), SIX, array(SCALAR, 4)),
)  # fmt: skip
def sums_at_planes(m, points, rows, surfaces, scale):
    """Sum the normal equations of the distances of moved points from planes, by perturbations of a motor.

    Parameters
    ----------
    m
        The motor that moves the points.
    points
        Points in its own frame.
    rows
        For each point the row of its plane; -1 for none.
    surfaces
        Planes and variances, as of `plane_of_points`.
    scale
        The distance at which points lose three quarters of their weight.

    Returns
    -------
    triangle, gradient
        The upper triangle of the matrix, and the derivative of half of the sum.
    numbers
        The number of points with planes, the sums of weights and of weighted squared distances, and the information
        about each direction that tilts of normals by chance would give.
    """

    def of(p, row):
        x, y, z, height, tilt = pick(surfaces, row, NOTHING)
        is_known = row >= 0
        # The distance is the join of the point and the plane, here in the frame of the motor.
        plane = assemble(PGA3, {"e1": x, "e2": y, "e3": z, "e0": height})
        own = ga.sandwich(~m, plane)
        normal = tuple(own[name] for name in ("e1", "e2", "e3"))
        at = coordinates(p)
        distance = sum(a * b for a, b in zip(normal, at, strict=True)) + own["e0"]
        ratio = 1 / (1 + distance * distance / (scale * scale))
        weight = is_known * ratio * ratio
        # A translation v and a rotation w move the point by v + w x p.
        line = (*cross(at, normal), *normal)
        entries = tuple(weight * line[i] * line[j] for i in range(6) for j in range(i, 6))
        sums = (is_known, weight, weight * distance * distance, weight * tilt)
        return entries, tuple(weight * distance * x for x in line), sums

    return total(of, points, rows)
