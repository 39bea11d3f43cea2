"""Lenses with distortion: images of points, their inverses, and sums of least squares for calibration.

The models are those of `families.lens_models`. Intrinsic parameters are ``fx fy cx cy skew``; a pixel is ``(fx x + skew
y + cx, fy y + cy)`` for coordinates x and y after distortion. A pose is the matrix [R | t] that takes the frame of the
points to that of the camera. Outside of the range in which a model is monotonic, a pixel is that of two points.
Inverses therefore take the end of that range, and return whether their result is within it.
"""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, array, iterate, jacobian, jvp, kernel, select, total
from gacompiler.specs.families import lens_models
from gacompiler.specs.families.sights import GENERATORS, place_of

POSE = array(SCALAR, 3, 4)
BROWN, FISHEYE = array(SCALAR, lens_models.N_BROWN), array(SCALAR, lens_models.N_FISHEYE)
PLACE, PIXEL, INTRINSICS = array(SCALAR, 3), array(SCALAR, 2), array(SCALAR, 5)
PLACES, PIXELS, WEIGHTS = array(SCALAR, "n", 2), array(SCALAR, "n", 2), array(SCALAR, "n")
STEPS = 60
"""Of bisections, from which no more bits of a distance follow."""
NEAR = Fraction(1, 10**15)
"""Newton's steps end at this distance, relative to that of the target."""
STEPS_OF_BOTH = 20
"""Of Newton's method for two coordinates, which starts near the solution and doubles the digits in each step."""
FAR = 10**100
"""Ends of ranges beyond this number are infinite."""
EXACT = Fraction(1, 10**12)
"""The error of an inverse, relative to its target, that counts as 0."""


def _place(point):
    return point["e032"], point["e013"], point["e021"]


def _in_pixels(place, intrinsics):
    (x, y), (fx, fy, cx, cy, skew) = place, intrinsics
    return fx * x + skew * y + cx, fy * y + cy


# Distortion and its inverse.


def _derived():
    """Return derivatives of both models by a distance from the axis, by a place, and by the coefficients."""

    @kernel(place=PIXEL, k=BROWN, returns=PIXEL)
    def brown(place, k):
        x, y = place
        return lens_models.brown(x, y, tuple(k))

    @kernel(place=PLACE, k=FISHEYE, returns=PIXEL)
    def fisheye(place, k):
        x, y, z = place
        return lens_models.fisheye_of_direction(x, y, z, tuple(k))

    @kernel(r=SCALAR, k=BROWN)
    def brown_radius(r, k):
        return r * lens_models.brown_factor(tuple(k), r * r)

    @kernel(r=SCALAR, k=FISHEYE)
    def fisheye_radius(r, k):
        return lens_models.fisheye_angle(r, tuple(k))

    radii = [jacobian(radius, "r") for radius in (brown_radius, fisheye_radius)]
    return radii, [jvp(model, "place") for model in (brown, fisheye)], [jvp(model, "k") for model in (brown, fisheye)]


(_BROWN_RADIUS, _FISHEYE_RADIUS), (_BROWN_BY_PLACE, _FISHEYE_BY_PLACE), (_BROWN_BY_K, _FISHEYE_BY_K) = _derived()


def _columns(derived, size, *arguments):
    """Return the value of a kernel, and its derivatives by each of the numbers of an array."""
    units = [tuple(int(i == j) for j in range(size)) for i in range(size)]
    along = [derived.function(*arguments, unit) for unit in units]
    return along[0][0], tuple(tangent for _, tangent in along)


@kernel(place=PIXEL, k=BROWN, limit=SCALAR, returns=(PIXEL, SCALAR))
def distort_brown(place, k, limit):
    """Compute where a lens of Brown's rational model shows normalised coordinates.

    Parameters
    ----------
    place
        The coordinates ``x / z, y / z`` of a point in the camera frame.
    k
        The coefficients ``k1 k2 p1 p2 k3 k4 k5 k6``.
    limit
        The largest distance from the axis, ``hypot(x, y)``, for which the model is valid; infinite if there is none.

    Returns
    -------
    image
        Coordinates after distortion.
    is_valid
        1 if the place is within the limit, otherwise 0.
    """
    x, y = place
    return lens_models.brown(x, y, tuple(k)), select(ga.sqrt(x * x + y * y) <= limit, 1, 0)


@kernel(place=PLACE, k=FISHEYE, limit=SCALAR, returns=(PIXEL, SCALAR))
def distort_fisheye(place, k, limit):
    """Compute where a fisheye lens shows a direction in the camera frame, of any length.

    Parameters
    ----------
    place
        The direction; its angle from the axis may exceed a right angle.
    k
        The coefficients ``k1 k2 k3 k4``.
    limit
        The largest angle for which the model is valid, at most pi.

    Returns
    -------
    image
        Coordinates after distortion.
    is_valid
        1 if the angle is within the limit, otherwise 0.
    """
    x, y, z = place
    angle = ga.atan2(ga.sqrt(x * x + y * y), z)
    return lens_models.fisheye_of_direction(x, y, z, tuple(k)), select(angle <= limit, 1, 0)


def _inverse(radius, k, target, most):
    """Return the number up to `most` at which an increasing function, 0 at 0, has a value.

    Newton's steps that leave the bracket of the solution are replaced by its middle, or by twice the number if the
    bracket has no end.
    """

    def step(state):
        low, high, at = state
        value, ((slope,),) = radius.function(at, k)
        is_above = value >= target
        low, high = select(is_above, low, at), select(is_above, at, high)
        new = at + (target - value) / slope
        middle = select(high < FAR, (low + high) / 2, 2 * at)
        return low, high, select(new > low, select(new < high, new, middle), middle)

    start = ga.minimum(target, most / 2)
    found, _, _ = iterate(step, (0, most, start), lambda old, new: ga.absolute(new[2] - old[2]) <= NEAR * new[2], STEPS)
    return found[2]


@kernel(target=PIXEL, k=BROWN, limit=SCALAR, returns=(PIXEL, SCALAR), loops=True)
def undistort_brown(target, k, limit):
    """Compute the normalised coordinates that a lens of Brown's rational model shows at a place.

    Newton's method for the distance from the centre, within the range in which that is monotonic, is followed by
    Newton's method for both coordinates.

    Parameters
    ----------
    target
        Coordinates after distortion.
    k
        As in `distort_brown`.
    limit
        The largest distance from the axis, ``hypot(x, y)``, for which the model is valid; infinite if there is none.

    Returns
    -------
    place
        The normalised coordinates, or 0.
    is_found
        1 if they are within the limit and distortion takes them to the target up to 1e-12, otherwise 0.
    """
    u, v = target
    size = ga.sqrt(u * u + v * v)
    divisor = select(size > 0, size, 1)
    share = _inverse(_BROWN_RADIUS, k, size, limit) / divisor

    def step(state):
        x, y, _, _ = state
        (a, b), ((xx, yx), (xy, yy)) = _columns(_BROWN_BY_PLACE, 2, (x, y), k)
        off, above, area = u - a, v - b, xx * yy - xy * yx
        safe = select(area > 0, area, 1)
        new = x + (yy * off - xy * above) / safe, y + (xx * above - yx * off) / safe
        return *new, ga.absolute(off) + ga.absolute(above), area

    found, _, _ = iterate(
        step, (share * u, share * v, FAR, 0), lambda _, new: new[2] <= NEAR * size, STEPS_OF_BOTH
    )  # fmt: skip
    x, y, off, area = found
    is_exact = select(off <= EXACT * size, 1, 0) * select(area > 0, 1, 0)
    is_found = is_exact * select(ga.sqrt(x * x + y * y) <= limit, 1, 0)
    # Iterations that find nothing may end anywhere.
    return (select(is_found > 0, x, 0), select(is_found > 0, y, 0)), is_found


@kernel(target=PIXEL, k=FISHEYE, limit=SCALAR, returns=(PLACE, SCALAR), loops=True)
def undistort_fisheye(target, k, limit):
    """Compute the direction that a fisheye lens shows at a place, by Newton's method for its angle from the axis.

    Parameters
    ----------
    target
        Coordinates after distortion.
    k
        As in `distort_fisheye`.
    limit
        The largest angle for which the model is valid, at most pi.

    Returns
    -------
    direction
        Of norm 1, in the camera frame.
    is_found
        1 if the angle is within the limit and distortion takes the direction to the target up to 1e-12, otherwise 0.
    """
    u, v = target
    size = ga.sqrt(u * u + v * v)
    angle = _inverse(_FISHEYE_RADIUS, k, size, limit)
    off = ga.absolute(lens_models.fisheye_angle(angle, tuple(k)) - size)
    share = ga.sin(angle) / select(size > 0, size, 1)
    return (share * u, share * v, ga.cos(angle)), select(off <= EXACT * size, 1, 0)


# Images of points, and their derivatives.


def _in_camera(pose, place):
    return tuple(row[0] * place[0] + row[1] * place[1] + row[2] * place[2] + row[3] for row in pose)


@kernel(
    pose=POSE, intrinsics=INTRINSICS, k=BROWN, limit=SCALAR, place=PLACE,
    returns=(PIXEL, SCALAR),
)  # fmt: skip
def project_brown(pose, intrinsics, k, limit, place):
    """Compute the pixel of a point in a camera whose lens has the distortion of Brown's rational model.

    Parameters
    ----------
    pose
        The matrix [R | t] from the frame of the point to that of the camera.
    intrinsics
        ``fx fy cx cy skew``.
    k, limit
        As in `distort_brown`.
    place
        The point.

    Returns
    -------
    pixel
    is_valid
        1 if the point is in front of the camera and within the limit, otherwise 0.
    """
    x, y, z = _in_camera(pose, place)
    u, v = x / z, y / z
    is_within = select(ga.sqrt(u * u + v * v) <= limit, 1, 0)
    return _in_pixels(lens_models.brown(u, v, tuple(k)), intrinsics), is_within * select(z > 0, 1, 0)


@kernel(
    pose=POSE, intrinsics=INTRINSICS, k=FISHEYE, limit=SCALAR, place=PLACE,
    returns=(PIXEL, SCALAR),
)  # fmt: skip
def project_fisheye(pose, intrinsics, k, limit, place):
    """Compute the pixel of a point in a camera with a fisheye lens.

    Parameters
    ----------
    pose, intrinsics, place
        As in `project_brown`.
    k, limit
        As in `distort_fisheye`.

    Returns
    -------
    pixel
    is_valid
        1 if the angle from the axis is within the limit, otherwise 0.
    """
    x, y, z = _in_camera(pose, place)
    image = lens_models.fisheye_of_direction(x, y, z, tuple(k))
    angle = ga.atan2(ga.sqrt(x * x + y * y), z)
    return _in_pixels(image, intrinsics), select(angle <= limit, 1, 0)


def _brown_rates(place, k):
    """Return the image of a place, its derivatives by the place, and those by the coefficients."""
    x, y, z = place
    u, v = x / z, y / z
    image, (by_u, by_v) = _columns(_BROWN_BY_PLACE, 2, (u, v), k)
    first, second = ([a / z for a in column] for column in (by_u, by_v))
    by_z = tuple(-u * a - v * b for a, b in zip(first, second, strict=True))
    return image, (first, second, by_z), _columns(_BROWN_BY_K, lens_models.N_BROWN, (u, v), k)[1]


def _fisheye_rates(place, k):
    """Return what `_brown_rates` does, for a fisheye lens."""
    image, by_place = _columns(_FISHEYE_BY_PLACE, 3, place, k)
    return image, by_place, _columns(_FISHEYE_BY_K, lens_models.N_FISHEYE, place, k)[1]


def _derivatives(rates, pose, intrinsics, k, place):
    """Return a pixel and two rows of its derivatives by intrinsic parameters, coefficients and pose."""
    fx, fy, _, _, skew = intrinsics
    there = _in_camera(pose, place)
    image, by_place, by_k = rates(there, k)
    point = place_of(there)

    def scaled(a, b):
        return fx * a + skew * b, fy * b

    columns = [scaled(*column) for column in by_place]
    by_pose = []
    for b in GENERATORS:
        motion = _place(b * point - point * b)
        by_pose.append(tuple(sum(d * column[i] for d, column in zip(motion, columns, strict=True)) for i in range(2)))
    x, y = image
    linear = ((x, 0), (0, y), (1, 0), (0, 1), (y, 0))
    rows = tuple(zip(*linear, *(scaled(*column) for column in by_k), *by_pose, strict=True))
    return _in_pixels(image, intrinsics), rows


@kernel(pose=POSE, intrinsics=INTRINSICS, k=BROWN, place=PLACE, returns=(PIXEL, array(SCALAR, 2, 19)))
def project_brown_derivatives(pose, intrinsics, k, place):
    """Compute the pixel of `project_brown` and its derivatives.

    Returns
    -------
    pixel
    rows
        The derivatives of both coordinates by the intrinsic parameters, by the coefficients, and by the bivector B in
        ``exp(B) m``, for the motor m of the pose, in the order of `PGA3.LINE`.
    """
    return _derivatives(_brown_rates, pose, intrinsics, k, place)


@kernel(pose=POSE, intrinsics=INTRINSICS, k=FISHEYE, place=PLACE, returns=(PIXEL, array(SCALAR, 2, 15)))
def project_fisheye_derivatives(pose, intrinsics, k, place):
    """Compute the pixel of `project_fisheye` and its derivatives, as `project_brown_derivatives` does."""
    return _derivatives(_fisheye_rates, pose, intrinsics, k, place)


# Least squares of the images of planes.


def _equations(rates, pose, intrinsics, k, place, pixel):
    """Return the two equations of a point of a plane: derivatives, and the distance of its image from the pixel."""
    found, rows = _derivatives(rates, pose, intrinsics, k, (*place, 0))
    return tuple((*row, at - target) for row, at, target in zip(rows, found, pixel, strict=True))


def _sums(rates, pose, intrinsics, k, places, pixels, weights):
    def products(place, pixel, weight):
        rows = _equations(rates, pose, intrinsics, k, place, pixel)
        size = len(rows[0])
        return tuple(weight * sum(row[i] * row[j] for row in rows) for i in range(size) for j in range(i + 1))

    return total(products, places, pixels, weights)


PLANE = {"pose": POSE, "intrinsics": INTRINSICS}
POINTS = {"places": PLACES, "pixels": PIXELS, "weights": WEIGHTS}


@kernel(**PLANE, k=BROWN, **POINTS, returns=array(SCALAR, 210))
def brown_sums(pose, intrinsics, k, places, pixels, weights):
    """Compute sums of products of the equations of points of a plane, by the derivatives of `project_brown`.

    Parameters
    ----------
    pose
        The matrix [R | t] from the frame of the plane, whose points have the coordinates ``(x, y, 0)``, to that of the
        camera.
    intrinsics, k
        As in `project_brown`.
    places
        Points of the plane.
    pixels
        Their pixels.
    weights
        Weights of the squares; 0 leaves out a point.

    Returns
    -------
    triangle
        The lower triangle, row by row, of the sum of products of 20 columns: derivatives as in
        `project_brown_derivatives`, and the distance of the image from the pixel.
    """
    return _sums(_brown_rates, pose, intrinsics, k, places, pixels, weights)


@kernel(**PLANE, k=FISHEYE, **POINTS, returns=array(SCALAR, 136))
def fisheye_sums(pose, intrinsics, k, places, pixels, weights):
    """Compute sums of products of the equations of points of a plane, of 16 columns; see `brown_sums`."""
    return _sums(_fisheye_rates, pose, intrinsics, k, places, pixels, weights)
