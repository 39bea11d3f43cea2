"""Sums of products with weights by matrices over real or complex numbers that represent an algebra."""

from __future__ import annotations

from functools import cache

import numpy as np
import scipy

from .algebra import Algebra, Array
from .workspace import empty


class Spinors:
    """Products of sums by matrices over real or complex numbers that represent the algebra.

    The columns of the matrices of all elements are the rows of one matrix, (columns * batch, channels * d): first
    columns first, so that every column is a contiguous array of real numbers.
    """

    def __init__(self, algebra: Algebra, side: str, dtype: np.dtype) -> None:
        found = algebra.spinors
        if found is None:
            raise ValueError(f"{algebra} has no matrices of as many real numbers as blades")
        matrices = found if side == "left" else found.transpose(0, 2, 1)
        self.d, self.size, is_complex = matrices.shape[-1], len(matrices), np.iscomplexobj(matrices)

        def reals(numbers: Array) -> Array:
            """Let real and imaginary parts alternate."""
            parts = np.stack([numbers.real, numbers.imag], -1) if is_complex else numbers
            return np.ascontiguousarray(parts.reshape(self.size, -1), dtype)

        self.basis = reals(matrices.reshape(self.size, -1))
        self.columns = [reals(matrices[..., k]) for k in range(self.d)]
        self.number = np.result_type(dtype, np.complex64) if is_complex else np.dtype(dtype)
        self.kernels = algebra.column_kernels if side == "left" else None

    @classmethod
    @cache
    def of(cls, algebra: Algebra, side: str, dtype: np.dtype) -> Spinors:
        """Return the matrices of an algebra, which are computed once."""
        return cls(algebra, side, dtype)

    def weights(self, w: Array) -> Array:
        """Return (in * d, out * d) for weights (out, in, blades)."""
        out, inner, _ = w.shape
        matrices = (w @ self.basis).view(self.number).reshape(out, inner, self.d, self.d)
        return np.asarray(matrices.transpose(1, 3, 0, 2).reshape(inner * self.d, out * self.d))

    def weights_pull(self, rows: Array, cotangent: Array, out: int) -> Array:
        """Return the gradient with respect to the weights."""
        # BLAS conjugates without a copy, which `rows.conj().T @ cotangent` makes.
        (product,) = scipy.linalg.blas.get_blas_funcs(("gemm",), (rows, cotangent))
        flat = product(1 / self.d, cotangent.T, rows.T, trans_b=2).T.reshape(-1, self.d, out, self.d)
        found = np.ascontiguousarray(flat.transpose(2, 0, 3, 1)).reshape(out, len(flat), -1)
        return np.asarray(found.view(found.real.dtype) @ self.basis.T)

    def rows(self, x: Array, out: Array | None = None) -> Array:
        """Return the columns of the matrices of x (batch, channels, blades)."""
        batch, channels, _ = x.shape
        if out is None:
            found = empty((self.d, batch, channels, self.size // self.d), x.dtype)
        else:
            found = self.parts(out, batch)
        if self.kernels:
            self.kernels[0](x, out=(found[0], found[1]))
        else:
            flat = np.ascontiguousarray(x).reshape(-1, self.size)
            for k, table in enumerate(self.columns):
                np.matmul(flat, table, out=found[k].reshape(len(flat), -1))
        return found.view(self.number).reshape(self.d * batch, channels * self.d)

    def parts(self, rows: Array, batch: int) -> Array:
        """Return a view of rows as real numbers (columns, batch, channels, numbers)."""
        return rows.view(rows.real.dtype).reshape(self.d, batch, -1, self.size // self.d)

    def sums(self, rows: Array, channels: int) -> Array:
        """Return the sums over the batch (channels, blades) of the elements whose columns are given."""
        parts = rows.view(rows.real.dtype).reshape(self.d, len(rows) // self.d, -1)
        total = np.ones(parts.shape[1], parts.dtype) @ parts
        zero = np.zeros((channels, self.size), parts.dtype)
        found = self.elements(total.view(self.number).reshape(self.d, -1), channels, zero)[0]
        return np.asarray(found / parts.dtype.type(self.d))

    def elements(self, rows: Array, channels: int, offset: Array) -> Array:
        """Return d times the inverse of `rows`, its transpose, plus an offset for each channel."""
        batch = len(rows) // self.d
        parts = self.parts(rows, batch)
        if self.kernels:
            return np.asarray(self.kernels[1](*parts, offset, out=empty((batch, channels, self.size), parts.dtype)))
        flat = parts.reshape(self.d, batch * channels, -1)
        found = flat[0] @ self.columns[0].T
        for k in range(1, self.d):
            found += flat[k] @ self.columns[k].T
        found = found.reshape(batch, channels, self.size)
        found += offset
        return np.asarray(found)
