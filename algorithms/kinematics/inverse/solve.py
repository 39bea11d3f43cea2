"""Inverse kinematics of a robot: selection of the method, and judgement of its branches."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import pga3, reaching

from ...arguments import Reals, finite, real_array
from ...elements import MOTOR, plain
from ..model import Model
from .chain import COINCIDE, Chain, Method, arm_of
from .closed import Closed, SphericalWrist, ThreeParallel, closed_form
from .elimination import Elimination
from .meets import GEOMETRIES, Meets
from .redundant import elbow_circle
from .search import Hints, search, search_within
from .single import MOTION, SinglePose
from .slides import ThreeSlides, TwoSlides
from .solutions import EVERY, FOUND, Branches, Solutions, Status
from .validation import BLOCK, EXACT, NO_ROOT, ROUGH, Found, checked

_AT_LIMIT = 1e-11
"""Variables beyond a limit by rounding errors up to this are set to the limit. The pose remains valid."""


def inverse(
    robot: Model,
    poses: ArrayLike,
    *,
    locked: Mapping[int, ArrayLike] | None = None,
    elbow: ArrayLike | None = None,
    method: str = "motors",
    near: ArrayLike | None = None,
    own: Method | None = None,
) -> Solutions:
    """Return all configurations of a robot that reach the given poses; see `Robot.inverse`.

    `own` is the kernel of the robot's own module, if that has one.
    """
    _check_method(robot, method, elbow)
    goals = unit_motors(poses, f"{robot.name}: poses")
    shape = goals.shape[:-1]
    values = _locked_values(robot, locked or {}, elbow, shape)
    angles = None if elbow is None else _per_pose(elbow, f"{robot.name}: elbow", shape)
    wanted = None if near is None else _configurations(robot, near, shape)
    goals = goals.reshape(-1, 8)
    is_finite = np.asarray(np.isfinite(goals).all(-1))
    for value in (*values.values(), *([] if angles is None else [angles])):
        is_finite &= np.isfinite(value)
    # Non-finite poses are replaced by the home pose here and marked as invalid at the end.
    poses = np.where(is_finite[:, None], goals, robot.tool)
    chain, goals = arm_of(robot).centred(pga3.motor_between_frames(robot.tool, poses))
    values = {joint: np.where(is_finite, value, 0.0) for joint, value in values.items()}
    arm = _reduced(chain, goals, values)
    form = None if arm is None else elbow_circle(robot) if angles is not None else _form(arm.chain, method)
    if arm is None or form is None:
        found = _with_locked(chain, goals, values, method, Hints(robot.limits[:, :2], wanted))
        result = _with_statuses(robot, chain, found, wanted, tuple(sorted(values)))
    else:
        solve, known = (form.solve, arm.goals) if own is None or arm.held or method != "motors" else (own, poses)
        turns = () if angles is None else (np.where(is_finite, angles, 0.0),)
        solver = _Solver(solve, (known, *turns), form.name)
        if solve is not own and not arm.held and _measures(form):
            solver = solver._replace(solve=form.measured, measures=True)
        result = _in_closed_form(robot, chain, goals, arm, solver, wanted)
    lost = ~is_finite
    if np.count_nonzero(lost):
        result.lose(lost)
    return result.solutions(shape)


def single_pose(robot: Model) -> SinglePose | None:
    """Return what computes the branches of a single pose of a robot near the origin.

    None if poses must be searched, or the robot is farther from the origin.
    """
    chain = arm_of(robot)
    form = _form(chain, "motors") if chain.is_near else None
    return None if form is None else SinglePose.of(robot, chain, form, _judged_by(chain, _bounds(robot), ()))


def _check_method(robot: Model, method: str, elbow: ArrayLike | None) -> None:
    if method == "motors":
        return
    if method not in GEOMETRIES:
        expected = " or ".join(map(repr, ("motors", *GEOMETRIES)))
        raise ValueError(f"{robot.name}: method {method!r}; expected {expected}")
    if elbow is not None:
        raise ValueError(
            f"{robot.name}: method {method!r} with elbow; expected method 'motors', or locked instead of elbow"
        )


def _locked_values(
    robot: Model, locked: Mapping[int, ArrayLike], elbow: ArrayLike | None, shape: tuple[int, ...]
) -> dict[int, Reals]:
    """Return the value of each locked joint for each pose, (N,)."""
    if locked and elbow is not None:
        raise ValueError(f"{robot.name}: locked and elbow are both given; expected at most one of them")
    values = {joint: _per_pose(value, f"{robot.name}: locked[{joint}]", shape) for joint, value in locked.items()}
    count = len(robot.kinds)
    for joint in values:
        if isinstance(joint, bool) or not isinstance(joint, (int, np.integer)) or not 0 <= joint < count:
            raise ValueError(f"{robot.name}: locked: joint {joint!r}; expected 0 to {count - 1}")
    if len(values) == count:
        raise ValueError(f"{robot.name}: locked: all joints; expected at least one free joint")
    return values


@dataclass(frozen=True, slots=True, eq=False)
class _Result:
    """What `Solutions` has, for goals in one axis, (N,)."""

    q: Reals
    valid: NDArray[np.bool_]
    status: NDArray[np.int8]
    nearest: Reals
    method: str
    within: NDArray[np.bool_]

    def lose(self, lost: NDArray[np.bool_]) -> None:
        """Mark goals that are not finite."""
        self.status[lost] = Status.NOT_FINITE
        self.valid[lost] = self.within[lost] = False
        self.q[lost] = self.nearest[lost] = np.nan

    def solutions(self, shape: tuple[int, ...]) -> Solutions:
        """Return the result for poses of the given leading axes."""
        branches, n = self.q.shape[1:]
        return Solutions(
            self.q.reshape(*shape, branches, n),
            self.valid.reshape(*shape, branches),
            self.status.reshape(shape),
            self.nearest.reshape(*shape, n),
            self.method,
            self.within.reshape(*shape, branches),
        )


_COLUMNS = ("q", "valid", "status", "nearest", "within")
"""The arrays of `_Result`, with a row for each goal."""


@dataclass(frozen=True, slots=True, eq=False)
class _Reduced:
    """An arm without its locked joints: the chain and its goals, (N, 8), and the values of the others, (N,)."""

    chain: Chain
    goals: Reals
    held: dict[int, Reals]

    def whole(self, q: Reals, start: int) -> Reals:
        """Return the variables of all joints of a block of goals, (N, B, n), in C order."""
        if not self.held:
            return np.ascontiguousarray(q)
        n = q.shape[-1] + len(self.held)
        found = np.empty((*q.shape[:-1], n))
        found[..., [joint for joint in range(n) if joint not in self.held]] = q
        for joint, value in self.held.items():
            found[..., joint] = value[start : start + len(q), None]
        return found


def _reduced(chain: Chain, goals: Reals, values: Mapping[int, Reals]) -> _Reduced | None:
    """Return an arm without locked joints; None if a joint between others has several values, or there is no goal.

    It moves the axes of the joints after it, so that each value gives a different arm.
    """
    for joint in sorted(values, reverse=True):
        value = values[joint]
        if joint not in (0, len(chain) - 1):
            if not len(value) or np.count_nonzero(value != value[0]):
                return None
            value = value[0]
        chain, goals = chain.lock(joint, value, goals)
    chain, goals = chain.centred(goals)
    return _Reduced(chain, goals, {joint: values[joint] for joint in sorted(values)})


class _Solver(NamedTuple):
    """A closed form: a function of blocks of arrays, which returns at least branches and discriminants."""

    solve: Callable[..., Any]
    known: tuple[Reals, ...]
    name: str
    measures: bool = False
    """Whether it returns the distances of the branches from the goals, too."""

    def at(self, start: int) -> tuple[Branches, Reals | None]:
        """Return the branches of a block of goals, and their distances if these are known."""
        found = self.solve(*(array[start : start + BLOCK] for array in self.known))
        if isinstance(found, Branches):
            return found, None
        return Branches(*found[:2]), found[2] if self.measures else None


def _bounds(robot: Model) -> bytes:
    """Return the limits as `_judge_of` takes them."""
    return robot.limits.T[:2].tobytes()


@lru_cache(maxsize=256)
def _judge_of(chain: Chain, limits: bytes, held: tuple[int, ...]) -> Method:
    """Return the kernel that judges the branches of a robot with the given limits, (2, n)."""
    return reaching.judged_branches.bind(**_judged_by(chain, limits, held))


def _judged_by(chain: Chain, limits: bytes, held: tuple[int, ...]) -> dict[str, Any]:
    """Return the tables of `judged_branches`."""
    low, high = np.frombuffer(limits).reshape(2, -1)
    free = np.array([float(joint not in held) for joint in range(len(chain))])
    given: dict[str, Any] = {"turns": chain.tables["turns"], "free": free, "low": low, "high": high}
    given |= {"slack": _AT_LIMIT, "right": chain.right, "exact": EXACT, "rough": ROUGH, "no_root": NO_ROOT}
    return {**given, "coincide": COINCIDE, "missing": np.nan}


def _measures(form: Any) -> TypeGuard[SphericalWrist | ThreeParallel]:
    """Whether a closed form computes distances from its goals."""
    return isinstance(form, ThreeParallel) or (isinstance(form, SphericalWrist) and form.regional.is_two_sums)


def _in_closed_form(
    robot: Model, chain: Chain, goals: Reals, arm: _Reduced, solver: _Solver, wanted: Reals | None
) -> _Result:
    """Solve and judge goals by kernels, and those whose branches are in doubt as `checked` does."""
    judge = _judge_of(chain, _bounds(robot), tuple(arm.held))
    parts = []
    for start in range(0, max(len(goals), 1), BLOCK):
        here = goals[start : start + BLOCK]
        solved, off = solver.at(start)
        q, gap = arm.whole(solved.q, start), np.ascontiguousarray(solved.gap)
        near, has_wish = _wish(None if wanted is None else wanted[start : start + BLOCK], q)
        moved, valid, within, nearest, singular, doubtful = judge(
            q, gap, chain.distance(q, here[:, None]) if off is None else off, near, has_wish
        )
        part = _Result(moved, valid > 0, FOUND[singular.astype(np.int8)], nearest, solver.name, within > 0)
        if solved.complete is not EVERY:
            part.status[~solved.complete] = Status.INCOMPLETE
        if np.count_nonzero(doubtful):
            rows = np.flatnonzero(doubtful)
            given = Branches(solved.q[rows], gap[rows], np.broadcast_to(solved.complete, len(q))[rows])
            found = checked(arm.chain, arm.goals[start + rows], given.of_block, solver.name)
            for joint, value in arm.held.items():
                found = _inserted(found, joint, value[start + rows])
            wish = None if wanted is None else near[rows]
            again = _with_statuses(robot, chain, found, wish, tuple(arm.held))
            for column in _COLUMNS:
                getattr(part, column)[rows] = getattr(again, column)
        parts.append(part)
    if len(parts) == 1:
        return parts[0]
    columns = {column: np.concatenate([getattr(part, column) for part in parts]) for column in _COLUMNS}
    return _Result(**columns, method=solver.name)


def _with_statuses(robot: Model, chain: Chain, found: Found, wanted: Reals | None, held: tuple[int, ...]) -> _Result:
    """Return what was found for some goals, with angles within the limits and statuses."""
    judge = _judge_of(chain, _bounds(robot), held)
    q, gap, off = np.ascontiguousarray(found.q), np.ascontiguousarray(found.gap), np.where(found.valid, 0.0, 1.0)
    near, has_wish = _wish(wanted, q)
    moved, _, within, best, singular, _ = judge(q, gap, off, near, has_wish)
    some = np.asarray(found.valid.any(-1))
    status = np.full(len(q), Status.OUT_OF_REACH if found.method != "search" else Status.NOT_FOUND, np.int8)
    status[~found.complete] = Status.NOT_FOUND
    status[some] = FOUND[singular[some].astype(np.int8)]
    status[some & ~found.complete] = Status.INCOMPLETE
    nearest = np.where(some[:, None], best, _within_limits(robot, found.nearest, near, held))
    return _Result(moved, found.valid, status, nearest, found.method, within > 0)


def _wish(wanted: Reals | None, q: Reals) -> tuple[Reals, Reals]:
    """Return the configurations to be near to, (N, n), and whether there is a wish, (N,), as the kernel takes them."""
    if wanted is None:
        return np.zeros((len(q), q.shape[-1])), np.zeros(len(q))
    return wanted, np.ones(len(q))


def _within_limits(robot: Model, q: Reals, wanted: Reals, held: tuple[int, ...]) -> Reals:
    """Return configurations (N, n) that may reach no goal, with angles as those of branches."""
    free = np.array([float(joint not in held) for joint in range(len(robot.kinds))])
    turns = free * np.array([float(kind.value == "revolute") for kind in robot.kinds])
    low, high = robot.limits.T[:2]
    return reaching.brought_within_limits(*np.broadcast_arrays(q, low, high, wanted, turns, _AT_LIMIT * free))[0]


def _configurations(robot: Model, near: ArrayLike, shape: tuple[int, ...]) -> Reals:
    """Return a configuration for each pose, (N, n)."""
    n, name = len(robot.kinds), f"{robot.name}: near"
    array = finite(real_array(near, name, (n,), f"{n} joint variables"), name)
    try:
        return np.broadcast_to(array, (*shape, n)).reshape(-1, n).astype(float)
    except ValueError:
        raise ValueError(
            f"{name}: shape {array.shape}; expected one configuration, or one for each pose, {(*shape, n)}"
        ) from None


def unit_motors(poses: ArrayLike, name: str) -> Reals:
    """Return motors or matrices as unit motors in double precision; NaN for matrices that are no rigid motions."""
    array = real_array(plain(poses, name, MOTOR), name, ())
    if array.shape[-2:] == (4, 4):
        found, away = reaching.motor_of_pose(array.astype(float))
        return np.where((away > MOTION)[..., None], np.nan, found)
    motors = real_array(array, name, (8,), "motors, or matrices (..., 4, 4)")
    return pga3.normalize_motor(motors.astype(float))


def _per_pose(value: ArrayLike, name: str, shape: tuple[int, ...]) -> Reals:
    """Return a number for each pose, (N,)."""
    array = real_array(value, name)
    try:
        return np.broadcast_to(array, shape).reshape(-1).astype(float)
    except ValueError:
        raise ValueError(f"{name}: shape {array.shape}; expected one number, or one for each pose, {shape}") from None


@lru_cache(maxsize=256)
def _form(chain: Chain, geometry: str) -> Closed | None:
    """Return the method for a chain, or None if it must be searched."""
    form: Closed | None = closed_form(chain) or ThreeSlides.of(chain) or TwoSlides.of(chain) or Elimination.of(chain)
    if geometry == "motors":
        return form
    form = Meets.of(form, geometry)
    if form is None:
        raise ValueError(
            f"method {geometry!r}: not available for this arm; expected a spherical wrist with intersecting or "
            "parallel axes before it, or three parallel axes; use method 'motors'"
        )
    return form


def _with_locked(chain: Chain, goals: Reals, values: Mapping[int, Reals], geometry: str, hints: Hints) -> Found:
    """Return the branches where some joints have given values, (N,) each."""
    if not values:
        chain, goals = chain.centred(goals)
        form = _form(chain, geometry)
        if form is None:
            return checked(chain, goals, lambda motors, block: _searched(chain, motors, hints.at(block)), "search")
        return checked(chain, goals, lambda motors, _: form.solve(motors), form.name)
    joint = max(values)
    value, others = values[joint], {j: v for j, v in values.items() if j != joint}
    if joint in (0, len(chain) - 1):
        rest, motors = chain.lock(joint, value, goals)
        return _inserted(_with_locked(rest, motors, others, geometry, hints.without(joint)), joint, value)
    # A joint between others moves the axes of the joints after it, so that each value gives a different arm.
    different, which = np.unique(value, return_inverse=True)
    parts = []
    for k, one in enumerate(different if len(different) else np.zeros(1)):
        chosen = np.flatnonzero(which == k)
        rest, motors = chain.lock(joint, one, goals[chosen])
        rest_of_others = {j: v[chosen] for j, v in others.items()}
        found = _with_locked(rest, motors, rest_of_others, geometry, hints.at(chosen).without(joint))
        parts.append((chosen, _inserted(found, joint, value[chosen])))
    branches = max(part.q.shape[1] for _, part in parts)
    q, nearest = np.full((len(goals), branches, len(chain)), np.nan), np.full((len(goals), len(chain)), np.nan)
    valid, gap = np.zeros((len(goals), branches), bool), np.zeros((len(goals), branches))
    complete = np.ones(len(goals), bool)
    for chosen, part in parts:
        here = slice(part.q.shape[1])
        q[chosen, here], valid[chosen, here], gap[chosen, here] = part.q, part.valid, part.gap
        nearest[chosen], complete[chosen] = part.nearest, part.complete
    methods = {part.method for _, part in parts}
    return Found(q, valid, gap, nearest, "search" if "search" in methods else parts[0][1].method, complete)


def _inserted(found: Found, joint: int, value: Reals) -> Found:
    q = np.insert(found.q, joint, value[:, None], axis=-1)
    return Found(
        q, found.valid, found.gap, np.insert(found.nearest, joint, value, axis=-1), found.method, found.complete
    )


def _searched(chain: Chain, goals: Reals, hints: Hints) -> Branches:
    # Arms with up to six joints have few branches, of which limits would hide some.
    q = search_within(chain, goals, hints) if len(chain) > 6 else search(chain, goals)
    return Branches(q, np.ones(q.shape[:2]), np.zeros(len(q), bool))
