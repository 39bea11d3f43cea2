"""Dynamics of kinematic trees, computed by the loop kernels of `generated.robots`. One class in one file."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import matrices

from ..arguments import Reals
from .differential import Differential

_SMALL = 12
"""Two products of single matrices with at most this many rows take less time in a kernel than two calls of BLAS."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Dynamics(Differential):
    """A robot with inertial parameters. Methods raise `MissingInertiaError` if the parameters are unknown."""

    def inverse_dynamics(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Reals:
        """Return the joint forces and torques that produce given accelerations under gravity.

        Parameters
        ----------
        q, qd, qdd : array_like, (..., n)
            Joint variables (rad, m), velocities and accelerations.

        Returns
        -------
        array, (..., n)
            N m, or N for prismatic joints. Friction is not included.

        Raises
        ------
        MissingInertiaError
        TypeError, ValueError
            If an argument is not an array of real numbers whose last axis has length n.
        """
        found: Reals | None = self._attempts.inverse_dynamics(q, qd, qdd)
        return self._evaluate("inverse_dynamics", q, qd, qdd) if found is None else found

    def gravity(self, q: ArrayLike) -> Reals:
        """Return the forces and torques (..., n) that hold the robot at rest.

        Parameters
        ----------
        q : array_like, (..., n)

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        found: Reals | None = self._attempts.gravity(q)
        return self._evaluate("gravity", q) if found is None else found

    def coriolis(self, q: ArrayLike, qd: ArrayLike) -> Reals:
        """Return the centrifugal and Coriolis forces and torques (..., n): ``coriolis_matrix(q, qd) @ qd``.

        Parameters
        ----------
        q, qd : array_like, (..., n)

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        found: Reals | None = self._attempts.coriolis(q, qd)
        return self._evaluate("coriolis", q, qd) if found is None else found

    def coriolis_matrix(self, q: ArrayLike, qd: ArrayLike) -> Reals:
        """Return the Coriolis matrix C of Christoffel symbols.

        The time derivative of the mass matrix minus 2 C is skew-symmetric. ``coriolis`` is quadratic in the velocities,
        and C is half its derivative with respect to them.

        Parameters
        ----------
        q, qd : array_like, (..., n)

        Returns
        -------
        array, (..., n, n)

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        found: Reals | None = self._attempts.coriolis_matrix(q, qd)
        return self._evaluate("coriolis_matrix", q, qd) if found is None else found

    def mass_matrix(self, q: ArrayLike) -> Reals:
        """Return the mass matrix H (..., n, n), which is symmetric and positive definite.

        The kinetic energy is ``qdᵀ H qd / 2``.

        Parameters
        ----------
        q : array_like, (..., n)

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        found: Reals | None = self._attempts.mass_matrix(q)
        return self._evaluate("mass_matrix", q) if found is None else found

    def inverse_mass_matrix(self, q: ArrayLike) -> Reals:
        """Return the inverse (..., n, n) of `mass_matrix`: the accelerations under a unit force at each joint.

        Computed by the articulated-body algorithm, or from the mass matrix if joints follow others (mimic). The entries
        of all joints of a tree are NaN if some of its joints move no inertia.

        Parameters
        ----------
        q : array_like, (..., n)

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        found: Reals | None = self._attempts.inverse_mass_matrix(q)
        return self._evaluate("inverse_mass_matrix", q) if found is None else found

    def forward_dynamics(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike) -> Reals:
        """Return the accelerations (..., n) under given joint forces and torques.

        Computed by the articulated-body algorithm (Featherstone 1983), in time proportional to the number of joints, or
        from the mass matrix if joints follow others (mimic). If the mass matrix is singular because a joint moves no
        inertia, all accelerations of its tree are NaN.

        Parameters
        ----------
        q, qd, tau : array_like, (..., n)

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        found: Reals | None = self._attempts.forward_dynamics(q, qd, tau)
        return self._evaluate("forward_dynamics", q, qd, tau) if found is None else found

    def inverse_dynamics_derivatives(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> tuple[Reals, Reals]:
        """Return the derivatives of `inverse_dynamics` with respect to `q` and `qd`.

        The derivative with respect to `qdd` is the mass matrix.

        Parameters
        ----------
        q, qd, qdd : array_like, (..., n)

        Returns
        -------
        by_q, by_qd : array, (..., n, n)
            Rows correspond to forces, columns to the variables of differentiation.

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        attempt = self._attempts.inverse_dynamics_derivatives
        found: tuple[Reals, Reals] | None = attempt(q, qd, qdd)
        if found is not None:
            return found
        by_q, by_qd = self._run(self._computed.inverse_dynamics_derivatives, ("q", "qd", "qdd"), q, qd, qdd)
        return by_q, by_qd

    def forward_dynamics_derivatives(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike) -> tuple[Reals, Reals, Reals]:
        """Return the derivatives of `forward_dynamics` with respect to `q`, `qd` and `tau`.

        Parameters
        ----------
        q, qd, tau : array_like, (..., n)

        Returns
        -------
        by_q, by_qd, by_tau : array, (..., n, n)
            Rows correspond to accelerations. `by_tau` is the inverse of the mass matrix.

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        attempt = self._attempts.forward_dynamics_derivatives
        found: tuple[Reals, Reals, Reals] | None = attempt(q, qd, tau)
        if found is None:
            found = self._run(self._computed.forward_dynamics_derivatives, ("q", "qd", "tau"), q, qd, tau)
        by_q, by_qd, inverse = found
        if by_q.ndim == 2 and len(inverse) > _SMALL:
            return np.dot(-inverse, by_q), np.dot(-inverse, by_qd), inverse
        return *matrices.derivatives_of_solution(inverse, by_q, by_qd), inverse

    def inverse_dynamics_slopes(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> tuple[Reals, Reals]:
        """Return `inverse_dynamics_derivatives` under its deprecated name, with a DeprecationWarning."""
        _warn_of_deprecated_name("inverse_dynamics")
        return self.inverse_dynamics_derivatives(q, qd, qdd)

    def forward_dynamics_slopes(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike) -> tuple[Reals, Reals, Reals]:
        """Return `forward_dynamics_derivatives` under its deprecated name, with a DeprecationWarning."""
        _warn_of_deprecated_name("forward_dynamics")
        return self.forward_dynamics_derivatives(q, qd, tau)

    def torque_regressor(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Reals:
        """Return the matrix that maps inertial parameters to joint forces, for identification.

        Parameters
        ----------
        q, qd, qdd : array_like, (..., n)

        Returns
        -------
        array, (..., n, N, 10)
            ``np.einsum("...ijk,jk->...i", regressor, robot.link_inertias)`` gives the forces of `inverse_dynamics`
            without the contribution of the armatures. The regressor does not depend on the masses of the robot.

        Raises
        ------
        TypeError, ValueError
            As in `inverse_dynamics`.
        """
        found: Reals | None = self._attempts.torque_regressor(q, qd, qdd)
        return self._evaluate("torque_regressor", q, qd, qdd) if found is None else found

    @property
    def link_inertias(self) -> Reals:
        """Inertial parameters (N, 10) of the links, as multiplied by `torque_regressor`.

        Each row holds the mass, the mass times the centre of mass, and the inertia tensor about the origin (xx, xy, xz,
        yy, yz, zz), at the zero configuration. The frame is parallel to the base frame. Its origin is the point of the
        joint's axis that is nearest to the origin of the parent joint or, for a joint that the base carries, to the
        frame after joint `tip`.

        Raises
        ------
        MissingInertiaError
        """
        return self._computed.inertias

    def centre_of_mass(self, q: ArrayLike) -> Reals:
        """Return the centre of mass (..., 3) of all moving links in the base frame, m. NaN if the total mass is zero.

        Parameters
        ----------
        q : array_like, (..., n)

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        found: Reals | None = self._attempts.centre_of_mass(q)
        return self._evaluate("centre_of_mass", q) if found is None else found

    def centroidal_momentum_matrix(self, q: ArrayLike) -> Reals:
        """Return the centroidal momentum matrix (..., 6, n): angular over linear rows.

        It maps joint velocities to the momentum about the centre of mass, expressed in the directions of the base
        frame. Rotor momenta are not included. NaN if the total mass is zero.

        Parameters
        ----------
        q : array_like, (..., n)

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        found: Reals | None = self._attempts.centroidal_momentum_matrix(q)
        return self._evaluate("centroidal_momentum_matrix", q) if found is None else found

    def centroidal_momentum(self, q: ArrayLike, qd: ArrayLike) -> Reals:
        """Return the momentum (..., 6) about the centre of mass: angular over linear.

        Parameters
        ----------
        q, qd : array_like, (..., n)

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        found: Reals | None = self._attempts.centroidal_momentum(q, qd)
        return self._evaluate("centroidal_momentum", q, qd) if found is None else found

    def kinetic_energy(self, q: ArrayLike, qd: ArrayLike) -> Reals:
        """Return the kinetic energy ``qdᵀ H qd / 2``, (...), J.

        Parameters
        ----------
        q, qd : array_like, (..., n)

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        found: Reals | None = self._attempts.kinetic_energy(q, qd)
        return self._evaluate("kinetic_energy", q, qd) if found is None else found

    def potential_energy(self, q: ArrayLike) -> Reals:
        """Return the gravitational potential energy (...), J.

        It is zero where all centres of mass are level with the origin of the base.

        Parameters
        ----------
        q : array_like, (..., n)

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        found: Reals | None = self._attempts.potential_energy(q)
        return self._evaluate("potential_energy", q) if found is None else found


def _warn_of_deprecated_name(what: str) -> None:
    """Warn the caller of a method that has been renamed."""
    warnings.warn(
        f"{what}_slopes is now {what}_derivatives; the old name will be removed in version 0.3",
        DeprecationWarning,
        stacklevel=3,
    )
