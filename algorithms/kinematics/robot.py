"""Robots: construction from tables, screws or URDF files, and forward and inverse kinematics. One class in one file."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from types import NoneType
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, real_array
from ..elements import LINE, MOTOR, elements
from ..precision import NEGLIGIBLE
from . import mjcf, urdf
from .bodies import Body, moved
from .denavit_hartenberg import Convention, Joint, Table, convention_of, rows_of
from .errors import DescriptionError, JointCountError
from .inverse import SelfMotion, Solutions, self_motions, single_pose
from .inverse import inverse as _inverse
from .named import FOLDED, table_of
from .reaching import Reached, reached
from .simulation import Simulated
from .tasks import Task
from .view import RobotView, view_of

_LINE_Z = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
"""The axis z as a unit line of PGA3, e12."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Robot(Simulated):
    """A robot: a chain or a tree of joints.

    `Model` documents the attributes, `Differential` and `Dynamics` the inherited methods. Every method accepts any
    leading axes, in float64 or float32.
    """

    @classmethod
    def named(cls, name: str) -> Robot:
        """Return a predefined robot.

        With masses: puma560, stanford, ur5 and panda. Lengths only: iiwa, ur3, ur10, ur3e, ur5e, ur10e, ur16e, ur20,
        ur30, irb140, kr5, cobra600, sawyer, jaco, mico and crx10ia. Case, spaces and hyphens are ignored. The names
        KUKA iiwa and Franka Panda are accepted, too. ``named.TABLES[name].source`` says where the numbers are from. The
        toolbox has the MIT licence; data sheets of makers state none.

        Raises
        ------
        TypeError
            If `name` is not a string.
        ValueError
            If the name is unknown.
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
        """Return a robot from the rows of a Denavit-Hartenberg table.

        Parameters
        ----------
        rows : sequence of mappings
            Base first. The keys are d, a (metres), alpha, theta (radians) and kind ("revolute" or "prismatic"). The
            joint variable of a revolute joint is added to theta. Missing numbers are 0; the default kind is revolute.
        convention : str
            "standard", or "modified" (Craig).
        name : str, optional
        bodies : sequence of Body, optional
            The rigid body of each row's link, in the frame after the row.

        Returns
        -------
        Robot

        Raises
        ------
        TypeError, ValueError
            For an unknown key, kind or convention, a value that is not a finite number, an empty list of rows, or a
            number of bodies that differs from the number of rows. The message names the row, counted from 0.
        """
        return cls.from_table(Table(name, convention_of(convention), rows_of(rows), "given", tuple(bodies)))

    @classmethod
    def from_table(cls, table: Table) -> Robot:
        """Return a robot from a table of validated rows."""
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
    @elements(axes=LINE, tool=MOTOR)
    def from_screws(
        cls,
        axes: ArrayLike,
        tool: ArrayLike,
        kinds: Sequence[str] = (),
        name: str = "robot",
        bodies: Sequence[Body] = (),
    ) -> Robot:
        """Return a serial arm described by a product of exponentials.

        Parameters
        ----------
        axes : array_like, (n, 6)
            Lines of the joint axes at the zero configuration, base first: e12, e13, e23, e01, e02, e03. They need not
            be normalised.
        tool : array_like, (8,)
            The motor of the end effector at the zero configuration.
        kinds : sequence of str, optional
            "revolute" or "prismatic" for each joint. By default all joints are revolute.
        name : str, optional
        bodies : sequence of Body, optional
            The rigid body that each joint carries, in the base frame, at the zero configuration.

        Returns
        -------
        Robot
            At the zero configuration, the frames after the joints coincide with the base frame, except the last, which
            is the frame of the end effector.

        Raises
        ------
        DescriptionError
            For axes without a direction or that are not lines; a tool that is not a motor; unknown kinds; a number of
            kinds or bodies that differs from the number of axes.
        """
        lines = np.array(real_array(axes, "axes", (-1, 6), "lines"), float)
        motor = np.array(real_array(tool, "tool", (8,), "a motor"), float)
        lengths = np.linalg.norm(lines[:, :3], axis=1, keepdims=True)
        defect = np.abs(pga3.plucker_residual(lines)).max(initial=0.0)
        if not (lengths > 0).all() or not defect <= NEGLIGIBLE * (np.square(lines).sum(1) + 1).max(initial=0.0):
            raise DescriptionError(
                f"{name}: axes: not lines; expected a nonzero direction and a moment orthogonal to it in each row"
            )
        unit = pga3.normalize_motor(motor)
        if not np.abs(unit - motor).max() < NEGLIGIBLE:
            raise DescriptionError(f"{name}: tool {motor}; expected a unit motor")
        for kind in kinds:
            if kind not in ("revolute", "prismatic"):
                raise DescriptionError(f"{name}: kind {kind!r}; expected 'revolute' or 'prismatic'")
        if len(kinds) not in (0, len(lines)):
            raise JointCountError(f"{name}: {len(kinds)} kinds for {len(lines)} axes; expected one kind for each axis")
        frames = np.tile(np.eye(8)[0], (len(lines), 1))
        carried = _carried(tuple(bodies), frames)
        home = np.concatenate([frames[:-1], unit[None]])
        chosen = tuple(map(Joint, kinds)) or (Joint.REVOLUTE,) * len(lines)
        return cls(name, chosen, lines / lengths, home, **carried)

    @classmethod
    def from_urdf(
        cls,
        path: str | Path,
        tip: str | None = None,
        locked: Iterable[str] = (),
        base: str = "fixed",
        arguments: Mapping[str, object] = urdf.NO_ARGUMENTS,
    ) -> Robot:
        """Return a robot from a URDF file: a tree of links with revolute, continuous, prismatic and fixed joints.

        Parameters
        ----------
        path : str or Path
            The name of a file, or a text of XML. Macros of xacro are expanded: properties, expressions, conditions,
            macros and includes (`algorithms.kinematics.xacro`).
        tip : str, optional
            The link that is the end effector. By default the moving link separated from the base by the largest number
            of joints, fixed joints included; the first one if there are several.
        locked : iterable of str, optional
            Names of joints that are fixed at 0. The link that such a joint carries is merged with its parent link.
        base : str
            "fixed"; "floating", where `q` begins with the motor of the first link (`FloatingRobot`); or "euler", where
            three prismatic joints x, y, z and three revolute joints yaw, pitch, roll precede the first link. The
            "euler" base is singular at a pitch of 90 degrees. If the only joint on the root link of the file is of type
            floating, the first link is the one that this joint carries. Any other floating joint is replaced by the
            same six joints, and a planar joint by three.
        arguments : mapping of str, optional
            Values of the arguments that a file of xacro declares, ``<xacro:arg>``.

        Returns
        -------
        Robot
            A `FloatingRobot` if the base is floating.
            Joints are in the order of the file, depth first: `joint_names`. Joints that mimic others have no variable.

        Raises
        ------
        OSError
            If the file cannot be read.
        TypeError
            If `path` is not the name of a file.
        CyclicTreeError, UnknownJointTypeError, NotFiniteError, JointCountError, DescriptionError
            If the file does not describe a robot. Links without inertia are accepted here; methods of dynamics raise a
            `MissingInertiaError` for them.

        Warns
        -----
        InertiaWarning
            If the inertia tensor of a link is not physically consistent: a principal moment is negative, or larger than
            the sum of the other two.
        """
        fields = urdf.read(path, tip, locked, base, arguments)
        return _BY_BASE.get(base, cls)(**fields)

    @classmethod
    def from_mjcf(
        cls, path: str | Path, tip: str | None = None, locked: Iterable[str] = (), base: str = "fixed"
    ) -> Robot:
        """Return a robot from a file of MuJoCo (MJCF): a tree of bodies with hinge, slide and free joints.

        Parameters
        ----------
        path : str or Path
            The name of a file, which may include others, or a text of XML.
        tip, locked, base
            As in `from_urdf`; links are bodies. A free joint on the only body of the world is a floating base.

        Returns
        -------
        Robot
            Limits are ranges, and forces of ``actuatorfrcrange``; velocities are unlimited. Armature is kept. Joints
            that an <equality> makes follow others linearly have no variable. Variables are those of MuJoCo, with `ref`.

        Raises
        ------
        OSError, TypeError, CyclicTreeError, UnknownJointTypeError, NotFiniteError, JointCountError, DescriptionError
            As in `from_urdf`. Ball joints are unknown. Inertias are not computed from geometry: methods of dynamics
            raise a `MissingInertiaError` for bodies with geometry and without <inertial>.

        Warns
        -----
        InertiaWarning
            As in `from_urdf`.
        """
        return _BY_BASE.get(base, cls)(**mjcf.read(path, tip, locked, base))

    def forward(self, q: ArrayLike) -> Reals:
        """Return the pose of the end effector as a motor.

        Parameters
        ----------
        q : array_like, (..., n)
            Joint variables: radians, or metres where the joint is prismatic. float32 gives float32.

        Returns
        -------
        array, (..., 8)
            Unit motors from the end effector's frame to the base frame: 1, e12, e13, e23, e01, e02, e03, e0123. The
            motor of a configuration with a NaN or an infinite angle is NaN.

        Raises
        ------
        TypeError, ValueError
            If `q` is not an array of real numbers whose last axis has length n.
        """
        found: Reals | None = self._attempts.forward(q)
        return self._evaluate("forward", q) if found is None else found

    def forward_all(self, q: ArrayLike) -> Reals:
        """Return the poses of all links, as the motors of all joint frames.

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
        found: Reals | None = self._attempts.forward_all(q)
        return self._evaluate("forward_all", q) if found is None else found

    def link(self, name: str, q: ArrayLike) -> Reals:
        """Return the pose of a link of a URDF file, (..., 8).

        Parameters
        ----------
        name : str
        q : array_like, (..., n)
            As in `forward`.

        Raises
        ------
        TypeError, ValueError
            As in `forward`, and if the link is unknown.
        """
        if (kernels := self._kernels_of(name)) is not None:
            return self._attempted(kernels[0], q)
        given = self._variables(q, "q")[0]
        return np.broadcast_to(self.carrier(name)[1], (*given.shape[:-1], 8)).astype(given.dtype)

    def pose(self, q: ArrayLike) -> Reals:
        """Return the pose of the end effector as a matrix that acts on columns (x, y, z, 1).

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
        return pga3.motor_to_matrix(self.forward(q))

    def inverse(
        self,
        poses: ArrayLike,
        *,
        locked: Mapping[int, ArrayLike] | None = None,
        elbow: ArrayLike | None = None,
        method: str = "motors",
        near: ArrayLike | None = None,
        link: str | None = None,
        way: str | None = None,
    ) -> Solutions:
        """Return all configurations that reach the given poses.

        The method depends on the structure of the arm:

        - Closed forms are used where the last or the first three axes intersect (at most 8 branches; 16 where the other
          three axes are skew), where the second to fourth or the third to fifth axes are parallel and the two axes
          beyond them intersect (8), for planar arms and SCARA (2), and for arms with three prismatic joints (2).
        - All branches of other arms with six joints, up to 16, are roots of a polynomial, computed as eigenvalues
          (`inverse.elimination`). With two prismatic joints they are roots of a function of one angle, located on a
          grid (`inverse.slides`).
        - All remaining arms are solved by damped Gauss-Newton iteration on motors from 24 starts, and up to 8 distinct
          configurations are kept. This includes redundant arms, unless `locked` or `elbow` selects a configuration.

        Angles are shifted by multiples of 2 pi into the joint limits where possible. Branches outside the limits are
        returned, too, and flagged. Joints that do not move the end effector have the value 0, or that of `near`,
        clipped to the limits.

        Parameters
        ----------
        poses : array_like, (..., 8) or (..., 4, 4)
            Motors of either sign, or matrices, as returned by `forward` and `pose`.
        locked : mapping of int to array_like, optional
            For arms with seven joints: joint indices, counted from 0, and the fixed value of each, either one number or
            one for each pose. Many different values are fast for the first and the last joint only.
        elbow : array_like, optional
            For arms with seven joints whose first three axes intersect in a shoulder and last three in a wrist: the
            angle in radians of the fourth axis about the line from shoulder to wrist, as measured by `elbow_angle`.
        method : str, optional
            "motors", or "affine" or "conformal" for arms with a spherical wrist or three parallel axes that need no
            quartic. These two compute the same branches in another order, by intersecting circles, lines, planes and
            spheres.
        near : array_like, (n,) or (..., n), optional
            A reference configuration, or one for each pose, such as the current one. `nearest` is then the branch
            closest to it, and of the angles that differ by multiples of 2 pi the closest one within the limits is
            chosen. For redundant arms, the search begins at it and remains within the limits where possible.
        link : str, optional
            The name of a link of a URDF file that is to have the poses, instead of the end effector.
        way : str, optional
            Deprecated name of `method`.

        Returns
        -------
        Solutions
            Branches, their validity, a status for each pose, and the nearest reachable configuration.

        Raises
        ------
        TypeError, ValueError
            If an argument has a wrong shape or type, a joint does not exist, `elbow` or `method` does not apply to the
            arm, or the link is unknown or fixed to the base.
        """
        single = self._computed.single_pose
        if single and locked is None and elbow is None and method == "motors" and link is None is way:
            quick: Solutions | None = single.attempt(poses, near)
            if quick is not None:
                return quick
        if way is not None:
            warnings.warn(
                "Robot.inverse: parameter way is now method; the old name will be removed in version 0.3",
                DeprecationWarning,
                stacklevel=2,
            )
            method = way
        if link is not None:
            return _to_link(self, link).inverse(poses, locked=locked, elbow=elbow, method=method, near=near)
        if not isinstance(locked, (Mapping, NoneType)):
            raise TypeError(
                f"{self.name}: locked: {type(locked).__name__}; expected a mapping of joints to values, such as "
                "{6: 0.5}"
            )
        arm, variables = self._arm()
        if arm is self:
            own = self._computed.own.get("inverse")
            if single is None and not locked and elbow is None and method == "motors":
                self._computed.single_pose = single_pose(self) or False
            return _inverse(self, poses, locked=locked, elbow=elbow, method=method, near=near, own=own)
        for joint in locked or {}:
            if joint not in variables:
                raise ValueError(
                    f"{self.name}: locked: joint {joint!r} does not move the end effector; expected one of {variables}"
                )
        kept = {variables.index(joint): value for joint, value in (locked or {}).items()}
        start = np.zeros(self.n_joints) if near is None else self._variables(near, "near")[0]
        part = None if near is None else start[..., variables]
        found = _inverse(arm, poses, locked=kept, elbow=elbow, method=method, near=part)
        # Joints that do not move the end effector keep the values of `near`, clipped to their limits.
        still = np.clip(start.astype(float), self.limits[:, 0], self.limits[:, 1])
        q = np.broadcast_to(still[..., None, :], (*found.q.shape[:-1], self.n_joints)).copy()
        nearest = np.broadcast_to(still, (*found.nearest.shape[:-1], self.n_joints)).copy()
        q[..., variables], nearest[..., variables] = found.q, found.nearest
        q[~found.valid] = np.nan
        nearest[np.isnan(found.nearest).any(-1)] = np.nan
        return replace(found, q=q, nearest=nearest)

    def self_motions(self, pose: ArrayLike, *, step: float = 0.05) -> tuple[SelfMotion, ...]:
        """Return all branches of configurations in which an arm with seven joints reaches a pose.

        The configurations of such an arm are curves, most of them closed. Limits do not end a curve: each configuration
        says whether it is within them.

        Parameters
        ----------
        pose : array_like, (8,) or (4, 4)
            A motor of either sign, or a matrix, as in `inverse`.
        step : float
            The distance of successive configurations, at most; radians, or metres for prismatic joints.

        Returns
        -------
        tuple of SelfMotion
            Empty if no start leads to the pose.

        Raises
        ------
        TypeError, ValueError
            If an argument has a wrong shape, the pose is not finite, the arm does not have seven joints, or `step` is
            not between 1e-4 and 0.5.

        Notes
        -----
        The branches are found from 96 random starts; branches closer to each other than `step` count as one. Each is
        followed along the rates that do not move the end effector, and corrected by `inverse`'s descent. A branch of
        iiwa or Panda takes some 10 to 25 ms; all configurations reach the pose to rounding errors.
        """
        arm, variables = self._arm()
        if len(variables) != self.n_joints:
            raise ValueError(f"{self.name}: self_motions: joints beside the arm; expected a robot that is an arm only")
        return self_motions(arm, pose, step)

    def reach(
        self, tasks: Task | Iterable[Task], *, near: ArrayLike | None = None, rest: ArrayLike | None = None
    ) -> Reached:
        """Return configurations that fulfil several tasks at once, within the limits of the variables.

        `algorithms.kinematics.tasks` has the tasks: a point of a link at a place, on a line, a plane or a sphere, an
        axis of a link along or across a direction or towards a point, an orientation, a pose. They may concern several
        links of a tree. Other methods return one configuration, of which there are mostly infinitely many; `inverse`
        returns all branches of an arm for a pose.

        Parameters
        ----------
        tasks : Task or sequence of Task
            Targets have leading axes if each configuration has targets of its own.
        near : array_like, (..., n), optional
            Where the search begins, such as the current configuration. The default is 0, moved into the limits.
        rest : array_like, (..., n), optional
            A configuration that is to be approached as far as the tasks leave the robot free, in the sum of squared
            differences; those of angles are multiplied by the size of the robot. Without it, a robot remains where the
            descent from `near` leads it.

        Returns
        -------
        Reached
            Configurations, a status for each, and the distance that is left of each task.

        Raises
        ------
        TypeError, ValueError
            If an argument has a wrong shape or type, a link is unknown or fixed to the base, or the base floats.

        Notes
        -----
        The sum of the squared weighted distances is minimized by damped Gauss-Newton steps (`gacompiler.specs.tasks`)
        from `near`, then from random configurations around it and within the limits. Where `rest` is given, its
        distance is added with decreasing weights and finally without. `Reaching` keeps the tables of the tasks, for
        control loops in which only targets change.

        Of 2,000 random poses of a Panda arm, and as many places with directions, views and points on spheres, all are
        reached. Distances that are left are below 1e-9 of its size.

        Examples
        --------
        >>> from algorithms.kinematics import Robot, tasks
        >>> arm = Robot.named("panda")
        >>> found = arm.reach([tasks.position([0.4, 0.1, 0.5]), tasks.across([0, 0, 1], axis=[1, 0, 0])])
        >>> found.status
        array(0, dtype=int8)
        """
        return reached(self, tasks, near, rest)

    def view(
        self,
        urdf: str | Path | None = None,
        *,
        q: ArrayLike | None = None,
        arguments: Mapping[str, object] = urdf.NO_ARGUMENTS,
    ) -> RobotView:
        """Return a view of the robot for a browser, with a slider for each variable.

        Parameters
        ----------
        urdf : str or Path, optional
            A file or text of URDF, whose links look like their <visual> elements: boxes, cylinders, spheres, and convex
            hulls of meshes of STL and OBJ; like <collision> where a mesh is of another format. By default, lines
            connect the joints.
        q : array_like, (n,), or (8 + m,) if the base floats, optional
            Where the sliders start, moved into the limits. The default is 0.
        arguments : mapping of str, optional
            As in `from_urdf`.

        Returns
        -------
        RobotView
            A notebook displays it, and ``save(path)`` writes one HTML file, which needs no network. The frames are
            computed in the browser by emitted JavaScript.

        Raises
        ------
        TypeError, ValueError
            If `q` has a wrong shape or the file does not describe a robot.
        OSError
            If the file cannot be read.
        """
        return view_of(self, q, urdf, arguments)

    def _arm(self) -> tuple[Robot, list[int]]:
        """Return the chain from the base to the end effector as a robot, and the indices of its variables."""
        if self._computed.arm is None:
            self._computed.arm = self._arm_of_path()
        arm, variables = self._computed.arm
        return arm or self, variables

    def _arm_of_path(self) -> tuple[Robot | None, list[int]]:
        """As `_arm`, with None for the robot itself."""
        path = list(self.path)
        if not self.coupling.size and len(path) == len(self.kinds):
            return None, path
        variables = path
        if self.coupling.size:
            rows = self.coupling[path]
            variables = [int(k) for k in rows.argmax(axis=1)]
            own = np.zeros_like(rows)
            own[range(len(path)), variables] = 1.0
            for j, same in zip(path, (rows == own).all(axis=1), strict=True):
                if not same or variables.count(variables[path.index(j)]) > 1:
                    raise ValueError(
                        f"{self.name}: inverse: {self.joint_names[j]} follows another joint; expected an independent "
                        "variable for each joint between the base and the end effector"
                    )
        kinds = tuple(self.kinds[j] for j in path)
        limits = self.limits[variables]
        return Robot(self.name, kinds, self.axes[path], self.home[path], tool=self.tool, limits=limits), variables


@lru_cache(maxsize=64)
def _to_link(robot: Robot, link: str) -> Robot:
    """Return the robot whose end effector is a link, the same object for equal arguments."""
    joint, motor = robot.carrier(link)
    if joint < 0:
        raise DescriptionError(f"{robot.name}: link {link!r} is fixed to the base; expected one that a joint moves")
    return replace(robot, tip=joint, tool=motor, module=None)


_Kind = TypeVar("_Kind", bound=Robot)
_BY_BASE: dict[str, type[Robot]] = {}


def for_base(base: str) -> Callable[[type[_Kind]], type[_Kind]]:
    """Register the decorated class as the one that `Robot.from_urdf` returns for the given value of `base`."""

    def declare(kind: type[_Kind]) -> type[_Kind]:
        _BY_BASE[base] = kind
        return kind

    return declare


def _carried(bodies: tuple[Body, ...], home: Reals) -> dict[str, Any]:
    """Return the `bodies` and `armature` of a `Model` from bodies in the frames after the joints."""
    if not bodies:
        return {}
    if len(bodies) != len(home):
        raise JointCountError(f"{len(bodies)} bodies for {len(home)} joints; expected one body for each joint")
    rows = [moved(motor, [body.row]) for motor, body in zip(home, bodies, strict=True)]
    return {"bodies": np.array(rows), "armature": np.array([body.armature for body in bodies])}
