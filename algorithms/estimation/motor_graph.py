"""Graphs of motors: what was measured of poses, velocities and biases. One class in one file."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from generated import pga2, pga3

from ..arguments import Reals, as_given, finite, real_array
from ..elements import LINE, MOTOR, PLANE, POINT, Layouts, plain
from ..precision import SINGLE
from .inertial import InertialSum
from .motor_factors import (
    BIASES,
    FLAT_MOTION,
    INERTIAL,
    LINES,
    MOTION,
    PLACE,
    PLANES,
    POINTS,
    PRIOR,
    SPEED,
    WALK,
    Factors,
    Kind,
    Summary,
)


class MotorGraph:
    """Measurements of moving frames: the factors of `smooth_motors`.

    States are numbered from 0. Each has a pose, a unit motor of `generated.pga3` from its frame to that of the map, and
    with inertial measurements a velocity in the frame of the map and biases. Errors of poses are perturbations in their
    own frame: a rotation vector and a translation, in this order.

    Methods add factors, one or several: `states` are numbers or arrays of them, (m,), and the other arguments have a
    row for each. A covariance is a matrix, its diagonal, or a matrix for each factor. Factors that are `robust` may be
    wrong. Their influence is bounded (Geman and McClure's function): it is a quarter at the gate, which right ones
    exceed with a probability of 0.001.

    Raises
    ------
    TypeError, ValueError
        If arguments have other shapes or types, are not finite, if motors are not unit motors, or covariances not
        positive definite.

    Examples
    --------
    >>> graph = MotorGraph()
    >>> graph.add_priors(0, np.eye(8)[0], np.full(6, 1e-4))
    >>> graph.add_motions(0, 1, pga3.motor_from_rotation_vector_translation([0, 0, 0.1], [1.0, 0, 0]), np.full(6, 1e-4))
    >>> graph
    MotorGraph of 2 states: 1 prior, 1 motion
    """

    def __init__(self) -> None:
        self.factors: list[Factors | Summary] = []

    def __repr__(self) -> str:
        counts: dict[str, int] = {}
        for each in self.factors:
            name = each.kind.name if isinstance(each, Factors) else "summary"
            counts[name] = counts.get(name, 0) + len(each.states)
        named = ", ".join(f"{count} {name}" for name, count in counts.items()) or "no factors"
        return f"MotorGraph of {self.n_states} states: {named}"

    @property
    def n_states(self) -> int:
        """The number of states: one more than the largest number in factors."""
        return 1 + max((int(each.states.max(initial=-1)) for each in self.factors), default=-1)

    def add_priors(
        self, states: ArrayLike, motors: ArrayLike, covariance: ArrayLike, *, robust: ArrayLike = False
    ) -> None:
        """Add poses that are known.

        Parameters
        ----------
        states : array_like, (m,) of int
        motors : array_like, (m, 8)
        covariance : array_like, (6,), (6, 6) or (m, 6, 6)
            Of perturbations of the poses.
        robust : array_like, (m,) of bool, optional

        Raises
        ------
        TypeError, ValueError
            As for all methods, see the class.
        """
        self._append(_made(PRIOR, (states,), [(checked_motors(motors, "motors"), 1)], covariance, robust))

    def add_motions(
        self,
        first: ArrayLike,
        second: ArrayLike,
        motions: ArrayLike,
        covariance: ArrayLike,
        *,
        robust: ArrayLike = False,
    ) -> None:
        """Add measured motions, such as odometry or closed loops: the second pose in the frame of the first.

        Parameters
        ----------
        first, second : array_like, (m,) of int
        motions : array_like, (m, 8)
        covariance : array_like, (6,), (6, 6) or (m, 6, 6)
            Of perturbations of the motions in the frame of the second pose.
        robust : array_like, (m,) of bool, optional

        Raises
        ------
        TypeError, ValueError
            As for all methods, see the class.
        """
        self._append(_made(MOTION, (first, second), [(checked_motors(motions, "motions"), 1)], covariance, robust))

    def add_flat_motions(
        self,
        first: ArrayLike,
        second: ArrayLike,
        motions: ArrayLike,
        covariance: ArrayLike,
        *,
        mount: ArrayLike | None = None,
        robust: ArrayLike = False,
    ) -> None:
        """Add motions measured in the x-y plane of a sensor, such as by wheels or by matched scans.

        They say nothing of height and tilt: of a robot on a floor, planes that are seen determine these.

        Parameters
        ----------
        first, second : array_like, (m,) of int
        motions : array_like, (m, 4)
            Unit motors of `generated.pga2`: the second pose of the sensor in the frame of its first one.
        covariance : array_like, (3,), (3, 3) or (m, 3, 3)
            Of the angle, x and y of perturbations of the motions in the frame of the second pose of the sensor.
        mount : array_like, (8,), optional
            Motor from the frame of the sensor to those of poses, by default the identity.
        robust : array_like, (m,) of bool, optional

        Raises
        ------
        TypeError, ValueError
            As for all methods, see the class.

        See Also
        --------
        algorithms.mapping.add_scans
        """
        flat = _of_unit(
            finite(real_array(motions, "motions", (4,), "a motor"), "motions"), "motions", pga2.normalize_motor
        )
        angle, shift = (np.asarray(each) for each in pga2.motor_to_angle_translation(flat))
        turned, moved = np.zeros((*angle.shape, 3)), np.zeros((*angle.shape, 3))
        turned[..., 2], moved[..., :2] = angle, shift
        base = checked_motors(np.eye(8)[0] if mount is None else mount, "mount")
        if base.ndim != 1:
            raise ValueError(f"mount: shape {base.shape}; expected (8,), one motor")
        there = pga3.motor_product(base, pga3.motor_from_rotation_vector_translation(turned, moved))
        made = _made(
            FLAT_MOTION, (first, second), [(np.asarray(pga3.motor_product(there, pga3.motor_inverse(base))), 1)],
            covariance, robust,
        )  # fmt: skip
        # Logarithms of misfits in the frame of the pose are moved to that of the sensor.
        self._append(replace(made, roots=made.roots @ _twists_moved(np.asarray(pga3.motor_inverse(base)))[2:5]))

    def add_points(
        self, states: ArrayLike, model: ArrayLike, seen: ArrayLike, covariance: ArrayLike, *, robust: ArrayLike = False
    ) -> None:
        """Add points of the map that were seen in the frames of poses.

        Parameters
        ----------
        states : array_like, (m,) of int
        model, seen : array_like, (m, 3)
            In the map, and in the frames of the poses.
        covariance : array_like, (3,), (3, 3) or (m, 3, 3)
        robust : array_like, (m,) of bool, optional

        Raises
        ------
        TypeError, ValueError
            As for all methods, see the class.
        """
        self._add_seen(POINTS, POINT, 3, states, model, seen, covariance, robust)

    def add_lines(
        self, states: ArrayLike, model: ArrayLike, seen: ArrayLike, covariance: ArrayLike, *, robust: ArrayLike = False
    ) -> None:
        """Add directed lines of the map that were seen in the frames of poses.

        Parameters
        ----------
        states : array_like, (m,) of int
        model, seen : array_like, (m, 6)
            In the map, and in the frames of the poses, both of any norm.
        covariance : array_like, (4,), (4, 4) or (m, 4, 4)
            Of the direction, in radians, and of the position at the point of the seen line that is closest to the
            origin, both along two directions across the line.
        robust : array_like, (m,) of bool, optional

        Raises
        ------
        TypeError, ValueError
            As for all methods, see the class.
        """
        self._add_seen(LINES, LINE, 6, states, model, seen, covariance, robust)

    def add_planes(
        self, states: ArrayLike, model: ArrayLike, seen: ArrayLike, covariance: ArrayLike, *, robust: ArrayLike = False
    ) -> None:
        """Add planes of the map that were seen in the frames of poses.

        Parameters
        ----------
        states : array_like, (m,) of int
        model, seen : array_like, (m, 4)
            In the map, and in the frames of the poses, with oriented normals.
        covariance : array_like, (3,), (3, 3) or (m, 3, 3)
            Of the normal, in radians along two directions across it, and of the distance.
        robust : array_like, (m,) of bool, optional

        Raises
        ------
        TypeError, ValueError
            As for all methods, see the class.
        """
        self._add_seen(PLANES, PLANE, 4, states, model, seen, covariance, robust)

    def add_positions(
        self,
        states: ArrayLike,
        places: ArrayLike,
        covariance: ArrayLike,
        *,
        lever: ArrayLike = (0.0, 0.0, 0.0),
        robust: ArrayLike = False,
    ) -> None:
        """Add places in the map, such as from satellites, of a point of the frames of poses.

        Parameters
        ----------
        states : array_like, (m,) of int
        places : array_like, (m, 3)
        covariance : array_like, (3,), (3, 3) or (m, 3, 3)
        lever : array_like, (3,) or (m, 3), optional
            The point in the frames of the poses, by default their origin.
        robust : array_like, (m,) of bool, optional

        Raises
        ------
        TypeError, ValueError
            As for all methods, see the class.
        """
        at, arm = _rows(plain(places, "places", POINT), "places", 3), _rows(plain(lever, "lever", POINT), "lever", 3)
        self._append(_made(PLACE, (states,), [(arm, 1), (at, 1)], covariance, robust))

    def add_velocities(self, states: ArrayLike, velocities: ArrayLike, covariance: ArrayLike) -> None:
        """Add velocities that are known.

        Parameters
        ----------
        states : array_like, (m,) of int
        velocities : array_like, (m, 3)
            In the map.
        covariance : array_like, (3,), (3, 3) or (m, 3, 3)

        Raises
        ------
        TypeError, ValueError
            As for all methods, see the class.
        """
        self._append(_made(SPEED, (states,), [(_rows(velocities, "velocities", 3), 1)], covariance, False))

    def add_biases(self, states: ArrayLike, biases: ArrayLike, covariance: ArrayLike) -> None:
        """Add biases that are known.

        Parameters
        ----------
        states : array_like, (m,) of int
        biases : array_like, (m, 6)
            Of angular rates and of specific forces.
        covariance : array_like, (6,), (6, 6) or (m, 6, 6)

        Raises
        ------
        TypeError, ValueError
            As for all methods, see the class.
        """
        self._append(_made(BIASES, (states,), [(_rows(biases, "biases", 6), 1)], covariance, False))

    def add_inertial(
        self,
        first: ArrayLike,
        second: ArrayLike,
        sums: InertialSum | Sequence[InertialSum],
        walk: ArrayLike,
        *,
        gravity: ArrayLike = (0.0, 0.0, -9.81),
    ) -> None:
        """Add inertial measurements between states, and the random walk of the biases meanwhile.

        Parameters
        ----------
        first, second : array_like, (m,) of int
        sums : InertialSum, or sequence of m
            As from `preintegrate`.
        walk : array_like, (6,), (6, 6) or (m, 6, 6)
            The covariance by which biases change in a second.
        gravity : array_like, (3,), optional
            In the frame of the map.

        Raises
        ------
        TypeError, ValueError
            As for all methods, see the class.
        """
        every = list(sums) if isinstance(sums, Iterable) else [sums]
        if not every:
            raise ValueError("sums: none; expected one for each pair of states")
        for each in every:
            if not isinstance(each, InertialSum):
                raise TypeError(f"sums: {type(each).__name__}; expected InertialSum, as from preintegrate")
        data = [
            (np.array([getattr(each, name) for each in every]), axes)
            for name, axes in (("motion", 1), ("place", 1), ("duration", 0), ("by_bias", 2), ("bias", 1))
        ]
        spread = np.array([each.covariance for each in every])
        walks = _covariances(walk, 6, "walk")
        if walks.ndim == 3 and len(walks) not in (1, len(every)):
            raise ValueError(f"walk: {len(walks)} covariances; expected one, or one for each of {len(every)} sums")
        walks = walks * data[2][0][:, None, None]
        # Both are made before one is added, so that a refused call changes nothing.
        self._append(
            _made(INERTIAL, (first, second), [*data, (_rows(gravity, "gravity", 3), 1)], spread, False),
            _made(WALK, (first, second), [(np.zeros(6), 1)], walks, False),
        )

    def _add_seen(
        self, kind: Kind, layouts: Layouts, length: int, states: ArrayLike, model: ArrayLike, seen: ArrayLike,
        covariance: ArrayLike, robust: ArrayLike,
    ) -> None:  # fmt: skip
        pair = []
        for value, name in ((model, "model"), (seen, "seen")):
            rows = _rows(plain(value, name, layouts), name, length)
            # Of lines and planes, the first three coefficients are those of the direction or of the normal.
            if kind is not POINTS and not (np.abs(rows[..., :3]).sum(-1) > 0).all():
                raise ValueError(f"{name}: a direction is 0; expected {kind.name} that are not at infinity")
            pair.append((rows, 1))
        self._append(_made(kind, (states,), pair, covariance, robust))

    def _append(self, *factors: Factors) -> None:
        """Add factors to the graph, all or none."""
        self.factors += [each for each in factors if len(each.robust)]


def _made(
    kind: Kind, states: Sequence[ArrayLike], data: Sequence[tuple[Reals, int]], covariance: ArrayLike, robust: ArrayLike
) -> Factors:
    """Return factors from data with their numbers of axes, after one for factors or none."""
    numbers = [_numbers(each) for each in states]
    spread = _covariances(covariance, kind.n_numbers, "covariance")
    flags = as_given(robust, "robust")
    if flags.dtype != np.bool_:
        raise TypeError(f"robust: dtype {flags.dtype}; expected bool")
    leading = [each.shape for each in numbers] + [value.shape[: value.ndim - axes] for value, axes in data]
    leading += [flags.shape, spread.shape[:-2]]
    try:
        shape = np.broadcast_shapes(*leading)
    except ValueError:
        shape = (0, 0)
    if len(shape) > 1:
        raise ValueError(f"{kind.name}: {_lengths(leading)} rows; expected one number for states and what was seen")
    m = shape[0] if shape else 1
    pairs = np.stack([np.broadcast_to(each, (m,)) for each in numbers], -1)
    if len(numbers) == 2 and (pairs[:, 0] == pairs[:, 1]).any():
        raise ValueError(f"{kind.name}: a factor of state {pairs[pairs[:, 0] == pairs[:, 1]][0, 0]} with itself")
    every = tuple(
        np.ascontiguousarray(np.broadcast_to(value, (m, *value.shape[value.ndim - axes :]))) for value, axes in data
    )
    return Factors(kind, pairs, every, _roots(spread), np.broadcast_to(flags, (m,)))


def _rows(value: ArrayLike, name: str, length: int) -> Reals:
    return finite(real_array(value, name, (length,), "vectors" if length == 3 else "").astype(float), name)


def checked_motors(value: ArrayLike, name: str) -> Reals:
    """Return unit motors (..., 8).

    Raises
    ------
    TypeError, ValueError
        If they have another shape or type, are not finite, or not unit motors.
    """
    return _of_unit(_rows(plain(value, name, MOTOR), name, 8), name, pga3.normalize_motor)


def _of_unit(motors: Reals, name: str, normalize: Callable[[Reals], Any]) -> Reals:
    size = np.abs(motors).max(-1, initial=1.0, keepdims=True)
    if not (np.abs(normalize(motors) - motors) <= SINGLE * size).all():
        raise ValueError(f"{name}: not unit motors; expected these, see normalize_motor")
    return motors


def _twists_moved(motor: Reals) -> Reals:
    """Return the matrix (6, 6) that moves twists, rotation and translation, by a motor."""
    # The coefficients of e12, e13 and e23 are the rotation about z, the opposite of that about y, and that about x.
    order, signs = [2, 1, 0, 3, 4, 5], [1, -1, 1, 1, 1, 1]
    return np.asarray(pga3.motor_to_adjoint(motor)[np.ix_(order, order)] * np.outer(signs, signs))


def _numbers(value: ArrayLike) -> Reals:
    numbers = as_given(value, "states")
    if (numbers.dtype.kind not in "iu" and numbers.size) or numbers.ndim > 1:
        raise TypeError(f"states: shape {numbers.shape}, dtype {numbers.dtype}; expected whole numbers, one or (m,)")
    if (numbers < 0).any():
        raise ValueError(f"states: {numbers.min()}; expected numbers from 0 on")
    return numbers.astype(np.int64)


def _covariances(value: ArrayLike, n: int, name: str) -> Reals:
    """Return a covariance (n, n) or several (m, n, n) from these or a diagonal (n,)."""
    given = real_array(value, name)
    spread = np.diag(given) if given.shape == (n,) else given
    if spread.ndim not in (2, 3) or spread.shape[-2:] != (n, n):
        raise ValueError(f"{name}: shape {given.shape}; expected ({n},), ({n}, {n}) or (m, {n}, {n})")
    return finite(spread.astype(float), name)


def _roots(spread: Reals) -> Reals:
    """Return inverse Cholesky factors of covariances.

    Raises
    ------
    ValueError
        If one is not symmetric and positive definite.
    """
    size = np.abs(spread).max((-1, -2), keepdims=True)
    try:
        if (np.abs(spread - np.swapaxes(spread, -1, -2)) > SINGLE * size).any():
            raise np.linalg.LinAlgError
        root = np.linalg.cholesky(spread)
    except np.linalg.LinAlgError:
        raise ValueError("covariance: not symmetric and positive definite; expected one that is") from None
    return np.asarray(np.linalg.inv(root))


def _lengths(shapes: Sequence[tuple[int, ...]]) -> str:
    return ", ".join(dict.fromkeys(" x ".join(map(str, shape)) for shape in shapes if shape))
