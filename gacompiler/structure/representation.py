"""Elements as matrices over the reals, the complex numbers or the quaternions, exactly.

The levels that `gacompiler.structure.levels` derives from the blades determine the place of every coefficient. The
real, complex or quaternion parts of the entries are stored along a last axis, so that integers and fractions are exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..algebra.algebra import Algebra
from ..algebra.blades import Rational
from ..algebra.catalog import orthogonal
from ..algebra.coefficients import is_exact, scale
from ..algebra.multivector import Multivector
from ..errors import AlgebraError
from .blocks import from_blocks, leaves, to_blocks
from .levels import HALVES, Level, tower
from .matrix_algebras import MatrixAlgebra, matrix_algebra, signature, without_grassmann

Matrices = NDArray[Any]
"""Shape (halves, size, size, parts); integers and fractions are Python objects (dtype object) and do not overflow."""

LARGEST_DIMENSION = 12
"""Largest dimension of an algebra for which matrices are computed."""


@dataclass(frozen=True, slots=True)
class Numbers:
    """The number system of the matrix entries: sums of units.

    Attributes
    ----------
    units : tuple of pairs
        Blade and sign of every unit: 1; 1 and i; 1, i, j and k with ``i j = k``; more with a degenerate part.
    names : tuple of str
    products : tuple of tuples
        ``products[a][b]`` are the pairs (unit, factor) of the product of the units `a` and `b`.
    """

    units: tuple[tuple[int, Rational], ...]
    names: tuple[str, ...]
    products: tuple[tuple[tuple[tuple[int, Rational], ...], ...], ...]


class Representation:
    """The matrices of an algebra.

    Parameters
    ----------
    algebra : Algebra
        With an orthogonal basis of squares +1, -1 and 0, or null pairs among them; up to 12 vectors.

    Attributes
    ----------
    algebra : Algebra
    kind : MatrixAlgebra
        The matrix algebra.
    numbers : Numbers
        The number system of the entries.

    Raises
    ------
    AlgebraError
        For a basis in which products of blades are not blades, and for other squares.

    Examples
    --------
    >>> from gacompiler.algebra.catalog import STA
    >>> print(Representation(STA).kind)
    H(2)
    """

    def __init__(self, algebra: Algebra) -> None:
        if algebra.dimension > LARGEST_DIMENSION:
            raise AlgebraError(
                f"matrices of {algebra.name}", f"{algebra.dimension} vectors", f"at most {LARGEST_DIMENSION}"
            )
        self.algebra = algebra
        self.kind: MatrixAlgebra = matrix_algebra(*signature(algebra))
        self._levels, rest = tower(algebra)
        self.numbers = _numbers(algebra, rest, without_grassmann(self.kind))
        self._place = {blade: (k, sign) for k, (blade, sign) in enumerate(self.numbers.units)}
        self._halves = 2 if any(level.kind is HALVES for level in self._levels) else 1
        self._size = 2 ** sum(level.kind is not HALVES for level in self._levels)
        if self._halves * self._size**2 * len(rest) != 1 << algebra.dimension:
            raise AlgebraError(f"matrices of {algebra.name}", "levels that do not fill the algebra")

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """The shape of the matrices of an element: halves, rows, columns, parts of an entry."""
        return self._halves, self._size, self._size, len(self.numbers.units)

    def matrix(self, x: Multivector) -> Matrices:
        """Return the matrices of an element, shape (halves, size, size, parts); exact if `x` is."""
        found = np.zeros(self.shape, dtype=object)
        for path, terms in leaves(to_blocks(self._levels, x.terms)):
            place = self._position(path)
            for blade, value in terms.items():
                unit, sign = self._place[blade]
                found[(*place, unit)] = scale(value, sign)
        return _narrowed(found)

    def element(self, matrices: Matrices) -> Multivector:
        """Return the element with given matrices: the inverse of `matrix`."""
        matrices = np.asarray(matrices)
        if matrices.shape != self.shape:
            raise AlgebraError(
                f"element of {self.algebra.name}", f"matrices of shape {matrices.shape}", f"shape {self.shape}"
            )
        blocks = self._blocks(self._levels, matrices.tolist(), ())
        values, scales = from_blocks(self._levels, blocks)
        return Multivector(self.algebra, {blade: scale(value, scales[blade]) for blade, value in values.items()})

    @cached_property
    def generators(self) -> tuple[Matrices, ...]:
        """The matrices of the basis vectors."""
        return tuple(self.matrix(vector) for vector in self.algebra.basis())

    def product(self, a: Matrices, b: Matrices) -> Matrices:
        """Return the product of matrices, with entries multiplied in their number system."""
        found = 0 * (a + b)
        for j, row in enumerate(self.numbers.products):
            for k, terms in enumerate(row):
                if terms:
                    part = a[..., j] @ b[..., k]
                    for unit, factor in terms:
                        found[..., unit] = found[..., unit] + factor * part
        return found

    @cached_property
    def one(self) -> Matrices:
        """The unit matrices."""
        return self.matrix(self.algebra.scalar(1))

    def real(self, matrices: Matrices) -> Matrices:
        """Return one real matrix: every entry as the matrix of its multiplication, pairs as diagonal blocks.

        Shape (size, size) with `MatrixAlgebra.real_size`: twice the rows for complex numbers, four times for
        quaternions.
        """
        halves, size, _, parts = self.shape
        found = np.zeros((halves, size, parts, halves, size, parts), dtype=matrices.dtype)
        for j, row in enumerate(self.numbers.products):
            for k, terms in enumerate(row):
                for unit, factor in terms:
                    for half in range(halves):
                        found[half, :, unit, half, :, k] += factor * matrices[half, :, :, j]
        return found.reshape(halves * size * parts, -1)

    def from_real(self, matrix: Matrices) -> Matrices:
        """Return the matrices with a given `real` matrix; redundant entries are read once."""
        halves, size, _, parts = self.shape
        blocks = np.asarray(matrix).reshape(halves, size, parts, halves, size, parts)
        return np.stack([blocks[half, :, :, half, :, 0].swapaxes(1, 2) for half in range(halves)])

    def complex(self, matrices: Matrices) -> NDArray[np.complex128]:
        """Return complex matrices, shape (halves, size, size), of twice that size for quaternions.

        ``1, i, j, k`` become ``1, i s3, i s2, i s1`` with Pauli matrices: exact for integers up to 2**53.

        Raises
        ------
        AlgebraError
            With a degenerate part, whose entries are not complex numbers.
        """
        parts = np.asarray(matrices, dtype=float)
        if self.kind.grassmann:
            raise AlgebraError(f"complex matrices of {self.algebra.name}", "a degenerate part", "r = 0", "use real()")
        found: NDArray[np.complex128]
        if self.kind.numbers != "H":
            found = (parts @ np.array([1, 1j][: parts.shape[-1]])).astype(complex)
            return found
        quaternions = np.array([[[1, 0], [0, 1]], [[1j, 0], [0, -1j]], [[0, 1], [-1, 0]], [[0, 1j], [1j, 0]]])
        halves, size, _, _ = self.shape
        found = np.einsum("hrcu,uab->hracb", parts, quaternions).reshape(halves, 2 * size, 2 * size)
        return found

    def _position(self, path: tuple[int, ...]) -> tuple[int, int, int]:
        half = row = column = 0
        for level, k in zip(self._levels, path, strict=True):
            if level.kind is HALVES:
                half = k
            else:
                row, column = 2 * row + k // 2, 2 * column + k % 2
        return half, row, column

    def _blocks(self, levels: tuple[Level, ...], values: Any, path: tuple[int, ...]) -> Any:
        if levels:
            return tuple(self._blocks(levels[1:], values, (*path, k)) for k in range(len(levels[0].kind.entries)))
        half, row, column = self._position(path)
        parts = values[half][row][column]
        units = self.numbers.units
        return {blade: scale(value, sign) for (blade, sign), value in zip(units, parts, strict=True) if value != 0}


@cache
def representation(algebra: Algebra) -> Representation:
    """Return the matrices of an algebra, computed once."""
    return Representation(algebra)


def complex_generators(n: int) -> NDArray[np.complex128]:
    """Return matrices of `n` vectors of square +1 that generate the complex geometric algebra.

    Shape (n, halves, size, size), with ``2**(n // 2)`` rows and two halves for odd `n`; entries 0, 1, -1, i and -i.
    They are the real matrices of G(k, k) or G(k + 1, k), times i for vectors of square -1.
    """
    if not 0 <= n <= LARGEST_DIMENSION:
        raise AlgebraError("complex_generators", f"{n} vectors", f"0 to {LARGEST_DIMENSION}")
    found = representation(orthogonal(n - n // 2, n // 2))
    if not n:
        return np.zeros((0, 1, 1, 1), dtype=complex)
    units = np.array([1] * (n - n // 2) + [1j] * (n // 2))
    return np.array([unit * found.complex(g) for unit, g in zip(units, found.generators, strict=True)])


def _narrowed(found: Matrices) -> Matrices:
    """Return NumPy numeric arrays if entries are floats or complex numbers; exact entries remain Python numbers."""
    if all(is_exact(value) for value in found.flat):
        return found
    return found.astype(complex if any(isinstance(value, complex) for value in found.flat) else float)


def _numbers(algebra: Algebra, rest: frozenset[int], kind: MatrixAlgebra) -> Numbers:
    """Return the blades that no level decomposes as units, 1 first; i, j, k with ``i j = k`` if these are all."""
    blades = sorted(rest, key=lambda blade: (blade.bit_count(), blade))
    squares = [algebra.blade_product(blade, blade).get(0, 0) for blade in blades]
    if any(abs(square) not in (0, 1) for square in squares) or any(
        len(algebra.blade_product(a, b)) > 1 for a in blades for b in blades
    ):
        raise AlgebraError(
            f"matrices of {algebra.name}",
            "basis vectors with unsupported squares or inner products",
            "squares +1, -1 and 0, orthogonal or in null pairs",
            "use orthogonal(p, q, r) with the numbers returned by signature()",
        )
    units: list[tuple[int, Rational]] = [(blade, 1) for blade in blades]
    names = [algebra.spelling(blade)[1] for blade in blades]
    if len(blades) == 4 and kind.numbers == "H":
        ((blade, sign),) = algebra.blade_product(blades[1], blades[2]).items()
        units[3] = blade, sign
    if squares in ([1], [1, -1], [1, -1, -1, -1]):
        names = ["1", "i", "j", "k"][: len(blades)]
    place = {blade: (k, sign) for k, (blade, sign) in enumerate(units)}
    products = tuple(
        tuple(
            tuple(
                (place[blade][0], place[blade][1] * factor * sign_a * sign_b)
                for blade, factor in algebra.blade_product(a, b).items()
            )
            for b, sign_b in units
        )
        for a, sign_a in units
    )
    return Numbers(tuple(units), tuple(names), products)
