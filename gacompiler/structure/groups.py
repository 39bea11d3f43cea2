"""The groups of Lipschitz, Pin and Spin: who is a member, what members do to vectors, and who does what.

A member of the Lipschitz group is an invertible `x`, even or odd, with ``grade_involution(x) v x**-1`` a vector for
every vector `v`. Its spinor norm is the number ``x ~x``; Pin has the members of norm +1 and -1, Spin the even ones of
these, Spin+ the even ones of norm +1 (Porteous 1995, ch. 16; Lounesto 2001, ch. 17).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..algebra.algebra import Algebra
from ..algebra.coefficients import Coefficient, divide, is_exact, scale
from ..algebra.factorization import TOLERANCE, significant
from ..algebra.involutions import grade_involution, reverse
from ..algebra.multivector import Multivector
from ..errors import AlgebraError
from .matrix_algebras import orthogonal_basis

Matrix = tuple[tuple[Any, ...], ...]


@dataclass(frozen=True, slots=True)
class Membership:
    """What `membership` finds.

    Attributes
    ----------
    is_lipschitz : bool
        Whether the element is a versor: a product of vectors that have inverses.
    is_pin, is_spin, is_spin_plus : bool
        Whether it belongs to these groups, each of which contains the next.
    spinor_norm : coefficient or None
        ``x ~x``, a number for versors.
    action : tuple of rows or None
        The orthogonal matrix of ``v -> grade_involution(x) v x**-1`` in the algebra's basis, images as columns.
    """

    is_lipschitz: bool
    is_pin: bool
    is_spin: bool
    is_spin_plus: bool
    spinor_norm: Coefficient | None = None
    action: Matrix | None = None


_OUTSIDE = Membership(False, False, False, False)


def membership(x: Multivector, tolerance: float = TOLERANCE) -> Membership:
    """To which of the groups Lipschitz, Pin, Spin and Spin+ an element belongs.

    Parameters
    ----------
    x : Multivector
        Any coefficients that can be divided; any metric.
    tolerance : float
        What counts as zero, of the square of the element's length, and as a norm of 1, where coefficients are not
        exact. Exact ones decide exactly.
    """
    parities = {k & 1 for k in significant(x, tolerance).grades}
    if len(parities) != 1:
        return _OUTSIDE
    x = x.grade(*(k for k in x.grades if k & 1 in parities))
    like = x.lift(sum(abs(value) ** 2 for value in x.terms.values()))
    norm = x * reverse(x)
    if significant(norm, tolerance, like=like).grades != (0,):
        return _OUTSIDE
    images = []
    for vector in x.algebra.basis():
        image = grade_involution(x) * vector * reverse(x)
        if significant(image, tolerance, like=like).grades not in ((), (1,)):
            return _OUTSIDE
        images.append([divide(image[1 << k], norm.scalar) for k in range(x.algebra.dimension)])
    action = tuple(zip(*images, strict=True))
    value = norm.scalar
    positive, negative = _is_close(value, 1, tolerance), _is_close(value, -1, tolerance)
    is_even = not x.grades[0] & 1
    pin = positive or negative
    return Membership(True, pin, pin and is_even, positive and is_even, value, action)


def spinor_norm(x: Multivector, tolerance: float = TOLERANCE) -> Coefficient:
    """The number ``x ~x`` of a versor.

    Raises
    ------
    AlgebraError
        For an element that is no versor.
    """
    found = membership(x, tolerance)
    if not found.is_lipschitz:
        raise AlgebraError("spinor norm", f"{x}", "a product of vectors that have inverses")
    return found.spinor_norm


def versor_of_isometry(algebra: Algebra, matrix: Sequence[Sequence[Coefficient]]) -> Multivector:
    """A versor whose action is an orthogonal matrix, a product of vectors (Cartan-Dieudonné): exact where that is.

    One vector of an orthogonal basis is put in its place after the other: by a reflection in the difference to its
    image, or, where that is null or short, by reflections in the sum and in the vector itself.

    Parameters
    ----------
    algebra : Algebra
        Of any metric that is not degenerate, in any basis.
    matrix : sequence of rows
        Keeps the Gram matrix; the images of basis vectors are its columns.

    Returns
    -------
    Multivector
        Not normalised: of rational matrices the coefficients are rational. Unit vectors, hence a member of Pin, where
        the matrix holds floats.

    Raises
    ------
    AlgebraError
        For a matrix that does not keep inner products, and in degenerate metrics.
    """
    rows, squares = orthogonal_basis(algebra.gram)
    n = algebra.dimension
    if not all(squares):
        raise AlgebraError(f"versor_of_isometry in {algebra.name}", "a degenerate metric", "p + q = n")
    if len(matrix) != n or any(len(row) != n for row in matrix):
        raise AlgebraError(f"versor_of_isometry in {algebra.name}", "a matrix of another size", f"{n} x {n}")
    values = [[_own(value) for value in row] for row in matrix]
    exact = all(is_exact(value) for row in values for value in row)
    _check_isometry(algebra, values, exact)
    basis = [Multivector(algebra, {1 << k: x if exact else float(x) for k, x in enumerate(row)}) for row in rows]
    images = [_moved(algebra, values, x) for x in basis]
    versor = algebra.scalar(1 if exact else 1.0)
    for k, (vector, square) in enumerate(zip(basis, squares, strict=True)):
        difference = images[k] - vector
        across = (difference * difference).scalar
        if not difference.terms:
            continue
        direct = across != 0 if exact else abs(across) >= 2 * abs(float(square))
        for mirror in (difference,) if direct else (images[k] + vector, vector):
            unit = mirror if exact else mirror / abs((mirror * mirror).scalar) ** 0.5
            images = [_reflected(image, unit) for image in images]
            versor = versor * unit
    return versor


def _own(value: Any) -> Coefficient:
    """Numbers of numpy as Python's."""
    return value.item() if hasattr(value, "item") and not is_exact(value) else value


def _moved(algebra: Algebra, matrix: Sequence[Sequence[Coefficient]], x: Multivector) -> Multivector:
    n = algebra.dimension
    return Multivector(algebra, {1 << i: sum(matrix[i][j] * x[1 << j] for j in range(n)) for i in range(n)})


def _reflected(x: Multivector, mirror: Multivector) -> Multivector:
    square = (mirror * mirror).scalar
    twice = (x * mirror + mirror * x).scalar
    return x - mirror.map(lambda value: value * divide(twice, square))


def _check_isometry(algebra: Algebra, matrix: Sequence[Sequence[Coefficient]], exact: bool) -> None:
    n = algebra.dimension
    size = max((abs(value) for row in matrix for value in row), default=1) ** 2
    for i in range(n):
        for j in range(i + 1):
            found = sum(
                scale(matrix[k][i] * matrix[m][j], algebra.gram[k][m])
                for k in range(n) for m in range(n) if algebra.gram[k][m]
            )  # fmt: skip
            wrong = abs(found - algebra.gram[i][j])
            if (wrong != 0) if exact else not wrong <= TOLERANCE * max(size, 1):
                raise AlgebraError(
                    f"versor_of_isometry in {algebra.name}",
                    f"images of {algebra.vectors[i]} and {algebra.vectors[j]} with inner product {found}",
                    f"{algebra.gram[i][j]}, as the vectors have",
                )


def _is_close(value: Coefficient, to: int, tolerance: float) -> bool:
    if isinstance(value, (float, complex)) or type(value).__module__.startswith(("numpy", "mpmath")):
        return bool(abs(value - to) <= tolerance)
    return bool(value == to)
