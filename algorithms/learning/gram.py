"""Rows of Gram matrices of multivectors, kept in a cache that all components share."""

from __future__ import annotations

from collections import OrderedDict

import numpy as np
import scipy
from numpy.typing import NDArray

from .blade_signs import Integers, Signs
from .svm_kernels import Floats, Kernel

_DENSE = 600
"""Size of a matrix up to which all of its eigenvalues are computed."""
_ROUNDING = 1e-9
"""Negative eigenvalues that are due to rounding, relative to the greatest diagonal element."""


class GramRows:
    """Rows of the kernel, one for each sample, as multivectors.

    If all rows fit into the cache, they are computed at once. Otherwise the least recently used rows are replaced.

    Parameters
    ----------
    kernel : Kernel
    samples : array, (n, ...)
    cache_size : float
        In megabytes.
    """

    def __init__(self, kernel: Kernel, samples: Floats, cache_size: float) -> None:
        self.kernel, self.samples = kernel, samples
        first = kernel.values(samples[:1], samples)
        self.size = first.shape[1]
        self.capacity = max(2, int(cache_size * 1e6 / first[0].nbytes))
        self.rows_computed = 0
        self._all: Floats | None = None
        self._kept: OrderedDict[int, Floats] = OrderedDict()
        if self.capacity >= len(samples):
            self._all = kernel.values(samples, samples)
            self.rows_computed = len(samples)

    def __len__(self) -> int:
        return len(self.samples)

    @property
    def is_complete(self) -> bool:
        """Whether all rows are kept."""
        return self._all is not None

    def row(self, i: int) -> Floats:
        """Return the row ``K(x_i, x_k)`` as an array (size, n)."""
        if self._all is not None:
            return np.asarray(self._all[i])
        found = self._kept.get(i)
        if found is None:
            if len(self._kept) >= self.capacity:
                self._kept.popitem(last=False)
            found = self._kept[i] = self.kernel.values(self.samples[i : i + 1], self.samples)[0]
            self.rows_computed += 1
        else:
            self._kept.move_to_end(i)
        return found

    def block(self, rows: NDArray[np.intp]) -> Floats:
        """Return rows as an array (rows, size, n)."""
        if self._all is not None:
            return self._all[rows]
        return np.asarray(self.kernel.values(self.samples[rows], self.samples))

    def square(self, rows: NDArray[np.intp]) -> Floats:
        """Return the part (rows, size, rows) of some samples, whose indices ascend."""
        if self._all is None or len(rows) == len(self):
            return self.block(rows)[:, :, rows] if self._all is None else self._all
        return np.asarray(self._all.take(rows, 0).take(rows, 2))

    def image(self, signed: Floats, signs: Signs) -> Floats:
        """Return the products of the Gram matrix with variables of components (m, n), a block of rows at a time."""
        if self._all is not None and self.size == 1:
            return np.asarray(signed @ self._all[:, 0])
        used = np.flatnonzero(signed.any(0))
        found = np.zeros(signed.shape)
        blade, sign = signs.pairs(len(signed))
        span = max(1, int(3e7 // max(1, self.size * len(self) * 8)))
        for start in range(0, len(used), span):
            rows = used[start : start + span]
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


def check_definite(rows: GramRows, m: int, signs: Signs) -> None:
    """Raise an error if the Gram matrix of samples and components has a negative eigenvalue.

    Raises
    ------
    ValueError
        With the smallest eigenvalue, or if the matrix is not symmetric.
    """
    block = rows.block(np.arange(len(rows)))
    matrix = expanded(block, 1 if rows.size == 1 else m, signs)
    largest = max(float(np.abs(matrix).max()), np.finfo(float).tiny)
    if not np.isfinite(largest):
        raise ValueError("kernel: its values are not finite; expected finite numbers; scale the features")
    if np.abs(matrix - matrix.T).max() > 1e-8 * largest:
        raise ValueError("kernel: K(y, x) is not the reverse of K(x, y); expected a symmetric Gram matrix")
    floor = _ROUNDING * largest * len(matrix)
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
