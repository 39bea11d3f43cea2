"""Poses of a camera from three points, poses near others with the least truncated squares, and motions about a plane.

A pose [R | t] takes the frame of the points to that of the camera. Pixels are those of the matrix K. What residuals of
a pose say is in one file with the search for the pose, since both have the same image of a point.
"""

from fractions import Fraction
from itertools import combinations_with_replacement

import gacompiler as ga
from gacompiler import (
    SCALAR,
    array,
    each,
    equal,
    fold,
    iterate,
    kernel,
    matrices,
    maximum,
    minimum,
    row_numbers,
    select,
    sqrt,
    total,
)
from gacompiler.algebra.catalog import PGA3
from gacompiler.specs.families.covariances import choose, cross, dot, square, triangle
from gacompiler.specs.families.descents import TINY, UNKNOWN, descend, truncated_equations
from gacompiler.specs.families.essential import nonzero, times
from gacompiler.specs.families.linear_equations import dominant, inverse_of, quotient
from gacompiler.specs.families.misfits import explained_of
from gacompiler.specs.families.poses import matrix_of_pose, moved_pose
from gacompiler.specs.families.rotations import quaternion_of_matrix
from gacompiler.specs.families.sights import rotor_of, translator_of
from gacompiler.specs.families.triangles import pose_between
from gacompiler.specs.families.two_views import applied, product, rotation_matrix, transposed, unit
from gacompiler.specs.linear_views import axes_of, reversed_about

THREE, POSE, NUMBERS = array(SCALAR, 3, 3), array(SCALAR, 3, 4), array(SCALAR, "n")
PIXELS, PLACES = array(SCALAR, "n", 2, shared=True), array(SCALAR, "n", 3, shared=True)
OWN_PIXELS, OWN_PLACES = array(SCALAR, "n", 2), array(SCALAR, "n", 3)
OPEN = Fraction(1, 10**14)
"""An eigenvalue below this part of the largest is rounding."""
HELD = Fraction(1, 10**9)
"""Added to a diagonal of ones, it holds what equations leave open."""
ROOT_OF_TWO, ROOT_OF_THREE = Fraction(1414213562373095, 10**15), Fraction(1732050807568877, 10**15)
"""Coordinates of a direction in which different points have different places."""
ALL = 10**20
"""A squared distance of pixels beyond which no limit is meant."""


@kernel(places=array(SCALAR, 3, 3), seen=array(SCALAR, 3, 2), returns=(array(SCALAR, 4, 3, 4), array(SCALAR, 4)))
def poses_of_three(places, seen):
    """Compute the poses [R | t] of a camera that sees three points in directions (x, y, 1).

    Distances between the points give two conics in the ratios of the depths, and those give a quartic (Grunert 1841).
    For complex roots, which noise makes of double roots, the real part is used.

    Returns
    -------
    poses
    is_there
        1 if the depths of a pose are positive, else 0.
    """
    rays = [unit((*p, 1)) for p in seen]
    alpha, beta, gamma = (dot(rays[i], rays[j]) for i, j in ((1, 2), (0, 2), (0, 1)))
    edges = [[p - q for p, q in zip(places[i], places[j], strict=True)] for i, j in ((1, 2), (0, 2), (0, 1))]
    a, b, c = (dot(edge, edge) for edge in edges)
    ratio, other = (a - c) / b, c / b
    # Depths are s, u s and v s; u = numerator / denominator, and u^2 - 2 gamma u + rest = 0, polynomials in v.
    numerator = [1 + ratio, -2 * ratio * beta, ratio - 1]
    denominator = [2 * gamma, -2 * alpha]
    rest = [1 - other, 2 * other * beta, -other]
    quartic = [0, 0, 0, 0, 0]
    for left, right, factor in (
        (numerator, numerator, 1),
        (rest, times(denominator, denominator), 1),
        (numerator, denominator, -2 * gamma),
    ):
        for k, x in enumerate(times(left, right)):
            quartic[k] = quartic[k] + factor * x
    roots, _, _ = ga.quartic_roots(*quartic[::-1])
    poses, there = [], []
    for v in roots:
        u = _at(numerator, v) / nonzero(_at(denominator, v))
        opposite = 1 + v * v - 2 * v * beta
        first = sqrt(b / maximum(opposite, TINY))
        depths = first, u * first, v * first
        points = [tuple(d * x for x in ray) for d, ray in zip(depths, rays, strict=True)]
        poses.append(pose_between(places, points))
        there.append(select(u > 0, select(v > 0, 1, 0), 0))
    return tuple(poses), tuple(there)


def _at(polynomial, x):
    value = polynomial[-1]
    for coefficient in polynomial[-2::-1]:
        value = value * x + coefficient
    return value


def _seen(rotation, shift, k, place, pixel):
    """Return the offset of the image of a point from a pixel, and the point in the frame of the camera."""
    x, y, z = (a + s for a, s in zip(applied(rotation, place), shift, strict=True))
    depth = nonzero(z)
    u, v = x / depth, y / depth
    image = [dot(row, (u, v, 1)) for row in k[:2]]
    return [a - b for a, b in zip(image, pixel, strict=True)], (u, v, z)


def _parts(pose):
    return [row[:3] for row in pose], [row[3] for row in pose]


def _pixel_square(rotation, shift, k, place, pixel):
    off, (_, _, z) = _seen(rotation, shift, k, place, pixel)
    return select(z > 0, dot(off, off), UNKNOWN)


@kernel(pose=POSE, k=THREE, places=OWN_PLACES, pixels=OWN_PIXELS, returns=NUMBERS)
def pixel_squares(pose, k, places, pixels):
    """Compute squared distances of pixels from the images of points in a pose; 1e30 behind the camera."""
    rotation, shift = _parts(pose)
    return each(lambda x, y: _pixel_square(rotation, shift, k, x, y), places, pixels)


@kernel(pose=POSE, k=THREE, places=PLACES, pixels=PIXELS, limit=SCALAR, returns=SCALAR)
def truncated_pixel_squares(pose, k, places, pixels, limit):
    """Sum `pixel_squares`, each at most `limit`."""
    rotation, shift = _parts(pose)
    return total(lambda x, y: minimum(_pixel_square(rotation, shift, k, x, y), limit), places, pixels)


def _descended(pose, k, places, pixels, limit, at_most):
    """Return what `descend_pose` does, with the upper triangle of the matrix."""
    start, offset = _parts(pose)
    beyond = select(limit < ALL, 2 * limit, 0)

    def equations(state):
        rotation, shift = rotation_matrix(state[:4]), state[4:]
        size = sqrt(dot(shift, shift))

        def of(place, pixel):
            off, (u, v, z) = _seen(rotation, shift, k, place, pixel)
            distance = dot(off, off) + select(z > 0, 0, beyond)
            nearness = size / nonzero(z)
            turned = ((-u * v, 1 + u * u, -v), (-1 - v * v, u * v, u))
            shifted = ((nearness, 0, -u * nearness), (0, nearness, -v * nearness))
            change = [(*a, *b) for a, b in zip(turned, shifted, strict=True)]
            columns = [tuple(dot(row[:2], column) for row in k[:2]) for column in zip(*change, strict=True)]
            return truncated_equations(columns, off, distance, limit)

        return total(of, places, pixels)

    found = descend((*quaternion_of_matrix(start), *offset), 6, equations, moved_pose, at_most)
    pose = matrix_of_pose(found.state)
    ahead = fold(lambda found, x: select(dot(pose[2][:3], x) + pose[2][3] > 0, found, 0), 1, places)
    return pose, found.table, (found.cost, found.ended, found.steps, found.cost - found.gain, ahead)


@kernel(
    pose=POSE, k=THREE, places=OWN_PLACES, pixels=OWN_PIXELS, limit=SCALAR, at_most=SCALAR,
    returns=(POSE, array(SCALAR, 6, 6), array(SCALAR, 5)),
)  # fmt: skip
def descend_pose(pose, k, places, pixels, limit, at_most):
    """Find the pose near another with the least `pixel_squares`, each at most `limit`.

    Steps of Levenberg and Marquardt are by a rotation vector that follows the pose, and by a translation in units of
    the distance of the origin from the camera. Points behind the camera count as `limit`, unless it is 1e20 or more:
    all points are used then, and those behind the camera have the images that the formulas give.

    Returns
    -------
    pose
    normal
        The matrix of the normal equations, by a step.
    numbers
        The sum of truncated squares, 1 if a minimum was reached, else 0, the number of steps, the sum that linear
        equations at the pose would leave, and 1 if all points are in front of the camera, else 0.
    """
    pose, table, numbers = _descended(pose, k, places, pixels, limit, at_most)
    return pose, _whole(table), numbers


def _whole(table):
    return tuple(tuple(row) for row in square(table, 6))


@kernel(
    starts=array(SCALAR, "s", 3, 4), k=THREE, places=OWN_PLACES, pixels=OWN_PIXELS, bounds=array(SCALAR, 2, 2),
    soon=SCALAR, at_most=SCALAR,
    returns=(array(SCALAR, "s", 3, 4), array(SCALAR, "s", 6, 6), array(SCALAR, "s", 4)),
)  # fmt: skip
def follow_poses(starts, k, places, pixels, bounds, soon, at_most):
    """Find the poses of least `pixel_squares` near others, unless these cannot lead to one that is near the best.

    Poses with all points in front of the camera come first, and among these and the others that of the least sum.

    Parameters
    ----------
    starts
        The last one is not used: its place is for the `reversed_pose` of the best minimum, which is followed too.
    k, places, pixels
        Points are relative to their centroid.
    bounds
        Descents end where linear equations leave more than ``a + b x`` for both rows (a, b), and the least sum x of
        poses with all points in front of the camera.
    soon
        The number of steps between tests.
    at_most
        The maximum number of steps from each start.

    Returns
    -------
    poses
    normals
        Of each, the matrix of the normal equations.
    numbers
        Of each, the sum of squares, 1 if a minimum was reached, else 0, the sum that linear equations would leave, and
        1 if all points are in front of the camera, else 0.
    """
    follow = _Following(starts, k, places, pixels, bounds, soon, at_most)
    numbers, last = follow.numbers, follow.last
    found = follow.to_minima(each(lambda pose, number: follow.reached(pose, number < last), starts, numbers), 0)

    def better(best, row, number):
        # Without a pose in front of the camera, the one with the least sum is reversed.
        is_used = number < last
        ahead = _less(select(best[36] > 0, best[33], UNKNOWN), row, is_used)
        behind = select(best[36] > 0, 0, select(row[36] > 0, 0, select(row[33] < best[33], is_used, 0)))
        return choose(maximum(ahead, behind) > 0, row, best)

    best = fold(better, (*(0 for _ in range(33)), UNKNOWN, 0, 0, 0), found, numbers)
    mirrored = reversed_about(_pose_of(best), axes_of(places))

    def filled(row, number):
        is_last = equal(number, last)
        return choose(is_last, follow.reached(mirrored, is_last), row)

    found = follow.to_minima(each(filled, found, numbers), 1)
    found = _ordered(found, numbers)
    return each(_pose_of, found), each(lambda row: _whole(row[12:33]), found), each(lambda row: row[33:37], found)


class _Following:
    """Descents of `follow_poses` from several starts.

    A row has the pose, the triangle of its normal equations, the sum of squares, 1 if it is a minimum, the sum that
    linear equations leave, and 1 if all points are in front of the camera.
    """

    def __init__(self, starts, k, places, pixels, bounds, soon, at_most):
        self.k, self.places, self.pixels, self.bounds = k, places, pixels, bounds
        self.soon, self.at_most = soon, at_most
        self.numbers = row_numbers(starts)
        self.last = fold(maximum, 0, self.numbers)

    def reached(self, pose, steps):
        """Return the row of a pose after some steps."""
        after, table, (cost, ended, _, lowest, ahead) = _descended(pose, self.k, self.places, self.pixels, ALL, steps)
        return (*(x for row in after for x in row), *table, cost, ended, lowest, ahead)

    def to_minima(self, rows, of_last):
        """Return rows after descents that end where they cannot lead to the best: of the last row, or of the others."""

        def stepped(state):
            before, done, _ = state
            limit, steps = self._limit(before, of_last), minimum(self.soon, self.at_most - done)

            def further(row, number):
                active = self._goes_on(row, number, limit, of_last)
                return choose(active > 0, self.reached(_pose_of(row), select(active > 0, steps + 1, 0)), row)

            after = each(further, before, self.numbers)
            next_limit = self._limit(after, of_last)

            def any_goes_on(found, row, number):
                return maximum(found, self._goes_on(row, number, next_limit, of_last))

            return after, done + steps, fold(any_goes_on, 0, after, self.numbers)

        return iterate(stepped, (rows, 0, 1), lambda _, new: new[2] <= 0, self.at_most)[0][0]

    def _limit(self, rows, of_last):
        """Return the sum beyond which linear equations rule out a row."""

        def lesser(best, row, number):
            return select(_less(best, row, maximum(of_last, number < self.last)) > 0, row[33], best)

        best = fold(lesser, UNKNOWN, rows, self.numbers)
        return maximum(*(a + b * best for a, b in self.bounds))

    def _goes_on(self, row, number, limit, of_last):
        """Return 1 if a descent goes on, else 0."""
        is_open = select(row[34] > 0, 0, select(row[33] < ALL, select(row[35] > limit, 0, 1), 0))
        return select(equal(of_last, equal(number, self.last)), is_open, 0)


def _less(best, row, is_used):
    """Return 1 if a row that is used has all points in front of the camera and a lower sum, else 0."""
    return select(is_used > 0, select(row[36] > 0, select(row[33] < best, 1, 0), 0), 0)


def _pose_of(row):
    return row[:4], row[4:8], row[8:12]


def _ordered(rows, numbers):
    """Return rows of poses, first those with all points in front of the camera, the least first."""

    def precedes(one, i, two, j):
        a, b = (select(row[33] < ALL, row[33], UNKNOWN) for row in (one, two))
        less = select(a < b, 1, equal(a, b) * (i < j))
        return select(one[36] > two[36], 1, equal(one[36], two[36]) * less)

    def rank_of(row, number):
        return fold(lambda count, other, k: count + precedes(other, k, row, number), 0, rows, numbers)

    ranks = each(rank_of, rows, numbers)

    def of_rank(number):
        nothing = tuple(0 for _ in range(37))
        return fold(lambda found, row, rank: choose(equal(rank, number), row, found), nothing, rows, ranks)

    return each(of_rank, numbers)


def _with_camera(rotation, shift, k, place, pixel):
    """Return derivatives of a pixel by the pose and by a camera, and the distance from the image, as 15 columns."""
    off, (u, v, z) = _seen(rotation, shift, k, place, pixel)
    s, nearness = u * u + v * v, sqrt(dot(shift, shift)) / nonzero(z)
    changes = (
        (-u * v, -1 - v * v), (1 + u * u, u * v), (-v, u), (nearness, 0), (0, nearness), (-u * nearness, -v * nearness),
        (u, v), (u, -v), (1, 0), (0, 1), (v, 0), (u * s, v * s),
        (s + 2 * u * u, 2 * u * v), (2 * u * v, s + 2 * v * v),
    )  # fmt: skip
    return [*(tuple(dot(row[:2], change) for row in k[:2]) for change in changes), tuple(-x for x in off)]


@kernel(
    pose=POSE, k=THREE, places=OWN_PLACES, pixels=OWN_PIXELS,
    returns=(array(SCALAR, 15, 15), array(SCALAR, 4)),
)  # fmt: skip
def pose_misfits(pose, k, places, pixels):
    """Compute what further parameters of a camera say of the distances of pixels in the pose of least squares.

    Returns
    -------
    sums
        The sums of products of 15 columns. Six are derivatives of pixels by a pose, as in `descend_pose`, and eight by
        the camera: the focal length, the ratio of its two numbers, the centre, the skew, a radial term of distortion
        and two tangential ones, all in focal lengths. The last has the distances of pixels from the images.
    explained
        The sum of squares of distances, the part of it across the derivatives by the pose, and what the eight and the
        best one of them explain of that part.
    """
    rotation, shift = _parts(pose)

    def sums_of(place, pixel):
        return tuple(
            dot(a, b) for a, b in combinations_with_replacement(_with_camera(rotation, shift, k, place, pixel), 2)
        )

    sums = square(total(sums_of, places, pixels), 15)
    return tuple(tuple(row) for row in sums), explained_of(sums, 6)


@kernel(pose=POSE, k=THREE, places=OWN_PLACES, pixels=OWN_PIXELS, returns=array(SCALAR, 5))
def neighbouring_offsets(pose, k, places, pixels):
    """Sum the squares of distances of pixels in a pose, and their products with those of the nearest other points.

    The other sums are 0 on average unless a direction prevails: those of ``x x - y y`` and ``2 x y``, and of squares
    away from the principal point minus those across.
    """
    rotation, shift = _parts(pose)
    numbers = row_numbers(places)

    def seen(place, pixel):
        off, (u, v, _) = _seen(rotation, shift, k, place, pixel)
        away = dot(k[0][:2], (u, v)), dot(k[1][:2], (u, v))
        return *off, *away

    offs = each(seen, places, pixels)

    def of(place, own, number):
        def nearer(best, other, off, j):
            apart = [a - b for a, b in zip(place, other, strict=True)]
            distance = select(equal(number, j), UNKNOWN, dot(apart, apart))
            return choose(distance < best[0], (distance, off[0], off[1]), best)

        _, *off = fold(nearer, (UNKNOWN, 0, 0), places, offs, numbers)
        x, y, a, b = own
        square, along, across = x * x + y * y, x * x - y * y, 2 * x * y
        radial = (along * (a * a - b * b) + across * 2 * a * b) / maximum(a * a + b * b, TINY)
        return square, x * off[0] + y * off[1], along, across, radial

    return total(of, places, offs, numbers)


@kernel(places=OWN_PLACES, normal=array(SCALAR, 6, 6), returns=array(SCALAR, 2))
def undetermined_pose(places, normal):
    """Determine whether there are fewer than four distinct points, and whether these or a motion leave a pose open.

    Points on a line do, and motions that change no pixels: both are found by eigenvalues below rounding.

    Parameters
    ----------
    places
    normal
        The matrix of the normal equations of a pose.
    """

    def counted(carry, p):
        *seen, count = carry
        along = p[0] + ROOT_OF_TWO * p[1] + ROOT_OF_THREE * p[2]
        is_new = 1
        for k, other in enumerate(seen):
            is_new = select(count > k, select(equal(along, other), 0, is_new), is_new)
        kept = [select(equal(count, k), select(is_new, along, other), other) for k, other in enumerate(seen)]
        return (*kept, count + is_new)

    *_, count = fold(counted, (0, 0, 0, 0), places)
    moments = total(lambda p: tuple(p[i] * p[j] for i in range(3) for j in range(i, 3)), places)
    _, middle, large = ga.eigenvalues_symmetric(square(moments, 3))
    table = triangle(normal)
    least = quotient(table, dominant(inverse_of(table, 6), 6))
    most = quotient(table, dominant(table, 6))
    is_open = select(middle <= OPEN * large, 1, select(least > OPEN * most, 0, 1))
    return count < 4, is_open


@kernel(pose=POSE, centroid=array(SCALAR, 3), returns=PGA3.MOTOR)
def motor_of_pose(pose, centroid):
    """Compute the unit motor from the camera to the world, for a pose of points about their centroid.

    The centre of the camera is computed relative to the centroid, which preserves accuracy far from the origin.
    """
    back, shift = _parts(pose)
    back = transposed(back)
    centre = [c - dot(row, shift) for c, row in zip(centroid, back, strict=True)]
    return translator_of(centre) * rotor_of(quaternion_of_matrix(back))


@kernel(normal=array(SCALAR, 6, 6), returns=array(SCALAR, 2))
def largest_variances(normal):
    """Compute the largest variances of directions of the rotation and of the translation, for residuals of variance 1.

    They are the inverses of the least eigenvalues of normal equations from which the other part is eliminated.
    """
    found = []
    for own, other in ((range(3), range(3, 6)), (range(3, 6), range(3))):
        part = [[normal[i][j] for j in other] for i in other]
        across = [[normal[i][j] for j in other] for i in own]
        solved = [ga.solve_symmetric(part, row)[0] for row in across]
        left = [[normal[i][j] - dot(across[a], solved[b]) for b, j in enumerate(own)] for a, i in enumerate(own)]
        found.append(
            1 / ga.eigenvalues_symmetric([[(left[a][b] + left[b][a]) / 2 for b in range(3)] for a in range(3)])[0]
        )
    return tuple(found)


@kernel(matrix=THREE, seen=array(SCALAR, 3), returns=(PGA3.MOTOR, PGA3.MOTOR, array(SCALAR, 2, 3)))
def motions_of_homography(matrix, seen):
    """Compute the two motions, and normals of the plane, of the homography of directions in two cameras.

    The homography is a multiple of ``R + t n'``: the motion ``R X + t`` takes the frame of the first camera to that of
    the second, n is the unit normal of the plane, at the distance 1 from the first camera, and both cameras are on the
    same side of it. The second solution is another plane and motion with the same images. Ma, Soatto, Kosecka and
    Sastry, *An Invitation to 3-D Vision*, 2004, section 5.3.

    Parameters
    ----------
    matrix
    seen
        A direction in which the first camera sees the plane; the normals are on the side of this direction.

    Returns
    -------
    first, second
        Unit motors. Both are the same rotation if the homography is one.
    normals
        Unit vectors.
    """
    values, right = matrices.three_singular_vectors(matrix)
    sign = select(dot(matrix[0], cross(matrix[1], matrix[2])) < 0, -1, 1)
    scale = sign / nonzero(values[1])
    scaled = [[scale * x for x in row] for row in matrix]
    large, small = values[0] / nonzero(values[1]), values[2] / nonzero(values[1])
    a, b = sqrt(maximum(1 - small * small, 0)), sqrt(maximum(large * large - 1, 0))
    a = select(a + b > 0, a, 1)
    size = sqrt(a * a + b * b)
    first, middle, last = transposed(right)
    image = applied(scaled, middle)
    motors, normals = [], []
    for side in (b, -b):
        along = [(a * x + side * y) / size for x, y in zip(first, last, strict=True)]
        normal = cross(middle, along)
        moved = applied(scaled, along)
        rotation = product(transposed((image, moved, cross(image, moved))), (middle, along, normal))
        normal = [select(dot(normal, seen) < 0, -x, x) for x in normal]
        shift = [dot(row, normal) - dot(other, normal) for row, other in zip(scaled, rotation, strict=True)]
        motors.append(translator_of(shift) * rotor_of(quaternion_of_matrix(rotation)))
        normals.append(tuple(normal))
    return (*motors, tuple(normals))
