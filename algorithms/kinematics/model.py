"""The constants of a robot: a tree of joints with axes and bodies at the zero configuration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from importlib import import_module
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals, real_array
from . import folded
from .computed import Computed, Method
from .constants import Floats
from .denavit_hartenberg import Joint
from .errors import DescriptionError, FloatingBaseError, JointCountError, NotFiniteError, UnknownJointTypeError
from .methods import Attempts
from .tables import FREEDOMS, MOTOR, followed, is_floating, leaders_of, path_to

_FLOAT64 = np.dtype(np.float64)
_FLOATS = (_FLOAT64, np.dtype(np.float32))
_SHOWN = 40
"""The largest number of joints that `repr` lists, which fill a screen."""

STANDARD_GRAVITY = (0.0, 0.0, -9.81)
"""The default gravitational acceleration of robots, m/s²."""


def _empty() -> Floats:
    return np.empty(0)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Model:
    """The constants of a robot. Immutable: arrays are read-only copies.

    The frame after joint j is the motor ``exp(-x_i/2 l_i) ... exp(-x_j/2 l_j) H_j`` over the joints from the base to j.
    This is the product of exponentials (Brockett 1984) with the unit lines ``l`` of the joints and the motors ``H`` of
    the frames, both at home, the configuration where all joint variables are 0. A prismatic joint translates along its
    line instead. All other conventions are converted to this form once, when the robot is created.

    Attributes
    ----------
    name : str
    kinds : tuple of Joint
        One for each of the N joints. Parents precede their children. Joint 0 of a robot whose base floats is its base.
    axes : array, (N, 6)
        Unit lines of the joints at home, in the base frame: e12, e13, e23, e01, e02, e03. That of a floating base is
        not used.
    home : array, (N, 8)
        Motors of the frames after every joint at home: 1, e12, e13, e23, e01, e02, e03, e0123.
    parents : tuple of int
        The joint that carries each joint, -1 for the base. By default each joint carries the next.
    joint_names : tuple of str
    tip : int
        The joint that carries the end effector. The last joint by default.
    tool : array, (8,)
        The motor of the end effector at home. The frame after joint `tip` by default.
    bodies : array, (N, 10)
        The rigid body that each joint carries, at home in the base frame: mass, centre of mass x y z, inertia tensor
        about the centre xx, xy, xz, yy, yz, zz. Empty if the masses are unknown.
    armature : array, (N,)
        Rotor inertias reflected at the joints.
    without_inertia : tuple of str
        Moving links without inertia. Methods of dynamics raise an error if there are any.
    free_fall : array, (3,)
        Gravitational acceleration in the base frame, m/s².
    limits : array, (n, 4)
        For each variable: lower limit, upper limit, maximum velocity, maximum effort; infinite if unlimited.
    coupling : array, (N, n + 1)
        Joints that follow others (mimic): their positions are ``coupling[:, :n] q + coupling[:, n]``. Empty if each
        joint has its own variable.
    leaders : tuple of int, (n,)
        The joint whose position each variable is; 0 for those of a floating base. By default, and after a change of the
        coupling that it contradicts, the first joint that equals the variable, or else the first that it moves.
    links : mapping of str to (int, array (8,))
        For each link name the joint that carries the link, and its motor at home.
    module : module or None
        Specialised kernels written by ``gac robot``. Only kernels that were generated from the constants of this robot
        are used; see `uses`.
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
    leaders: tuple[int, ...] = ()
    links: Mapping[str, tuple[int, Floats]] = field(default_factory=dict)
    module: Any = None
    _floats: ClassVar[bool] = False
    """Whether the base of the robots of this class floats."""
    _computed: Computed = field(init=False, repr=False)
    """The kernels of `module` that were generated from the same constants, and those of `generated.robots`."""
    _attempts: Attempts = field(init=False, repr=False)
    """Fast calls of these kernels, which methods try first."""

    def __post_init__(self) -> None:
        if not self.kinds:
            raise JointCountError(f"{self.name}: no joint; expected at least one")
        self._fill_defaults()
        self._check_constants()
        self._check_kinds()
        self._check_limits_and_bodies()
        if any(not -1 <= parent < j for j, parent in enumerate(self.parents)) or len(self.parents) != len(self.kinds):
            raise DescriptionError(
                f"{self.name}: parents {self.parents}; expected an earlier joint or -1 for each joint"
            )
        for name in ("axes", "home", "tool", "bodies", "armature", "free_fall", "limits", "coupling"):
            kept = np.array(getattr(self, name), float)
            kept.flags.writeable = False
            self._fill(name, kept)
        self._fill("_computed", Computed(self, folded.kernels_of(self)))
        self._fill("_attempts", self._computed.attempts)

    def _fill(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    def _fill_defaults(self) -> None:
        count, n = len(self.kinds), self.n_joints
        if not self.parents:
            self._fill("parents", tuple(range(-1, count - 1)))
        if not self.joint_names:
            self._fill("joint_names", tuple(f"joint {k}" for k in range(count)))
        if self.tip < 0:
            self._fill("tip", count - 1)
        if not self.tool.size:
            self._fill("tool", self.home[self.tip].copy())
        if not self.armature.size:
            self._fill("armature", np.zeros(count))
        if not self.limits.size:
            self._fill("limits", np.tile([-np.inf, np.inf, np.inf, np.inf], (n, 1)))
        if self.limits.shape != (n, 4):
            raise JointCountError(f"{self.name}: limits of shape {self.limits.shape}; expected ({n}, 4)")
        self._fill("leaders", leaders_of(self))
        self._fill("links", MappingProxyType(dict(self.links)))

    def _check_constants(self) -> None:
        count = len(self.kinds)
        for name, shape in (("axes", (count, 6)), ("home", (count, 8)), ("tool", (8,)), ("armature", (count,))):
            found = getattr(self, name)
            if found.shape != shape:
                raise JointCountError(f"{self.name}: {name} of shape {found.shape}; expected {shape}")
            if not np.isfinite(found).all():
                raise NotFiniteError(f"{self.name}: {name} has a NaN or an infinite number; expected finite numbers")

    def _check_kinds(self) -> None:
        for kind in self.kinds:
            if not isinstance(kind, Joint):
                raise UnknownJointTypeError(f"{self.name}: kind {kind!r}; expected Joint.REVOLUTE or Joint.PRISMATIC")
        if is_floating(self) != self._floats:
            wanted = "a base that floats" if self._floats else "one that does not float, or a FloatingRobot"
            raise FloatingBaseError(f"{self.name}: joint 0 is {self.kinds[0].value}; expected {wanted}")
        if Joint.FLOATING in self.kinds[1:] or (self._floats and -1 in self.parents[1:]):
            raise FloatingBaseError(f"{self.name}: a floating base is joint 0, which carries all others")

    def _check_limits_and_bodies(self) -> None:
        if not np.isfinite(self.bodies).all() or np.isnan(self.limits).any() or not np.isfinite(self.coupling).all():
            raise NotFiniteError(f"{self.name}: bodies, limits or coupling with a NaN; expected numbers")
        for joint, (low, high, speed, effort) in enumerate(self.limits):
            limits = f"{self.name}: limits of joint {joint}:"
            if low > high:
                raise DescriptionError(f"{limits} {low} to {high}; expected the lower first")
            if speed < 0 or effort < 0:
                raise DescriptionError(f"{limits} speed {speed}, effort {effort}; expected no negative number")
        count = len(self.kinds)
        if self.bodies.size and self.bodies.shape != (count, 10):
            raise JointCountError(f"{self.name}: bodies of shape {self.bodies.shape}; expected ({count}, 10)")

    def __repr__(self) -> str:
        """Return what the robot is in one screen: its joints with their limits, and what is known of it."""
        own = len(self.kinds)
        masses = "unknown masses" if not self.bodies.size else f"{self.bodies[:, 0].sum():.4g} kg"
        ends = self.joint_names[self.tip]
        head = f"{type(self).__name__} {self.name!r}: {own} joints, {self.n_joints} variables, {masses}"
        variables, ratios, offsets = followed(self)
        rows = []
        for joint in range(min(own, _SHOWN)):
            low, high = self.limits[variables[joint], :2]
            leader = self.leaders[variables[joint]]
            free = f"{low:8.4g} to {high:<8.4g}"
            bound = f"{ratios[joint]:.4g} times {self.joint_names[leader]}, plus {offsets[joint]:.4g}"
            parent = self.parents[joint]
            on = "" if parent == joint - 1 else f", on {'the base' if parent < 0 else self.joint_names[parent]}"
            what = free if leader == joint else bound
            rows.append(f"  {self.joint_names[joint]:20} {self.kinds[joint].value:10} {what}{on}".rstrip())
        more = [f"  ... and {own - _SHOWN} more"] if own > _SHOWN else []
        return "\n".join([f"{head}; the end effector is carried by {ends}", *rows, *more])

    def __reduce__(self) -> tuple[Any, ...]:
        kept = {entry.name: getattr(self, entry.name) for entry in fields(self) if entry.init}
        module = None if self.module is None else self.module.__name__
        return _unpickled, (type(self), {**kept, "links": dict(self.links), "module": module})

    @property
    def n_joints(self) -> int:
        """The number of rates and of forces. It is the number of variables, too, except for floating bases."""
        if self.coupling.size:
            return int(self.coupling.shape[1]) - 1
        return len(self.kinds) + (FREEDOMS - 1 if is_floating(self) else 0)

    @property
    def n_positions(self) -> int:
        """The length of `q`. It equals `n_joints` except for floating bases."""
        return self.n_joints + (MOTOR - FREEDOMS if is_floating(self) else 0)

    @property
    def uses(self) -> Mapping[str, str]:
        """For each method, the module whose kernels it calls: the robot's own, or the generic ``generated.robots``.

        Kernels of the robot's module are not used if they were generated from different constants. For example, a robot
        whose tool was changed uses the generic `forward`, but its own `mass_matrix`.
        """
        return MappingProxyType(folded.uses(self._computed.own, self.module))

    @property
    def path(self) -> tuple[int, ...]:
        """The joints from the base to the end effector."""
        return path_to(self, self.tip)

    def _evaluate(self, name: str, *values: ArrayLike) -> Reals:
        """Return the result of the kernel of a method whose fast call has rejected the arguments."""
        last = "tau" if name == "forward_dynamics" else "qdd"
        found: Reals = self._run(getattr(self._computed, name), ("q", "qd", last)[: len(values)], *values)
        return found

    def _run(self, kernel: Method, names: Sequence[str], *values: ArrayLike) -> Any:
        """Check and broadcast variables, rates and forces, and call a kernel. float32 gives float32."""
        shape, rows = self._together(*zip(values, names, strict=True))
        arrays = [row.reshape(*shape, row.shape[-1]) for row in rows]
        found = kernel(*(array.astype(_FLOAT64, copy=False) for array in arrays))
        if arrays[0].dtype is _FLOAT64:
            return found
        if isinstance(found, tuple):
            return tuple(np.asarray(each, arrays[0].dtype)[()] for each in found)
        return np.asarray(found, arrays[0].dtype)[()]

    def _attempted(self, kernel: Method, q: ArrayLike) -> Reals:
        """Call a kernel of variables: fast if the extension accepts them, otherwise after checks."""
        found: Reals | None = kernel.attempt(q)
        return self._run(kernel, ("q",), q) if found is None else found

    def _variables(self, value: ArrayLike, name: str) -> tuple[Reals, Reals]:
        """Return joint variables or their rates as an array, and as rows."""
        length, meaning = self._expected(name)
        if type(value) is np.ndarray and value.dtype in _FLOATS and value.shape[-1:] == (length,):
            return value, value if value.ndim == 2 else value.reshape(-1, length)
        array = real_array(value, f"{self.name}: {name}", (length,), meaning)
        return array, array.reshape(-1, length)

    def _expected(self, name: str) -> tuple[int, str]:
        """Return the length of an argument, and what it consists of."""
        if not is_floating(self):
            return self.n_joints, f"{self.n_joints} joint variables"
        count = self.n_joints - FREEDOMS
        if name in ("q", "q0", "q1"):
            return self.n_positions, f"a motor and {count} joint variables"
        return self.n_joints, f"{FREEDOMS} of the base, {count} of joints"

    def _together(self, *values: tuple[ArrayLike, str]) -> tuple[tuple[int, ...], list[Reals]]:
        """Return the broadcast leading axes of several arguments, and each argument as rows."""
        arrays = [self._variables(value, name)[0] for value, name in values]
        lead, dtype = arrays[0].shape[:-1], arrays[0].dtype
        if not all(a.shape[:-1] == lead and a.dtype == dtype for a in arrays):
            dtype = np.result_type(*arrays)
            try:
                lead = np.broadcast_shapes(*(a.shape[:-1] for a in arrays))
            except ValueError:
                shapes = ", ".join(f"{name} {a.shape}" for (_, name), a in zip(values, arrays, strict=True))
                raise ValueError(f"{self.name}: {shapes}; expected leading axes that broadcast") from None
            arrays = [np.broadcast_to(a, (*lead, a.shape[-1])).astype(dtype, copy=False) for a in arrays]
        return lead, [a.reshape(-1, a.shape[-1]) for a in arrays]

    def _reduced(self, columns: Reals) -> Reals:
        """Convert derivatives with respect to all joints (..., N) to those with respect to the variables (..., n)."""
        if not self.coupling.size:
            return columns
        return columns @ self.coupling[:, :-1].astype(columns.dtype)  # type: ignore[no-any-return]


def _unpickled(cls: type[Model], kept: dict[str, Any]) -> Model:
    module = kept["module"]
    return cls(**{**kept, "module": None if module is None else import_module(module)})
