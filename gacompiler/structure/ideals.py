"""The centre, idempotents and minimal left ideals of an algebra, the spaces of spinors.

A primitive idempotent is a product of factors ``(1 + g) / 2`` of commuting blades ``g`` that square to 1 (Lounesto
2001, ch. 17). Its left ideal is a column of the matrices, so the algebra acts on it as on columns of numbers.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..algebra.algebra import Algebra
from ..algebra.blades import exact
from ..algebra.multivector import Multivector
from ..errors import AlgebraError
from .matrix_algebras import orthogonal_basis
from .representation import Representation


def centre(algebra: Algebra) -> tuple[Multivector, ...]:
    """Return a basis of the elements that commute with all: 1, and the pseudoscalar for an odd number of vectors.

    In a degenerate metric the centre also contains the even blades of the vectors orthogonal to all vectors. The result
    is exact, in any basis.
    """
    rows, squares = orthogonal_basis(algebra.gram)
    vectors = [Multivector(algebra, {1 << k: x for k, x in enumerate(row)}) for row in rows]
    null = [k for k, square in enumerate(squares) if not square]
    others = [k for k, square in enumerate(squares) if square]
    found = []
    for chosen in range(1 << len(null)):
        blade = algebra.scalar(1)
        part = [k for bit, k in enumerate(null) if chosen >> bit & 1]
        if not len(part) & 1:
            found.append(_product(blade, vectors, part))
        if (len(others) + len(part)) & 1 and len(part) == len(null):
            found.append(_product(blade, vectors, [*others, *part]))
    found = [element.map(exact) for element in found]
    return tuple(sorted(found, key=lambda element: (max(element.grades), min(element.terms))))


def _product(start: Multivector, vectors: list[Multivector], chosen: list[int]) -> Multivector:
    for k in chosen:
        start = start * vectors[k]
    return start


def primitive_idempotents(representation: Representation) -> tuple[Multivector, ...]:
    """Return idempotents that annihilate each other, sum to 1 and are not sums of others: the diagonal unit matrices.

    They are exact. With a graded degenerate part of pairs of matrices (``2K`` with p + q odd) each is split once more
    by the blade that squares to 1 and that no level could use.
    """
    halves, size, _, _ = representation.shape
    found = []
    for half in range(halves):
        for k in range(size):
            matrices = np.zeros(representation.shape, dtype=object)
            matrices[half, k, k, 0] = 1
            found.append(representation.element(matrices))
    root = _root_of_one(representation)
    if root is None:
        return tuple(found)
    half_of = Fraction(1, 2)
    return tuple(f * ((1 + sign * root) * half_of) for f in found for sign in (1, -1))


def idempotent_factors(idempotent: Multivector) -> tuple[Multivector, ...]:
    """Return commuting blades ``g`` with signs such that an idempotent is the product of all ``(1 + g) / 2``.

    Raises
    ------
    AlgebraError
        For an element that is not such a product, such as idempotents in null bases.
    """
    product, factors = idempotent.lift(1), []
    for blade in sorted(idempotent.terms, key=lambda blade: (blade.bit_count(), blade)):
        if blade and blade not in product.terms:
            factors.append(Multivector(idempotent.algebra, {blade: 1 if idempotent.terms[blade] > 0 else -1}))
            product = product * ((1 + factors[-1]) * Fraction(1, 2))
    if product != idempotent:
        raise AlgebraError(
            "idempotent_factors", f"{idempotent}", "a product of factors (1 + g) / 2 of commuting blades"
        )
    return tuple(factors)


def _root_of_one(representation: Representation) -> Multivector | None:
    """Return a blade among the units of the entries that squares to 1."""
    algebra = representation.algebra
    for blade, _ in representation.numbers.units[1:]:
        if algebra.blade_product(blade, blade) == {0: 1}:
            return Multivector(algebra, {blade: 1})
    return None


class LeftIdeal:
    """The minimal left ideal of a primitive idempotent: spinors as elements of the algebra.

    Parameters
    ----------
    representation : Representation
    column : int
        Number of the idempotent, columns of the first half first.

    Attributes
    ----------
    representation : Representation
    idempotent : Multivector
    basis : tuple of Multivector
        Basis of the ideal over the reals: of the column, entry by entry and unit by unit.

    Raises
    ------
    AlgebraError
        For a column that does not exist, and with a degenerate part, for which columns are not minimal.
    """

    def __init__(self, representation: Representation, column: int = 0) -> None:
        halves, size, _, parts = representation.shape
        if representation.kind.grassmann:
            raise AlgebraError(
                f"left ideal of {representation.algebra.name}", "a degenerate part", "a metric without null directions"
            )
        if not 0 <= column < halves * size:
            raise AlgebraError(
                f"left ideal of {representation.algebra.name}", f"column {column}", f"0 to {halves * size - 1}"
            )
        self.representation = representation
        self.idempotent = primitive_idempotents(representation)[column]
        self._half, self._column = divmod(column, size)
        units = np.eye(size * parts, dtype=int).astype(object).reshape(-1, size, parts)
        self.basis = tuple(self.spinor(unit) for unit in units)

    def spinor(self, column: NDArray[Any]) -> Multivector:
        """Return the element of the ideal with a column of numbers, shape (size, parts)."""
        matrices = np.zeros(self.representation.shape, dtype=np.asarray(column).dtype)
        matrices[self._half, :, self._column] = column
        return self.representation.element(matrices)

    def column(self, spinor: Multivector) -> NDArray[Any]:
        """Return the column of numbers, shape (size, parts), of an element of the ideal.

        Raises
        ------
        AlgebraError
            For an element that is not in the ideal.
        """
        matrices = self.representation.matrix(spinor)
        column = matrices[self._half, :, self._column].copy()
        matrices[self._half, :, self._column] = 0
        if np.any(matrices != 0):
            raise AlgebraError(
                f"column of a spinor of {self.representation.algebra.name}",
                "an element outside the ideal",
                "x with x f = x, f the idempotent",
                "multiply it by the idempotent from the right",
            )
        found: NDArray[Any] = column
        return found
