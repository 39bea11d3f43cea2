"""What a robot is: joints in a tree, each with an axis and what it carries, all where every variable is 0."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from importlib import import_module
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals, real_array
from . import folded
from .computed import Attempts, Computed, Method
from .constants import Floats
from .denavit_hartenberg import Joint
from .errors import DescriptionError, JointCountError, MissingInertiaError, NotFiniteError, UnknownJointTypeError
from .tables import path_to

_FLOAT64 = np.dtype(np.float64)
_FLOATS = (_FLOAT64, np.dtype(np.float32))

STANDARD_GRAVITY = (0.0, 0.0, -9.81)
"""The acceleration of free fall that robots' tables are made with, m/s²."""


def _empty() -> Floats:
    return np.empty(0)


@dataclass(frozen=True, slots=True, eq=False)
class Model:
    """The constants of a robot. Immutable; arrays are copies, and cannot be written to.

    The frame after joint j is the motor ``exp(-x_i/2 l_i) ... exp(-x_j/2 l_j) H_j`` over the joints from the base to j:
    the product of exponentials (Brockett 1984) with the unit lines ``l`` of the joints and the motors ``H`` of the
    frames, both where all joint variables are 0. A prismatic joint translates along its line instead. All conventions
    become this form once, when the robot is made.

    Attributes
    ----------
    name : str
    kinds : tuple of Joint
        One for each joint, what carries before what is carried; N of them.
    axes : array, (N, 6)
        Unit lines of the joints at home, in the base frame: e12, e13, e23, e01, e02, e03.
    home : array, (N, 8)
        Motors of the frames after every joint at home: 1, e12, e13, e23, e01, e02, e03, e0123.
    parents : tuple of int
        The joint that carries each joint, -1 for the base. Left out: each carries the next.
    joint_names : tuple of str
    tip : int
        The joint that carries the end effector; left out, the last one.
    tool : array, (8,)
        The motor of the end effector at home; left out, the frame after joint `tip`.
    bodies : array, (N, 10)
        What each joint carries, at home in the base frame: mass, centre x y z, tensor about the centre xx, xy, xz, yy,
        yz, zz. Empty where nothing is known of masses.
    armature : array, (N,)
        Inertia of the motors' rotors seen at the joints.
    without_inertia : tuple of str
        Links that move and have no inertia; dynamics is refused where there are any.
    free_fall : array, (3,)
        Gravity in the base frame, m/s².
    limits : array, (n, 4)
        For each variable: lowest, highest, speed, effort; infinite where there is no limit.
    coupling : array, (N, n + 1)
        Joints that follow others (mimic): their positions are ``coupling[:, :n] q + coupling[:, n]``. Empty where each
        joint has its own variable.
    links : mapping of str to (int, array (8,))
        By name of a link: the joint that carries it, and its motor at home.
    module : module or None
        Kernels with constants folded, written by ``gac robot``. Those that were made from the constants of this robot
        are used, and no others: `uses`.
    """

    name: str
    kinds: tuple[Joint, ...]
    axes: Floats
    home: Floats
    parents: tuple[int, ...] = ()
    joint_names: tuple[str, ...] = ()
    tip: int = -1
    tool: Floats = field(default_factory=_empty)
    bodies: Floats = field(default_factory=_empty)
    armature: Floats = field(default_factory=_empty)
    without_inertia: tuple[str, ...] = ()
    free_fall: Floats = field(default_factory=lambda: np.array(STANDARD_GRAVITY))
    limits: Floats = field(default_factory=_empty)
    coupling: Floats = field(default_factory=_empty)
    links: Mapping[str, tuple[int, Floats]] = field(default_factory=dict)
    module: Any = None
    _computed: Computed = field(init=False, repr=False)
    """The kernels of `generated.robots` with the tables of this robot."""
    _attempts: Attempts = field(init=False, repr=False)
    """Their quick calls, which methods try first."""
    _own: folded.Folded = field(default=folded.NOTHING, init=False, repr=False)
    """The kernels of the module that were made from the same constants; none where joints follow others."""

    def __post_init__(self) -> None:
        count = len(self.kinds)
        if not count:
            raise JointCountError(f"{self.name}: no joint; expected at least one")

        def fill(name: str, value: Any) -> None:
            object.__setattr__(self, name, value)

        if not self.parents:
            fill("parents", tuple(range(-1, count - 1)))
        if not self.joint_names:
            fill("joint_names", tuple(f"joint {k}" for k in range(count)))
        if self.tip < 0:
            fill("tip", count - 1)
        if not self.tool.size:
            fill("tool", self.home[self.tip].copy())
        if not self.armature.size:
            fill("armature", np.zeros(count))
        n = self.coupling.shape[1] - 1 if self.coupling.size else count
        if not self.limits.size:
            fill("limits", np.tile([-np.inf, np.inf, np.inf, np.inf], (n, 1)))
        if self.limits.shape != (n, 4):
            raise JointCountError(f"{self.name}: limits of shape {self.limits.shape}; expected ({n}, 4)")
        fill("links", MappingProxyType(dict(self.links)))
        for name, shape in (("axes", (count, 6)), ("home", (count, 8)), ("tool", (8,)), ("armature", (count,))):
            found = getattr(self, name)
            if found.shape != shape:
                raise JointCountError(f"{self.name}: {name} of shape {found.shape}; expected {shape}")
            if not np.isfinite(found).all():
                raise NotFiniteError(f"{self.name}: {name} has a NaN or an infinite number; expected finite numbers")
        for kind in self.kinds:
            if not isinstance(kind, Joint):
                raise UnknownJointTypeError(f"{self.name}: kind {kind!r}; expected Joint.REVOLUTE or Joint.PRISMATIC")
        if not np.isfinite(self.bodies).all() or np.isnan(self.limits).any() or not np.isfinite(self.coupling).all():
            raise NotFiniteError(f"{self.name}: bodies, limits or coupling with a NaN; expected numbers")
        for joint, (low, high, speed, effort) in enumerate(self.limits):
            if low > high:
                raise DescriptionError(
                    f"{self.name}: limits of joint {joint}: {low} to {high}; expected the lower first"
                )
            if speed < 0 or effort < 0:
                raise DescriptionError(
                    f"{self.name}: limits of joint {joint}: speed {speed}, effort {effort}; expected no negative number"
                )
        if self.bodies.size and self.bodies.shape != (count, 10):
            raise JointCountError(f"{self.name}: bodies of shape {self.bodies.shape}; expected ({count}, 10)")
        if any(not -1 <= parent < j for j, parent in enumerate(self.parents)) or len(self.parents) != count:
            raise DescriptionError(
                f"{self.name}: parents {self.parents}; expected an earlier joint or -1 for each joint"
            )
        for name in ("axes", "home", "tool", "bodies", "armature", "free_fall", "limits", "coupling"):
            kept = np.array(getattr(self, name), float)
            kept.flags.writeable = False
            fill(name, kept)
        fill("_own", folded.kernels_of(self))
        fill("_computed", Computed(self, self._own.names))
        fill("_attempts", self._computed.attempts)

    def __reduce__(self) -> tuple[Any, ...]:
        kept = {entry.name: getattr(self, entry.name) for entry in fields(self) if entry.init}
        module = None if self.module is None else self.module.__name__
        return _unpickled, (type(self), {**kept, "links": dict(self.links), "module": module})

    @property
    def n_joints(self) -> int:
        """The number of joint variables."""
        return self.coupling.shape[1] - 1 if self.coupling.size else len(self.kinds)

    @property
    def n_positions(self) -> int:
        """The length of `q`: that of its rates, but for a base that floats."""
        return self.n_joints

    @property
    def uses(self) -> Mapping[str, str]:
        """For each method the module whose kernels it calls: the robot's own, or ``generated.robots`` as for any robot.

        Kernels of the module that were made from other constants than the robot has are not used. So a robot with
        another tool has the generic `forward`, and its own `mass_matrix`.
        """
        return MappingProxyType(folded.uses(self._own, self.module))

    @property
    def path(self) -> tuple[int, ...]:
        """The joints from the base to the end effector."""
        return path_to(self, self.tip)

    def _run(self, kernel: Method, names: Sequence[str], *values: ArrayLike) -> Any:
        """A kernel of `generated.robots` on variables, rates and forces; float32 gives float32.

        Whatever the kernel cannot do at once is checked here, since errors name the robot.
        """
        found = kernel.attempt(*values)
        if found is not None:
            return found
        shape, rows = self._together(*zip(values, names, strict=True))
        arrays = [row.reshape(*shape, self.n_joints) for row in rows]
        found = kernel(*(array.astype(_FLOAT64, copy=False) for array in arrays))
        if arrays[0].dtype is _FLOAT64:
            return found
        if isinstance(found, tuple):
            return tuple(np.asarray(each, arrays[0].dtype)[()] for each in found)
        return np.asarray(found, arrays[0].dtype)[()]

    def _variables(self, value: ArrayLike, name: str) -> tuple[Reals, Reals]:
        """Joint variables or their rates as given, and as rows."""
        if type(value) is np.ndarray and value.dtype in _FLOATS and value.shape[-1:] == (self.n_joints,):
            return value, value if value.ndim == 2 else value.reshape(-1, self.n_joints)
        array = real_array(value, f"{self.name}: {name}", (self.n_joints,), f"{self.n_joints} joint variables")
        return array, array.reshape(-1, self.n_joints)

    def _together(self, *values: tuple[ArrayLike, str]) -> tuple[tuple[int, ...], list[Reals]]:
        """The leading axes that several arguments have in common, and each as rows."""
        arrays = [self._variables(value, name)[0] for value, name in values]
        if all(a.shape == arrays[0].shape and a.dtype == arrays[0].dtype for a in arrays):
            return arrays[0].shape[:-1], [a.reshape(-1, self.n_joints) for a in arrays]
        dtype = np.result_type(*arrays)
        try:
            together = np.broadcast_arrays(*arrays)
        except ValueError:
            shapes = ", ".join(f"{name} {a.shape}" for (_, name), a in zip(values, arrays, strict=True))
            raise ValueError(f"{self.name}: {shapes}; expected leading axes that broadcast") from None
        return together[0].shape[:-1], [a.reshape(-1, self.n_joints).astype(dtype, copy=False) for a in together]

    def _reduced(self, columns: Reals) -> Reals:
        """Derivatives by all joints (..., N) as derivatives by the variables (..., n)."""
        if not self.coupling.size:
            return columns
        return columns @ self.coupling[:, :-1].astype(columns.dtype)  # type: ignore[no-any-return]

    def _need_inertia(self) -> None:
        if self.without_inertia:
            links = ", ".join(self.without_inertia)
            raise MissingInertiaError(f"{self.name}: no inertia of {links}; expected one for every link that moves")
        if not self.bodies.size:
            raise MissingInertiaError(f"{self.name}: nothing known of masses; expected bodies, one for each joint")


def _unpickled(cls: type[Model], kept: dict[str, Any]) -> Model:
    module = kept["module"]
    return cls(**{**kept, "module": None if module is None else import_module(module)})
