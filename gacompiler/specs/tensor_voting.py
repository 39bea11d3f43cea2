"""Tensor voting in the plane and in space: stick, plate and ball votes over lists of pairs, and spectra of tensors.

A token is a point with a symmetric tensor, given by its upper triangle, row by row. Offsets are measured in units of
the scale sigma. A stick with the normal n votes, at the offset v of length l, for the normal ``-u n u`` with the unit
vector u along v: the normal there of the circle through both points that is tangent to the token's plane. The decay is
``exp(-s**2 - curvature * k**2)`` with the length s and the curvature k of the arc, and zero if the angle of v and the
plane exceeds 45 degrees. Plate and ball votes are integrals of stick votes over the normals in a plane, and over all
normals. By symmetry they depend on two functions of invariants of the pair, which callers take from tables.

A pair is a voter and a receiver. At the same place, a voter votes with its own stick or plate, and a ball does not
vote. In all loops over pairs, `zero` contains zeros.
"""

from fractions import Fraction

import gacompiler as ga
from gacompiler import SCALAR, array, each, gather, index, kernel, scatter, select, sqrt
from gacompiler.algebra.catalog import VGA2, VGA3

AXES2, AXES3 = ("e1", "e2"), ("e1", "e2", "e3")
VECTOR2, VECTOR3 = VGA2.VECTOR, VGA3.VECTOR
TENSORS2, TENSORS3 = array(SCALAR, "m", 3), array(SCALAR, "m", 6)
VOTER, RECEIVER = index("pairs", into="n"), index("pairs", into="m")
PAIRS = array(SCALAR, "pairs")
CUBICS = array(SCALAR, "cells", 8, shared=True)
STEEPEST = Fraction(1, 2)
"""The squared sine of the angle above which sticks do not vote."""
FLAT = Fraction(1, 10**16)
THIN = Fraction(1, 10**12)
NEVER_ZERO = Fraction(1, 10**200)


def _outer(numbers, factor):
    n = len(numbers)
    return tuple(factor * numbers[i] * numbers[j] for i in range(n) for j in range(i, n))


def _sum(*rows):
    return tuple(sum(column[1:], column[0]) for column in zip(*rows, strict=True))


def _numbers(vector, axes):
    return tuple(vector[name] for name in axes)


def _offset(place, other, scale):
    """Return the offset in units of the scale, its squared length, whether it is zero, and a nonzero squared length."""
    v = (other - place) / scale
    square = ga.norm_squared(v)
    same = square <= NEVER_ZERO
    return v, square, same, select(same, 1, square)


def _stick(normal, place, other, scale, curvature, axes):
    """Return the voted normal, and the decay of the vote."""
    v, square, same, safe = _offset(place, other, scale)
    along = ga.scalar_product(normal, v)
    sine = ga.minimum(along * along / safe, 1)
    turned = _numbers(-(v * normal * v) / safe, axes)
    voted = tuple(select(same, a, b) for a, b in zip(_numbers(normal, axes), turned, strict=True))
    return voted, select(same, 1, _decay(square, sine, safe, curvature))


def _decay(square, sine, safe, curvature):
    root = sqrt(sine)
    flat = sine <= FLAT
    ratio = select(flat, 1, ga.atan2(root, sqrt(1 - sine)) / select(flat, 1, root))
    decay = ga.exp(-(square * ratio * ratio) - 4 * curvature * sine / safe)
    return select(sine <= STEEPEST, decay, 0)


def _bicubic(row, x, y):
    a, b, c, d = (row[k] + y * (row[k + 1] + y * (row[k + 2] + y * row[k + 3])) for k in range(0, 16, 4))
    return a + x * (b + x * (c + x * d))


def _ball(place, other, weight, scale, x, cubics, axes):
    """Return the vote of a ball, ``a I + b v v / v**2``, with cubics of x from 0 to 1 for `a` and `b`."""
    v, _, same, safe = _offset(place, other, scale)
    a, b = (row[0] + x * (row[1] + x * (row[2] + x * row[3])) for row in (cubics[:4], cubics[4:]))
    counts = select(same, 0, weight)
    across = _outer(_numbers(v, axes), counts * b / safe)
    n = len(axes)
    alike = tuple(counts * a if i == j else 0 for i in range(n) for j in range(i, n))
    return _sum(across, alike)


@kernel(
    normal=VECTOR3, place=VECTOR3, at=VECTOR3, scale=SCALAR, curvature=SCALAR, returns=(array(SCALAR, 3), SCALAR),
)  # fmt: skip
def stick_vote(normal, place, at, scale, curvature):
    """Compute the normal for which a stick votes at a point, and the decay of the vote.

    Parameters
    ----------
    normal
        Unit normal of the token.
    place, at
        The token and the receiver.
    scale, curvature
        The length sigma, and the weight of squared curvatures in units of sigma.
    """
    return _stick(normal, place, at, scale, curvature, AXES3)


@kernel(
    points=array(VECTOR3, "n"), normals=array(VECTOR3, "n"), weights=array(SCALAR, "n"), at=array(VECTOR3, "m"),
    voter=VOTER, receiver=RECEIVER, scale=SCALAR, curvature=SCALAR, zero=array(SCALAR, "m"), returns=TENSORS3,
)  # fmt: skip
def stick_votes(points, normals, weights, at, voter, receiver, scale, curvature, zero):
    """Sum the votes of sticks in space."""

    def of(place, normal, weight, other):
        voted, factor = _stick(normal, place, other, scale, curvature, AXES3)
        return _outer(voted, weight * factor)

    rows = each(of, gather(points, voter), gather(normals, voter), gather(weights, voter), gather(at, receiver))
    return scatter(rows, receiver, zero)


@kernel(
    points=array(VECTOR2, "n"), normals=array(VECTOR2, "n"), weights=array(SCALAR, "n"), at=array(VECTOR2, "m"),
    voter=VOTER, receiver=RECEIVER, scale=SCALAR, curvature=SCALAR, zero=array(SCALAR, "m"), returns=TENSORS2,
)  # fmt: skip
def stick_votes_in_plane(points, normals, weights, at, voter, receiver, scale, curvature, zero):
    """Sum the votes of sticks in the plane."""

    def of(place, normal, weight, other):
        voted, factor = _stick(normal, place, other, scale, curvature, AXES2)
        return _outer(voted, weight * factor)

    rows = each(of, gather(points, voter), gather(normals, voter), gather(weights, voter), gather(at, receiver))
    return scatter(rows, receiver, zero)


@kernel(
    points=array(VECTOR3, "n"), weights=array(SCALAR, "n"), at=array(VECTOR3, "m"), voter=VOTER, receiver=RECEIVER,
    scale=SCALAR, x=PAIRS, cell=index("pairs", into="cells"), cubics=CUBICS, zero=array(SCALAR, "m"), returns=TENSORS3,
)  # fmt: skip
def ball_votes(points, weights, at, voter, receiver, scale, x, cell, cubics, zero):
    """Sum the votes of balls in space; each pair has a cell of a table of cubics, and a place x in it from 0 to 1."""

    def of(place, weight, other, x, row):
        return _ball(place, other, weight, scale, x, row, AXES3)

    places, sizes, others = gather(points, voter), gather(weights, voter), gather(at, receiver)
    return scatter(each(of, places, sizes, others, x, gather(cubics, cell)), receiver, zero)


@kernel(
    points=array(VECTOR3, "n"), first=VOTER, second=index("pairs", into="n"), scale=SCALAR, x=PAIRS,
    cell=index("pairs", into="cells"), cubics=CUBICS, zero=array(SCALAR, "n"),
    returns=(array(SCALAR, "n", 6), array(SCALAR, "n", 6)),
)  # fmt: skip
def mutual_ball_votes(points, first, second, scale, x, cell, cubics, zero):
    """Sum the votes of balls of the weight 1 for each other, separately for the first and the second of each pair.

    Both tokens of a pair receive the same vote.
    """

    def of(place, other, x, row):
        return _ball(place, other, 1, scale, x, row, AXES3)

    rows = each(of, gather(points, first), gather(points, second), x, gather(cubics, cell))
    return scatter(rows, first, zero), scatter(rows, second, zero)


@kernel(
    points=array(VECTOR2, "n"), weights=array(SCALAR, "n"), at=array(VECTOR2, "m"), voter=VOTER, receiver=RECEIVER,
    scale=SCALAR, x=PAIRS, cell=index("pairs", into="cells"), cubics=CUBICS, zero=array(SCALAR, "m"), returns=TENSORS2,
)  # fmt: skip
def ball_votes_in_plane(points, weights, at, voter, receiver, scale, x, cell, cubics, zero):
    """Sum the votes of balls in the plane; each pair has a cell of a table of cubics, and a place x in it."""

    def of(place, weight, other, x, row):
        return _ball(place, other, weight, scale, x, row, AXES2)

    places, sizes, others = gather(points, voter), gather(weights, voter), gather(at, receiver)
    return scatter(each(of, places, sizes, others, x, gather(cubics, cell)), receiver, zero)


@kernel(
    points=array(VECTOR3, "n"), at=array(VECTOR3, "m"), voter=VOTER, receiver=RECEIVER, scale=SCALAR, returns=PAIRS,
)  # fmt: skip
def pair_distances(points, at, voter, receiver, scale):
    """Compute the distance of each pair in space, in units of the scale."""

    def of(place, other):
        return ga.norm((other - place) / scale)

    return each(of, gather(points, voter), gather(at, receiver))


@kernel(
    points=array(VECTOR3, "n"), at=array(VECTOR3, "m"), normals=array(VECTOR3, "n"), tangents=array(VECTOR3, "n"),
    voter=VOTER, receiver=RECEIVER, scale=SCALAR, returns=(PAIRS, PAIRS, PAIRS),
)  # fmt: skip
def pair_invariants(points, at, normals, tangents, voter, receiver, scale):
    """Compute what the votes of sticks and plates depend on: a squared distance and two squared sines.

    The results are the squared distance in units of the scale, the squared sine of the angle of the offset and the
    plane of the stick, and that of the angle of the offset and the tangent.
    """

    def of(place, normal, tangent, other):
        v, square, _, safe = _offset(place, other, scale)
        across, along = ga.scalar_product(normal, v), ga.scalar_product(tangent, v)
        inverse = 1 / safe
        return square, ga.minimum(across * across * inverse, 1), ga.maximum(1 - along * along * inverse, 0)

    return each(of, gather(points, voter), gather(normals, voter), gather(tangents, voter), gather(at, receiver))


@kernel(square=SCALAR, sine=SCALAR, steepness=SCALAR, curvature=SCALAR, spread=SCALAR, returns=(SCALAR, SCALAR, SCALAR))
def vote_places(square, sine, steepness, curvature, spread):
    """Compute the decay of the vote of a stick, and the place of a plate in a table.

    The place is the root of the distance, and a number from 0 to 2 that grows with the sine s of the angle of offset
    and tangent. In units of the sine at 45 degrees, this is ``s (1 + t) / (s + t)`` with t = `spread` times the
    distance up to 45 degrees, and ``1 + sqrt(2 - 2 / s**2)`` above.

    Parameters
    ----------
    square, sine, steepness
        The results of `pair_invariants`.
    curvature
        The weight of squared curvatures.
    """
    decay = _decay(square, sine, select(square <= NEVER_ZERO, 1, square), curvature)
    distance = sqrt(square)
    near = spread * distance + NEVER_ZERO
    s = sqrt(2 * ga.minimum(steepness, STEEPEST))
    flat = s * (1 + near) / (s + near)
    steep = sqrt(ga.maximum(2 - 1 / ga.maximum(steepness, STEEPEST), 0))
    return decay, sqrt(distance), flat + steep


@kernel(
    points=array(VECTOR3, "n"), normals=array(VECTOR3, "n"), tangents=array(VECTOR3, "n"), sticks=array(SCALAR, "n"),
    plates=array(SCALAR, "n"), at=array(VECTOR3, "m"), voter=VOTER, receiver=RECEIVER, scale=SCALAR, decay=PAIRS,
    x=PAIRS, y=PAIRS, cell=index("pairs", into="cells"), cubics=array(SCALAR, "cells", 32, shared=True),
    zero=array(SCALAR, "m"), returns=TENSORS3,
)  # fmt: skip
def stick_and_plate_votes(
    points, normals, tangents, sticks, plates, at, voter, receiver, scale, decay, x, y, cell, cubics, zero
):
    """Sum the votes of tokens of surfaces and curves in space, each of which is a stick and a plate.

    With the unit offset u, the plate votes for ``w (I - t t) + e p p / p.p``, where t is the tangent, reflected in u,
    and p the component of u across the tangent, reflected in u. The function w is the integral of the decay times the
    squared component of the normal across u, and ``w + e`` that of the component along p.

    Parameters
    ----------
    sticks, plates
        Their weights.
    decay
        Of the stick of each pair.
    x, y
        Places of each pair in its cell, from 0 to 1.
    cubics
        Rows of coefficients of w and e, of the powers of y for each power of x.
    """

    def of(place, normal, tangent, stick, plate, other, decay, x, y, row):
        v, _, same, safe = _offset(place, other, scale)
        inverse = 1 / safe
        u, t = v * sqrt(inverse), tangent
        # -u n u = n - 2 n.u u; the second form gives n at the same place, where u is zero.
        voted = _numbers(normal - 2 * ga.scalar_product(normal, u) * u, AXES3)
        w, e = select(same, 1, _bicubic(row[:16], x, y)), _bicubic(row[16:], x, y)
        along = ga.scalar_product(t, u)
        p = u - along * t
        square = ga.norm_squared(p)
        d = select(square <= THIN, 0, e / ga.maximum(square, THIN))
        t, p = _numbers(t - 2 * along * u, AXES3), _numbers(p - 2 * square * u, AXES3)
        weight, w, d = stick * decay, plate * w, plate * d
        rows = []
        for i in range(3):
            for j in range(i, 3):
                alike = w if i == j else 0
                rows.append(weight * voted[i] * voted[j] + (alike - w * t[i] * t[j]) + d * p[i] * p[j])
        return tuple(rows)

    tokens = gather(points, voter), gather(normals, voter), gather(tangents, voter)
    weights = gather(sticks, voter), gather(plates, voter)
    rows = each(of, *tokens, *weights, gather(at, receiver), decay, x, y, gather(cubics, cell))
    return scatter(rows, receiver, zero)


@kernel(tensor=array(SCALAR, 6), returns=(array(SCALAR, 3), array(SCALAR, 3, 3)))
def spectrum(tensor):
    """Compute the eigenvalues of a symmetric tensor in descending order, and unit eigenvectors as rows."""
    xx, xy, xz, yy, yz, zz = tensor
    values, vectors = ga.eigenvectors_symmetric(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))
    rows = list(zip(*vectors, strict=True))
    return tuple(reversed(values)), tuple(reversed(rows))


@kernel(tensor=array(SCALAR, 3), returns=(array(SCALAR, 2), array(SCALAR, 2, 2)))
def spectrum_in_plane(tensor):
    """Compute the eigenvalues of a symmetric tensor of the plane in descending order, and eigenvectors as rows."""
    xx, xy, yy = tensor
    values, vectors = ga.eigenvectors_symmetric(((xx, xy), (xy, yy)))
    rows = list(zip(*vectors, strict=True))
    return tuple(reversed(values)), tuple(reversed(rows))
