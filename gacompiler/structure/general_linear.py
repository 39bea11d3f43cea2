"""The general linear group as versors: GL(n) and gl(n) in G(n, n).

The vectors ``w_1 .. w_n`` and ``v_1 .. v_n`` of `gacompiler.algebra.catalog.null_pairs` are two null cones with
``w_i . v_j = 1`` for ``i = j``, else 0. A matrix `A` is the bivector ``sum a_ij w_i ^ v_j``, whose commutator with the
``w`` is `A`; a matrix `T` the versor that moves the ``w`` by `T` and the ``v`` by the inverse transposed, so that all
of linear algebra is orthogonal (Doran, Hestenes, Sommen & Van Acker, *J. Math. Phys.* 34, 1993).

No logarithm is needed: with ``C = (T - 1) (T + 1)**-1`` the versor is the outer exponential of the bivector of `C`
times ``det(T + 1)``, and by Cramer's rule every coefficient of that product is one determinant, whether or not
``T + 1`` has an inverse.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..algebra.algebra import Algebra
from ..algebra.blades import exact
from ..algebra.catalog import null_pairs
from ..algebra.coefficients import divide, is_exact
from ..algebra.multivector import Multivector
from ..errors import AlgebraError
from .groups import membership
from .lie import LieAlgebra

Floats = NDArray[np.float64]

_OUTSIDE = 1e-9
"""Tolerance for components outside the null cone, relative to the largest coefficient, for inexact versors."""


@cache
def null_cones(n: int) -> Algebra:
    """Return G(n, n) in a basis of null pairs, the same object each time."""
    return null_pairs(n)


def orthonormal_frame(n: int) -> tuple[tuple[Multivector, ...], tuple[Multivector, ...]]:
    """Return the vectors ``s_i = w_i + v_i / 2`` of square +1 and ``t_i = w_i - v_i / 2`` of square -1 of G(n, n)."""
    vectors = null_cones(n).basis()
    half = Fraction(1, 2)
    pairs = list(zip(vectors[:n], vectors[n:], strict=True))
    return tuple(w + v * half for w, v in pairs), tuple(w - v * half for w, v in pairs)


def bivector_of_linear_map(matrix: Sequence[Sequence[Any]]) -> Multivector:
    """Return the bivector ``sum a_ij w_i ^ v_j`` of a matrix over any ring: ``B x w_k`` is its column `k` on the ``w``.

    Commutator products of bivectors are commutators of matrices: ``B_A x B_C`` corresponds to ``A C - C A``.
    """
    n = _square(matrix)
    terms = {1 << i | 1 << n + j: _own(matrix[i][j]) for i in range(n) for j in range(n)}
    return Multivector(null_cones(n), terms)


def linear_map_of_bivector(bivector: Multivector) -> NDArray[Any]:
    """Return the matrix of a bivector of gl(n), shape (n, n), dtype object: inverse of `bivector_of_linear_map`.

    Raises
    ------
    AlgebraError
        For another algebra, and for a bivector with terms that correspond to no matrix, such as ``w_1 ^ w_2``.
    """
    n = _pairs(bivector.algebra)
    found = np.array([[bivector[1 << i | 1 << n + j] for j in range(n)] for i in range(n)], dtype=object)
    if bivector_of_linear_map(found.tolist()).terms != bivector.terms:
        raise AlgebraError("linear_map_of_bivector", f"{bivector}", "a sum of w_i ^ v_j")
    return found


def general_linear_algebra(n: int) -> LieAlgebra:
    """Return gl(n): the ``n**2`` bivectors ``w_i ^ v_j``, row by row."""
    return LieAlgebra(null_cones(n), tuple(_unit(n, i, j) for i in range(n) for j in range(n)))


def special_linear_algebra(n: int) -> LieAlgebra:
    """Return sl(n): the bivectors of traceless matrices."""
    off = [_unit(n, i, j) for i in range(n) for j in range(n) if i != j]
    return LieAlgebra(null_cones(n), (*off, *(_unit(n, i, i) - _unit(n, i + 1, i + 1) for i in range(n - 1))))


def orthogonal_subalgebra(squares: Sequence[int]) -> LieAlgebra:
    """Return so(p, q) within gl(n): the matrices that are skew in a metric of squares +1 and -1."""
    n = len(squares)
    return LieAlgebra(
        null_cones(n),
        tuple(_unit(n, i, j) * squares[i] - _unit(n, j, i) * squares[j] for i in range(n) for j in range(i + 1, n)),
    )


def versor_of_linear_map(matrix: Sequence[Sequence[Any]] | ArrayLike, normalized: bool = False) -> Multivector:
    """Return the versor of G(n, n) that moves the ``w`` by a matrix ``T``: ``K w_k K**-1`` is the column `k` of `T`.

    Parameters
    ----------
    matrix : (n, n)
        Invertible. The result is exact if the entries are integers or fractions.
    normalized : bool
        Divide by ``sqrt(|det T|)``, as floats, so that ``K ~K`` is +1 or -1.

    Returns
    -------
    Multivector
        Even, with ``K ~K = det T``. The map is a homomorphism: the versor of a product is the product of the versors.
        If ``det T < 0`` the norm is negative, and `K` is not the exponential of a bivector.

    Raises
    ------
    AlgebraError
        For a matrix that is not square or not invertible.
    """
    entries = [[_own(value) for value in row] for row in np.asarray(matrix, dtype=object)]
    n = _square(entries)
    values: list[Any]
    if all(is_exact(value) for row in entries for value in row):
        values, determinant = _exact_coefficients(entries), _determinant(entries)
    else:
        numbers = np.array(entries, dtype=float)
        values, determinant = versor_coefficients(numbers).tolist(), np.linalg.det(numbers)
    if determinant == 0:
        raise AlgebraError("versor_of_linear_map", "a matrix of determinant 0", "a matrix that has an inverse")
    versor = Multivector(null_cones(n), dict(zip(versor_blades(n), values, strict=True)))
    if not normalized:
        return versor
    size = abs(float(determinant)) ** 0.5
    return versor.map(lambda value: float(value) / size)


def versor_coefficients(matrices: ArrayLike) -> Floats:
    """Return the coefficients of the versors of many matrices at once, not normalised.

    Parameters
    ----------
    matrices : array_like, (..., n, n)

    Returns
    -------
    array, (..., m)
        On the ``m = (2n)! / n!**2`` blades of `versor_blades`.
    """
    t = np.asarray(matrices, dtype=float)
    n = t.shape[-1]
    _, rows = _index_sets(n)
    stacked = np.concatenate([t + np.eye(n), t - np.eye(n)], axis=-2)
    found = np.linalg.det(stacked[..., rows, :]) * _signs(n)
    return np.asarray(found)


def versor_blades(n: int) -> tuple[int, ...]:
    """Return the bitmaps of the blades in versors of linear maps: as many ``w`` as ``v``."""
    return _index_sets(n)[0]


def linear_map_of_versor(versor: Multivector) -> NDArray[Any]:
    """Return the matrix, shape (n, n), dtype object, by which a versor moves the ``w``; exact if the versor is.

    Raises
    ------
    AlgebraError
        For an element that is not a versor, and for versors that mix the two null cones.
    """
    n = _pairs(versor.algebra)
    action = membership(versor).action
    if action is None:
        raise AlgebraError("linear_map_of_versor", "an element that is not a versor", "a product of invertible vectors")
    found = np.array(action, dtype=object)
    size = max(abs(value) for value in found.flat)
    exactly = all(is_exact(value) for value in versor.terms.values())
    if any(abs(value) > (0 if exactly else _OUTSIDE * size) for value in [*found[n:, :n].flat, *found[:n, n:].flat]):
        raise AlgebraError("linear_map_of_versor", "a versor that mixes the null cones", "w moved to w, v moved to v")
    return found[:n, :n]


def polar_versors(matrix: ArrayLike) -> tuple[Multivector, Multivector]:
    """Return versors of a rotation or reflection ``Q`` and a symmetric positive stretch ``S`` with ``T = Q S``.

    They are normalised floats, computed from the singular values of `T`.
    """
    left, values, right = np.linalg.svd(np.asarray(matrix, dtype=float))
    return (
        versor_of_linear_map(left @ right, normalized=True),
        versor_of_linear_map(right.T @ np.diag(values) @ right, normalized=True),
    )


@cache
def _index_sets(n: int) -> tuple[tuple[int, ...], NDArray[np.int64]]:
    """Return, for sets I and J of one size, ``w_I ^ v_J`` and the rows of (T + 1, T - 1) of its determinant.

    Rows J of ``T + 1`` are replaced by rows I of ``T - 1``.
    """
    blades, rows = [], []
    for k in range(n + 1):
        for one in combinations(range(n), k):
            for two in combinations(range(n), k):
                chosen = list(range(n))
                for i, j in zip(one, two, strict=True):
                    chosen[j] = n + i
                blades.append(sum(1 << i for i in one) | sum(1 << n + j for j in two))
                rows.append(chosen)
    return tuple(blades), np.array(rows, dtype=np.int64).reshape(-1, n)


@cache
def _signs(n: int) -> Floats:
    """Return ``2**-n`` times the sign of sorting ``w v w v ...`` into ``w w ... v v ...``."""
    sizes = [blade.bit_count() // 2 for blade in _index_sets(n)[0]]
    return np.array([(-1) ** (k * (k - 1) // 2) / 2.0**n for k in sizes])


def _exact_coefficients(matrix: Sequence[Sequence[Any]]) -> list[Any]:
    n = len(matrix)
    stacked = [[matrix[i][j] + (i == j) for j in range(n)] for i in range(n)]
    stacked += [[matrix[i][j] - (i == j) for j in range(n)] for i in range(n)]
    _, rows = _index_sets(n)
    signs = _signs(n)
    return [
        exact(Fraction(sign) * _determinant([stacked[k] for k in row]))
        for sign, row in zip(signs.tolist(), rows.tolist(), strict=True)
    ]


def _determinant(rows: Sequence[Sequence[Any]]) -> Fraction:
    work = [[Fraction(x) for x in row] for row in rows]
    result = Fraction(1)
    for k in range(len(work)):
        pivot = next((i for i in range(k, len(work)) if work[i][k]), None)
        if pivot is None:
            return Fraction(0)
        if pivot != k:
            work[k], work[pivot] = work[pivot], work[k]
            result = -result
        result *= work[k][k]
        for i in range(k + 1, len(work)):
            factor = divide(work[i][k], work[k][k])
            if factor:
                work[i] = [x - factor * y for x, y in zip(work[i], work[k], strict=True)]
    return result


def _unit(n: int, i: int, j: int) -> Multivector:
    return Multivector(null_cones(n), {1 << i | 1 << n + j: 1})


def _square(matrix: Sequence[Sequence[Any]]) -> int:
    n = len(matrix)
    if n == 0 or any(len(row) != n for row in matrix):
        raise AlgebraError("linear map", f"{n} rows of {[len(row) for row in matrix]} numbers", "a square matrix")
    return n


def _pairs(algebra: Algebra) -> int:
    n = algebra.dimension // 2
    if algebra.dimension % 2 or n == 0 or algebra.gram != null_cones(n).gram:
        raise AlgebraError(f"linear maps in {algebra.name}", "another basis", "null_pairs(n)")
    return n


def _own(value: Any) -> Any:
    """Convert NumPy numbers to Python numbers."""
    return value.item() if isinstance(value, np.generic) else value
