"""Robots: made from tables, screws or URDF files, and asked where things are. One class, in one file."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from types import NoneType
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, real_array
from . import urdf
from .bodies import Body, moved
from .denavit_hartenberg import Convention, Joint, Table, convention_of, rows_of
from .errors import DescriptionError, JointCountError
from .inverse import Solutions
from .inverse import inverse as _inverse
from .named import FOLDED, table_of
from .simulation import Simulated

_LINE_Z = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
"""The axis z as a unit line of PGA3, e12."""


@dataclass(frozen=True, slots=True, eq=False)
class Robot(Simulated):
    """A robot, a chain or a tree of joints: see `Model` for what it holds, `Differential` and `Dynamics` for more
    of what it can do. Every method takes any leading axes, in float64 or float32.
    """

    @classmethod
    def named(cls, name: str) -> Robot:
        """A robot known by name: puma560, stanford, ur5, panda or iiwa.

        Capitals, spaces and hyphens make no difference, and KUKA iiwa and Franka Panda are known so, too.

        Raises
        ------
        TypeError, ValueError
            For what is no name, or another name.
        """
        table = table_of(name)
        robot = cls.from_table(table)
        return robot.with_module(import_module(f"generated.{table.name}")) if table.name in FOLDED else robot

    @classmethod
    def from_dh(
        cls,
        rows: Sequence[Mapping[str, object]],
        convention: str = "standard",
        name: str = "robot",
        bodies: Sequence[Body] = (),
    ) -> Robot:
        """A robot from the rows of a Denavit-Hartenberg table.

        Parameters
        ----------
        rows : sequence of mappings
            Base first. Keys d, a (metres), alpha, theta (radians; theta is what the joint variable is added to), kind
            ("revolute" or "prismatic"); what is left out is 0, and revolute.
        convention : str
            "standard", or "modified" (Craig).
        name : str, optional
        bodies : sequence of Body, optional
            What each row's link weighs, in the frame after the row.

        Returns
        -------
        Robot

        Raises
        ------
        TypeError, ValueError
            For an unknown key, kind or convention, what is not a finite number, no rows, or another number of bodies;
            the message names the row, counted from 0.
        """
        return cls.from_table(Table(name, convention_of(convention), rows_of(rows), "given", tuple(bodies)))

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
        limits = np.array([(low, high, np.inf, np.inf) for low, high in table.limits])
        kinds = tuple(row.kind for row in table.rows)
        return cls(table.name, kinds, axes, home, limits=limits, **_carried(table.bodies, home))

    @classmethod
    def from_screws(
        cls,
        axes: ArrayLike,
        tool: ArrayLike,
        kinds: Sequence[str] = (),
        name: str = "robot",
        bodies: Sequence[Body] = (),
    ) -> Robot:
        """A serial arm as a product of exponentials.

        Parameters
        ----------
        axes : array_like, (n, 6)
            Lines of the joints where all variables are 0, base first: e12, e13, e23, e01, e02, e03. Of any length.
        tool : array_like, (8,)
            The motor of the end effector there.
        kinds : sequence of str, optional
            "revolute" or "prismatic" for each joint; left out, all turn.
        name : str, optional
        bodies : sequence of Body, optional
            What each joint carries, in the base frame, where all variables are 0.

        Returns
        -------
        Robot
            Frames after the joints are those of the base at home, but for the last, which is the end effector's.

        Raises
        ------
        DescriptionError
            For lines without direction, or that are none; motors that are none; unknown kinds; another number of kinds
            or bodies than of axes.
        """
        lines = np.array(real_array(axes, "axes", (-1, 6), "lines"), float)
        motor = np.array(real_array(tool, "tool", (8,), "a motor"), float)
        lengths = np.linalg.norm(lines[:, :3], axis=1, keepdims=True)
        defect = np.abs(pga3.plucker_residual(lines)).max(initial=0.0)
        if not (lengths > 0).all() or not defect <= 1e-9 * (np.square(lines).sum(1) + 1).max(initial=0.0):
            raise DescriptionError(f"{name}: axes that are no lines; expected a direction, and a moment across it")
        unit = pga3.normalize_motor(motor)
        if not np.abs(unit - motor).max() < 1e-9:
            raise DescriptionError(f"{name}: tool {motor}; expected a unit motor")
        for kind in kinds:
            if kind not in ("revolute", "prismatic"):
                raise DescriptionError(f"{name}: kind {kind!r}; expected 'revolute' or 'prismatic'")
        if len(kinds) not in (0, len(lines)):
            raise JointCountError(f"{name}: {len(kinds)} kinds for {len(lines)} axes; expected one for each")
        frames = np.tile(np.eye(8)[0], (len(lines), 1))
        carried = _carried(tuple(bodies), frames)
        home = np.concatenate([frames[:-1], unit[None]])
        chosen = tuple(map(Joint, kinds)) or (Joint.REVOLUTE,) * len(lines)
        return cls(name, chosen, lines / lengths, home, **carried)

    @classmethod
    def from_urdf(
        cls, path: str | Path, tip: str | None = None, locked: Iterable[str] = (), base: str = "fixed"
    ) -> Robot:
        """A robot from a URDF file: a tree of links with revolute, continuous, prismatic and fixed joints.

        Parameters
        ----------
        path : str or Path
        tip : str, optional
            The link that is the end effector; left out, the one most joints away from the base, fixed ones counted, of
            those that move, and the first of several.
        locked : iterable of str, optional
            Names of joints that are held at 0: what they carry becomes part of what carries them.
        base : str
            "fixed"; "floating", where `q` begins with the motor of the first link (`FloatingRobot`); or "euler": three
            slides x, y, z and turns by yaw, pitch and roll come before the first link, which is singular at a pitch of
            a quarter turn. Where the only joint on the root of the file is of type floating, the first link is the one
            that it carries. Any other joint of type floating becomes such six joints, and a planar one three.

        Returns
        -------
        Robot
            A `FloatingRobot` where the base floats.
            Joints are in the order of the file, depth first: `joint_names`. Joints that mimic others have no variable.

        Raises
        ------
        OSError
            Where the file cannot be read.
        TypeError
            Where `path` is no name of a file.
        CyclicTreeError, UnknownJointTypeError, NotFiniteError, JointCountError, DescriptionError
            Where it describes no robot. Links without inertia are refused only when dynamics is asked for, with a
            `MissingInertiaError`.

        Warns
        -----
        InertiaWarning
            Where no rigid body has the tensor of a link: a principal moment is negative, or larger than the sum of the
            two others.
        """
        fields = urdf.read(path, tip, locked, base)
        return _BY_BASE.get(base, cls)(**fields)

    def forward(self, q: ArrayLike) -> Reals:
        """Where the end effector is.

        Parameters
        ----------
        q : array_like, (..., n)
            Joint variables: radians, or metres where the joint is prismatic. float32 gives float32.

        Returns
        -------
        array, (..., 8)
            Unit motors from the end effector's frame to the base frame: 1, e12, e13, e23, e01, e02, e03, e0123. A motor
            of a configuration with a NaN or an infinite angle is NaN.

        Raises
        ------
        TypeError, ValueError
            Where `q` is not an array of n real numbers in its last axis.
        """
        own = self._own.forward
        if own is not None:
            try:
                return own(q)  # type: ignore[no-any-return]
            except (TypeError, ValueError):
                pass
        attempt = self._attempts.forward
        found = attempt(q)
        return self._run(self._computed.forward, ("q",), q) if found is None else found  # type: ignore[no-any-return]

    def forward_all(self, q: ArrayLike) -> Reals:
        """Where every link is: the motors of all frames.

        Parameters
        ----------
        q : array_like, (..., n)
            As in `forward`.

        Returns
        -------
        array, (..., N, 8)
            Unit motors from the frame after each of the N joints to the base frame.

        Raises
        ------
        TypeError, ValueError
            As in `forward`.
        """
        attempt = self._attempts.forward_all
        found = attempt(q)
        if found is not None:
            return found  # type: ignore[no-any-return]
        own = self._own.call("forward_all", q)
        if own is not None:
            return own  # type: ignore[no-any-return]
        return self._run(self._computed.forward_all, ("q",), q)  # type: ignore[no-any-return]

    def link(self, name: str, q: ArrayLike) -> Reals:
        """Where a link of a URDF file is, (..., 8).

        Parameters
        ----------
        name : str
        q : array_like, (..., n)
            As in `forward`.

        Raises
        ------
        TypeError, ValueError
            As in `forward`, and for an unknown link.
        """
        joint, tool = self._carrier(name)
        if joint >= 0:
            return self._run(self._computed.forward_to(joint, tool), ("q",), q)  # type: ignore[no-any-return]
        given = self._variables(q, "q")[0]
        return np.broadcast_to(tool, (*given.shape[:-1], 8)).astype(given.dtype)

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
        way: str = "motors",
        near: ArrayLike | None = None,
    ) -> Solutions:
        """All configurations that reach poses.

        In closed form where the last or the first three axes meet (at most 8 branches, 16 where the other three are
        skew), where the second, third and fourth, or third to fifth, are parallel and the two beyond meet (8), and for
        planar arms and SCARA (2), and where three joints slide (2). All branches of other arms of six joints, up to 16,
        are roots of a polynomial, found as eigenvalues (`inverse.elimination`), or, where two joints slide, of a
        function of one angle, found on a grid (`inverse.slides`). What is left is searched by damped Gauss-Newton on
        motors from 24 starts, and up to 8 different configurations are kept; so are arms with more joints than a pose
        has freedoms unless `locked` or `elbow` says which configuration is meant. Angles are turned by whole turns into
        the joint limits where that is possible; other branches are given, too, and flagged. Joints that do not move the
        end effector are at 0, or as `near` has them, or at the limit next to that.

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
        way : str, optional
            "motors"; or, for arms with a wrist or three parallel axes that need no quartic, "affine" or "conformal":
            the same branches in another order, from meets of circles, lines, planes and spheres.
        near : array_like, (n,) or (..., n), optional
            A configuration, or one for each pose, such as the current one: `nearest` is the branch that is nearest to
            it, and of angles that differ by whole turns the nearest within the limits is taken.

        Returns
        -------
        Solutions
            Branches, which of them are valid, a status for each pose, the nearest that can be reached.

        Raises
        ------
        TypeError, ValueError
            Where an argument has another shape or type, a joint is not there, or `elbow` is given for another arm.
        """
        if not isinstance(locked, (Mapping, NoneType)):
            raise TypeError(f"{self.name}: locked: {type(locked).__name__}; expected a mapping, as {{6: 0.5}}")
        arm, variables = self._arm()
        if arm is self:
            return _inverse(self, poses, locked=locked, elbow=elbow, way=way, near=near)
        for joint in locked or {}:
            if joint not in variables:
                raise ValueError(
                    f"{self.name}: locked: joint {joint!r} does not move the end effector; expected one of {variables}"
                )
        kept = {variables.index(joint): value for joint, value in (locked or {}).items()}
        start = np.zeros(self.n_joints) if near is None else self._variables(near, "near")[0]
        part = None if near is None else start[..., variables]
        found = _inverse(arm, poses, locked=kept, elbow=elbow, way=way, near=part)
        # What does not move the end effector is as `near` has it, as far as its limits allow.
        still = np.clip(start.astype(float), self.limits[:, 0], self.limits[:, 1])
        q = np.broadcast_to(still[..., None, :], (*found.q.shape[:-1], self.n_joints)).copy()
        nearest = np.broadcast_to(still, (*found.nearest.shape[:-1], self.n_joints)).copy()
        q[..., variables], nearest[..., variables] = found.q, found.nearest
        q[~found.valid] = np.nan
        nearest[np.isnan(found.nearest).any(-1)] = np.nan
        return replace(found, q=q, nearest=nearest)

    def _arm(self) -> tuple[Robot, list[int]]:
        """The joints from the base to the end effector as a robot, and which variables are theirs."""
        path = list(self.path)
        if not self.coupling.size and len(path) == len(self.kinds):
            return self, path
        variables = path
        if self.coupling.size:
            rows = self.coupling[path]
            variables = [int(k) for k in rows.argmax(axis=1)]
            own = np.zeros_like(rows)
            own[range(len(path)), variables] = 1.0
            for j, same in zip(path, (rows == own).all(axis=1), strict=True):
                if not same or variables.count(variables[path.index(j)]) > 1:
                    raise ValueError(
                        f"{self.name}: inverse: {self.joint_names[j]} follows another joint; expected joints to the "
                        "end effector that have variables of their own"
                    )
        kinds = tuple(self.kinds[j] for j in path)
        limits = self.limits[variables]
        return Robot(self.name, kinds, self.axes[path], self.home[path], tool=self.tool, limits=limits), variables


_Kind = TypeVar("_Kind", bound=Robot)
_BY_BASE: dict[str, type[Robot]] = {}


def for_base(base: str) -> Callable[[type[_Kind]], type[_Kind]]:
    """Declare the class below as the one that `Robot.from_urdf` makes where the base is called `base`."""

    def declare(kind: type[_Kind]) -> type[_Kind]:
        _BY_BASE[base] = kind
        return kind

    return declare


def _carried(bodies: tuple[Body, ...], home: Reals) -> dict[str, Any]:
    """The fields of a `Model` that say what joints carry, from bodies in the frames after them."""
    if not bodies:
        return {}
    if len(bodies) != len(home):
        raise JointCountError(f"{len(bodies)} bodies for {len(home)} joints; expected one for each")
    rows = [moved(motor, [body.row]) for motor, body in zip(home, bodies, strict=True)]
    return {"bodies": np.array(rows), "armature": np.array([body.armature for body in bodies])}
