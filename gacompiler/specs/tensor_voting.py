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
    root = sqrt(sine)
    flat = sine <= FLAT
    ratio = select(flat, 1, ga.atan2(root, sqrt(1 - sine)) / select(flat, 1, root))
    decay = ga.exp(-(square * ratio * ratio) - 4 * curvature * sine / safe)
    turned = _numbers(-(v * normal * v) / safe, axes)
    voted = tuple(select(same, a, b) for a, b in zip(_numbers(normal, axes), turned, strict=True))
    return voted, select(same, 1, select(sine <= STEEPEST, decay, 0))


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
    points=array(VECTOR3, "n"), at=array(VECTOR3, "m"), tangents=array(VECTOR3, "n"), voter=VOTER, receiver=RECEIVER,
    scale=SCALAR, returns=(PAIRS, PAIRS),
)  # fmt: skip
def pair_invariants(points, at, tangents, voter, receiver, scale):
    """Compute the distance of each pair in units of the scale, and the squared sine of its angle to the tangent."""

    def of(place, tangent, other):
        _, square, _, safe = _offset(place, other, scale)
        along = ga.scalar_product(tangent, (other - place) / scale)
        return sqrt(square), ga.maximum(1 - along * along / safe, 0)

    return each(of, gather(points, voter), gather(tangents, voter), gather(at, receiver))


@kernel(
    points=array(VECTOR3, "n"), tangents=array(VECTOR3, "n"), weights=array(SCALAR, "n"), at=array(VECTOR3, "m"),
    voter=VOTER, receiver=RECEIVER, scale=SCALAR, across=PAIRS, excess=PAIRS, zero=array(SCALAR, "m"), returns=TENSORS3,
)  # fmt: skip
def plate_votes(points, tangents, weights, at, voter, receiver, scale, across, excess, zero):
    """Sum the votes of plates, tokens of curves, in space.

    With the projector A across the tangent, the unit offset u, and p = A u, the vote is
    ``w A + d p p - 2 (w + d p.p) (p u + u p - 2 p.p u u)``. The function w is the integral of the decay times the
    squared component of the normal across u, and ``w + d p.p`` that of the component along p.

    Parameters
    ----------
    across, excess
        The functions w and d of each pair.
    """

    def of(place, tangent, weight, other, w, d):
        v, _, same, safe = _offset(place, other, scale)
        t, u = _numbers(tangent, AXES3), _numbers(v / sqrt(safe), AXES3)
        along = sum((a * b for a, b in zip(t, u, strict=True)), 0)
        p = tuple(a - along * b for a, b in zip(u, t, strict=True))
        square = sum((a * a for a in p), 0)
        both = w + d * square
        # p u + u p - 2 p.p u u = q u + u q with q = p - p.p u
        q = tuple(a - square * b for a, b in zip(p, u, strict=True))
        w, d, both = select(same, 1, w), select(same, 0, d), select(same, 0, both)
        rows = []
        for i in range(3):
            for j in range(i, 3):
                projector = (1 if i == j else 0) - t[i] * t[j]
                bent = q[i] * u[j] + u[i] * q[j]
                rows.append(weight * (w * projector + d * p[i] * p[j] - 2 * both * bent))
        return tuple(rows)

    places, axes, sizes = gather(points, voter), gather(tangents, voter), gather(weights, voter)
    return scatter(each(of, places, axes, sizes, gather(at, receiver), across, excess), receiver, zero)


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
