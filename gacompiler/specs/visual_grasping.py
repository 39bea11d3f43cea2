"""Grasping guided by two images: errors that are brackets of the projective plane, and steps that reduce them.

An image has twelve points. The first four are marks of a hand with two parallel fingers: the tips of both fingers and
the bases of both, corners of a rectangle in space. The others are the corners of a box; corner ``4 i + 2 j + k`` is at
the end i of the first axis, j of the second and k of the third. The fingers are to close along the first axis about
the centre of the box, with their bases at the end 1 of the third axis.

Points are homogeneous vectors (x, y, 1) of G(3), in pixels from the mean of the corners, divided by a multiple of their
spread. Lines are joins and points are meets, and a bracket of three points, the outer product, is 0 if they are
collinear. Divided by the distance of two of the points it is the distance of the third from the line through them.
Meets of diagonals are images of centres, and meets of parallel edges are vanishing points, whatever the camera.
"""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, array, each, kernel, sqrt, total
from gacompiler.specs.projective2 import PROJECTIVE2

N_POINTS, N_ERRORS = 12, 7
FIELD = 10
"""The unit of length is this multiple of the spread of the corners, of the order of the focal length."""
TINY = Fraction(1, 10**30)


def _face(axis, end):
    """Return the corners of a face, in order."""
    others = [4, 2, 1]
    own = others.pop(axis)
    return [end * own + i * others[0] + j * others[1] for i, j in ((0, 0), (0, 1), (1, 1), (1, 0))]


def _edges(axis):
    """Return the corners of the four edges along an axis, from the end 0 to the end 1."""
    others = [4, 2, 1]
    own = others.pop(axis)
    return [(i * others[0] + j * others[1], own + i * others[0] + j * others[1]) for i in (0, 1) for j in (0, 1)]


def _bracket(a, b, c):
    return (a ^ b ^ c)["e123"]


def _join(a, b):
    return ga.undual(a ^ b)


def _pixel(p):
    """Return a point with the third coordinate 1."""
    return p / p["e3"]


def _length(v):
    return sqrt(v["e1"] * v["e1"] + v["e2"] * v["e2"] + TINY)


def _line(a, b):
    """Return the line through two points whose brackets with points are distances."""
    line = _join(a, b)
    return line / _length(line)


def _away(p, a, b):
    """Return the distance of a point from the line through two points."""
    return _bracket(p, a, b) / _length(_join(a, b))


def _concurrent(lines):
    """Return the point with the least sum of squared distances from lines."""
    rows = []
    for line in lines:
        x, y, w = line["e1"], line["e2"], line["e3"]
        rows.append((x * x, x * y, y * y, -x * w, -y * w))
    xx, xy, yy, x, y = (sum(column[1:], column[0]) for column in zip(*rows, strict=True))
    size = xx * yy - xy * xy
    return ga.assemble(PROJECTIVE2, {"e1": (yy * x - xy * y) / size, "e2": (xx * y - xy * x) / size, "e3": 1})


def _vanishing_point(box, axis):
    """Return the unit vector of the vanishing point of four edges: the eigenvector of the sum of squares of lines.

    Its sign is that of the direction of the edges.
    """
    lines = [_line(box[a], box[b]) for a, b in _edges(axis)]
    numbers = [[line[name] for name in ("e1", "e2", "e3")] for line in lines]
    matrix = [[sum(row[i] * row[j] for row in numbers) for j in range(3)] for i in range(3)]
    _, vectors = ga.eigenvectors_symmetric(matrix)
    x, y, w = (row[0] for row in vectors)
    along = sum((box[b] - box[a] for a, b in _edges(axis)[1:]), box[_edges(axis)[0][1]] - box[_edges(axis)[0][0]])
    sign = ga.select(along["e1"] * x + along["e2"] * y < 0, -1, 1)
    return ga.assemble(PROJECTIVE2, {"e1": sign * x, "e2": sign * y, "e3": sign * w})


def _convexity(a, b, c, d):
    """Return the least area of a triangle of neighbouring corners, with the sign of the area, per squared sides."""
    areas = _bracket(a, b, c), _bracket(b, c, d), _bracket(c, d, a), _bracket(d, a, b)
    sign = ga.select(areas[0] + areas[2] < 0, -1, 1)
    least = ga.minimum(ga.minimum(sign * areas[0], sign * areas[1]), ga.minimum(sign * areas[2], sign * areas[3]))
    sides = [q - p for p, q in ((a, b), (b, c), (c, d), (d, a))]
    return least / (sum(ga.norm_squared(side) for side in sides) + TINY)


def _harmonic(left, right, centre, far, along):
    """Return ``([left centre] [right far] + [left far] [right centre]) / 2`` along a line with a unit direction.

    It is 0 if the cross-ratio of the points is -1, so that the centre is the middle of both points in space, if `far`
    is the vanishing point of the line. If `far` is at infinity in the image, it is the distance of the middle.
    """

    def place(p):
        return along["e1"] * p["e1"] + along["e2"] * p["e2"], p["e3"]

    def bracket_of(p, q):
        (a, v), (b, w) = place(p), place(q)
        return a * w - b * v

    return (bracket_of(left, centre) * bracket_of(right, far) + bracket_of(left, far) * bracket_of(right, centre)) / 2


@kernel(points=array(SCALAR, N_POINTS, 2), returns=(array(SCALAR, N_ERRORS), SCALAR, array(SCALAR, 3), SCALAR))
def errors_of_image(points):
    """Compute the errors of a grasp in one image, in pixels.

    Parameters
    ----------
    points
        The marks of the hand and the corners of the box, in pixels.

    Returns
    -------
    errors
        The distance of the second tip from the line through the first one and the vanishing point of the first axis;
        those of both bases from the lines through their tips and the vanishing point of the third axis; that of the
        middle of the tips from the third axis of the box; those of both tips from the first axis; and the deviation
        from -1 of the cross-ratio of the tips, the centre of the box, and the vanishing point.
    ratio
        The distance of the centres of the faces between the fingers, divided by that of the tips.
    convexity
        The least of all faces, the least of the faces whose centres are used, and that of the hand: negative if a part
        is behind the camera or points are confused, and almost 0 if a rectangle is seen from the side.
    ahead
        Positive if the bases of the fingers are on the side of the end 1 of the third axis.
    """
    corners = points[4:]
    mean = [sum(p[i] for p in corners) / 8 for i in range(2)]
    square = sum((p[i] - mean[i]) * (p[i] - mean[i]) for p in corners for i in range(2)) / 8
    pixels = FIELD * sqrt(square + TINY)
    scale = 1 / pixels
    vectors = [
        ga.assemble(PROJECTIVE2, {"e1": scale * (x - mean[0]), "e2": scale * (y - mean[1]), "e3": 1}) for x, y in points
    ]
    (left, right, left_base, right_base), box = vectors[:4], vectors[4:]

    def centre_of(face):
        a, b, c, d = (box[k] for k in face)
        return _pixel(_join(_join(a, c), _join(b, d)))

    first, second, above = centre_of(_face(0, 0)), centre_of(_face(0, 1)), centre_of(_face(2, 1))
    centre = _concurrent([_line(box[k], box[7 - k]) for k in range(4)])
    closing, upwards = _vanishing_point(box, 0), _vanishing_point(box, 2)
    middle = (left + right) / 2
    span = second - first
    harmonic = _harmonic(left, right, centre, closing, span / _length(span))
    errors = (
        _away(right, left, closing),
        _away(left_base, left, upwards),
        _away(right_base, right, upwards),
        _away(middle, centre, above),
        _away(left, first, second),
        _away(right, first, second),
        harmonic,
    )
    ratio = sqrt((ga.norm_squared(span) + TINY) / (ga.norm_squared(right - left) + TINY))
    used = [_convexity(*(box[k] for k in _face(*face))) for face in ((0, 0), (0, 1), (2, 1))]
    others = [_convexity(*(box[k] for k in _face(*face))) for face in ((1, 0), (1, 1), (2, 0))]
    clear = ga.minimum(used[0], ga.minimum(used[1], used[2]))
    least = ga.minimum(clear, ga.minimum(others[0], ga.minimum(others[1], others[2])))
    up, own = above - centre, left_base + right_base - left - right
    return (
        tuple(pixels * error for error in errors),
        ratio,
        (least, clear, _convexity(left, right, right_base, left_base)),
        up["e1"] * own["e1"] + up["e2"] * own["e2"],
    )


ROWS, MOTION = array(SCALAR, "rows"), array(SCALAR, 6)
JACOBIAN = array(SCALAR, "rows", 6)


def _dot(a, b):
    return sum((x * y for x, y in zip(a[1:], b[1:], strict=True)), a[0] * b[0])


@kernel(errors=ROWS, jacobian=JACOBIAN, weights=ROWS, damping=SCALAR, gain=SCALAR, limit=SCALAR, returns=MOTION)
def step_of_hand(errors, jacobian, weights, damping, gain, limit):
    """Compute the motion that reduces weighted errors, by damped least squares.

    Directions that no error depends on, the null space of the derivatives, are left alone because of the damping.

    Parameters
    ----------
    errors, jacobian, weights
        The errors, their derivatives by the motion, and their weights.
    damping
        The increment of the diagonal of the normal equations, relative to their trace.
    gain
        The part of the errors that is to be removed.
    limit
        Maximum length of the motion.
    """

    def normal(error, row, weight):
        return tuple(weight * row[i] * row[j] for i in range(6) for j in range(i + 1)), tuple(
            weight * x * error for x in row
        )

    triangle, right = total(normal, errors, jacobian, weights)
    matrix = [[triangle[max(i, j) * (max(i, j) + 1) // 2 + min(i, j)] for j in range(6)] for i in range(6)]
    more = damping * sum(matrix[i][i] for i in range(6)) + TINY
    for i in range(6):
        matrix[i][i] = matrix[i][i] + more
    solution, _ = ga.solve_symmetric(matrix, right)
    length = gain * sqrt(_dot(solution, solution) + TINY)
    factor = -gain * ga.minimum(1, limit / length)
    return tuple(factor * x for x in solution)


@kernel(jacobian=JACOBIAN, change=ROWS, motion=MOTION, floor=SCALAR, returns=JACOBIAN)
def improved_jacobian(jacobian, change, motion, floor):
    """Correct derivatives by the observed change of the errors in a motion, by Broyden's rule.

    Parameters
    ----------
    jacobian
        Derivatives of the errors.
    change, motion
        The change of the errors, and the motion.
    floor
        Squared length of motions at which half of the observed deviation counts, because of noise.
    """
    square = _dot(motion, motion) + floor

    def corrected(row, seen):
        share = (seen - _dot(row, motion)) / square
        return tuple(x + share * m for x, m in zip(row, motion, strict=True))

    return each(corrected, jacobian, change)
