"""Dynamics of robots whose links are held by contacts and closed loops: accelerations, forces and impacts.

One class in one file.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import constraints as kernels
from generated import pga3

from ..arguments import Reals, finite_number
from ..evidence import Status
from .contacts import IDENTITY, Constraint
from .dynamics import Dynamics
from .errors import DescriptionError
from .tables import FREEDOMS, base_of, carried_by, followed, is_floating, joints_of, path_to

_DEPENDENT = 2.0**-26
"""The part of a row below which it depends on others, as in `gacompiler.specs.constraints`."""
_JOINTS = ("parents", "variables", "ratios", "offsets", "places", "screws", "turns", "coordinates")


class ConstraintStatus(Status):
    """Outcome for one configuration.

    ``OK``: the accelerations and forces are determined. ``REDUNDANT``: some constraints, or forces, follow from others.
    The result is right; of all forces that give it, those with the smallest sum of squares are returned.
    ``CONTRADICTORY``: constraints contradict each other, or no forces hold the passive joints; only some are satisfied.
    ``NO_INERTIA``: a joint moves no inertia. ``NOT_FINITE``: an argument is NaN or infinite.
    """

    OK = 0
    REDUNDANT = 1
    CONTRADICTORY = 2
    NO_INERTIA = 3
    NOT_FINITE = 4


_FLOAT64 = np.dtype(np.float64)
_OK, _REDUNDANT, _CONTRADICTORY = (np.array(code, np.int8) for code in tuple(ConstraintStatus)[:3])


@dataclass(slots=True, eq=False)
class Response:
    """What a robot does under constraints.

    Attributes
    ----------
    result : array, (..., n)
        Accelerations, forces of joints, or velocities after an impact.
    forces : array, (..., r)
        Forces of the constraints, or impulses: those of each constraint in turn (`Constrained.parts`).
    status : array of int, (...)
        Values of `ConstraintStatus`.
    """

    result: Reals
    forces: Reals
    status: NDArray[np.int8]


class _Given(NamedTuple):
    """Arguments in double precision, (n,) or (N, n), with the leading axes and the type of the results."""

    lead: tuple[int, ...]
    dtype: np.dtype[Any]
    rows: tuple[Reals, ...]

    def shaped(self, found: Reals, axes: int = 1) -> Reals:
        """Return a result with its last axes, in the shape and type of the arguments."""
        if found.ndim == axes and not self.lead and self.dtype is found.dtype:
            return found
        return found.reshape(*self.lead, *found.shape[found.ndim - axes :]).astype(self.dtype, copy=False)


class Constrained:
    """A robot with constraints, with its tables prepared.

    Parameters
    ----------
    robot : Robot
        With a fixed or a floating base; joints may follow others.
    constraints : Constraint or sequence of Constraint
        From `algorithms.kinematics.contacts`.
    passive : sequence of str, optional
        Joints without a motor, for `inverse_dynamics`. A floating base always has none. A joint that follows another
        (mimic) is moved by the motor of that, and naming it has no effect. Joints that always have the same position
        are named together, because either may be the one that follows.

    Attributes
    ----------
    parts : tuple of slice
        The forces of each constraint among those of all.

    Raises
    ------
    TypeError, ValueError
        If there is no constraint, a link or joint is unknown, no joint moves the first link of a constraint, or only
        some of the joints with the same position are passive.
    MissingInertiaError
        If masses are unknown.

    Examples
    --------
    >>> from algorithms.kinematics import Constrained, Robot, contacts
    >>> arm = Robot.named("ur5")
    >>> held = Constrained(arm, contacts.point(directions=[[0, 0, 1]]))
    >>> q, still = [0, -1.0, 1.0, 0, 0, 0], [0] * 6
    >>> found = held.forward_dynamics(q, still, still)
    >>> found.status
    array(0, dtype=int8)
    """

    def __init__(
        self, robot: Dynamics, constraints: Constraint | Iterable[Constraint], passive: Sequence[str] = ()
    ) -> None:
        given = [constraints] if isinstance(constraints, Constraint) else list(constraints)
        if not given:
            raise ValueError("constraints: none; expected at least one, such as contacts.point('foot')")
        for each in given:
            if not isinstance(each, Constraint):
                raise TypeError(f"constraints: {type(each).__name__}; expected those of algorithms.kinematics.contacts")
        self._robot = robot
        ends = np.cumsum([0, *(len(each.rows) for each in given)])
        self.parts = tuple(slice(int(a), int(b)) for a, b in pairwise(ends))
        self._count = int(ends[-1])
        self._passive = self._coordinates_of(passive)
        table = joints_of(robot)
        base = base_of(robot)
        lengths = {"m": robot.n_joints, "k": robot.n_positions, "r": self._count}
        self._rows = kernels.constraint_rows.bind(
            lengths,
            **{name: getattr(table, name) for name in _JOINTS},
            **self._tables(given),
            base=base.base,
            freedoms=base.freedoms,
        )
        self._constrained = kernels.constrained.bind(
            {"m": robot.n_joints, "r": self._count}, largest=robot._computed.largest_inertias
        )
        self._balanced = kernels.balanced.bind({"u": len(self._passive), "r": self._count})
        self._smallest = kernels.smallest_multipliers.bind({"r": self._count})
        self._lengths = robot.n_positions, robot.n_joints, robot.n_joints
        self._still = np.zeros(robot.n_joints)

    def forward_dynamics(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike, *, frequency: float = 0.0) -> Response:
        """Return the accelerations under joint forces, gravity and the constraints, and the forces of these.

        Parameters
        ----------
        q, qd, tau : array_like, (..., n), or `q` (..., 8 + m) if the base floats
            As in `Robot.forward_dynamics`. The constraints are imposed on the accelerations: `q` and `qd` should
            satisfy them.
        frequency : float
            Errors of position and velocity decay like those of critically damped oscillators with this angular
            frequency, rad/s (Baumgarte 1972). The default, 0, does not correct them.

        Returns
        -------
        Response

        Raises
        ------
        TypeError, ValueError
            If an argument has a wrong shape, or the frequency is negative.
        """
        omega = finite_number(frequency, "frequency")
        if omega < 0:
            raise ValueError(f"frequency: {omega}; expected 0 or more")
        given = self._given((q, "q"), (qd, "qd"), (tau, "tau"))
        at, rates, force = given.rows
        matrix, wanted, gaps, terms, scales, gap_scales = self._rows(at, rates)
        if omega:
            wanted = wanted + omega * (2 * _times(matrix, rates) + omega * gaps)
            scales = scales + omega * (2 * _times(terms, np.abs(rates)) + omega * gap_scales)
        rest = force - self._robot._computed.held(at, rates)
        return self._solved(given, rest, (matrix, -wanted, terms, scales))

    def inverse_dynamics(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Response:
        """Return the forces of the joints that have motors, and of the constraints, for given accelerations.

        Parameters
        ----------
        q, qd, qdd : array_like, (..., n), or `q` (..., 8 + m) if the base floats
            As in `Robot.inverse_dynamics`. The accelerations should satisfy the constraints; `accelerations` checks
            them.

        Returns
        -------
        Response
            The forces of passive joints and of a floating base are zero. Of all forces of constraints that make them
            zero, those with the smallest sum of squares are returned.

        Raises
        ------
        TypeError, ValueError
            If an argument has a wrong shape.
        """
        given = self._given((q, "q"), (qd, "qd"), (qdd, "qdd"))
        at, rates, rising = given.rows
        tau = self._robot.inverse_dynamics(at, rates, rising)
        found = self._rows(at, rates)
        matrix, terms = (np.swapaxes(each, -1, -2) for each in (found[0], found[3]))
        if not len(self._passive):
            return self._response(given, tau, np.zeros((*at.shape[:-1], self._count)), 0, 0.0)
        held = self._passive
        scales = self._scales_of(rates, rising)[..., held]
        rows = (matrix[..., held, :], tau[..., held], terms[..., held, :], scales)
        forces, count, left = self._balanced(*map(np.ascontiguousarray, rows))
        tau = tau - _times(matrix, forces)
        # What remains of the forces of passive joints are rounding errors, or what the constraints cannot exert.
        tau[..., self._passive] *= 0.0
        return self._response(given, tau, forces, count, left)

    def _scales_of(self, rates: Reals, rising: Reals) -> Reals:
        """Return the sizes (..., n) of the terms of forces: bounds of inertias times accelerations.

        An entry of a mass matrix is at most the geometric mean of those on the diagonal.
        """
        robot = self._robot
        fastest = np.abs(rising).max(-1) + np.square(rates).max(-1) + np.linalg.norm(robot.free_fall)
        roots = np.sqrt(robot._computed.largest_inertias)
        scales: Reals = np.asarray(fastest)[..., None] * (roots * roots.max())
        return scales

    def impact(self, q: ArrayLike, qd: ArrayLike, restitution: float = 0.0) -> Response:
        """Return the velocities after the constraints have been closed suddenly, and their impulses.

        Parameters
        ----------
        q, qd : array_like, (..., n), or `q` (..., 8 + m) if the base floats
            Configuration, and velocities before the impact.
        restitution : float
            The velocities of the constraints are multiplied by its negative. The default, 0, is a plastic impact.

        Returns
        -------
        Response
            Its forces are impulses, N s and N m s.

        Raises
        ------
        TypeError, ValueError
            If an argument has a wrong shape, or the restitution is not between 0 and 1.
        """
        bounce = finite_number(restitution, "restitution")
        if not 0 <= bounce <= 1:
            raise ValueError(f"restitution: {bounce}; expected a number from 0 to 1")
        given = self._given((q, "q"), (qd, "qd"))
        at, rates = given.rows
        found = self._rows(at, rates)
        matrix, terms = found[0], found[3]
        momenta = _times(self._robot.mass_matrix(at), rates)
        scales = bounce * _times(terms, np.abs(rates))
        return self._solved(given, momenta, (matrix, -bounce * _times(matrix, rates), terms, scales))

    def matrix(self, q: ArrayLike) -> Reals:
        """Return the matrix (..., r, n) of the constraints: its product with `qd` are the velocities that vanish.

        Parameters
        ----------
        q : array_like, (..., n), or (..., 8 + m) if the base floats

        Raises
        ------
        TypeError, ValueError
            If the argument has a wrong shape.
        """
        return self._evaluated(q)[0]

    def errors(self, q: ArrayLike) -> Reals:
        """Return by how much the constraints are violated, (..., r): lengths, and sines of angles.

        The sine of half a turn is zero: a hinge whose axis points the other way has no errors of angles, nor has a weld
        that is half a turn about one of its axes away from its target. `frequency` corrects neither.

        Parameters
        ----------
        q : array_like, (..., n), or (..., 8 + m) if the base floats

        Returns
        -------
        array, (..., r)
            Zero for constraints without a target.

        Raises
        ------
        TypeError, ValueError
            If the argument has a wrong shape.
        """
        return self._evaluated(q)[2]

    def accelerations(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Reals:
        """Return the accelerations (..., r) of the constraints, which are zero if `qdd` satisfies them.

        Parameters
        ----------
        q, qd, qdd : array_like, (..., n), or `q` (..., 8 + m) if the base floats

        Raises
        ------
        TypeError, ValueError
            If an argument has a wrong shape.
        """
        given = self._given((q, "q"), (qd, "qd"), (qdd, "qdd"))
        at, rates, rising = given.rows
        matrix, drift = self._rows(at, rates)[:2]
        return given.shaped(_times(matrix, rising) + drift)

    def _evaluated(self, q: ArrayLike) -> tuple[Reals, ...]:
        """Return the results of the kernel of rows at rest."""
        given = self._given((q, "q"))
        found = self._rows(given.rows[0], self._still)[:3]
        return tuple(given.shaped(each, each.ndim - given.rows[0].ndim + 1) for each in found)

    def _given(self, *values: tuple[Any, str]) -> _Given:
        """Check and broadcast arguments. Single configurations in double precision, as of control loops, come first."""
        rows = tuple(value for value, _ in values)
        for row, length in zip(rows, self._lengths, strict=False):
            if type(row) is not np.ndarray or row.dtype is not _FLOAT64 or row.shape != (length,):
                break
        else:
            return _Given((), rows[0].dtype, rows)
        lead, found = self._robot._together(*values)
        return _Given(lead, found[0].dtype, tuple(row.astype(float, copy=False) for row in found))

    def _solved(self, given: _Given, force: Reals, rows: tuple[Reals, ...]) -> Response:
        """Return the response to forces; `rows` are the constraints, as arguments of the kernel `constrained`."""
        mass = self._robot.mass_matrix(given.rows[0])
        found, forces, count, left, upper, steps = self._constrained(mass, force, *rows)
        if count.min(initial=self._count) < self._count if count.ndim else count < self._count:
            forces = self._smallest(upper, steps)
        return self._response(given, found, forces, count, left)

    def _response(self, given: _Given, found: Reals, forces: Reals, count: Any, left: Any) -> Response:
        # What remains of a row and of its right-hand side may each be this part of its terms.
        is_single = found.ndim == 1
        if is_single and isfinite(np.dot(found, found) + np.dot(forces, forces)):
            status = _OK if count == self._count else _REDUNDANT
            if left > 2 * _DEPENDENT:
                status = _CONTRADICTORY
            return Response(given.shaped(found), given.shaped(forces), status.copy())
        codes = np.where(np.asarray(count) < self._count, ConstraintStatus.REDUNDANT, ConstraintStatus.OK)
        codes = np.where(np.asarray(left) > 2 * _DEPENDENT, ConstraintStatus.CONTRADICTORY, codes)
        is_found = np.isfinite(found).all(-1) & np.isfinite(forces).all(-1)
        codes = np.where(is_found, codes, ConstraintStatus.NO_INERTIA)
        for row in given.rows:
            codes = np.where(np.isfinite(row).all(-1), codes, ConstraintStatus.NOT_FINITE)
        codes = codes.astype(np.int8).reshape(given.lead)
        return Response(given.shaped(found), given.shaped(forces), codes)

    def _coordinates_of(self, names: Sequence[str]) -> NDArray[np.int64]:
        """Return the coordinates of passive joints and of the base."""
        robot = self._robot
        joints = robot.joint_names
        for name in names:
            if name not in joints:
                raise DescriptionError(f"{robot.name}: passive: no joint {name!r}; expected one of {', '.join(joints)}")
        found = set(range(FREEDOMS * is_floating(robot)))
        moved: dict[int, list[str]] = {}
        for joint, coordinate, ratio, offset in zip(joints, *followed(robot), strict=True):
            if ratio == 1 and offset == 0:
                moved.setdefault(int(coordinate), []).append(joint)
        for coordinate, together in moved.items():
            missing = set(together) - set(names)
            if missing and len(missing) < len(together):
                raise DescriptionError(
                    f"{robot.name}: passive: {', '.join(together)} have the same position; expected all of them or none"
                )
            if not missing:
                found.add(coordinate)
        return np.array(sorted(found), np.int64)

    def _carrier(self, link: str | None) -> tuple[int, Reals]:
        """Return the joint that carries a link, -1 for the base, and the motor of the link in its frame."""
        robot = self._robot
        joint, motor = (robot.tip, robot.tool) if link is None else robot.carrier(link)
        return joint, (motor if joint < 0 else carried_by(robot, joint, motor))

    def _tables(self, constraints: Sequence[Constraint]) -> dict[str, Any]:
        """Return the tables of `gacompiler.specs.constraints`."""
        robot = self._robot
        found: dict[str, list[Any]] = {name: [] for name in _ROWS}
        pairs: list[tuple[int, int, int, float]] = []
        lifted = []
        coordinates, ratios, _ = followed(robot)
        floats = is_floating(robot)
        for each in constraints:
            joint, motor = self._carrier(each.link)
            if joint < 0:
                raise DescriptionError(
                    f"{robot.name}: {each.name}: link {each.link!r} is fixed to the base; expected one that moves"
                )
            other, held = (-1, np.array(IDENTITY)) if each.other is None else self._carrier(each.other)
            target = np.zeros(3) if each.target is None else each.target
            for row in each.rows:
                number = len(found["owners"])
                values = {
                    "owners": joint,
                    "points": pga3.move_point(motor, each.place),
                    "marks": pga3.move_direction(motor, row.mark),
                    "others": max(other, 0),
                    "grounded": float(other < 0),
                    "forces": pga3.move_direction(held, row.force),
                    "torques": pga3.move_direction(held, row.torque),
                    "targets": pga3.move_point(held, target),
                    "bearings": pga3.move_direction(held, row.bearing),
                    "known": float(each.target is not None),
                }
                for name, value in values.items():
                    found[name].append(value)
                for sign, end in ((1.0, joint), (-1.0, other)):
                    path = path_to(robot, end)[floats:]
                    pairs += [(number, mover, coordinates[mover], sign * ratios[mover]) for mover in path]
                if floats and other < 0:
                    lifted.append(number)
        held_rows = np.array([pair[:3] for pair in pairs], np.int64).reshape(-1, 3)
        names = dict(zip(("held", "movers", "places_of"), map(np.ascontiguousarray, held_rows.T), strict=True))
        return {
            **{
                name: np.array(values, kind) for (name, kind), values in zip(_ROWS.items(), found.values(), strict=True)
            },
            **names,
            "factors": np.array([pair[3] for pair in pairs]),
            "lifted": np.array(lifted, np.int64),
            "lifted_freedoms": np.tile(np.arange(FREEDOMS), (len(lifted), 1)),
        }


_ROWS = {
    "owners": np.int64,
    "points": float,
    "marks": float,
    "others": np.int64,
    "grounded": float,
    "forces": float,
    "torques": float,
    "targets": float,
    "bearings": float,
    "known": float,
}
"""The tables of rows, and their types."""


def _times(matrix: Reals, vector: Reals) -> Reals:
    """Return the product of matrices and vectors."""
    if matrix.ndim == 2:
        return np.dot(matrix, vector)  # type: ignore[no-any-return]
    return (matrix @ vector[..., None])[..., 0]
