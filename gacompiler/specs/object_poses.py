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
from gacompiler import SCALAR, array, assemble, each, gather, index, iterate, kernel, select, total
from gacompiler.algebra.catalog import PGA3
from gacompiler.specs.families.covariances import choose, square
from gacompiler.specs.families.rates import (
    Rated,
    bilinear,
    components,
    constant,
    length,
    linear,
    plus,
    quotient,
    scaled,
)

LINE, PLANE, MOTOR = PGA3.LINE, PGA3.PLANE, PGA3.MOTOR
DIRECTION_OF_LINE, DIRECTION = ("e23", "e13", "e12"), ("e032", "e013", "e021")
NORMAL = ("e1", "e2", "e3")
N_RATES = 8
"""Derivatives by the six coefficients of a bivector, and by the two coordinates of the pixel."""
TINY = Fraction(1, 10**30)
RIDGE = Fraction(1, 10**11)
"""Part of the trace that is added to the diagonal: motions that change nothing in the images have no step."""
FIRST_DAMPING, LARGEST_DAMPING = Fraction(1, 10**4), 10**9
STEPS = 60
SMALL_PART = Fraction(1, 10**4)
"""Part of the sum of squares: if a step decreases it by less, it is the last one."""
UNKNOWN = 10**30
"""The sum of squares before the first step."""

CAMERAS = array(SCALAR, "cameras", 3, 4)


def _seen(name):
    """Return the parameters of measured pixels: their coordinates, their cameras, and weights."""
    return {
        f"{name}_pixels": array(SCALAR, name, 2),
        f"{name}_cameras": index(name, into="cameras"),
        f"{name}_weights": array(SCALAR, name),
    }


MODEL = {
    "m": MOTOR, "cameras": CAMERAS,
    "points": array(SCALAR, "points", 3), **_seen("points"),
    "edges": array(LINE, "edges"), **_seen("edges"),
    "balls": array(SCALAR, "balls", 4), **_seen("balls"),
    "tubes": array(SCALAR, "tubes", 7), **_seen("tubes"),
    "rims": array(SCALAR, "rims", 7), **_seen("rims"),
}  # fmt: skip
"""Parameters of the kernels: elements of the object, and the pixels at which they are seen."""


def _planes(camera):
    return [assemble(PGA3, dict(zip(("e1", "e2", "e3", "e0"), row, strict=True))) for row in camera]


def _place(p):
    return PGA3.multivector({"e123": 1}) + assemble(PGA3, dict(zip(DIRECTION, p, strict=True)))


def _line(coefficients):
    return assemble(PGA3, dict(zip(LINE.blades, coefficients, strict=True)))


def _join(a, b):
    return a & b


def _scalar(x):
    return x["1"]


GENERATORS = tuple(PGA3.multivector({name: 1}) for name in LINE.blades)


def _moving(element):
    """Return an element of the object, with its derivatives by a motion of the object."""
    return Rated(element, (*(g * element - element * g for g in GENERATORS), None, None))


def _from_object(m, cameras):
    """Return the planes of cameras in the frame of an object: moving those moves each element just once."""

    def turned(camera):
        moved = (ga.sandwich(~m, plane) for plane in _planes(camera))
        return tuple(tuple(plane[name] for name in PLANE.blades) for plane in moved)

    return each(turned, cameras)


def _sight(camera, pixel):
    """Return the line of sight of a pixel, and its derivatives by the pixel."""
    first, second, third = _planes(camera)
    left, above = first - pixel[0] * third, second - pixel[1] * third
    rates = (None,) * 6 + (-(third ^ above), -(left ^ third))
    return Rated(left ^ above, rates)


def _in_pixels(condition, metric):
    """Return the distance in pixels at which a condition holds, to first order, and its derivatives by the pose.

    If `metric` is positive, it is the number of pixels per unit of the condition. The derivatives are exact then, and
    descents from far away do not stall; otherwise the change of the slope is neglected.
    """
    u, v = (0 if rate is None else rate for rate in condition.rates[6:])
    slope = ga.sqrt(u * u + v * v + TINY)
    if not isinstance(metric, int):
        slope = select(metric > 0, 1 / (metric + TINY), slope)
    return condition.value / slope, [rate / slope for rate in condition.rates[:6]]


# Each function returns residuals in pixels with their derivatives.


def _of_point(camera, pixel, place, _metric):
    there = _moving(_place(place))
    heights = [linear(lambda x, plane=plane: _scalar(plane & x), there) for plane in _planes(camera)]
    found = [quotient(height, heights[2]) for height in heights[:2]]
    return [(f.value - at, list(f.rates[:6])) for f, at in zip(found, pixel, strict=True)]


def _of_edge(camera, pixel, line, _metric):
    """Return the distance of a pixel from the image of a straight edge."""
    moment = linear(_scalar, bilinear(_join, _sight(camera, pixel), _moving(line)))
    return [_in_pixels(moment, 0)]


def _of_ball(camera, pixel, ball, metric):
    """Return the distance from the silhouette of a sphere, whose lines of sight are a radius from its centre."""
    sight = _sight(camera, pixel)
    plane = bilinear(_join, _moving(_place(ball[:3])), sight)
    far = quotient(length(components(plane, NORMAL)), length(components(sight, DIRECTION_OF_LINE)))
    return [_in_pixels(plus(far, constant(-ball[3], N_RATES)), metric)]


def _of_tube(camera, pixel, tube, metric):
    """Return the distance from the nearer of the two lines of a cylinder's silhouette."""
    sight, axis = _sight(camera, pixel), _moving(_line(tube[:6]))
    moment = linear(_scalar, bilinear(_join, sight, axis))
    across = components(bilinear(lambda a, b: a * b - b * a, sight, axis), DIRECTION_OF_LINE)
    far = quotient(scaled(2, moment), length(across))
    return [_in_pixels(plus(scaled(select(far.value < 0, -1, 1), far), constant(-tube[6], N_RATES)), metric)]


def _of_rim(camera, pixel, rim, metric):
    """Return the distance from the image of a circle: its centre, its unit normal and its radius."""
    centre = _moving(_place(rim[:3]))
    x, y, z = rim[3:6]
    height = rim[0] * x + rim[1] * y + rim[2] * z
    plane = _moving(assemble(PGA3, {"e1": x, "e2": y, "e3": z, "e0": -height}))
    hit = bilinear(lambda a, b: a ^ b, _sight(camera, pixel), plane)
    weight = linear(lambda p: p["e123"], hit)
    parts = zip(components(hit, DIRECTION), components(centre, DIRECTION), strict=True)
    far = length([plus(quotient(one, weight), scaled(-1, other)) for one, other in parts])
    return [_in_pixels(plus(far, constant(-rim[6], N_RATES)), metric)]


KINDS = {"points": _of_point, "edges": _of_edge, "balls": _of_ball, "tubes": _of_tube, "rims": _of_rim}


def _tables(values):
    """Return, for each kind, its residuals and arrays: elements, pixels, cameras, weights."""
    return [
        (kind, values[name], values[f"{name}_pixels"], values[f"{name}_cameras"], values[f"{name}_weights"])
        for name, kind in KINDS.items()
    ]


def _share(residuals, weight, scale):
    """Return the weight of an estimate after Geman and McClure, and the robust square."""
    far = sum(r * r for r, _ in residuals)
    ratio = 1 / (1 + far / (scale * scale))
    return weight * ratio * ratio, weight * far * ratio


def _sums(m, values, unit, scale):
    """Return the upper triangle and the right-hand side of the normal equations, and the sum of robust squares."""
    table, slope, cost = (0,) * 21, (0,) * 6, 0
    turned = _from_object(m, values["cameras"])
    for kind, elements, pixels, cameras, weights in _tables(values):

        def of(element, pixel, weight, camera, kind=kind):
            found = kind(camera, pixel, element, values["metric"])
            share, far = _share(found, weight, scale)
            rows = [(r, [*row[:3], *(unit * x for x in row[3:])]) for r, row in found]
            square_sums = tuple(share * sum(row[i] * row[j] for _, row in rows) for i in range(6) for j in range(i, 6))
            return square_sums, tuple(share * sum(r * row[i] for r, row in rows) for i in range(6)), far

        more, right, far = total(of, elements, pixels, weights, gather(turned, cameras))
        table = tuple(a + b for a, b in zip(table, more, strict=True))
        slope = tuple(a + b for a, b in zip(slope, right, strict=True))
        cost = cost + far
    return table, slope, cost


class Descent(NamedTuple):
    """The best pose so far with its normal equations, and the next one to try."""

    motor: Any
    candidate: Any
    table: Any
    slope: Any
    cost: Any
    damping: Any
    gain: Any
    done: Any


def _step(now, values, unit, scale, tolerance):
    """Compare a candidate with the best pose, and compute the next one."""
    table, slope, cost = _sums(now.candidate, values, unit, scale)
    better = cost < now.cost
    motor = assemble(PGA3, {b: select(better, now.candidate[b], now.motor[b]) for b in MOTOR.blades})
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
    sizes = [1, 1, 1, unit, unit, unit]
    bivector = _line([-s * x for s, x in zip(sizes, solution, strict=True)])
    small = tolerance + SMALL_PART * cost
    done = select(gain <= small, 1, select(damping > LARGEST_DAMPING, 1, 0))
    return Descent(motor, motor * ga.exp(bivector), table, slope, cost, damping, gain, done)


@kernel(
    **MODEL, unit=SCALAR, scale=SCALAR, tolerance=SCALAR, metric=SCALAR,
    returns=(MOTOR, array(SCALAR, 21), array(SCALAR, 6), array(SCALAR, 4)),
)  # fmt: skip
def refine_pose(
    m, cameras, points, points_pixels, points_cameras, points_weights, edges, edges_pixels, edges_cameras,
    edges_weights, balls, balls_pixels, balls_cameras, balls_weights, tubes, tubes_pixels, tubes_cameras,
    tubes_weights, rims, rims_pixels, rims_cameras, rims_weights, unit, scale, tolerance, metric,
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
        The distance in pixels at which measurements lose three quarters of their weight.
    tolerance
        Steps end if the next one, which is still taken, is expected to decrease the sum of squares by less than this
        and a small part of it.
    metric
        If positive, distances from silhouettes are measured at the object, with this number of pixels per unit of
        length. Descents from far away need this; the minimum is not that of distances in pixels.

    Returns
    -------
    motor
    triangle, slope
        The upper triangle of the normal equations by the coefficients of B, with translations in multiples of `unit`,
        and their right-hand side, at the last pose that was compared.
    numbers
        The sum of robust squares, whether the sum of squares is at a minimum, the number of steps, and the expected
        decrease by a further step.
    """
    values = dict(locals())

    def body(now):
        return _step(now, values, unit, scale, tolerance)

    start = Descent(m, m, (0,) * 21, (0,) * 6, UNKNOWN, FIRST_DAMPING, UNKNOWN, 0)
    found, ended, steps = iterate(body, start, lambda _, new: new.done > 0, STEPS)
    fine = found.gain <= tolerance + SMALL_PART * found.cost
    motor = assemble(PGA3, {b: select(fine, found.candidate[b], found.motor[b]) for b in MOTOR.blades})
    return motor, found.table, found.slope, (found.cost, ended * fine, steps, found.gain)


@kernel(**MODEL, returns=tuple(array(SCALAR, name, 2) for name in KINDS))
def residuals_of_pose(
    m, cameras, points, points_pixels, points_cameras, points_weights, edges, edges_pixels, edges_cameras,
    edges_weights, balls, balls_pixels, balls_cameras, balls_weights, tubes, tubes_pixels, tubes_cameras,
    tubes_weights, rims, rims_pixels, rims_cameras, rims_weights,
):  # fmt: skip
    """Compute, for each pixel, its distance from the image of its element, and the depth of the element.

    The distance is positive. The depth has the unit of the cameras' matrices, whose third rows should be unit planes.
    """
    values = dict(locals())
    turned = _from_object(m, values["cameras"])
    anchors = {
        "points": lambda p: _place(p), "balls": lambda b: _place(b[:3]), "rims": lambda r: _place(r[:3]),
        "edges": _foot_of_line, "tubes": lambda t: _foot_of_line(_line(t[:6])),
    }  # fmt: skip
    results = []
    for name, (kind, elements, pixels, cameras_of, _) in zip(KINDS, _tables(values), strict=True):

        def of(element, pixel, camera, kind=kind, anchor_of=anchors[name]):
            far = ga.sqrt(sum(r * r for r, _ in kind(camera, pixel, element, 0)))
            return far, _scalar(_planes(camera)[2] & anchor_of(element))

        results.append(each(of, elements, pixels, gather(turned, cameras_of)))
    return tuple(results)


def _foot_of_line(line):
    """Return the point of a line that is nearest to the origin."""
    foot = ga.inner_product(PGA3.multivector({"e123": 1}), line) ^ line
    return foot / foot["e123"]
