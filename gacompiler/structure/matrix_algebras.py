"""The matrix algebra of a geometric algebra: the classification of Cartan, Bott and Atiyah.

``G(p, q)`` is the algebra of square matrices over the real numbers R, the complex numbers C or the quaternions H, or of
pairs of these, as determined by ``p - q`` modulo 8 (Atiyah, Bott & Shapiro, *Topology* 3, 1964; Porteous, *Clifford
Algebras and the Classical Groups*, 1995, ch. 15; Lounesto, *Clifford Algebras and Spinors*, 2001, ch. 16).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from ..algebra.algebra import Algebra
from ..algebra.blades import Rational
from ..errors import AlgebraError

DIMENSIONS = {"R": 1, "C": 2, "H": 4}
"""Dimensions of the real and complex numbers and the quaternions over the reals."""
_BY_SIGNATURE = (("R", 1), ("R", 2), ("R", 1), ("C", 1), ("H", 1), ("H", 2), ("H", 1), ("C", 1))


@dataclass(frozen=True, slots=True)
class MatrixAlgebra:
    """Square matrices over a division algebra, or pairs of them, times a Grassmann algebra.

    Attributes
    ----------
    numbers : {"R", "C", "H"}
        Division algebra of the entries.
    size : int
        Number of rows of the matrices.
    halves : {1, 2}
        Two for pairs of matrices, which are multiplied separately.
    grassmann : int
        Number of vectors of the Grassmann algebra, the degenerate part.
    is_graded : bool
        Whether odd elements of the two factors anticommute. This makes a difference only for odd ``p + q`` with
        a degenerate part.
    """

    numbers: str
    size: int
    halves: int = 1
    grassmann: int = 0
    is_graded: bool = False

    @property
    def dimension(self) -> int:
        """The dimension over the real numbers."""
        return self.halves * self.size**2 * DIMENSIONS[self.numbers] << self.grassmann

    @property
    def real_size(self) -> int:
        """The size of one real matrix composed of the entries' parts, with pairs as diagonal blocks.

        It is the smallest faithful representation if the metric is not degenerate. A degenerate part multiplies it by
        ``2**grassmann``, as it acts on itself.
        """
        return self.halves * self.size * DIMENSIONS[self.numbers] << self.grassmann

    def __str__(self) -> str:
        """Return ``R(4)``, ``2H(2)``, ``C``; with a degenerate part ``H(2) ⊗ Λ(1)``, or with ``⊗̂`` if it is graded."""
        text = f"{self.halves if self.halves > 1 else ''}{self.numbers}{f'({self.size})' if self.size > 1 else ''}"
        if self.grassmann:
            text += f" {'⊗̂' if self.is_graded else '⊗'} Λ({self.grassmann})"
        return text


def matrix_algebra(p: int, q: int = 0, r: int = 0) -> MatrixAlgebra:
    """Return the matrix algebra that is isomorphic to ``G(p, q, r)``.

    Parameters
    ----------
    p, q, r : int
        Numbers of basis vectors with square +1, -1 and 0; nonnegative.

    Returns
    -------
    MatrixAlgebra
        For ``r = 0`` isomorphic as an algebra. With a degenerate part its tensor product with the Grassmann algebra of
        `r` vectors: the ordinary one for even ``p + q``, since then the null vectors times the pseudoscalar of the
        others commute with these, otherwise the graded one.

    Examples
    --------
    >>> print(matrix_algebra(4, 1), matrix_algebra(0, 3), matrix_algebra(3, 0, 1))
    C(4) 2H C(2) ⊗̂ Λ(1)
    """
    _check(p, q, r)
    numbers, halves = _BY_SIGNATURE[(p - q) % 8]
    rest = (1 << (p + q)) // (DIMENSIONS[numbers] * halves)
    return MatrixAlgebra(numbers, 1 << (rest.bit_length() // 2), halves, r, bool(r and (p + q) & 1))


def even_subalgebra(p: int, q: int = 0, r: int = 0) -> MatrixAlgebra:
    """Return the matrix algebra of the even elements of ``G(p, q, r)``.

    They are isomorphic to ``G(q, p - 1, r)`` and to ``G(p, q - 1, r)``, if these exist: products of all vectors with
    one invertible vector generate them (`gacompiler.structure.isomorphisms.even_isomorphism`).

    Raises
    ------
    AlgebraError
        For ``p = q = 0 < r``, where all vectors are null: half a Grassmann algebra, which is not a matrix algebra.
    """
    _check(p, q, r)
    if p:
        return matrix_algebra(q, p - 1, r)
    if q:
        return matrix_algebra(p, q - 1, r)
    if r:
        raise AlgebraError(
            f"even subalgebra of G(0, 0, {r})", "no vector that has an inverse", "p + q > 0", "it is Λ of even grades"
        )
    return matrix_algebra(0)


def complex_matrix_algebra(n: int) -> MatrixAlgebra:
    """Return the complex geometric algebra of `n` vectors, whatever the signature: ``C(k)`` or ``2C(k)``."""
    _check(n, 0, 0)
    return MatrixAlgebra("C", 1 << (n // 2), 1 + (n & 1))


def tensor_product(a: MatrixAlgebra, b: MatrixAlgebra) -> MatrixAlgebra:
    """Return the ordinary tensor product over the reals, in which the elements of both factors commute.

    ``K (x) R = K``, ``C (x) C = 2C``, ``C (x) H = C(2)``, ``H (x) H = R(4)``; sizes multiply.

    Raises
    ------
    AlgebraError
        For a graded factor, and for two complex factors one of which has two halves: these are four matrices.
    """
    if a.is_graded or b.is_graded:
        raise AlgebraError("tensor product", f"{a} and {b}", "factors without a graded part")
    numbers, size, halves = {
        "CC": ("C", 1, 2), "CH": ("C", 2, 1), "HC": ("C", 2, 1), "HH": ("R", 4, 1),
    }.get(a.numbers + b.numbers, (max(a.numbers, b.numbers, key=lambda name: DIMENSIONS[name]), 1, 1))  # fmt: skip
    halves *= a.halves * b.halves
    if halves > 2:
        raise AlgebraError("tensor product", f"{a} and {b}", "at most two halves in all")
    return MatrixAlgebra(numbers, size * a.size * b.size, halves, a.grassmann + b.grassmann)


def signature(algebra: Algebra) -> tuple[int, int, int]:
    """Return the numbers ``(p, q, r)`` of an algebra in any basis, exactly, from its Gram matrix (Sylvester's law)."""
    squares = orthogonal_basis(algebra.gram)[1]
    return sum(x > 0 for x in squares), sum(x < 0 for x in squares), sum(x == 0 for x in squares)


def orthogonal_basis(
    gram: Sequence[Sequence[Rational]],
) -> tuple[tuple[tuple[Fraction, ...], ...], tuple[Fraction, ...]]:
    """Return rational vectors, as rows, that are orthogonal under a Gram matrix, and their squares.

    Uses Lagrange reduction.
    """
    n = len(gram)
    rows = [[Fraction(int(i == j)) for j in range(n)] for i in range(n)]
    chosen: list[list[Fraction]] = []
    squares: list[Fraction] = []

    def inner(a: Sequence[Fraction], b: Sequence[Fraction]) -> Fraction:
        return sum((a[i] * gram[i][j] * b[j] for i in range(n) for j in range(n) if a[i] and b[j]), Fraction(0))

    while rows:
        pivot = next((k for k, row in enumerate(rows) if inner(row, row)), None)
        if pivot is None:
            pair = next(((i, j) for i in range(len(rows)) for j in range(i) if inner(rows[i], rows[j])), None)
            if pair is None:
                return tuple(map(tuple, [*chosen, *rows])), (*squares, *(Fraction(0) for _ in rows))
            pivot = pair[0]
            rows[pivot] = [x + y for x, y in zip(rows[pivot], rows[pair[1]], strict=True)]
        vector = rows.pop(pivot)
        square = inner(vector, vector)
        chosen.append(vector)
        squares.append(square)
        rows = [[x - inner(row, vector) / square * y for x, y in zip(row, vector, strict=True)] for row in rows]
    return tuple(map(tuple, chosen)), tuple(squares)


def without_grassmann(algebra: MatrixAlgebra) -> MatrixAlgebra:
    """The matrix factor alone."""
    return replace(algebra, grassmann=0, is_graded=False)


def _check(p: int, q: int, r: int) -> None:
    if min(p, q, r) < 0:
        raise AlgebraError(f"G({p}, {q}, {r})", "a negative number of vectors", "p, q and r of 0 or more")
