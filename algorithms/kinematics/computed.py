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
    Joints,
    Pairs,
    carried_by,
    homes_of,
    inertias_of,
    joints_of,
    origins_of,
    pairs_of,
    path_to,
    pushes_of,
)

Method = Any
"""A kernel with bound tables (`LoopKernel.bind`): a function of the variables, their rates and forces."""

_FLOAT64 = np.dtype(np.float64)
_JOINTS = ("variables", "ratios", "offsets", "places", "screws", "turns")


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
    n: int
    """The number of variables."""

    def __call__(self, *rows: Floats) -> Any:
        return self.run(*rows)

    def attempt(self, *rows: Any) -> Any:
        """Return the result for a single configuration in double precision, otherwise None."""
        for row in rows:
            if type(row) is not np.ndarray or row.dtype is not _FLOAT64 or row.shape != (self.n,):
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
    """

    def __init__(self, model: Constants, own: Mapping[str, Any]) -> None:
        self._model = model
        self.own = own
        self.attempts = Attempts()
        self._paths: dict[tuple[int, bytes], tuple[Method, Method]] = {}

    @property
    def _lengths(self) -> dict[str, int]:
        """The expected length of the arguments: the number of variables."""
        return {"m": self._model.n_joints}

    @cached_property
    def _joints(self) -> Joints:
        return joints_of(self._model)

    @cached_property
    def _all(self) -> dict[str, Any]:
        return {"parents": self._joints.parents, **_named(self._joints)}

    @cached_property
    def _heavy(self) -> dict[str, Any]:
        """The joints with inertias. The base is moved to the first joint, which does not change the forces."""
        joints = self._joints.relative_to_first
        return {"parents": joints.parents, **_named(joints), "inertias": self.inertias}

    @cached_property
    def _pairs(self) -> Pairs:
        return pairs_of(self._model)

    @cached_property
    def _pair_tables(self) -> dict[str, Any]:
        names = ("lower", "upper", "lower_variables", "upper_variables", "is_strict")
        return {name: getattr(self._pairs, name) for name in names}

    @property
    def _gravity(self) -> Floats:
        return np.array(self._model.free_fall, float)

    # Kinematics.

    def _along(self, joint: int, tool: Floats) -> tuple[Method, Method]:
        """Return the kernels of pose and Jacobian of a frame that a joint carries; `tool` is its motor at home."""
        key = joint, tool.tobytes()
        if key not in self._paths:
            joints = self._joints.along(path_to(self._model, joint))
            inside = carried_by(self._model, joint, tool)
            tip = pga3.motor_to_rotor_translation(inside)[1]
            self._paths[key] = (
                robots.forward.bind(self._lengths, **_named(joints), tool=inside),
                robots.jacobian.bind(self._lengths, **_named(joints.relative_to_first), tip=tip).returning(
                    "out", transposed=True
                ),
            )
        return self._paths[key]

    def forward_to(self, joint: int, tool: Floats) -> Method:
        """Return the kernel of the motor (..., 8) of a frame that a joint carries."""
        return self._along(joint, tool)[0]

    def jacobian_of(self, joint: int, tool: Floats) -> Method:
        """Return the kernel of the Jacobian (..., 6, m) of a frame that a joint carries."""
        return self._along(joint, tool)[1]

    @_BoundOnce
    def forward(self) -> Method:
        """The motor of the end effector, (..., 8)."""
        return self.forward_to(self._model.tip, self._model.tool)

    @_BoundOnce
    def jacobian(self) -> Method:
        """Velocities of the end effector for unit rates, (..., 6, m)."""
        return self.jacobian_of(self._model.tip, self._model.tool)

    @_BoundOnce
    def jacobian_rate(self) -> Method:
        """The time derivative of `jacobian`, from q and qd."""
        own = _named(self._joints.along(self._model.path).relative_to_first)
        inside = carried_by(self._model, self._model.tip, self._model.tool)
        tip = pga3.motor_to_rotor_translation(inside)[1]
        return robots.jacobian_rate.bind(self._lengths, **own, tip=tip).returning("out", transposed=True)

    @_BoundOnce
    def forward_all(self) -> Method:
        """The motors of all frames, (..., N, 8)."""
        rotors, places = homes_of(self._model)
        return robots.forward_all.bind(self._lengths, **self._all, home_rotors=rotors, home_places=places)

    @_BoundOnce
    def twists_of_joints(self) -> Method:
        """The twists of the joints at unit speed, (..., N, 6)."""
        return robots.twists_of_joints.bind(self._lengths, **self._all)

    # Dynamics.

    @cached_property
    def inertias(self) -> Floats:
        """Inertial parameters (N, 10), which `torque_regressor` multiplies. Raises a MissingInertiaError."""
        return inertias_of(self._model)

    @_BoundOnce
    def inverse_dynamics(self) -> Method:
        """Joint forces, from q, qd and qdd."""
        armature = self._model.armature
        return robots.inverse_dynamics.bind(self._lengths, **self._heavy, armature=armature, gravity=self._gravity)

    @_BoundOnce
    def coriolis(self) -> Method:
        """Joint forces without gravity and accelerations, from q and qd."""
        still = {"gravity": np.zeros(3), "qdd": np.zeros(self._model.n_joints)}
        return robots.inverse_dynamics.bind(self._lengths, **self._heavy, armature=self._model.armature, **still)

    @_BoundOnce
    def gravity(self) -> Method:
        """Joint forces that hold the robot at rest, from q."""
        return robots.gravity_forces.bind(self._lengths, **self._heavy, gravity=self._gravity)

    @_BoundOnce
    def mass_matrix(self) -> Method:
        """The mass matrix, (..., m, m)."""
        pairs, ratios = self._pairs, self._joints.ratios
        lower, upper = pairs.lower, pairs.upper
        return robots.mass_matrix.bind(
            self._lengths,
            **self._heavy,
            lower=lower,
            upper=upper,
            rows=pairs.lower_variables,
            columns=pairs.upper_variables,
            mirrored=np.where(lower == upper, -1, pairs.lower_variables),
            factors=ratios[lower] * ratios[upper],
            armature=np.where(lower == upper, self._model.armature[lower], 0.0),
        )

    @_BoundOnce
    def inverse_mass_matrix(self) -> Method:
        """The inverse of the mass matrix, (..., m, m), from q."""
        if self._model.coupling.size:
            return _Composed(self._inverse_of_mass_matrix, self._model.n_joints)
        pushes = pushes_of(self._model)
        tables = {field.name: getattr(pushes, field.name) for field in fields(pushes)}
        return robots.inverse_mass_matrix.bind(self._lengths, **self._heavy, armature=self._model.armature, **tables)

    @_BoundOnce
    def coriolis_matrix(self) -> Method:
        """The matrix of Christoffel symbols, (..., m, m), from q and qd."""
        return robots.coriolis_matrix.bind(self._lengths, **self._heavy, **self._pair_tables)

    @_BoundOnce
    def inverse_dynamics_derivatives(self) -> Method:
        """Derivatives of the forces with respect to q and qd, (..., m, m) each, from q, qd and qdd."""
        return robots.inverse_dynamics_derivatives.bind(
            self._lengths, **self._heavy, gravity=self._gravity, **self._pair_tables
        )

    @_BoundOnce
    def forward_dynamics(self) -> Method:
        """Accelerations, from q, qd and tau."""
        if self._model.coupling.size:
            return _Composed(self._accelerations_by_mass_matrix, self._model.n_joints)
        armature = self._model.armature
        return robots.forward_dynamics.bind(self._lengths, **self._heavy, armature=armature, gravity=self._gravity)

    # Robots with mimic joints, whose joints accelerate together: the articulated-body algorithm does not apply.

    @cached_property
    def _held(self) -> Method:
        """Joint forces for zero acceleration, from q and qd."""
        armature, still = self._model.armature, np.zeros(self._model.n_joints)
        return robots.inverse_dynamics.bind(
            self._lengths, **self._heavy, armature=armature, gravity=self._gravity, qdd=still
        )

    def _inverse_of_mass_matrix(self, q: Floats) -> Floats:
        return solved(self.mass_matrix(q), np.eye(self._model.n_joints), self._largest_inertias)

    def _accelerations_by_mass_matrix(self, q: Floats, qd: Floats, tau: Floats) -> Floats:
        rest = tau - self._held(q, qd)
        return solved(self.mass_matrix(q), rest[..., None], self._largest_inertias)[..., 0]

    @cached_property
    def _largest_inertias(self) -> Floats:
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
                reflected = (about if joints.turns[carrier] else mass) + rotor
                found[joints.variables[carrier]] += joints.ratios[carrier] ** 2 * reflected
        return found

    @_BoundOnce
    def torque_regressor(self) -> Method:
        """The matrix from inertial parameters to forces, (..., m, N, 10), from q, qd and qdd."""
        joints = self._joints.relative_to_first
        tables = {"parents": joints.parents, **_named(joints)}
        pairs = {name: self._pair_tables[name] for name in ("lower", "upper", "upper_variables")}
        return robots.torque_regressor.bind(self._lengths, **tables, gravity=self._gravity, **pairs)

    @_BoundOnce
    def kinetic_energy(self) -> Method:
        """The kinetic energy, from q and qd."""
        return robots.kinetic_energy.bind(self._lengths, **self._heavy, armature=self._model.armature)

    @_BoundOnce
    def potential_energy(self) -> Method:
        """The potential energy, from q."""
        return robots.potential_energy.bind(self._lengths, **self._all, inertias=self.inertias, gravity=self._gravity)

    @_BoundOnce
    def centre_of_mass(self) -> Method:
        """The centre of mass of all moving links, from q."""
        return robots.centre_of_mass.bind(self._lengths, **self._all, inertias=self.inertias).returning("out_1")

    @_BoundOnce
    def centroidal_momentum_matrix(self) -> Method:
        """The matrix of momenta about the centre of mass at unit rates, (..., 6, m)."""
        return robots.centroidal_momentum_matrix.bind(self._lengths, **self._heavy).returning("out_0", transposed=True)
