"""Inverse kinematics of a robot: which way is taken, all branches, and whether they are right."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import pga3

from ...arguments import Reals, finite, real_array
from ..model import Model
from .chain import COINCIDE, SAME, Chain, apart
from .closed import closed_form
from .elimination import Elimination
from .meets import GEOMETRIES, Meets
from .redundant import elbow_circle
from .search import descend, polish, search
from .slides import ThreeSlides, TwoSlides
from .solutions import Solutions, Status

_BLOCK = 2048
"""Poses that are worked on at once, so that what belongs to them stays in the second cache."""
_RIGHT = 2e-11
"""A branch is valid where each coefficient of its motor, lengths as parts of the arm's size, is nearer than this."""
_EXACT = 1e-13
"""Branches farther off than this, up to `_ROUGH`, are polished."""
_ROUGH, _NO_ROOT = 1e-3, -1e-6
"""But for those whose discriminant says that there is no solution, whatever its rounding."""
_STEPS, _FEW = 60, 8
"""Of descents to the nearest pose that can be reached; and from how many starts, where nothing is known."""
_MOTION = 1e-3
"""Matrices are of motions where no entry of the rotation is farther from one, and from that of the motor."""
_AT_LIMIT = 1e-11
"""Variables that are beyond a limit by rounding, up to this, are put on it: the pose is still right."""

Way = Callable[[Reals, slice], tuple[Reals, Reals]]


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    """Branches of a batch of goals: q (N, B, n), valid (N, B), discriminants (N, B), nearest (N, n)."""

    q: Reals
    valid: NDArray[np.bool_]
    gap: Reals
    nearest: Reals
    method: str


def inverse(
    robot: Model,
    poses: ArrayLike,
    *,
    locked: Mapping[int, ArrayLike] | None = None,
    elbow: ArrayLike | None = None,
    way: str = "motors",
    near: ArrayLike | None = None,
) -> Solutions:
    """All configurations of a robot that reach poses: what `Robot.inverse` calls, and describes."""
    if way != "motors" and way not in GEOMETRIES:
        raise ValueError(f"{robot.name}: way {way!r}; expected 'motors', {', '.join(map(repr, GEOMETRIES))}")
    if way != "motors" and elbow is not None:
        raise ValueError(f"{robot.name}: way {way!r} with an elbow; expected 'motors', or joints locked")
    goals = _motors(robot, poses)
    shape, count = goals.shape[:-1], int(np.prod(goals.shape[:-1]))
    if locked and elbow is not None:
        raise ValueError(f"{robot.name}: locked and elbow are both given; expected one of them")
    values = {
        joint: _per_pose(value, f"{robot.name}: locked[{joint}]", shape) for joint, value in (locked or {}).items()
    }
    for joint in values:
        if isinstance(joint, bool) or not isinstance(joint, (int, np.integer)) or not 0 <= joint < len(robot.kinds):
            raise ValueError(f"{robot.name}: locked: joint {joint!r}; expected 0 to {len(robot.kinds) - 1}")
    if values and len(values) == len(robot.kinds):
        raise ValueError(f"{robot.name}: locked: all joints; expected one at least that is free")
    angles = None if elbow is None else _per_pose(elbow, f"{robot.name}: elbow", shape)
    wanted = None if near is None else _configurations(robot, near, shape)
    given = list(values.values()) + ([] if angles is None else [angles])
    goals = goals.reshape(-1, 8)
    is_finite = np.isfinite(goals).all(-1) & np.all([np.isfinite(value) for value in given], axis=0)
    # What is not finite is solved as the pose at home, and struck out at the end.
    goals = np.where(is_finite[:, None], goals, robot.tool)
    goals = pga3.motor_between_frames(robot.tool, goals)
    values = {joint: np.where(is_finite, value, 0.0) for joint, value in values.items()}
    chain = Chain(robot.axes, tuple(kind.value == "prismatic" for kind in robot.kinds))
    if angles is not None:
        arm, turns = elbow_circle(robot), np.where(is_finite, angles, 0.0)
        found = _checked(chain, goals, lambda motors, block: arm.solve(motors, turns[block]), arm.name)
    else:
        found = _with_locked(chain, goals, values, way)
    branches, n = found.q.shape[1:]
    status, within = np.empty(count, np.int8), np.empty((count, branches), bool)
    for start in range(0, count, _BLOCK):
        block = slice(start, start + _BLOCK)
        here = None if wanted is None else wanted[block]
        _judge(robot, found, is_finite, block, status[block], within[block], here, frozenset(values))
    return Solutions(
        found.q.reshape(*shape, branches, n),
        found.valid.reshape(*shape, branches),
        status.reshape(shape),
        found.nearest.reshape(*shape, n),
        found.method,
        within.reshape(*shape, branches),
    )


def _judge(
    robot: Model,
    found: _Found,
    is_finite: NDArray[np.bool_],
    block: slice,
    status: NDArray[np.int8],
    within: NDArray[np.bool_],
    wanted: Reals | None,
    held: frozenset[int],
) -> None:
    """The status of a block of poses, and which branches are within the limits; what is not valid becomes NaN."""
    q, valid, nearest = found.q[block], found.valid[block], found.nearest[block]
    status[:] = Status.OUT_OF_REACH if found.method != "search" else Status.NOT_FOUND
    status[valid.any(-1)] = Status.FOUND
    status[(valid & (np.abs(found.gap[block]) <= COINCIDE)).any(-1)] = Status.SINGULAR
    lost = ~is_finite[block]
    if lost.any():
        status[lost], valid[lost], nearest[lost] = Status.NOT_FINITE, False, np.nan
    q[~valid] = np.nan
    within[:] = valid & _turned_inside(robot, q, None if wanted is None else wanted[:, None], held)
    _turned_inside(robot, nearest, wanted, held)
    some = np.flatnonzero(valid.any(-1))
    chosen = np.where(within[some].any(-1, keepdims=True), within[some], valid[some])
    if wanted is None:
        best = chosen.argmax(-1)
    else:
        best = np.where(chosen, np.square(q[some] - wanted[some, None]).sum(-1), np.inf).argmin(-1)
    nearest[some] = q[some, best]


def _turned_inside(robot: Model, q: Reals, wanted: Reals | None, held: frozenset[int]) -> NDArray[np.bool_]:
    """Turn joints of configurations (..., n) in place by whole turns into their limits; which are inside then: (...).

    Of several numbers of turns, the one that comes nearest to what is wanted, or to 0; `held` joints are left alone.
    """
    inside = np.ones(q.shape[:-1], bool)
    for joint, kind in enumerate(robot.kinds):
        (low, high), value = robot.limits[joint, :2], q[..., joint]
        if joint not in held:
            if kind.value == "revolute" and (wanted is not None or low > -np.pi or high < np.pi):
                fewest = np.ceil((low - _AT_LIMIT - value) / (2 * np.pi))
                most = np.floor((high + _AT_LIMIT - value) / (2 * np.pi))
                turns = np.rint(((0.0 if wanted is None else wanted[..., joint]) - value) / (2 * np.pi))
                value += 2 * np.pi * np.where(fewest <= most, np.clip(turns, fewest, most), turns)
            value[(value < low) & (value >= low - _AT_LIMIT)] = low
            value[(value > high) & (value <= high + _AT_LIMIT)] = high
        inside &= (value >= low) & (value <= high)
    return inside


def _configurations(robot: Model, near: ArrayLike, shape: tuple[int, ...]) -> Reals:
    """A configuration for each pose, (N, n)."""
    n, name = len(robot.kinds), f"{robot.name}: near"
    array = finite(real_array(near, name, (n,), f"{n} joint variables"), name)
    try:
        return np.broadcast_to(array, (*shape, n)).reshape(-1, n).astype(float)
    except ValueError:
        raise ValueError(
            f"{name}: shape {array.shape}; expected one configuration, or one for each pose, {(*shape, n)}"
        ) from None


def _motors(robot: Model, poses: ArrayLike) -> Reals:
    """Unit motors of poses, in double precision."""
    array = real_array(poses, f"{robot.name}: poses", ())
    if array.shape[-2:] == (4, 4):
        matrices = array.astype(float)
        found = pga3.motor_from_matrix(matrices)
        away = pga3.motor_to_matrix(found) - matrices
        away[..., :3, 3] = 0.0
        found[np.abs(away).max((-2, -1)) > _MOTION] = np.nan
        return found  # type: ignore[no-any-return]
    motors = real_array(array, f"{robot.name}: poses", (8,), "motors, or matrices (..., 4, 4)")
    return pga3.normalize_motor(motors.astype(float))  # type: ignore[no-any-return]


def _per_pose(value: ArrayLike, name: str, shape: tuple[int, ...]) -> Reals:
    """A number for each pose, (N,)."""
    array = real_array(value, name)
    try:
        return np.broadcast_to(array, shape).reshape(-1).astype(float)
    except ValueError:
        raise ValueError(f"{name}: shape {array.shape}; expected one number, or one for each pose, {shape}") from None


def _with_locked(chain: Chain, goals: Reals, values: Mapping[int, Reals], geometry: str) -> _Found:
    """The branches where some joints have given values, (N,) each."""
    if not values:
        form = closed_form(chain) or ThreeSlides.of(chain) or TwoSlides.of(chain) or Elimination.of(chain)
        if geometry != "motors":
            form = Meets.of(form, geometry)
            if form is None:
                raise ValueError(
                    f"way {geometry!r}: not for this arm; expected a wrist, and first axes that meet or parallel ones, "
                    "or three parallel axes; use 'motors'"
                )
        if form is None:
            return _checked(chain, goals, lambda motors, _: _searched(chain, motors), "search")
        return _checked(chain, goals, lambda motors, _: form.solve(motors), form.name)
    joint = max(values)
    value, others = values[joint], {j: v for j, v in values.items() if j != joint}
    if joint in (0, len(chain) - 1):
        rest, motors = chain.lock(joint, value, goals)
        return _inserted(_with_locked(rest, motors, others, geometry), joint, value)
    # A joint between others carries axes along: one arm for each value.
    different, which = np.unique(value, return_inverse=True)
    parts = []
    for k, one in enumerate(different if len(different) else np.zeros(1)):
        chosen = np.flatnonzero(which == k)
        rest, motors = chain.lock(joint, one, goals[chosen])
        found = _with_locked(rest, motors, {j: v[chosen] for j, v in others.items()}, geometry)
        parts.append((chosen, _inserted(found, joint, value[chosen])))
    branches = max(part.q.shape[1] for _, part in parts)
    q, nearest = np.full((len(goals), branches, len(chain)), np.nan), np.full((len(goals), len(chain)), np.nan)
    valid, gap = np.zeros((len(goals), branches), bool), np.zeros((len(goals), branches))
    for chosen, part in parts:
        here = slice(part.q.shape[1])
        q[chosen, here], valid[chosen, here], gap[chosen, here] = part.q, part.valid, part.gap
        nearest[chosen] = part.nearest
    methods = {part.method for _, part in parts}
    return _Found(q, valid, gap, nearest, "search" if "search" in methods else parts[0][1].method)


def _inserted(found: _Found, joint: int, value: Reals) -> _Found:
    q = np.insert(found.q, joint, value[:, None], axis=-1)
    return _Found(q, found.valid, found.gap, np.insert(found.nearest, joint, value, axis=-1), found.method)


def _searched(chain: Chain, goals: Reals) -> tuple[Reals, Reals]:
    q = search(chain, goals)
    return q, np.ones(q.shape[:2])


def _checked(chain: Chain, goals: Reals, way: Way, method: str) -> _Found:
    """The branches of a way, compared with the goals; those that are nearly right are polished."""
    found: _Found | None = None
    rough: list[tuple[Reals, Reals, Reals, Reals]] = []
    free: list[tuple[Reals, Reals, Reals, Reals]] = []
    for start in range(0, max(len(goals), 1), _BLOCK):
        block = slice(start, start + _BLOCK)
        q, gap = way(goals[block], block)
        off = chain.distance(q, goals[block, None])
        if found is None:
            shape = len(goals), *q.shape[1:]
            found = _Found(
                np.empty(shape), np.empty(shape[:2], bool), np.empty(shape[:2]), np.empty((shape[0], shape[2])), method
            )
        # The arc tangent of -0 is -pi.
        q[q == -np.pi] = np.pi
        valid = off <= _RIGHT
        near = (off > _EXACT) & (off < _ROUGH) & (gap > _NO_ROOT)
        if near.any():
            rows, branches = np.nonzero(near)
            rough.append((rows + start, branches, q[near], off[near]))
        loose = (off >= _ROUGH) & (np.abs(gap) <= COINCIDE) & np.isfinite(off)
        if loose.any():
            rows, branches = np.nonzero(loose)
            free.append((rows + start, branches, q[loose], off[loose]))
        # Where no branch is valid, the one that is nearest.
        best = np.argmax(valid, axis=-1)
        lost = ~valid.any(-1)
        best[lost] = np.argmin(np.where(np.isfinite(off[lost]), off[lost], np.inf), axis=-1)
        found.nearest[block] = q[np.arange(len(q)), best]
        q[~valid] = np.nan
        found.q[block], found.valid[block], found.gap[block] = q, valid, gap
    assert found is not None  # there is a block even of no goals
    if rough:
        _polished(chain, goals, found, *(np.concatenate(part) for part in zip(*rough, strict=True)))
    if free:
        _freed(chain, goals, found, *(np.concatenate(part) for part in zip(*free, strict=True)))
    missed = np.flatnonzero(~found.valid.any(-1))
    if len(missed):
        begin = found.nearest[missed]
        nowhere = ~np.isfinite(begin).all(-1)
        if nowhere.any():
            begin[nowhere] = search(chain, goals[missed[nowhere]], _FEW)[:, 0]
        reached, _ = descend(chain, begin, goals[missed], _STEPS, 1e-13 * chain.size)
        # Where a joint could turn freely, another angle than the one that was taken may reach.
        lost = (np.abs(found.gap[missed]) <= COINCIDE).any(-1) & (chain.distance(reached, goals[missed]) > _RIGHT)
        reached[lost] = search(chain, goals[missed[lost]])[:, 0]
        found.nearest[missed] = chain.wrapped(reached)
        distance = chain.distance(reached, goals[missed])
        right = missed[distance <= _RIGHT]
        found.q[right, 0], found.valid[right, 0] = found.nearest[right], True
        # Found though the equations had no solution: that is where they are singular.
        found.gap[right, 0] = 0.0
    return found


def _polished(chain: Chain, goals: Reals, found: _Found, rows: Reals, branches: Reals, q: Reals, off: Reals) -> None:
    """Put branches (K, n) that were off by (K,) into what was found, polished where that helps."""
    better = polish(chain, q, goals[rows])
    distance = chain.distance(better, goals[rows])
    improved = distance < off
    q = np.where(improved[:, None], chain.wrapped(better), q)
    right = np.where(improved, distance, off) <= _RIGHT
    rows, branches, q = rows[right], branches[right], q[right]
    found.q[rows, branches], found.valid[rows, branches] = q, True
    found.nearest[rows] = found.q[rows, found.valid[rows].argmax(-1)]


def _freed(chain: Chain, goals: Reals, found: _Found, rows: Reals, branches: Reals, q: Reals, off: Reals) -> None:
    """Put in branches (K, n), off by (K,), whose joint that turns freely has an angle from which the rest cannot reach.

    One for each pose that has no such branch yet: the nearest, moved to where it reaches, unless it is there already.
    """
    has_one = np.any(found.valid & (np.abs(found.gap) <= COINCIDE), axis=-1)
    order = np.argsort(off)
    order = order[~has_one[rows[order]]]
    first = order[np.unique(rows[order], return_index=True)[1]]
    rows, branches = rows[first], branches[first]
    better, _ = descend(chain, q[first], goals[rows], _STEPS, 1e-13 * chain.size)
    better = chain.wrapped(polish(chain, better, goals[rows]))
    known = (apart(found.q[rows], better[:, None], np.array(chain.slides)) < SAME).any(-1)
    right = (chain.distance(better, goals[rows]) <= _RIGHT) & ~known
    rows, branches = rows[right], branches[right]
    found.q[rows, branches], found.valid[rows, branches] = better[right], True
