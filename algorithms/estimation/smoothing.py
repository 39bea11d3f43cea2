"""Smoothing of poses, velocities and biases: the states that agree best with all measurements of a graph."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, as_given, finite, finite_number, real_array
from ..evidence.descent import Descent
from ..precision import CONVERGED
from .motor_factors import States
from .motor_graph import MotorGraph, checked_motors
from .motor_problem import MotorProblem, SmoothingStatus


@dataclass(frozen=True, slots=True, eq=False)
class SmoothedMotors:
    """Result of `smooth_motors`."""

    motors: Reals
    """(n, 8) The poses."""
    velocities: Reals
    """(n, 3) In the frame of the map."""
    biases: Reals
    """(n, 6) Of angular rates and of specific forces."""
    status: SmoothingStatus
    undetermined: tuple[str, ...]
    """What the measurements leave undetermined, such as "rotation and translation of states 0 to 9"."""
    directions: Reals
    """(k, n, 15) Up to eight undetermined directions: rotations, translations, velocities and biases of states."""
    cost: float
    """Half the sum of squared residuals in standard deviations, robust ones bounded."""
    weights: Reals
    """(m,) Of factors, in the order of the graph: 1, or between 0 and 1 for robust ones."""
    squares: Reals
    """(m,) The squared residuals of factors, in standard deviations."""
    steps: int
    covariances: Reals
    """(k, 6, 6) Of perturbations of the poses `marginals`, or (k, 15, 15) with velocities and biases; infinite for
    states that are not determined."""


def smooth_motors(
    graph: MotorGraph,
    motors: ArrayLike,
    velocities: ArrayLike | None = None,
    biases: ArrayLike | None = None,
    *,
    fixed: ArrayLike = (),
    marginals: ArrayLike = (),
    tolerance: float = CONVERGED,
) -> SmoothedMotors:
    """Find the states that agree best with all measurements of a graph.

    This is the smoothing of factor graphs, as by gtsam's ``LevenbergMarquardtOptimizer``: Gauss-Newton steps on motors
    with derivatives by generated kernels and sparse factors, damped where they fail.

    Parameters
    ----------
    graph : MotorGraph
    motors : array_like, (n, 8)
        The start: unit motors from the frames of poses to that of the map, at least as many as the graph has states.
    velocities : array_like, (n, 3), optional
        The start, by default 0.
    biases : array_like, (n, 6), optional
        The start, by default 0.
    fixed : array_like, (k,) of int, optional
        States whose poses are held at the start.
    marginals : array_like, (k,) of int, optional
        States whose marginal covariances are computed. Each takes some solutions with the factors of the last step.
    tolerance : float, optional
        The relative decrease of the cost at which the steps end.

    Returns
    -------
    SmoothedMotors
        The status OK guarantees that a minimum was reached, that the measurements determine all states, that most of
        the robust factors agree, and that the residuals do not contradict the covariances (chi-square).

    Raises
    ------
    TypeError, ValueError
        If arguments have other shapes or types, are not finite, or if the graph has more states than the start.

    Notes
    -----
    The minimum is a local one near the start: chains of odometry are good starts, and robust factors are bounded less
    in the first steps, so that a large loop can pull the poses together.

    Examples
    --------
    >>> graph = MotorGraph()
    >>> graph.add_priors(0, np.eye(8)[0], np.full(6, 1e-4))
    >>> ahead = pga3.motor_from_rotation_vector_translation([0, 0, 0.0], [1.0, 0, 0])
    >>> graph.add_motions([0, 1], [1, 2], ahead, np.full(6, 1e-2))
    >>> graph.add_positions(2, [2.3, 0, 0], np.full(3, 1e-2))
    >>> found = smooth_motors(graph, np.tile(np.eye(8)[0], (3, 1)), marginals=[2])
    >>> found.status.name, pga3.motor_to_rotation_vector_translation(found.motors)[1][:, 0].round(2).tolist()
    ('OK', [0.0, 1.1, 2.2])
    """
    start = checked_start(motors, velocities, biases)
    n = len(start.motors)
    if graph.n_states > n:
        raise ValueError(f"motors: {n} states; expected at least {graph.n_states}, as the graph has")
    wanted, held = checked_states(marginals, n, "marginals"), checked_states(fixed, n, "fixed")
    return smoothed(MotorProblem(graph.factors, n, held), start, wanted, finite_number(tolerance, "tolerance"))


def smoothed(problem: MotorProblem, start: States, wanted: Reals, tolerance: float) -> SmoothedMotors:
    """Return the minimum of a problem near a start, with the covariances of some states."""
    return smoothed_of(problem, problem.descended(start, tolerance), start, wanted)


def smoothed_of(problem: MotorProblem, end: Descent, start: States, wanted: Reals) -> SmoothedMotors:
    """Return the result of a descent, with the covariances of some states."""
    free = problem.undetermined(end)
    spreads = problem.covariances(end, wanted, free.states)
    motors, velocities, biases = end.state
    motors = np.where(problem.held[:, None], start.motors, pga3.normalize_motor(motors))
    return SmoothedMotors(
        motors, velocities, biases, problem.status(end, free), free.names,
        free.directions, end.cost, end.weights, end.squares, end.steps, spreads,
    )  # fmt: skip


def checked_start(motors: ArrayLike, velocities: ArrayLike | None, biases: ArrayLike | None) -> States:
    """Return states from arguments.

    Raises
    ------
    TypeError, ValueError
        If they have other shapes or types, or are not finite.
    """
    poses = checked_motors(motors, "motors")
    if poses.ndim != 2:
        raise ValueError(f"motors: shape {poses.shape}; expected (n, 8)")
    n = len(poses)
    found = [poses]
    for value, name, length, meaning in ((velocities, "velocities", 3, "vectors"), (biases, "biases", 6, "")):
        given = np.zeros((n, length)) if value is None else real_array(value, name, (n, length), meaning)
        if given.ndim != 2:
            raise ValueError(f"{name}: shape {given.shape}; expected ({n}, {length})")
        found.append(finite(given, name).astype(float))
    return States(*found)


def checked_states(states: ArrayLike, n: int, name: str) -> Reals:
    """Return a list of numbers of n states.

    Raises
    ------
    ValueError
        If it is none.
    """
    numbers = as_given(states, name)
    numbers = numbers.astype(np.int64).reshape(-1) if numbers.size == 0 else numbers
    if numbers.ndim != 1 or numbers.dtype.kind not in "iu" or not ((numbers >= 0) & (numbers < n)).all():
        raise ValueError(f"{name}: {numbers}; expected a list of states, 0 to {n - 1}")
    return numbers
