"""Navigation in floor plans and line maps: rays, poses from lines, paths of lines and arcs, objects, stereo points.

Lines and motors of the plane are those of `generated.pga2`. The error of a pose is the twist x in the frame of the
robot for which the true motor is ``m exp(-x/2)``: the angle, and the translation of the robot ahead and to the left.
Covariances are passed as upper triangles, row by row. The covariance of a line ``n . v = d`` is that of the angle of n
and of d.

Lines and circles are, as dual circles of `generated.cga2`, vectors s with ``s . s = 1``: ``n + d einf`` and
``k (c - r**2/2 einf)`` with the curvature ``k = 1/r`` or ``-1/r``, the coefficient of e0. The signed distance e of a
point X follows from one formula for both: ``X . s = e - k e**2/2``. It is positive on the left of the path if the
curvature is positive for left turns, as its centre is then on the left. Planes and spheres of `generated.cga3` are the
same in space.
"""

from fractions import Fraction
from typing import Any, NamedTuple

import gacompiler as ga
from gacompiler import SCALAR, absolute, array, assemble, atan2, fold, iterate, kernel, maximum, minimum, select, sqrt
from gacompiler.algebra.catalog import CGA2, CGA3, PGA2, PGA3
from gacompiler.specs.families.covariances import (
    are_finite,
    choose,
    congruent,
    dot,
    measured,
    size_of_triangle,
    square,
    triangle,
)

POINT, DIRECTION, LINE, MOTOR = PGA2.POINT, PGA2.DIRECTION, PGA2.LINE, PGA2.MOTOR
PAIR, TRIPLE, COVARIANCE = array(SCALAR, 2), array(SCALAR, 3), array(SCALAR, size_of_triangle(3))
FAR = 10**30
"""The distance of what is not there."""
TINY = Fraction(1, 10**12)
NEVER_ZERO = Fraction(1, 10**200)
FEET = 3
"""The number of steps that find the place of an object from which a measured point deviates."""
STEPS = 20
"""Maximum number of linearisations."""
TWISTS = [PGA2.multivector(part) for part in ({"e12": 1}, {"e01": 1}, {"e20": -1})]
"""The twists of a unit angle, and of unit translations along x and y."""


# Rays and walls.


@kernel(
    origin=POINT, direction=DIRECTION, starts=array(POINT, "n", shared=True), ends=array(POINT, "n", shared=True),
    returns=(SCALAR, SCALAR),
)  # fmt: skip
def cast_ray(origin, direction, starts, ends):
    """Compute the distance along a ray to the first of n walls, segments from `starts` to `ends`, and the wall's index.

    The distance is a multiple of the length of `direction`. Without a wall it is 1e30, and the index is -1. A ray
    through a common end of two walls meets one of them, since the test is by the signs of the areas of ray and ends.
    """
    ray = origin & direction

    def nearer(found, a, b):
        nearest, row, number = found
        left, right = ray & a, ray & b
        across = right - left
        parallel = (left <= 0) * (left >= 0) * (right <= 0) * (right >= 0)
        t = (origin & a & b) / select(parallel, 1, across)
        hits = (left * right <= 0) * (1 - parallel) * (t >= 0) * (t < nearest)
        return select(hits, t, nearest), select(hits, number, row), number + 1

    distance, wall, _ = fold(nearer, (FAR, -1, 0), starts, ends)
    return distance, wall


# Poses from lines.


def _normal(line):
    return line["e1"], line["e2"]


def _twist(numbers):
    return sum(x * one for x, one in zip(numbers, TWISTS, strict=True))


def _numbers(bivector):
    return bivector["e12"], bivector["e01"], -bivector["e20"]


def _adjoint(motor):
    """Return the rows of the matrix that moves twists."""
    columns = [_numbers(ga.sandwich(motor, one)) for one in TWISTS]
    return [list(row) for row in zip(*columns, strict=True)]


def _unit(motor):
    """Remove the rounding errors of the norm of an almost unit motor."""
    return motor / sqrt(motor["1"] * motor["1"] + motor["e12"] * motor["e12"])


@kernel(motor=MOTOR, covariance=COVARIANCE, motion=MOTOR, noise=COVARIANCE, returns=(MOTOR, COVARIANCE))
def predict_pose(motor, covariance, motion, noise):
    """Predict a pose after a motion in the frame of the robot, as by odometry, with a covariance of its error."""
    moved = triangle(congruent(_adjoint(~motion), square(covariance, 3)))
    return _unit(motor * motion), tuple(a + b for a, b in zip(moved, noise, strict=True))


class Deviation(NamedTuple):
    """The deviation of a measured line from a line of a map."""

    angle: Any
    offset: Any
    """Of the measured line, at the foot of the perpendicular from the robot."""
    normal: Any
    """The unit normal of the predicted line in the frame of the robot."""
    noise: Any
    """The covariance of angle and offset by both lines."""
    usable: Any


def _deviation(motor, model, spread, seen, noise):
    """Return the deviation of a measured line; the normals of both lines may be opposite."""
    predicted = ga.sandwich(~motor, model)
    p, q = _normal(predicted), _normal(seen)
    sizes = dot(p, p), dot(q, q)
    exists = (sizes[0] > 0) * (sizes[1] > 0)
    lengths = [sqrt(select(size > 0, size, 1)) for size in sizes]
    sign = select(dot(p, q) < 0, -1, 1)
    p, d = tuple(sign * x / lengths[0] for x in p), -sign * predicted["e0"] / lengths[0]
    q, e = tuple(x / lengths[1] for x in q), -seen["e0"] / lengths[1]
    # The offset of the map's line is that from the origin of the map; the robot is away from it, and the angle turns
    # the line about the origin's foot of the perpendicular.
    n = tuple(x / lengths[0] for x in _normal(model))
    robot = ga.sandwich(motor, PGA2.multivector({"e12": 1}))
    arm = n[0] * robot["e01"] - n[1] * robot["e20"]
    aa, ad, dd = spread
    own = aa, sign * (ad - arm * aa), dd - 2 * arm * ad + arm * arm * aa
    both = tuple(a + b for a, b in zip(own, noise, strict=True))
    angle = atan2(p[0] * q[1] - p[1] * q[0], dot(p, q))
    usable = exists * are_finite((angle, e, d, *both)) * (both[0] > 0) * (both[2] > 0)
    return Deviation(angle, e - d, p, both, usable)


def _independent(deviation):
    """Return two uncorrelated deviations, the rows of their derivatives by the twist of the pose, and variances."""
    aa, ad, dd = (select(deviation.usable, a, b) for a, b in zip(deviation.noise, (1, 0, 1), strict=True))
    slope = ad / aa
    x, y = deviation.normal
    rest = dd - slope * ad
    rows = (-1, 0, 0), (slope, -x, -y)
    return (deviation.angle, deviation.offset - slope * deviation.angle), rows, (aa, maximum(rest, TINY * dd))


def _square_of(deviation, state, covariance):
    """Return the state and covariance after a line, and the square of its innovation divided by its covariance."""
    values, rows, variances = _independent(deviation)
    total = 0
    for value, row, variance in zip(values, rows, variances, strict=True):
        innovation = select(deviation.usable, value - dot(row, state), 0)
        state, covariance, part = measured(state, covariance, row, innovation, variance)
        total = total + part
    return state, covariance, total


@kernel(
    motor=MOTOR, covariance=COVARIANCE, seen=LINE, noise=TRIPLE, first=POINT, last=POINT,
    model=array(LINE, "n", shared=True), spread=array(SCALAR, "n", 3, shared=True),
    extent=array(SCALAR, "n", 2, shared=True), margin=SCALAR, one_sided=SCALAR,
    returns=(SCALAR, SCALAR, SCALAR),
)  # fmt: skip
def associate_line(motor, covariance, seen, noise, first, last, model, spread, extent, margin, one_sided):
    """Find the line of a map that agrees best with a line measured in the frame of a robot.

    Parameters
    ----------
    motor, covariance
        The pose.
    seen, noise
        The measured line, and the covariance of its angle and offset.
    first, last
        The ends of the measured segment.
    model, spread
        Unit lines of the map, and the covariances of their angles and offsets.
    extent
        The smallest and largest position of the map's segments along their lines.
    margin
        The middle of the measured segment may be beyond an end of the map's segment by this length.
    one_sided
        1 if lines are seen only from the side from which their normals point away, else 0.

    Returns
    -------
    row
        The index of the line, or -1.
    square, next_square
        The squared innovation divided by its covariance, for this line and for the second best; 1e30 if there is none.
    """
    middle = ga.sandwich(motor, (first + last) / 2)

    def better(found, line, own, limits):
        best, following, row, number = found
        deviation = _deviation(motor, line, own, seen, noise)
        _, _, value = _square_of(deviation, (0, 0, 0), square(covariance, 3))
        along = middle["e20"] * line["e2"] - middle["e01"] * line["e1"]
        overlaps = (limits[0] - margin <= along) * (along <= limits[1] + margin)
        faces = maximum(1 - one_sided, ga.sandwich(~motor, line)["e0"] <= 0)
        value = select(deviation.usable * overlaps * faces, value, FAR)
        is_best = value < best
        return (
            select(is_best, value, best),
            select(is_best, best, minimum(following, value)),
            select(is_best, number, row),
            number + 1,
        )

    best, following, row, _ = fold(better, (FAR, FAR, -1, 0), model, spread, extent)
    return row, best, following


class Pose(NamedTuple):
    """A linearisation of an update of a pose."""

    motor: Any
    covariance: Any
    predicted_square: Any
    """The sum of squared innovations at the first linearisation."""
    used: Any
    first: Any
    turned: Any
    moved: Any


@kernel(
    motor=MOTOR, covariance=COVARIANCE, model=array(LINE, "n"), spread=array(SCALAR, "n", 3), seen=array(LINE, "n"),
    noise=array(SCALAR, "n", 3), gate=SCALAR,
    returns=(MOTOR, COVARIANCE, TRIPLE),
)  # fmt: skip
def update_pose(motor, covariance, model, spread, seen, noise, gate):
    """Update a pose by measured lines that are associated with lines of a map, linearised until it does not change.

    Parameters
    ----------
    motor, covariance
        The prediction.
    model, spread
        Lines of the map, and the covariances of their angles and offsets.
    seen, noise
        Lines in the frame of the robot, and the covariances of their angles and offsets.
    gate
        Lines are left out if their squared innovation, divided by its covariance, exceeds this.

    Returns
    -------
    motor, covariance
        The estimate.
    numbers
        The sum of squared innovations at the prediction, how many lines were used, and whether the iteration converged.
    """
    prior = square(covariance, 3)

    def linearised(now):
        # The prior error at m exp(-x/2) is -x; the adjoint of half the motion moves its covariance.
        error = _numbers(-2 * ga.log(~now.motor * motor))
        half = _adjoint(ga.exp(_twist(error) / -4))

        def taken(carry, line, own, measured_line, other):
            state, spread_now, total, used = carry
            deviation = _deviation(now.motor, line, own, measured_line, other)
            after, rows, part = _square_of(deviation, state, square(spread_now, 3))
            takes = deviation.usable * (part <= gate)
            return (
                choose(takes, tuple(after), state),
                choose(takes, triangle(rows), spread_now),
                select(takes, total + part, total),
                select(takes, used + 1, used),
            )

        begun = error, triangle(congruent(half, prior)), 0, 0
        state, spread_now, total, used = fold(taken, begun, model, spread, seen, noise)
        following = _unit(now.motor * ga.exp(_twist(state) / -2))
        return Pose(
            following, spread_now, select(now.first, total, now.predicted_square), used, 0, state[0] * state[0],
            state[1] * state[1] + state[2] * state[2],
        )  # fmt: skip

    begun = Pose(motor, tuple(covariance), 0, 0, 1, 0, 0)

    def settled(_, new):
        spread_now = square(new.covariance, 3)
        return (1000 * new.turned <= spread_now[0][0]) * (1000 * new.moved <= spread_now[1][1] + spread_now[2][2])

    found, converged, _ = iterate(linearised, begun, settled, STEPS)
    return found.motor, found.covariance, (found.predicted_square, found.used, converged)


# Paths and control.


def _distance(square_of_distance, curvature):
    """Return the signed distance from the inner product with a unit vector, of a line or a circle."""
    return 2 * square_of_distance / (1 + sqrt(maximum(1 - 2 * curvature * square_of_distance, 0)))


@kernel(
    p=CGA2.POINT, pieces=array(CGA2.VECTOR, "n", shared=True), starts=array(SCALAR, "n", 4, shared=True),
    spans=array(SCALAR, "n", 2, shared=True), low=SCALAR, high=SCALAR,
    returns=(SCALAR, SCALAR, SCALAR),
)  # fmt: skip
def nearest_on_path(p, pieces, starts, spans, low, high):
    """Find the point of a path of lines and arcs that is nearest to a point.

    Parameters
    ----------
    p
    pieces
        Unit vectors: dual lines and dual circles.
    starts
        The start of each piece and the cosine and sine of its heading there.
    spans
        The position of the start of each piece along the path, and its length.
    low, high
        Only positions between these are considered.

    Returns
    -------
    distance
        Positive on the left of the path; 1e30 if no position is considered.
    position
        Along the path.
    row
        The index of the piece, or -1.
    """

    def nearer(found, piece, start, span):
        least, distance, position, row, number = found
        curvature = piece["e0"]
        off = _distance(ga.inner_product(p, piece)["1"], curvature)
        dx, dy = p["e1"] - start[0], p["e2"] - start[1]
        x, y = start[2] * dx + start[3] * dy, start[2] * dy - start[3] * dx
        straight = absolute(curvature) <= TINY
        k = select(straight, 1, curvature)
        # The angle is that next to the middle of the arc.
        middle = k * span[1] / 2
        turn = atan2(k * x, 1 - k * y) - middle
        angle = atan2(ga.sin(turn), ga.cos(turn)) + middle
        begin, end = maximum(low - span[0], 0), minimum(high - span[0], span[1])
        along = maximum(minimum(select(straight, x, angle / k), end), begin)
        ahead = select(straight, along, ga.sin(k * along) / k)
        aside = select(straight, 0, (1 - ga.cos(k * along)) / k)
        away = (x - ahead) * (x - ahead) + (y - aside) * (y - aside)
        is_nearer = (begin <= end) * (away < least)
        signed = select(off < 0, -1, 1) * sqrt(away)
        return (
            select(is_nearer, away, least),
            select(is_nearer, signed, distance),
            select(is_nearer, span[0] + along, position),
            select(is_nearer, number, row),
            number + 1,
        )

    _, distance, position, row, _ = fold(nearer, (FAR * FAR, FAR, 0, -1, 0), pieces, starts, spans)
    return distance, position, row


@kernel(
    distance=SCALAR, angle=SCALAR, curvature=SCALAR, speed=SCALAR, gains=PAIR, limit=SCALAR, returns=(SCALAR, SCALAR)
)
def lyapunov_turn(distance, angle, curvature, speed, gains, limit):
    """Compute the angular velocity with which ``k1 e**2 + a**2`` decreases (Samson, *IEEE Trans. Robot. Autom.*, 1995).

    Parameters
    ----------
    distance
        The signed distance e from the path, positive on its left.
    angle
        The heading a relative to the path, in (-pi, pi].
    curvature
        Of the path at the nearest point.
    speed
        Not negative.
    gains
        k1, in 1/length**2, and k2, in 1/length: the angle decays by the rate k2 v.
    limit
        The largest absolute value of the curvature of the motion.

    Returns
    -------
    turn
        The angular velocity.
    wanted
        The angular velocity without the limit.
    """
    is_small = absolute(angle) < TINY
    ratio = select(is_small, 1, ga.sin(angle) / select(is_small, 1, angle))
    room = maximum(1 - curvature * distance, Fraction(1, 10))
    wanted = speed * (curvature * ga.cos(angle) / room - gains[0] * distance * ratio - gains[1] * angle)
    bound = limit * speed
    return maximum(minimum(wanted, bound), -bound), wanted


@kernel(pose=MOTOR, target=POINT, returns=SCALAR)
def pursuit_curvature(pose, target):
    """Compute the curvature of the arc from a robot's pose, tangent to its heading, to a target (pure pursuit)."""
    seen = ga.sandwich(~pose, target)
    x, y = seen["e20"], seen["e01"]
    return 2 * y / (x * x + y * y + NEVER_ZERO)


# Objects.


@kernel(
    p=POINT, poses=array(MOTOR, "n", shared=True), sizes=array(SCALAR, "n", 3, shared=True),
    returns=(SCALAR, SCALAR),
)  # fmt: skip
def distance_to_objects(p, poses, sizes):
    """Compute the signed distance from a point to the nearest of n objects, negative inside, and the object's index.

    An object is a box in the frame of its pose, with half its length along x, half its width along y, enlarged by a
    radius: the three numbers of `sizes`. Circles are boxes of length and width 0, segments those of width and radius 0.
    """

    def nearer(found, pose, size):
        least, row, number = found
        own = ga.sandwich(~pose, p)
        x, y = absolute(own["e20"]) - size[0], absolute(own["e01"]) - size[1]
        right, up = maximum(x, 0), maximum(y, 0)
        distance = sqrt(right * right + up * up) + minimum(maximum(x, y), 0) - size[2]
        is_nearer = distance < least
        return select(is_nearer, distance, least), select(is_nearer, number, row), number + 1

    distance, row, _ = fold(nearer, (FAR, -1, 0), poses, sizes)
    return distance, row


# Lines, circles, planes and spheres of points with covariances.


def _step(algebra, points, spreads, start, curved, damping):
    """Return the unit vector after a Gauss-Newton step, the sum of squares before it, and its predicted decrease."""
    axes = algebra.POINT.blades
    n = len(axes)
    names = (*axes, "e0", "einf")

    def dual(vector):
        """Return half the derivatives of the square of a vector."""
        return [vector[name] for name in axes] + [-vector["einf"], -vector["e0"]]

    def off(vector, place):
        """Return the distance of a place, the square root in the formula of the distance, and the unit normal there."""
        curvature = vector["e0"]
        inner = dot([vector[name] for name in axes], place) - curvature * dot(place, place) / 2 - vector["einf"]
        distance = _distance(inner, curvature)
        room = maximum(1 - curvature * distance, Fraction(1, 1000))
        return distance, room, [(vector[name] - curvature * x) / room for name, x in zip(axes, place, strict=True)]

    def equation(vector, point, spread):
        """Return the distance of a point, its derivatives by the coefficients, and its weight.

        The distance is that along the direction in which the point most probably deviates: it is taken at the place of
        the object that is nearest to the point if lengths are measured by the covariance.
        """
        measured_place = [point[name] for name in axes]
        table = square(spread, n)
        place = measured_place
        for _ in range(FEET):
            distance, _, normal = off(vector, place)
            column = [dot(row, normal) for row in table]
            gap = distance + dot(normal, [a - b for a, b in zip(measured_place, place, strict=True)])
            step = gap / (dot(normal, column) + NEVER_ZERO)
            place = [a - step * c for a, c in zip(measured_place, column, strict=True)]
        distance, room, normal = off(vector, place)
        variance = dot(normal, [dot(row, normal) for row in table])
        bend = (distance * distance - dot(place, place)) / 2
        distance = distance + dot(normal, [a - b for a, b in zip(measured_place, place, strict=True)])
        row = [*(x / room for x in place), bend / room, -1 / room]
        # The distance does not depend on the norm of the vector: its derivative along the vector is 0.
        own = dot(row, [vector[name] for name in names])
        row = [a - own * b for a, b in zip(row, dual(vector), strict=True)]
        row[n] = curved * row[n]
        return distance, row, 1 / (variance + NEVER_ZERO)

    def step(old):
        def sums(carry, point, spread):
            distance, row, weight = equation(old, point, spread)
            full = (*row, distance)
            products = (weight * full[i] * full[j] for i in range(n + 3) for j in range(i, n + 3))
            return tuple(a + b for a, b in zip(carry, products, strict=True))

        size = n + 3
        whole = square(fold(sums, (0,) * size_of_triangle(size), points, spreads), size)
        # The norm s . s = 1 is kept to first order by a term of the size of the others.
        gauge = dual(old)
        gauge[n] = curved * gauge[n]
        scale = sum(whole[k][k] for k in range(n))
        table = [[whole[i][j] + scale * gauge[i] * gauge[j] for j in range(n + 2)] for i in range(n + 2)]
        for k in range(n + 2):
            table[k][k] = table[k][k] + damping * scale
        table[n][n] = table[n][n] + (1 - curved) * scale
        right = [-whole[k][n + 2] for k in range(n + 2)]
        change, _ = ga.solve_symmetric(table, right)
        allowed = [curved if name == "e0" else 1 for name in names]
        moved = [old[name] + a * x for name, a, x in zip(names, allowed, change, strict=True)]
        vector = assemble(algebra, dict(zip(names, moved, strict=True)))
        size_squared = ga.scalar_product(vector, vector)
        return vector / sqrt(select(size_squared > 0, size_squared, 1)), whole[n + 2][n + 2], dot(change, right)

    return step(start)


@kernel(
    points=array(CGA2.POINT, "n"), spreads=array(SCALAR, "n", size_of_triangle(2)), start=CGA2.VECTOR, curved=SCALAR,
    damping=SCALAR, returns=(CGA2.VECTOR, SCALAR, SCALAR),
)  # fmt: skip
def circle_step(points, spreads, start, curved, damping):
    """Compute a Gauss-Newton step to the circle, or the line if `curved` is 0, of points with covariances.

    `start` is a unit vector; `damping` times a mean of the diagonal of the normal equations is added to it. Returns the
    next unit vector, the sum of squared distances from `start` divided by their variances, and the decrease of this sum
    that the step predicts.
    """
    return _step(CGA2, points, spreads, start, curved, damping)


@kernel(
    points=array(CGA3.POINT, "n"), spreads=array(SCALAR, "n", size_of_triangle(3)), start=CGA3.VECTOR, curved=SCALAR,
    damping=SCALAR, returns=(CGA3.VECTOR, SCALAR, SCALAR),
)  # fmt: skip
def sphere_step(points, spreads, start, curved, damping):
    """Compute a Gauss-Newton step to the sphere, or the plane, of points in space, as `circle_step` does."""
    return _step(CGA3, points, spreads, start, curved, damping)


@kernel(
    image=TRIPLE, pair=array(SCALAR, 4), pose=PGA3.MOTOR, variances=PAIR,
    returns=(PGA3.POINT, array(SCALAR, size_of_triangle(3))),
)  # fmt: skip
def stereo_point(image, pair, pose, variances):
    """Compute a point and its covariance from its image in a rectified pair of cameras.

    Parameters
    ----------
    image
        The pixel x and y in the left image, and the disparity.
    pair
        The focal length, the principal point x and y of the left camera, in pixels, and the baseline. Disparities are 0
        for points at infinity.
    pose
        The motor from the frame of the left camera to that of the map.
    variances
        Of pixels and of disparities.
    """
    f, cx, cy, baseline = pair
    x, y, z = image[0] - cx, image[1] - cy, f
    scale = baseline / image[2]
    point = assemble(PGA3, {"e032": scale * x, "e013": scale * y, "e021": scale * z, "e123": 1})
    slope = -scale / image[2]
    columns = (scale, 0, 0), (0, scale, 0), (slope * x, slope * y, slope * z)

    def turned(column):
        names = ("e032", "e013", "e021")
        moved = ga.sandwich(pose, assemble(PGA3, {k: c for k, c in zip(names, column, strict=True)}))
        return [moved[name] for name in names]

    parts = [turned(column) for column in columns]
    weights = variances[0], variances[0], variances[1]
    covariance = tuple(
        sum(w * part[i] * part[j] for w, part in zip(weights, parts, strict=True))
        for i in range(3)
        for j in range(i, 3)
    )
    return ga.sandwich(pose, point), covariance
