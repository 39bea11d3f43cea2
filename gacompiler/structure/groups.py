"""The Lipschitz, Pin and Spin groups: membership, action on vectors, and versors of isometries.

A member of the Lipschitz group is an invertible `x`, even or odd, with ``grade_involution(x) v x**-1`` a vector for
every vector `v`. Its spinor norm is the number ``x ~x``; Pin contains the members of norm +1 and -1, Spin the even
elements of Pin, Spin+ the even elements of norm +1 (Porteous 1995, ch. 16; Lounesto 2001, ch. 17).
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
    """The result of `membership`.

    Attributes
    ----------
    is_lipschitz : bool
        Whether the element is a versor: a product of invertible vectors.
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
    """Determine to which of the groups Lipschitz, Pin, Spin and Spin+ an element belongs.

    Parameters
    ----------
    x : Multivector
        With coefficients of any field, in any metric.
    tolerance : float
        Tolerance for zero, relative to the square of the element's length, and for a norm of 1, if coefficients are not
        exact. It is not used for exact coefficients.
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
    """Return the number ``x ~x`` of a versor.

    Raises
    ------
    AlgebraError
        For an element that is not a versor.
    """
    found = membership(x, tolerance)
    if not found.is_lipschitz:
        raise AlgebraError("spinor norm", f"{x}", "a product of vectors that have inverses")
    return found.spinor_norm


def versor_of_isometry(algebra: Algebra, matrix: Sequence[Sequence[Coefficient]]) -> Multivector:
    """Return a versor whose action is an orthogonal matrix, a product of vectors; exact if the matrix is.

    By the theorem of Cartan and Dieudonné, the vectors of an orthogonal basis are mapped to their images one after the
    other: by a reflection in the difference to the image, or, if that is null or short, by reflections in the sum and
    in the vector itself.

    Parameters
    ----------
    algebra : Algebra
        Of any nondegenerate metric, in any basis.
    matrix : sequence of rows
        Preserves the Gram matrix; the images of basis vectors are its columns.

    Returns
    -------
    Multivector
        Not normalised for rational matrices, so that the coefficients are rational. A product of unit vectors,
        hence a member of Pin, if the matrix contains floats.

    Raises
    ------
    AlgebraError
        For a matrix that does not preserve inner products, and in degenerate metrics.
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
    """Convert NumPy numbers to Python numbers."""
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
                    f"{algebra.gram[i][j]}, the inner product of the vectors",
                )


def _is_close(value: Coefficient, to: int, tolerance: float) -> bool:
    if isinstance(value, (float, complex)) or type(value).__module__.startswith(("numpy", "mpmath")):
        return bool(abs(value - to) <= tolerance)
    return bool(value == to)
