"""Coordinates of lines and points of three-dimensional projective geometric algebra."""

from gacompiler import assemble
from gacompiler.algebra.catalog import PGA3


def line_of(direction, moment):
    """Return the line with a direction and a moment."""
    (x, y, z), (u, v, w) = direction, moment
    return assemble(PGA3, {"e12": z, "e13": -y, "e23": x, "e01": u, "e02": v, "e03": w})


def direction_of(line):
    """Return the direction of a line."""
    return line["e23"], -line["e13"], line["e12"]


def moment_of(line):
    """Return the moment of a line about the origin."""
    return line["e01"], line["e02"], line["e03"]


def place_of(point):
    """Return the coordinates of a point of weight 1."""
    return point["e032"], point["e013"], point["e021"]
