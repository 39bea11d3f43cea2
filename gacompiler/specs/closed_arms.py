"""All branches of the commonest arms, one kernel for each structure: the subproblems of `arms`, composed.

Axes are unit lines at the zero configuration, and a goal is the motion of all joints together. Each branch is returned
with its discriminant, the smallest of the equations that lead to it, as in `arms`. A discriminant of 0 of the joints
solved first is kept, because the following ones depend on the angle of a freely rotating joint.
"""

from fractions import Fraction
from functools import reduce

import gacompiler as ga
from gacompiler import SCALAR, array, kernel
from gacompiler.algebra.catalog import PGA3
from gacompiler.specs import arms, reaching

LINE, POINT, PLANE, MOTOR = PGA3.UNIT_LINE, PGA3.POINT, PGA3.PLANE, PGA3.MOTOR
PROFILE, SIDES = array(SCALAR, 2, 3), array(SCALAR, 3)
EVERY = (arms.BOTH,) * 3
"""Both sides of the solutions of three equations."""
VARIABLES = array(SCALAR, "n")
JUDGED = (VARIABLES, SCALAR, SCALAR, SCALAR, SCALAR)
COINCIDE = Fraction(1, 10**12)
"""Branches with discriminants up to this coincide to 1e-6 radians, as `COINCIDE` of `algorithms.kinematics`."""
ON_AXIS = Fraction(1, 10**20)
"""Squared sines up to this count as 0."""


def _motion(axis, q):
    """Compute the motor of a rotation."""
    return ga.cos(q / 2) - ga.sin(q / 2) * axis


def _in_rows(numbers, rows):
    """Return a fixed number of numbers as an array with as many rows as another one."""

    def number(k):
        return reduce(lambda last, i: ga.select(ga.equal(k, i), numbers[i], last), range(len(numbers) - 1), numbers[-1])

    return ga.each(number, ga.row_numbers(rows))


def _motions(axes, angles):
    return reduce(lambda made, pair: made * _motion(*pair), zip(axes, angles, strict=True), 1)


def _measured(found, size):
    branches, gaps, ends = found
    return branches, gaps, tuple(reaching.difference(made, left, size) for made, left in ends)


def _judged(found, goal, wanted, axes, size, turns, free, low, *limits):
    """Return what `reaching.judged` says of one branch."""
    (branch,), (gap,), _ = found
    q = _in_rows(branch, low)
    off = reaching.distance(q, goal, axes, turns, size)
    return tuple(reaching.judged(q, gap, off, wanted, turns, free, low, *limits))


def _smaller(gap, more):
    return ga.select(ga.absolute(gap) <= COINCIDE, gap, ga.minimum(gap, more))


@kernel(
    goal=MOTOR, axes=array(LINE, 6), point=POINT, plane=PLANE, signs=array(SCALAR, 3), size=SCALAR,
    returns=(array(SCALAR, 8, 6), array(SCALAR, 8), array(SCALAR, 8)),
)  # fmt: skip
def three_parallel_axes(goal, axes, point, plane, signs, size):
    """Solve six joints of which the second to fourth are parallel and the last two intersect.

    Parameters
    ----------
    goal, axes
        The motion, and the axes of the joints.
    point, plane
        Where the last two axes intersect, and the plane through this point orthogonal to the parallel axes.
    signs
        1 or -1 for each of the parallel axes: whether it has the direction of the first of them.
    size
        A length of the order of the arm's reach, by which distances are divided.

    Returns
    -------
    branches, discriminants, distances
        The last are differences of motors as of `reaching.distance_to_goal`: where the joints that are solved last lead
        to, and where the others leave them to go.
    """
    return _measured(branches_of_three_parallel_axes(goal, axes, point, plane, signs), size)


@kernel(
    goal=MOTOR, sides=SIDES, wanted=VARIABLES, lines=array(LINE, 6), point=POINT, plane=PLANE, signs=array(SCALAR, 3),
    axes=reaching.AXES, size=SCALAR, **reaching.JUDGED, returns=JUDGED,
)  # fmt: skip
def three_parallel_axes_branch(
    goal, sides, wanted, lines, point, plane, signs, axes, size, turns, free, low, high, slack, right, exact, rough,
    no_root, coincide, missing,
):  # fmt: skip
    """Compute and judge one of the branches of `three_parallel_axes`, as `reaching.judged_branch`.

    The sides are 1 or -1 for each of the three pairs of solutions, and `lines` are the axes.
    """
    found = branches_of_three_parallel_axes(goal, lines, point, plane, signs, [(side,) for side in sides])
    return _judged(
        found, goal, wanted, axes, size, turns, free, low, high, slack, right, exact, rough, no_root, coincide, missing
    )


def branches_of_three_parallel_axes(goal, axes, point, plane, signs, sides=EVERY):
    """Compute `three_parallel_axes` for the given sides, also for constants; pairs of motors instead of distances."""
    ones, gap_one = arms.to_plane(-axes[0], goal * point * ~goal, plane, sides[0])
    parallel = [sign * axis for sign, axis in zip(signs, axes[1:4], strict=True)]
    branches, gaps, ends = [], [], []
    for one in ones:
        rest = ~_motion(axes[0], one) * goal
        *wrists, gap_wrist = arms.about_two_axes(axes[4], axes[5], ~rest * axes[1] * rest, axes[1], sides[1])
        for five, six in wrists:
            wrist = _motion(axes[4], five) * _motion(axes[5], six)
            left = rest * ~wrist
            middles, gap_middle = arms.about_parallel_axes(parallel[0], parallel[1], parallel[2], left, sides[2])
            for middle in middles:
                branches.append((one, *(sign * q for sign, q in zip(signs, middle, strict=True)), five, six))
                gaps.append(_smaller(_smaller(gap_one, gap_wrist), gap_middle))
                ends.append((_motions(parallel, middle), left))
    return tuple(branches), tuple(gaps), tuple(ends)


@kernel(
    goal=MOTOR, axes=array(LINE, 6), centre=POINT, base=POINT, mix=array(SCALAR, 2, 2), third=PROFILE, order=SCALAR,
    size=SCALAR, returns=(array(SCALAR, 8, 6), array(SCALAR, 8), array(SCALAR, 8)),
)  # fmt: skip
def spherical_wrist(goal, axes, centre, base, mix, third, order, size):
    """Solve six revolute joints of which the last three intersect, and of the others two intersect or are parallel.

    Parameters
    ----------
    goal, axes
        The motion, and the axes of the joints.
    centre, base
        The point in which the last three axes intersect, and a point of the second axis.
    mix
        Combines height and distance about the second axis such that one equation has a single variable.
    third
        The side of the third joint in the combined equations, as returned by `arms.circle_profile`.
    order
        Positive if the first joint is solved before the third one, negative if after it.
    size
        As in `three_parallel_axes`, which says what is returned.
    """
    return _measured(branches_of_spherical_wrist(goal, axes, centre, base, mix, third, order > 0), size)


def _chosen(condition, a, b):
    """Return the first value if a condition holds, which may be known already."""
    if isinstance(condition, bool):
        return a if condition else b
    return ga.select(condition, a, b)


@kernel(
    goal=MOTOR, sides=SIDES, wanted=VARIABLES, lines=array(LINE, 6), centre=POINT, base=POINT,
    mix=array(SCALAR, 2, 2), third=PROFILE, order=SCALAR,
    axes=reaching.AXES, size=SCALAR, **reaching.JUDGED, returns=JUDGED,
)  # fmt: skip
def spherical_wrist_branch(
    goal, sides, wanted, lines, centre, base, mix, third, order, axes, size, turns, free, low, high, slack, right,
    exact, rough, no_root, coincide, missing,
):  # fmt: skip
    """Compute and judge one of the branches of `spherical_wrist`, as `three_parallel_axes_branch`."""
    found = branches_of_spherical_wrist(goal, lines, centre, base, mix, third, order > 0, [(side,) for side in sides])
    return _judged(
        found, goal, wanted, axes, size, turns, free, low, high, slack, right, exact, rough, no_root, coincide, missing
    )


def branches_of_spherical_wrist(goal, axes, centre, base, mix, third, is_first_before_third, sides=EVERY):
    """Compute `spherical_wrist` for the given sides, also for constants; pairs of motors instead of distances."""
    goal_point = goal * centre * ~goal
    height, distance = arms.circle_profile(axes[1], base, -axes[0], goal_point)
    first = tuple(tuple(a * x + b * y for x, y in zip(height, distance, strict=True)) for a, b in mix)
    known, wanted = (
        tuple(
            tuple(_chosen(is_first_before_third, x, y) for x, y in zip(*rows, strict=True))
            for rows in zip(*sides, strict=True)
        )
        for sides in ((first, third), (third, first))
    )
    branches, gaps, ends = [], [], []
    for (a, b), gap in zip(*arms.two_sums(known, wanted, *sides[:2]), strict=True):
        one, three = _chosen(is_first_before_third, a, b), _chosen(is_first_before_third, b, a)
        two = arms.turn_between_points(
            axes[1], arms.turned_point(axes[2], centre, three), arms.turned_point(-axes[0], goal_point, one)
        )
        arm = _motion(axes[0], one) * _motion(axes[1], two) * _motion(axes[2], three)
        left = ~arm * goal
        wrists, gap_wrist = arms.about_three_axes(axes[3], axes[4], axes[5], left, sides[2])
        for wrist in wrists:
            branches.append((one, two, three, *wrist))
            gaps.append(_smaller(gap, gap_wrist))
            ends.append((_motions(axes[3:], wrist), left))
    return tuple(branches), tuple(gaps), tuple(ends)


@kernel(
    goal=MOTOR, elbow=SCALAR, axes=array(LINE, 7), shoulder=POINT, wrist=POINT,
    returns=(array(SCALAR, 8, 7), array(SCALAR, 8)),
)  # fmt: skip
def elbow_circle(goal, elbow, axes, shoulder, wrist):
    """Solve seven joints of which the first three intersect and the last three do, for a given elbow angle.

    Parameters
    ----------
    goal, axes
        The motion, and the axes of the joints.
    elbow
        The angle of the fourth axis about the line from shoulder to wrist, from the commutator product of the line and
        the first axis; of the second axis, if the wrist is on the first one.
    shoulder, wrist
        The points in which the first and the last three axes intersect.
    """
    return branches_of_elbow_circle(goal, elbow, axes, shoulder, wrist)


def branches_of_elbow_circle(goal, elbow, axes, shoulder, wrist):
    """Compute `elbow_circle`, also for constants."""
    goal_point = goal * wrist * ~goal
    line = ga.normalize(shoulder & goal_point)
    across, spare = ga.commutator(line, axes[0]), ga.commutator(line, axes[1])
    sine_squared = ga.norm_squared(across)
    start = ga.select(sine_squared > ON_AXIS, across, spare)
    after = _motion(line, elbow) * arms.elbow_frame(shoulder, goal_point, start)
    away = goal_point - shoulder
    length = ga.sqrt(away["e032"] * away["e032"] + away["e013"] * away["e013"] + away["e021"] * away["e021"])
    fours, gap_four = arms.turns_to_sphere(axes[3], wrist, shoulder, length)
    branches, gaps = [], []
    for four in fours:
        bend = _motion(axes[3], four)
        upper = after * ~arms.elbow_frame(shoulder, bend * wrist * ~bend, axes[3])
        aheads, gap_ahead = arms.wrist_turns(*axes[:3], upper)
        behinds, gap_behind = arms.wrist_turns(*axes[4:], ~(upper * bend) * goal)
        gap = _smaller(_smaller(ga.minimum(gap_four, sine_squared), gap_ahead), gap_behind)
        branches += [(*ahead, four, *behind) for ahead in aheads for behind in behinds]
        gaps += [gap] * 4
    return tuple(branches), tuple(gaps)
