"""Inverse kinematics of one robot: the closed forms of `gacompiler.specs.closed_arms` with its constants folded.

Every function takes a serial `Chain`, a pose of the end effector, which is a unit motor of either sign, and the tables
of the closed form. It returns all branches of joint variables, the discriminant of each, and the error of each: the
largest difference between coefficients of two motors. These are the pose that it leads to and the given one or, for
parallel axes, the motion of these and the motion that the other joints leave them, which share more with the solution.
A branch is a solution if its error is a rounding error.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

from ..algebra.catalog import PGA3
from ..errors import SpecError
from ..frontend.expression import lift
from ..frontend.operations import absolute, maximum, minimum
from ..frontend.rows import leaves_of, like
from ..specs import closed_arms
from .chains import Chain, Number, exact
from .constants import with_constants_folded
from .exact_tables import MOTOR, motor_of, path_to
from .frames import directions_and_moments, line_of
from .kinematics import motor_of_variables

Tables = dict[str, Any]
_spec: Any = closed_arms  # specs have no types


def three_parallel_axes(
    chain: Chain, pose: Any, *, point: Sequence[Number], plane: Sequence[Number], signs: Sequence[int],
    backwards: bool = False,
) -> Any:  # fmt: skip
    """Solve six joints of which the second to fourth are parallel and the last two intersect.

    Parameters
    ----------
    chain : Chain
    pose : multivector
    point, plane, signs
        As in `closed_arms.three_parallel_axes`: coordinates (3,), coefficients of e1, e2, e3, e0, and (3,).
    backwards : bool
        Whether the tables are those of the chain from its end to the base.
    """

    def solve(goal: Any, axes: Sequence[Any]) -> Any:
        return _spec.branches_of_three_parallel_axes(goal, axes, _point(point), _plane(plane), signs)

    return _solved(chain, pose, solve, backwards)


def spherical_wrist(
    chain: Chain, pose: Any, *, centre: Sequence[Number], base: Sequence[Number], mix: Sequence[Sequence[Number]],
    third: Sequence[Sequence[Number]], is_first_before_third: bool, backwards: bool = False,
) -> Any:  # fmt: skip
    """Solve six revolute joints of which the last three intersect, and of the others two intersect or are parallel.

    Parameters
    ----------
    chain : Chain
    pose : multivector
    centre, base, mix, third
        As in `closed_arms.spherical_wrist`: coordinates (3,) of both points, (2, 2) and (2, 3).
    is_first_before_third : bool
        Which of the two joints is solved first.
    backwards : bool
        Whether the tables are those of the chain from its end to the base.
    """

    def solve(goal: Any, axes: Sequence[Any]) -> Any:
        rows = [tuple(tuple(map(exact, row)) for row in matrix) for matrix in (mix, third)]
        found = _spec.branches_of_spherical_wrist(
            goal, axes, _point(centre), _point(base), *rows, is_first_before_third
        )
        return found[:2]

    return _solved(chain, pose, solve, backwards)


def elbow_circle(chain: Chain, pose: Any, elbow: Any, *, shoulder: Sequence[Number], wrist: Sequence[Number]) -> Any:
    """Solve seven joints of which the first three intersect and the last three do, for a given elbow angle.

    Parameters
    ----------
    chain : Chain
    pose : multivector
    elbow : scalar
        As `elbow` of `algorithms.kinematics.Robot.inverse`.
    shoulder, wrist
        Coordinates (3,) of the points in which the axes intersect.
    """

    def solve(goal: Any, axes: Sequence[Any]) -> Any:
        return _spec.branches_of_elbow_circle(goal, elbow, axes, _point(shoulder), _point(wrist))

    return _solved(chain, pose, solve, False)


def _solved(chain: Chain, pose: Any, solve: Callable[..., Any], backwards: bool) -> Any:
    path = path_to(chain, chain.tip)
    if len(path) != chain.n_joints or chain.variables or set(chain.kinds) != {"revolute"}:
        raise SpecError("inverse", "slides, or joints beside the arm or coupled", "a serial arm of revolute joints")
    axes = [line_of(*line) for line in directions_and_moments(chain)]
    goal = pose * ~motor_of(chain.tool)
    branches, gaps, *ends = solve(~goal, [-axis for axis in reversed(axes)]) if backwards else solve(goal, axes)
    rows = [tuple(reversed(row)) if backwards else row for row in branches]
    pairs = ends[0] if ends else [(motor_of_variables(chain, row), pose) for row in rows]
    value = (tuple(rows), tuple(gaps), tuple(_error(left, made) for made, left in pairs))
    return like(value, with_constants_folded([lift(leaf) for leaf in leaves_of(value)]))


def _error(pose: Any, made: Any) -> Any:
    """Return the largest difference between coefficients of two motors of any sign."""
    near, far = lift(0), lift(0)
    for blade in MOTOR:
        near = maximum(near, absolute(made[blade] - pose[blade]))
        far = maximum(far, absolute(made[blade] + pose[blade]))
    return minimum(near, far)


def _point(coordinates: Sequence[Number]) -> Any:
    x, y, z = map(exact, coordinates)
    return PGA3.multivector({"e123": Fraction(1), "e032": x, "e013": y, "e021": z})


def _plane(coefficients: Sequence[Number]) -> Any:
    return PGA3.multivector(dict(zip(("e1", "e2", "e3", "e0"), map(exact, coefficients), strict=True)))
