"""Ruled surfaces, conics and cycloidal curves, generated from points and lines by motors, dilators and intersections.

All curves and surfaces are arrays of points in a standard position about the z axis and the origin. The first axis of
the array of a surface corresponds to the first argument. Use ``generated.pga3.move_point`` to move them. Angles are in
radians.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from generated import cga3, pga3
from generated.gac_runtime.annotations import Numbers

from ..arguments import Reals, finite_number, real_array

_ORIGIN = np.zeros(3)
"""The origin."""
_AXIS = np.array([1.0, 0, 0, 0, 0, 0])
"""The z axis, a line of `generated.pga3`."""


def cycloidal_curve(angles: ArrayLike, arm: float, rate: float, radius: float) -> Reals:
    """Return a cycloidal curve: a point rotates about a centre that itself rotates about the origin.

    The curve is ``radius (cos t, sin t) + arm (cos rate t, sin rate t)`` in the plane z = 0, computed by two rotors.
    For circles with radii R and r, an epicycloid has radius R + r, arm -r and rate (R + r) / r; a hypocycloid has
    R - r, r and -(R - r) / r. Other arms give trochoids. The rate -1 gives an ellipse with the semi-axes radius + arm
    and radius - arm.

    Parameters
    ----------
    angles : array_like, (n,)
        Angles t of the first rotor.
    arm, rate, radius : float

    Returns
    -------
    array, (n, 3)

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type, or is not finite.
    """
    turned = real_array(angles, "angles", (-1,), "angles")
    arm, rate, radius = (finite_number(x, name) for x, name in ((arm, "arm"), (rate, "rate"), (radius, "radius")))
    outer = pga3.motor_from_line(_AXIS, turned)
    inner = pga3.motor_from_line(pga3.join_point_direction([radius, 0, 0], [0.0, 0, 1]), (rate - 1) * turned)
    return np.asarray(pga3.move_point(pga3.motor_product(outer, inner), [radius + arm, 0, 0]))


def cone(angles: ArrayLike, lengths: ArrayLike, half_angle: float) -> Reals:
    """Return a cone with its apex at the origin: a line through the apex, rotated about the axis.

    Parameters
    ----------
    angles : array_like, (n,)
    lengths : array_like, (m,)
        Positions along the line, measured from the apex. The sign selects the nappe.
    half_angle : float
        The angle between line and axis, in (0, pi/2).

    Returns
    -------
    array, (n, m, 3)

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type, or the angle is not in (0, pi/2).
    """
    return _turned(angles, pga3.point_on_line(_generator(half_angle), real_array(lengths, "lengths", (-1,), "lengths")))


def cone_over(directrix: ArrayLike, lengths: ArrayLike, apex: ArrayLike) -> Reals:
    """Return the cone of all lines that join an apex to the points of a curve.

    Parameters
    ----------
    directrix : array_like, (n, 3)
        Points of the curve, different from the apex.
    lengths : array_like, (m,)
        Positions along the lines in units of the distance between apex and point: 0 is the apex, 1 the curve.
    apex : array_like, (3,)

    Returns
    -------
    array, (n, m, 3)

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type.
    """
    curve, top = real_array(directrix, "directrix", (-1, 3), "points"), real_array(apex, "apex", (3,), "a point")
    along = real_array(lengths, "lengths", (-1,), "lengths")
    for name, found, expected in (("directrix", curve, "(n, 3)"), ("lengths", along, "(m,)"), ("apex", top, "(3,)")):
        if found.ndim != expected.count(",") + (expected[-2] != ","):
            raise ValueError(f"{name}: shape {found.shape}; expected {expected}")
    distance = pga3.distance_points(top, curve)
    lines = pga3.normalize_line(pga3.join_points(top, curve))
    start = pga3.position_along_line(top, lines)
    return np.asarray(pga3.point_on_line(lines[:, None], start[:, None] + distance[:, None] * along))


def conic(angles: ArrayLike, half_angle: float, plane: ArrayLike) -> Reals:
    """Return the section of a cone about the z axis with a plane: the intersections of its lines with the plane.

    Parameters
    ----------
    angles : array_like, (n,)
        Angles of the lines of the cone.
    half_angle : float
        Half the opening angle of the cone, in (0, pi/2).
    plane : array_like, (4,)
        A plane of `generated.pga3`.

    Returns
    -------
    array, (n, 3)
        Infinite or NaN where a line is parallel to the plane.

    Raises
    ------
    TypeError, ValueError
        As in `cone`.
    """
    turned = pga3.motor_from_line(_AXIS, real_array(angles, "angles", (-1,), "angles"))
    lines = pga3.move_line(turned, _generator(half_angle))
    with np.errstate(divide="ignore", invalid="ignore"):
        met = pga3.meet_line_plane(lines, real_array(plane, "plane", (4,), "a plane"))
        return np.asarray(pga3.point_from_trivector(met))


def conic_type(half_angle: float, plane: ArrayLike) -> Literal["ellipse", "parabola", "hyperbola"]:
    """Return the type of the section of a cone about the z axis with a plane.

    The type is determined by the angle between axis and plane, with a tolerance of 1e-12 for parabolas. For a plane
    through the apex it is the type of the curve that degenerates to a point, a line or two lines.

    Parameters
    ----------
    half_angle : float
        Half the opening angle of the cone, in (0, pi/2).
    plane : array_like, (4,)
        A plane of `generated.pga3`.

    Returns
    -------
    str

    Raises
    ------
    TypeError, ValueError
        As in `cone`.
    """
    _generator(half_angle)
    given = real_array(plane, "plane", (4,), "a plane")
    if given.ndim != 1:
        raise ValueError(f"plane: shape {given.shape}; expected (4,), one plane")
    unit = pga3.normalize_plane(given)
    off = abs(float(pga3.signed_angle_line_plane(_AXIS, unit))) - half_angle
    if abs(off) <= 1e-12:
        return "parabola"
    return "ellipse" if off > 0 else "hyperbola"


def helicoid(angles: ArrayLike, lengths: ArrayLike, pitch: float) -> Reals:
    """Return a helicoid: the x axis in a screw motion about the z axis.

    Parameters
    ----------
    angles : array_like, (n,)
    lengths : array_like, (m,)
        Positions along the moving line.
    pitch : float
        Translation along the axis per radian.

    Returns
    -------
    array, (n, m, 3)

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type.
    """
    turned = real_array(angles, "angles", (-1,), "angles")
    motors = pga3.motor_from_screw_pitch(_AXIS, turned, finite_number(pitch, "pitch"))
    return _moved(motors, _on_line(_ORIGIN, [1.0, 0, 0], lengths))


def hyperboloid(angles: ArrayLike, lengths: ArrayLike, radius: float, slope: float) -> Reals:
    """Return a hyperboloid of one sheet: a line skew to the z axis, rotated about it.

    ``(x**2 + y**2) / radius**2 - z**2 / (radius / slope)**2 = 1``.

    Parameters
    ----------
    angles : array_like, (n,)
    lengths : array_like, (m,)
        Positions along the line, measured from its point nearest to the axis.
    radius : float
        The distance between line and axis, not 0.
    slope : float
        The tangent of the angle between line and axis. The opposite sign gives the other family of lines.

    Returns
    -------
    array, (n, m, 3)

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type.
    """
    radius, slope = finite_number(radius, "radius"), finite_number(slope, "slope")
    return _turned(angles, _on_line([radius, 0, 0], [0, slope, 1.0], lengths))


def conoid(angles: ArrayLike, lengths: ArrayLike, heights: ArrayLike) -> Reals:
    """Return a right conoid: a line that intersects the z axis at right angles, rotated about it and moved along it.

    Plücker's conoid has heights ``sin(2 angle)``; heights proportional to the angle give the helicoid.

    Parameters
    ----------
    angles : array_like, (n,)
    lengths : array_like, (m,)
        Positions along the line, measured from the axis.
    heights : array_like, (n,)
        Translation along the axis for each angle.

    Returns
    -------
    array, (n, m, 3)

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type.
    """
    turned = real_array(angles, "angles", (-1,), "angles")
    raised = real_array(heights, "heights", (len(turned),), "one for each angle")
    return _moved(pga3.motor_from_screw(_AXIS, turned, raised), _on_line(_ORIGIN, [1.0, 0, 0], lengths))


def ellipsoid(angles: ArrayLike, latitudes: ArrayLike, semi_axes: ArrayLike) -> Reals:
    """Return an ellipsoid: an ellipse (a cycloidal curve) dilated by ``cos(latitude)`` and moved along the z axis.

    Parameters
    ----------
    angles : array_like, (n,)
        Angles of the points of the ellipse.
    latitudes : array_like, (m,)
        In (-pi/2, pi/2).
    semi_axes : array_like, (3,)
        Positive semi-axes along x, y and z.

    Returns
    -------
    array, (n, m, 3)

    Raises
    ------
    TypeError, ValueError
        If an argument has a wrong shape or type, or a semi-axis or a cosine is not positive.
    """
    a, b, c = (float(x) for x in _positive(real_array(semi_axes, "semi_axes", (3,), "three lengths"), "semi_axes"))
    latitude = real_array(latitudes, "latitudes", (-1,), "latitudes")
    dilators = cga3.dilator_from_scale(_positive(np.cos(latitude), "cos(latitudes)"))
    ellipse = cycloidal_curve(angles, (a - b) / 2, -1, (a + b) / 2)
    height = np.multiply.outer(c * np.sin(latitude), [0.0, 0, 1])
    return np.asarray(
        cga3.translate_point(cga3.translator_from_vector(height), cga3.dilate_point(dilators, ellipse[:, None]))
    )


def sphere_cone_curve(angles: ArrayLike, half_angle: float, sphere: ArrayLike) -> Reals:
    """Return the intersection of a cone about the z axis with a sphere, computed line by line.

    Parameters
    ----------
    angles : array_like, (n,)
    half_angle : float
        Half the opening angle of the cone, in (0, pi/2).
    sphere : array_like, (5,)
        A sphere of `generated.cga3`.

    Returns
    -------
    array, (n, 2, 3)
        Both points of every line. NaN where the line does not intersect the sphere.

    Raises
    ------
    TypeError, ValueError
        As in `cone`.
    """
    further = cone(angles, [1.0], half_angle)[:, 0]
    pairs = cga3.meet_line_sphere(cga3.line_from_points(_ORIGIN, further), real_array(sphere, "sphere", (5,)))
    return np.stack(cga3.point_pair_points(pairs), -2)


def _generator(half_angle: float) -> Reals:
    angle = finite_number(half_angle, "half_angle")
    if not 0 < angle < np.pi / 2:
        raise ValueError(f"half_angle: {angle}; expected an angle between 0 and pi/2")
    return np.asarray(pga3.join_point_direction(_ORIGIN, [np.sin(angle), 0, np.cos(angle)]))


def _on_line(p: Numbers, direction: Numbers, lengths: ArrayLike) -> Reals:
    """Return points at multiples of a direction of any length, on the line through `p`, its point closest to 0."""
    line = pga3.normalize_line(pga3.join_point_direction(p, direction))
    size = np.linalg.norm(np.asarray(direction))
    return np.asarray(pga3.point_on_line(line, size * real_array(lengths, "lengths", (-1,), "lengths")))


def _turned(angles: ArrayLike, points: Reals) -> Reals:
    return _moved(pga3.motor_from_line(_AXIS, real_array(angles, "angles", (-1,), "angles")), points)


def _moved(motors: Reals, points: Reals) -> Reals:
    return np.asarray(pga3.move_point(motors[:, None], points))


def _positive(values: Reals, name: str) -> Reals:
    if not np.all(values > 0):
        raise ValueError(f"{name}: {values.min() if values.size else values}; expected positive numbers")
    return values
