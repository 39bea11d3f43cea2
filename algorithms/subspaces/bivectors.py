"""Invariant decomposition: bivectors as sums of commuting simple bivectors, in any metric."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ..arguments import real_array
from ..precision import EIGENVALUE, NEGLIGIBLE, ROUNDING, SINGLE, TINY
from .blade import LARGEST, Floats, _finite, check_dimension, flat
from .gram import gram_matrix

_APART = 0.05
"""Squared rates that differ by more than this, relative to the largest, are separated by polynomials."""


@dataclass(frozen=True, slots=True, eq=False)
class BivectorParts:
    """Invariant decompositions of bivectors.

    Attributes
    ----------
    parts : array, (..., n // 2, n (n - 1) / 2)
        Commuting simple bivectors in descending order of the absolute values of their squares, padded with zeros. Their
        sum is the bivector.
    squares : array, (..., n // 2)
        Squares of the parts: negative for rotations, positive for boosts, 0 for null parts.
    is_split : bool array, (...)
        False if no real decomposition was found, so that some part is not simple. Always true in a definite metric.
    """

    parts: Floats
    squares: Floats
    is_split: NDArray[np.bool_]


def split_bivectors(coefficients: ArrayLike, n: int, gram: ArrayLike | None = None) -> BivectorParts:
    """Decompose bivectors into sums of commuting simple bivectors.

    In a Euclidean metric the parts are the planes of the eigenvectors of a skew-symmetric matrix, computed for the
    whole batch, also for equal rates. In other metrics they are the restrictions of the bivector to the invariant
    subspaces of ``x -> B . x``, one for each squared rate (the squares are those of Roelfs & De Keninck, *Graded
    symmetry groups*, 2021), in descending order, so that the last remainder may be null. Parts with equal rates are
    separated if the metric of their subspace is definite.

    Parameters
    ----------
    coefficients : array_like, (..., n (n - 1) / 2)
        Coefficients of ``e1^e2, e1^e3, e2^e3, e1^e4, ...``, ordered by bitmap.
    n : int
        Dimension, 2 to 30.
    gram : array_like, (n,) or (n, n), optional
        Squares, or all inner products, of the basis vectors. Euclidean by default. May be degenerate.

    Raises
    ------
    TypeError, ValueError
        If shapes are incompatible or numbers are not finite.
    """
    check_dimension(n, LARGEST)
    if n < 2:
        raise ValueError(f"n: {n}; expected 2 or more vectors, which have bivectors")
    count = n * (n - 1) // 2
    array = _finite(real_array(coefficients, "coefficients", (count,), f"bivectors of {n} vectors"), "coefficients")
    metric = gram_matrix(gram, n)
    # by bitmap: second vector ascending, first vector within
    column, row = np.tril_indices(n, -1)
    matrices = np.zeros((*array.shape[:-1], n, n))
    matrices[..., row, column] = array
    matrices -= np.swapaxes(matrices, -1, -2)
    if np.array_equal(metric, np.eye(n)):
        parts, is_split = _by_eigenvectors(matrices), np.ones(array.shape[:-1], bool)
    else:
        shape = array.shape[:-1]
        each = flat(matrices, shape, 2)
        parts, good = _by_polynomials(each, metric)
        for e in np.flatnonzero(~good):
            parts[e], good[e] = _by_subspaces(each[e], metric)
        parts, is_split = parts.reshape(*shape, n // 2, n, n), good.reshape(shape)
    maps = parts @ metric
    squares = np.einsum("...ij,...ji->...", maps, maps) / 2
    return BivectorParts(parts[..., row, column], squares, is_split)


def _by_eigenvectors(matrices: Floats) -> Floats:
    n = matrices.shape[-1]
    rates, vectors = np.linalg.eigh(1j * matrices)
    rates, vectors = rates[..., ::-1][..., : n // 2], vectors[..., ::-1][..., : n // 2]
    x, y = vectors.real, vectors.imag
    planes = np.einsum("...ik,...jk->...kij", y, x)
    rates = np.where(rates > EIGENVALUE * rates[..., :1], rates, 0.0)
    return np.asarray(2.0 * rates[..., None, None] * (planes - np.swapaxes(planes, -1, -2)))


def _by_polynomials(matrices: Floats, metric: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Split all bivectors by polynomials; return the parts and whether the split is accurate.

    It is accurate if the squared rates are real and well separated. The parts are polynomials of ``S**2`` times the
    bivector, where S is ``x -> B . x``. Each polynomial is 1 at one squared rate and has double roots at the others.
    The part of the smallest squared rate is the remainder, so that it may be null.
    """
    n, m = matrices.shape[-1], matrices.shape[-1] // 2
    maps = matrices @ metric
    squares = np.linalg.eigvals(maps) ** 2
    order = np.argsort(-np.abs(squares), axis=-1)
    # rates come in pairs of opposite sign, and in odd dimensions the smallest is 0
    rates = np.take_along_axis(squares, order, -1)[..., : 2 * m].reshape(-1, m, 2)
    size = np.maximum(np.abs(rates).max((-1, -2)), TINY)
    good = (np.abs(rates.imag).max((-1, -2)) < SINGLE * size) & (np.ptp(rates.real, axis=-1).max(-1) < SINGLE * size)
    mean = rates.real.mean(-1)
    parts = np.zeros((len(matrices), m, n, n))
    whole = maps @ maps
    identity = np.eye(n)
    for i in range(m - 1):
        product = matrices
        for j in [*(j for j in range(m) if j != i), *([None] if n % 2 else [])]:
            other = np.zeros(len(mean)) if j is None else mean[:, j]
            gap = mean[:, i] - other
            good &= np.abs(gap) > _APART * size
            factor = (whole - other[:, None, None] * identity) / np.where(good, gap, 1.0)[:, None, None]
            product = factor @ (factor @ product)
        parts[:, i] = (product - np.swapaxes(product, -1, -2)) / 2
    parts[:, m - 1] = matrices - parts.sum(1)
    lengths = np.linalg.svd(parts, compute_uv=False)
    norms = np.linalg.norm(matrices, axis=(-1, -2))
    return parts, good & (lengths[..., 2:].max((-1, -2), initial=0.0) <= ROUNDING * norms)


def _by_subspaces(matrix: Floats, metric: Floats) -> tuple[Floats, bool]:
    n = len(matrix)
    parts: list[Floats] = []
    rest, good = matrix, True
    size = float(np.linalg.norm(matrix))
    while np.linalg.norm(rest) > EIGENVALUE * size:
        simple = _is_simple(rest, ROUNDING * size)
        if simple or len(parts) == n // 2 - 1:
            good = good and simple
            parts.append(rest)
            break
        found, split = _largest(rest, metric)
        good = good and split
        parts += found
        rest = rest - sum(found)
    whole = np.zeros((max(n // 2, len(parts)), n, n))
    for k, part in enumerate(parts):
        whole[k] = part
    if len(parts) > n // 2:
        whole, good = whole[: n // 2], False
    return whole, good


def _largest(matrix: Floats, metric: Floats) -> tuple[list[Floats], bool]:
    """Return the parts that belong to the largest squared rate, and whether they are simple."""
    operator = matrix @ metric
    rates = np.linalg.eigvals(operator)
    squares = rates**2
    top = squares[int(np.argmax(np.abs(squares)))]
    norm = np.linalg.norm(operator, 2)
    if abs(top) <= (1e-4 * norm) ** 2:
        return [matrix], False  # nilpotent and not simple: there is no unique real decomposition
    near = SINGLE * abs(top)
    complex_pair = abs(top.imag) > near

    def chosen(real: float, imaginary: float) -> bool:
        square = complex(real, imaginary) ** 2
        return bool(min(abs(square - top), abs(square - np.conj(top))) <= near)

    triangle, basis, count = scipy.linalg.schur(operator, output="real", sort=chosen)
    projector = np.zeros_like(triangle)
    projector[:count, :count] = np.eye(count)
    if count < len(matrix):
        first, second = triangle[:count, :count], triangle[count:, count:]
        projector[:count, count:] = scipy.linalg.solve_sylvester(first, -second, triangle[:count, count:])
    part = basis @ projector @ basis.T @ matrix
    part = (part - part.T) / 2
    if count == 2 and not complex_pair:
        return [part], True
    if complex_pair:
        return [part], False
    return _of_equal_rates(part, basis[:, :count], metric)


def _of_equal_rates(part: Floats, subspace: Floats, metric: Floats) -> tuple[list[Floats], bool]:
    """Split a bivector with equal rates by orthonormal vectors of its subspace, if these exist."""
    inner = subspace.T @ metric @ subspace
    squares = np.linalg.eigvalsh(inner)
    if squares.min() * squares.max() <= 0:
        return [part], False
    sign = np.sign(squares[0])
    lower = scipy.linalg.cholesky(sign * inner, lower=True)
    plain = lower.T @ (subspace.T @ part @ subspace) @ lower
    back = scipy.linalg.solve_triangular(lower.T, np.eye(len(lower)), lower=False)
    split = _by_eigenvectors((plain - plain.T) / 2)
    return [subspace @ back @ one @ back.T @ subspace.T for one in split], True


def _is_simple(matrix: Floats, rounding: float) -> bool:
    lengths = np.linalg.svd(matrix, compute_uv=False)
    return len(lengths) < 4 or bool(lengths[2] <= NEGLIGIBLE * lengths[0] + rounding)
