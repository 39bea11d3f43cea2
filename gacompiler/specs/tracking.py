"""Tracking by a camera on a robot: images of points, lines and planes, their derivatives, and steps of control.

The camera's frame has z along the optical axis, x to the right and y down. A robot is a chain of joints with unit
lines `axes` in the base frame at home, ``M = exp(-q_1/2 l_1) ... exp(-q_n/2 l_n)``; `turns` is 1 for a revolute joint
and 0 for a prismatic one, whose `axes` are lines at infinity. `camera` is the motor from the camera's frame to the base
frame at home.

Each coordinate of an image depends on the motion of an element relative to the camera through a line, its wrench: the
rate of change of the coordinate is ``twist & wrench``, and an entry of the image Jacobian is minus the join of the
wrench with the axis of a joint.
"""

from fractions import Fraction
from typing import Any, NamedTuple

from gacompiler import (
    SCALAR,
    absolute,
    array,
    atan2,
    commutator,
    cos,
    each,
    eigenvalues_symmetric,
    fold,
    kernel,
    maximum,
    sandwich,
    scan,
    select,
    sin,
    solve_symmetric,
    sqrt,
    total,
)
from gacompiler.algebra.catalog import PGA3
from gacompiler.specs.families.covariances import cross, dot
from gacompiler.specs.families.lines import direction_of, line_of, moment_of, place_of

LINE, MOTOR, POINT, PLANE = PGA3.LINE, PGA3.MOTOR, PGA3.POINT, PGA3.PLANE
PAIR, TRIPLE = array(SCALAR, 2), array(SCALAR, 3)
NUMBERS = array(SCALAR, "n")
CHAIN = {
    "q": NUMBERS,
    "axes": array(LINE, "n", shared=True),
    "turns": array(SCALAR, "n", shared=True),
    "camera": MOTOR,
}
HALF = Fraction(1, 2)
NEVER_ZERO = Fraction(1, 10**300)
NOT_SEEN = Fraction(1, 10**6)
"""An element has no image if a denominator is at most this fraction of the quantities that it is compared with."""
SMALL, FINITE = Fraction(1, 2**1000), 2**60
"""Numbers count as finite if the sum of their absolute values times SMALL is at most FINITE."""
OK, SATURATED, SINGULAR, NOT_VISIBLE, NOT_FINITE = range(5)
"""The statuses of `algorithms.estimation.TrackingStatus`."""


# Numbers with two derivatives with respect to time.


class Jet(NamedTuple):
    """A number and its first two derivatives with respect to time."""

    value: Any
    rate: Any
    bend: Any


def _times(a, b):
    return Jet(
        a.value * b.value,
        a.rate * b.value + a.value * b.rate,
        a.bend * b.value + 2 * a.rate * b.rate + a.value * b.bend,
    )


def _plus(a, b):
    return Jet(*(x + y for x, y in zip(a, b, strict=True)))


def _scaled(factor, a):
    return Jet(*(factor * x for x in a))


def _quotient(a, b):
    value = a.value / b.value
    rate = (a.rate - value * b.rate) / b.value
    return Jet(value, rate, (a.bend - 2 * rate * b.rate - value * b.bend) / b.value)


def _root(a):
    value = sqrt(a.value)
    rate = a.rate / (2 * value)
    return Jet(value, rate, (a.bend / 2 - rate * rate) / value)


def _angle(y, x):
    square = x.value * x.value + y.value * y.value
    rate = (x.value * y.rate - y.value * x.rate) / square
    growth = 2 * (x.value * x.rate + y.value * y.rate)
    return Jet(atan2(y.value, x.value), rate, (x.value * y.bend - y.value * x.bend - rate * growth) / square)


# Lines, points and planes in coordinates.


def _is_finite(values):
    return SMALL * sum(map(absolute, values)) <= FINITE


# Images. Each function returns the coordinates, their wrenches, and whether the element has an image.


class Image(NamedTuple):
    """Coordinates of an element's image."""

    values: Any
    wrenches: Any
    """A line for each coordinate, in the frame of the camera."""
    seen: Any


def _divisor(seen, x):
    """Return `x` where the element is seen, otherwise 1, so that quotients are finite."""
    return select(seen, x, 1)


def _point_image(point, mirror):
    place = place_of(point)
    x, y, z = place
    square = dot(place, place)
    far = sqrt(square + NEVER_ZERO)
    depth = z + mirror * far
    seen = (depth > NOT_SEEN * far) * (square > 0)
    scale = _divisor(seen, depth)
    values = x / scale, y / scale
    away = tuple(mirror * c / far for c in place)
    wrenches = []
    for k, value in enumerate(values):
        gradient = tuple((int(i == k) - value * (away[i] + int(i == 2))) / scale for i in range(3))
        wrenches.append(line_of(gradient, cross(place, gradient)))
    return Image(values, wrenches, seen)


def _line_image(line):
    direction, moment = direction_of(line), moment_of(line)
    a, b, c = moment
    square = a * a + b * b
    seen = square > NOT_SEEN * NOT_SEEN * dot(moment, moment)
    scale = _divisor(seen, square)
    norm = sqrt(scale)
    distance = -c / norm
    gradients = (-b / scale, a / scale, 0), (-distance * a / scale, -distance * b / scale, -1 / norm)
    wrenches = [line_of(cross(direction, g), cross(moment, g)) for g in gradients]
    return Image((atan2(b, a), distance), wrenches, seen)


def _plane_image(plane):
    normal = plane["e1"], plane["e2"], plane["e3"]
    distance = -plane["e0"]
    seen = distance * distance > NOT_SEEN * NOT_SEEN * NOT_SEEN * NOT_SEEN * dot(normal, normal)
    scale = _divisor(seen, distance)
    values = tuple(n / scale for n in normal)
    wrenches = []
    for k, value in enumerate(values):
        gradient = tuple(int(i == k) / scale for i in range(3))
        force = tuple(-value / scale * n for n in normal)
        wrenches.append(line_of(force, cross(normal, gradient)))
    return Image(values, wrenches, seen)


def _moving_point_image(point, first, second, mirror):
    """Return the coordinates of a moving point's image as jets."""
    place = [Jet(*each_) for each_ in zip(place_of(point), place_of(first), place_of(second), strict=True)]
    square = _plus(_plus(_times(place[0], place[0]), _times(place[1], place[1])), _times(place[2], place[2]))
    far = _root(_plus(square, Jet(NEVER_ZERO, 0, 0)))
    depth = _plus(place[2], _scaled(mirror, far))
    seen = depth.value > NOT_SEEN * far.value
    depth = Jet(_divisor(seen, depth.value), depth.rate, depth.bend)
    return [_quotient(place[0], depth), _quotient(place[1], depth)]


def _moving_line_image(line, first, second):
    a, b, c = (Jet(*each_) for each_ in zip(moment_of(line), moment_of(first), moment_of(second), strict=True))
    square = _plus(_times(a, a), _times(b, b))
    seen = square.value > NOT_SEEN * NOT_SEEN * dot(moment_of(line), moment_of(line))
    square = Jet(_divisor(seen, square.value), square.rate, square.bend)
    angle = _angle(b, Jet(select(seen, a.value, 1), a.rate, a.bend))
    return [angle, _quotient(_scaled(-1, c), _root(square))]


def _moving_plane_image(plane, first, second):
    parts = [Jet(*(each_[name] for each_ in (plane, first, second))) for name in ("e1", "e2", "e3", "e0")]
    *normal, offset = parts
    seen = offset.value * offset.value > NOT_SEEN * NOT_SEEN * NOT_SEEN * NOT_SEEN * dot(
        [n.value for n in normal], [n.value for n in normal]
    )
    distance = Jet(_divisor(seen, -offset.value), -offset.rate, -offset.bend)
    return [_quotient(n, distance) for n in normal]


# The chain of joints.


def _moved_line(motor, line):
    # The relation ``m ~m = 1`` of products in a loop is not inferred, only that the result is a bivector.
    return sandwich(motor, line).grade(2)


def _chain(q, axes, turns, camera):
    """Return the lines of the joints now, and the motor of the camera."""

    def after(motor, x, axis, turn):
        half = x / 2
        return motor * (select(turn, cos(half), 1) - select(turn, sin(half), half) * axis)

    motors = scan(after, 1, q, axes, turns)
    last = fold(lambda _, motor: motor, 1, motors)
    # A joint does not move its own line.
    lines = each(_moved_line, motors, axes)
    return lines, last * camera


def _entries(lines, wrenches):
    """Return the image Jacobian: for each joint the rates of the coordinates at unit speed."""
    return each(lambda line: tuple(-(line & wrench) for wrench in wrenches), lines)


def _image_of(image, grade):
    """Return a function that computes images in a moved camera, with wrenches in the base frame."""

    def found(motor, element, *more):
        own = image(sandwich(~motor, element).grade(grade), *more)
        return Image(own.values, [_moved_line(motor, wrench) for wrench in own.wrenches], own.seen)

    return found


_point_seen, _line_seen, _plane_seen = _image_of(_point_image, 3), _image_of(_line_image, 2), _image_of(_plane_image, 1)


@kernel(**CHAIN, point=POINT, mirror=SCALAR, returns=(PAIR, array(SCALAR, "n", 2), SCALAR))
def image_of_point(q, axes, turns, camera, point, mirror):
    """Compute the image of a point of the base frame, its Jacobian, and whether the point is seen.

    The coordinates are ``x / (z + mirror r)`` and ``y / (z + mirror r)``, with the distance r of the point: those of a
    pinhole camera if `mirror` is 0, of a parabolic mirror or a stereographic projection if it is 1, and of the unified
    model of cameras with mirrors in general.
    """
    lines, motor = _chain(q, axes, turns, camera)
    image = _point_seen(motor, point, mirror)
    return tuple(image.values), _entries(lines, image.wrenches), image.seen


@kernel(**CHAIN, line=LINE, returns=(PAIR, array(SCALAR, "n", 2), SCALAR))
def image_of_line(q, axes, turns, camera, line):
    """Compute the image of a line of the base frame, its Jacobian, and whether the line is seen.

    The image is the line ``x cos(theta) + y sin(theta) = rho`` with coordinates theta and rho. The line need not be
    normalised; the opposite line has the angle theta + pi and the distance -rho.
    """
    lines, motor = _chain(q, axes, turns, camera)
    image = _line_seen(motor, line)
    return tuple(image.values), _entries(lines, image.wrenches), image.seen


@kernel(**CHAIN, plane=PLANE, returns=(TRIPLE, array(SCALAR, "n", 3), SCALAR))
def image_of_plane(q, axes, turns, camera, plane):
    """Compute the image of a plane of the base frame, its Jacobian, and whether the plane is seen.

    The coordinates are those of the inverse depth, ``1/z = a x + b y + c`` at the image point (x, y): the disparities
    of a stereo camera are proportional to them.
    """
    lines, motor = _chain(q, axes, turns, camera)
    image = _plane_seen(motor, plane)
    return tuple(image.values), _entries(lines, image.wrenches), image.seen


# Steps of control.


class Solved(NamedTuple):
    """Rates of the joints for wanted rates of an image."""

    rates: Any
    least: Any
    """The smallest singular value of the weighted Jacobian."""


def _solved(entries, weights, wanted, threshold, damping):
    """Return the weighted damped least-squares solution, with the least norm.

    The square of the damping increases as the smallest singular value falls below the threshold, and is 0 above it
    (Nakamura and Hanafusa, *J. Dyn. Syst. Meas. Control* 108:163, 1986).
    """
    size = len(wanted)
    places = [(i, j) for i in range(size) for j in range(i + 1)]
    sums = total(lambda row, weight: tuple(weight * row[i] * row[j] for i, j in places), entries, weights)
    table = dict(zip(places, sums, strict=True))
    gram = [[table[max(i, j), min(i, j)] for j in range(size)] for i in range(size)]
    lowest = maximum(eigenvalues_symmetric(gram)[0], 0)
    bound = threshold * threshold
    damped = select(lowest < bound, damping * damping * (1 - lowest / maximum(bound, NEVER_ZERO)), 0) + NEVER_ZERO
    solution, _ = solve_symmetric(
        [[gram[i][j] + (damped if i == j else 0) for j in range(size)] for i in range(size)], wanted
    )
    rates = each(lambda row, weight: weight * dot(row, solution), entries, weights)
    return Solved(rates, sqrt(lowest))


def _within(rates, limits, seen, least, threshold, more):
    """Return rates scaled to their limits, and the status of the step; rates are 0 where they are not finite."""
    size, excess = fold(
        lambda found, rate, limit: (
            found[0] + SMALL * absolute(rate),
            maximum(found[1], absolute(rate) / maximum(limit, NEVER_ZERO)),
        ),
        (0, 0),
        rates,
        limits,
    )
    finite = (size <= FINITE) * _is_finite(more)
    scale = select(excess > 1, 1 / maximum(excess, 1), 1)
    moving = finite * seen
    applied = each(lambda rate: select(moving, scale * rate, 0), rates)
    status = select(
        finite,
        select(seen, select(least < threshold, SINGULAR, select(excess > 1, SATURATED, OK)), NOT_VISIBLE),
        NOT_FINITE,
    )
    return applied, status


def _wrapped(angle):
    return atan2(sin(angle), cos(angle))


def _rates(entries, image, goal, goal_rate, twist, gain, weights, limits, threshold, damping, turned=()):
    """Return the rates of the joints, the error, the smallest singular value and the status of a step."""
    errors = [
        _wrapped(value - wanted) if k in turned else value - wanted
        for k, (value, wanted) in enumerate(zip(image.values, goal, strict=True))
    ]
    drift = [twist & wrench for wrench in image.wrenches]
    wanted = [rate - k * error - own for rate, k, error, own in zip(goal_rate, gain, errors, drift, strict=True)]
    found = _solved(entries, weights, wanted, threshold, damping)
    applied, status = _within(found.rates, limits, image.seen, found.least, threshold, [*errors, *wanted, found.least])
    return applied, tuple(errors), found.least, status


def _velocity(size):
    """Return the parameters of a step of velocity control for an image with `size` coordinates."""
    task = array(SCALAR, size)
    return {
        "twist": LINE,
        "goal": task,
        "goal_rate": task,
        "gain": task,
        "weights": array(SCALAR, "n"),
        "limits": array(SCALAR, "n"),
        "threshold": SCALAR,
        "damping": SCALAR,
    }


def _step(size):
    return (NUMBERS, array(SCALAR, size), SCALAR, SCALAR)


@kernel(**CHAIN, point=POINT, mirror=SCALAR, **_velocity(2), returns=_step(2))
def rates_for_point(
    q, axes, turns, camera, point, mirror, twist, goal, goal_rate, gain, weights, limits, threshold, damping
):
    """Compute rates of the joints with which the error of a point's image decays: ``e' = -gain e``.

    Parameters
    ----------
    q, axes, turns, camera, point, mirror
        As in `image_of_point`.
    twist
        The twist of the point in the base frame.
    goal, goal_rate
        The desired image and its rate of change.
    gain
        The rates at which the coordinates of the error decay.
    weights
        The mobility of the joints: a joint with weight 0 does not move.
    limits
        The largest rates. All rates are scaled by the same factor to be within them.
    threshold, damping
        The singular value below which the solution is damped, and the damping at a singularity.

    Returns
    -------
    rates
        0 if the point is not seen, or if a number is not finite.
    error
        The image minus the goal.
    least
        The smallest singular value of the weighted Jacobian.
    status
        A number of `algorithms.estimation.TrackingStatus`.
    """
    lines, motor = _chain(q, axes, turns, camera)
    image = _point_seen(motor, point, mirror)
    entries = _entries(lines, image.wrenches)
    return _rates(entries, image, goal, goal_rate, twist, gain, weights, limits, threshold, damping)


@kernel(**CHAIN, line=LINE, **_velocity(2), returns=_step(2))
def rates_for_line(q, axes, turns, camera, line, twist, goal, goal_rate, gain, weights, limits, threshold, damping):
    """Compute rates of the joints with which the error of a line's image decays, as in `rates_for_point`.

    The error of the angle is in (-pi, pi].
    """
    lines, motor = _chain(q, axes, turns, camera)
    image = _line_seen(motor, line)
    entries = _entries(lines, image.wrenches)
    return _rates(entries, image, goal, goal_rate, twist, gain, weights, limits, threshold, damping, turned=(0,))


@kernel(**CHAIN, plane=PLANE, **_velocity(3), returns=_step(3))
def rates_for_plane(q, axes, turns, camera, plane, twist, goal, goal_rate, gain, weights, limits, threshold, damping):
    """Compute rates of the joints with which the error of a plane's image decays, as in `rates_for_point`."""
    lines, motor = _chain(q, axes, turns, camera)
    image = _plane_seen(motor, plane)
    entries = _entries(lines, image.wrenches)
    return _rates(entries, image, goal, goal_rate, twist, gain, weights, limits, threshold, damping)


# Accelerations, for control by forces.


class Moving(NamedTuple):
    """The motion of an element relative to the camera, in the camera's frame."""

    lines: Any
    motor: Any
    twist: Any
    change: Any
    """The rate of change of the twist if the joints do not accelerate."""


def _moving(q, qd, axes, turns, camera, twist):
    lines, motor = _chain(q, axes, turns, camera)

    def outward(carrier, line, speed):
        total_twist, change = carrier
        rate = commutator(line, total_twist)
        return total_twist + speed * line, change + speed * rate

    nothing = PGA3.multivector({})
    own, change = fold(outward, (nothing, nothing), lines, qd)
    # The derivative of ``~m y m`` is ``~m (y' + t x y) m`` if the twist of the motor m is t.
    relative = _moved_line(~motor, twist - own)
    return Moving(lines, motor, relative, _moved_line(~motor, commutator(own, twist) - change))


def _jets(element, moving, image, *more):
    """Return the coordinates of the image of an element of the camera's frame as jets."""
    first = commutator(element, moving.twist)
    second = commutator(element, moving.change) + commutator(first, moving.twist)
    return image(element, first, second, *more)


def _acceleration(size):
    task = array(SCALAR, size)
    return {
        "twist": LINE,
        "goal": task,
        "goal_rate": task,
        "goal_bend": task,
        "gain": task,
        "damping_gain": task,
        "weights": array(SCALAR, "n"),
        "limits": array(SCALAR, "n"),
        "threshold": SCALAR,
        "damping": SCALAR,
    }


def _accelerations(
    moving, image, jets, goal, goal_rate, goal_bend, gain, damping_gain, weights, limits, threshold, damping, turned=()
):
    errors = [
        _wrapped(jet.value - wanted) if k in turned else jet.value - wanted
        for k, (jet, wanted) in enumerate(zip(jets, goal, strict=True))
    ]
    slopes = [jet.rate - rate for jet, rate in zip(jets, goal_rate, strict=True)]
    wanted = [
        bend - d * slope - k * error - jet.bend
        for bend, d, slope, k, error, jet in zip(goal_bend, damping_gain, slopes, gain, errors, jets, strict=True)
    ]
    entries = _entries(moving.lines, [_moved_line(moving.motor, wrench) for wrench in image.wrenches])
    found = _solved(entries, weights, wanted, threshold, damping)
    numbers = [*errors, *wanted, found.least]
    applied, status = _within(found.rates, limits, image.seen, found.least, threshold, numbers)
    return applied, tuple(errors), tuple(slopes), found.least, status


def _bend(size):
    return (NUMBERS, array(SCALAR, size), array(SCALAR, size), SCALAR, SCALAR)


@kernel(**CHAIN, qd=NUMBERS, point=POINT, mirror=SCALAR, **_acceleration(2), returns=_bend(2))
def accelerations_for_point(
    q, axes, turns, camera, qd, point, mirror, twist,
    goal, goal_rate, goal_bend, gain, damping_gain, weights, limits, threshold, damping,
):  # fmt: skip
    """Compute accelerations of the joints with ``e'' + damping_gain e' + gain e = 0`` for the image of a point.

    Parameters are those of `rates_for_point`, and the rates of the joints `qd`, the second derivative of the goal, and
    the two gains. The twist of the point is constant. The limits are those of the accelerations.

    Returns
    -------
    accelerations
        0 if the point is not seen, or if a number is not finite.
    error, error_rate
        The image minus the goal, and its rate of change.
    least
        The smallest singular value of the weighted Jacobian.
    status
        A number of `algorithms.estimation.TrackingStatus`.
    """
    moving = _moving(q, qd, axes, turns, camera, twist)
    seen = sandwich(~moving.motor, point).grade(3)
    jets = _jets(seen, moving, _moving_point_image, mirror)
    image = _point_image(seen, mirror)
    return _accelerations(
        moving, image, jets, goal, goal_rate, goal_bend, gain, damping_gain, weights, limits, threshold, damping
    )


@kernel(**CHAIN, qd=NUMBERS, line=LINE, **_acceleration(2), returns=_bend(2))
def accelerations_for_line(
    q, axes, turns, camera, qd, line, twist,
    goal, goal_rate, goal_bend, gain, damping_gain, weights, limits, threshold, damping,
):  # fmt: skip
    """Compute accelerations of the joints for the image of a line, as in `accelerations_for_point`."""
    moving = _moving(q, qd, axes, turns, camera, twist)
    seen = sandwich(~moving.motor, line).grade(2)
    jets = _jets(seen, moving, _moving_line_image)
    image = _line_image(seen)
    return _accelerations(
        moving, image, jets,
        goal, goal_rate, goal_bend, gain, damping_gain, weights, limits, threshold, damping, turned=(0,),
    )  # fmt: skip


@kernel(**CHAIN, qd=NUMBERS, plane=PLANE, **_acceleration(3), returns=_bend(3))
def accelerations_for_plane(
    q, axes, turns, camera, qd, plane, twist,
    goal, goal_rate, goal_bend, gain, damping_gain, weights, limits, threshold, damping,
):  # fmt: skip
    """Compute accelerations of the joints for the image of a plane, as in `accelerations_for_point`."""
    moving = _moving(q, qd, axes, turns, camera, twist)
    seen = sandwich(~moving.motor, plane).grade(1)
    jets = _jets(seen, moving, _moving_plane_image)
    image = _plane_image(seen)
    return _accelerations(
        moving, image, jets, goal, goal_rate, goal_bend, gain, damping_gain, weights, limits, threshold, damping
    )
