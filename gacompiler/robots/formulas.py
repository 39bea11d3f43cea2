"""Symbolic formulas of robots: motors of rows of Denavit-Hartenberg tables, and Lagrange's equations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..algebra.catalog import PGA3
from ..errors import SpecError
from ..frontend.operations import cos, sin
from .chains import Chain
from .dynamics import kinetic_energy, potential_energy

_E12, _E23, _E01, _E03 = (PGA3.multivector({name: 1}) for name in ("e12", "e23", "e01", "e03"))


def row_motor(theta: Any = 0, d: Any = 0, a: Any = 0, alpha: Any = 0, convention: str = "standard") -> Any:
    """Return the motor of a row of a Denavit-Hartenberg table.

    The product of the motors of all rows is the forward kinematics in closed form.

    Parameters
    ----------
    theta, d, a, alpha : scalars
        Numbers, expressions in a kernel, or sympy symbols, which give symbolic results.
    convention : str
        "standard", or "modified" (Craig).

    Returns
    -------
    Expression or Multivector
    """
    if convention not in ("standard", "modified"):
        raise SpecError("row_motor()", f"convention {convention!r}", "'standard' or 'modified'")
    about_z = (1 - _E03 * (d / 2)) * (cos(theta / 2) - _E12 * sin(theta / 2))
    about_x = (1 - _E01 * (a / 2)) * (cos(alpha / 2) - _E23 * sin(alpha / 2))
    return about_z * about_x if convention == "standard" else about_x * about_z


def lagrange_equations(chain: Chain, q: Sequence[Any], qd: Sequence[Any], qdd: Sequence[Any]) -> tuple[Any, ...]:
    """Derive the joint forces of a small chain as formulas, ``d/dt dT/dqd - dT/dq + dV/dq`` of the energies.

    Parameters
    ----------
    chain : Chain
        With inertias.
    q, qd, qdd : n sympy symbols each
        Joint variables, and their first and second time derivatives.

    Returns
    -------
    n formulas
        Equal to the result of `inverse_dynamics`, which is the efficient method for numerical values.
    """
    kinetic, potential = kinetic_energy(chain, q, qd)["1"], potential_energy(chain, q)["1"]
    forces = []
    for joint, rate in zip(q, qd, strict=True):
        momentum = _derivative(kinetic, rate)
        found = _derivative(potential, joint) - _derivative(kinetic, joint)
        for x, v, a in zip(q, qd, qdd, strict=True):
            found = found + _derivative(momentum, x) * v + _derivative(momentum, v) * a
        forces.append(found)
    return tuple(forces)


def _derivative(formula: Any, symbol: Any) -> Any:
    return formula.diff(symbol) if hasattr(formula, "diff") else 0
