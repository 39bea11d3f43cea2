"""A serial arm as a chain of screws: the motion of every joint about its axis at home, times a home motor."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import pga3

from ..arguments import Reals, real_array
from .denavit_hartenberg import Convention, Joint, Table, convention_of, rows_of
from .inverse import Solutions
from .inverse import inverse as _inverse
from .named import TABLES

_BLOCK = 4096
"""Configurations that are worked on at once: their motors stay in the second cache."""

_LINE_Z = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
"""The axis z as a unit line of PGA3, e12."""


@dataclass(frozen=True, slots=True, eq=False)
class Robot:
    """A serial arm with one variable for each joint.

    The frame after joint j is the motor ``exp(-q_1/2 l_1) ... exp(-q_j/2 l_j) H_j``: the product of exponentials
    (Brockett 1984) with the unit lines ``l`` of the joints and the motors ``H`` of the frames, both where all joint
    variables are 0. A prismatic joint translates along its line instead. All conventions become this form once, when
    the robot is made.

    Attributes
    ----------
    name : str
    kinds : tuple of Joint
        One for each joint, base first; n of them.
    axes : array, (n, 6)
        Unit lines of the joints at home, in the base frame: e12, e13, e23, e01, e02, e03.
    home : array, (n, 8)
        Motors of the frames after every joint at home: 1, e12, e13, e23, e01, e02, e03, e0123.
    """

    name: str
    kinds: tuple[Joint, ...]
    axes: NDArray[np.float64]
    home: NDArray[np.float64]

    @classmethod
    def named(cls, name: str) -> Robot:
        """A robot known by name: puma560 or ur5.

        Raises
        ------
        ValueError
            For another name.
        """
        if name not in TABLES:
            raise ValueError(f"robot {name!r}: not known; expected one of {', '.join(TABLES)}, or use Robot.from_dh")
        return cls.from_table(TABLES[name])

    @classmethod
    def from_dh(cls, rows: Sequence[Mapping[str, object]], convention: str = "standard", name: str = "robot") -> Robot:
        """A robot from the rows of a Denavit-Hartenberg table.

        Parameters
        ----------
        rows : sequence of mappings
            Base first. Keys d, a (metres), alpha, theta (radians; theta is what the joint variable is added to), kind
            ("revolute" or "prismatic"); what is left out is 0, and revolute.
        convention : str
            "standard", or "modified" (Craig).
        name : str, optional

        Returns
        -------
        Robot

        Raises
        ------
        TypeError, ValueError
            For an unknown key, kind or convention, what is not a finite number, or no rows; the message names the row,
            counted from 0.
        """
        return cls.from_table(Table(name, convention_of(convention), rows_of(rows), "given"))

    @classmethod
    def from_table(cls, table: Table) -> Robot:
        """A robot from a table whose rows are known to be right."""
        axes, home = np.empty((len(table.rows), 6)), np.empty((len(table.rows), 8))
        standard = table.convention is Convention.STANDARD
        row_motor = pga3.motor_from_denavit_hartenberg if standard else pga3.motor_from_modified_denavit_hartenberg
        before = np.eye(8)[0]
        for j, row in enumerate(table.rows):
            pga3.motor_product(before, row_motor(row.theta, row.d, row.a, row.alpha), out=home[j])
            # A standard joint moves about z before its link, a modified one after it.
            pga3.move_line(before if standard else home[j], _LINE_Z, out=axes[j])
            before = home[j]
        axes.flags.writeable = home.flags.writeable = False
        return cls(table.name, tuple(row.kind for row in table.rows), axes, home)

    @property
    def n_joints(self) -> int:
        """The number of joint variables."""
        return len(self.kinds)

    def forward(self, q: ArrayLike) -> Reals:
        """Where the end effector is: the motor of the last frame.

        Parameters
        ----------
        q : array_like, (..., n)
            Joint variables: radians, or metres where the joint is prismatic. float32 gives float32.

        Returns
        -------
        array, (..., 8)
            Unit motors from the last frame to the base frame: 1, e12, e13, e23, e01, e02, e03, e0123. A motor of a
            configuration with a NaN or an infinite angle is NaN.

        Raises
        ------
        TypeError, ValueError
            Where `q` is not an array of n real numbers in its last axis.
        """
        q, flat = self._joint_variables(q)
        motors = np.empty((len(flat), 8), q.dtype)
        axes, home = self.axes.astype(q.dtype), self.home.astype(q.dtype)
        for start in range(0, len(flat), _BLOCK):
            block = slice(start, start + _BLOCK)
            *_, last = self._prefixes(flat[block], axes, motors[block])
            pga3.motor_product(last, home[-1], out=motors[block])
        return motors.reshape(*q.shape[:-1], 8)

    def forward_all(self, q: ArrayLike) -> Reals:
        """Where every link is: the motors of all frames.

        Parameters
        ----------
        q : array_like, (..., n)
            As in `forward`.

        Returns
        -------
        array, (..., n, 8)
            Unit motors from the frame after each joint to the base frame; the last is that of `forward`.

        Raises
        ------
        TypeError, ValueError
            As in `forward`.
        """
        q, flat = self._joint_variables(q)
        motors = np.empty((len(flat), self.n_joints, 8), q.dtype)
        axes, home = self.axes.astype(q.dtype), self.home.astype(q.dtype)
        workspace = np.empty((min(len(flat), _BLOCK), 8), q.dtype)
        for start in range(0, len(flat), _BLOCK):
            block = slice(start, start + _BLOCK)
            variables = flat[block]
            for j, prefix in enumerate(self._prefixes(variables, axes, workspace[: len(variables)])):
                pga3.motor_product(prefix, home[j], out=motors[block, j])
        return motors.reshape(*q.shape, 8)

    def pose(self, q: ArrayLike) -> Reals:
        """Where the end effector is, as a matrix that acts on columns (x, y, z, 1).

        Parameters
        ----------
        q : array_like, (..., n)
            As in `forward`.

        Returns
        -------
        array, (..., 4, 4)

        Raises
        ------
        TypeError, ValueError
            As in `forward`.
        """
        return pga3.motor_to_matrix(self.forward(q))  # type: ignore[no-any-return]

    def inverse(
        self,
        poses: ArrayLike,
        *,
        locked: Mapping[int, ArrayLike] | None = None,
        elbow: ArrayLike | None = None,
    ) -> Solutions:
        """All configurations that reach poses.

        In closed form where the last or the first three axes meet (at most 8 branches, 16 where the other three are
        skew), where the second, third and fourth, or third to fifth, are parallel and the two beyond meet (8), and for
        planar arms and SCARA (2). Other arms are searched by damped Gauss-Newton on motors from 24 starts, and up to 8
        different configurations are kept; so are arms with more joints than a pose has freedoms unless `locked` or
        `elbow` says which configuration is meant. Joint limits are not looked at.

        Parameters
        ----------
        poses : array_like, (..., 8) or (..., 4, 4)
            Motors, of either sign, or matrices, as `forward` and `pose` give them.
        locked : mapping of int to array_like, optional
            Joints, counted from 0, and the values that they shall have, one or one for each pose: for arms of seven
            joints. Many different values are fast for the first and the last joint only.
        elbow : array_like, optional
            For arms of seven joints whose first three axes meet in a shoulder and last three in a wrist: the angle in
            radians of the fourth axis about the line from shoulder to wrist, as `elbow_angle` measures it.

        Returns
        -------
        Solutions
            Branches, which of them are valid, a status for each pose, the nearest that can be reached.

        Raises
        ------
        TypeError, ValueError
            Where an argument has another shape or type, a joint is not there, or `elbow` is given for another arm.
        """
        return _inverse(self, poses, locked=locked, elbow=elbow)

    def _joint_variables(self, q: ArrayLike) -> tuple[Reals, Reals]:
        """The joint variables, and the same as rows."""
        array = real_array(q, f"{self.name}: q", (self.n_joints,), f"{self.n_joints} joint variables")
        return array, array.reshape(-1, self.n_joints)

    def _prefixes(self, q: Reals, axes: Reals, product: Reals) -> Iterator[Reals]:
        """The products of the first 1, 2, ..., n joint motions, one after the other in the same memory."""
        step = np.empty_like(product)
        for j, kind in enumerate(self.kinds):
            motion = product if j == 0 else step
            if kind is Joint.REVOLUTE:
                pga3.motor_from_line(axes[j], q[:, j], out=motion)
            else:
                pga3.motor_from_screw(axes[j], 0.0, q[:, j], out=motion)
            if j:
                pga3.motor_product(product, step, out=product)
            yield product
