"""Affine and Euclidean geometry in G(n + 1, n + 1) and on the horosphere.

`AffineSpace` is the affine plane of a null cone: points ``x + w_(n+1)``, moved by the versors of homogeneous matrices.
`Horosphere` adds a metric: ``x_h = x + e`` and ``x_c = x_h - x**2 / 2 ebar`` with ``e . ebar = 1``, and with it
directed distances between points, lines, planes and all other flats (Bayro-Corrochano & Sobczyk, *Geometric Algebra
with Applications in Science and Engineering*, 2001, part I).
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise
from typing import Any

from ..algebra.algebra import Algebra
from ..algebra.coefficients import divide, scale
from ..algebra.factorization import TOLERANCE, join, join_and_meet, significant, spanning_vectors
from ..algebra.multivector import Multivector
from ..algebra.versors import inverse, sandwich
from ..errors import AlgebraError
from .general_linear import null_cones, versor_of_linear_map
from .lie import LieAlgebra


class AffineSpace:
    """Affine space of `n` dimensions in G(n + 1, n + 1).

    Parameters
    ----------
    n : int

    Attributes
    ----------
    algebra : Algebra
        `gacompiler.algebra.catalog.null_pairs` of n + 1; points lie in the first null cone, where all products are
        outer products.
    """

    def __init__(self, n: int) -> None:
        self.n = n
        self.algebra = null_cones(n + 1)

    def point(self, coordinates: Sequence[Any]) -> Multivector:
        """Return the point ``x + w_(n+1)`` of weight 1."""
        return self._vector(coordinates, 1)

    def direction(self, coordinates: Sequence[Any]) -> Multivector:
        """Return a point at infinity, of weight 0."""
        return self._vector(coordinates, 0)

    def coordinates(self, point: Multivector) -> tuple[Any, ...]:
        """Return the coordinates of a point of any nonzero weight."""
        weight = point[1 << self.n]
        if weight == 0:
            raise AlgebraError("coordinates of a point", "weight 0", "a finite point", "it is a direction")
        return tuple(divide(point[1 << k], weight) for k in range(self.n))

    def versor(self, matrix: Sequence[Sequence[Any]], translation: Sequence[Any]) -> Multivector:
        """Return the versor of ``x -> A x + t`` from the homogeneous matrix; exact, of norm ``det A``."""
        rows = [[*row, t] for row, t in zip(matrix, translation, strict=True)]
        return versor_of_linear_map([*rows, [0] * self.n + [1]])

    def translator(self, translation: Sequence[Any]) -> Multivector:
        """Return ``exp(t ^ v_(n+1) / 2) = 1 + t ^ v_(n+1) / 2``, the versor of ``x -> x + t``."""
        infinite = self.algebra.basis()[2 * self.n + 1]
        return 1 + (self.direction(translation) ^ infinite).map(lambda value: scale(value, Fraction(1, 2)))

    def move(self, versor: Multivector, x: Multivector) -> Multivector:
        """Return ``K x K**-1``, for points, lines and all other blades of points."""
        return versor * x * inverse(versor)

    def affine_algebra(self) -> LieAlgebra:
        """Return aff(n): the ``n**2 + n`` bivectors ``w_i ^ v_j`` whose homogeneous matrix has a zero last row."""
        n = self.n
        return LieAlgebra(self.algebra, tuple(self._unit(i, j) for i in range(n) for j in range(n + 1)))

    def euclidean_algebra(self) -> LieAlgebra:
        """Return se(n): rotations ``w_i ^ v_j - w_j ^ v_i`` and translations ``w_i ^ v_(n+1)``."""
        n = self.n
        rotations = [self._unit(i, j) - self._unit(j, i) for i in range(n) for j in range(i + 1, n)]
        return LieAlgebra(self.algebra, (*rotations, *(self._unit(i, n) for i in range(n))))

    def _unit(self, i: int, j: int) -> Multivector:
        return Multivector(self.algebra, {1 << i | 1 << self.n + 1 + j: 1})

    def _vector(self, coordinates: Sequence[Any], weight: int) -> Multivector:
        if len(coordinates) != self.n:
            raise AlgebraError("affine point", f"{len(coordinates)} coordinates", f"{self.n}")
        return Multivector(self.algebra, {**{1 << k: x for k, x in enumerate(coordinates)}, 1 << self.n: weight})


class Horosphere:
    """Euclidean (or pseudo-Euclidean) space as affine plane and as horosphere of G(p + 1, q + 1).

    Parameters
    ----------
    p, q : int
        Numbers of basis vectors with square +1 and -1.

    Attributes
    ----------
    algebra : Algebra
        Basis ``e1 .. en e ebar``, the last two null with ``e . ebar = 1``.

    Notes
    -----
    Flats are outer products of affine points: a line is ``x_h ^ y_h``. The direction of a flat is ``ebar . A``.
    """

    def __init__(self, p: int, q: int = 0) -> None:
        n = p + q
        gram = [[int(i == j) * (1 if i < p else -1) * (i < n) for j in range(n + 2)] for i in range(n + 2)]
        gram[n][n + 1] = gram[n + 1][n] = 1
        self.n = n
        vectors = [*(f"e{k + 1}" for k in range(n)), "e", "ebar"]
        self.algebra = Algebra(f"horosphere of G({p},{q})", vectors, gram)
        *self.vectors, self.e, self.ebar = self.algebra.basis()

    def vector(self, coordinates: Sequence[Any]) -> Multivector:
        """Return a vector of the space itself."""
        if len(coordinates) != self.n:
            raise AlgebraError("vector of the horosphere", f"{len(coordinates)} coordinates", f"{self.n}")
        return Multivector(self.algebra, {1 << k: x for k, x in enumerate(coordinates)})

    def affine(self, coordinates: Sequence[Any]) -> Multivector:
        """Return the affine point ``x_h = x + e``."""
        return self.vector(coordinates) + self.e

    def conformal(self, coordinates: Sequence[Any]) -> Multivector:
        """Return ``x_c = x + e - x**2 / 2 ebar``: null, with ``x_c . ebar = 1`` and ``x_c . y_c = -(x - y)**2 / 2``."""
        return self.lift(self.affine(coordinates))

    def lift(self, affine: Multivector) -> Multivector:
        """Return ``x_c = x_h ebar x_h / 2``."""
        return (affine * self.ebar * affine).map(lambda value: scale(value, Fraction(1, 2))).grade(1)

    def drop(self, x: Multivector) -> Multivector:
        """Return the affine part of points and blades, without ``ebar``."""
        return x.keep(lambda blade: not blade >> self.n + 1 & 1)

    def coordinates(self, point: Multivector) -> tuple[Any, ...]:
        """Return the coordinates of an affine or conformal point of any nonzero weight."""
        weight = point[1 << self.n]
        if weight == 0:
            raise AlgebraError("coordinates of a point", "weight 0", "a finite point", "it is a direction")
        return tuple(divide(point[1 << k], weight) for k in range(self.n))

    def translator(self, translation: Sequence[Any]) -> Multivector:
        """Return ``1 + t ebar / 2``, which moves ``x_c`` to the point of ``x + t``."""
        return 1 + (self.vector(translation) * self.ebar).map(lambda value: scale(value, Fraction(1, 2)))

    def move(self, versor: Multivector, flat: Multivector) -> Multivector:
        """Move a flat by a rotor, a translator or a product of these; the result is an affine blade."""
        return self.drop(sandwich(versor, flat))

    def flat(self, *points: Sequence[Any]) -> Multivector:
        """Return the flat through some points: point, line, plane and so on; zero if they are dependent."""
        blade = self.algebra.scalar(1)
        for point in points:
            blade = blade ^ self.affine(point)
        return blade

    def direction(self, flat: Multivector) -> Multivector:
        """Return ``ebar . A``: the blade of the directions of a flat, 1 for a point; zero at infinity."""
        return self.ebar.product("left_contraction", flat)

    def support(self, flat: Multivector) -> Multivector:
        """Return the affine point of a flat that is nearest to the origin.

        It is the part of grade 1 of ``A D**-1``, where `D` is the direction.
        """
        direction = self.direction(flat)
        if not significant(direction, TOLERANCE, like=flat).terms:
            raise AlgebraError("support of a flat", "a flat at infinity", "a finite one")
        return (flat * inverse(direction)).grade(1)

    def directed_distance(self, a: Multivector, b: Multivector) -> Multivector:
        """Return the vector from the flat `a` to the flat `b` that is orthogonal to both; zero if they meet.

        For flats with independent directions it is ``ebar . (A ^ B) / (D_A ^ D_B)``, up to sign. Since that is 0 / 0
        for parallel flats, the method uses, for all pairs, the difference of the supports minus its component in the
        join of the directions. Directions must not be null.
        """
        difference = self.support(b) - self.support(a)
        span = join(self.direction(a), self.direction(b))
        if span.grades in ((), (0,)):
            return difference
        return (difference ^ span) * inverse(span)

    def lies_on(self, a: Multivector, b: Multivector, tolerance: float = TOLERANCE) -> bool:
        """Return whether the flat `a` is contained in the flat `b`. Exact if both are."""
        return all(not significant(x ^ b, tolerance, like=_bound(x, b)).terms for x in spanning_vectors(a, tolerance))

    def is_flag(self, *flats: Multivector) -> bool:
        """Return whether each flat lies on the next: point on line on plane."""
        return all(self.lies_on(a, b) for a, b in pairwise(flats))

    def meet(self, a: Multivector, b: Multivector) -> tuple[Multivector, bool]:
        """Return the common part of two flats, and whether it is finite.

        Parallel flats share only directions. No metric is used.
        """
        shared = join_and_meet(a, b)[1]
        direction = self.direction(shared)
        return shared, bool(significant(direction, TOLERANCE, like=shared).terms)


def _bound(a: Multivector, b: Multivector) -> Multivector:
    """Return a scalar as large as the largest coefficients of two elements together."""
    one, two = (max((abs(value) for value in x.terms.values()), default=0) for x in (a, b))
    return a.lift(one * two)
