"""Fundamental matrices, homographies and cameras by linear equations between normalised coordinates, and poses of them.

Points are normalised to mean 0 and mean square d, their number of coordinates (Hartley, *In Defense of the Eight-Point
Algorithm*, 1997).
"""

from gacompiler import SCALAR, array, each, kernel, matrices, select, sqrt, total
from gacompiler.specs.families.linear_equations import BELOW_ROUNDING, normalized, solution, undone
from gacompiler.specs.projective2 import homography_equations
from gacompiler.specs.projective3 import epipolar_equation

PIXELS, PLACES = array(SCALAR, "n", 2), array(SCALAR, "n", 3)
THREE, FOUR, CAMERA = array(SCALAR, 3, 3), array(SCALAR, 4, 4), array(SCALAR, 3, 4)


def _dot(a, b):
    return sum(x * y for x, y in zip(a[1:], b[1:], strict=True)) + a[0] * b[0]


def _cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _times(a, b):
    columns = tuple(zip(*b, strict=True))
    return tuple(tuple(_dot(row, column) for column in columns) for row in a)


def _unit(matrix):
    size = sqrt(sum(x * x for row in matrix for x in row))
    return tuple(tuple(x / size for x in row) for row in matrix)


@kernel(first=PIXELS, second=PIXELS, returns=THREE)
def fundamental_of_pixels(first, second):
    """Compute the fundamental matrix of rank 2 and norm 1 that pairs of pixels fit best (eight-point algorithm).

    The unit vector of its entries has the least squares of ``x' F x`` for normalised pixels. The nearest matrix of rank
    2 is taken before the normalisation is undone. The result for fewer than eight pairs is 0.
    """
    (one, left), (two, right) = normalized(first, 2), normalized(second, 2)
    entries, _, _ = solution(lambda x, y: [epipolar_equation(x, y)], one, two)
    matrix = _rows(entries, 3)
    _, vectors = matrices.three_singular_vectors(matrix)
    null = tuple(row[2] for row in vectors)
    rank_two = tuple(tuple(x - _dot(row, null) * v for x, v in zip(row, null, strict=True)) for row in matrix)
    return _if_enough(8, first, _unit(_times(tuple(zip(*right, strict=True)), _times(rank_two, left))))


def _if_enough(least, rows, matrix, otherwise=((0,) * 4,) * 3):
    """Return a matrix if there are enough rows to determine it, or else another one."""
    is_enough = total(lambda _: 1, rows) >= least
    pairs = [zip(row, other[: len(row)], strict=True) for row, other in zip(matrix, otherwise, strict=True)]
    return tuple(tuple(select(is_enough, x, y) for x, y in row) for row in pairs)


def _rows(entries, width):
    return tuple(tuple(entries[i : i + width]) for i in range(0, len(entries), width))


@kernel(first=PIXELS, second=PIXELS, returns=(array(SCALAR, "n", 2, 9), THREE, THREE))
def plane_equations(first, second):
    """Compute two equations of ``x' x H x = 0`` for each pair of normalised pixels, and the similarities of pixels.

    Returns
    -------
    equations
        For each pair, the coefficients of the entries of H, row by row, in two equations.
    left, right
        The similarities that normalise the first and the second pixels.
    """
    (one, left), (two, right) = normalized(first, 2), normalized(second, 2)
    return each(homography_equations, one, two), left, right


@kernel(entries=array(SCALAR, 9), left=THREE, right=THREE, returns=THREE)
def homography_of_entries(entries, left, right):
    """Compute the homography of norm 1 from the solution of `plane_equations`."""
    matrix = tuple(tuple(entries[3 * i : 3 * i + 3]) for i in range(3))
    return _unit(_times(undone(right), _times(matrix, left)))


@kernel(places=PLACES, pixels=PIXELS, returns=(array(SCALAR, "n", 2, 12), FOUR, THREE))
def camera_equations(places, pixels):
    """Compute two equations of ``x P X = 0`` for each pair of a normalised point and pixel, and the similarities.

    Returns
    -------
    equations
        For each pair, the coefficients of the entries of P, row by row, in two equations.
    left, right
        The similarities that normalise points and pixels.
    """
    (one, left), (two, right) = normalized(places, 3), normalized(pixels, 2)
    return each(_camera_equations, one, two), left, right


def _camera_equations(place, pixel):
    x, nothing = (*place, 1), (0, 0, 0, 0)
    return (*x, *nothing, *(-pixel[0] * a for a in x)), (*nothing, *x, *(-pixel[1] * a for a in x))


@kernel(entries=array(SCALAR, 12), left=FOUR, right=THREE, returns=CAMERA)
def camera_of_entries(entries, left, right):
    """Compute the camera matrix of norm 1 from the solution of `camera_equations`."""
    matrix = tuple(tuple(entries[4 * i : 4 * i + 4]) for i in range(3))
    return _unit(_times(undone(right), _times(matrix, left)))


def _nearest_rotation(matrix):
    """Return the rotation nearest to a matrix, and the mean of the singular values."""
    values, vectors = matrices.three_singular_vectors(matrix)
    first, second, _ = zip(*vectors, strict=True)
    u = tuple(_dot(row, first) for row in matrix)
    u = _scaled(u)
    v = tuple(_dot(row, second) for row in matrix)
    along = _dot(u, v)
    v = _scaled(tuple(a - along * b for a, b in zip(v, u, strict=True)))
    images, axes = (u, v, _cross(u, v)), (first, second, _cross(first, second))
    rotation = _times(tuple(zip(*images, strict=True)), axes)
    return rotation, (values[0] + values[1] + values[2]) / 3


def _scaled(vector):
    """Return a vector of length 1, or 0 for the zero vector."""
    size = sqrt(_dot(vector, vector))
    return tuple(x / select(size > 0, size, 1) for x in vector)


def _or_one(x):
    return select(x > 0, x, 1)


def _pose_of_camera(camera):
    """Return the pose [R | t] nearest to a camera matrix of points around the origin, which is in front of it.

    The sign is determined by the depth of the origin: the determinant is unreliable for thin scenes.
    """
    sign = select(camera[2][3] < 0, -1, 1)
    rotation, size = _nearest_rotation(tuple(tuple(sign * x for x in row[:3]) for row in camera))
    return tuple((*row, sign * own[3] / _or_one(size)) for row, own in zip(rotation, camera, strict=True))


@kernel(homography=THREE, axes=THREE, returns=CAMERA)
def pose_of_plane(homography, axes):
    """Compute the pose [R | t] from the homography of a plane through the origin, which is in front of it.

    Parameters
    ----------
    homography
        It maps coordinates in the plane to the image.
    axes
        The first two rows are the axes of the coordinates.
    """
    return _pose_of_plane(homography, axes)


def _pose_of_plane(homography, axes):
    columns = tuple(zip(*homography, strict=True))
    size = sqrt(sqrt(_dot(columns[0], columns[0]) * _dot(columns[1], columns[1])))
    factor = select(homography[2][2] < 0, -1, 1) / _or_one(size)
    x, y, shift = (tuple(factor * a for a in column) for column in columns)
    rotation, _ = _nearest_rotation(tuple(zip(x, y, _cross(x, y), strict=True)))
    return tuple((*row, s) for row, s in zip(_times(rotation, _frame(axes)), shift, strict=True))


def axes_of(places):
    """Return axes, as rows, in the order of the extents of points about the origin along them."""
    moments = total(lambda p: tuple(tuple(a * b for b in p) for a in p), places)
    size = sum(moments[k][k] for k in range(3)) * BELOW_ROUNDING
    # Of one point the order of the other axes would be that of roundings.
    rows = [[x + (3 - i) * size if i == j else x for j, x in enumerate(row)] for i, row in enumerate(moments)]
    return tuple(zip(*matrices.three_singular_vectors(rows)[1], strict=True))


@kernel(pose=CAMERA, places=PLACES, returns=CAMERA)
def reversed_pose(pose, places):
    """Mirror the plane of the largest extents of points in that perpendicular to the line of sight (Necker reversal).

    The pose [R | t] of both planes has the same image under parallel projection: if a pose is a minimum of the
    distances in the image of points in the plane, another minimum is near the reversed one. Points are relative to
    their centroid; fewer than three leave the pose as it is.
    """
    return _if_enough(3, places, reversed_about(pose, axes_of(places)), pose)


def reversed_about(pose, axes):
    """Return `reversed_pose` for axes, as rows, of which the first two span the plane."""
    frame, shift = _frame(axes), tuple(row[3] for row in pose)
    normal = _scaled(shift)
    columns = [tuple(_dot(row[:3], axis) for row in pose) for axis in frame]
    mirrored = [
        tuple(a - 2 * _dot(normal, column) * n for a, n in zip(column, normal, strict=True)) for column in columns
    ]
    mirrored[2] = tuple(-a for a in mirrored[2])
    rotation = _times(tuple(zip(*mirrored, strict=True)), frame)
    return tuple((*row, s) for row, s in zip(rotation, shift, strict=True))


def _frame(axes):
    """Return a right-handed frame of which the first two axes are given."""
    return axes[0], axes[1], _cross(axes[0], axes[1])


@kernel(places=PLACES, pixels=PIXELS, k=THREE, returns=array(SCALAR, 3, 3, 4))
def starts_of_pose(places, pixels, k):
    """Compute three candidates for the pose [R | t] of a camera, from linear equations.

    The first is that of the homography of the plane of the largest extents, the second its `reversed_pose`, and the
    third that of a camera matrix, for points in space. Those for which there are too few points, four or six, are 0.

    Parameters
    ----------
    places
        Points relative to their centroid.
    pixels
    k
        The upper triangular matrix of the camera, with 1 in its last row.
    """
    axes = axes_of(places)
    inverse = _inverse_of_intrinsics(k)
    seen = each(lambda p: tuple(_dot(row, (*p, 1)) for row in inverse), pixels)
    flat = each(lambda p: tuple(_dot(axis, p) for axis in axes[:2]), places)
    (one, left), (two, right) = normalized(flat, 2), normalized(seen, 2)
    entries, _, _ = solution(homography_equations, one, two)
    plane = _pose_of_plane(_unit(_times(undone(right), _times(_rows(entries, 3), left))), axes)
    one, left = normalized(places, 3)
    entries, _, _ = solution(_camera_equations, one, two)
    space = _pose_of_camera(_unit(_times(undone(right), _times(_rows(entries, 4), left))))
    flat_ones = [_if_enough(4, places, pose) for pose in (plane, reversed_about(plane, axes))]
    return (*flat_ones, _if_enough(6, places, space))


def _inverse_of_intrinsics(k):
    """Return the first two rows of the inverse of an upper triangular matrix with 1 in its last row."""
    (a, skew, x), (_, b, y), _ = k
    return (1 / a, -skew / (a * b), (skew * y / b - x) / a), (0, 1 / b, -y / b)
