"""Join and meet of arrays of blades. Angles between subspaces determine the dimensions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from .blade import (
    BLADE_TOLERANCE,
    Blade,
    FactoredBlade,
    Floats,
    _factors,
    _made,
    check_pair,
    flat,
    refuse,
    wedge_vectors,
)
from .products import outer_of_grades

ANGLE = 1e-9
"""A direction of one blade is contained in the other if the sine of the angle between them is at most this."""

_CLEAR = 1e-3
"""If the product of the sines of all principal angles is above this, the outer product is the join to 12 digits."""

AnyBlade = TypeVar("AnyBlade", Blade, FactoredBlade)


@dataclass(frozen=True, slots=True, eq=False)
class JoinAndMeet:
    """Joins and meets of arrays of blades, whose grades may differ from element to element.

    For each element ``join = a ^ c`` with ``b = meet ^ c``, up to components of ``c`` in `a`. Joins scale with `a` and
    `b`, and meets have norm 1. The sign of a meet is determined by its rows, and that of the join accordingly.

    Attributes
    ----------
    larger : Blade or FactoredBlade
        The blade of larger grade.
    join_grade, meet_grade : int array, (...)
    outside : array, (..., k, n)
        Orthonormal rows that complete `larger` to the join, padded with zeros. `k` is the grade of the other blade.
    inside : array, (..., k, n)
        Orthonormal rows of the meet, padded with zeros.
    factor : array, (...)
        The join is this number times the outer product of `larger` and the rows `outside`.
    """

    larger: Blade | FactoredBlade
    join_grade: NDArray[np.int64]
    meet_grade: NDArray[np.int64]
    outside: Floats
    inside: Floats
    factor: Floats

    def join(self, grade: int | None = None) -> Blade | FactoredBlade:
        """Return the joins of a grade, in order. By default all joins, which must then have the same grade."""
        grade, chosen = self._chosen(self.join_grade, grade, "join")
        rows = self.outside[chosen][..., : grade - self.larger.grade, :]
        factor = self.factor[chosen]
        if isinstance(self.larger, Blade):
            shape = self.join_grade.shape + self.larger.coefficients.shape[-1:]
            first = Blade(np.broadcast_to(self.larger.coefficients, shape)[chosen], self.larger.n, self.larger.grade)
            return wedge_vectors(first, rows, factor)
        shape = self.join_grade.shape
        own = np.broadcast_to(self.larger.vectors, shape + self.larger.vectors.shape[-2:])[chosen]
        return _made(np.concatenate([own, rows], -2), factor * np.broadcast_to(self.larger.scale, shape)[chosen])

    def meet(self, grade: int | None = None) -> Blade | FactoredBlade:
        """Return the meets of a grade, in order. By default all meets, which must then have the same grade."""
        grade, chosen = self._chosen(self.meet_grade, grade, "meet")
        rows = self.inside[chosen][..., :grade, :]
        found = _made(rows, np.ones(rows.shape[:-2]))
        return found.coefficients() if isinstance(self.larger, Blade) else found

    def _chosen(self, grades: NDArray[np.int64], grade: int | None, name: str) -> tuple[int, Any]:
        if grade is not None:
            k = self.outside.shape[-2]
            least, largest = (
                (0, k) if name == "meet" else (self.larger.grade, min(self.larger.grade + k, self.larger.n))
            )
            if grade not in range(least, largest + 1):
                raise ValueError(f"grade: {grade!r}; expected {least} to {largest}, which a {name} of these can have")
            return grade, grades == grade
        if not grades.size:
            raise ValueError(f"{name}: no elements, so no grade; expected at least one element, or a grade")
        least, largest = int(grades.min()), int(grades.max())
        if least != largest:
            raise ValueError(
                f"{name}: grades {', '.join(map(str, np.unique(grades)))} among the elements; expected one grade; "
                f"use join_and_meet(a, b).{name}(grade)"
            )
        return least, ()


def join_and_meet(
    a: Blade | FactoredBlade,
    b: Blade | FactoredBlade,
    tolerance: float = ANGLE,
    blade_tolerance: float | None = BLADE_TOLERANCE,
) -> JoinAndMeet:
    """Return the smallest blades that contain two blades, and the largest that both contain.

    The metric of the algebra is not used. The grade of the meet is the number of principal angles between the two
    subspaces whose sine is at most the tolerance, in the Euclidean metric of the coordinates. It does not depend on the
    scales of the blades.

    Parameters
    ----------
    a, b : Blade or FactoredBlade
        Blades of the same form and dimension. Leading axes broadcast.
    tolerance : float
        The sine of an angle, 0 < tolerance < 1. It should exceed the errors of the blades (10^-15 for exact
        coefficients).
    blade_tolerance : float or None
        Tolerated deviation of coefficients from a blade, relative to their norm. None skips the check.

    Raises
    ------
    TypeError, ValueError
        If forms, dimensions or leading axes are incompatible, or an element is zero or not a blade.
    """
    check_pair(a, b)
    if not 0 < tolerance < 1:
        raise ValueError(f"tolerance: {tolerance!r}; expected the sine of an angle, above 0 and below 1")
    rows = {name: _rows(x, name, blade_tolerance) for name, x in (("a", a), ("b", b))}
    swapped = a.grade < b.grade  # projecting the smaller blade costs less
    larger, smaller = (b, a) if swapped else (a, b)
    (one, _), (two, scale) = rows["b" if swapped else "a"], rows["a" if swapped else "b"]
    shape = np.broadcast_shapes(a.shape, b.shape)
    one, two = flat(one, shape, 2), flat(two, shape, 2)
    count = len(one)
    rank, factor = np.empty(count, np.int64), np.empty(count)
    outside, inside = np.empty_like(two), np.empty_like(two)
    from . import loops  # imported here because it loads numba

    loops.join_batch(one, two, tolerance, rank, factor, outside, inside)
    more = rank.reshape(shape)
    factor = factor.reshape(shape) * scale
    if swapped:
        # b ^ c' is a ^ c up to the order of c and c'
        factor = np.where(more * (larger.grade - smaller.grade + more) & 1, -factor, factor)
    of_rows = (*shape, smaller.grade, a.n)
    return JoinAndMeet(
        larger, larger.grade + more, smaller.grade - more, outside.reshape(of_rows), inside.reshape(of_rows), factor
    )


def join(a: AnyBlade, b: AnyBlade, tolerance: float = ANGLE) -> AnyBlade:
    """Return the joins of blades, which must all have the same grade; see `join_and_meet`.

    If the blades are clearly disjoint, the joins are the outer products.
    """
    check_pair(a, b)
    if isinstance(a, Blade) and isinstance(b, Blade) and a.grade + b.grade <= a.n and 0 < tolerance < _CLEAR:
        found = _apart(a, b, tolerance)
        if found is not None:
            return found
    return join_and_meet(a, b, tolerance).join()  # type: ignore[return-value]


def _apart(a: Blade, b: Blade, tolerance: float) -> Blade | None:
    """Return the joins of disjoint blades as outer products, whose norms are products of sines, or None for others."""
    shape, grade = np.broadcast_shapes(a.shape, b.shape), a.grade + b.grade
    one, two = (flat(x.coefficients, shape, 1) for x in (a, b))
    out: Floats = outer_of_grades(a.n, a.grade, b.grade)(one, two)
    whole, first, second = (np.einsum("ep,ep->e", x, x) for x in (out, one, two))
    clear = whole > _CLEAR * _CLEAR * first * second
    if 8 * np.count_nonzero(~clear) > len(clear) - 8:
        return None
    for name, x in (("a", a), ("b", b)):
        _rows(x, name, BLADE_TOLERANCE, orthonormal=False)
    if not clear.all():
        rest = join_and_meet(Blade(one[~clear], a.n, a.grade), Blade(two[~clear], a.n, b.grade), tolerance)
        if np.any(rest.join_grade != grade):
            return None
        found = rest.join()
        assert isinstance(found, Blade)
        out[~clear] = found.coefficients
    return Blade(out.reshape(*shape, -1), a.n, grade)


def meet(a: AnyBlade, b: AnyBlade, tolerance: float = ANGLE) -> AnyBlade:
    """Return the meets of blades, which must all have the same grade; see `join_and_meet`."""
    return join_and_meet(a, b, tolerance).meet()  # type: ignore[return-value]


def _rows(
    x: Blade | FactoredBlade, name: str, tolerance: float | None, orthonormal: bool = True
) -> tuple[Floats, Floats]:
    if isinstance(x, Blade):
        try:
            return _factors(x, tolerance, orthonormal)
        except ValueError as error:
            raise ValueError(str(error).replace("blade", name, 1)) from None
    refuse(np.atleast_1d(x.scale == 0).ravel(), x.shape, "zero; expected a blade other than zero", name)
    return x.vectors, x.scale
