"""Differential kinematics: velocities, accelerations, and Jacobians of the end effector and elements fixed to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, real_array
from ..elements import LINE, PLANE, elements
from ..precision import NEGLIGIBLE
from .changes import Changes
from .computed import Method
from .errors import DescriptionError


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Differential(Changes):
    """A robot with differential kinematics."""

    def integrate(self, q: ArrayLike, v: ArrayLike) -> Reals:
        """Return the configuration reached from `q` with constant rates `v` for unit time.

        This is ``q + v``, except for a floating base, which follows a screw motion.

        Parameters
        ----------
        q : array_like, (..., n), or (..., 8 + m) if the base floats
        v : array_like, (..., n)
            Rates multiplied by the time step.

        Returns
        -------
        array, of the shape of `q`
            The motor of a floating base is a unit motor.

        Raises
        ------
        TypeError, ValueError
            As in `jacobian`.
        """
        found: Reals | None = self._attempts.integrate(q, v)
        return self._run(self._computed.integrate, ("q", "v"), q, v) if found is None else found

    def difference(self, q0: ArrayLike, q1: ArrayLike) -> Reals:
        """Return the constant rates that lead from `q0` to `q1` in unit time.

        This is ``q1 - q0``, except for a floating base: ``integrate(q0, v)`` is `q1`. Full revolutions of a joint are
        not removed.

        Parameters
        ----------
        q0, q1 : array_like, (..., n), or (..., 8 + m) if the base floats

        Returns
        -------
        array, (..., n)
            A floating base rotates by an angle in [0, pi]. Its motor may have either sign.

        Raises
        ------
        TypeError, ValueError
            As in `jacobian`.
        """
        found: Reals | None = self._attempts.difference(q0, q1)
        return self._run(self._computed.difference, ("q0", "q1"), q0, q1) if found is None else found

    def jacobian(self, q: ArrayLike, link: str | None = None) -> Reals:
        """Return the geometric Jacobian of the end effector, or of another link, in the base frame.

        Parameters
        ----------
        q : array_like, (..., n)
            Joint variables: radians, or metres for prismatic joints. float32 gives float32.
        link : str, optional
            The name of a link of a URDF file, to use its frame instead of the end effector's.

        Returns
        -------
        array, (..., 6, n)
            ``J @ qd`` is the angular velocity x, y, z over the velocity of the frame's origin.

        Raises
        ------
        TypeError, ValueError
            If `q` is not an array of real numbers whose last axis has length n, or the link is unknown.
        """
        if link is not None:
            return self._jacobian_of_link(link, q)
        found: Reals | None = self._attempts.jacobian(q)
        return self._evaluate("jacobian", q) if found is None else found

    def _jacobian_of_link(self, name: str, q: ArrayLike) -> Reals:
        if (kernels := self._kernels_of(name)) is not None:
            return self._attempted(kernels[1], q)
        given = self._variables(q, "q")[0]
        return np.zeros((*given.shape[:-1], 6, self.n_joints), given.dtype)

    def jacobian_rate(self, q: ArrayLike, qd: ArrayLike) -> Reals:
        """Return the time derivative of `jacobian` for joint velocities `qd`.

        Parameters
        ----------
        q, qd : array_like, (..., n)

        Returns
        -------
        array, (..., 6, n)
            ``J @ qdd + J_rate @ qd`` is the angular acceleration over that of the end effector's origin.

        Raises
        ------
        TypeError, ValueError
            As in `jacobian`.
        """
        found: Reals | None = self._attempts.jacobian_rate(q, qd)
        return self._evaluate("jacobian_rate", q, qd) if found is None else found

    def velocity(self, q: ArrayLike, qd: ArrayLike) -> Reals:
        """Return the velocity of the end effector, (..., 6): angular over linear, base frame.

        Parameters
        ----------
        q, qd : array_like, (..., n)

        Raises
        ------
        TypeError, ValueError
            As in `jacobian`.
        """
        found: Reals | None = self._attempts.velocity(q, qd)
        return self._evaluate("velocity", q, qd) if found is None else found

    def acceleration(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Reals:
        """Return the acceleration of the end effector, (..., 6): angular over that of its origin, base frame.

        Parameters
        ----------
        q, qd, qdd : array_like, (..., n)

        Raises
        ------
        TypeError, ValueError
            As in `jacobian`.
        """
        found: Reals | None = self._attempts.acceleration(q, qd, qdd)
        return self._evaluate("acceleration", q, qd, qdd) if found is None else found

    def manipulability(self, q: ArrayLike) -> Reals:
        """Return Yoshikawa's manipulability measure (...), which is 0 at singular configurations.

        The measure is the product of the singular values of the Jacobian: ``sqrt(det(J Jᵀ))`` for six or more
        variables, ``sqrt(det(Jᵀ J))`` for fewer. Velocity components that are zero in every configuration are excluded:
        for three joints in a plane the measure is ``|det(J)|`` of x, y and the angle. With at most three variables that
        cannot generate all remaining components independently, only linear velocity is used: for two joints in a plane
        the measure is ``|det(J)|`` of x and y, for three joints in space that of x, y and z.

        The value depends on the unit of length, since rows of angular and linear velocity are multiplied. It is NaN if
        `q` contains a NaN.

        Parameters
        ----------
        q : array_like, (..., n)

        Raises
        ------
        TypeError, ValueError
            As in `jacobian`.
        """
        jacobian = self.jacobian(q)
        some = self.jacobian(self._anywhere())
        freedoms, variables = _rank(some), int(np.abs(some).max((0, 1)).astype(bool).sum())
        if variables < freedoms and variables <= 3:
            jacobian, freedoms = jacobian[..., 3:, :], _rank(some[:, 3:])
        finite = np.asarray(np.isfinite(jacobian).all((-2, -1)))
        values = np.linalg.svd(np.where(finite[..., None, None], jacobian, 0), compute_uv=False)
        measure = np.asarray(np.prod(values[..., : min(freedoms, variables)], axis=-1))
        measure[~finite] = np.nan
        return measure[()]

    def _anywhere(self) -> Reals:
        """Return four generic configurations."""
        return np.random.default_rng(0).uniform(-2, 2, (4, self.n_positions))

    def twists_of_joints(self, q: ArrayLike) -> Reals:
        """Return the twist of every joint at unit rate, as lines in the base frame: the spatial Jacobian.

        Parameters
        ----------
        q : array_like, (..., n)

        Returns
        -------
        array, (..., N, 6)
            One for each of the N joints: e12, e13, e23, e01, e02, e03. The twist of a revolute joint is the unit line
            of its axis, that of a prismatic joint a line at infinity. Joints that do not move the end effector are
            included.

        Raises
        ------
        TypeError, ValueError
            As in `jacobian`.
        """
        found: Reals | None = self._attempts.twists_of_joints(q)
        return self._evaluate("twists_of_joints", q) if found is None else found

    def jacobian_of_point(self, q: ArrayLike, p: ArrayLike) -> Reals:
        """Return the Jacobian of a point fixed to the end effector.

        Parameters
        ----------
        q : array_like, (..., n)
        p : array_like, (3,), or element
            Coordinates x, y, z in the end effector's frame.

        Returns
        -------
        array, (..., 3, n)

        Raises
        ------
        TypeError, ValueError
            As in `jacobian`.
        """
        return self._jacobian_of(q, real_array(p, "p", (3,), "x, y, z"), pga3.move_point, pga3.twist_on_point)

    @elements(line=LINE)
    def jacobian_of_line(self, q: ArrayLike, line: ArrayLike) -> Reals:
        """Return the Jacobian of a line fixed to the end effector.

        Parameters
        ----------
        q : array_like, (..., n)
        line : array_like, (6,), or element
            e12, e13, e23, e01, e02, e03 in the end effector's frame.

        Returns
        -------
        array, (..., 6, n)
            Derivatives of the coefficients in the base frame.

        Raises
        ------
        TypeError, ValueError
            As in `jacobian`.
        """
        return self._jacobian_of(q, real_array(line, "line", (6,), "a line"), pga3.move_line, pga3.twist_on_line)

    @elements(plane=PLANE)
    def jacobian_of_plane(self, q: ArrayLike, plane: ArrayLike) -> Reals:
        """Return the Jacobian of a plane fixed to the end effector.

        Parameters
        ----------
        q : array_like, (..., n)
        plane : array_like, (4,), or element
            e1, e2, e3, e0 in the end effector's frame.

        Returns
        -------
        array, (..., 4, n)
            Derivatives of the coefficients in the base frame.

        Raises
        ------
        TypeError, ValueError
            As in `jacobian`.
        """
        return self._jacobian_of(q, real_array(plane, "plane", (4,), "a plane"), pga3.move_plane, pga3.twist_on_plane)

    def _jacobian_of(self, q: ArrayLike, element: Reals, move: pga3.Kernel, twist_on: pga3.Kernel) -> Reals:
        q = self._variables(q, "q")[0]
        twists = self.twists_of_joints(q)
        now = move(self._evaluate("forward", q), element.astype(q.dtype))
        path = list(self.path)
        found = np.zeros((*q.shape[:-1], len(element), len(self.kinds)), q.dtype)
        found[..., path] = np.swapaxes(twist_on(twists[..., path, :], now[..., None, :]), -1, -2)
        return self._reduced(found)

    def _kernels_of(self, link: str) -> tuple[Method, Method] | None:
        """Return the kernels of the pose and of the Jacobian of a link, or None if it does not move."""
        known = self._computed.of_links
        if link not in known:
            joint, tool = self.carrier(link)
            known[link] = self._computed.along(joint, tool) if joint >= 0 else None
        return known[link]

    def carrier(self, link: str) -> tuple[int, Reals]:
        """Return the joint that carries a link of a URDF file, -1 for the base, and the link's motor at home, (8,).

        Raises
        ------
        DescriptionError
            If the link is unknown.
        """
        if link not in self.links:
            raise DescriptionError(f"{self.name}: no link {link!r}; expected one of {', '.join(self.links) or 'none'}")
        return self.links[link]


def _rank(rows: Reals) -> int:
    """Return the rank of the columns of several Jacobians."""
    values = np.linalg.svd(np.concatenate(list(rows), axis=-1), compute_uv=False)
    return int((values > NEGLIGIBLE * values.max(initial=0.0)).sum())
