"""Poses of objects from their images: points, straight edges, and silhouettes of spheres, cylinders and circles.

Points, lines, planes and motors are those of G(3,0,1), as in the module `pga3`. The pose of an object is the motor m
from its frame to the world. Its perturbation is ``m exp(B)`` for a bivector B, a motion in the frame of the object.

A camera is three planes, the rows of its matrix: the quotients of the distances of a point from them are its pixel. The
pixel (u, v) is also the line in which the planes ``first - u third`` and ``second - v third`` meet, the line of sight.
An edge, a silhouette or a circle is seen at this pixel if the line of sight meets or touches it. The residual is the
distance in pixels, to first order, from the nearest pixel for which that is true.
"""

from fractions import Fraction
from typing import Any, NamedTuple

import gacompiler as ga
from gacompiler import SCALAR, absolute, array, assemble, each, gather, iterate, kernel, select, total
from gacompiler.specs.families.covariances import choose, congruent, cross, dot, square
from gacompiler.specs.families.misfits import explained_of
from gacompiler.specs.families.sights import (
    ANCHORS,
    CAMERA,
    DIRECTION_OF_LINE,
    KINDS,
    MODEL,
    MOTOR,
    TINY,
    in_object,
    line_of,
    place_of,
    plane_of,
    planes_of,
    scalar_of,
    tables,
)

RIDGE = Fraction(1, 10**11)
"""Part of the trace that is added to the diagonal: motions that change nothing in the images have no step."""
FIRST_DAMPING, LARGEST_DAMPING = Fraction(1, 10**4), 10**9
STEPS = 10
"""Largest number of steps of a call. Descents that need more continue in further calls."""
SMALL_PART = Fraction(1, 10**4)
"""Part of the sum of squares: if a step decreases it by less, it is the last one."""
UNKNOWN = 10**30
"""The sum of squares before the first step."""
PLAIN_STAGE, ROBUST_STAGE, ENDED = 1, 2, 3


def _share(residuals, weight, scale):
    """Return the weight of an estimate after Geman and McClure, and the robust square."""
    far = sum(r * r for r, *_ in residuals)
    ratio = 1 / (1 + far / (scale * scale))
    return weight * ratio * ratio, weight * far * ratio


def _sums(m, values, scale, metric):
    """Return the upper triangle and the right-hand side of the normal equations, and the sum of robust squares."""
    table, slope, cost, unit = (0,) * 21, (0,) * 6, 0, values["unit"]
    turned = in_object(m, values["cameras"])
    for kind, elements, pixels, cameras, weights in tables(values):

        def of(element, pixel, weight, camera, kind=kind):
            found = kind(camera, pixel, element, metric)
            share, far = _share(found, weight, scale)
            rows = [(r, [*row[:3], *(unit * x for x in row[3:])]) for r, row, _ in found]
            square_sums = tuple(share * sum(row[i] * row[j] for _, row in rows) for i in range(6) for j in range(i, 6))
            return square_sums, tuple(share * sum(r * row[i] for r, row in rows) for i in range(6)), far

        more, right, far = total(of, elements, pixels, weights, gather(turned, cameras))
        table = tuple(a + b for a, b in zip(table, more, strict=True))
        slope = tuple(a + b for a, b in zip(slope, right, strict=True))
        cost = cost + far
    return table, slope, cost


class Descent(NamedTuple):
    """The best pose of a stage so far with its normal equations, and the next one to try."""

    motor: Any
    candidate: Any
    table: Any
    slope: Any
    cost: Any
    damping: Any
    gain: Any
    stage: Any
    done: Any


def _either(condition, a, b):
    return assemble(a.algebra, {blade: select(condition, a[blade], b[blade]) for blade in MOTOR.blades})


def _step(now, values):
    """Compare a candidate with the best pose, and compute the next one; after the end of a stage, begin the next."""
    scale = select(now.stage < ROBUST_STAGE, values["wide"], values["scale"])
    metric = select(now.stage < PLAIN_STAGE, values["metric"], 0)
    table, slope, cost = _sums(now.candidate, values, scale, metric)
    better = cost < now.cost
    motor = _either(better, now.candidate, now.motor)
    table, slope = choose(better, table, now.table), choose(better, slope, now.slope)
    cost = select(better, cost, now.cost)
    damping = select(better, now.damping / 10, now.damping * 20)
    matrix = square(table, 6)
    trace = sum(matrix[k][k] for k in range(6))
    damped = [
        [matrix[j][k] + ((damping * matrix[k][k] + RIDGE * trace + TINY) if j == k else 0) for k in range(6)]
        for j in range(6)
    ]
    solution, _ = ga.solve_symmetric(damped, slope)
    gain = sum(s * x for s, x in zip(slope, solution, strict=True))
    sizes = [1, 1, 1, *[values["unit"]] * 3]
    candidate = motor * ga.exp(line_of([-s * x for s, x in zip(sizes, solution, strict=True)]))
    fine = gain <= values["tolerance"] + SMALL_PART * cost
    ended = select(fine, 1, select(damping > LARGEST_DAMPING, 1, 0))
    follows = select(now.stage < ROBUST_STAGE, ended, 0)
    motor = _either(follows * fine > 0, candidate, motor)
    cost, damping = select(follows > 0, UNKNOWN, cost), select(follows > 0, FIRST_DAMPING, damping)
    candidate = _either(follows > 0, motor, candidate)
    return Descent(motor, candidate, table, slope, cost, damping, gain, now.stage + follows, ended - follows)


@kernel(
    **MODEL, unit=SCALAR, scale=SCALAR, wide=SCALAR, tolerance=SCALAR, metric=SCALAR, stage=SCALAR, damping=SCALAR,
    returns=(MOTOR, array(SCALAR, 21), array(SCALAR, 4)),
)  # fmt: skip
def refine_pose(
    m, cameras, points, points_pixels, points_cameras, points_weights, edges, edges_pixels, edges_cameras,
    edges_weights, balls, balls_pixels, balls_cameras, balls_weights, tubes, tubes_pixels, tubes_cameras,
    tubes_weights, rims, rims_pixels, rims_cameras, rims_weights, unit, scale, wide, tolerance, metric, stage, damping,
):  # fmt: skip
    """Refine the pose of an object by Levenberg-Marquardt steps on motors.

    Parameters
    ----------
    m
        A pose to begin with.
    cameras
        For each camera the three planes of its matrix.
    points, edges, balls, tubes, rims
        Elements of the object, one for each pixel: points; lines; centres and radii of spheres; axes and radii of
        cylinders; centres, unit normals and radii of circles.
    unit
        The length, about the size of the object, that is equivalent to a rotation by one radian.
    scale
        The distance in pixels at which measurements lose three quarters of their weight, in the last stage.
    wide
        The same for the stages before it, such as 1e6 for plain least squares.
    tolerance
        Steps end if the next one, which is still taken, is expected to decrease the sum of squares by less than this
        and a small part of it.
    metric
        The number of pixels per unit of length in stage 0. Descents from far away need this stage; its minimum is not
        that of distances in pixels.
    stage
        The first of three stages: 0 for distances from silhouettes at the object, 1 for distances in pixels, both with
        the wide scale, and 2 for distances in pixels with the other scale, which is always the last stage.
    damping
        The factor of the diagonal of the normal equations that is added to it: 1e-4, or the result of a previous call.

    Returns
    -------
    motor
    triangle
        The upper triangle of the normal equations by the coefficients of B, with translations in multiples of `unit`,
        at the last pose that was compared.
    numbers
        The sum of robust squares, or 1e30 if it is not at a minimum; the stage with which a further call continues, or
        3 if the last one ended; the damping for this call; and the number of steps.
    """
    values = dict(locals())

    def body(now):
        return _step(now, values)

    start = Descent(m, m, (0,) * 21, (0,) * 6, UNKNOWN, damping, UNKNOWN, stage, 0)
    found, ended, steps = iterate(body, start, lambda _, new: new.done > 0, STEPS)
    fine = found.gain <= tolerance + SMALL_PART * found.cost
    motor = _either(fine, found.candidate, found.motor)
    # The first step of the next call divides the damping.
    now = select(ended > 0, ENDED, found.stage), 10 * found.damping
    return motor, found.table, (select(ended * fine > 0, found.cost, UNKNOWN), *now, steps)


def _covariance(triangle, unit, centre):
    """Return the inverse of the normal equations by rotation vectors and displacements, and a bound of its condition.

    The bound is the product of the traces of the matrix and its inverse.
    """
    matrix = square(triangle, 6)
    inverse, pivots = ga.solve_symmetric(matrix, [[int(i == j) for j in range(6)] for i in range(6)])
    traces = sum(matrix[k][k] for k in range(6)) * sum(absolute(inverse[k][k]) for k in range(6))
    turns = [[0, 0, -2, 0, 0, 0], [0, 2, 0, 0, 0, 0], [-2, 0, 0, 0, 0, 0]]
    levers = [cross(column, centre) for column in zip(*turns, strict=True)]
    shifts = [[levers[j][i] + (-2 * unit if j == 3 + i else 0) for j in range(6)] for i in range(3)]
    return congruent([*turns, *shifts], inverse), select(pivots > 0, traces, UNKNOWN)


@kernel(
    **MODEL, triangle=array(SCALAR, 21), unit=SCALAR, centre=array(SCALAR, 3), limit=SCALAR,
    returns=(*(array(SCALAR, name) for name in KINDS), array(SCALAR, 6, 6), array(SCALAR, 5)),
)  # fmt: skip
def judge_pose(
    m, cameras, points, points_pixels, points_cameras, points_weights, edges, edges_pixels, edges_cameras,
    edges_weights, balls, balls_pixels, balls_cameras, balls_weights, tubes, tubes_pixels, tubes_cameras,
    tubes_weights, rims, rims_pixels, rims_cameras, rims_weights, triangle, unit, centre, limit,
):  # fmt: skip
    """Compute distances of pixels from the images of their elements, and the covariance of a pose.

    Parameters
    ----------
    triangle, unit
        As in `refine_pose`.
    centre
        The point of the object whose displacement the covariance describes.
    limit
        Pixels agree with the pose if their distance is at most this one.

    Returns
    -------
    points, edges, balls, tubes, rims
        The distance in pixels of each pixel.
    covariance
        The inverse of the normal equations by the rotation vector and the displacement of the centre, for a noise of
        one pixel.
    numbers
        The sum of the weights of pixels that agree, that of their equations, the weighted sum of their squared
        distances, the number of pixels whose element is not in front of the camera, and a bound of the condition of the
        normal equations, which is too large if they are singular.
    """
    values = dict(locals())
    turned = in_object(m, values["cameras"])
    results, numbers = [], (0, 0, 0, 0)
    for (name, kind), (_, elements, pixels, cameras_of, weights) in zip(KINDS.items(), tables(values), strict=True):

        def of(element, pixel, camera, kind=kind):
            return ga.sqrt(sum(r * r for r, *_ in kind(camera, pixel, element, 0)))

        def behind(element, camera, anchor_of=ANCHORS[name]):
            return select(scalar_of(planes_of(camera)[2] & anchor_of(element)) > 0, 0, 1)

        far = each(of, elements, pixels, gather(turned, cameras_of))
        count, squares = total(lambda f, w: choose(f <= limit, (w, w * f * f), (0, 0)), far, weights)
        hidden = total(behind, elements, gather(turned, cameras_of))
        equations = (2 if name == "points" else 1) * count
        numbers = tuple(a + b for a, b in zip(numbers, (count, equations, squares, hidden), strict=True))
        results.append(far)
    covariance, condition = _covariance(triangle, unit, centre)
    return *results, covariance, (*numbers, condition)


def _centre_of_camera(camera):
    """Return the point in which the three planes of a camera meet."""
    first, second, third = planes_of(camera)
    meet = first ^ second ^ third
    return meet / meet["e123"]


def _coordinates(point):
    return tuple(point[name] for name in ("e032", "e013", "e021"))


N_TERMS = 5
"""The focal length, a radial term of distortion, and the extents of an object along its axes."""


def _place_seen(camera, pixel, turned, shifted):
    """Return the point of an object that is seen at a pixel, by the derivatives of its distance by turns and shifts.

    The former are the cross product of the place and the latter, which leaves out the part along these: it is that of
    the line of sight.
    """
    eye = _coordinates(_centre_of_camera(camera))
    first, second, third = planes_of(camera)
    sight = (first - pixel[0] * third) ^ (second - pixel[1] * third)
    x, y, z = (sight[name] for name in DIRECTION_OF_LINE)
    along = x, -y, z
    across = cross(along, shifted)
    rest = [a - b for a, b in zip(turned, cross(eye, shifted), strict=True)]
    depth = dot(rest, across) / (dot(across, across) + TINY)
    return [a + depth * b for a, b in zip(eye, along, strict=True)]


@kernel(
    **MODEL, unit=SCALAR, scale=SCALAR, lenses=array(SCALAR, "cameras", 3),
    returns=(array(SCALAR, 7 + N_TERMS, 7 + N_TERMS), array(SCALAR, 4)),
)  # fmt: skip
def object_misfits(
    m, cameras, points, points_pixels, points_cameras, points_weights, edges, edges_pixels, edges_cameras,
    edges_weights, balls, balls_pixels, balls_cameras, balls_weights, tubes, tubes_pixels, tubes_cameras,
    tubes_weights, rims, rims_pixels, rims_cameras, rims_weights, unit, scale, lenses,
):  # fmt: skip
    """Compute what other cameras and another size of an object say of the distances of pixels in its pose.

    Parameters
    ----------
    unit, scale
        As in `refine_pose`: distances have the same robust weights.
    lenses
        For each camera the pixel of its axis, and the inverse of its focal length.

    Returns
    -------
    sums
        The sums of products of 12 columns. Six are derivatives by the coefficients of B, as in `refine_pose`. Five are
        those by the focal length and by a radial term of distortion, which all cameras share, and by the extents of the
        object along its axes. The last has the distances.
    explained
        The sum of squares of distances, the part of it across the derivatives by the pose, and what the five and the
        best one of them explain of that part.
    """
    values = dict(locals())
    sums, turned = (0,) * ((7 + N_TERMS) * (8 + N_TERMS) // 2), in_object(m, values["cameras"])
    for name, (kind, elements, pixels, cameras_of, weights) in zip(KINDS, tables(values), strict=True):

        def of(element, pixel, weight, camera, lens, kind=kind, name=name):
            measured = kind(camera, pixel, element, 0)
            share, _ = _share(measured, weight, scale)
            # Derivatives are those at the nearest pixel of the image, which does not depend on the distance.
            near = [x - sum(r * by[k] for r, _, by in measured) for k, x in enumerate(pixel)]
            found = kind(camera, near, element, 0)
            off = [lens[2] * (x - c) for x, c in zip(near, lens[:2], strict=True)]
            far, rows = dot(off, off), []
            for (r, _, _), (_, row, by) in zip(measured, found, strict=True):
                z, y, x, *shifted = (sign * part / 2 for sign, part in zip((-1, 1, -1, -1, -1, -1), row, strict=True))
                place = element if name == "points" else _place_seen(camera, near, (x, y, z), shifted)
                focal = dot(by, off)
                sizes = [a * b for a, b in zip(place, shifted, strict=True)]
                rows.append([*row[:3], *(unit * each_ for each_ in row[3:]), focal, far * focal, *sizes, r])
            return tuple(share * sum(a * b for a, b in pairs) for pairs in _pairs(rows))

        more = total(of, elements, pixels, weights, gather(turned, cameras_of), gather(lenses, cameras_of))
        sums = tuple(a + b for a, b in zip(sums, more, strict=True))
    table = square(sums, 7 + N_TERMS)
    return tuple(tuple(row) for row in table), explained_of(table, 6)


def _pairs(rows):
    """Return for each pair of columns, as in an upper triangle, its entries in all rows."""
    n = len(rows[0])
    return [[(row[i], row[j]) for row in rows] for i in range(n) for j in range(i, n)]


@kernel(m=MOTOR, thin=array(SCALAR, 3), centre=array(SCALAR, 3), camera=CAMERA, returns=MOTOR)
def reverse_depth(m, thin, centre, camera):
    """Reverse the depth of an object, near which a second minimum is likely.

    The result is the product of the pose with two reflections, in the plane of the object through `centre` with the
    unit normal `thin`, and in the plane through the same point orthogonal to its line of sight. Under parallel
    projection this changes no image of an object in the first plane.
    """
    there = ga.sandwich(m, place_of(centre))
    sight = [a - b for a, b in zip(_coordinates(there), _coordinates(_centre_of_camera(camera)), strict=True)]
    size = ga.sqrt(dot(sight, sight) + TINY)
    mirror = plane_of([x / size for x in sight], _coordinates(there))
    return mirror * m * plane_of(thin, centre)


@kernel(a=MOTOR, b=MOTOR, samples=array(SCALAR, "samples", 3), returns=SCALAR)
def distance_of_poses(a, b, samples):
    """Compute the mean squared distance between the places of samples of an object at two poses."""

    def of(sample):
        p = place_of(sample)
        off = [x - y for x, y in zip(_coordinates(ga.sandwich(a, p)), _coordinates(ga.sandwich(b, p)), strict=True)]
        return dot(off, off), 1

    squares, count = total(of, samples)
    return squares / count
