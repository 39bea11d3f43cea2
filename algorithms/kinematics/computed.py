"""The loop kernels of `generated.robots` with the tables of one robot, each bound on first use.

`Attempts` holds the fast paths of bound kernels, which the extension of the runtime executes directly. Methods try them
before they validate their arguments.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np

from generated import pga3, robots

from .constants import Constants, Floats
from .definite import solved
from .methods import Attempts
from .tables import (
    FREEDOMS,
    Base,
    Joints,
    Pairs,
    armature_of,
    base_of,
    carried_by,
    divided,
    homes_of,
    inertias_of,
    is_floating,
    joints_of,
    origins_of,
    pairs_of,
    path_to,
    pushes_of,
)

Method = Any
"""A kernel with bound tables (`LoopKernel.bind`): a function of the variables, their rates and forces."""

_FLOAT64 = np.dtype(np.float64)
_JOINTS = ("variables", "coordinates", "ratios", "offsets", "places", "screws", "turns")


class _BoundOnce(cached_property[Any]):
    """A kernel that is bound on first use and registered in `Attempts`: the robot's own if it has one."""

    def __get__(self, computed: Any, owner: type | None = None) -> Any:
        if computed is None:
            return self
        name = str(self.attrname)
        found = computed.own[name] if name in computed.own else super().__get__(computed, owner)
        setattr(computed.attempts, name, found.attempt)
        return found


@dataclass(frozen=True, slots=True)
class _Composed:
    """A function of several kernels, with the interface of a kernel."""

    run: Callable[..., Any]
    shapes: tuple[tuple[int], ...]
    """The shapes of configurations, and of rates and forces."""

    def __call__(self, *rows: Floats) -> Any:
        return self.run(*rows)

    def attempt(self, *rows: Any) -> Any:
        """Return the result for a single configuration in double precision, otherwise None."""
        for k, row in enumerate(rows):
            if type(row) is not np.ndarray or row.dtype is not _FLOAT64 or row.shape != self.shapes[min(k, 1)]:
                return None
        return self.run(*rows)


def _named(joints: Joints) -> dict[str, Any]:
    return dict(zip(_JOINTS, joints.rows, strict=True))


class Computed:
    """The kernels for one robot, as functions of `q`, followed by `qd`, `qdd` or `tau`.

    Parameters
    ----------
    model : Constants
    own : mapping of str to Kernel
        The kernels of the robot's own module, which replace those of the same name.

    Attributes
    ----------
    own : mapping of str to Kernel
    attempts : Attempts
        Fast calls of the kernels that have been used.
    reaching : tuple or None
        The fixed parts of the last tasks of `Robot.reach`, and the object that computes them.
    arm : tuple or None
        The chain from the base to the end effector as a robot, None for the robot itself, and its variables.
    single_pose : SinglePose, False or None
        The kernels of `Robot.inverse` for one pose, after the first call; False if poses must be searched.
    of_links : dict of str to tuple of Method
        The kernels of poses and Jacobians of the links that have been used, None for links that do not move.
    """

    def __init__(self, model: Constants, own: Mapping[str, Any]) -> None:
        self._model = model
        self.own = own
        self.attempts = Attempts()
        self.reaching: tuple[Any, Any] | None = None
        self.arm: Any = None
        self.single_pose: Any = None
        self.of_links: dict[str, tuple[Method, Method] | None] = {}

    def _bound(self, kernel: Any, **tables: Any) -> Method:
        """Bind the tables that a kernel takes; configurations and rates must have the robot's lengths."""
        taken = {name: table for name, table in tables.items() if name in kernel.argument_names}
        lengths = {"k": self._model.n_positions, "m": self._model.n_joints}
        known = {name: length for name, length in lengths.items() if name in kernel.lengths}
        return kernel.bind(known, **taken)

    @cached_property
    def _joints(self) -> Joints:
        return joints_of(self._model)

    @cached_property
    def _base(self) -> dict[str, Any]:
        """The tables of the base, and the numbers that stand for its coordinates."""
        own = base_of(self._model)
        return {entry.name: getattr(own, entry.name) for entry in fields(Base)} | {
            "rates": np.zeros(self._model.n_joints)
        }

    @cached_property
    def _all(self) -> dict[str, Any]:
        return {"parents": self._joints.parents, **_named(self._joints), **self._base}

    @cached_property
    def _heavy(self) -> dict[str, Any]:
        """The joints with inertias. The base is moved to the first joint, which does not change the forces."""
        joints = self._joints.relative_to_first
        armature = armature_of(self._model)
        return self._all | _named(joints) | {"inertias": self.inertias, "armature": armature, "gravity": self._gravity}

    @cached_property
    def _pairs(self) -> Pairs:
        return pairs_of(self._model)

    @cached_property
    def _pair_tables(self) -> dict[str, Any]:
        return {entry.name: getattr(self._pairs, entry.name) for entry in fields(Pairs)}

    @property
    def _gravity(self) -> Floats:
        return np.array(self._model.free_fall, float)

    # Kinematics.

    def along(self, joint: int, tool: Floats) -> tuple[Method, Method]:
        """Return the kernels of pose and Jacobian of a frame that a joint carries; `tool` is its motor at home."""
        inside = carried_by(self._model, joint, tool)
        tip = pga3.motor_to_rotor_translation(inside)[1]
        joints, near = self._chain_to(joint)
        return (
            self._bound(robots.forward, **_named(joints), **self._base, tool=inside),
            self._bound(robots.jacobian, **_named(near), **self._base, tip=tip).returning("out", transposed=True),
        )

    def _chain_to(self, joint: int) -> tuple[Joints, Joints]:
        """Return the joints that move a link, and with a fixed base moved to the first of them.

        A floating base is left out if there are other joints: its row does not move.
        """
        path = path_to(self._model, joint)
        if is_floating(self._model):
            found = self._joints.along(path[1:] or path)
            return found, found
        found = self._joints.along(path)
        return found, found.relative_to_first

    @cached_property
    def _of_tip(self) -> tuple[Method, Method]:
        return self.along(self._model.tip, self._model.tool)

    @_BoundOnce
    def forward(self) -> Method:
        """The motor of the end effector, (..., 8)."""
        return self._of_tip[0]

    @_BoundOnce
    def jacobian(self) -> Method:
        """Velocities of the end effector for unit rates, (..., 6, m)."""
        return self._of_tip[1]

    @cached_property
    def _to_tip(self) -> dict[str, Any]:
        """The tables of the joints that move the end effector."""
        own = _named(self._chain_to(self._model.tip)[1])
        inside = carried_by(self._model, self._model.tip, self._model.tool)
        return own | self._base | {"tip": pga3.motor_to_rotor_translation(inside)[1]}

    @_BoundOnce
    def jacobian_rate(self) -> Method:
        """The time derivative of `jacobian`, from q and qd."""
        return self._bound(robots.jacobian_rate, **self._to_tip).returning("out", transposed=True)

    @_BoundOnce
    def velocity(self) -> Method:
        """The velocity of the end effector, (..., 6), from q and qd."""
        return self._bound(robots.velocity, **self._to_tip)

    @_BoundOnce
    def acceleration(self) -> Method:
        """The acceleration of the end effector, (..., 6), from q, qd and qdd."""
        return self._bound(robots.acceleration, **self._to_tip)

    @_BoundOnce
    def forward_all(self) -> Method:
        """The motors of all frames, (..., N, 8)."""
        rotors, places = homes_of(self._model)
        return self._bound(robots.forward_all, **self._all, home_rotors=rotors, home_places=places)

    @_BoundOnce
    def twists_of_joints(self) -> Method:
        """The twists of the joints at unit speed, (..., N, 6)."""
        return self._bound(robots.twists_of_joints, **self._all)

    # Motions.

    @cached_property
    def _places(self) -> dict[str, Any]:
        """The variables of the joints, each once, and their coordinates."""
        model = self._model
        coordinates = np.arange(FREEDOMS if is_floating(model) else 0, model.n_joints)
        variables = coordinates + (model.n_positions - model.n_joints)
        return self._base | {"variables": variables, "coordinates": coordinates}

    @_BoundOnce
    def integrate(self) -> Method:
        """The configuration reached from q with rates v."""
        return self._bound(robots.integrate, **self._places)

    @_BoundOnce
    def difference(self) -> Method:
        """The rates that lead from q0 to q1."""
        return self._bound(robots.difference, **self._places)

    # Dynamics.

    @cached_property
    def inertias(self) -> Floats:
        """Inertial parameters (N, 10), which `torque_regressor` multiplies. Raises a MissingInertiaError."""
        return inertias_of(self._model)

    @_BoundOnce
    def inverse_dynamics(self) -> Method:
        """Joint forces, from q, qd and qdd."""
        return self._bound(robots.inverse_dynamics, **self._heavy)

    @_BoundOnce
    def coriolis(self) -> Method:
        """Joint forces without gravity and accelerations, from q and qd."""
        still = {"gravity": np.zeros(3), "qdd": np.zeros(self._model.n_joints)}
        return self._bound(robots.inverse_dynamics, **self._heavy | still)

    @_BoundOnce
    def gravity(self) -> Method:
        """Joint forces that hold the robot at rest, from q."""
        return self._bound(robots.gravity_forces, **self._heavy)

    @_BoundOnce
    def mass_matrix(self) -> Method:
        """The mass matrix, (..., m, m)."""
        pairs, ratios = self._pairs, self._joints.ratios
        lower, upper = pairs.lower, pairs.upper
        own = {
            "lower": lower,
            "upper": upper,
            "rows": pairs.lower_coordinates,
            "columns": pairs.upper_coordinates,
            "mirrored": np.where(lower == upper, -1, pairs.lower_coordinates),
            "factors": ratios[lower] * ratios[upper],
            "armature": np.where(lower == upper, self._model.armature[lower], 0.0),
        }
        return self._bound(robots.mass_matrix, **self._heavy | own)

    @_BoundOnce
    def inverse_mass_matrix(self) -> Method:
        """The inverse of the mass matrix, (..., m, m), from q."""
        if self._model.coupling.size:
            return _Composed(self._inverse_of_mass_matrix, self._shapes)
        return self._bound(robots.inverse_mass_matrix, **self._heavy | self._push_tables)

    @property
    def _push_tables(self) -> dict[str, Any]:
        pushes = pushes_of(self._model)
        return {entry.name: getattr(pushes, entry.name) for entry in fields(pushes)}

    @_BoundOnce
    def coriolis_matrix(self) -> Method:
        """The matrix of Christoffel symbols, (..., m, m), from q and qd."""
        return self._bound(robots.coriolis_matrix, **self._heavy, **self._pair_tables)

    @_BoundOnce
    def inverse_dynamics_derivatives(self) -> Method:
        """Derivatives of the forces with respect to q and qd, (..., m, m) each, from q, qd and qdd."""
        return self._bound(robots.inverse_dynamics_derivatives, **self._heavy, **self._pair_tables)

    @_BoundOnce
    def forward_dynamics(self) -> Method:
        """Accelerations, from q, qd and tau."""
        if self._model.coupling.size:
            return _Composed(self._accelerations_by_mass_matrix, self._shapes)
        return self._bound(robots.forward_dynamics, **self._heavy, inverse_ratios=divided(self._joints.ratios))

    @_BoundOnce
    def forward_dynamics_derivatives(self) -> Method:
        """Derivatives of the forces as above, and the inverse of the mass matrix, from q, qd and tau."""
        if self._model.coupling.size:
            return _Composed(self._derivatives_by_mass_matrix, self._shapes)
        tables = self._heavy | self._pair_tables | self._push_tables
        return self._bound(robots.dynamics_derivatives, **tables, inverse_ratios=divided(self._joints.ratios))

    # Robots with mimic joints, whose joints accelerate together: the articulated-body algorithm does not apply.

    @property
    def _shapes(self) -> tuple[tuple[int], ...]:
        return (self._model.n_positions,), (self._model.n_joints,)

    @cached_property
    def held(self) -> Method:
        """Joint forces for zero acceleration, from q and qd."""
        still = np.zeros(self._model.n_joints)
        return self._bound(robots.inverse_dynamics, **self._heavy | {"qdd": still})

    def _inverse_of_mass_matrix(self, q: Floats) -> Floats:
        return solved(self.mass_matrix(q), np.eye(self._model.n_joints), self.largest_inertias)

    def _accelerations_by_mass_matrix(self, q: Floats, qd: Floats, tau: Floats) -> Floats:
        rest = tau - self.held(q, qd)
        return solved(self.mass_matrix(q), rest[..., None], self.largest_inertias)[..., 0]

    def _derivatives_by_mass_matrix(self, q: Floats, qd: Floats, tau: Floats) -> tuple[Floats, Floats, Floats]:
        inverse = self._inverse_of_mass_matrix(q)
        qdd = (inverse @ (tau - self.held(q, qd))[..., None])[..., 0]
        return *self.inverse_dynamics_derivatives(q, qd, qdd), inverse

    @cached_property
    def largest_inertias(self) -> Floats:
        """For each of the m variables, an upper bound of its inertia, independent of the directions of the axes."""
        model, joints, origins = self._model, self._joints, origins_of(self._model)
        found = np.zeros(model.n_joints)
        for joint in range(len(model.kinds)):
            mass, *h = self.inertias[joint, :4]
            spread = self.inertias[joint, [4, 7, 9]].sum()
            for carrier in path_to(model, joint):
                away = origins[joint] - origins[carrier]
                about = spread + 2 * abs(away @ h) + mass * (away @ away)
                rotor = model.armature[joint] if joint == carrier else 0.0
                if carrier == 0 and is_floating(model):
                    found[:FREEDOMS] += (about,) * 3 + (mass,) * 3
                    continue
                reflected = (about if joints.turns[carrier] else mass) + rotor
                found[joints.coordinates[carrier]] += joints.ratios[carrier] ** 2 * reflected
        return found

    @_BoundOnce
    def torque_regressor(self) -> Method:
        """The matrix from inertial parameters to forces, (..., m, N, 10), from q, qd and qdd."""
        # A floating base moves all links, its own included.
        links = np.arange(len(self._model.kinds))[: is_floating(self._model) * len(self._model.kinds)]
        moved = {"moved": links, "moved_freedoms": np.tile(np.arange(FREEDOMS), (len(links), 1))}
        near = _named(self._joints.relative_to_first)
        tables = self._all | near | self._pair_tables | moved | {"gravity": self._gravity}
        return self._bound(robots.torque_regressor, **tables)

    @_BoundOnce
    def kinetic_energy(self) -> Method:
        """The kinetic energy, from q and qd."""
        return self._bound(robots.kinetic_energy, **self._heavy)

    @_BoundOnce
    def potential_energy(self) -> Method:
        """The potential energy, from q."""
        return self._bound(robots.potential_energy, **self._all, inertias=self.inertias, gravity=self._gravity)

    @_BoundOnce
    def centre_of_mass(self) -> Method:
        """The centre of mass of all moving links, from q."""
        return self._bound(robots.centre_of_mass, **self._all, inertias=self.inertias).returning("out_1")

    @_BoundOnce
    def centroidal_momentum(self) -> Method:
        """The momentum about the centre of mass, (..., 6), from q and qd."""
        return self._bound(robots.centroidal_momentum, **self._heavy)

    @_BoundOnce
    def centroidal_momentum_matrix(self) -> Method:
        """The matrix of momenta about the centre of mass at unit rates, (..., 6, m)."""
        return self._bound(robots.centroidal_momentum_matrix, **self._heavy).returning("out", transposed=True)
