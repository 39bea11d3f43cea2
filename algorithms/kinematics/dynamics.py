"""Dynamics of trees of joints: momenta and wrenches are lines, and a twist joined with a wrench is a power.

Everything is in the base frame, or beside it where that is far away (`Model._near`): what a joint's motion did to a
body is done to its inertia (`inertia_of_moved_body`), and inertias about the common origin add up. Recursive
Newton-Euler (Luh, Walker and Paul, *J. Dynamic Systems* 102:69, 1980); the mass matrix by composite bodies (Walker and
Orin, same journal, 104:205, 1982). One class and its passes, so one file.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals
from .chains import blocks, joint_twists, motions, room
from .differential import Differential

Torque = Callable[[float, Reals, Reals], ArrayLike]
"""Forces of the joints from time, joint variables (..., n) and speeds (..., n)."""


@dataclass(frozen=True, slots=True)
class Motion:
    """How everything moves in a block of states, one array for each joint; in the base frame.

    Attributes
    ----------
    axes : list of array, (..., 6)
        Twists of the joints at unit speed.
    base_rate : array, (6,)
        The rate of the base's twist; gravity counts as its acceleration upwards.
    twists, rates : list of array, (..., 6)
        Of what each joint carries.
    inertias : list of array, (..., 10)
        About the origin.
    wrenches : list of array, (..., 6)
        Through each joint.
    """

    axes: list[Reals]
    base_rate: Reals
    twists: list[Reals]
    rates: list[Reals]
    inertias: list[Reals]
    wrenches: list[Reals]


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
        else:
            one = self._passes.inverse_dynamics(self._heavy, q, qd, qdd)
            if one is not None:
                return one  # type: ignore[no-any-return]
        self._need_inertia()
        shape, flat = self._together((q, "q"), (qd, "qd"), (qdd, "qdd"))
        return self._forces(flat[0], flat[1], flat[2]).reshape(*shape, self.n_joints)

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
        still = self._still
        if self._own.inverse_dynamics is None:
            one = self._passes.gravity(self._heavy, q)
            if one is not None:
                return one  # type: ignore[no-any-return]
        if type(q) is not np.ndarray or q.dtype is not still.dtype:
            still = np.zeros(self.n_joints, self._variables(q, "q")[0].dtype)
        return self.inverse_dynamics(q, still, still)

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
        one = self._passes.inverse_dynamics(self._weightless, q, qd, self._still)
        if one is not None:
            return one  # type: ignore[no-any-return]
        self._need_inertia()
        shape, (flat, speeds) = self._together((q, "q"), (qd, "qd"))
        still = np.zeros_like(flat)
        found = self._forces(flat, speeds, still, without_gravity=True)
        return found.reshape(*shape, self.n_joints)

    def coriolis_matrix(self, q: ArrayLike, qd: ArrayLike) -> Reals:
        """The matrix C of Christoffel's symbols, for which the rate of the mass matrix less 2 C is skew.

        ``coriolis`` is quadratic in the speeds, and C is half its derivative by them: a difference of two of its
        values, which is exact for quadratic functions, gives a column.

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
        one = self._passes.coriolis_matrix(self._heavy, q, qd)
        if one is not None:
            return one  # type: ignore[no-any-return]
        self._need_inertia()
        shape, (flat, speeds) = self._together((q, "q"), (qd, "qd"))
        n, steps = self.n_joints, np.eye(self.n_joints, dtype=flat.dtype)
        found = np.empty((len(flat), n, n), flat.dtype)
        still = np.zeros_like(flat)
        for j, step in enumerate(steps):
            ahead = self._forces(flat, speeds + step, still, without_gravity=True)
            behind = self._forces(flat, speeds - step, still, without_gravity=True)
            found[:, :, j] = (ahead - behind) / 4
        return found.reshape(*shape, n, n)

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
        else:
            one = self._passes.mass_matrix(self._heavy, q)
            if one is not None:
                return one  # type: ignore[no-any-return]
        self._need_inertia()
        q, flat = self._variables(q, "q")
        count = len(self.kinds)
        if self._kernels.mass_matrix is not None:
            found = self._folded(self._kernels.mass_matrix, self._positions(q))
        else:
            found = np.zeros((len(flat), count, count), q.dtype)
            for block in blocks(len(flat)):
                self._fill_mass_matrix(self._positions(flat[block]), found[block])
        found = self._reduced(np.swapaxes(self._reduced(found), -1, -2)) if self.coupling.size else found
        return found.reshape(*q.shape, self.n_joints)

    def forward_dynamics(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike) -> Reals:
        """Accelerations (..., n) under forces and torques of the joints.

        The mass matrix, factorised, against what is left of the forces: for a few joints that is less work than
        articulated bodies, and it is as accurate as the matrix is well conditioned. Where the matrix is not positive
        definite, because something moves that has no inertia, the accelerations are NaN.

        Parameters
        ----------
        q, qd, tau : array_like, (..., n)

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        own, one = self._own, None
        if own.inverse_dynamics is None or own.mass_matrix is None:
            one = self._passes.forward_dynamics(self._heavy, q, qd, tau)
        elif type(q) is np.ndarray and q.ndim == 1:
            try:
                matrix, bias = own.mass_matrix(q), own.inverse_dynamics(q, qd, self._still)
                one = self._passes.solved(self._heavy, matrix, bias, tau)
            except (TypeError, ValueError):
                pass
        if one is not None:
            return one  # type: ignore[no-any-return]
        self._need_inertia()
        shape, (flat, speeds, forces) = self._together((q, "q"), (qd, "qd"), (tau, "tau"))
        found = forces - self._forces(flat, speeds, np.zeros_like(flat))
        matrix = np.ascontiguousarray(self.mass_matrix(flat))
        _solve_positive(matrix if matrix.base is None else matrix.copy(), found)
        return found.reshape(*shape, self.n_joints)

    def kinetic_energy(self, q: ArrayLike, qd: ArrayLike) -> Reals:
        """``qdᵀ H qd / 2`` (...), J; a number for one configuration.

        Parameters
        ----------
        q, qd : array_like, (..., n)

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        one = self._passes.kinetic_energy(self._heavy, q, qd)
        if one is not None:
            return one  # type: ignore[no-any-return]
        shape, (flat, speeds) = self._together((q, "q"), (qd, "qd"))
        energy: Reals = np.einsum("bi,bij,bj->b", speeds, self.mass_matrix(flat), speeds) / 2
        return energy.reshape(shape)[()]

    def potential_energy(self, q: ArrayLike) -> Reals:
        """The energy (...) of height, J; zero where all centres of mass are level with the base's origin.

        It is a number for one configuration.

        Parameters
        ----------
        q : array_like, (..., n)

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        """
        one = self._passes.potential_energy(None if self._heavy is None else self._table, q)
        if one is not None:
            return one  # type: ignore[no-any-return]
        self._need_inertia()
        q, flat = self._variables(q, "q")
        found = np.zeros(len(flat), q.dtype)
        for block in blocks(len(flat)):
            for motor, body in zip(motions(self, self._positions(flat[block])), self.bodies, strict=True):
                centres = pga3.move_point(motor, body[1:4].astype(q.dtype))
                found[block] -= centres @ (body[0] * self.free_fall).astype(q.dtype)
        return found.reshape(q.shape[:-1])[()]

    def simulate(
        self, q: ArrayLike, qd: ArrayLike, step: float, n_steps: int, torque: Torque | None = None
    ) -> tuple[Reals, Reals]:
        """Motion under gravity and the forces of the joints, by Gauss's collocation with four stages.

        The method has order 8 and is symmetric in time: where no forces act, the energy does not drift. Over 10 s of a
        double pendulum that turns over, in steps of 5 ms, it stays within 1e-10 J of 10. Stages are found by iteration
        until they stay.

        Parameters
        ----------
        q, qd : array_like, (..., n)
            At time 0.
        step : float
            s.
        n_steps : int
        torque : callable, optional
            ``torque(time, q, qd)`` gives (..., n) forces of the joints; without one there are none.

        Returns
        -------
        q, qd : array, (n_steps + 1, ..., n)
            With the start.

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        ArithmeticError
            Where the stages do not settle: the step is too long.
        """
        shape, (position, speed) = self._start(q, qd)
        positions, speeds = [position], [speed]

        def rates(times: Reals, x: Reals, v: Reals) -> Reals:
            """Accelerations at all stages (stages, B, n) at once, where the motion `x` has led from `position`."""
            places, forces = self.integrate(position, x), np.zeros_like(v)
            if torque is not None:
                for time, place, speed, force in zip(times, places, v, forces, strict=True):
                    force.reshape(*shape, -1)[...] = torque(time, place.reshape(*shape, -1), speed.reshape(*shape, -1))
            with np.errstate(over="ignore", invalid="ignore"):  # what diverges has an error
                return self.forward_dynamics(places, v, forces)

        still = np.zeros_like(speed)
        accelerations = np.repeat(rates(np.zeros(1), still[None], speed[None]), len(_TIMES), axis=0)
        for k in range(n_steps):
            motion, speed, accelerations = _gauss_step(rates, self._straight, k * step, step, speed, accelerations)
            position = self.integrate(position, motion)
            positions.append(position)
            speeds.append(speed)
        return (
            np.array(positions).reshape(n_steps + 1, *shape, self.n_positions),
            np.array(speeds).reshape(n_steps + 1, *shape, self.n_joints),
        )

    def _start(self, q: ArrayLike, qd: ArrayLike) -> tuple[tuple[int, ...], list[Reals]]:
        """The leading axes of configurations and speeds, and both as rows."""
        return self._together((q, "q"), (qd, "qd"))

    def _straight(self, x: Reals, v: Reals) -> Reals:
        """Rates of the motion `x` from some configuration, at velocities `v`: see `integrate`."""
        return v

    def _forces(self, q: Reals, qd: Reals, qdd: Reals, without_gravity: bool = False) -> Reals:
        """Inverse dynamics of rows of variables."""
        kernel = self._kernels.inverse_dynamics
        if kernel is not None:
            x, v, a = self._positions(q), self._rates(qd), self._rates(qdd)
            found = self._folded(kernel, x, v, a)
            if without_gravity:
                found = found - self._folded(kernel, x, np.zeros_like(v), np.zeros_like(a))
            return self._reduced(found)
        found = np.empty((len(q), len(self.kinds)), q.dtype)
        free_fall = np.zeros(3) if without_gravity else self.free_fall
        for block in blocks(len(q)):
            x, v, a = self._positions(q[block]), self._rates(qd[block]), self._rates(qdd[block])
            self._newton_euler(x, v, a, free_fall, found[block])
        return self._reduced(found)

    def _newton_euler(self, x: Reals, v: Reals, a: Reals, free_fall: Reals, out: Reals) -> None:
        now = self._moving(x, v, a, free_fall)
        for j, (axis, wrench) in enumerate(zip(now.axes, now.wrenches, strict=True)):
            out[..., j] = pga3.power(axis, wrench)
        out += self.armature.astype(x.dtype) * a

    def _moving(self, x: Reals, v: Reals, a: Reals, free_fall: Reals) -> Motion:
        """Newton and Euler: outward through the joints, and back."""
        moved = motions(self._near, x)
        axes, bodies = joint_twists(self._near, moved), self._near.bodies.astype(x.dtype)
        now = Motion(axes, np.concatenate([np.zeros(3), -free_fall]).astype(x.dtype), [], [], [], [])
        base = np.zeros(6, x.dtype), now.base_rate
        for j, parent in enumerate(self.parents):
            twist, rate, wrench, inertia = room(6, x), room(6, x), room(6, x), room(10, x)
            before = (now.twists[parent], now.rates[parent]) if parent >= 0 else base
            pga3.twist_after_joint(before[0], axes[j], v[..., j], out=twist)
            pga3.twist_rate_after_joint(*before, axes[j], v[..., j], a[..., j], out=rate)
            pga3.inertia_of_moved_body(moved[j], bodies[j], out=inertia)
            pga3.inertial_wrench(inertia, twist, rate, out=wrench)
            now.twists.append(twist)
            now.rates.append(rate)
            now.inertias.append(inertia)
            now.wrenches.append(wrench)
        for j in reversed(range(len(self.kinds))):
            if self.parents[j] >= 0:
                now.wrenches[self.parents[j]] += now.wrenches[j]
        return now

    def _fill_mass_matrix(self, x: Reals, out: Reals) -> None:
        moved = motions(self._near, x)
        axes, bodies = joint_twists(self._near, moved), self._near.bodies.astype(x.dtype)
        composite = [
            pga3.inertia_of_moved_body(m, body, out=room(10, x)) for m, body in zip(moved, bodies, strict=True)
        ]
        wrench = room(6, x)
        for j in reversed(range(len(self.kinds))):
            pga3.momentum(composite[j], axes[j], out=wrench)
            ancestor = j
            while ancestor >= 0:
                out[..., j, ancestor] = out[..., ancestor, j] = pga3.power(axes[ancestor], wrench)
                ancestor = self.parents[ancestor]
            out[..., j, j] += self.armature[j]
            if self.parents[j] >= 0:
                composite[self.parents[j]] += composite[j]


def _collocation(points: Reals) -> tuple[Reals, Reals, Reals]:
    """For nodes in (0, 1): integrals of Lagrange's polynomials to each node, to 1, and their values one step later."""
    powers = np.arange(len(points))
    basis = np.linalg.inv(points[:, None] ** powers)
    to_node = points[:, None] ** (powers + 1) / (powers + 1) @ basis
    return to_node, 1 / (powers + 1) @ basis, (1 + points[:, None]) ** powers @ basis


_TIMES = (np.polynomial.legendre.leggauss(4)[0] + 1) / 2
_STAGES, _WEIGHTS, _AHEAD = _collocation(_TIMES)
_SETTLED, _TRIES = 1e-14, 60


def _gauss_step(
    rates: Callable[[Reals, Reals, Reals], Reals],
    straight: Callable[[Reals, Reals], Reals],
    time: float,
    step: float,
    qd: Reals,
    start: Reals,
) -> tuple[Reals, Reals, Reals]:
    """One step of Gauss's method (Hairer, Lubich and Wanner, *Geometric Numerical Integration*, II.1.3).

    The motion from the configuration at the start, the speeds after it, and the accelerations at the stages, carried
    on, which the next step starts from. Where the base floats, the motion's coordinates are those of the exponential
    (Munthe-Kaas, *Applied Numerical Mathematics* 29:115, 1999).
    """
    accelerations = start
    slides = qd + step * np.tensordot(_STAGES, accelerations, 1)
    for _ in range(_TRIES):
        speeds = qd + step * np.tensordot(_STAGES, accelerations, 1)
        before, places = slides, step * np.tensordot(_STAGES, slides, 1)
        slides = straight(places, speeds)
        found = rates(time + step * _TIMES, places, speeds)
        change = max(np.abs(found - accelerations).max(initial=0.0) * step, np.abs(slides - before).max(initial=0.0))
        accelerations = found
        if change <= _SETTLED * (1 + np.abs(speeds).max(initial=0.0)):
            break
    else:
        raise ArithmeticError(f"step of {step} s at {time} s: the stages do not settle; take a shorter step")
    motion = step * np.tensordot(_WEIGHTS, slides, 1)
    return motion, qd + step * np.tensordot(_WEIGHTS, accelerations, 1), np.tensordot(_AHEAD, accelerations, 1)


@njit(cache=True, error_model="numpy")
def _solve_positive(matrices: Any, right: Any) -> None:
    """``right = matrix⁻¹ right`` in place for each element, by L D Lᵀ; matrices are overwritten."""
    n = right.shape[1]
    for e in range(right.shape[0]):
        for j in range(n):
            pivot = matrices[e, j, j]
            for k in range(j):
                pivot -= matrices[e, j, k] * matrices[e, j, k] * matrices[e, k, k]
            matrices[e, j, j] = pivot if pivot > 0 else np.nan
            for i in range(j + 1, n):
                total = matrices[e, i, j]
                for k in range(j):
                    total -= matrices[e, i, k] * matrices[e, j, k] * matrices[e, k, k]
                matrices[e, i, j] = total / matrices[e, j, j]
        for i in range(n):
            for k in range(i):
                right[e, i] -= matrices[e, i, k] * right[e, k]
        for i in range(n):
            right[e, i] /= matrices[e, i, i]
        for i in range(n - 1, -1, -1):
            for k in range(i + 1, n):
                right[e, i] -= matrices[e, k, i] * right[e, k]
