"""Linear functions of vectors, extended to the whole algebra: outermorphisms, adjoints, determinants, inverses."""

from __future__ import annotations

from dataclasses import dataclass
from math import comb
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import real_array
from ..evidence import Status
from ..subspaces.blade import Blade, FactoredBlade, flat
from ..subspaces.gram import gram_matrix, is_degenerate
from . import minors

Floats = NDArray[np.float64]
_EXPANDED = 8
"""Number of vectors above which determinants are computed by elimination: expansion takes n 2**n products."""


class LinearStatus(Status):
    """Status of a linear function."""

    OK = 0
    SINGULAR = 1
    """The function is singular up to rounding: it has no inverse, and its rotation is not unique."""
    REPEATED = 2
    """Some eigenvalues or rates are equal: their blade is determined, the vectors in it are not."""
    DEFECTIVE = 3
    """Some equal eigenvalues have too few eigenvectors; their blade is still an eigenblade."""


@dataclass(frozen=True, slots=True, eq=False)
class LinearFunction:
    """Linear functions of vectors ``x -> matrix @ x``, extended to blades: ``f(a ^ b) = f(a) ^ f(b)``.

    Parameters
    ----------
    matrix : array_like, (..., m, n)
        Matrices from n to m vectors, each at most 12.

    Raises
    ------
    TypeError, ValueError
        If `matrix` is not a batch of finite real matrices of this size.
    """

    matrix: Floats

    def __init__(self, matrix: ArrayLike) -> None:
        array = finite_matrices(matrix)
        if max(array.shape[-2:]) > minors.LARGEST:
            raise ValueError(f"matrix: shape {array.shape}; expected at most {minors.LARGEST} rows and columns")
        object.__setattr__(self, "matrix", array)

    @property
    def shape(self) -> tuple[int, ...]:
        """The leading axes."""
        return self.matrix.shape[:-2]

    def __matmul__(self, other: LinearFunction) -> LinearFunction:
        """Return the composition that applies `other` first."""
        if not isinstance(other, LinearFunction):
            return NotImplemented
        if self.matrix.shape[-1] != other.matrix.shape[-2]:
            raise ValueError(
                f"@: a function of {self.matrix.shape[-1]} vectors after one to {other.matrix.shape[-2]}; "
                "expected as many"
            )
        return LinearFunction(self.matrix @ other.matrix)

    @overload
    def __call__(self, x: Blade) -> Blade: ...
    @overload
    def __call__(self, x: FactoredBlade) -> FactoredBlade: ...
    def __call__(self, x: Blade | FactoredBlade) -> Blade | FactoredBlade:
        """Apply the outermorphism to blades; leading axes broadcast.

        Raises
        ------
        TypeError, ValueError
            If `x` is not a blade of n vectors, or if it has more than m of them in factored form.
        """
        if not isinstance(x, (Blade, FactoredBlade)):
            raise TypeError(f"x: {type(x).__name__}; expected Blade or FactoredBlade")
        m, n = self.matrix.shape[-2:]
        if x.n != n:
            raise ValueError(f"x: a blade of {x.n} vectors; expected {n}")
        if isinstance(x, Blade):
            if x.grade > m:
                raise ValueError(f"x: grade {x.grade}; expected at most {m}, or its image is zero in every case")
            mapped = (self.outermorphism(x.grade) @ x.coefficients[..., None])[..., 0]
            return Blade(mapped, m, x.grade)
        made = FactoredBlade.of_vectors(x.vectors @ np.swapaxes(self.matrix, -1, -2))
        return FactoredBlade(made.vectors, made.scale * x.scale)

    def outermorphism(self, grade: int) -> Floats:
        """Return the matrix of the function on blades of a grade: its compound matrix, the minors of this order.

        Parameters
        ----------
        grade : int
            From 0 to the smaller of m and n.

        Returns
        -------
        array, (..., C(m, grade), C(n, grade))
            Matrix over basis blades ordered by bitmap, as in `subspaces.Blade`.

        Raises
        ------
        ValueError
            If the grade is out of range.
        """
        smaller = min(self.matrix.shape[-2:])
        if isinstance(grade, bool) or not isinstance(grade, (int, np.integer)) or not 0 <= grade <= smaller:
            raise ValueError(f"grade: {grade!r}; expected 0 to {smaller}")
        found = minors.compound(self._flat(), int(grade))
        return found.reshape(*self.shape, *found.shape[1:])

    def multivector(self, coefficients: ArrayLike) -> Floats:
        """Apply the outermorphism to arbitrary elements, grade by grade; scalars are unchanged.

        Parameters
        ----------
        coefficients : array_like, (..., 2**n)
            Coefficients by grade, each grade ordered by bitmap: the order of full layouts such as that of
            ``vga3.geometric_product``.

        Returns
        -------
        array, (..., 2**m)
        """
        m, n = self.matrix.shape[-2:]
        array = real_array(coefficients, "coefficients", (1 << n,), f"elements of {n} vectors")
        parts, start = [], 0
        batch = np.broadcast_shapes(self.shape, array.shape[:-1])
        for k in range(max(m, n) + 1):
            size = comb(n, k)
            if k > min(m, n):
                parts.append(np.zeros((*batch, comb(m, k))))
            else:
                part = (self.outermorphism(k) @ array[..., start : start + size, None])[..., 0]
                parts.append(np.broadcast_to(part, (*batch, comb(m, k))))
            start += size
        return np.concatenate(parts, -1)

    def adjoint(self, gram: ArrayLike | None = None) -> LinearFunction:
        """Return the adjoint, with ``a . f(b) = adjoint(a) . b``.

        Parameters
        ----------
        gram : array_like, (n,) or (n, n), optional
            Squares, or all inner products, of the basis vectors; the default is Euclidean.

        Raises
        ------
        TypeError, ValueError
            If `gram` has a wrong shape or is degenerate, or if the function is not square and `gram` is given.
        """
        transposed = np.swapaxes(self.matrix, -1, -2)
        if gram is None:
            return LinearFunction(transposed)
        metric = gram_matrix(gram, self._square("adjoint"))
        if is_degenerate(metric):
            raise ValueError("gram: some vector is orthogonal to all; expected a metric that is not degenerate")
        return LinearFunction(np.linalg.solve(metric, transposed @ metric))

    def determinant(self) -> Floats:
        """Return the determinant, ``(...)``: ``f(I) = det f I``, the outer product of the images of the basis vectors.

        For up to 8 vectors it is computed as this product, with errors of 1e-15 of the product of the lengths of rows;
        for more vectors, by elimination.
        """
        n = self._square("determinant")
        if n > _EXPANDED:
            return np.asarray(np.linalg.det(self.matrix))
        return np.asarray(self._last_minors().reshape(self.shape))

    def inverse(self) -> Inverse:
        """Return the inverse by the pseudoscalar: ``f^-1(a) = I adjoint(I^-1 a) / det f``.

        The matrix of a singular function is NaN. For ill-conditioned functions of many vectors elimination is more
        accurate: errors are those of minors, 1e-15 of the products of the lengths of rows.
        """
        self._square("inverse")
        found, determinant, singular = minors.inverses(self._flat())
        status = np.where(singular, LinearStatus.SINGULAR, LinearStatus.OK)
        return Inverse(found.reshape(self.matrix.shape), determinant.reshape(self.shape), status.reshape(self.shape))

    def inverse_outermorphism(self, grade: int) -> Floats:
        """Return the matrix of the inverse on blades of a grade, from complementary minors (Jacobi), without inversion.

        Returns
        -------
        array, (..., C(n, grade), C(n, grade))
            NaN for a singular function.
        """
        n = self._square("inverse_outermorphism")
        if isinstance(grade, bool) or not isinstance(grade, (int, np.integer)) or not 0 <= grade <= n:
            raise ValueError(f"grade: {grade!r}; expected 0 to {n}")
        # scale entries to about 1, so that products neither overflow nor underflow
        exponent = np.frexp(np.abs(self.matrix).max((-1, -2)))[1]
        unit = LinearFunction(np.ldexp(self.matrix, -exponent[..., None, None]))
        determinant, lengths = unit.determinant(), np.linalg.norm(unit.matrix, axis=-1)
        singular = np.abs(determinant) <= n * np.finfo(np.float64).eps * np.prod(lengths, axis=-1)
        found = minors.complementary(unit.outermorphism(n - grade), n, int(grade))
        found = found / np.where(singular, np.nan, determinant)[..., None, None]
        return np.asarray(np.ldexp(found, -int(grade) * exponent[..., None, None]))

    def _last_minors(self) -> Floats:
        """Return the outer products of the rows in turn: minors of the first rows only."""
        n = self.matrix.shape[-1]
        return minors.wedge_rows(self._flat(), n)

    def _flat(self) -> Floats:
        return flat(self.matrix, self.shape, 2)

    def _square(self, what: str) -> int:
        m, n = self.matrix.shape[-2:]
        if m != n:
            raise ValueError(f"{what}: a function from {n} to {m} vectors; expected as many")
        return int(n)


@dataclass(frozen=True, slots=True, eq=False)
class Inverse:
    """Inverses of linear functions.

    Attributes
    ----------
    matrix : array, (..., n, n)
        NaN if there is no inverse.
    determinant : array, (...)
        The determinant of the function, not of the inverse.
    status : int array, (...)
        `LinearStatus`: OK or SINGULAR.
    """

    matrix: Floats
    determinant: Floats
    status: NDArray[Any]


def finite_matrices(matrix: ArrayLike, square: bool = False) -> Floats:
    """Return a batch of matrices as float64 after validation.

    Raises
    ------
    TypeError, ValueError
        If `matrix` is not an array of matrices, if a number is not finite, or if it is not square although required.
    """
    array = real_array(matrix, "matrix", (-1, -1), "matrices").astype(np.float64, copy=False)
    if min(array.shape[-2:]) < 1 or (square and array.shape[-1] != array.shape[-2]):
        raise ValueError(
            f"matrix: shape {array.shape}; expected {'(..., n, n)' if square else '(..., m, n)'}, n from 1"
        )
    if not np.isfinite(array).all():
        at = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise ValueError(f"matrix: {array[at]} at {at}; expected finite numbers")
    return array
