"""Dynamics of trees of joints, by the loop kernels of `generated.robots`."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals
from .differential import Differential


@dataclass(frozen=True, slots=True, eq=False)
class Dynamics(Differential):
    """A robot that has masses. Everything raises `MissingInertiaError` where they are not known."""

    def inverse_dynamics(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Reals:
        """Forces and torques of the joints that give accelerations, gravity included.

        Parameters
        ----------
        q, qd, qdd : array_like, (..., n)
            Joint variables (rad, m), their rates, and the rates of these.

        Returns
        -------
        array, (..., n)
            N m, or N where the joint slides. No friction.

        Raises
        ------
        MissingInertiaError
        TypeError, ValueError
            Where an argument is not an array of n real numbers in its last axis.
        """
        own = self._own.inverse_dynamics
        if own is not None:
            try:
                return own(q, qd, qdd)  # type: ignore[no-any-return]
            except (TypeError, ValueError):
                pass
        attempt = self._attempts.inverse_dynamics
        found = attempt(q, qd, qdd)
        if found is not None:
            return found  # type: ignore[no-any-return]
        self._need_inertia()
        return self._run(self._computed.inverse_dynamics, ("q", "qd", "qdd"), q, qd, qdd)  # type: ignore[no-any-return]

    def gravity(self, q: ArrayLike) -> Reals:
        """Forces and torques (..., n) that hold the robot still.

        Parameters
        ----------
        q : array_like, (..., n)

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        attempt = self._attempts.gravity
        found = attempt(q)
        if found is not None:
            return found  # type: ignore[no-any-return]
        own = self._own.call("gravity", q)
        if own is not None:
            return own  # type: ignore[no-any-return]
        self._need_inertia()
        return self._run(self._computed.gravity, ("q",), q)  # type: ignore[no-any-return]

    def coriolis(self, q: ArrayLike, qd: ArrayLike) -> Reals:
        """Forces and torques (..., n) of centrifugal and Coriolis accelerations: ``coriolis_matrix(q, qd) @ qd``.

        Parameters
        ----------
        q, qd : array_like, (..., n)

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        attempt = self._attempts.coriolis
        found = attempt(q, qd)
        if found is not None:
            return found  # type: ignore[no-any-return]
        own = self._own.call("coriolis", q, qd)
        if own is not None:
            return own  # type: ignore[no-any-return]
        self._need_inertia()
        return self._run(self._computed.coriolis, ("q", "qd"), q, qd)  # type: ignore[no-any-return]

    def coriolis_matrix(self, q: ArrayLike, qd: ArrayLike) -> Reals:
        """The matrix C of Christoffel's symbols, for which the rate of the mass matrix less 2 C is skew.

        ``coriolis`` is quadratic in the speeds, and C is half its derivative by them.

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
        own = self._own.call("coriolis_matrix", q, qd)
        if own is not None:
            return own  # type: ignore[no-any-return]
        self._need_inertia()
        return self._run(self._computed.coriolis_matrix, ("q", "qd"), q, qd)  # type: ignore[no-any-return]

    def mass_matrix(self, q: ArrayLike) -> Reals:
        """The symmetric positive definite matrix (..., n, n) of the kinetic energy ``qdᵀ H qd / 2``.

        Parameters
        ----------
        q : array_like, (..., n)

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        own = self._own.mass_matrix
        if own is not None:
            try:
                return own(q)  # type: ignore[no-any-return]
            except (TypeError, ValueError):
                pass
        attempt = self._attempts.mass_matrix
        found = attempt(q)
        if found is not None:
            return found  # type: ignore[no-any-return]
        self._need_inertia()
        return self._run(self._computed.mass_matrix, ("q",), q)  # type: ignore[no-any-return]

    def inverse_mass_matrix(self, q: ArrayLike) -> Reals:
        """The inverse (..., n, n) of `mass_matrix`: the accelerations under a unit force of each joint.

        By articulated bodies; where joints follow others, from the mass matrix. NaN for all joints of a tree in which
        something moves that has no inertia.

        Parameters
        ----------
        q : array_like, (..., n)

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        self._need_inertia()
        return self._run(self._computed.inverse_mass_matrix, ("q",), q)  # type: ignore[no-any-return]

    def forward_dynamics(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike) -> Reals:
        """Accelerations (..., n) under forces and torques of the joints.

        By articulated bodies (Featherstone 1983), in a time proportional to the number of joints; where joints follow
        others, from the mass matrix. Where that is singular, because a joint moves nothing that has inertia, all
        accelerations of its tree are NaN.

        Parameters
        ----------
        q, qd, tau : array_like, (..., n)

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        attempt = self._attempts.forward_dynamics
        found = attempt(q, qd, tau)
        if found is not None:
            return found  # type: ignore[no-any-return]
        own = self._own.call("forward_dynamics", q, qd, tau)
        if own is not None:
            return own  # type: ignore[no-any-return]
        self._need_inertia()
        return self._run(self._computed.forward_dynamics, ("q", "qd", "tau"), q, qd, tau)  # type: ignore[no-any-return]

    def inverse_dynamics_derivatives(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> tuple[Reals, Reals]:
        """Derivatives of `inverse_dynamics` by the variables and by their rates; those by `qdd` are the mass matrix.

        Parameters
        ----------
        q, qd, qdd : array_like, (..., n)

        Returns
        -------
        by_q, by_qd : array, (..., n, n)
            Rows are forces, columns what they are differentiated by.

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        own = self._own.call("inverse_dynamics_derivatives", q, qd, qdd)
        if own is not None:
            return own[0], own[1]
        self._need_inertia()
        by_q, by_qd = self._run(self._computed.inverse_dynamics_derivatives, ("q", "qd", "qdd"), q, qd, qdd)
        return by_q, by_qd

    def forward_dynamics_derivatives(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike) -> tuple[Reals, Reals, Reals]:
        """Derivatives of `forward_dynamics` by the variables, their rates, and the forces.

        Parameters
        ----------
        q, qd, tau : array_like, (..., n)

        Returns
        -------
        by_q, by_qd, by_tau : array, (..., n, n)
            Rows are accelerations; the last is the inverse of the mass matrix.

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        by_q, by_qd = self.inverse_dynamics_derivatives(q, qd, self.forward_dynamics(q, qd, tau))
        inverse = self.inverse_mass_matrix(q)
        less = -inverse
        if by_q.ndim == inverse.ndim == 2:
            # `matmul` takes twice as long for small matrices: it looks for further axes.
            return np.dot(less, by_q), np.dot(less, by_qd), inverse
        by_tau = inverse if inverse.shape == by_q.shape else np.broadcast_to(inverse, by_q.shape).copy()
        return less @ by_q, less @ by_qd, by_tau

    def inverse_dynamics_slopes(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> tuple[Reals, Reals]:
        """The former name of `inverse_dynamics_derivatives`, with a DeprecationWarning."""
        _warn_of_name("inverse_dynamics")
        return self.inverse_dynamics_derivatives(q, qd, qdd)

    def forward_dynamics_slopes(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike) -> tuple[Reals, Reals, Reals]:
        """The former name of `forward_dynamics_derivatives`, with a DeprecationWarning."""
        _warn_of_name("forward_dynamics")
        return self.forward_dynamics_derivatives(q, qd, tau)

    def torque_regressor(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Reals:
        """The matrix that gives the forces of the joints from the inertias, for their identification.

        Parameters
        ----------
        q, qd, qdd : array_like, (..., n)

        Returns
        -------
        array, (..., n, N, 10)
            ``np.einsum("...ijk,jk->...i", regressor, robot.link_inertias)`` are the forces of `inverse_dynamics`
            without those of armatures. It does not depend on the masses of the robot.

        Raises
        ------
        TypeError, ValueError
            As in `inverse_dynamics`.
        """
        return self._run(self._computed.torque_regressor, ("q", "qd", "qdd"), q, qd, qdd)  # type: ignore[no-any-return]

    @property
    def link_inertias(self) -> Reals:
        """(N, 10), the inertias of what the joints carry, as `torque_regressor` is multiplied with them.

        Mass, mass times centre, and the tensor about the origin, xx, xy, xz, yy, yz, zz, where all variables are 0.
        The frame is parallel to the base frame, and its origin is on the joint's axis: the point nearest to the origin
        of the joint that carries it or, for a joint that the base carries, to the frame after joint `tip`.

        Raises
        ------
        MissingInertiaError
        """
        self._need_inertia()
        return self._computed.inertias

    def centre_of_mass(self, q: ArrayLike) -> Reals:
        """The centre of mass (..., 3) of everything that moves, in the base frame, m; NaN where nothing has mass.

        Parameters
        ----------
        q : array_like, (..., n)

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        attempt = self._attempts.centre_of_mass
        found = attempt(q)
        if found is not None:
            return found  # type: ignore[no-any-return]
        own = self._own.call("centre_of_mass", q)
        if own is not None:
            return own  # type: ignore[no-any-return]
        self._need_inertia()
        return self._run(self._computed.centre_of_mass, ("q",), q)  # type: ignore[no-any-return]

    def centroidal_momentum_matrix(self, q: ArrayLike) -> Reals:
        """The matrix (..., 6, n) that gives momenta about the centre of mass from rates: angular over linear.

        In the directions of the base frame, without the momenta of the motors' rotors; NaN where nothing has mass.

        Parameters
        ----------
        q : array_like, (..., n)

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        attempt = self._attempts.centroidal_momentum_matrix
        found = attempt(q)
        if found is not None:
            return found  # type: ignore[no-any-return]
        own = self._own.call("centroidal_momentum_matrix", q)
        if own is not None:
            return own  # type: ignore[no-any-return]
        self._need_inertia()
        return self._run(self._computed.centroidal_momentum_matrix, ("q",), q)  # type: ignore[no-any-return]

    def centroidal_momentum(self, q: ArrayLike, qd: ArrayLike) -> Reals:
        """The momentum (..., 6) about the centre of mass: angular over linear.

        Parameters
        ----------
        q, qd : array_like, (..., n)

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        shape, (flat, speeds) = self._together((q, "q"), (qd, "qd"))
        found: Reals = np.einsum("bij,bj->bi", self.centroidal_momentum_matrix(flat), speeds)
        return found.reshape(*shape, 6)

    def kinetic_energy(self, q: ArrayLike, qd: ArrayLike) -> Reals:
        """``qdᵀ H qd / 2`` (...), J.

        Parameters
        ----------
        q, qd : array_like, (..., n)

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        attempt = self._attempts.kinetic_energy
        found = attempt(q, qd)
        if found is not None:
            return found  # type: ignore[no-any-return]
        own = self._own.call("kinetic_energy", q, qd)
        if own is not None:
            return own  # type: ignore[no-any-return]
        self._need_inertia()
        return self._run(self._computed.kinetic_energy, ("q", "qd"), q, qd)  # type: ignore[no-any-return]

    def potential_energy(self, q: ArrayLike) -> Reals:
        """The energy (...) of height, J; zero where all centres of mass are level with the base's origin.

        Parameters
        ----------
        q : array_like, (..., n)

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        attempt = self._attempts.potential_energy
        found = attempt(q)
        if found is not None:
            return found  # type: ignore[no-any-return]
        own = self._own.call("potential_energy", q)
        if own is not None:
            return own  # type: ignore[no-any-return]
        self._need_inertia()
        return self._run(self._computed.potential_energy, ("q",), q)  # type: ignore[no-any-return]


def _warn_of_name(what: str) -> None:
    """Warn the caller of a method that has another name now."""
    warnings.warn(
        f"{what}_slopes is now {what}_derivatives, and will be removed in version 0.2", DeprecationWarning, stacklevel=3
    )
