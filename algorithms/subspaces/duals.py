"""Complements, metric duals, and the delta product of arrays of blades."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..precision import CONVERGED
from . import index_tables as tables
from .blade import Blade, FactoredBlade, Floats, _made, check_pair, factorize_blade
from .gram import gram_matrix, is_degenerate
from .incidence import ANGLE, AnyBlade, join_and_meet


def dual(a: AnyBlade) -> AnyBlade:
    """Return the right complement: ``b ^ dual(b) = I`` for basis blades. It does not depend on a metric.

    Raises
    ------
    TypeError
        If `a` is not a Blade or FactoredBlade.
    """
    if isinstance(a, Blade):
        blades = tables.vectors_of(a.n, a.grade)
        # number of swaps that move the blade's vectors to the front
        swaps = blades.sum(-1) - a.grade * (a.grade - 1) // 2
        sign = 1.0 - 2.0 * (swaps & 1)
        # complements are in reverse order
        return Blade((a.coefficients * sign)[..., ::-1], a.n, a.n - a.grade)
    if not isinstance(a, FactoredBlade):
        raise TypeError(f"a: {type(a).__name__}; expected Blade or FactoredBlade")
    whole = np.linalg.qr(np.swapaxes(a.vectors, -1, -2), mode="complete")[0]
    rest = np.swapaxes(whole[..., a.grade :], -1, -2)
    orientation = np.sign(np.linalg.det(np.concatenate([a.vectors, rest], -2)))
    return _made(rest, a.scale * orientation)


def polarity(a: AnyBlade, gram: ArrayLike | None = None) -> AnyBlade:
    """Return the metric dual ``a I**-1``.

    Parameters
    ----------
    a : Blade or FactoredBlade
    gram : array_like, (n,) or (n, n), optional
        Squares, or all inner products, of the basis vectors. Euclidean by default.

    Raises
    ------
    TypeError, ValueError
        If the metric is degenerate, so that the pseudoscalar has no inverse, or `gram` has a wrong shape.
    """
    if isinstance(a, Blade):
        return polarity(factorize_blade(a), gram).coefficients()
    if not isinstance(a, FactoredBlade):
        raise TypeError(f"a: {type(a).__name__}; expected Blade or FactoredBlade")
    matrix = gram_matrix(gram, a.n)
    if is_degenerate(matrix):
        raise ValueError("polarity: the metric is degenerate and I has no inverse; use dual, which needs no metric")
    mapped = FactoredBlade.of_vectors(a.vectors @ matrix)
    square = _reversion(a.n) * np.linalg.det(matrix)
    return dual(_made(mapped.vectors, _reversion(a.grade) * mapped.scale * a.scale / square))


def delta_product(
    a: AnyBlade, b: AnyBlade, gram: ArrayLike | None = None, tolerance: float = ANGLE
) -> AnyBlade:  # fmt: skip
    """Return the delta product of two blades: the part of grade ``join - meet`` of their geometric product.

    Parameters
    ----------
    a, b : Blade or FactoredBlade
        Blades of the same form and dimension. Leading axes broadcast, and all meets must have the same grade.
    gram : array_like, (n,) or (n, n), optional
        Squares, or all inner products, of the basis vectors. Euclidean by default.
    tolerance : float
        The sine of an angle below which a direction counts as shared; see `join_and_meet`.

    Raises
    ------
    TypeError, ValueError
        If the arguments are incompatible, the grades of meets differ, or a meet is null in the metric, so that the
        product may vanish.
    """
    check_pair(a, b)
    matrix = gram_matrix(gram, a.n)
    if isinstance(a, Blade) and isinstance(b, Blade):
        return delta_product(factorize_blade(a), factorize_blade(b), gram, tolerance).coefficients()
    found = join_and_meet(a, b, tolerance)
    joined, met = found.join(), found.meet()
    assert isinstance(joined, FactoredBlade) and isinstance(met, FactoredBlade)
    rows, m = np.swapaxes(joined.vectors, -1, -2), met.grade
    square = np.linalg.det(met.vectors @ matrix @ np.swapaxes(met.vectors, -1, -2))
    if np.any(np.abs(square) <= CONVERGED * np.abs(matrix).max() ** m):
        raise ValueError("delta_product: a meet is null in the metric; expected invertible meets")
    # in coordinates of the join: the complement orthogonal to the meet, and the volume spanned by both
    inside, across = met.vectors @ rows, met.vectors @ matrix @ rows
    whole = np.linalg.qr(np.swapaxes(across, -1, -2), mode="complete")[0]
    outside = np.swapaxes(whole[..., m:], -1, -2)
    volume = np.linalg.det(np.concatenate([outside, inside], -2))
    sign = _reversion(m) * (-1.0) ** (m * (joined.grade - a.grade))
    return _made(outside @ joined.vectors, sign * square * joined.scale / volume)


def metric_factors(a: FactoredBlade, gram: ArrayLike) -> tuple[Floats, Floats]:
    """Return vectors that are orthogonal in a metric and whose geometric product is a given blade.

    Returns
    -------
    vectors : array, (..., grade, n)
        The first vector includes the scale.
    squares : array, (..., grade)
        Squares of the vectors before scaling; zero for null directions.
    """
    matrix = gram_matrix(gram, a.n)
    squares, rotation = np.linalg.eigh(a.vectors @ matrix @ np.swapaxes(a.vectors, -1, -2))
    vectors = np.swapaxes(rotation, -1, -2) @ a.vectors
    if a.grade:
        vectors[..., 0, :] *= (a.scale * np.linalg.det(rotation))[..., None]
    return vectors, squares


def _reversion(k: int) -> float:
    return -1.0 if k & 2 else 1.0
