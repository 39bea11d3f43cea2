"""The first three joints of an arm, which move a point to a given position.

``E1 E2 E3 c = p``. The invariants of the second joint are equal for ``x = E3 c`` and ``y = E1^-1 p``: height and
distance for a revolute joint, two coordinates for a prismatic joint. These are two equations between the first and the
third variable. If one of them, or a linear combination, contains only one of the variables because axes intersect or
are parallel, the variables are solved one after the other, with two solutions each. Otherwise an ellipse intersects a
circle in at most four points (Pieper's quartic).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from generated import arms, pga3

from ...arguments import Reals
from .chain import TOLERANCE, Chain, common_point, direction, parallel


class _Order(Enum):
    FIRST_THEN_THIRD = 1
    THIRD_THEN_FIRST = 2
    TOGETHER = 3


@dataclass(frozen=True, slots=True, eq=False)
class Regional:
    """Closed form of three joints for the position of a point.

    Attributes
    ----------
    chain : Chain
        Three joints.
    point : array, (3,)
        The moved point at the zero configuration.
    """

    chain: Chain
    point: Reals
    order: _Order
    mix: Reals
    """(2, 2) Matrix that combines the two equations, so that the first has a single variable."""
    frame: tuple[Reals, Reals]
    """A point of the second axis (twice) for a revolute second joint, two directions for a prismatic one. See
    `_equations`."""
    third: Reals
    """(2, 3) The side of the third joint in both equations, combined."""

    @classmethod
    def of(cls, chain: Chain, point: Reals) -> Regional | None:
        """Return the closed form of three joints, or None if there is none: for prismatic joints skew to all others."""
        frame = _frame(chain)
        scale = np.array([1.0, 1.0 if chain.slides[1] else 1 / chain.size])
        mix = np.diag(scale)
        third = mix @ _equations(chain, frame, 2, chain.axes[2], point)
        tests = point + chain.size * np.random.default_rng(0).normal(size=(8, 3))
        first = mix @ _equations(chain, frame, 0, -chain.axes[0], tests)
        small = TOLERANCE * max(1.0, chain.size)
        single = np.abs(first[..., :2]).max((0, 2)) <= small
        left, values, _ = np.linalg.svd(third[:, :2])
        if values[1] <= small:
            order, mix = _Order.FIRST_THEN_THIRD, left.T[::-1] @ mix
        elif single.any():
            order, mix = _Order.THIRD_THEN_FIRST, (np.eye(2) if single[0] else np.eye(2)[::-1]) @ mix
        elif not (chain.slides[0] or chain.slides[2]):
            order = _Order.TOGETHER
        else:
            return None
        return cls(chain, point, order, mix, frame, mix @ _equations(chain, frame, 2, chain.axes[2], point))

    @property
    def is_two_sums(self) -> bool:
        """Whether all joints are revolute, and one equation has a single variable."""
        return not any(self.chain.slides) and self.order is not _Order.TOGETHER

    @property
    def two_sums(self) -> tuple[Reals, Reals, Reals, Reals, float]:
        """What `closed_arms.spherical_wrist` takes after the axes."""
        order = 1.0 if self.order is _Order.FIRST_THEN_THIRD else -1.0
        return self.point, self.frame[0], self.mix, self.third, order

    def solve(self, goals: Reals) -> tuple[Reals, Reals]:
        """Return all branches for goals of the point.

        Parameters
        ----------
        goals : array, (N, 3)

        Returns
        -------
        q : array, (N, 4, 3)
        discriminant : array, (N, 4)
            The smallest discriminant of the solved equations, as in the module `arms`.
        """
        chain = self.chain
        first = self.mix @ _equations(chain, self.frame, 0, -chain.axes[0], goals)
        if self.order is _Order.TOGETHER:
            inverse = np.linalg.inv(self.third[:, :2])
            ellipse, centre = inverse @ first[..., :2], (first[..., 2] - self.third[:, 2]) @ inverse.T
            one, imaginary = arms.turns_of_ellipse(ellipse, centre)
            circle = np.stack([np.cos(one), np.sin(one)], -1)
            x = circle @ ellipse.swapaxes(-1, -2) + centre[:, None]
            three, gap = np.arctan2(x[..., 1], x[..., 0]), _apart(one, imaginary)
        else:
            ahead = self.order is _Order.FIRST_THEN_THIRD
            known, wanted = (first[:, None], self.third) if ahead else (self.third, first[:, None])
            slides = (chain.slides[0], chain.slides[2])[:: 1 if ahead else -1]
            if any(slides):
                a, b, gap = _in_turn(slides, known, wanted)
            else:
                both, gap = arms.turns_of_two_sums(first if ahead else self.third, self.third if ahead else first)
                a, b = both[..., 0], both[..., 1]
            one, three = (a, b) if ahead else (b, a)
        return np.stack([one, self._second(one, three, goals), three], -1), gap

    def _second(self, one: Reals, three: Reals, goals: Reals) -> Reals:
        """Return the variable of the second joint, from those of the others."""
        chain, axis = self.chain, self.chain.axes[1]
        x = _moved(chain.slides[2], chain.axes[2], self.point, three)
        y = _moved(chain.slides[0], -chain.axes[0], goals[:, None], one)
        if chain.slides[1]:
            return np.asarray(pga3.position_along_line(y, axis) - pga3.position_along_line(x, axis))
        return arms.turn_between_points(axis, x, y)  # type: ignore[no-any-return]


def _apart(angles: Reals, imaginary: Reals) -> Reals:
    """Return the squared sine of half the angle to the nearest other solution, negative for non-solutions: (N, 4)."""
    half = np.sin((angles[:, :, None] - angles[:, None]) / 2) ** 2
    near: Reals = (half + np.eye(4)).min(-1)
    return np.where(imaginary == 0, near, -np.abs(imaginary))


def _frame(chain: Chain) -> tuple[Reals, Reals]:
    """Return the reference of the two equations, chosen so that constant sides are constant to rounding errors."""
    first, second = chain.axes[:2]
    if not chain.slides[1]:
        meet = None if chain.slides[0] else common_point(chain.axes[:2], chain.size)
        base = pga3.line_support(second) if meet is None else meet
        return base, base
    # The second coordinate is orthogonal to the first prismatic axis, or along the component of the first axis that is
    # orthogonal to the second joint.
    along = direction(second)
    other = direction(first)
    if parallel(first, second):
        other = np.eye(3)[np.argmin(np.abs(along))]
    across = np.cross(along, other)
    across /= np.linalg.norm(across)
    inside = np.cross(across, along)
    return (inside, across) if chain.slides[0] else (across, inside)


def _equations(chain: Chain, frame: tuple[Reals, Reals], joint: int, axis: Reals, points: Reals) -> Reals:
    """Return both equations of points that a joint moves about or along an axis: (..., 3) to (..., 2, 3)."""
    slides = chain.slides[joint]
    if chain.slides[1]:
        shadow = arms.segment_shadow if slides else arms.circle_shadow
        return shadow(*frame, axis, points)
    profile = arms.segment_profile if slides else arms.circle_profile
    return profile(chain.axes[1], frame[0], axis, points)


def _moved(slides: bool, axis: Reals, points: Reals, q: Reals) -> Reals:
    """Return points moved by a joint."""
    if slides:
        return pga3.move_point(pga3.motor_from_screw(axis, 0.0, q), points)
    return arms.turned_point(axis, points, q)


def _in_turn(slides: tuple[bool, ...], known: Reals, wanted: Reals) -> tuple[Reals, Reals, Reals]:
    """Solve the equations one after the other, as `arms.turns_of_two_sums`, also for prismatic joints."""
    a, gap_a = _solved(slides[0], known[..., 0, :], wanted[..., 0, 2])
    a, gap_a = a.reshape(-1, 2), gap_a.reshape(-1, 1)
    b, gap_b = _solved(slides[1], wanted[..., 1, :], _value(slides[0], known[..., 1, :], a))
    return np.repeat(a, 2, axis=-1), b.reshape(-1, 4), np.repeat(np.minimum(gap_a, gap_b), 2, axis=-1)


def _solved(slides: bool, row: Reals, value: Reals) -> tuple[Reals, Reals]:
    """Return both variables at which a side has a value, (..., 3) and (...) to (..., 2), and the discriminant."""
    if not slides:
        return arms.turns_of_sum(row[..., 0], row[..., 1], value - row[..., 2])
    found, gap = arms.slides_of_quadratic(row[..., 0], row[..., 1], row[..., 2] - value)
    # A linear equation has one solution.
    linear = np.broadcast_to(row[..., 0] == 0, gap.shape)
    return np.where(linear[..., None] & np.array([False, True]), np.nan, found), gap


def _value(slides: bool, row: Reals, q: Reals) -> Reals:
    """Evaluate a side of an equation at values of its variable."""
    a, b = (q * q, q) if slides else (np.cos(q), np.sin(q))
    value: Reals = row[..., 0] * a + row[..., 1] * b + row[..., 2]
    return value
