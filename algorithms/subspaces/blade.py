"""Arrays of blades in two forms: coefficients with respect to basis blades, and orthonormal vectors with a scale."""

from __future__ import annotations

from dataclasses import dataclass
from math import comb
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arguments import finite, real_array
from ..precision import NEGLIGIBLE
from . import index_tables as tables
from .products import outer_by_vector, outer_of_grades

Floats = NDArray[np.float64]

LARGEST = 30
"""Maximum dimension for blades in factored form."""
BLADE_TOLERANCE = 1e-9
"""Tolerated deviation of coefficients from a blade, relative to their norm."""


@dataclass(frozen=True, slots=True, eq=False)
class Blade:
    """Blades given by coefficients: the additive form.

    Parameters
    ----------
    coefficients : array_like, (..., C(n, grade))
        Over the basis blades of one grade, ordered by bitmap: ``e1^e2, e1^e3, e2^e3, e1^e4, ...`` for grade 2.
    n : int
        The number of basis vectors, 1 to 16.
    grade : int
        0 to `n`.

    Raises
    ------
    TypeError, ValueError
        If the coefficients are not real or not finite, or their number does not match the grade.

    Notes
    -----
    The constructor does not check that the elements are outer products of vectors; `factorize_blade` does.
    """

    coefficients: Floats
    n: int
    grade: int

    def __init__(self, coefficients: ArrayLike, n: int, grade: int) -> None:
        check_dimension(n, tables.LARGEST, "more vectors take the factored form, FactoredBlade")
        if not _is_int(grade) or not 0 <= grade <= n:
            raise ValueError(f"grade: {grade!r}; expected 0 to n = {n}")
        array = real_array(coefficients, "coefficients", (comb(n, grade),), f"blades of grade {grade} of {n} vectors")
        object.__setattr__(self, "coefficients", _finite(array, "coefficients"))
        object.__setattr__(self, "n", int(n))
        object.__setattr__(self, "grade", int(grade))

    @property
    def shape(self) -> tuple[int, ...]:
        """The leading axes."""
        return self.coefficients.shape[:-1]

    def norm(self) -> Floats:
        """The Euclidean norm of the coefficients."""
        largest = np.abs(self.coefficients).max(-1)
        unit = self.coefficients / np.where(largest > 0, largest, 1.0)[..., None]
        return np.asarray(largest * np.linalg.norm(unit, axis=-1))


@dataclass(frozen=True, slots=True, eq=False)
class FactoredBlade:
    """Blades given by vectors: the multiplicative form, ``scale`` times the outer product of orthonormal vectors.

    A blade of grade k is stored as k n numbers instead of C(n, k). The vectors are orthonormal in coordinates,
    independently of any metric of the algebra.

    Parameters
    ----------
    vectors : array_like, (..., grade, n)
        Orthonormal rows; use `of_vectors` for arbitrary vectors. `n` is at most 30.
    scale : array_like, (...)

    Raises
    ------
    TypeError, ValueError
        If shapes are incompatible, numbers are not finite, or rows are not orthonormal.
    """

    vectors: Floats
    scale: Floats

    def __init__(self, vectors: ArrayLike, scale: ArrayLike = 1.0) -> None:
        rows = _finite(real_array(vectors, "vectors", (-1, -1), "orthonormal rows"), "vectors")
        check_dimension(rows.shape[-1], LARGEST)
        if rows.shape[-2] > rows.shape[-1]:
            raise ValueError(f"vectors: shape {rows.shape}; expected at most as many rows as columns")
        products = rows @ np.swapaxes(rows, -1, -2) - np.eye(rows.shape[-2])
        if products.size and np.abs(products).max() > NEGLIGIBLE:
            raise ValueError("vectors: rows not orthonormal; expected orthonormal rows; use FactoredBlade.of_vectors")
        numbers = _finite(real_array(scale, "scale"), "scale")
        try:
            shape = np.broadcast_shapes(rows.shape[:-2], numbers.shape)
        except ValueError:
            raise ValueError(
                f"scale: shape {numbers.shape}; expected one that broadcasts with {rows.shape[:-2]}"
            ) from None
        object.__setattr__(self, "vectors", np.broadcast_to(rows, shape + rows.shape[-2:]))
        object.__setattr__(self, "scale", np.broadcast_to(numbers, shape))

    @classmethod
    def of_vectors(cls, vectors: ArrayLike) -> FactoredBlade:
        """Return the outer product of vectors, ``(..., grade, n)``. For dependent ones the scale is about 0."""
        rows = _finite(real_array(vectors, "vectors", (-1, -1), "vectors of a blade"), "vectors")
        check_dimension(rows.shape[-1], LARGEST)
        if rows.shape[-2] > rows.shape[-1]:
            raise ValueError(f"vectors: {rows.shape[-2]} rows of length {rows.shape[-1]}; expected at most n rows")
        q, r = np.linalg.qr(np.swapaxes(rows, -1, -2))
        with np.errstate(over="ignore"):
            scale = np.prod(np.diagonal(r, axis1=-2, axis2=-1), axis=-1)
        return cls(np.swapaxes(q, -1, -2), scale)

    @property
    def shape(self) -> tuple[int, ...]:
        """The leading axes."""
        return self.scale.shape

    @property
    def n(self) -> int:
        """The number of basis vectors."""
        return int(self.vectors.shape[-1])

    @property
    def grade(self) -> int:
        """The number of vectors."""
        return int(self.vectors.shape[-2])

    def coefficients(self) -> Blade:
        """Return the same blades as coefficients, for dimensions up to 16."""
        return wedge_vectors(Blade(np.ones((*self.shape, 1)), self.n, 0), self.vectors, self.scale)


def reduced_factors(blade: Blade, tolerance: float | None = BLADE_TOLERANCE) -> tuple[Floats, Floats]:
    """Return vectors whose outer product, times a scale, is a given blade.

    The coordinates are ratios of coefficients of the blade. Restricted to the vectors of the basis blade with the
    largest coefficient they form the identity matrix, and no coordinate is larger than 1. Therefore the vectors are
    well conditioned for every blade. This is the fast algorithm of Fontijne & Dorst (*Efficient algorithms for
    factorization and join of blades*, 2010).

    Parameters
    ----------
    blade : Blade
    tolerance : float or None
        Tolerated deviation of the coefficients from the product, relative to their norm. None skips the check.

    Returns
    -------
    vectors : array, (..., grade, n)
    scale : array, (...)

    Raises
    ------
    TypeError, ValueError
        If an element is zero or not a blade.
    """
    return _factors(blade, tolerance, orthonormal=False)


def factorize_blade(
    blade: Blade, tolerance: float | None = BLADE_TOLERANCE, *, averaged: bool = False
) -> FactoredBlade:  # fmt: skip
    """Factorize blades into orthonormal vectors, at about twice the cost of `reduced_factors`.

    Parameters
    ----------
    blade : Blade
    tolerance : float or None
        Tolerated deviation of the coefficients from a blade, relative to their norm. None skips the check.
    averaged : bool
        Whether to compute the subspace from all coefficients, as the dominant eigenvectors of the Gram matrix of
        ``e_i . B``, instead of a subset determined by the largest coefficient. This averages noise in the coefficients,
        at ten to fifty times the cost.

    Raises
    ------
    TypeError, ValueError
        If an element is zero or not a blade.

    Notes
    -----
    The product of the vectors reproduces the blade to 10^-12 of its largest coefficient, measured for random blades of
    all grades in 3 to 10 dimensions with scales from 10^-8 to 10^8, and to 10^-10 if two factors differ by 10^-7.
    """
    if averaged:
        return _by_eigenvectors(blade, tolerance)
    vectors, scale = _factors(blade, tolerance, orthonormal=True)
    return _made(vectors, scale)


def outer_product(a: Blade | FactoredBlade, b: Blade | FactoredBlade) -> Blade | FactoredBlade:
    """Return the outer product of blades of the same form. Leading axes broadcast.

    Raises
    ------
    TypeError, ValueError
        If the forms or dimensions differ, or the sum of the grades is larger than n.
    """
    check_pair(a, b)
    if a.grade + b.grade > a.n:
        raise ValueError(f"outer_product: grades {a.grade} and {b.grade} of {a.n} vectors; expected a sum up to {a.n}")
    shape = np.broadcast_shapes(a.shape, b.shape)
    if isinstance(a, Blade) and isinstance(b, Blade):
        product = outer_of_grades(a.n, a.grade, b.grade)
        return Blade(product(a.coefficients, b.coefficients), a.n, a.grade + b.grade)
    assert isinstance(a, FactoredBlade) and isinstance(b, FactoredBlade)
    parts = [np.broadcast_to(x.vectors, shape + x.vectors.shape[-2:]) for x in (a, b)]
    found = FactoredBlade.of_vectors(np.concatenate(parts, -2))
    return _made(found.vectors, found.scale * a.scale * b.scale)


def wedge_vectors(blade: Blade, vectors: Floats, scale: Floats) -> Blade:
    """Return ``scale`` times the outer product of a blade and vectors ``(..., k, n)``. Shapes are not checked."""
    check_dimension(blade.n, tables.LARGEST, "keep the factored form")
    k = vectors.shape[-2]
    shape = np.broadcast_shapes(blade.shape, vectors.shape[:-2])
    out = np.broadcast_to(blade.coefficients, (*shape, blade.coefficients.shape[-1]))
    for i in range(k):
        out = outer_by_vector(blade.n, blade.grade + i)(out, vectors[..., i, :])
    return Blade(out * np.asarray(scale)[..., None], blade.n, blade.grade + k)


def flat(array: Floats, shape: tuple[int, ...], axes: int) -> Floats:
    """Return a contiguous read-only array with one leading axis instead of `shape`, as required by compiled loops."""
    if array.shape[: array.ndim - axes] != shape or len(shape) != 1:
        last = array.shape[array.ndim - axes :]
        array = np.broadcast_to(array, shape + last).reshape(int(np.prod(shape)), *last)
    found = np.ascontiguousarray(array).view()
    found.flags.writeable = False
    return found


def check_pair(a: object, b: object) -> None:
    """Raise an error unless two blades have the same form and dimension."""
    for name, value in (("a", a), ("b", b)):
        if not isinstance(value, (Blade, FactoredBlade)):
            raise TypeError(f"{name}: {type(value).__name__}; expected Blade or FactoredBlade")
    assert isinstance(a, (Blade, FactoredBlade)) and isinstance(b, (Blade, FactoredBlade))
    if type(a) is not type(b):
        raise TypeError("a, b: a Blade and a FactoredBlade; expected the same form; use factorize_blade on the Blade")
    if a.n != b.n:
        raise ValueError(f"a, b: blades of {a.n} and of {b.n} vectors; expected the same algebra")
    try:
        np.broadcast_shapes(a.shape, b.shape)
    except ValueError:
        raise ValueError(f"a, b: leading axes {a.shape} and {b.shape}; expected leading axes that broadcast") from None


def check_dimension(n: object, largest: int, remedy: str = "") -> None:
    """Raise an error unless `n` is an integer from 1 to `largest`."""
    if not _is_int(n) or not 1 <= n <= largest:
        raise ValueError(f"n: {n!r}; expected 1 to {largest} vectors" + (f"; {remedy}" if remedy else ""))


def _is_int(value: object) -> TypeGuard[int]:
    return isinstance(value, (int, np.integer)) and not isinstance(value, bool)


def _finite(array: NDArray[Any], name: str) -> Floats:
    return finite(array, name).astype(np.float64, copy=False)


def _made(vectors: Floats, scale: Floats) -> FactoredBlade:
    """Construct a FactoredBlade without validation."""
    made = object.__new__(FactoredBlade)
    object.__setattr__(made, "vectors", vectors)
    object.__setattr__(made, "scale", np.asarray(scale))
    return made


def _factors(blade: Blade, tolerance: float | None, orthonormal: bool) -> tuple[Floats, Floats]:
    if not isinstance(blade, Blade):
        raise TypeError(f"blade: {type(blade).__name__}; expected Blade")
    coefficients = flat(blade.coefficients, blade.shape, 1)
    vectors, scale, error = factors_and_defects(coefficients, blade.n, blade.grade, orthonormal, tolerance is not None)
    refuse(scale == 0, blade.shape, "zero; expected a blade other than zero")
    if tolerance is not None:
        _refuse_far(error, blade, tolerance)
    return vectors.reshape(*blade.shape, blade.grade, blade.n), scale.reshape(blade.shape)


def factors_and_defects(
    coefficients: Floats, n: int, grade: int, orthonormal: bool, checked: bool
) -> tuple[Floats, Floats, Floats]:
    """Return vectors, scale (0 for zero) and relative deviation from a blade of elements ``(N, C(n, grade))``."""
    vectors = np.empty((len(coefficients), grade, n))
    if grade == n:
        vectors[:] = np.eye(n)
        return vectors, coefficients[:, 0].copy(), np.zeros(len(coefficients))
    table = tables.factor_table(n, grade)
    scale, error = np.empty(len(coefficients)), np.zeros(len(coefficients))
    checked = checked and 1 < grade < n - 1  # elements of other grades are always blades
    short = checked and tables.blade_table_terms(n, grade) <= tables.MOST_TERMS
    relations = tables.blade_table(n, grade) if short else tables.blade_table(1, 0)
    fields = (relations.pivot, relations.target, relations.first, relations.left, relations.right, relations.sign)
    coefficients = flat(coefficients, coefficients.shape[:1], 1)
    from . import loops  # imported here because it loads numba

    loops.factor_batch(coefficients, table.place, table.sign, orthonormal, fields, vectors, scale, error)
    if checked and not short:
        nonzero = scale != 0
        unit = coefficients[nonzero] / np.abs(coefficients[nonzero]).max(-1, keepdims=True)
        scalar = Blade(np.ones((len(unit), 1)), n, 0)
        product = wedge_vectors(scalar, vectors[nonzero], np.ones(len(unit))).coefficients
        size = (product * unit).sum(-1, keepdims=True) / (product * product).sum(-1, keepdims=True)
        error[nonzero] = np.linalg.norm(unit - size * product, axis=-1) / np.linalg.norm(unit, axis=-1)
    return vectors, scale, error


def refuse(bad: NDArray[np.bool_], shape: tuple[int, ...], words: str, name: str = "blade") -> None:
    """Raise an error that names the first element of a flat batch for which `bad` is true."""
    if bad.any():
        at = tuple(int(i) for i in np.unravel_index(int(np.argmax(bad)), shape or (1,)))
        raise ValueError(f"{name}: element {at if shape else ''}".rstrip() + f" is {words}")


def _refuse_far(error: Floats, blade: Blade, tolerance: float) -> None:
    far = ~(error <= tolerance)
    if far.any():
        words = f"no blade: {float(error[np.argmax(far)]):.2g} of its norm is not as in a blade"
        refuse(far, blade.shape, f"{words}; expected at most {tolerance:g}")


def _by_eigenvectors(blade: Blade, tolerance: float | None) -> FactoredBlade:
    """Factorize by the row space of all contractions ``e_i . B``, which uses all coefficients."""
    first, _ = _factors(blade, None, orthonormal=True)
    n, k = blade.n, blade.grade
    unit = blade.coefficients / blade.norm()[..., None]
    if 0 < k < n:
        rests = tables.vectors_of(n, k - 1)
        columns = np.repeat(rests[:, None, :], n, 1)
        extended = np.concatenate([columns, np.broadcast_to(np.arange(n), (len(rests), n))[..., None]], -1)
        order = np.argsort(extended, -1)
        ascending = np.take_along_axis(extended, order, -1).astype(np.int32)
        double = (np.diff(ascending, axis=-1) == 0).any(-1)
        sign = np.where(double, 0.0, 1.0 - 2.0 * ((k - 1 - np.argmax(order == k - 1, -1)) & 1))
        contracted = unit[..., np.where(double, 0, tables.place(ascending))] * sign
        gram = np.swapaxes(contracted, -1, -2) @ contracted
        vectors = np.ascontiguousarray(np.swapaxes(np.linalg.eigh(gram)[1][..., n - k :], -1, -2))
    else:
        vectors = first
    product = wedge_vectors(Blade(np.ones((*blade.shape, 1)), n, 0), vectors, np.ones(blade.shape)).coefficients
    cosine = (product * unit).sum(-1)
    if tolerance is not None:
        error = np.linalg.norm(unit - cosine[..., None] * product, axis=-1)
        _refuse_far(np.atleast_1d(error).ravel(), blade, tolerance)
    return _made(vectors, cosine * blade.norm())
