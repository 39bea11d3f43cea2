"""Distances in pixels between measurements and the images of elements of an object, with their derivatives.

Each function of `KINDS` takes a camera, in the frame of the object, a pixel, an element and the parameter `metric` of
the kernels, and returns residuals with their derivatives by the coefficients of a bivector, and by the pixel.
"""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, array, assemble, each, index, select
from gacompiler.algebra.catalog import PGA3
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

CAMERAS, CAMERA = array(SCALAR, "cameras", 3, 4), array(SCALAR, 3, 4)


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


def planes_of(camera):
    """Return the three planes of a camera."""
    return [assemble(PGA3, dict(zip(("e1", "e2", "e3", "e0"), row, strict=True))) for row in camera]


def plane_of(normal, point):
    """Return the plane through a point with a unit normal."""
    height = sum(a * b for a, b in zip(normal, point, strict=True))
    return assemble(PGA3, {**dict(zip(NORMAL, normal, strict=True)), "e0": -height})


def translator_of(shift):
    """Return the motor of a translation."""
    return 1 - assemble(PGA3, dict(zip(("e01", "e02", "e03"), shift, strict=True))) / 2


def rotor_of(quaternion):
    """Return the motor of a rotation by its unit quaternion (w, x, y, z)."""
    w, x, y, z = quaternion
    return assemble(PGA3, {"1": w, "e23": -x, "e13": y, "e12": -z})


def place_of(p):
    """Return a point by its coordinates."""
    return PGA3.multivector({"e123": 1}) + assemble(PGA3, dict(zip(DIRECTION, p, strict=True)))


def line_of(coefficients):
    """Return a line, or any bivector, by its coefficients."""
    return assemble(PGA3, dict(zip(LINE.blades, coefficients, strict=True)))


def _join(a, b):
    return a & b


def scalar_of(x):
    """Return the scalar part."""
    return x["1"]


GENERATORS = tuple(PGA3.multivector({name: 1}) for name in LINE.blades)


def _moving(element):
    """Return an element of the object, with its derivatives by a motion of the object."""
    return Rated(element, (*(g * element - element * g for g in GENERATORS), None, None))


def in_object(m, cameras):
    """Return the planes of cameras in the frame of an object: moving those moves each element just once."""

    def turned(camera):
        moved = (ga.sandwich(~m, plane) for plane in planes_of(camera))
        return tuple(tuple(plane[name] for name in PLANE.blades) for plane in moved)

    return each(turned, cameras)


def _sight(camera, pixel):
    """Return the line of sight of a pixel, and its derivatives by the pixel."""
    first, second, third = planes_of(camera)
    left, above = first - pixel[0] * third, second - pixel[1] * third
    rates = (None,) * 6 + (-(third ^ above), -(left ^ third))
    return Rated(left ^ above, rates)


def _in_pixels(condition, metric):
    """Return the distance in pixels at which a condition holds, to first order, and its derivatives by pose and pixel.

    If `metric` is positive, it is the number of pixels per unit of the condition. The derivatives are exact then, and
    descents from far away do not stall; otherwise the change of the slope is neglected.
    """
    u, v = (0 if rate is None else rate for rate in condition.rates[6:])
    slope = ga.sqrt(u * u + v * v + TINY)
    if not isinstance(metric, int):
        slope = select(metric > 0, 1 / (metric + TINY), slope)
    return condition.value / slope, [rate / slope for rate in condition.rates[:6]], (u / slope, v / slope)


# Each function returns residuals in pixels with their derivatives.


def _of_point(camera, pixel, place, _metric):
    there = _moving(place_of(place))
    heights = [linear(lambda x, plane=plane: scalar_of(plane & x), there) for plane in planes_of(camera)]
    found = [quotient(height, heights[2]) for height in heights[:2]]
    by_pixel = (-1, 0), (0, -1)
    return [(f.value - at, list(f.rates[:6]), by) for f, at, by in zip(found, pixel, by_pixel, strict=True)]


def _of_edge(camera, pixel, line, _metric):
    """Return the distance of a pixel from the image of a straight edge."""
    moment = linear(scalar_of, bilinear(_join, _sight(camera, pixel), _moving(line)))
    return [_in_pixels(moment, 0)]


def _of_ball(camera, pixel, ball, metric):
    """Return the distance from the silhouette of a sphere, whose lines of sight are a radius from its centre."""
    sight = _sight(camera, pixel)
    plane = bilinear(_join, _moving(place_of(ball[:3])), sight)
    far = quotient(length(components(plane, NORMAL)), length(components(sight, DIRECTION_OF_LINE)))
    return [_in_pixels(plus(far, constant(-ball[3], N_RATES)), metric)]


def _of_tube(camera, pixel, tube, metric):
    """Return the distance from the nearer of the two lines of a cylinder's silhouette."""
    sight, axis = _sight(camera, pixel), _moving(line_of(tube[:6]))
    moment = linear(scalar_of, bilinear(_join, sight, axis))
    across = components(bilinear(lambda a, b: a * b - b * a, sight, axis), DIRECTION_OF_LINE)
    far = quotient(scaled(2, moment), length(across))
    return [_in_pixels(plus(scaled(select(far.value < 0, -1, 1), far), constant(-tube[6], N_RATES)), metric)]


def _of_rim(camera, pixel, rim, metric):
    """Return the distance from the image of a circle: its centre, its unit normal and its radius."""
    centre = _moving(place_of(rim[:3]))
    x, y, z = rim[3:6]
    plane = _moving(plane_of((x, y, z), rim[:3]))
    hit = bilinear(lambda a, b: a ^ b, _sight(camera, pixel), plane)
    weight = linear(lambda p: p["e123"], hit)
    parts = zip(components(hit, DIRECTION), components(centre, DIRECTION), strict=True)
    far = length([plus(quotient(one, weight), scaled(-1, other)) for one, other in parts])
    return [_in_pixels(plus(far, constant(-rim[6], N_RATES)), metric)]


KINDS = {"points": _of_point, "edges": _of_edge, "balls": _of_ball, "tubes": _of_tube, "rims": _of_rim}


def tables(values):
    """Return, for each kind, its residuals and arrays: elements, pixels, cameras, weights."""
    return [
        (kind, values[name], values[f"{name}_pixels"], values[f"{name}_cameras"], values[f"{name}_weights"])
        for name, kind in KINDS.items()
    ]


def foot_of_line(line):
    """Return the point of a line that is nearest to the origin."""
    foot = ga.inner_product(PGA3.multivector({"e123": 1}), line) ^ line
    return foot / foot["e123"]


ANCHORS = {
    "points": place_of,
    "edges": foot_of_line,
    "balls": lambda ball: place_of(ball[:3]),
    "tubes": lambda tube: foot_of_line(line_of(tube[:6])),
    "rims": lambda rim: place_of(rim[:3]),
}
"""Points of the elements whose depths are positive if the elements are in front of a camera."""
