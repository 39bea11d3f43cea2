"""Dynamics of one robot: the loops of `gacompiler.specs.robots`, unrolled and with the robot's constants folded.

Every function takes a `Chain`, followed by the variables and further arguments, which are expressions in a kernel,
sympy symbols or numbers. Known arguments, such as the zero rates for gravity, are folded like the constants.
"""

from __future__ import annotations

from typing import Any

from ..frontend.loop_trace import written_out
from ..specs import robots as spec
from .accelerations import accelerations
from .chains import Chain, exact
from .exact_tables import Tables, rows_of, tables_of_joints, tables_of_pairs
from .folding import Rows, Scalars, folded, need
from .frames import ZERO
from .inertias import about_origins, base_parameters, carried_by_base
from .mass_matrix import composite_bodies

# Forces.


def inverse_dynamics(chain: Chain, q: Scalars, qd: Scalars, qdd: Scalars) -> tuple[Any, ...]:
    """Compute the joint forces and torques for given accelerations, by the recursive Newton-Euler algorithm.

    Parameters
    ----------
    chain : Chain
        With inertias.
    q, qd, qdd : scalars
        Joint variables, and their first and second time derivatives.

    Returns
    -------
    n scalars
        In N m, or N for prismatic joints.
    """
    return folded(_inverse_dynamics, chain, q=q, qd=qd, qdd=qdd)  # type: ignore[no-any-return]


def _inverse_dynamics(chain: Chain, q: Scalars, qd: Scalars, qdd: Scalars) -> Any:
    return _newton_euler(chain, q, qd, qdd, _gravity_of(chain))


def gravity(chain: Chain, q: Scalars) -> tuple[Any, ...]:
    """Compute the joint forces and torques that balance gravity.

    Parameters
    ----------
    chain : Chain
        With inertias.
    q : scalars

    Returns
    -------
    n scalars
    """
    return folded(_gravity, chain, q=q)  # type: ignore[no-any-return]


def _gravity(chain: Chain, q: Scalars) -> Any:
    still = (0,) * chain.n_variables
    return _newton_euler(chain, q, still, still, _gravity_of(chain))


def coriolis(chain: Chain, q: Scalars, qd: Scalars) -> tuple[Any, ...]:
    """Compute the joint forces and torques due to centrifugal and Coriolis accelerations.

    Parameters
    ----------
    chain : Chain
        With inertias.
    q, qd : scalars

    Returns
    -------
    n scalars
    """
    return folded(_coriolis, chain, q=q, qd=qd)  # type: ignore[no-any-return]


def _coriolis(chain: Chain, q: Scalars, qd: Scalars) -> Any:
    return _newton_euler(chain, q, qd, (0,) * chain.n_variables, ZERO)


def _newton_euler(chain: Chain, q: Scalars, qd: Scalars, qdd: Scalars, weight: Scalars) -> Any:
    given = {"q": q, "qd": qd, "qdd": qdd, "gravity": weight, "armature": _armature_of(chain)}
    return written_out(spec.inverse_dynamics, {**given, **_heavy(chain)})


def mass_matrix(chain: Chain, q: Scalars) -> Rows:
    """Compute the symmetric mass matrix by the composite-rigid-body algorithm.

    Parameters
    ----------
    chain : Chain
        With inertias.
    q : scalars

    Returns
    -------
    n rows of n scalars
    """
    need(chain, "inertias")
    return folded(composite_bodies, chain, q=q)  # type: ignore[no-any-return]


def forward_dynamics(chain: Chain, q: Scalars, qd: Scalars, tau: Scalars) -> tuple[Any, ...]:
    """Compute the accelerations for given joint forces and torques, from the mass matrix.

    The result is NaN if a joint moves no inertia.

    Parameters
    ----------
    chain : Chain
        With inertias.
    q, qd, tau : scalars

    Returns
    -------
    n scalars
    """
    return folded(_forward_dynamics, chain, q=q, qd=qd, tau=tau)  # type: ignore[no-any-return]


def _forward_dynamics(chain: Chain, q: Scalars, qd: Scalars, tau: Scalars) -> Any:
    bias = _inverse_dynamics(chain, q, qd, (0,) * chain.n_variables).elements
    forces = [force - own["1"] for force, own in zip(tau, bias, strict=True)]
    return accelerations(chain, composite_bodies(chain, q), forces)


def coriolis_matrix(chain: Chain, q: Scalars, qd: Scalars) -> Rows:
    """Compute the Coriolis matrix from Christoffel symbols: half the derivative of the Coriolis forces by the rates.

    Parameters
    ----------
    chain : Chain
        With inertias.
    q, qd : scalars

    Returns
    -------
    n rows of n scalars
    """
    return folded(_coriolis_matrix, chain, q=q, qd=qd)  # type: ignore[no-any-return]


def _coriolis_matrix(chain: Chain, q: Scalars, qd: Scalars) -> Any:
    tables = _heavy(chain) | tables_of_pairs(chain)
    return written_out(spec.coriolis_matrix, {"q": q, "qd": qd, **tables})


def inverse_dynamics_derivatives(chain: Chain, q: Scalars, qd: Scalars, qdd: Scalars) -> tuple[Rows, Rows]:
    """Compute the derivatives of `inverse_dynamics` with respect to the variables and their rates.

    Parameters
    ----------
    chain : Chain
        With inertias.
    q, qd, qdd : scalars

    Returns
    -------
    by_q, by_qd : n rows of n scalars
    """
    return folded(_inverse_dynamics_derivatives, chain, q=q, qd=qd, qdd=qdd)  # type: ignore[no-any-return]


def _inverse_dynamics_derivatives(chain: Chain, q: Scalars, qd: Scalars, qdd: Scalars) -> Any:
    given = {"q": q, "qd": qd, "qdd": qdd, "gravity": _gravity_of(chain)}
    return written_out(spec.inverse_dynamics_derivatives, {**given, **_heavy(chain), **tables_of_pairs(chain)})


# Energies and momenta.


def kinetic_energy(chain: Chain, q: Scalars, qd: Scalars) -> Any:
    """Compute the kinetic energy in J, including the rotors of the actuators.

    Parameters
    ----------
    chain : Chain
        With inertias.
    q, qd : scalars

    Returns
    -------
    scalar
    """
    return folded(_kinetic_energy, chain, q=q, qd=qd)


def _kinetic_energy(chain: Chain, q: Scalars, qd: Scalars) -> Any:
    tables = _heavy(chain) | {"armature": _armature_of(chain)}
    return written_out(spec.kinetic_energy, {"q": q, "qd": qd, **tables})


def potential_energy(chain: Chain, q: Scalars) -> Any:
    """Compute the potential energy in J, which is 0 if all centres of mass are at the origin.

    Parameters
    ----------
    chain : Chain
        With inertias.
    q : scalars

    Returns
    -------
    scalar
    """
    return folded(_potential_energy, chain, q=q)


def _potential_energy(chain: Chain, q: Scalars) -> Any:
    weight, (_, moment, _) = _gravity_of(chain), carried_by_base(chain)
    energy = written_out(spec.potential_energy, {"q": q, "gravity": weight, **_heavy(chain)})
    return energy - sum(g * x for g, x in zip(weight, moment, strict=True))


def centre_of_mass(chain: Chain, q: Scalars) -> tuple[Any, ...]:
    """Compute the centre of mass x, y, z of the moving bodies in the base frame.

    Parameters
    ----------
    chain : Chain
        With inertias.
    q : scalars

    Returns
    -------
    3 scalars
    """
    return folded(_centre_of_mass, chain, q=q)  # type: ignore[no-any-return]


def _centre_of_mass(chain: Chain, q: Scalars) -> Any:
    _, point = written_out(spec.centre_of_mass, {"q": q, **tables_of_joints(chain), "inertias": _bodies_of(chain)})
    return tuple(point[name] for name in ("e032", "e013", "e021"))


def centroidal_momentum_matrix(chain: Chain, q: Scalars) -> Rows:
    """Compute the centroidal momentum matrix: angular over linear momentum about the centre of mass, per unit rate.

    Parameters
    ----------
    chain : Chain
        With inertias.
    q : scalars

    Returns
    -------
    6 rows of n scalars
    """
    return folded(_centroidal_momentum_matrix, chain, q=q)  # type: ignore[no-any-return]


def _centroidal_momentum_matrix(chain: Chain, q: Scalars) -> Any:
    tables = tables_of_joints(chain) | {"inertias": _bodies_of(chain)}
    return written_out(spec.centroidal_momentum_matrix, {"q": q, **tables})


# Tables.


def _heavy(chain: Chain) -> Tables:
    """Return the tables of the joints, with the parameters of the inertias that affect forces."""
    need(chain, "inertias")
    return tables_of_joints(chain) | {"inertias": rows_of(base_parameters(chain))}


def _bodies_of(chain: Chain) -> Any:
    need(chain, "inertias")
    return rows_of(about_origins(chain))


def _armature_of(chain: Chain) -> Any:
    return [exact(x) for x in chain.armature] if chain.armature else [0] * chain.n_joints


def _gravity_of(chain: Chain) -> Any:
    return tuple(exact(g) for g in chain.gravity)
