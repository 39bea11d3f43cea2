"""Lie algebras of bivectors: closed under the commutator product, with structure constants and Killing form.

The bracket is the commutator product ``A x B = (A B - B A) / 2``, so that ``v -> A x v`` is a representation. It is
half of the commutator, in accordance with the half angles of rotors (Doran, Hestenes, Sommen & Van Acker, *J. Math.
Phys.* 34, 1993). All results are exact over the rationals.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..algebra.algebra import Algebra
from ..algebra.blades import exact
from ..algebra.multivector import Multivector, sum_of
from ..algebra.versors import commutator
from ..errors import AlgebraError
from .matrix_algebras import orthogonal_basis

Exact = NDArray[Any]
"""Arrays of dtype object: Python's integers and fractions."""


@dataclass(frozen=True)
class LieAlgebra:
    """A space of elements that is closed under the commutator product.

    Attributes
    ----------
    algebra : Algebra
        The algebra of the elements.
    basis : tuple of Multivector
        Linearly independent, with rational coefficients.

    Raises
    ------
    AlgebraError
        For a basis that is linearly dependent, or does not span its brackets.
    """

    algebra: Algebra
    basis: tuple[Multivector, ...]

    def __post_init__(self) -> None:
        if _rank(self._rows) < len(self.basis):
            raise AlgebraError(f"Lie algebra in {self.algebra.name}", "linearly dependent elements", "a basis")
        self.structure_constants  # noqa: B018 - raises an error if brackets are outside the space

    @property
    def dimension(self) -> int:
        """Number of generators."""
        return len(self.basis)

    @cached_property
    def _blades(self) -> tuple[int, ...]:
        return tuple(sorted({blade for x in self.basis for blade in x.terms}))

    @cached_property
    def _rows(self) -> list[list[Fraction]]:
        return [[Fraction(x[blade]) for blade in self._blades] for x in self.basis]

    @cached_property
    def _solver(self) -> tuple[list[int], list[list[Fraction]]]:
        """Return the blades whose coefficients determine the coordinates, and the matrix that computes them."""
        pivots = _pivots(self._rows)
        square = [[row[k] for k in pivots] for row in self._rows]
        return pivots, _inverse(square)

    def coordinates(self, x: Multivector) -> tuple[Any, ...]:
        """Return the coordinates of an element of the space, exact if the element is.

        Raises
        ------
        AlgebraError
            For an element outside the space; floats are compared to 1e-9 of the largest coefficient.
        """
        pivots, solver = self._solver
        values = [x[self._blades[k]] for k in pivots]
        found = [
            sum((value * row[k] for value, row in zip(values, solver, strict=True)), 0) for k in range(len(pivots))
        ]
        rest = x - self.element(found)
        size = max((abs(value) for value in x.terms.values()), default=0)
        inexact = any(isinstance(value, (float, np.floating)) for value in x.terms.values())
        if any(abs(value) > (1e-9 * size if inexact else 0) for value in rest.terms.values()):
            raise AlgebraError(f"coordinates in a Lie algebra of {self.algebra.name}", f"{x}", "an element of its span")
        return tuple(exact(value) if isinstance(value, Fraction) else value for value in found)

    def element(self, coordinates: Sequence[Any]) -> Multivector:
        """Return the element with given coordinates."""
        return sum_of(self.algebra, (x * value for x, value in zip(self.basis, coordinates, strict=True)))

    @cached_property
    def structure_constants(self) -> Exact:
        """The constants, shape (m, m, m): ``basis[i] x basis[j]`` is the sum of ``c[i, j, k] basis[k]``; exact."""
        m = self.dimension
        found = np.zeros((m, m, m), dtype=object)
        for i, a in enumerate(self.basis):
            for j in range(i):
                found[i, j] = self.coordinates(commutator(a, self.basis[j]))
                found[j, i] = -found[i, j]
        return found

    def adjoint(self, x: Multivector) -> Exact:
        """Return the matrix, shape (m, m), of ``y -> x x y`` on coordinates as columns."""
        coordinates = np.array(self.coordinates(x), dtype=object)
        return np.tensordot(coordinates, self.structure_constants, 1).T

    @cached_property
    def killing_form(self) -> Exact:
        """The trace of ``ad(a) ad(b)``, shape (m, m), exact."""
        c = self.structure_constants
        m = self.dimension
        flat = c.reshape(m, m * m)
        turned = c.transpose(0, 2, 1).reshape(m, m * m)
        form: Exact = flat @ turned.T
        return form

    @cached_property
    def killing_signature(self) -> tuple[int, int, int]:
        """The numbers of positive, negative and vanishing squares of the Killing form."""
        _, squares = orthogonal_basis([[Fraction(x) for x in row] for row in self.killing_form.tolist()])
        return sum(x > 0 for x in squares), sum(x < 0 for x in squares), sum(x == 0 for x in squares)

    @property
    def is_semisimple(self) -> bool:
        """Whether the Killing form is nondegenerate (Cartan's criterion)."""
        return self.killing_signature[2] == 0

    @property
    def is_compact(self) -> bool:
        """Whether the Killing form is negative definite: the group is compact and its centre finite."""
        return self.killing_signature[1] == self.dimension

    @cached_property
    def centre(self) -> tuple[Multivector, ...]:
        """Return a basis of the elements that commute with all of the space."""
        m = self.dimension
        rows = self.structure_constants.reshape(m, m * m).T.tolist()
        return tuple(self.element(row) for row in _kernel([[Fraction(x) for x in row] for row in rows], m))

    @cached_property
    def derived(self) -> LieAlgebra:
        """Return the span of all brackets."""
        return LieAlgebra(self.algebra, independent(commutator(a, b) for a in self.basis for b in self.basis))

    def commutant(self, *elements: Multivector) -> LieAlgebra:
        """Return the elements of the space that commute with all given ones."""
        if not elements:
            return self
        brackets = [[commutator(x, y) for x in self.basis] for y in elements]
        rows = []
        for line in brackets:
            for blade in sorted({blade for x in line for blade in x.terms}):
                rows.append([Fraction(x[blade]) for x in line])
        kernel = _kernel(rows, self.dimension)
        return LieAlgebra(self.algebra, tuple(self.element([exact(x) for x in row]) for row in kernel))


def bivector_algebra(algebra: Algebra) -> LieAlgebra:
    """Return all bivectors of an algebra: the Lie algebra of its Spin group, ``so(p, q)``, in any metric."""
    return LieAlgebra(algebra, tuple(Multivector(algebra, {blade: 1}) for blade in algebra.blades(2)))


def generated_lie_algebra(generators: Sequence[Multivector], largest: int = 500) -> LieAlgebra:
    """Return the smallest Lie algebra that contains some elements: their brackets, the brackets of these, and so on.

    Raises
    ------
    AlgebraError
        For no generator, and for more than `largest` dimensions.
    """
    if not generators:
        raise AlgebraError("generated_lie_algebra", "no generator", "at least one")
    basis = independent(generators)
    while True:
        if len(basis) > largest:
            raise AlgebraError("generated_lie_algebra", f"more than {largest} dimensions", "fewer", "raise largest")
        longer = independent([*basis, *(commutator(a, b) for k, a in enumerate(basis) for b in basis[:k])])
        if len(longer) == len(basis):
            return LieAlgebra(generators[0].algebra, basis)
        basis = longer


def independent(elements: Iterable[Multivector]) -> tuple[Multivector, ...]:
    """Return the elements that do not depend linearly on preceding ones: a basis of their span, exactly."""
    kept: list[Multivector] = []
    reduced: list[tuple[int, dict[int, Fraction]]] = []
    for x in elements:
        row = {blade: Fraction(value) for blade, value in x.terms.items()}
        for pivot, other in reduced:
            if pivot in row:
                factor = row[pivot]
                for blade, value in other.items():
                    rest = row.get(blade, Fraction(0)) - factor * value
                    if rest:
                        row[blade] = rest
                    else:
                        row.pop(blade, None)
        if row:
            pivot = min(row)
            reduced.append((pivot, {blade: value / row[pivot] for blade, value in row.items()}))
            kept.append(x)
    return tuple(kept)


def vector_matrix(bivector: Multivector) -> Exact:
    """Return the matrix, shape (n, n), of ``v -> B x v`` on vectors; images of basis vectors are its columns.

    The versor ``exp(B / 2)`` moves vectors by the exponential of this matrix.
    """
    algebra = bivector.algebra
    images = [commutator(bivector, vector) for vector in algebra.basis()]
    rows = [[image[1 << i] for image in images] for i in range(algebra.dimension)]
    return np.array(rows, dtype=object)


def bivector_of_matrix(algebra: Algebra, matrix: Sequence[Sequence[Any]]) -> Multivector:
    """Return the bivector `B` with ``B x v`` the image of `v` under a matrix: the inverse of `vector_matrix`.

    Raises
    ------
    AlgebraError
        For a matrix that is not skew in the metric: ``G M + M^T G = 0``; and in degenerate metrics.
    """
    n = algebra.dimension
    gram = [[Fraction(x) for x in row] for row in algebra.gram]
    if algebra.is_degenerate:
        raise AlgebraError(f"bivector_of_matrix in {algebra.name}", "a degenerate metric", "p + q = n")
    inverse = _inverse(gram)
    terms: dict[int, Any] = {}
    for i in range(n):
        for j in range(i + 1, n):
            value = sum((matrix[i][k] * inverse[k][j] for k in range(n) if inverse[k][j]), 0)
            terms[1 << i | 1 << j] = exact(value) if isinstance(value, Fraction) else value
    found = Multivector(algebra, terms)
    difference = vector_matrix(found) - np.array(matrix, dtype=object)
    size = max((abs(x) for row in matrix for x in row), default=0)
    inexact = any(isinstance(x, (float, np.floating)) for row in matrix for x in row)
    if any(abs(x) > (1e-9 * size if inexact else 0) for x in difference.flat):
        raise AlgebraError(f"bivector_of_matrix in {algebra.name}", "a matrix that is not skew", "G M + M^T G = 0")
    return found


def _pivots(rows: Sequence[Sequence[Fraction]]) -> list[int]:
    return _echelon(rows)[1]


def _rank(rows: Sequence[Sequence[Fraction]]) -> int:
    return len(_pivots(rows))


def _echelon(rows: Sequence[Sequence[Fraction]]) -> tuple[list[list[Fraction]], list[int]]:
    """Return the reduced echelon form, and the columns of its pivots."""
    work = [list(row) for row in rows]
    pivots: list[int] = []
    for column in range(len(work[0]) if work else 0):
        k = next((i for i in range(len(pivots), len(work)) if work[i][column]), None)
        if k is None:
            continue
        top = len(pivots)
        work[top], work[k] = work[k], work[top]
        pivot = work[top][column]
        work[top] = [x / pivot if x else x for x in work[top]]
        for i, row in enumerate(work):
            if i != top and row[column]:
                factor = row[column]
                work[i] = [x - factor * y if y else x for x, y in zip(row, work[top], strict=True)]
        pivots.append(column)
    return work, pivots


def _kernel(rows: Sequence[Sequence[Fraction]], n: int) -> list[list[Fraction]]:
    """Return a basis of the columns that some rows of length `n` annihilate."""
    work, pivots = _echelon(rows)
    found = []
    for free in (k for k in range(n) if k not in pivots):
        column = [Fraction(int(k == free)) for k in range(n)]
        for row, pivot in zip(work, pivots, strict=False):
            column[pivot] = -row[free]
        found.append(column)
    return found


def _inverse(matrix: Sequence[Sequence[Fraction]]) -> list[list[Fraction]]:
    n = len(matrix)
    work, _ = _echelon([[*row, *(Fraction(int(i == j)) for j in range(n))] for i, row in enumerate(matrix)])
    return [row[n:] for row in work]
