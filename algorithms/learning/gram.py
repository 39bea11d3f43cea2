"""Rows of Gram matrices of multivectors, which all components share."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from ..precision import NEGLIGIBLE, SINGLE
from .blade_signs import Integers, Signs
from .svm_kernels import Floats, Kernel

_DENSE = 600
"""Size of a matrix up to which all of its eigenvalues are computed."""
_BLOCK = 4e6
"""Bytes of the rows that are computed at a time."""
_FEW = 3
"""The number of times that a number is moved when some rows are copied and multiplied."""
Samples = NDArray[np.intp]


LANES = 16
"""Number of samples in a block, a multiple of the widths of vectors."""


def in_blocks(rows: Floats) -> Floats:
    """Return arrays (..., n) as (..., blocks, lanes), with zeros behind the last samples."""
    n = rows.shape[-1]
    found = np.zeros((*rows.shape[:-1], -(-n // LANES) * LANES))
    found[..., :n] = rows
    return found.reshape(*rows.shape[:-1], -1, LANES)


class GramRows:
    """Rows of the kernel, one for each sample, which are computed when they are first needed, and kept.

    If the memory is full, rows that the present request does not need are replaced.

    Parameters
    ----------
    kernel : Kernel
    samples : array, (n, ...)
    cache_size : float
        In megabytes.

    Attributes
    ----------
    diagonal : array, (n,)
        The scalar parts of ``K(x, x)``.
    size : int
        The number of coefficients of a kernel.
    most_together : int
        The number of samples whose Gram matrix, or whose rows, fit into the memory.
    """

    def __init__(self, kernel: Kernel, samples: Floats, cache_size: float) -> None:
        self.kernel, self.samples = kernel, samples
        self.size = kernel.values(samples[:1], samples[:1]).shape[1]
        self.diagonal = kernel.diagonal(samples)
        n, numbers = len(samples), cache_size * 1e6 / 8 / self.size
        self._span = max(1, int(_BLOCK // (8 * self.size * n)))
        capacity = min(n, max(2, int(numbers // n)))
        self.most_together = min(n, max(capacity, int(np.sqrt(numbers))))
        self._kept = np.empty((capacity, self.size, -(-n // LANES) * LANES))
        self._owner = np.full(capacity, -1)
        self._place = np.full(n, -1)

    def __len__(self) -> int:
        return len(self.samples)

    def block(self, rows: Samples) -> Floats:
        """Return rows as an array (rows, size, n)."""
        if len(rows) > len(self._kept):
            return self.kernel.values(self.samples[rows], self.samples)
        self._keep(rows)
        return np.asarray(self._kept[self._place[rows]][:, :, : len(self)])

    def _keep(self, rows: Samples) -> None:
        """Compute the rows that are missing."""
        missing = rows[self._place[rows] < 0]
        free = np.flatnonzero(self._owner < 0)
        if len(free) < len(missing):
            other = np.flatnonzero((self._owner >= 0) & ~np.isin(self._owner, rows))
            self._place[self._owner[other]] = -1
            self._owner[other] = -1
            free = np.flatnonzero(self._owner < 0)
        free = free[: len(missing)]
        self._place[missing], self._owner[free] = free, missing
        if len(free) and free[-1] - free[0] == len(free) - 1:
            found = self._kept[free[0] : free[-1] + 1]
            found[:, :, len(self) :] = 0
            self.kernel.fill(self.samples[missing], self.samples, found[:, :, : len(self)])
            return
        for start in range(0, len(missing), self._span):
            own, place = missing[start : start + self._span], free[start : start + self._span]
            self._kept[place, :, len(self) :] = 0
            self._kept[place, :, : len(self)] = self.kernel.values(self.samples[own], self.samples)

    def square(self, rows: Samples) -> Floats:
        """Return the part (rows, size, rows) of some samples, whose indices ascend."""
        if len(rows) > len(self._kept):
            return self.kernel.values(self.samples[rows], self.samples[rows])
        blocks = self.blocks(rows)
        return np.asarray(blocks.reshape(*blocks.shape[:2], -1)[:, :, : len(rows)])

    def blocks(self, rows: Samples) -> Floats:
        """Return the Gram matrix of some samples, whose indices ascend, in blocks (rows, size, blocks, lanes)."""
        if len(rows) > len(self._kept):
            return in_blocks(self.square(rows))
        self._keep(rows)
        place = self._place[rows]
        if len(rows) == len(self) and (place == np.arange(len(self))).all():
            return self._kept.reshape(*self._kept.shape[:2], -1, LANES)
        found = np.zeros((len(rows), self.size, -(-len(rows) // LANES) * LANES))
        for start in range(0, len(rows), LANES):
            own = slice(start, start + LANES)
            found[own, :, : len(rows)] = self._kept[place[own]].take(rows, 2)
        return found.reshape(len(rows), self.size, -1, LANES)

    def image(self, signed: Floats, signs: Signs) -> Floats:
        """Return the products of the Gram matrix with variables of components (m, n), a block of rows at a time."""
        used = np.flatnonzero(signed.any(0))
        if self.kernel.is_linear:
            return np.asarray((signed[:, used] @ self.samples[used]) @ self.samples.T)
        found = np.zeros(signed.shape)
        blade, sign = signs.pairs(len(signed))
        if len(used) <= len(self._kept):
            self._keep(used)
            last = int(self._place[used].max(initial=-1)) + 1
            if _FEW * len(used) > last:
                # Reading all rows takes less time than a copy of some.
                by_place = np.zeros((len(signed), last))
                by_place[:, self._place[used]] = signed[:, used]
                return _image(self._kept[:last, :, : len(self)], by_place, blade, sign)
        for start in range(0, len(used), self._span):
            rows = used[start : start + self._span]
            found += _image(self.block(rows), signed[:, rows], blade, sign)
        return found


def _image(block: Floats, signed: Floats, blade: Integers, sign: Integers) -> Floats:
    """Multiply rows ``K(x_k, x_i)`` by variables of the samples k: ``K(x_i, x_k)`` follows by reversion."""
    if block.shape[1] == 1:
        return np.asarray(signed @ block[:, 0])
    found = np.zeros((len(signed), block.shape[2]))
    for j in range(len(signed)):
        for k in range(len(signed)):
            # <e_j K(x_i, x_k) e_k^+> = <e_k K(x_k, x_i) e_j^+>
            found[j] += sign[k, j] * (signed[k] @ block[:, blade[k, j]])
    return found


def expanded(block: Floats, m: int, signs: Signs) -> Floats:
    """Return ``<e_j K(x_i, x_k) e_l^+>`` as a matrix, component-major on both sides, of kernels (n, size, k)."""
    if block.shape[1] == 1:
        return np.asarray(np.kron(np.eye(m), block[:, 0]))
    blade, sign = signs.pairs(m)
    found = block[:, blade] * sign[:, :, None]
    return np.asarray(found.transpose(1, 0, 2, 3).reshape(m * len(block), m * block.shape[2]))


def check_finite(values: Floats) -> None:
    """Raise an error if values of a kernel are not finite.

    Raises
    ------
    ValueError
        If a value is NaN or infinite.
    """
    if not np.isfinite(values).all():
        raise ValueError("kernel: its values are not finite; expected finite numbers; scale the features")


def check_definite(rows: GramRows, m: int, signs: Signs) -> None:
    """Raise an error if the Gram matrix of samples and components has a negative eigenvalue.

    Numbers that single precision holds are those of a kernel that was computed in it, and has its rounding errors.

    Raises
    ------
    ValueError
        With the smallest eigenvalue, or if the matrix is not symmetric or not finite.
    """
    block = rows.block(np.arange(len(rows)))
    check_finite(block)
    matrix = expanded(block, 1 if rows.size == 1 else m, signs)
    largest = max(float(np.abs(matrix).max()), np.finfo(float).tiny)
    with np.errstate(over="ignore"):
        is_single = np.array_equal(matrix, matrix.astype(np.float32))
    rounding = SINGLE if is_single else NEGLIGIBLE
    if np.abs(matrix - matrix.T).max() > max(1e-8, rounding) * largest:
        raise ValueError("kernel: K(y, x) is not the reverse of K(x, y); expected a symmetric Gram matrix")
    floor = rounding * largest * len(matrix)
    try:
        scipy.linalg.cholesky(matrix + floor * np.eye(len(matrix)), lower=True, check_finite=False)
    except scipy.linalg.LinAlgError:
        smallest = smallest_eigenvalue(matrix)
        if smallest < -floor:
            raise ValueError(
                f"kernel: not positive definite on these samples, smallest eigenvalue {smallest:.3g}; "
                "choose another kernel, degree or coef0"
            ) from None


def smallest_eigenvalue(matrix: Floats) -> float:
    """Return the smallest eigenvalue of a symmetric matrix."""
    if len(matrix) <= _DENSE:
        return float(scipy.linalg.eigvalsh(matrix, subset_by_index=[0, 0])[0])
    operator = scipy.sparse.linalg.LinearOperator(matrix.shape, lambda x: matrix @ x, dtype=np.float64)
    start = np.random.default_rng(0).normal(size=len(matrix))
    return float(scipy.sparse.linalg.eigsh(operator, 1, which="SA", v0=start, tol=1e-6)[0][0])
