"""Configurations in which a robot fulfils several tasks at once, within the limits of its variables."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from operator import le
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import pga3
from generated import tasks as kernels

from ..arguments import Reals, real_array
from ..evidence import Status
from .denavit_hartenberg import Joint
from .differential import Differential
from .errors import DescriptionError
from .inverse.chain import ROUNDING
from .inverse.search import AROUND, REACHED
from .tables import carried_by, followed, joints_of, need_fixed_base, path_to
from .tasks import Part, Task

_STEPS = 60.0
"""Limit on the steps of one descent; most converge in fewer than ten."""
_ROUNDS = 4, 16, 96
"""Limit on work: random starts of each round where the previous ones have failed."""
_JOINTS = ("variables", "ratios", "offsets", "places", "screws", "turns")
_PULLS = 0.1, 0.01, 1e-3
"""Weights of the distance from `rest` relative to the tasks, one descent each. The last one leaves the tasks by about
its square, 1e-6 of the size; from there, the descent without it converges quadratically. With the last one alone, a
descent follows a narrow valley in small steps."""


class ReachStatus(Status):
    """Outcome for one configuration.

    ``OK``: all tasks are fulfilled to 1e-9 of the robot's size, within the limits. ``NEAREST``: the sum of the
    squared weighted distances has a local minimum, the smallest one of some hundred starts; this does not prove that
    the tasks cannot be fulfilled. ``NOT_FINITE``: a target or `near` is NaN or infinite.
    """

    OK = 0
    NEAREST = 1
    NOT_FINITE = 2


@dataclass(frozen=True, slots=True, eq=False)
class Reached:
    """Configurations that fulfil tasks.

    Attributes
    ----------
    q : array, (..., n)
        Variables within their limits; NaN where the status is NOT_FINITE.
    status : array of int, (...)
        Values of `ReachStatus`.
    distances : array, (..., tasks)
        What is left of each task, in metres or radians as the task says; `pose` counts as two tasks.
    """

    q: Reals
    status: NDArray[np.int8]
    distances: Reals


class Reaching:
    """The tasks of one robot, with its tables prepared: for control loops, in which only targets change.

    Parameters
    ----------
    robot : Robot
        With a fixed base. The limits of its variables hold.
    tasks : Task or sequence of Task
        From `algorithms.kinematics.tasks`. Tasks inside tuples, such as those of `pose`, are tasks of their own.

    Raises
    ------
    TypeError, ValueError
        If there is no task, a link is unknown or fixed to the base, or a link is moved by several joints that follow
        one variable.

    Examples
    --------
    >>> from algorithms.kinematics import Robot
    >>> from algorithms.kinematics.tasks import direction, position
    >>> arm = Robot.named("panda")
    >>> reaching = Reaching(arm, [position([0.4, 0.1, 0.5]), direction([0, 0, -1])])
    >>> found = reaching([0, 0, 0, -1.5, 0, 1.5, 0])
    >>> found.status
    array(0, dtype=int8)
    """

    def __init__(self, robot: Differential, tasks: Task | Iterable[Any]) -> None:
        need_fixed_base(robot, "reach")
        self._robot = robot
        self._tasks = list(_flat(tasks))
        if not self._tasks:
            raise ValueError("tasks: none; expected at least one, such as tasks.position([0.4, 0.1, 0.5])")
        self._parts = [part for task in self._tasks for part in task.parts]
        self._owners = np.repeat(np.arange(len(self._tasks)), [len(task.parts) for task in self._tasks])
        self._size = _size(robot)
        self._low, self._high = np.ascontiguousarray(robot.limits[:, :2].T)
        self._turns = np.array([robot.kinds[joint] is Joint.REVOLUTE for joint in robot.leaders])
        self._lengths = np.where(self._turns, self._size, 1.0)
        self._targets = _stacked([part.target for part in self._parts])
        self._bind()

    def _bind(self) -> None:
        robot, parts = self._robot, self._parts
        frames = [self._frame(task) for task in self._tasks]
        links = np.array([frames[owner][0] for owner in self._owners], np.int64)
        motors = np.array([frames[owner][1] for owner in self._owners])
        # Only ratios of weights matter; the errors of the tasks are compared with the size.
        largest = max(task.weight for task in self._tasks)
        weights = np.array([task.weight / largest * (self._size if task.is_angle else 1.0) for task in self._tasks])
        # Squared norms of the parts become those of their tasks, without weights.
        self._shares = (self._owners[:, None] == np.arange(len(self._tasks))) / weights**2
        self._tolerances = np.array([REACHED * (1.0 if task.is_angle else self._size) for task in self._tasks])
        joints, carried = self._moving(links)
        self._moves = np.array([(carried[:, self._owners == k] != 0).any(1) for k in range(len(self._tasks))])
        table = joints_of(robot)
        tree = {name: getattr(table, name) for name in ("parents", *_JOINTS)}
        tasks = {
            "links": links,
            "kinds": np.array([float(part.kind) for part in parts]),
            "points": pga3.move_point(motors, np.array([part.point for part in parts])),
            "directions": pga3.move_direction(motors, np.array([part.direction for part in parts])),
            "rows": np.array([weights[owner] * part.rows for owner, part in zip(self._owners, parts, strict=True)]),
            "radii": np.array([part.radius for part in parts]),
        }
        lengths = {"m": robot.n_joints, "k": len(parts)}
        self._left = kernels.distances_to_tasks.bind(lengths, **tree, **tasks)
        reach = {
            "joints": joints,
            "carried": carried,
            "low": self._low,
            "high": self._high,
            "size": self._size,
            "enough": ROUNDING * self._size,
            "at_most": _STEPS,
        }
        self._with_pulls = partial(kernels.reach.bind, lengths, **tree, **tasks, **reach)
        self._reach = self._with_pulls(pulls=np.zeros(robot.n_joints))

    def __call__(
        self,
        near: ArrayLike | None = None,
        *,
        targets: ArrayLike | None = None,
        rest: ArrayLike | None = None,
    ) -> Reached:
        """Return the configurations as `Robot.reach` does.

        Parameters
        ----------
        near : array_like, (..., n), optional
            As in `Robot.reach`.
        targets : array_like, (..., parts, 3), optional
            Other targets of the same tasks, as `targets` of this object returns them. Directions are unit vectors.
        rest : array_like, (..., n), optional
            As in `Robot.reach`.

        Returns
        -------
        Reached

        Raises
        ------
        TypeError, ValueError
            If an argument has a wrong shape.
        """
        if rest is None and (single := self._single(near, self._targets if targets is None else targets)) is not None:
            return single
        count = self._robot.n_joints
        name = self._robot.name
        goals = self._targets
        if targets is not None:
            goals = real_array(targets, f"{name}: targets", goals.shape[-2:], "a target for each part of the tasks")
        given = [
            real_array(value, f"{name}: {label}", (count,), f"{count} joint variables")
            for value, label in ((near, "near"), (rest, "rest"))
            if value is not None
        ]
        shape = _together(name, [goals.shape[:-2], *(array.shape[:-1] for array in given)])
        goals = np.ascontiguousarray(np.broadcast_to(goals, (*shape, *goals.shape[-2:]))).reshape(-1, *goals.shape[-2:])
        starts = given[0] if near is not None else np.clip(np.zeros(count), self._low, self._high)
        start = np.ascontiguousarray(np.broadcast_to(starts, (*shape, count))).reshape(-1, count)
        home = None
        if rest is not None:
            home = np.ascontiguousarray(np.broadcast_to(given[-1], (*shape, count))).reshape(-1, count)
        finite = np.isfinite(goals).all((1, 2)) & np.isfinite(start).all(1)
        if home is not None:
            finite &= np.isfinite(home).all(1)
        if finite.all():
            q, left, reached = self._searched(goals, start, home)
            status = np.where(reached, ReachStatus.OK, ReachStatus.NEAREST)
        else:
            q = np.full((len(goals), count), np.nan)
            left = np.full((len(goals), len(self._tasks)), np.nan)
            status = np.full(len(goals), ReachStatus.NOT_FINITE)
            rows = None if home is None else home[finite]
            q[finite], left[finite], reached = self._searched(goals[finite], start[finite], rows)
            status[finite] = np.where(reached, ReachStatus.OK, ReachStatus.NEAREST)
        for k, task in enumerate(self._tasks):
            left[:, k] = task.measure(left[:, k])
        return Reached(
            q.reshape(*shape, count),
            status.astype(np.int8).reshape(shape),
            left.reshape(*shape, len(self._tasks)),
        )

    def _single(self, near: Any, goals: Any) -> Reached | None:
        """Return what one descent finds for one configuration, as in control loops; None if that is not enough."""
        for array, shape in ((near, self._low.shape), (goals, self._targets.shape[-2:])):
            if type(array) is not np.ndarray or array.dtype != np.float64 or array.shape != shape:
                return None
        q, _ = self._reach(near, goals, near)
        found = self._left(q, goals)
        left = np.sqrt(np.dot(found * found, self._shares))
        if not all(map(le, left.tolist(), self._tolerances.tolist())):  # also if there is a NaN
            return None
        for k, task in enumerate(self._tasks):
            left[k] = task.measure(left[k])
        return Reached(q, np.array(ReachStatus.OK, np.int8), left)

    @property
    def targets(self) -> Reals:
        """A copy of the targets of all parts, (..., parts, 3): one for each task, and three for orientations.

        Directions are unit vectors.
        """
        return self._targets.copy()

    @cached_property
    def _pulled(self) -> list[Any]:
        """The kernels of descents towards `rest`."""
        return [self._with_pulls(pulls=(pull * self._lengths) ** 2) for pull in _PULLS]

    def _searched(self, goals: Reals, near: Reals, rest: Reals | None) -> tuple[Reals, Reals, NDArray[np.bool_]]:
        """Return configurations (N, n) that reach the goals or have the smallest error, and what `_judged` returns."""
        found, error = self._descended(near, goals, rest)
        left, reached = self._judged(found, goals)
        if reached.all():
            return found, left, reached
        for starts in self._starts(near):
            missed = np.flatnonzero(~reached)
            # Variables that move fulfilled tasks only remain where they are.
            unmet = (left[missed] > self._tolerances) @ self._moves
            begin = np.where(unmet[:, None], starts[missed], found[missed, None])
            many = np.repeat(goals[missed], begin.shape[1], 0).reshape(*begin.shape[:2], *goals.shape[1:])
            home = None if rest is None else np.ascontiguousarray(np.broadcast_to(rest[missed, None], begin.shape))
            q, errors = self._descended(begin, many, home)
            sides, good = self._judged(q, many)
            # Of the configurations that reach the goals the nearest one, otherwise the one with the smallest error.
            apart = (((q - near[missed, None]) * self._lengths) ** 2).sum(-1)
            best = np.where(good.any(1), np.where(good, apart, np.inf).argmin(1), errors.argmin(1))
            rows = np.arange(len(missed))
            better = good[rows, best] | (errors[rows, best] < error[missed])
            to, rows, best = missed[better], rows[better], best[better]
            found[to], error[to], left[to], reached[to] = (each[rows, best] for each in (q, errors, sides, good))
            if reached.all():
                break
        return found, left, reached

    def _starts(self, near: Reals) -> Iterator[Reals]:
        """Yield the starts of each further round, (N, S, n): first around `near`, then anywhere within the limits."""
        rng = np.random.default_rng(7)
        wide = np.where(self._turns, np.pi, self._size)
        # Where one limit is infinite, the range begins or ends at the other one.
        low = np.where(np.isfinite(self._low), self._low, np.minimum(-wide, self._high - 2 * wide))
        high = np.where(np.isfinite(self._high), self._high, np.maximum(wide, low + 2 * wide))
        yield near[:, None] + AROUND * (high - low) * rng.normal(size=(_ROUNDS[0], len(low)))
        for count in _ROUNDS:
            yield np.broadcast_to(rng.uniform(low, high, (count, len(low))), (len(near), count, len(low)))

    def _descended(self, begin: Reals, goals: Reals, rest: Reals | None) -> tuple[Reals, Reals]:
        """Return the ends of descents from (..., n) and their errors (...); near `rest` where that is free."""
        if rest is not None:
            for pulled in self._pulled:
                begin, _ = pulled(begin, goals, rest)
        return self._reach(begin, goals, begin)  # type: ignore[no-any-return]

    def _judged(self, q: Reals, goals: Reals) -> tuple[Reals, NDArray[np.bool_]]:
        """Return the norms of the tasks (..., tasks) without their weights, and whether all are reached, (...)."""
        left = np.sqrt(self._left(q, goals) ** 2 @ self._shares)
        return left, (left <= self._tolerances).all(-1)

    def _frame(self, task: Task) -> tuple[int, Reals]:
        """Return the joint that carries the link of a task, and the motor of the link in the frame of the joint."""
        robot = self._robot
        joint, motor = (robot.tip, robot.tool) if task.link is None else robot.carrier(task.link)
        if joint < 0:
            raise DescriptionError(
                f"{robot.name}: {task.name}: link {task.link!r} is fixed to the base; expected one that a joint moves"
            )
        return joint, carried_by(robot, joint, motor)

    def _moving(self, links: NDArray[np.int64]) -> tuple[NDArray[np.int64], Reals]:
        """Return for each variable the joint by which it moves the tasks, and its ratio for each part it moves."""
        robot = self._robot
        variables, ratios, _ = followed(robot)
        joints = np.full(robot.n_joints, -1, np.int64)
        carried = np.zeros((robot.n_joints, len(links)))
        for part, link in enumerate(links):
            for joint in path_to(robot, int(link)):
                variable = variables[joint]
                if joints[variable] not in (-1, joint):
                    raise DescriptionError(
                        f"{robot.name}: reach: {robot.joint_names[joint]} and "
                        f"{robot.joint_names[joints[variable]]} follow one variable; expected tasks of links that are "
                        "moved by one of them"
                    )
                joints[variable] = joint
                carried[variable, part] = ratios[joint]
        return np.maximum(joints, 0), carried


def reached(
    robot: Differential, tasks: Task | Iterable[Any], near: ArrayLike | None, rest: ArrayLike | None
) -> Reached:
    """Return what `Robot.reach` does. The tables of the last tasks are kept, for tasks that differ in their targets."""
    given = list(_flat(tasks))
    key = [(task.name, task.link, task.weight, [_fixed(part) for part in task.parts]) for task in given]
    kept = robot._computed.reaching
    if kept is None or kept[0] != key:
        kept = robot._computed.reaching = key, Reaching(robot, given)
    targets = _stacked([part.target for task in given for part in task.parts])
    found: Reached = kept[1](near, targets=targets, rest=rest)
    return found


def _fixed(part: Part) -> tuple[Any, ...]:
    """Return all of a part of a task but its target, to be compared."""
    return part.kind, part.radius, part.rows.tobytes(), part.point.tobytes(), part.direction.tobytes()


def _flat(tasks: Task | Iterable[Any]) -> Iterable[Task]:
    if isinstance(tasks, Task):
        yield tasks
        return
    if not isinstance(tasks, Iterable) or isinstance(tasks, (str, bytes, np.ndarray)):
        raise TypeError(f"tasks: {type(tasks).__name__}; expected tasks, such as tasks.position([0.4, 0.1, 0.5])")
    for each in tasks:
        yield from _flat(each)


def _stacked(targets: Sequence[Reals]) -> Reals:
    """Return targets (..., 3) as one array (..., parts, 3)."""
    if all(target.ndim == 1 for target in targets):
        return np.array(targets, float)
    shape = _together("tasks", [target.shape[:-1] for target in targets])
    return np.stack([np.broadcast_to(target, (*shape, 3)) for target in targets], -2).astype(float)


def _together(name: str, shapes: Sequence[tuple[int, ...]]) -> tuple[int, ...]:
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError:
        raise ValueError(f"{name}: leading axes {shapes}; expected axes that broadcast") from None


def _size(robot: Differential) -> float:
    """Return a length of the order of the robot's reach: the sum of the distances along its longest path, or 1."""
    table = joints_of(robot)
    steps = np.linalg.norm(table.places, axis=-1)
    reach = np.zeros(len(steps))
    for joint, parent in enumerate(table.parents):
        reach[joint] = 0.0 if parent < 0 else reach[parent] + steps[joint]
    total = float(reach.max(initial=0.0))
    tool = float(np.linalg.norm(pga3.motor_to_rotor_translation(carried_by(robot, robot.tip, robot.tool))[1]))
    return total + tool if total + tool > 0 else 1.0
