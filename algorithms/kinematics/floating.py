"""Robots with a floating base: its pose is a motor, its velocity a twist in its own frame.

In the arrays of a `Model` six joints carry the base: three prismatic and three revolute ones. At the origin, where all
of them are 0, their rates are the base's velocities in its own frame, in another order. The dynamics of a robot
elsewhere differ only in the direction of gravity. Therefore everything is computed with the base at the origin, by the
methods for robots with a fixed base, and inertias are summed about the origin of the base. Results do not depend on the
distance from the world's origin, and no attitude is singular. Two corrections are needed: the accelerations of the six
joints differ from those of the base (`velocity_map_rate`), and gravity is an upward acceleration of the base.

The forces on the base are a torque about its origin and a force, both in its frame. One class in one file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NoReturn, Self

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, real_array
from .base_velocity import cross_matrix, rotated, times, velocity_map_rate, velocity_map_rate_derivative
from .errors import FloatingBaseError
from .inverse import Solutions
from .robot import Robot, for_base
from .tables import need_inertia

_MOTOR = 8
_ORDER = (5, 4, 3, 0, 1, 2)
"""Indices of the six joints (prismatic x, y, z, then revolute z, y, x) in the order of velocities: angular, linear."""
_AXES = np.array([[e12, -e13, e23, 0, 0, 0] for e23, e13, e12 in (*np.eye(3), *np.eye(3)[::-1])])
"""Lines of the axes of the six joints at home."""
_BERNOULLI = (1 / 2, 1 / 12, 0.0, -1 / 720, 0.0, 1 / 30240, 0.0, -1 / 1209600, 0.0, 1 / 47900160)
"""Bernoulli numbers divided by factorials, with the signs for velocities in the moving frame."""


@for_base("floating")
@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FloatingRobot(Robot):
    """A robot with a floating base, as returned by ``Robot.from_urdf(path, base="floating")``.

    With m joints, `q` has ``8 + m`` entries: the motor of the base frame in the world (1, e12, e13, e23, e01, e02, e03,
    e0123), followed by the joint variables. M and -M are the same pose; motors are normalised. Velocities,
    accelerations and forces have ``n = 6 + m`` entries: the angular velocity x, y, z of the base and the linear
    velocity x, y, z of its origin, both in the base frame, followed by those of the joints. Accelerations are the time
    derivatives of these components. Derivatives with respect to `q` are taken along ``integrate(q, dv)``.

    Kinematic results are expressed in the world frame, as for a robot with a fixed base. `inverse`, `with_module` and
    `with_base` raise a `FloatingBaseError`.

    Relative to the largest entry, forces and accelerations of G1, Talos, ANYmal and Solo differ from those of Pinocchio
    by less than 1e-12, within 1,000 km of the origin, at any attitude.
    """

    _still_base: Robot = field(init=False, repr=False)
    """The robot with its base at the origin, carried by six joints, without gravity."""

    def __post_init__(self) -> None:
        Robot.__post_init__(self)
        kinds = [kind.value for kind in self.kinds[:6]]
        right = kinds == ["prismatic"] * 3 + ["revolute"] * 3 and self.parents[:6] == (-1, 0, 1, 2, 3, 4)
        if not right or not np.array_equal(self.axes[:6], _AXES) or -1 in self.parents[6:]:
            raise FloatingBaseError(
                f"{self.name}: first joints {kinds} about {self.axes[:6].tolist()}; expected prismatic joints along "
                "x, y, z and revolute joints about z, y, x, in a chain that carries all other joints"
            )
        kept = {name: getattr(self, name) for name in _FIELDS}
        object.__setattr__(self, "_still_base", Robot(**kept, free_fall=np.zeros(3)))

    @property
    def n_positions(self) -> int:
        """The length of `q`."""
        return self.n_joints - 6 + _MOTOR

    # Configurations.

    def integrate(self, q: ArrayLike, v: ArrayLike) -> Reals:
        """Return the configuration reached from `q` with constant velocities `v` for unit time.

        The base follows a screw motion.

        Parameters
        ----------
        q : array_like, (..., 8 + m)
        v : array_like, (..., 6 + m)
            Velocities multiplied by the time step.

        Returns
        -------
        array, (..., 8 + m)
            With a unit motor.

        Raises
        ------
        TypeError, ValueError
            If an argument has a wrong shape.
        """
        now = self._at(q, (v, "v"))
        step = pga3.motor_from_twist(_line(now.rates[0]))
        moved = pga3.normalize_motor(pga3.motor_product(now.base, step))
        return np.concatenate([moved, now.joints + now.rates[0][..., 6:]], axis=-1)

    def difference(self, q0: ArrayLike, q1: ArrayLike) -> Reals:
        """Return the constant velocities v from `q0` to `q1` in unit time, such that ``integrate(q0, v)`` is `q1`.

        Parameters
        ----------
        q0, q1 : array_like, (..., 8 + m)

        Returns
        -------
        array, (..., 6 + m)
            The base rotates by an angle in [0, pi]. Its motor may have either sign.

        Raises
        ------
        TypeError, ValueError
            If an argument has a wrong shape.
        """
        m = self.n_positions
        given = [real_array(q, f"{self.name}: {k}", (m,), self._meaning) for k, q in (("q0", q0), ("q1", q1))]
        start, end = _broadcast(self.name, given, ("q0", "q1"))
        twist = pga3.motor_to_twist(pga3.motor_relative(*(pga3.normalize_motor(q[..., :_MOTOR]) for q in (start, end))))
        return np.concatenate([*pga3.twist_to_velocities(twist), end[..., _MOTOR:] - start[..., _MOTOR:]], axis=-1)

    # Kinematics: computed with the base at the origin, then transformed by the motor of the base.

    def forward(self, q: ArrayLike) -> Reals:
        """As `Robot.forward`."""
        now = self._at(q)
        return pga3.motor_product(now.base, self._still_base.forward(now.x))

    def forward_all(self, q: ArrayLike) -> Reals:
        """As `Robot.forward_all`; the first six frames are the base's."""
        now = self._at(q)
        return pga3.motor_product(now.base[..., None, :], self._still_base.forward_all(now.x))

    def link(self, name: str, q: ArrayLike) -> Reals:
        """As `Robot.link`; a link that the base does not carry is fixed in the world."""
        now, there = self._at(q), self.carrier(name)[1]
        if self.carrier(name)[0] >= 0:
            there = pga3.motor_product(now.base, self._still_base.link(name, now.x))
        return np.broadcast_to(there, now.base.shape).astype(now.base.dtype)

    def jacobian(self, q: ArrayLike, link: str | None = None) -> Reals:
        """As `Robot.jacobian`, (..., 6, n)."""
        now = self._at(q)
        return rotated(now.base, self._still_base.jacobian(now.x, link)[..., self._order])

    def jacobian_rate(self, q: ArrayLike, qd: ArrayLike) -> Reals:
        """As `Robot.jacobian_rate`, (..., 6, n)."""
        now = self._at(q, (qd, "qd"))
        inner, v = self._still_base, now.rates[0]
        joints = v[..., self._places].copy()
        joints[..., :6] = 0
        there = inner.jacobian(now.x)[..., self._order]
        rate = inner.jacobian_rate(now.x, joints)[..., self._order]
        for part in (slice(0, 3), slice(3, 6)):
            rate[..., part, :] += np.cross(v[..., :3, None], there[..., part, :], axisa=-2, axisb=-2, axisc=-2)
        return rotated(now.base, rate)

    def velocity(self, q: ArrayLike, qd: ArrayLike) -> Reals:
        """As `Robot.velocity`."""
        return times(self.jacobian(q), self._at(q, (qd, "qd")).rates[0])

    def acceleration(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Reals:
        """As `Robot.acceleration`."""
        speeds, rates = self._at(q, (qd, "qd"), (qdd, "qdd")).rates
        return times(self.jacobian(q), rates) + times(self.jacobian_rate(q, qd), speeds)

    def twists_of_joints(self, q: ArrayLike) -> Reals:
        """As `Robot.twists_of_joints`; the first six are those of the base joints at the origin."""
        now = self._at(q)
        return pga3.move_line(now.base[..., None, :], self._still_base.twists_of_joints(now.x))

    def _jacobian_of(self, q: ArrayLike, element: Reals, move: pga3.Kernel, twist_on: pga3.Kernel) -> Reals:
        now = self._at(q)
        there = Robot._jacobian_of(self._still_base, now.x, element, move, twist_on)[..., self._order]
        columns = np.swapaxes(there, -1, -2)
        move = pga3.move_direction if move is pga3.move_point else move
        return np.swapaxes(move(now.base[..., None, :], columns), -1, -2)

    # Dynamics: computed with the base at the origin and accelerated upwards instead of gravity.

    def inverse_dynamics(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Reals:
        """As `Robot.inverse_dynamics`, (..., n)."""
        now = self._at(q, (qd, "qd"), (qdd, "qdd"))
        v, a = now.rates
        return self._forces_there(now, v, a, self._falling(now))

    def gravity(self, q: ArrayLike) -> Reals:
        """As `Robot.gravity`, (..., n)."""
        now = self._at(q)
        still = np.zeros((*now.x.shape[:-1], self.n_joints), now.x.dtype)
        return self._forces_there(now, still, still, self._falling(now))

    def coriolis(self, q: ArrayLike, qd: ArrayLike) -> Reals:
        """As `Robot.coriolis`, (..., n)."""
        now = self._at(q, (qd, "qd"))
        return self._forces_there(now, now.rates[0], np.zeros_like(now.rates[0]), np.zeros(3))

    def coriolis_matrix(self, q: ArrayLike, qd: ArrayLike) -> Reals:
        """As `Robot.coriolis_matrix`, (..., n, n)."""
        now = self._at(q, (qd, "qd"))
        inner, v = self._still_base, now.rates[0]
        found = inner.coriolis_matrix(now.x, v[..., self._places])[..., self._order[:, None], self._order]
        found[..., :6] -= self.mass_matrix(q)[..., :6] @ velocity_map_rate(v)
        return found

    def mass_matrix(self, q: ArrayLike) -> Reals:
        """As `Robot.mass_matrix`, (..., n, n); independent of the pose of the base."""
        return self._still_base.mass_matrix(self._at(q).x)[..., self._order[:, None], self._order]

    def inverse_mass_matrix(self, q: ArrayLike) -> Reals:
        """As `Robot.inverse_mass_matrix`, (..., n, n)."""
        return self._still_base.inverse_mass_matrix(self._at(q).x)[..., self._order[:, None], self._order]

    def forward_dynamics(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike) -> Reals:
        """As `Robot.forward_dynamics`, (..., n)."""
        now = self._at(q, (qd, "qd"), (tau, "tau"))
        speeds, forces = (rate[..., self._places] for rate in now.rates)
        found = self._still_base.forward_dynamics(now.x, speeds, forces)[..., self._order]
        found[..., 3:6] += self._falling(now)
        found[..., :6] += times(velocity_map_rate(now.rates[0]), now.rates[0][..., :6])
        return found

    def inverse_dynamics_derivatives(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> tuple[Reals, Reals]:
        """As `Robot.inverse_dynamics_derivatives`, (..., n, n) each."""
        now = self._at(q, (qd, "qd"), (qdd, "qdd"))
        v, a = now.rates
        falling = self._falling(now)
        mass = self.mass_matrix(q)
        speeds, rates = v[..., self._places], self._there(v, a, falling)[..., self._places]
        found = self._still_base.inverse_dynamics_derivatives(now.x, speeds, rates)
        by_q, by_qd = (derivative[..., self._order[:, None], self._order] for derivative in found)
        # Gravity rotates opposite to the base in its frame. The position of the base has no effect.
        by_q[..., :3] = -mass[..., 3:6] @ cross_matrix(falling)
        by_q[..., 3:6] = 0
        by_qd[..., :6] -= mass[..., :6] @ velocity_map_rate_derivative(v)
        return by_q, by_qd

    def torque_regressor(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Reals:
        """As `Robot.torque_regressor`, (..., n, N, 10); the first five of the N joints carry no link."""
        now = self._at(q, (qd, "qd"), (qdd, "qdd"))
        v, a = now.rates
        speeds, rates = v[..., self._places], self._there(v, a, self._falling(now))[..., self._places]
        return self._still_base.torque_regressor(now.x, speeds, rates)[..., self._order, :, :]

    def centre_of_mass(self, q: ArrayLike) -> Reals:
        """As `Robot.centre_of_mass`, in the world frame."""
        now = self._at(q)
        return pga3.move_point(now.base, self._still_base.centre_of_mass(now.x))

    def centroidal_momentum_matrix(self, q: ArrayLike) -> Reals:
        """As `Robot.centroidal_momentum_matrix`, (..., 6, n), in the directions of the world frame."""
        now = self._at(q)
        return rotated(now.base, self._still_base.centroidal_momentum_matrix(now.x)[..., self._order])

    def centroidal_momentum(self, q: ArrayLike, qd: ArrayLike) -> Reals:
        """As `Robot.centroidal_momentum`."""
        return times(self.centroidal_momentum_matrix(q), self._at(q, (qd, "qd")).rates[0])

    def kinetic_energy(self, q: ArrayLike, qd: ArrayLike) -> Reals:
        """As `Robot.kinetic_energy`."""
        now = self._at(q, (qd, "qd"))
        return self._still_base.kinetic_energy(now.x, now.rates[0][..., self._places])

    def potential_energy(self, q: ArrayLike) -> Reals:
        """As `Robot.potential_energy`: zero where all centres of mass are level with the world's origin."""
        need_inertia(self)
        mass = self.bodies[:, 0].sum()
        if mass == 0:
            return np.zeros_like(self._at(q).x[..., 0])[()]
        centre = self.centre_of_mass(q)
        return np.asarray(-mass * (centre @ self.free_fall.astype(centre.dtype)), centre.dtype)[()]

    def _start(self, q: ArrayLike, qd: ArrayLike) -> tuple[tuple[int, ...], list[Reals]]:
        now = self._at(q, (qd, "qd"))
        place = np.concatenate([now.base, now.joints], axis=-1)
        rows = [place.reshape(-1, self.n_positions), now.rates[0].reshape(-1, self.n_joints)]
        return place.shape[:-1], rows

    def _straight(self, x: Reals, v: Reals) -> Reals:
        """Apply the derivative of the inverse exponential (tenth order in the motion `x`) to velocities `v`."""
        motion, change = _line(x), _line(v)
        total = change
        for factor in _BERNOULLI:
            change = pga3.twist_on_line(motion, change)
            total = total + factor * change
        return np.concatenate([*pga3.twist_to_velocities(total), v[..., 6:]], axis=-1)

    # Methods that do not apply to a floating base.

    def with_base(self, base: ArrayLike) -> Self:
        """Raise a FloatingBaseError: `q` determines the pose of the base."""
        self._refuse("with_base", "q determines its pose; use integrate to move it")

    def with_module(self, module: Any) -> Self:
        """Raise a FloatingBaseError: specialised kernels require a fixed base."""
        self._refuse("with_module", "specialised kernels require a fixed base; load the robot with base='fixed'")

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
        """Raise a FloatingBaseError: the base alone reaches every pose."""
        self._refuse("inverse", "the base alone reaches every pose; load the robot with base='fixed'")

    def _refuse(self, name: str, why: str) -> NoReturn:
        raise FloatingBaseError(f"{self.name}: {name}: the base floats, and {why}")

    def _arm(self) -> tuple[Robot, list[int]]:
        self._refuse("inverse", "the base alone reaches every pose; load the robot with base='fixed'")

    def _variables(self, value: ArrayLike, name: str) -> tuple[Reals, Reals]:
        """Raise a FloatingBaseError in methods that are inherited from robots with a fixed base."""
        self._refuse(name, "this requires a fixed base; load the robot with base='fixed' or base='euler'")

    # Conversion between the base's representations.

    @property
    def _order(self) -> Any:
        return np.array([*_ORDER, *range(6, self.n_joints)])

    @property
    def _places(self) -> Any:
        return np.argsort(self._order)

    @property
    def _meaning(self) -> str:
        return f"a motor and {self.n_joints - 6} joint variables"

    def _at(self, q: ArrayLike, *rates: tuple[ArrayLike, str]) -> _State:
        n = self.n_joints
        given = [real_array(q, f"{self.name}: q", (n - 6 + _MOTOR,), self._meaning)]
        given += [real_array(x, f"{self.name}: {name}", (n,), f"6 of the base, {n - 6} of joints") for x, name in rates]
        place, *found = _broadcast(self.name, given, ("q", *(name for _, name in rates)))
        x = np.zeros((*place.shape[:-1], n), place.dtype)
        x[..., 6:] = place[..., _MOTOR:]
        return _State(pga3.normalize_motor(place[..., :_MOTOR]), x, found)

    def _falling(self, now: _State) -> Reals:
        """Return the gravitational acceleration in the frame of the base."""
        back = pga3.motor_inverse(now.base)
        return pga3.move_direction(back, self.free_fall.astype(back.dtype))

    def _there(self, v: Reals, a: Reals, falling: Reals) -> Reals:
        """Return joint accelerations with the base at the origin, with gravity as an upward acceleration."""
        found = a.copy()
        found[..., :6] -= times(velocity_map_rate(v), v[..., :6])
        found[..., 3:6] -= falling
        return found

    def _forces_there(self, now: _State, v: Reals, a: Reals, falling: Reals) -> Reals:
        rates = self._there(v, a, falling)
        speeds, places = v[..., self._places], rates[..., self._places]
        return self._still_base.inverse_dynamics(now.x, speeds, places)[..., self._order]


_FIELDS = (
    *("name", "kinds", "axes", "home", "parents", "joint_names", "tip", "tool", "bodies", "armature"),
    *("without_inertia", "limits", "coupling", "links"),
)


@dataclass(frozen=True, slots=True)
class _State:
    """Unit motors of the base (..., 8), variables with the base at the origin (..., n), and rates, each (..., n)."""

    base: Reals
    x: Reals
    rates: list[Reals]

    @property
    def joints(self) -> Reals:
        """Variables of the joints, without those of the base."""
        return self.x[..., 6:]


def _broadcast(robot: str, arrays: list[Reals], names: tuple[str, ...]) -> list[Reals]:
    """Broadcast the leading axes of arrays and convert them to a common type."""
    try:
        lead = np.broadcast_shapes(*(a.shape[:-1] for a in arrays))
    except ValueError:
        shapes = ", ".join(f"{name} {a.shape}" for name, a in zip(names, arrays, strict=True))
        raise ValueError(f"{robot}: {shapes}; expected leading axes that broadcast") from None
    dtype = np.result_type(*arrays)
    return [np.broadcast_to(a, (*lead, a.shape[-1])).astype(dtype, copy=False) for a in arrays]


def _line(v: Reals) -> Reals:
    """Return the base's velocities as a twist in its frame."""
    return pga3.twist_from_velocities(v[..., :3], v[..., 3:6])
