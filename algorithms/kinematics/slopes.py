"""Derivatives of the dynamics, for optimisation and control.

A joint that turns a little further moves all that it carries as one rigid body. Powers do not change when everything is
moved, so what is carried feels the same as if what carries it had moved the other way: twist and acceleration of the
carrier are dragged back, and what follows is linear (compare Carpentier and Mansard, *Robotics: Science and Systems*,
2018).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals
from .chains import blocks
from .dynamics import Dynamics, Motion


@dataclass(frozen=True, slots=True, eq=False)
class Slopes(Dynamics):
    """A robot whose dynamics can be linearised."""

    def inverse_dynamics_slopes(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> tuple[Reals, Reals]:
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
        one = self._passes.slopes(self._heavy, q, qd, qdd)
        if one is not None:
            return one[0], one[1]
        self._need_inertia()
        shape, (flat, speeds, rates) = self._together((q, "q"), (qd, "qd"), (qdd, "qdd"))
        n, count = self.n_joints, len(self.kinds)
        found = np.zeros((len(flat), count, count), flat.dtype)
        for block in blocks(len(flat)):
            x, v, a = self._positions(flat[block]), self._rates(speeds[block]), self._rates(rates[block])
            self._fill_slopes(self._moving(x, v, a, self.free_fall), found[block])
        by_q = self._reduced(np.swapaxes(self._reduced(found), -1, -2)) if self.coupling.size else None
        by_q = found if by_q is None else np.swapaxes(by_q, -1, -2)
        # forces are quadratic in the speeds, through Christoffel's symbols
        return by_q.reshape(*shape, n, n), 2 * self.coriolis_matrix(flat, speeds).reshape(*shape, n, n)

    def forward_dynamics_slopes(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike) -> tuple[Reals, Reals, Reals]:
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
        numpy.linalg.LinAlgError
            Where the mass matrix is singular.
        """
        inverse = np.linalg.inv(self.mass_matrix(q))
        by_q, by_qd = self.inverse_dynamics_slopes(q, qd, self.forward_dynamics(q, qd, tau))
        return -inverse @ by_q, -inverse @ by_qd, np.broadcast_to(inverse, by_q.shape).copy()

    def _fill_slopes(self, now: Motion, out: Reals) -> None:
        count = len(self.kinds)
        still = np.zeros_like(now.twists[0]), np.broadcast_to(now.base_rate, now.twists[0].shape)
        momenta = [pga3.momentum(body, twist) for body, twist in zip(now.inertias, now.twists, strict=True)]
        for j in range(count):
            axis, carrier = now.axes[j], self.parents[j]
            twist, rate = (now.twists[carrier], now.rates[carrier]) if carrier >= 0 else still
            back, back_rate = -pga3.twist_on_line(axis, twist), -pga3.twist_on_line(axis, rate)
            carried = self._carried_by(j)
            changes = {k: np.zeros_like(axis) for k in carried}
            for k in reversed(carried):
                change = back_rate + pga3.line_commutator(now.twists[k] - twist, back)
                changes[k] += pga3.momentum(now.inertias[k], change)
                changes[k] += pga3.line_commutator(pga3.momentum(now.inertias[k], back), now.twists[k])
                changes[k] += pga3.line_commutator(momenta[k], back)
                out[..., k, j] = pga3.power(now.axes[k], changes[k])
                if k != j:
                    changes[self.parents[k]] += changes[k]
            change = changes[j] + pga3.twist_on_line(axis, now.wrenches[j])
            while carrier >= 0:
                out[..., carrier, j] = pga3.power(now.axes[carrier], change)
                carrier = self.parents[carrier]

    def _carried_by(self, joint: int) -> list[int]:
        """A joint, and all that it carries, in order."""
        found = [joint]
        for k in range(joint + 1, len(self.kinds)):
            if self.parents[k] in found:
                found.append(k)
        return found
