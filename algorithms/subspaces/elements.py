"""General elements with ``2**n`` coefficients: classification, and factorization of versors.

Coefficients are ordered by grade and then by bitmap, as in the layout `full` of an algebra. The only product required
is that with a basis vector, which permutes coefficients and changes signs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import real_array
from . import index_tables as tables
from .blade import BLADE_TOLERANCE, Floats, _finite, factors_and_defects, flat
from .gram import gram_matrix, nullity
from .reflections import reflections_of
from .versors import FactoredVersor

LARGEST = 12
"""Maximum dimension of elements with ``2**n`` coefficients."""


@dataclass(frozen=True, slots=True, eq=False)
class Classes:
    """Classification of elements.

    Attributes
    ----------
    kind : str array, (...)
        ``"zero"``, ``"blade"`` (including scalars, vectors and null blades), ``"versor"`` (a product of invertible
        vectors that is not a blade), or ``"general"``.
    grade : int array, (...)
        Grade of blades, -1 for other elements.
    is_even, is_odd, is_versor, is_null : bool array, (...)
        An element is null if the scalar part of ``a ~a`` vanishes. Blades that are not null are versors.
    norm_squared : array, (...)
        The scalar part of ``a ~a``.
    """

    kind: NDArray[np.str_]
    grade: NDArray[np.int64]
    is_even: NDArray[np.bool_]
    is_odd: NDArray[np.bool_]
    is_versor: NDArray[np.bool_]
    is_null: NDArray[np.bool_]
    norm_squared: Floats


def classify(coefficients: ArrayLike, gram: ArrayLike | None = None, tolerance: float = BLADE_TOLERANCE) -> Classes:
    """Classify elements as zero, blades, versors or general elements.

    Parameters
    ----------
    coefficients : array_like, (..., 2**n)
        n up to 12.
    gram : array_like, (n,) or (n, n), optional
        Squares, or all inner products, of the basis vectors. Euclidean by default.
    tolerance : float
        Tolerated deviation from a blade or a versor, relative to the norm. Smaller parts of a grade are ignored.

    Raises
    ------
    TypeError, ValueError
        If there are not 2**n finite coefficients, `gram` has a wrong shape, or the null space of the metric has two or
        more dimensions, where versors are not determined by their maps.

    Notes
    -----
    A versor satisfies ``V e_j = M(e_j) V`` with an orthogonal map M, which is computed by least squares. These elements
    form the Clifford-Lipschitz group. If the null space of the metric has at most one dimension, they are the products
    of vectors.
    """
    array, n = _element(coefficients)
    metric = _metric(gram, n)
    values = flat(array, array.shape[:-1], 1)
    size = np.linalg.norm(values, axis=-1)
    unit = values / np.where(size > 0, size, 1.0)[:, None]
    grades = _grades(n)
    present = np.stack([np.linalg.norm(unit[:, grades == k], axis=-1) > tolerance for k in range(n + 1)], -1)
    is_zero = size == 0
    is_even, is_odd = (~present[:, start::2].any(-1) for start in (1, 0))
    grade = np.where(present.sum(-1) == 1, present.argmax(-1), -1)
    for k in range(2, n - 1):
        chosen = np.flatnonzero(grade == k)
        _, _, error = factors_and_defects(unit[np.ix_(chosen, grades == k)], n, k, False, True)
        grade[chosen[error > tolerance]] = -1
    norm, error = _norm_squared(unit, n, metric), _maps(unit, n, metric)[1]
    is_null = np.abs(norm) <= tolerance * np.maximum(1.0, np.abs(metric).max()) ** n
    is_versor = (is_even ^ is_odd) & ~is_null & (error <= tolerance)
    kind = np.select([is_zero, grade >= 0, is_versor], ["zero", "blade", "versor"], "general")
    shape = array.shape[:-1]
    parts = (kind, np.where(is_zero, -1, grade), is_even, is_odd, is_versor, is_null, norm * size**2)
    return Classes(*(np.asarray(part).reshape(shape) for part in parts))


def factorize_versor(
    coefficients: ArrayLike, gram: ArrayLike | None = None, tolerance: float = BLADE_TOLERANCE
) -> FactoredVersor:  # fmt: skip
    """Factorize a versor into vectors by means of its map of vectors (Cartan-Dieudonné theorem).

    The map is the least-squares solution of ``M(e_j) V = V e_j`` (with a sign for odd versors). It is factorized by
    `reflections_of`, and the scale follows from the product of the resulting vectors.

    Parameters
    ----------
    coefficients : array_like, (2**n,)
        n up to 12.
    gram : array_like, (n,) or (n, n), optional
        Squares, or all inner products, of the basis vectors. Euclidean by default.
    tolerance : float
        Tolerated deviation of the product of the vectors from the element, relative to its norm.

    Raises
    ------
    TypeError, ValueError
        If the element is zero or not a versor, `gram` has a wrong shape, or the null space of the metric has two or
        more dimensions.
    """
    array, n = _element(coefficients)
    if array.ndim != 1:
        raise ValueError(f"coefficients: shape {array.shape}; expected one element, ({1 << n},)")
    metric = _metric(gram, n)
    size = float(np.linalg.norm(array))
    if size == 0.0:
        raise ValueError("coefficients: zero; expected a versor")
    unit = array[None] / size
    maps, error = _maps(unit, n, metric)
    if not error[0] <= tolerance:
        raise ValueError(f"coefficients: no versor: vectors turn into other grades, by {error[0]:.2g}")
    vectors = reflections_of(maps[0], metric)
    product = vector_products(vectors, n, metric)
    scale = float(product @ unit[0] / (product @ product))
    off = float(np.linalg.norm(unit[0] - scale * product))
    if not off <= tolerance:
        raise ValueError(f"coefficients: no versor: {off:.2g} of it is not in the product of vectors; expected 0")
    return FactoredVersor(vectors, metric, scale * size)


def vector_products(vectors: Floats, n: int, gram: Floats) -> Floats:
    """Return the coefficients of the geometric product of vectors, ``(k, n) -> (2**n,)``."""
    result = np.zeros(1 << n)
    result[0] = 1.0
    for vector in vectors[::-1]:
        result = vector @ _times_basis(result[None], n, gram, left=True)[0]
    return result


def versor_coefficients(versor: FactoredVersor) -> Floats:
    """Return the coefficients of versors in factored form, ``(..., 2**n)``, n up to 12.

    Raises
    ------
    ValueError
        If the dimension is larger than 12.
    """
    n = versor.n
    if n > LARGEST:
        raise ValueError(f"versor: {n} vectors; expected at most {LARGEST}; keep the factored form")
    rows = flat(versor.vectors, versor.shape, 2)
    products = np.array([vector_products(one, n, versor.gram) for one in rows]).reshape(*versor.shape, 1 << n)
    return np.asarray(products * versor.scale[..., None])


def _metric(gram: ArrayLike | None, n: int) -> Floats:
    metric = gram_matrix(gram, n)
    if nullity(metric) > 1:
        raise ValueError("gram: two or more dimensions are orthogonal to all; expected one at most; versors are more")
    return metric


def _element(coefficients: ArrayLike) -> tuple[Floats, int]:
    array = _finite(real_array(coefficients, "coefficients", (-1,), "2**n coefficients"), "coefficients")
    n = int(array.shape[-1]).bit_length() - 1
    if array.shape[-1] != 1 << max(n, 0) or not 1 <= n <= LARGEST:
        raise ValueError(f"coefficients: {array.shape[-1]} in the last axis; expected 2**n with n from 1 to {LARGEST}")
    return array, n


@cache
def _bitmaps(n: int) -> NDArray[np.int64]:
    return np.array([int((1 << row).sum()) for k in range(n + 1) for row in tables.vectors_of(n, k).astype(np.int64)])


@cache
def _grades(n: int) -> NDArray[np.int64]:
    return np.array([int(bitmap).bit_count() for bitmap in _bitmaps(n)])


@cache
def _moves(n: int, left: bool) -> tuple[NDArray[np.int64], Floats]:
    """Return for each basis vector and blade the index of the blade with that vector added or removed, and the sign."""
    bitmaps = _bitmaps(n)
    at = np.empty(1 << n, np.int64)
    at[bitmaps] = np.arange(1 << n)
    targets, signs = np.empty((n, 1 << n), np.int64), np.empty((n, 1 << n))
    for i in range(n):
        targets[i] = at[bitmaps ^ (1 << i)]
        others = bitmaps & ((1 << i) - 1) if left else bitmaps >> (i + 1)
        signs[i] = [1 - 2 * (int(other).bit_count() & 1) for other in others]
    return targets, signs


def _times_basis(values: Floats, n: int, gram: Floats, left: bool) -> Floats:
    """Return ``e_i X`` or ``X e_i`` for all basis vectors: ``(N, 2**n) -> (N, n, 2**n)``."""
    targets, signs = _moves(n, left)
    moved = values[:, targets] * signs
    has = (_bitmaps(n)[None, :] >> np.arange(n)[:, None] & 1).astype(bool)
    outer = np.where(has, moved, 0.0)
    inner = np.where(has, 0.0, moved)
    return np.asarray(outer + np.einsum("ij,ejs->eis", gram, inner))


def _norm_squared(values: Floats, n: int, gram: Floats) -> Floats:
    """Return the scalar part of ``a ~a``, grade by grade from minors of the Gram matrix."""
    if np.abs(gram - np.diag(np.diag(gram))).max() == 0:
        squares = np.array([np.prod(np.diag(gram)[tables.vectors_of(n, k)], -1) for k in range(n + 1)], dtype=object)
        return np.asarray(values**2 @ np.concatenate(list(squares)).astype(np.float64))
    total = np.zeros(len(values))
    for k in range(n + 1):
        blades = tables.vectors_of(n, k)
        minors = np.linalg.det(gram[blades[:, None, :, None], blades[None, :, None, :]])
        part = values[:, _grades(n) == k]
        total += np.einsum("ei,ij,ej->e", part, minors, part)
    return total


def _maps(values: Floats, n: int, gram: Floats) -> tuple[Floats, Floats]:
    """Return the maps of vectors of elements that are versors, and the deviation of the elements from versors."""
    odd = np.linalg.norm(values[:, _grades(n) & 1 == 1], axis=-1) > np.linalg.norm(
        values[:, _grades(n) & 1 == 0], axis=-1
    )
    left = np.swapaxes(_times_basis(values, n, gram, left=True), -1, -2)
    right = np.swapaxes(_times_basis(values, n, gram, left=False), -1, -2)
    right = right * np.where(odd, -1.0, 1.0)[:, None, None]
    maps = np.linalg.pinv(left, rcond=1e-10) @ right
    size = 1.0 + np.abs(maps).max((-1, -2))
    error = np.linalg.norm(left @ maps - right, axis=(-1, -2)) / size
    kept = np.swapaxes(maps, -1, -2) @ gram @ maps
    off = np.abs(kept - gram).max((-1, -2)) / size**2
    return maps, np.maximum(error, off)
