"""Tracking of points, lines and planes by a camera on a robot: exact linearisation of the image by feedback."""

from __future__ import annotations

from dataclasses import InitVar, dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from generated import tracking as kernels
from generated.gac_runtime.module import Kernel

from ..arguments import Reals, real_array
from ..evidence import Status
from ..kinematics import Robot
from .image_jacobians import Chain, chain_of

_SIZES = {"point": 2, "line": 2, "plane": 3}
_LAYOUTS = {"point": 3, "line": 6, "plane": 4}
_NO_TWIST, _PAIR, _TRIPLE = np.zeros(6), np.zeros(2), np.zeros(3)
"""Arguments that are left out: a target at rest, and errors of zero."""
for _default in (_NO_TWIST, _PAIR, _TRIPLE):
    _default.flags.writeable = False


class TrackingStatus(Status):
    """Whether a step of control has the designed dynamics of the error."""

    OK = 0
    SATURATED = 1
    """All rates, or accelerations, are scaled down by one factor to their limits: the error decays more slowly along
    the same direction."""
    SINGULAR = 2
    """The smallest singular value of the image Jacobian is below the threshold: the solution is damped."""
    NOT_VISIBLE = 3
    """The element has no image, or is behind the camera: the joints are not moved."""
    NOT_FINITE = 4
    """A number is not finite: the joints are not moved."""


class VelocityStep(NamedTuple):
    """A step of velocity control."""

    rates: Reals
    """(..., n) Rates of the joints, finite in any case."""
    error: Reals
    """(..., k) The image minus the goal; angles in (-pi, pi]."""
    least_singular_value: Reals
    """(...) The smallest singular value of the image Jacobian, weighted by the mobility of the joints."""
    status: Reals | int
    """(...) A `TrackingStatus` each."""


class ForceStep(NamedTuple):
    """A step of control by joint forces, or torques for revolute joints."""

    forces: Reals
    """(..., n) Joint forces: those of the accelerations. They compensate gravity if the status is not OK."""
    accelerations: Reals
    """(..., n) Accelerations of the joints, finite in any case."""
    error: Reals
    """(..., k) The image minus the goal; angles in (-pi, pi]."""
    error_rate: Reals
    """(..., k)"""
    least_singular_value: Reals
    """(...) The smallest singular value of the image Jacobian, weighted by the mobility of the joints."""
    status: Reals | int
    """(...) A `TrackingStatus` each."""


@dataclass(frozen=True, slots=True, eq=False)
class Tracker:
    """A controller that keeps the image of an element at a goal.

    The image y of an element is a function of the joints with Jacobian J. The rates ``J^+ (goal' - gain e - y_0')``,
    where ``y_0'`` is due to the motion of the element, make the error obey ``e' = -gain e`` exactly: input-output
    linearisation by feedback. For control by forces, accelerations are chosen so that ``e'' + damping_gain e' + gain_2
    e = 0``, and `Robot.inverse_dynamics` gives their forces. The goal is reached exactly if the Jacobian has full rank,
    and the rates have the least norm if there are more joints than coordinates.

    Parameters
    ----------
    robot : Robot
    camera : array_like, (8,), optional
        The motor from the frame of the camera to that of the end effector. By default they coincide.
    gain : float, optional
        The rate at which errors decay, 1/s. For control by forces it is the double pole: ``gain_2 = gain**2`` and
        ``damping_gain = 2 gain``.
    mirror : float, optional
        The parameter of the mirror of the camera, for points; see `image_of_point`.
    threshold, damping : float, optional
        Below this smallest singular value the solution is damped; the damping at a singularity. Both in units of the
        Jacobian. The default threshold is small enough for pan-tilt heads that do not look along the first axis.
    speeds : array_like, (n,), optional
        Largest rates. By default those of the robot's limits.
    accelerations : array_like, (n,), optional
        Largest accelerations. By default unlimited.
    mobility : array_like, (n,), optional
        Weights of the joints: a joint with a larger weight moves more, with weight 0 it does not move. By default 1.
    """

    robot: Robot
    camera: InitVar[ArrayLike | None] = None
    gain: float = 2.0
    mirror: float = 0.0
    threshold: float = 0.02
    damping: float = 0.1
    speeds: InitVar[ArrayLike | None] = None
    accelerations: InitVar[ArrayLike | None] = None
    mobility: InitVar[ArrayLike | None] = None
    chain: Chain = field(init=False, repr=False)
    _is_whole: bool = field(init=False, repr=False)
    _kernels: dict[str, Any] = field(init=False, repr=False)

    def __post_init__(
        self,
        camera: ArrayLike | None,
        speeds: ArrayLike | None,
        accelerations: ArrayLike | None,
        mobility: ArrayLike | None,
    ) -> None:
        for name in ("gain", "mirror", "threshold", "damping"):
            if not 0 <= getattr(self, name) < np.inf:
                raise ValueError(f"{name} {getattr(self, name)}; expected a finite number that is not negative")
        chain = chain_of(self.robot, camera)
        n = self.robot.n_joints

        def own(value: ArrayLike | None, name: str, default: Reals) -> Reals:
            given = default if value is None else real_array(value, name, (n,), "a number for each joint")
            if given.shape != (n,) or not (given >= 0).all():
                raise ValueError(f"{name} {given}; expected {n} numbers that are not negative")
            # Infinite limits would give the product of 0 and infinity.
            return np.minimum(chain.own(given.astype(np.float64)), 1e300)

        common = {
            **chain.tables,
            "weights": own(mobility, "mobility", np.ones(n)),
            "threshold": self.threshold,
            "damping": self.damping,
        }
        rates = {**common, "limits": own(speeds, "speeds", self.robot.limits[:, 2])}
        bends = {**common, "limits": own(accelerations, "accelerations", np.full(n, np.inf))}
        bound = {}
        for name, size in _SIZES.items():
            lengths, mirror = {"n": len(chain.path)}, {"mirror": self.mirror} if name == "point" else {}
            gain = {"gain": np.full(size, self.gain)}
            bound[f"rates {name}"] = getattr(kernels, f"rates_for_{name}").bind(lengths, **rates, **gain, **mirror)
            gains = {"gain": np.full(size, self.gain**2), "damping_gain": np.full(size, 2 * self.gain)}
            bound[f"bends {name}"] = getattr(kernels, f"accelerations_for_{name}").bind(
                lengths, **bends, **gains, **mirror
            )
        object.__setattr__(self, "chain", chain)
        object.__setattr__(self, "_is_whole", chain.is_whole)
        object.__setattr__(self, "_kernels", bound)

    def rates_for_point(
        self,
        q: ArrayLike,
        point: ArrayLike,
        goal: ArrayLike = _PAIR,
        goal_rate: ArrayLike = _PAIR,
        twist: ArrayLike = _NO_TWIST,
    ) -> VelocityStep:
        """Return rates of the joints that move the image of a point to a goal.

        Parameters
        ----------
        q : array_like, (..., n)
            Joint variables.
        point : array_like, (..., 3)
            In the base frame.
        goal, goal_rate : array_like, (..., 2), optional
            The desired image, by default the optical axis, and its rate of change.
        twist : array_like, (..., 6), optional
            The twist of the point, a line of `generated.pga3`: (0, 0, 0, vx, vy, vz) for a velocity.

        Returns
        -------
        VelocityStep

        Raises
        ------
        TypeError, ValueError
            If an argument has a different shape or type.
        """
        return self._rates("point", q, point, twist, goal, goal_rate)

    def rates_for_line(
        self,
        q: ArrayLike,
        line: ArrayLike,
        goal: ArrayLike,
        goal_rate: ArrayLike = _PAIR,
        twist: ArrayLike = _NO_TWIST,
    ) -> VelocityStep:
        """Return rates of the joints that move the image of a line (..., 6) to a goal, (theta, rho).

        The other arguments are those of `rates_for_point`, the coordinates those of `image_of_line`.
        """
        return self._rates("line", q, line, twist, goal, goal_rate)

    def rates_for_plane(
        self,
        q: ArrayLike,
        plane: ArrayLike,
        goal: ArrayLike,
        goal_rate: ArrayLike = _TRIPLE,
        twist: ArrayLike = _NO_TWIST,
    ) -> VelocityStep:
        """Return rates of the joints that move the image of a plane (..., 4) to a goal, (a, b, c).

        The other arguments are those of `rates_for_point`, the coordinates those of `image_of_plane`.
        """
        return self._rates("plane", q, plane, twist, goal, goal_rate)

    def forces_for_point(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        point: ArrayLike,
        goal: ArrayLike = _PAIR,
        goal_rate: ArrayLike = _PAIR,
        goal_acceleration: ArrayLike = _PAIR,
        twist: ArrayLike = _NO_TWIST,
    ) -> ForceStep:
        """Return joint forces that move the image of a point to a goal.

        Parameters
        ----------
        q, qd : array_like, (..., n)
            Joint variables and their rates.
        point, goal, goal_rate, twist
            As in `rates_for_point`. The twist is constant.
        goal_acceleration : array_like, (..., 2), optional
            The second derivative of the goal.

        Returns
        -------
        ForceStep

        Raises
        ------
        MissingInertiaError
            If the robot has no masses.
        TypeError, ValueError
            If an argument has a different shape or type.
        """
        return self._forces("point", q, qd, point, twist, goal, goal_rate, goal_acceleration)

    def forces_for_line(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        line: ArrayLike,
        goal: ArrayLike,
        goal_rate: ArrayLike = _PAIR,
        goal_acceleration: ArrayLike = _PAIR,
        twist: ArrayLike = _NO_TWIST,
    ) -> ForceStep:
        """Return joint forces that move the image of a line (..., 6) to a goal, as in `forces_for_point`."""
        return self._forces("line", q, qd, line, twist, goal, goal_rate, goal_acceleration)

    def forces_for_plane(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        plane: ArrayLike,
        goal: ArrayLike,
        goal_rate: ArrayLike = _TRIPLE,
        goal_acceleration: ArrayLike = _TRIPLE,
        twist: ArrayLike = _NO_TWIST,
    ) -> ForceStep:
        """Return joint forces that move the image of a plane (..., 4) to a goal, as in `forces_for_point`."""
        return self._forces("plane", q, qd, plane, twist, goal, goal_rate, goal_acceleration)

    def kernel(self, element: str, forces: bool = False) -> Kernel:
        """Return the bound kernel of a step, for loops in which the checks of the other methods take too long.

        Parameters
        ----------
        element : {"point", "line", "plane"}
        forces : bool, optional
            Whether the kernel computes accelerations instead of rates.

        Returns
        -------
        callable
            Function of q, the element, its twist, goal and goal_rate, all float64 arrays, that returns rates, error,
            smallest singular value and status; see `generated.tracking.rates_for_point`. With `forces`, it is a
            function of q, qd, the element, its twist, goal, and two derivatives of the goal, that returns
            accelerations, error, its rate, singular value and status.
        """
        found: Kernel = self._kernels[f"{'bends' if forces else 'rates'} {element}"]
        return found

    def _rates(
        self, name: str, q: ArrayLike, element: ArrayLike, twist: ArrayLike, goal: ArrayLike, goal_rate: ArrayLike
    ) -> VelocityStep:
        kernel = self._kernels["rates " + name]
        # One configuration in double precision needs no checks here.
        found = kernel.attempt(q, element, twist, goal, goal_rate) if self._is_whole else None
        if found is not None and type(found[3]) is np.float64:
            rates, error, least, status = found
            return VelocityStep(rates, error, least, int(status))
        given = self._given(name, (q,), element, twist, (goal, goal_rate))
        rates, error, least, status = kernel(*given)
        return VelocityStep(self.chain.of_robot(rates), error, least, np.asarray(status, np.int_)[()])

    def _forces(
        self,
        name: str,
        q: ArrayLike,
        qd: ArrayLike,
        element: ArrayLike,
        twist: ArrayLike,
        goal: ArrayLike,
        goal_rate: ArrayLike,
        goal_acceleration: ArrayLike,
    ) -> ForceStep:
        kernel = self._kernels["bends " + name]
        found = kernel.attempt(q, qd, element, twist, goal, goal_rate, goal_acceleration) if self._is_whole else None
        if found is not None and type(found[4]) is np.float64:
            bends, error, error_rate, least, status = found
            forces = self.robot.inverse_dynamics(q, qd, bends)
            return ForceStep(forces, bends, error, error_rate, least, int(status))
        given = self._given(name, (q, qd), element, twist, (goal, goal_rate, goal_acceleration))
        bends, error, error_rate, least, status = kernel(*given)
        accelerations = self.chain.of_robot(bends)
        forces = self.robot.inverse_dynamics(q, qd, accelerations)
        return ForceStep(forces, accelerations, error, error_rate, least, np.asarray(status, np.int_)[()])

    def _given(
        self,
        name: str,
        variables: tuple[ArrayLike, ...],
        element: ArrayLike,
        twist: ArrayLike,
        goals: tuple[ArrayLike, ...],
    ) -> list[Reals]:
        n, size = self.robot.n_joints, _SIZES[name]
        arrays = [
            self.chain.own(real_array(value, key, (n,), f"{n} joint variables"))
            for key, value in zip(("q", "qd"), variables, strict=False)
        ]
        arrays.append(real_array(element, name, (_LAYOUTS[name],), f"a {name}"))
        arrays.append(real_array(twist, "twist", (6,), "a twist"))
        names = ("goal", "goal_rate", "goal_acceleration")
        arrays += [real_array(value, key, (size,), "a goal") for key, value in zip(names, goals, strict=False)]
        return [array.astype(np.float64, copy=False) for array in arrays]
