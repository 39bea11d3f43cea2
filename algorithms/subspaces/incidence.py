"""Join and meet of arrays of blades, with dimensions decided by angles; what two blades do not share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from . import loops
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

ANGLE = 1e-9
"""A direction of one blade is in the other where the sine of the angle between them is at most this."""

AnyBlade = TypeVar("AnyBlade", Blade, FactoredBlade)


@dataclass(frozen=True, slots=True, eq=False)
class JoinAndMeet:
    """Joins and meets of arrays of blades, whose grades may differ from element to element.

    Attributes
    ----------
    join_grade, meet_grade : int array, (...)
    outside : array, (..., b, n)
        Orthonormal rows that complete `a` to the join, as many as its grade is larger; zeros after them.
    inside : array, (..., b, n)
        Orthonormal rows of the meet, as many as its grade; zeros after them.
    factor : array, (...)
        ``join = a ^ c`` and ``b = meet ^ c`` where ``c`` is this number times the outer product of the rows `outside`
        (the second up to what lies in `a`), so joins change with the scales of `a` and `b` and meets are unit.
    """

    a: Blade | FactoredBlade
    join_grade: NDArray[np.int64]
    meet_grade: NDArray[np.int64]
    outside: Floats
    inside: Floats
    factor: Floats

    def join(self, grade: int | None = None) -> Blade | FactoredBlade:
        """The joins of a grade, in order, in the form of `a`; with no grade given all, when they have the same one."""
        grade, chosen = self._chosen(self.join_grade, grade, "join")
        rows = self.outside[chosen][..., : grade - self.a.grade, :]
        factor = self.factor[chosen]
        if isinstance(self.a, Blade):
            shape = self.join_grade.shape + self.a.coefficients.shape[-1:]
            first = Blade(np.broadcast_to(self.a.coefficients, shape)[chosen], self.a.n, self.a.grade)
            return wedge_vectors(first, rows, factor)
        shape = self.join_grade.shape
        own = np.broadcast_to(self.a.vectors, shape + self.a.vectors.shape[-2:])[chosen]
        return _made(np.concatenate([own, rows], -2), factor * np.broadcast_to(self.a.scale, shape)[chosen])

    def meet(self, grade: int | None = None) -> Blade | FactoredBlade:
        """The meets of a grade, in order, in the form of `a`; with no grade given all, when they have the same one."""
        grade, chosen = self._chosen(self.meet_grade, grade, "meet")
        rows = self.inside[chosen][..., :grade, :]
        found = _made(rows, np.ones(rows.shape[:-2]))
        return found.coefficients() if isinstance(self.a, Blade) else found

    def _chosen(self, grades: NDArray[np.int64], grade: int | None, name: str) -> tuple[int, Any]:
        if grade is not None:
            return grade, grades == grade
        found = np.unique(grades)
        if len(found) > 1:
            raise ValueError(
                f"{name}: grades {', '.join(map(str, found))} among the elements; expected one grade; "
                f"use join_and_meet(a, b).{name}(grade)"
            )
        if not len(found):
            raise ValueError(f"{name}: no elements, so no grade; expected at least one element, or a grade")
        return int(found[0]), ()


def join_and_meet(a: Blade | FactoredBlade, b: Blade | FactoredBlade, tolerance: float = ANGLE) -> JoinAndMeet:
    """The smallest blades that contain, and the largest that are contained in, two blades; no metric is used.

    The grade of the meet is the number of principal angles between the two subspaces with a sine of at most the
    tolerance, in the Euclidean metric of the coordinates. So it does not depend on the scales of the blades.

    Parameters
    ----------
    a, b : Blade or FactoredBlade
        The same form and number of vectors; leading axes broadcast.
    tolerance : float
        A sine, 0 < tolerance < 1. Sines below some 10^-15 times the condition of the blades are rounding.

    Raises
    ------
    TypeError, ValueError
        Where forms, numbers of vectors or leading axes do not fit, or an element is zero or no blade.
    """
    check_pair(a, b)
    if not 0 < tolerance < 1:
        raise ValueError(f"tolerance: {tolerance!r}; expected the sine of an angle, above 0 and below 1")
    (one, _), (two, scale) = _rows(a, "a"), _rows(b, "b")
    shape = np.broadcast_shapes(a.shape, b.shape)
    one, two = flat(one, shape, 2), flat(two, shape, 2)
    count = len(one)
    rank, factor = np.empty(count, np.int64), np.empty(count)
    outside, inside = np.empty_like(two), np.empty_like(two)
    loops.join_batch(one, two, tolerance, rank, factor, outside, inside)
    more = rank.reshape(shape)
    rows = (*shape, b.grade, b.n)
    return JoinAndMeet(
        a,
        a.grade + more,
        b.grade - more,
        outside.reshape(rows),
        inside.reshape(rows),
        factor.reshape(shape) * np.broadcast_to(scale, shape),
    )


def join(a: AnyBlade, b: AnyBlade, tolerance: float = ANGLE) -> AnyBlade:
    """The joins of blades, when all have the same grade: see `join_and_meet`."""
    return join_and_meet(a, b, tolerance).join()  # type: ignore[return-value]


def meet(a: AnyBlade, b: AnyBlade, tolerance: float = ANGLE) -> AnyBlade:
    """The meets of blades, when all have the same grade: see `join_and_meet`."""
    return join_and_meet(a, b, tolerance).meet()  # type: ignore[return-value]


def _rows(x: Blade | FactoredBlade, name: str) -> tuple[Floats, Floats]:
    if isinstance(x, Blade):
        try:
            return _factors(x, BLADE_TOLERANCE, orthonormal=True)
        except ValueError as error:
            raise ValueError(str(error).replace("blade", name, 1)) from None
    refuse(np.atleast_1d(x.scale == 0).ravel(), x.shape, "zero; expected a blade other than zero", name)
    return x.vectors, x.scale
