"""Two calibrated views in kernels: residuals of pairs of pixels, their derivatives, and steps of motions.

A motion is the unit quaternion of its rotation and its translation, of length 1. `left` and `right` are the inverses of
the matrices K of both cameras, and `onto` is that of the second.
"""

import gacompiler as ga
from gacompiler import maximum, minimum, select, sqrt, total
from gacompiler.specs.families.covariances import choose, cross, dot
from gacompiler.specs.families.descents import TINY, descend
from gacompiler.specs.families.sights import DIRECTION, place_of, rotor_of, translator_of


def unit(vector):
    """Return a vector of length 1."""
    size = sqrt(dot(vector, vector))
    return tuple(x / size for x in vector)


def rotation_matrix(quaternion):
    """Return the matrix of the rotation by a unit quaternion."""
    w, x, y, z = quaternion
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def product(a, b):
    """Return the product of two matrices."""
    columns = tuple(zip(*b, strict=True))
    return tuple(tuple(dot(row, column) for column in columns) for row in a)


def transposed(a):
    """Return the rows of the transposed matrix."""
    return tuple(zip(*a, strict=True))


def applied(matrix, vector):
    """Return the product of a matrix and a vector."""
    return tuple(dot(row, vector) for row in matrix)


def crossed(vector, matrix):
    """Return the matrix of which each column is the cross product of a vector and a column."""
    return transposed([cross(vector, column) for column in transposed(matrix)])


def parts(m):
    """Return the quaternion and the translation of a unit motor."""
    moved = ga.sandwich(m, place_of((0, 0, 0)))
    return (m["1"], -m["e23"], m["e13"], -m["e12"]), tuple(moved[name] for name in DIRECTION)


def sampson(fundamental, back, x, y):
    """Return the Sampson distance of a pair, its square's divisor, and the two epipolar lines."""
    line, other = applied(fundamental, (*x, 1)), applied(back, (*y, 1))
    size = line[0] * line[0] + line[1] * line[1] + other[0] * other[0] + other[1] * other[1]
    return line[0] * y[0] + line[1] * y[1] + line[2], size, line, other


def tangents(t):
    """Return two unit vectors orthogonal to a unit vector and to each other (Duff et al., JCGT 6, 2017)."""
    x, y, z = t
    sign = select(z < 0, -1, 1)
    a = -1 / (sign + z)
    b = x * y * a
    return (1 + sign * x * x * a, sign * b, -sign * x), (b, sign + y * y * a, -y)


def turned_by(quaternion, step):
    """Return a rotation after a small rotation vector, the first three numbers of a step."""
    w, x, y, z = quaternion
    a, b, c = (s / 2 for s in step[:3])
    return unit(
        (w - a * x - b * y - c * z, x + a * w + b * z - c * y, y + b * w + c * x - a * z, z + c * w + a * y - b * x)
    )


def moved(quaternion, shift, step):
    """Return a motion after a small rotation and a step of its translation on the sphere."""
    u, v = tangents(shift)
    place = tuple(s + step[3] * p + step[4] * q for s, p, q in zip(shift, u, v, strict=True))
    return turned_by(quaternion, step), unit(place)


def derivatives(quaternion, shift, left, right):
    """Return the fundamental matrix of a motion, and its derivatives by rotations and by the two tangents."""
    rotation, down = rotation_matrix(quaternion), transposed(right)
    axes = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    matrices = [crossed(shift, rotation), *(crossed(shift, crossed(axis, rotation)) for axis in axes)]
    matrices += [crossed(u, rotation) for u in tangents(shift)]
    return [product(product(down, each_), left) for each_ in matrices]


def sampson_sums(distance, x, y, changes, limit):
    """Return the normal equations of one pair within the limit, and its truncated square."""
    off, size, line, other = distance
    inverse = 1 / sqrt(maximum(size, TINY))
    residual = off * inverse
    weight = select(residual * residual < limit, 1, 0)
    part = residual * inverse
    near = [(a - part * b) * inverse for a, b in zip((*y, 1), (line[0], line[1], 0), strict=True)]
    far = [part * inverse * b for b in other[:2]]
    outer = [[n * a for a in (*x, 1)] for n in near]
    for i, j in ((0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1)):
        outer[i][j] = outer[i][j] - far[j] * (*y, 1)[i]
    entries = [entry for row in outer for entry in row]
    rows = [dot([entry for row in change for entry in row], entries) for change in changes]
    n = len(rows)
    table = tuple(weight * rows[i] * rows[j] for i in range(n) for j in range(i, n))
    return (*table, *(weight * row * residual for row in rows), minimum(residual * residual, limit))


def normal_equations(quaternion, shift, left, right, first, second, limit):
    """Return the normal equations of pairs within the limit, and the sum of truncated squares."""
    fundamental, *changes = derivatives(quaternion, shift, left, right)
    back = transposed(fundamental)

    def of(x, y):
        return sampson_sums(sampson(fundamental, back, x, y), x, y, changes, limit)

    return total(of, first, second)


def normal_equations_in_front(quaternion, shift, left, right, onto, first, second, limit):
    """Return what `normal_equations` does, for pairs of points that are in front of the cameras or at infinity."""
    fundamental, *changes = derivatives(quaternion, shift, left, right)
    back, rotation = transposed(fundamental), rotation_matrix(quaternion)

    def of(x, y):
        off, size, line, other = sampson(fundamental, back, x, y)
        _, _, in_front = met(rotation, shift, left, right, x, y, off / maximum(size, TINY), line, other)
        own = sampson_sums((off, size, line, other), x, y, changes, limit)
        table, slope, square_ = transfer_sums(rotation, left, onto, x, y, limit)
        wide = [0] * 15
        for k, position in enumerate((0, 1, 2, 5, 6, 9)):
            wide[position] = table[k]
        return choose(in_front > 0, own, (*wide, *slope, 0, 0, square_))

    return total(of, first, second)


def transfer(rotation, left, onto, x, y):
    """Return the offset of a pixel from its partner under a rotation, the inverse of its covariance, and the place.

    The covariance is that of noise in both images.
    """
    ray = applied(left, (*x, 1))
    turned = applied(rotation, ray)
    depth = select(turned[2] > 0, turned[2], 1)
    place = turned[0] / depth, turned[1] / depth
    columns = [applied(rotation, column) for column in transposed(left)[:2]]
    inner = [[(c[k] - place[k] * c[2]) / depth for c in columns] for k in (0, 1)]
    change = product([row[:2] for row in onto[:2]], inner)
    off = [dot(row, (*place, 1)) - b for row, b in zip(onto[:2], y, strict=True)]
    a, b = 1 + dot(change[0], change[0]), dot(change[0], change[1])
    c = 1 + dot(change[1], change[1])
    scale = 1 / (a * c - b * b)
    return off, (c * scale, -b * scale, a * scale), (*place, turned[2])


def met(rotation, t, left, right, x, y, part, line, other):
    """Return the depth at which the lines of sight of the nearest pair meet, the first line, and if it is in front."""
    ray = applied(left, (x[0] - part * other[0], x[1] - part * other[1], 1))
    sight = applied(right, (y[0] - part * line[0], y[1] - part * line[1], 1))
    turned = applied(rotation, ray)
    aa, ab, bb = dot(turned, turned), dot(turned, sight), dot(sight, sight)
    at, bt = dot(turned, t), dot(sight, t)
    normal = cross(turned, sight)
    inverse = 1 / maximum(dot(normal, normal), TINY)
    depth, depth_there = (ab * bt - bb * at) * inverse, (aa * bt - ab * at) * inverse
    return depth, ray, select(depth > 0, select(depth_there > 0, 1, 0), 0)


def form(weights, a, b):
    """Return the value of a symmetric bilinear form of two numbers each."""
    xx, xy, yy = weights
    return xx * a[0] * b[0] + xy * (a[0] * b[1] + a[1] * b[0]) + yy * a[1] * b[1]


def transfer_sums(rotation, left, onto, x, y, limit):
    """Return the normal equations of one pair by a rotation, if it is within the limit, and its truncated square."""
    off, weights, (u, v, depth) = transfer(rotation, left, onto, x, y)
    found = select(depth > 0, form(weights, off, off), 2 * limit)
    weight = select(found < limit, 1, 0)
    moved = ((-u * v, 1 + u * u, -v), (-1 - v * v, u * v, u))
    rows = transposed(product([row[:2] for row in onto[:2]], moved))
    table = tuple(weight * form(weights, rows[i], rows[j]) for i in range(3) for j in range(i, 3))
    return table, tuple(weight * form(weights, row, off) for row in rows), minimum(found, limit)


def descended(m, equations, at_most):
    """Return the motion to which steps from a motor lead, the normal equations there, and numbers of the descent."""
    quaternion, shift = parts(m)

    def sums(state):
        return equations(state[:4], state[4:])

    def stepped(state, step):
        turned, t = moved(state[:4], state[4:], step)
        return (*turned, *t)

    found = descend((*quaternion, *shift), 5, sums, stepped, at_most)
    motion = translator_of(found.state[4:]) * rotor_of(found.state[:4])
    return motion, found.table, (found.cost, found.ended, found.steps)
