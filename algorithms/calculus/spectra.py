"""Decompositions of linear functions: eigenblades, polar decomposition, spectra of symmetric and skew functions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ..precision import ROUNDING, SINGLE
from ..subspaces.blade import FactoredBlade, flat
from .linear_functions import LinearStatus, finite_matrices

Floats = NDArray[np.float64]
_SINGULAR = 1e-14
"""Stretches below this, relative to the largest one and for each vector, count as zero."""


@dataclass(frozen=True, slots=True, eq=False)
class Eigenblades:
    """Blades that linear functions only scale, ``f(A) = value A``, and whose outer product spans the whole space.

    Attributes
    ----------
    vectors : array, (..., n, n)
        Rows, sorted by group, orthonormal within a group; each group spans an eigenblade.
    group : int array, (..., n)
        The index of the blade of each row, from 0.
    eigenvalues : complex array, (..., n)
        Eigenvalues of the function on the subspace of the rows; the eigenvalue of a blade is their product. They are
        sorted by descending magnitude, those of symmetric functions in descending order.
    status : int array, (...)
        `LinearStatus`: OK if all eigenvalues differ, REPEATED, or DEFECTIVE.
    """

    vectors: Floats
    group: NDArray[np.int64]
    eigenvalues: NDArray[Any]
    status: NDArray[Any]

    def blades(self, index: tuple[int, ...] = ()) -> list[tuple[FactoredBlade, float]]:
        """Return the eigenblades of one function and their eigenvalues; grades are 1 or 2 if eigenvalues differ."""
        group = self.group[index]
        if group.ndim != 1:
            raise ValueError(f"index: {index}; expected one function of shape {self.group.shape[:-1]}")
        found = []
        for g in range(int(group[-1]) + 1):
            rows = group == g
            value = np.prod(self.eigenvalues[index][rows]).real
            found.append((FactoredBlade(self.vectors[index][rows]), float(value)))
        return found


@dataclass(frozen=True, slots=True, eq=False)
class Polar:
    """Polar decomposition of linear functions, a stretch followed by a rotation: ``f(x) = rotation stretch x``.

    Attributes
    ----------
    rotation : array, (..., n, n)
        Orthogonal, with a reflection if the determinant is negative; see `subspaces.reflections_of` for versors.
    stretch : array, (..., n, n)
        Symmetric positive semidefinite: the square root of ``adjoint f``.
    stretches : array, (..., n)
        The eigenvalues of `stretch`, descending.
    status : int array, (...)
        `LinearStatus`: OK, or SINGULAR if the rotation is not unique.
    """

    rotation: Floats
    stretch: Floats
    stretches: Floats
    status: NDArray[Any]


@dataclass(frozen=True, slots=True, eq=False)
class SkewPlanes:
    """Planes of skew functions: ``f(x) = x . B`` with the bivector ``B = sum rate_k u_k ^ v_k``.

    Attributes
    ----------
    rates : array, (..., n // 2)
        In descending order, padded with 0.
    planes : array, (..., n // 2, 2, n)
        ``u_k`` and ``v_k``, all of them orthonormal, including those of rate 0.
    axis : array, (..., n % 2, n)
        The remaining direction in odd dimensions.
    status : int array, (...)
        `LinearStatus`: OK; REPEATED if rates are equal; SINGULAR if some rate is 0.
    """

    rates: Floats
    planes: Floats
    axis: Floats
    status: NDArray[Any]


def eigenblades(matrix: ArrayLike, tolerance: float = SINGLE) -> Eigenblades:
    """Compute eigenblades of linear functions, one for each distinct real eigenvalue or pair of complex ones.

    All other eigenblades are outer products of these and, if eigenvalues are equal, of parts of them.

    Parameters
    ----------
    matrix : array_like, (..., n, n)
    tolerance : float
        Eigenvalues closer than this, relative to the norm of the function, form one blade. A k-fold eigenvalue with one
        eigenvector is uncertain by 1e-16 to the power 1/k.

    Raises
    ------
    TypeError, ValueError
        If `matrix` is not a batch of finite square matrices.

    Notes
    -----
    If eigenvalues differ, the blades come from eigenvectors; otherwise from ordered Schur forms of one function after
    the other. ``f(A) - value A`` is at most 1e-14 of ``|f|**grade`` if eigenvalues are at least 0.01 apart.
    """
    array = finite_matrices(matrix, square=True)
    shape, n = array.shape[:-2], array.shape[-1]
    each = flat(array, shape, 2)
    values, complex_vectors = np.linalg.eig(each)
    values, complex_vectors = values.astype(np.complex128), complex_vectors.astype(np.complex128)
    order = np.lexsort((-values.real, -np.abs(values)), axis=-1)
    values = np.take_along_axis(values, order, -1)
    complex_vectors = np.take_along_axis(complex_vectors, order[:, None, :], -1)
    norm = np.linalg.norm(each, axis=(-1, -2))
    gaps = np.abs(values[:, :, None] - values[:, None, :])
    gaps[:, np.arange(n), np.arange(n)] = np.inf
    plain = gaps.min((-1, -2), initial=np.inf) > tolerance * norm
    vectors, group = _of_eigenvectors(values, complex_vectors)
    status = np.full(len(each), int(LinearStatus.OK))
    for e in np.flatnonzero(~plain):
        vectors[e], group[e], values[e], status[e] = _of_schur(each[e], values[e], tolerance * norm[e])
    parts = (vectors.reshape(array.shape), group.reshape(*shape, n), values.reshape(*shape, n))
    return Eigenblades(*parts, status.reshape(shape))


def polar(matrix: ArrayLike) -> Polar:
    """Compute the polar decomposition of linear functions, a stretch followed by a rotation, by singular values.

    Parameters
    ----------
    matrix : array_like, (..., n, n)

    Raises
    ------
    TypeError, ValueError
        If `matrix` is not a batch of finite square matrices.
    """
    array = finite_matrices(matrix, square=True)
    left, stretches, right = np.linalg.svd(array)
    stretch = np.swapaxes(right, -1, -2) @ (stretches[..., None] * right)
    singular = stretches[..., -1] <= array.shape[-1] * _SINGULAR * stretches[..., 0]
    status = np.where(singular, LinearStatus.SINGULAR, LinearStatus.OK)
    return Polar(left @ right, (stretch + np.swapaxes(stretch, -1, -2)) / 2, stretches, status)


def symmetric_spectrum(matrix: ArrayLike, tolerance: float = SINGLE) -> Eigenblades:
    """Compute orthogonal eigenblades of symmetric functions: ``f(x) = sum eigenvalue_k P_k(x)``, with projections P_k.

    Parameters
    ----------
    matrix : array_like, (..., n, n)
        Symmetric to 1e-12 of its norm.
    tolerance : float
        Eigenvalues closer than this, relative to the norm of the function, form one blade.

    Raises
    ------
    TypeError, ValueError
        If `matrix` is not a batch of finite symmetric matrices.
    """
    array = _with_symmetry(matrix, 1.0, "symmetric")
    n = array.shape[-1]
    values, columns = np.linalg.eigh(array)
    values, rows = values[..., ::-1], np.swapaxes(columns[..., ::-1], -1, -2)
    near = -np.diff(values, axis=-1) <= tolerance * np.linalg.norm(array, axis=(-1, -2))[..., None]
    group = np.concatenate([np.zeros((*values.shape[:-1], 1), np.int64), np.cumsum(~near, -1)], -1)
    status = np.where(near.any(-1) if n > 1 else False, LinearStatus.REPEATED, LinearStatus.OK)
    return Eigenblades(rows, group, values.astype(np.complex128), np.broadcast_to(status, values.shape[:-1]))


def skew_planes(matrix: ArrayLike, tolerance: float = SINGLE) -> SkewPlanes:
    """Compute orthogonal planes of skew functions: the canonical form ``f(x) = x . B`` of their bivector.

    Parameters
    ----------
    matrix : array_like, (..., n, n)
        Skew to 1e-12 of its norm, with n at least 2.
    tolerance : float
        Rates that differ by less than this, relative to the norm, count as equal; planes are orthonormal in any case.

    Raises
    ------
    TypeError, ValueError
        If `matrix` is not a batch of finite skew matrices.

    Notes
    -----
    Rates below 1e-14 of the norm, times the number of vectors, are 0. The bivector of the function has the coefficient
    ``matrix[j, i]`` at ``e_i ^ e_j``.
    """
    array = _with_symmetry(matrix, -1.0, "skew")
    shape, n = array.shape[:-2], array.shape[-1]
    if n < 2:
        raise ValueError("matrix: one vector; expected 2 or more, which have planes")
    half = n // 2
    each = flat(array, shape, 2)
    rates, columns = np.linalg.eigh(1j * each)
    rates, columns = rates[:, ::-1][:, :half], np.swapaxes(columns[:, :, ::-1][:, :, :half], -1, -2)
    norm = np.linalg.norm(each, axis=(-1, -2))
    rates = np.where(rates > n * _SINGULAR * norm[:, None], rates, 0.0)
    rows = np.stack([columns.real, columns.imag], 2).reshape(len(each), 2 * half, n)
    rows *= np.repeat(rates > 0, 2, axis=-1)[..., None] * np.sqrt(2.0)
    # for zero rows, the factorisation completes the basis
    q, r = np.linalg.qr(np.swapaxes(rows, -1, -2), mode="complete")
    sign = np.where(np.diagonal(r, axis1=-2, axis2=-1) < 0, -1.0, 1.0)
    basis = np.swapaxes(q, -1, -2)
    basis[:, : 2 * half] *= sign[..., None]
    scale = np.maximum(norm, np.finfo(np.float64).tiny)[:, None]
    repeated = ((-np.diff(rates, axis=-1) <= tolerance * scale) & (rates[:, 1:] > 0)).any(-1)
    status = np.where(repeated, LinearStatus.REPEATED, LinearStatus.OK)
    status = np.where((rates == 0).any(-1), LinearStatus.SINGULAR, status)
    planes = basis[:, : 2 * half].reshape(*shape, half, 2, n)
    return SkewPlanes(
        rates.reshape(*shape, half), planes, basis[:, 2 * half :].reshape(*shape, n % 2, n), status.reshape(shape)
    )


def _with_symmetry(matrix: ArrayLike, sign: float, word: str) -> Floats:
    array = finite_matrices(matrix, square=True)
    other = sign * np.swapaxes(array, -1, -2)
    size, off = np.linalg.norm(array, axis=(-1, -2)), np.linalg.norm(array - other, axis=(-1, -2))
    if not (off <= ROUNDING * size).all():
        worst = float((off / np.where(size > 0, size, 1.0)).max())
        raise ValueError(f"matrix: not {word}, by {worst:.2g} of its norm; expected at most {ROUNDING:g}")
    return np.asarray((array + other) / 2)


def _of_eigenvectors(values: NDArray[Any], vectors: NDArray[Any]) -> tuple[Floats, NDArray[np.int64]]:
    """Return rows and groups for distinct eigenvalues, with complex ones in adjacent pairs."""
    count, n = values.shape
    is_second = np.zeros((count, n), np.bool_)
    for k in range(1, n):
        pair = (values[:, k].imag != 0) & (values[:, k] == np.conj(values[:, k - 1])) & ~is_second[:, k - 1]
        is_second[:, k] = pair
    rows = np.swapaxes(np.where(is_second[:, None, :], vectors.imag, vectors.real), -1, -2)
    first = np.concatenate([rows[:, :1], rows[:, :-1]], 1)
    first = first / np.linalg.norm(first, axis=-1, keepdims=True).clip(np.finfo(np.float64).tiny)
    along = (rows * first).sum(-1, keepdims=True)
    rows = np.where(is_second[..., None], rows - along * first, rows)
    rows = rows / np.linalg.norm(rows, axis=-1, keepdims=True).clip(np.finfo(np.float64).tiny)
    return rows, np.cumsum(~is_second, -1) - 1


def _of_schur(matrix: Floats, values: NDArray[Any], near: float) -> tuple[Floats, NDArray[np.int64], NDArray[Any], int]:
    """Return rows, groups, eigenvalues and status of one function, with a subspace for each cluster of eigenvalues."""
    n = len(matrix)
    # map to the upper half plane, so that conjugate pairs coincide
    places = values.real + 1j * np.abs(values.imag)
    cluster = np.arange(n)
    for i in range(n):
        for j in range(i):
            if min(abs(places[i] - places[j]), abs(places[i] - np.conj(places[j]))) <= near:
                cluster[cluster == cluster[i]] = cluster[j]
    rows, group, found, status = [], [], [], int(LinearStatus.OK)
    for g, first in enumerate(dict.fromkeys(cluster.tolist())):
        members = places[cluster == first]

        def chosen(real: float, imaginary: float) -> bool:
            distance = np.abs(places - complex(real, abs(imaginary)))
            return bool(cluster[int(np.argmin(distance))] == first)  # noqa: B023

        triangle, basis, count = scipy.linalg.schur(matrix, output="real", sort=chosen)
        inner = triangle[:count, :count]
        centre = members.mean()
        # a pair closer to each other than this merges with itself, and with nearby real eigenvalues
        is_pair = members.imag.min() > near / 2
        if count > (2 if is_pair else 1):
            rest = inner - centre.real * np.eye(count)
            rest = rest @ rest + centre.imag**2 * np.eye(count) if is_pair else rest
            size = near * (2 * abs(centre) if is_pair else 1.0)
            defective = np.linalg.norm(rest) > count * size
            status = max(status, int(LinearStatus.DEFECTIVE if defective else LinearStatus.REPEATED))
        rows.append(basis[:, :count].T)
        group += [g] * count
        found += [centre if is_pair else centre.real] * (count // 2 if is_pair else count)
        found += [np.conj(centre)] * (count // 2) if is_pair else []
    return np.concatenate(rows), np.array(group), np.array(found, np.complex128), status
