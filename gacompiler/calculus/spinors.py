"""Pauli and Dirac spinors as even multivectors, and their conversion from and to columns.

Doran & Lasenby 2003, §8.1 and §8.3. A Pauli spinor is an even element of VGA3, ``psi = a0 + a1 e23 + a2 e31 + a3 e12``.
A Dirac spinor is an even element of STA. Multiplication of a column by the imaginary unit becomes multiplication of the
spinor by ``I sigma3`` from the right, which is ``e12`` in VGA3 and ``g2 g1`` in STA.

====================  ====================
columns               multivectors
====================  ====================
``sigma_k |psi>``     ``e_k psi e3``
``i |psi>``           ``psi e12``
``gamma_mu |psi>``    ``g_mu psi g0``
``i |psi>``           ``psi g2 g1``
``gamma_5 |psi>``     ``psi g3 g0``
====================  ====================

Indices are lower indices, so ``gamma_5 = -i gamma_0 gamma_1 gamma_2 gamma_3``.
"""

from __future__ import annotations

from typing import Any

import sympy

from ..algebra.catalog import STA, VGA3
from ..errors import AlgebraError
from ..symbolic import multivector
from ..symbolic.multivector import SymbolicMultivector


def pauli_matrices() -> tuple[Any, ...]:
    """Return the three Pauli matrices."""
    i = sympy.I
    return (
        sympy.Matrix([[0, 1], [1, 0]]),
        sympy.Matrix([[0, -i], [i, 0]]),
        sympy.Matrix([[1, 0], [0, -1]]),
    )


def dirac_matrices() -> tuple[Any, ...]:
    """Return ``gamma_0`` to ``gamma_3`` in the Dirac representation; their squares are 1, -1, -1, -1."""
    identity, zero = sympy.eye(2), sympy.zeros(2)
    first = sympy.Matrix(sympy.BlockMatrix([[identity, zero], [zero, -identity]]))
    return first, *(sympy.Matrix(sympy.BlockMatrix([[zero, -sigma], [sigma, zero]])) for sigma in pauli_matrices())


def pauli_spinor(column: Any) -> SymbolicMultivector:
    """Return the even element of VGA3 for a column of two complex numbers."""
    upper, lower = (_parts(entry) for entry in _column(column, 2))
    return multivector(VGA3, {"1": upper[0], "e23": lower[1], "e31": -lower[0], "e12": upper[1]})


def pauli_column(spinor: SymbolicMultivector) -> Any:
    """Return the column of two complex numbers for an even element of VGA3 with real coefficients."""
    _even(spinor, VGA3)
    i = sympy.I
    return sympy.Matrix([spinor["1"] + i * spinor["e12"], -spinor["e31"] + i * spinor["e23"]])


def dirac_spinor(column: Any) -> SymbolicMultivector:
    """Return the even element of STA for a column of four complex numbers."""
    entries = _column(column, 4)
    phi, eta = (_in_spacetime(pauli_spinor(entries[k : k + 2])) for k in (0, 2))
    return phi + eta * _sigma(3)


def dirac_column(spinor: SymbolicMultivector) -> Any:
    """Return the column of four complex numbers for an even element of STA with real coefficients."""
    _even(spinor, STA)
    g0 = STA.basis()[0]
    conjugated = g0 * spinor * g0
    upper = (spinor + conjugated) / 2
    lower = (spinor - conjugated) / 2 * _sigma(3)
    return sympy.Matrix.vstack(pauli_column(_in_space(upper)), pauli_column(_in_space(lower)))


def _sigma(k: int) -> SymbolicMultivector:
    basis = STA.basis()
    return multivector(STA, basis[k] * basis[0])


_PLANES = {"e23": (2, 3), "e31": (3, 1), "e12": (1, 2)}
"""``e_j e_k`` becomes ``sigma_j sigma_k = -g_j g_k``."""


def _in_spacetime(spinor: SymbolicMultivector) -> SymbolicMultivector:
    total = multivector(STA, spinor["1"])
    for plane, (j, k) in _PLANES.items():
        total = total + spinor[plane] * (_sigma(j) * _sigma(k))
    return total


def _in_space(element: SymbolicMultivector) -> SymbolicMultivector:
    return multivector(VGA3, {"1": element["1"], **{plane: -element[f"g{j}g{k}"] for plane, (j, k) in _PLANES.items()}})


def _column(column: Any, n: int) -> list[Any]:
    entries = [sympy.sympify(entry) for entry in column]
    if len(entries) != n:
        raise AlgebraError("spinor", f"a column of {len(entries)} entries", f"{n} complex numbers")
    return entries


def _parts(entry: Any) -> tuple[Any, Any]:
    real, imaginary = sympy.expand(entry, complex=True).as_real_imag()
    return real, imaginary


def _even(spinor: SymbolicMultivector, algebra: Any) -> None:
    if not isinstance(spinor, SymbolicMultivector) or spinor.algebra != algebra or any(k & 1 for k in spinor.grades):
        raise AlgebraError("spinor", f"{spinor!r}", f"an even element of {algebra.name}")
