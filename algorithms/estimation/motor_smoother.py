"""Smoothing of the last states of a moving frame: measurements may be late, and older states are summarised."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arguments import Reals, finite_number
from ..precision import CONVERGED
from .motor_factors import Factors, States, Summary
from .motor_graph import MotorGraph
from .motor_problem import MotorProblem, SmoothingStatus
from .smoothing import SmoothedMotors, checked_start, checked_states, smoothed_of


class MotorSmoother(MotorGraph):
    """Fixed-lag smoother of motors: it estimates the states of the last seconds together.

    `add_state` adds a state and returns its number, the methods of `MotorGraph` add factors of such numbers, and
    `update` estimates all states of the window. States that are older than the newest one by more than the lag are left
    out then; what their measurements say of the others is kept as a linear factor (marginalisation). Measurements may
    be late: factors and states are added in any order, as long as their time is within the window.

    Parameters
    ----------
    lag : float
        The length of the window in seconds.
    tolerance : float, optional
        As of `smooth_motors`.

    Raises
    ------
    ValueError
        If the lag is not positive.

    Examples
    --------
    >>> smoother = MotorSmoother(lag=2.0)
    >>> ahead = pga3.motor_from_rotation_vector_translation([0, 0, 0.0], [1.0, 0, 0])
    >>> smoother.add_priors(smoother.add_state(0.0, np.eye(8)[0]), np.eye(8)[0], np.full(6, 1e-4))
    >>> for time in (1.0, 2.0, 3.0):
    ...     state = smoother.add_state(time, smoother.motors[-1])
    ...     smoother.add_motions(state - 1, state, ahead, np.full(6, 1e-4))
    ...     status = smoother.update()
    >>> status.name, smoother.numbers.tolist()
    ('OK', [1, 2, 3])
    >>> pga3.motor_to_rotation_vector_translation(smoother.motors)[1][:, 0].round(6).tolist()
    [1.0, 2.0, 3.0]
    """

    def __init__(self, lag: float, *, tolerance: float = CONVERGED) -> None:
        super().__init__()
        self._lag = finite_number(lag, "lag")
        if not self._lag > 0:
            raise ValueError(f"lag: {lag}; expected a positive number of seconds")
        self._tolerance = finite_number(tolerance, "tolerance")
        self._n_added = 0
        self._numbers, self._times = np.zeros(0, np.int64), np.zeros(0)
        self._states = States(np.zeros((0, 8)), np.zeros((0, 3)), np.zeros((0, 6)))
        self._too_late = 0
        self._status = SmoothingStatus.EMPTY
        self._found: SmoothedMotors | None = None
        self._late = False

    @property
    def numbers(self) -> Reals:
        """(n,) The numbers of the states of the window, by time."""
        return self._numbers

    @property
    def times(self) -> Reals:
        """(n,) Their times."""
        return self._times

    @property
    def motors(self) -> Reals:
        """(n, 8) Their poses: before an update, where `add_state` was given them."""
        return self._states.motors

    @property
    def velocities(self) -> Reals:
        """(n, 3) Their velocities in the map."""
        return self._states.velocities

    @property
    def biases(self) -> Reals:
        """(n, 6) Their biases of rates and of forces."""
        return self._states.biases

    @property
    def status(self) -> SmoothingStatus:
        """The status of the last update."""
        return self._status

    @property
    def found(self) -> SmoothedMotors | None:
        """The result of the last update, of the states of the window before old ones were left out."""
        return self._found

    @property
    def n_too_late(self) -> int:
        """How many factors were not used so far because a state of theirs was left out before."""
        return self._too_late

    def add_state(
        self, time: float, motor: ArrayLike, velocity: ArrayLike | None = None, bias: ArrayLike | None = None
    ) -> int:
        """Add a state at a time in seconds, with a start, and return its number.

        Parameters
        ----------
        time : float
        motor : array_like, (8,)
            The start of the pose.
        velocity : array_like, (3,), optional
            By default 0.
        bias : array_like, (6,), optional
            By default 0.

        Returns
        -------
        int

        Raises
        ------
        TypeError, ValueError
            If arguments have other shapes or types, are not finite, or the time is before the window.
        """
        at = finite_number(time, "time")
        newest = self._times[-1] if len(self._times) else at
        if at < newest - self._lag:
            raise ValueError(f"time: {at}; expected at least {newest - self._lag}, the lag before the newest state")
        rows: Any = [None if value is None else [value] for value in (motor, velocity, bias)]
        new = checked_start(*rows)
        place = int(np.searchsorted(self._times, at, "right"))
        number, self._n_added = self._n_added, self._n_added + 1
        self._times = np.insert(self._times, place, at)
        self._numbers = np.insert(self._numbers, place, number)
        self._states = States(*(
            np.insert(old, place, one, axis=0) for old, one in zip(self._states, new, strict=True)
        ))  # fmt: skip
        return number

    def update(self, marginals: ArrayLike = ()) -> SmoothingStatus:
        """Estimate all states of the window, and leave out those that are older than the lag.

        Parameters
        ----------
        marginals : array_like, (k,) of int, optional
            Numbers of states whose covariances are computed, as ``found.covariances``.

        Returns
        -------
        SmoothingStatus
            TOO_LATE if a factor since the last update was not used, and else the status of the window.

        Raises
        ------
        ValueError
            If the marginals are not numbers of states of the window. Nothing is changed then.
        """
        row, wanted = self._rows(), checked_states(marginals, self._n_added, "marginals")
        if (row[wanted] < 0).any():
            raise ValueError(f"marginals: {wanted}; expected numbers of states of the window, {self._numbers}")
        late, self._late = self._late, False
        problem = MotorProblem(
            [each.kept(np.ones(len(each.states), bool), row) for each in self.factors],
            len(self._numbers),
            np.zeros(0, np.int64),
        )
        end = problem.descended(self._states, self._tolerance)
        self._found = smoothed_of(problem, end, self._states, row[wanted])
        self._states = States(self._found.motors, self._found.velocities, self._found.biases)
        self._status = SmoothingStatus.TOO_LATE if late else self._found.status
        gone = self._times < self._times.max(initial=-np.inf) - self._lag
        if gone.any():
            self._leave_out(problem, end, gone)
        return self._status

    def _rows(self) -> Reals:
        """Return the row of each state by its number, -1 for those that were left out."""
        row = np.full(self._n_added, -1)
        row[self._numbers] = np.arange(len(self._numbers))
        return row

    def _leave_out(self, problem: MotorProblem, end: Any, gone: Reals) -> None:
        summary, row = problem.summary(end, gone), self._rows()
        kept: list[Factors | Summary] = []
        for each in self.factors:
            inside = np.asarray(~gone[row[each.states]].any(1))
            if isinstance(each, Factors) and inside.any():
                kept.append(each.kept(inside, np.arange(self._n_added)))
            elif isinstance(each, Summary) and inside.all():
                kept.append(each)
        if summary is not None:
            kept.append(Summary(self._numbers[summary.states], summary.about, summary.rest, summary.rows))
        self.factors = kept
        self._numbers, self._times = self._numbers[~gone], self._times[~gone]
        self._states = States(*(each[~gone] for each in self._states))

    def _append(self, *factors: Factors) -> None:
        for new in factors:
            if new.states.max(initial=-1) >= self._n_added:
                raise ValueError(f"states: {new.states.max()}; expected numbers that add_state returned")
        for new in factors:
            inside = np.asarray((self._rows()[new.states] >= 0).all(1))
            self._late |= not inside.all()
            self._too_late += int((~inside).sum())
            if inside.any():
                self.factors.append(new.kept(inside, np.arange(self._n_added)))
