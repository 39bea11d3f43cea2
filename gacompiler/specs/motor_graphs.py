"""Factors of graphs of motors of G(3,0,1): residuals and their derivatives.

A pose is a unit motor from its own frame to that of the map. Its perturbation is a motion in its own frame, ``m
exp(B)``: three numbers of the rotation vector and three of the translation, half of which are the coefficients of B.
Residuals of measured elements are expressed in the frame of the pose. The compiler derives all derivatives.

Inertial measurements between two poses are summed once (Forster et al., *On-Manifold Preintegration*, 2017). The sum is
a motor whose translation is the change of the velocity, and a change of the place. Rates and accelerations are constant
between samples, and the motion is exact for these.
"""

from fractions import Fraction
from math import factorial
from typing import Any, NamedTuple

import gacompiler as ga
from gacompiler import SCALAR, array, assemble, fold, jvp, kernel, select
from gacompiler.algebra.catalog import PGA3
from gacompiler.specs.families.covariances import (
    congruent,
    cross,
    dot,
    size_of_triangle,
    square,
    triangle,
)
from gacompiler.specs.families.frames import across

MOTOR, LINE, POINT, PLANE = PGA3.MOTOR, PGA3.LINE, PGA3.POINT, PGA3.PLANE
TWIST, VECTOR = array(SCALAR, 6), array(SCALAR, 3)
HALF = Fraction(1, 2)
SMALLEST_SINE = Fraction(1, 10**9)
TERMS = 9
"""From floating point: of a series, the first term that is left out is at most 1 / 20! for angles of up to a radian."""
MOTIONS = (("e23", -1), ("e13", 1), ("e12", -1), ("e01", -1), ("e02", -1), ("e03", -1))
"""The bivectors of which half moves a pose: by a rotation about its x, y and z axis, and by a translation along."""
UNITS, ZEROS = ((1, 0, 0), (0, 1, 0), (0, 0, 1)), (0, 0, 0)
SIX_UNITS = tuple(tuple(int(i == k) for i in range(6)) for k in range(6))
GENERATORS = tuple(sign * HALF * PGA3.multivector({name: 1}) for name, sign in MOTIONS)


def _by_rows(n, m):
    return array(SCALAR, n, m)


def _matrix(columns):
    """Return the rows of a matrix from its columns."""
    return tuple(zip(*columns, strict=True))


def translation_of(m):
    """Return the translation of a unit motor, which rotates first."""
    moved = m * PGA3.multivector({"e123": 1}) * ~m
    return tuple(moved[name] for name in POINT.blades)


def _rotor_part(m):
    return assemble(PGA3, {name: m[name] for name in PGA3.ROTOR.blades})


def _bivector(twist):
    return assemble(PGA3, {name: sign * HALF * x for (name, sign), x in zip(MOTIONS, twist, strict=True)})


@kernel(m=MOTOR, twist=TWIST, returns=MOTOR)
def moved_motor(m, twist):
    """Move a pose by a perturbation in its own frame, ``m exp(B)``."""
    return m * ga.exp(_bivector(twist))


@kernel(m=MOTOR, returns=TWIST)
def twist_of_motor(m):
    """Compute the perturbation that moves the identity to `m` or `-m`, by the angle of at most a half turn."""
    logarithm = ga.log(m)
    return tuple(2 * sign * logarithm[name] for name, sign in MOTIONS)


_BY_MOTOR = jvp(twist_of_motor, "m")


@kernel(a=MOTOR, b=MOTOR, motion=MOTOR, returns=(TWIST, _by_rows(6, 6), _by_rows(6, 6)))
def relative_motion(a, b, motion):
    """Compute the misfit ``~motion ~a b`` of a measured motion between two poses, as a perturbation.

    Returns
    -------
    misfit
    by_a, by_b
        The derivatives by perturbations of both poses.
    """
    back, between = ~motion, ~a * b
    misfit = back * between
    by_a = [_BY_MOTOR.function(misfit, -back * g * between) for g in GENERATORS]
    by_b = [_BY_MOTOR.function(misfit, misfit * g) for g in GENERATORS]
    return by_a[0][0], _matrix([each[1] for each in by_a]), _matrix([each[1] for each in by_b])


@kernel(m=MOTOR, motor=MOTOR, returns=(TWIST, _by_rows(6, 6)))
def difference_of_motors(m, motor):
    """Compute the perturbation that moves `motor` to `m`, and its derivatives by perturbations of `m`."""
    misfit = ~motor * m
    by_m = [_BY_MOTOR.function(misfit, misfit * g) for g in GENERATORS]
    return by_m[0][0], _matrix([each[1] for each in by_m])


# Elements of a map that are measured in the frame of a pose.


def _turn(d, e):
    """Return the rotation, along two axes across the unit vector e, that takes e to the unit vector d.

    It is as long as the angle, so that it does not become small again beyond 90 degrees.
    """
    u, v = across(e)
    a, b, cosine = dot(u, d), dot(v, d), dot(e, d)
    square = a * a + b * b
    is_small = square < SMALLEST_SINE * SMALLEST_SINE
    sine = ga.sqrt(select(is_small, 1, square))
    factor = select(is_small, 1, ga.atan2(sine, cosine) / sine)
    return factor * a, factor * b


def _scaled(direction, more):
    """Return a direction and what belongs to it, divided by the norm of the direction."""
    size = dot(direction, direction)
    scale = 1 / ga.sqrt(size)
    return tuple(scale * x for x in direction), tuple(scale * x for x in more)


def _direction_and_moment(line):
    return _scaled((line["e23"], -line["e13"], line["e12"]), (line["e01"], line["e02"], line["e03"]))


@kernel(line=LINE, seen=LINE, returns=array(SCALAR, 4))
def misfit_of_line(line, seen):
    """Compute the turn of a line from a seen one, and its moment about the foot of that, along two axes across it."""
    d, m = _direction_and_moment(line)
    e, n = _direction_and_moment(seen)
    u, v = across(e)
    own = tuple(a - b for a, b in zip(m, cross(cross(e, n), d), strict=True))
    return *_turn(d, e), dot(u, own), dot(v, own)


@kernel(plane=PLANE, seen=PLANE, returns=VECTOR)
def misfit_of_plane(plane, seen):
    """Compute the turn of the normal of a plane from that of a seen one, and its height at the foot of that."""
    d, (h,) = _scaled([plane[name] for name in ("e1", "e2", "e3")], (plane["e0"],))
    e, (g,) = _scaled([seen[name] for name in ("e1", "e2", "e3")], (seen["e0"],))
    return *_turn(d, e), h - g * dot(d, e)


@kernel(point=POINT, seen=POINT, returns=VECTOR)
def misfit_of_point(point, seen):
    """Compute the difference of a point from a seen one."""
    return tuple(point[name] - seen[name] for name in POINT.blades)


_BY_LINE, _BY_PLANE, _BY_POINT = (
    jvp(misfit_of_line, "line"), jvp(misfit_of_plane, "plane"), jvp(misfit_of_point, "point")
)  # fmt: skip


def _seen(derived, m, element, seen):
    """Return the misfit of an element that is moved into the frame of a pose, and its derivatives by the pose."""
    here = ~m * element * m
    by_pose = [derived.function(here, seen, here * g - g * here) for g in GENERATORS]
    return by_pose[0][0], _matrix([each[1] for each in by_pose])


@kernel(m=MOTOR, line=LINE, seen=LINE, returns=(array(SCALAR, 4), _by_rows(4, 6)))
def seen_line(m, line, seen):
    """Compute the misfit of a line of the map in the frame of a pose, and its derivatives by the pose."""
    return _seen(_BY_LINE, m, line, seen)


@kernel(m=MOTOR, plane=PLANE, seen=PLANE, returns=(VECTOR, _by_rows(3, 6)))
def seen_plane(m, plane, seen):
    """Compute the misfit of a plane of the map in the frame of a pose, and its derivatives by the pose."""
    return _seen(_BY_PLANE, m, plane, seen)


@kernel(m=MOTOR, point=POINT, seen=POINT, returns=(VECTOR, _by_rows(3, 6)))
def seen_point(m, point, seen):
    """Compute the misfit of a point of the map in the frame of a pose, and its derivatives by the pose."""
    return _seen(_BY_POINT, m, point, seen)


@kernel(m=MOTOR, lever=POINT, place=POINT, returns=(VECTOR, _by_rows(3, 6)))
def place_of_pose(m, lever, place):
    """Compute the difference of a point of the pose from a place in the map, and its derivatives by the pose."""
    columns = [m * (g * lever - lever * g) * ~m for g in GENERATORS]
    rows = tuple(tuple(column[name] for column in columns) for name in POINT.blades)
    return misfit_of_point.function(m * lever * ~m, place), rows


# Inertial measurements.


def _cross_rows(a):
    """Return the rows of the matrix that multiplies by `a` from the left."""
    x, y, z = a
    return (0, -z, y), (z, 0, -x), (-y, x, 0)


def _series(square, start):
    """Return ``sum (-square)**k / (2 k + start)!``, to rounding for angles of up to a radian."""
    return sum(Fraction((-1) ** k, factorial(2 * k + start)) * square**k for k in range(1, TERMS)) + Fraction(
        1, factorial(start)
    )


@kernel(rate=VECTOR, force=VECTOR, dt=SCALAR, returns=(VECTOR, VECTOR))
def inertial_increments(rate, force, dt):
    """Compute the changes of velocity and place, in the first frame, by a constant rate and specific force.

    They are exact to rounding for rotations of up to a radian.
    """
    turn = tuple(dt * x for x in rate)
    size = dot(turn, turn)
    once = cross(turn, force)
    twice = cross(turn, once)
    one, two, three, four = (_series(size, start) for start in (2, 3, 3, 4))
    velocity = tuple(dt * (f + one * a + two * b) for f, a, b in zip(force, once, twice, strict=True))
    place = tuple(dt * dt * (HALF * f + three * a + four * b) for f, a, b in zip(force, once, twice, strict=True))
    return velocity, place


_INCREMENTS, _BY_RATE = inertial_increments.function, jvp(inertial_increments, "rate")


class Sum(NamedTuple):
    """What inertial samples add up to."""

    motion: Any
    """The rotation, and the change of the velocity in the first frame as the translation."""
    place: Any
    by_bias: Any
    """Rows of the derivatives of rotation, velocity and place by the biases of rates and forces."""
    covariance: Any


def _times(a, b):
    """Return the rows of a product of matrices."""
    columns = list(zip(*b, strict=True))
    return [[dot(row, column) for column in columns] for row in a]


def _rotation(m):
    """Return the rows of the matrix of a motor's rotation."""
    columns = [m * PGA3.multivector({name: 1}) * ~m for name in POINT.blades]
    return [[column[name] for column in columns] for name in POINT.blades]


def _inputs(rotation, turn, rate, force, dt):
    """Return the derivatives (9, 6) of a sum by the rate and the force of a sample."""
    crossed = _cross_rows(turn)
    twice, size = _times(crossed, crossed), dot(turn, turn)
    one, two = _series(size, 2), _series(size, 3)
    by_turn = [[dt * (int(i == k) - one * crossed[i][k] + two * twice[i][k]) for k in range(3)] for i in range(3)]
    changes = [_BY_RATE.function(rate, force, dt, unit)[2:] for unit in UNITS]
    changes += [_INCREMENTS(rate, unit, dt) for unit in UNITS]
    moved = [_times(rotation, _matrix([change[k] for change in changes])) for k in range(2)]
    return [[*row, 0, 0, 0] for row in by_turn] + moved[0] + moved[1]


def _added(carry, rate, force, dt, noise):
    """Add a sample, from which biases are subtracted."""
    turn = tuple(dt * x for x in rate)
    step = ga.exp(_bivector((*turn, *(dt * f for f in force))))
    rotation, back = _rotation(carry.motion), _rotation(~step)
    velocity, place = _INCREMENTS(rate, force, dt)
    by_input = _inputs(rotation, turn, rate, force, dt)
    of_velocity, of_place = (
        [[-x for x in row] for row in _times(rotation, _cross_rows(change))] for change in (velocity, place)
    )
    earlier = [
        *([*back[i], *ZEROS, *ZEROS] for i in range(3)),
        *([*of_velocity[i], *UNITS[i], *ZEROS] for i in range(3)),
        *([*of_place[i], *(dt * x for x in UNITS[i]), *UNITS[i]] for i in range(3)),
    ]
    by_bias = _times(earlier, carry.by_bias)
    by_bias = [[a - b for a, b in zip(*rows, strict=True)] for rows in zip(by_bias, by_input, strict=True)]
    variances = [noise[k // 3] / dt for k in range(6)]
    spread = congruent(earlier, square(carry.covariance, 9))
    scaled = [[x * v for x, v in zip(row, variances, strict=True)] for row in by_input]
    spread = [
        [spread[i][k] + (dot(scaled[i], by_input[k]) if k >= i else 0) for k in range(9)] for i in range(9)
    ]  # fmt: skip
    before, moved = translation_of(carry.motion), [dot(row, place) for row in rotation]
    place = tuple(p + dt * v + x for p, v, x in zip(carry.place, before, moved, strict=True))
    return Sum(carry.motion * step, place, tuple(tuple(row) for row in by_bias), triangle(spread))


@kernel(
    rates=array(SCALAR, "n", 3), forces=array(SCALAR, "n", 3), dt=array(SCALAR, "n"), bias=TWIST,
    noise=array(SCALAR, 2), returns=(MOTOR, VECTOR, _by_rows(9, 6), array(SCALAR, size_of_triangle(9))),
)  # fmt: skip
def preintegrate(rates, forces, dt, bias, noise):
    """Sum inertial samples between two poses.

    Parameters
    ----------
    rates, forces
        Angular rates and specific forces in the frame of the sensor, each constant during `dt`.
    dt
    bias
        Of rates and of forces, which is subtracted.
    noise
        Variances per hertz of rates and of forces.

    Returns
    -------
    motion
        The rotation from the last frame to the first one, and as translation the change of the velocity in the first.
    place
        The change of the place in the first frame, without gravity and the first velocity.
    by_bias
        Derivatives of the rotation, in the last frame, of the change of the velocity and of the place by `bias`.
    covariance
        The upper triangle of their covariance.
    """

    def add(carry, rate, force, step):
        rate, force = ([a - b for a, b in zip(x, bias[k:], strict=False)] for x, k in ((rate, 0), (force, 3)))
        return _added(carry, tuple(rate), tuple(force), step, noise)

    start = Sum(PGA3.multivector({"1": 1}), (0, 0, 0), tuple((0,) * 6 for _ in range(9)), (0,) * size_of_triangle(9))
    return tuple(fold(add, start, rates, forces, dt))


_INERTIAL = {
    "a": MOTOR, "velocity": VECTOR, "bias": TWIST, "b": MOTOR, "next_velocity": VECTOR,
    "motion": MOTOR, "place": VECTOR, "dt": SCALAR, "by_bias": _by_rows(9, 6), "reference": TWIST, "gravity": VECTOR,
}  # fmt: skip


def _into_frame(m, vector):
    """Return a vector of the map in the frame of a pose."""
    moved = ~m * assemble(PGA3, dict(zip(POINT.blades, vector, strict=True))) * m
    return tuple(moved[name] for name in POINT.blades)


@kernel(**_INERTIAL, returns=array(SCALAR, 9))
def misfit_of_inertial(a, velocity, bias, b, next_velocity, motion, place, dt, by_bias, reference, gravity):
    """Compute the misfits of the rotation, the velocity and the place of two poses and preintegrated samples.

    Parameters
    ----------
    a, velocity, bias
        The first pose, its velocity in the map, and its bias of rates and of forces.
    b, next_velocity
        The second pose and velocity.
    motion, place, by_bias
        As from `preintegrate`.
    dt
        The time between both poses.
    reference
        The bias that was subtracted.
    gravity
        In the frame of the map.
    """
    off = [x - y for x, y in zip(bias, reference, strict=True)]
    change = [dot(row, off) for row in by_bias]
    turn = _bivector((*change[:3], 0, 0, 0))
    misfit = _rotor_part(~(_rotor_part(motion) * ga.exp(turn))) * _rotor_part(~a * b)
    # Both signs are the same rotation; the logarithm of a rotor that is not declared as a motor keeps its sign.
    logarithm = ga.log(select(misfit["1"] < 0, -1, 1) * misfit)
    start, end, speed = translation_of(a), translation_of(b), translation_of(motion)
    of_velocity = _into_frame(a, [w - v - dt * g for v, w, g in zip(velocity, next_velocity, gravity, strict=True)])
    way = [
        q - p - dt * v - HALF * dt * dt * g for p, q, v, g in zip(start, end, velocity, gravity, strict=True)
    ]  # fmt: skip
    of_place = _into_frame(a, way)
    return (
        *(2 * sign * logarithm[name] for name, sign in MOTIONS[:3]),
        *(x - s - c for x, s, c in zip(of_velocity, speed, change[3:6], strict=True)),
        *(x - s - c for x, s, c in zip(of_place, place, change[6:], strict=True)),
    )


@kernel(
    **_INERTIAL,
    returns=(array(SCALAR, 9), _by_rows(9, 6), _by_rows(9, 3), _by_rows(9, 6), _by_rows(9, 6), _by_rows(9, 3)),
)
def inertial_motion(a, velocity, bias, b, next_velocity, motion, place, dt, by_bias, reference, gravity):
    """Compute `misfit_of_inertial` and its derivatives by its first five arguments."""
    given = (a, velocity, bias, b, next_velocity, motion, place, dt, by_bias, reference, gravity)
    tangents = {
        "a": [a * g for g in GENERATORS], "velocity": UNITS, "bias": SIX_UNITS,
        "b": [b * g for g in GENERATORS], "next_velocity": UNITS,
    }  # fmt: skip
    found = [[_BY_INERTIAL[name].function(*given, tangent)[1] for tangent in each] for name, each in tangents.items()]
    return misfit_of_inertial.function(*given), *(_matrix(columns) for columns in found)


_BY_INERTIAL = {name: jvp(misfit_of_inertial, name) for name in ("a", "velocity", "bias", "b", "next_velocity")}
