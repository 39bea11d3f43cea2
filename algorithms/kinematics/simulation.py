"""Simulation of motion by Gauss collocation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals
from .dynamics import Dynamics

Torque = Callable[[float, Reals, Reals], ArrayLike]
"""Joint forces as a function of time, joint variables (..., n) and velocities (..., n)."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Simulated(Dynamics):
    """A robot whose motion can be simulated."""

    def simulate(
        self, q: ArrayLike, qd: ArrayLike, step: float, n_steps: int, torque: Torque | None = None
    ) -> tuple[Reals, Reals]:
        """Simulate the motion under gravity and joint forces, by Gauss collocation with four stages.

        The method has order 8 and is symmetric in time, so that without joint forces the energy does not drift. For a
        double pendulum that rotates over the top, with an energy of 10 J, simulated for 10 s in steps of 5 ms, the
        energy remains within 1e-10 J. The stages are computed by fixed-point iteration.

        Parameters
        ----------
        q, qd : array_like, (..., n)
            Joint variables and velocities at time 0.
        step : float
            Time step, s.
        n_steps : int
        torque : callable, optional
            ``torque(time, q, qd)`` returns the joint forces (..., n). By default they are zero.

        Returns
        -------
        q, qd : array, (n_steps + 1, ..., n)
            Including the initial state.

        Raises
        ------
        MissingInertiaError, TypeError, ValueError
            As in `inverse_dynamics`.
        ArithmeticError
            If the stages do not converge because the step is too long.
        """
        shape, (position, speed) = self._start(q, qd)
        positions, speeds = [position], [speed]

        def rates(times: Reals, x: Reals, v: Reals) -> Reals:
            """Return the accelerations at all stages (stages, B, n), after the motion `x` from `position`."""
            places, forces = self.integrate(position, x), np.zeros_like(v)
            if torque is not None:
                for time, place, speed, force in zip(times, places, v, forces, strict=True):
                    force.reshape(*shape, -1)[...] = torque(time, place.reshape(*shape, -1), speed.reshape(*shape, -1))
            with np.errstate(over="ignore", invalid="ignore"):  # divergence raises an error below
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
        """Return the common leading axes of configurations and velocities, and both as rows."""
        return self._together((q, "q"), (qd, "qd"))

    def _straight(self, x: Reals, v: Reals) -> Reals:
        """Return the rate of the motion coordinates `x` of `integrate` at velocities `v`."""
        return v


def _collocation(points: Reals) -> tuple[Reals, Reals, Reals]:
    """Return the integrals of the Lagrange polynomials to each node and to 1, and their values one step later.

    The nodes `points` are in (0, 1).
    """
    powers = np.arange(len(points))
    basis = np.linalg.inv(points[:, None] ** powers)
    to_node = points[:, None] ** (powers + 1) / (powers + 1) @ basis
    return to_node, 1 / (powers + 1) @ basis, (1 + points[:, None]) ** powers @ basis


_TIMES = (np.polynomial.legendre.leggauss(4)[0] + 1) / 2
_STAGES, _WEIGHTS, _AHEAD = _collocation(_TIMES)
_SETTLED, _TRIES = 1e-14, 60
"""From floating point and a limit on work: relative changes of stages that end their iteration, and how often it is
repeated."""


def _gauss_step(
    rates: Callable[[Reals, Reals, Reals], Reals],
    straight: Callable[[Reals, Reals], Reals],
    time: float,
    step: float,
    qd: Reals,
    start: Reals,
) -> tuple[Reals, Reals, Reals]:
    """Perform one step of Gauss's method (Hairer, Lubich and Wanner, *Geometric Numerical Integration*, II.1.3).

    Return the motion from the initial configuration, the velocities after the step, and the stage accelerations
    extrapolated by one step, from which the next iteration starts. For a floating base, the motion is described by
    exponential coordinates (Munthe-Kaas, *Applied Numerical Mathematics* 29:115, 1999).
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
        raise ArithmeticError(f"step of {step} s at {time} s: the stages do not converge; use a shorter step")
    motion = step * np.tensordot(_WEIGHTS, slides, 1)
    return motion, qd + step * np.tensordot(_WEIGHTS, accelerations, 1), np.tensordot(_AHEAD, accelerations, 1)
