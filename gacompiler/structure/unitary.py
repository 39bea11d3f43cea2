"""Complex structures: U(n) and SU(n) as the rotors of G(2n) that leave a bivector invariant.

A vector of ``n`` complex numbers is the vector ``sum x_k e_k + y_k f_k`` of 2n real ones, with ``f_k = e_(n+k)``. The
bivector ``J = sum e_k f_k`` represents multiplication by i: ``v x J``. Elements that commute with it are unitary
(Doran, Hestenes, Sommen & Van Acker, *J. Math. Phys.* 34, 1993).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..algebra.algebra import Algebra
from ..algebra.catalog import orthogonal
from ..algebra.multivector import Multivector, sum_of
from ..algebra.versors import commutator
from ..errors import AlgebraError
from .groups import membership, versor_of_isometry
from .lie import LieAlgebra, bivector_of_matrix, vector_matrix

Complex = NDArray[np.complex128]

_TOLERANCE = 1e-9


@cache
def complex_space(n: int) -> Algebra:
    """Return G(2n), which contains the real vectors of `n` complex numbers."""
    return orthogonal(2 * n)


def complex_structure(n: int) -> Multivector:
    """Return the bivector ``J``, the sum of all ``e_k f_k``."""
    return sum_of(complex_space(n), (_bivector(n, k, n + k) for k in range(n)))


def vector_of_complex(numbers: Sequence[Any] | ArrayLike) -> Multivector:
    """Convert complex numbers to a vector."""
    z = np.asarray(numbers, dtype=complex)
    n = len(z)
    values = [*z.real.tolist(), *z.imag.tolist()]
    return Multivector(complex_space(n), {1 << k: value for k, value in enumerate(values)})


def complex_of_vector(vector: Multivector) -> Complex:
    """Convert a vector to complex numbers."""
    n = _half(vector.algebra)
    return np.array([complex(float(vector[1 << k]), float(vector[1 << n + k])) for k in range(n)])


def times_i(vector: Multivector) -> Multivector:
    """Return the vector of i times the complex numbers: ``v x J``."""
    return commutator(vector, complex_structure(_half(vector.algebra)))


def hermitian_product(a: Multivector, b: Multivector) -> tuple[Any, Any]:
    """Return the real and imaginary part of ``a . b + i (a ^ b) . J``, exactly.

    In complex numbers it is the sum of ``a_k`` times the conjugate of ``b_k``.
    """
    n = _half(a.algebra)
    bivector = (a ^ b).product("scalar_product", complex_structure(n))
    return a.product("scalar_product", b).scalar, bivector.scalar


def unitary_algebra(n: int) -> LieAlgebra:
    """Return u(n): the ``n**2`` bivectors that commute with ``J``.

    ``e_j e_k + f_j f_k`` and ``e_j f_k - f_j e_k`` for ``j < k``, and ``e_k f_k``.
    """
    pairs = [(j, k) for j in range(n) for k in range(j + 1, n)]
    real = [_bivector(n, j, k) + _bivector(n, n + j, n + k) for j, k in pairs]
    imaginary = [_bivector(n, j, n + k) + _bivector(n, k, n + j) for j, k in pairs]
    return LieAlgebra(complex_space(n), (*real, *imaginary, *(_bivector(n, k, n + k) for k in range(n))))


def special_unitary_algebra(n: int) -> LieAlgebra:
    """Return su(n): the ``n**2 - 1`` of these whose product with ``J`` has no scalar part, with traceless matrices."""
    basis = unitary_algebra(n).basis
    steps = [a - b for a, b in zip(basis[-n:], basis[1 - n :], strict=False)] if n > 1 else []
    return LieAlgebra(complex_space(n), (*basis[: n * n - n], *steps))


def skew_hermitian_of_bivector(bivector: Multivector) -> Complex:
    """Return the complex matrix, shape (n, n), of ``v -> B x v``; ``exp(B / 2)`` acts by its exponential.

    Raises
    ------
    AlgebraError
        For a bivector that does not commute with ``J``.
    """
    return _complex_matrix(vector_matrix(bivector).astype(float), "skew_hermitian_of_bivector")


def bivector_of_skew_hermitian(matrix: ArrayLike) -> Multivector:
    """Return the bivector of a matrix with ``M^H = -M``: the inverse of `skew_hermitian_of_bivector`.

    Raises
    ------
    AlgebraError
        For a matrix that is not skew-Hermitian.
    """
    real = real_matrix(matrix)
    return bivector_of_matrix(complex_space(len(real) // 2), real.tolist())


def rotor_of_unitary(matrix: ArrayLike) -> Multivector:
    """Return a rotor of G(2n) that moves vectors by a unitary matrix; its negative does the same.

    Raises
    ------
    AlgebraError
        For a matrix that is not unitary.
    """
    real = real_matrix(matrix)
    return versor_of_isometry(complex_space(len(real) // 2), real.tolist())


def unitary_of_rotor(rotor: Multivector) -> Complex:
    """Return the unitary matrix of a rotor.

    Raises
    ------
    AlgebraError
        For an element that is not a versor, or does not leave ``J`` invariant.
    """
    action = membership(rotor).action
    if action is None:
        raise AlgebraError("unitary_of_rotor", "an element that is not a versor", "a rotor")
    return _complex_matrix(np.array(action, dtype=float), "unitary_of_rotor")


def real_matrix(matrix: ArrayLike) -> NDArray[np.float64]:
    """Return a complex matrix (n, n) as the real one (2n, 2n) on ``(x, y)``: ``[[Re, -Im], [Im, Re]]``."""
    m = np.asarray(matrix, dtype=complex)
    if m.ndim != 2 or m.shape[0] != m.shape[1]:
        raise AlgebraError("complex matrix", f"shape {m.shape}", "a square matrix")
    return np.block([[m.real, -m.imag], [m.imag, m.real]])


def _complex_matrix(real: NDArray[np.float64], where: str) -> Complex:
    n = len(real) // 2
    found = real[:n, :n] + 1j * real[n:, :n]
    if np.abs(real_matrix(found) - real).max(initial=0) > _TOLERANCE * max(1.0, float(np.abs(real).max(initial=0))):
        raise AlgebraError(where, "a map that is not complex linear", "one that commutes with J")
    return found


def _bivector(n: int, j: int, k: int) -> Multivector:
    """Return ``e_j e_k`` of the 2n vectors for any order of the indices."""
    sign = 1 if j < k else -1
    return Multivector(complex_space(n), {1 << j | 1 << k: sign})


def _half(algebra: Algebra) -> int:
    n = algebra.dimension // 2
    if algebra.dimension % 2 or algebra.gram != complex_space(n).gram:
        raise AlgebraError(f"complex vectors in {algebra.name}", "another metric", "complex_space(n), Euclidean of 2n")
    return n
