"""The affine and conformal methods of the book (11.5 and 11.6): points are found by intersecting geometric objects.

A point moved by a joint describes a circle or a line. The invariants of the next joint determine its position there: in
a plane orthogonal to an axis, or on a sphere about a point of an axis. In conformal geometry the intersection of circle
and sphere, circle and plane, or line and sphere is a point pair, which is imaginary if there is no intersection. In
affine geometry two spheres intersect in their radical plane, planes intersect in lines, and the points of a line at a
given distance are found by the theorem of Pythagoras. Angles are then those between planes through the axes. The module
`arms` performs the same computation on motors in fewer and larger steps; these methods serve illustration and
comparison.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from generated import arms, cga3, pga3

from ...arguments import Reals
from ...precision import ROOT
from .chain import Chain, common_point, direction, parallel
from .closed import Backwards, Closed, SphericalWrist, ThreeParallel, joined

Pair = tuple[Reals, Reals]
"""Two points (..., 2, 3), and the squared sine (...) of half the angle between them, negative if they do not exist."""


_SMALL, _FREE = 1e-14, 1e-12
"""Circles with a relative radius below the first number count as points. If their radius and their distance to the
plane are below the second number, every angle is a solution."""


class Geometry(Protocol):
    """Intersection of a circle or a line with a plane or a sphere."""

    def circle_plane(self, axis: Reals, p: Reals, plane_point: Reals, normal: Reals) -> Pair:
        """Intersect the circle of `p` about an axis with the plane through a point with a unit normal."""

    def circle_sphere(self, axis: Reals, p: Reals, centre: Reals, radius: Reals) -> Pair:
        """Intersect the circle of `p` about an axis with a sphere."""

    def line_plane(self, axis: Reals, p: Reals, plane_point: Reals, normal: Reals) -> Pair:
        """Intersect the line through `p` along an axis with a plane. The point is returned twice."""

    def line_sphere(self, axis: Reals, p: Reals, centre: Reals, radius: Reals) -> Pair:
        """Intersect the line through `p` along an axis with a sphere."""


def _sphere_of_circle(axis: Reals, p: Reals) -> tuple[Reals, Reals]:
    """Return centre and radius of the circle of a point about an axis."""
    centre = pga3.project_point_on_line(p, axis)
    return centre, pga3.distance_points(p, centre)


class ConformalGeometry:
    """Intersections as point pairs of G(4,1)."""

    def circle_plane(self, axis: Reals, p: Reals, plane_point: Reals, normal: Reals) -> Pair:
        """As in `Geometry`."""
        circle, radius = self._circle(axis, p)
        return self._points(cga3.meet_circle_plane(circle, cga3.plane_from_point_normal(plane_point, normal)), radius)

    def circle_sphere(self, axis: Reals, p: Reals, centre: Reals, radius: Reals) -> Pair:
        """As in `Geometry`."""
        circle, own = self._circle(axis, p)
        return self._points(cga3.meet_circle_sphere(circle, cga3.sphere_from_centre(centre, radius)), own)

    def line_plane(self, axis: Reals, p: Reals, plane_point: Reals, normal: Reals) -> Pair:
        """As in `Geometry`."""
        line, plane = self._line(axis, p), cga3.plane_from_point_normal(plane_point, normal)
        point = cga3.point_from_flat_point(cga3.meet_line_plane(line, plane))
        return np.stack([point, point], -2), np.ones(point.shape[:-1])

    def line_sphere(self, axis: Reals, p: Reals, centre: Reals, radius: Reals) -> Pair:
        """As in `Geometry`."""
        return self._points(cga3.meet_line_sphere(self._line(axis, p), cga3.sphere_from_centre(centre, radius)), radius)

    def _circle(self, axis: Reals, p: Reals) -> tuple[Reals, Reals]:
        centre, radius = _sphere_of_circle(axis, p)
        return cga3.circle_from_centre(centre, direction(axis), radius * radius), radius

    def _line(self, axis: Reals, p: Reals) -> Reals:
        along = np.broadcast_to(direction(axis), p.shape)
        return cga3.line_from_direction_moment(along, np.cross(p, along))

    def _points(self, pair: Reals, radius: Reals) -> Pair:
        square = cga3.point_pair_radius_squared(pair)
        points = np.stack(cga3.point_pair_points(pair), -2)
        # the centre of an imaginary pair is the nearest point
        points = np.where((square > 0)[..., None, None], points, cga3.point_pair_centre(pair)[..., None, :])
        with np.errstate(divide="ignore", invalid="ignore"):
            return points, np.clip(square / radius**2, -1, 1)


class AffineGeometry:
    """Intersections as lines of planes of G(3,0,1), and distances along them."""

    def circle_plane(self, axis: Reals, p: Reals, plane_point: Reals, normal: Reals) -> Pair:
        """As in `Geometry`."""
        centre, radius = _sphere_of_circle(axis, p)
        across = pga3.plane_orthogonal_to_line(p, axis)
        line = pga3.normalize_line(pga3.meet_planes(across, pga3.plane_from_point_normal(plane_point, normal)))
        return self._along(line, centre, radius)

    def circle_sphere(self, axis: Reals, p: Reals, centre: Reals, radius: Reals) -> Pair:
        """As in `Geometry`."""
        own, own_radius = _sphere_of_circle(axis, p)
        between = centre - own
        square = np.square(between).sum(-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            part = ((square + own_radius**2 - radius**2) / (2 * square))[..., None]
            return self.circle_plane(axis, p, own + part * between, between / np.sqrt(square)[..., None])

    def line_plane(self, axis: Reals, p: Reals, plane_point: Reals, normal: Reals) -> Pair:
        """As in `Geometry`."""
        plane = pga3.plane_from_point_normal(plane_point, normal)
        point = pga3.point_from_trivector(pga3.meet_line_plane(self._line(axis, p), plane))
        return np.stack([point, point], -2), np.ones(point.shape[:-1])

    def line_sphere(self, axis: Reals, p: Reals, centre: Reals, radius: Reals) -> Pair:
        """As in `Geometry`."""
        return self._along(self._line(axis, p), centre, radius)

    def _line(self, axis: Reals, p: Reals) -> Reals:
        along = np.broadcast_to(direction(axis), p.shape)
        return pga3.line_from_direction_moment(along, np.cross(p, along))

    def _along(self, line: Reals, centre: Reals, radius: Reals) -> Pair:
        """Return the points of a line at a distance from a centre."""
        foot = pga3.project_point_on_line(centre, line)
        square = radius**2 - pga3.distance_squared_points(foot, centre)
        half = np.sqrt(np.maximum(square, 0))[..., None] * direction(line)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.stack([foot - half, foot + half], -2), np.clip(square / radius**2, -1, 1)


GEOMETRIES: dict[str, Geometry] = {"affine": AffineGeometry(), "conformal": ConformalGeometry()}


@dataclass(frozen=True, slots=True, eq=False)
class Meets:
    """A closed form whose points are found by intersections."""

    form: SphericalWrist | ThreeParallel
    geometry: Geometry
    geometry_name: str

    @classmethod
    def of(cls, form: Closed | None, geometry_name: str) -> Closed | None:
        """Return the method for "affine" or "conformal" geometry, or None for arms that need a quartic."""
        if isinstance(form, Backwards):
            inner = cls.of(form.forwards, geometry_name)
            return None if inner is None else Backwards(inner)
        if isinstance(form, SphericalWrist):
            chain = form.regional.chain
            folded = parallel(chain.axes[1], chain.axes[2]) and not chain.slides[2]
            if chain.slides[1] or not (folded or _shoulder(chain) is not None):
                return None
        elif not isinstance(form, ThreeParallel):
            return None
        return cls(form, GEOMETRIES[geometry_name], geometry_name)

    @property
    def name(self) -> str:
        """The structure of the arm, and the geometry."""
        return f"{self.form.name}, {self.geometry_name}"

    def solve(self, goals: Reals) -> tuple[Reals, Reals]:
        """As in `Closed`."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return self._wrist(goals) if isinstance(self.form, SphericalWrist) else self._parallel(goals)

    def _path_plane(self, chain: Chain, joint: int, p: Reals, plane_point: Reals, axis: Reals) -> Pair:
        normal = np.broadcast_to(direction(axis), p.shape)
        if chain.slides[joint]:
            return self.geometry.line_plane(chain.axes[joint], p, plane_point, normal)
        return self._circle_plane(chain.axes[joint], p, plane_point, normal)

    def _circle_plane(self, axis: Reals, p: Reals, plane_point: Reals, normal: Reals) -> Pair:
        """As in `Geometry`, relative to radius and centre of the circle, to avoid cancellation for small circles."""
        centre, radius = _sphere_of_circle(axis, p)
        reach = np.maximum(np.abs(p), np.abs(plane_point)).max(-1, initial=1e-30)
        size = np.maximum(radius, _SMALL * reach)[..., None]
        away = plane_point - centre
        places, gap = self.geometry.circle_plane(_through_origin(axis), (p - centre) / size, away / size, normal)
        every = (radius <= _FREE * reach) & (np.abs((away * normal).sum(-1)) <= _FREE * reach)
        places = np.where((every & ~(gap >= 0))[..., None, None], 0.0, places)
        return centre[..., None, :] + size[..., None] * places, np.where(every, 0.0, gap)

    def _path_sphere(self, chain: Chain, joint: int, p: Reals, centre: Reals, radius: Reals) -> Pair:
        intersect = self.geometry.line_sphere if chain.slides[joint] else self.geometry.circle_sphere
        return intersect(chain.axes[joint], p, centre, radius)

    def _wrist(self, goals: Reals) -> tuple[Reals, Reals]:
        assert isinstance(self.form, SphericalWrist)
        chain, centre = self.form.regional.chain, self.form.regional.point
        goal = pga3.move_point(goals, centre)
        q, gap = self._three(chain, np.broadcast_to(centre, goal.shape), goal)
        rest = pga3.motor_relative(chain.motion_of_all(q), goals[:, None])
        axes, turns = self.form.chain.axes[3:], self.form.chain.part(3, 6)
        # on the unit sphere about the origin: the first two rotations take the direction `before` to `after`
        first, second = _through_origin(axes[0]), _through_origin(axes[1])
        after = direction(pga3.move_line(rest, axes[2]))
        before = np.broadcast_to(direction(axes[2]), after.shape)
        places, gap_wrist = self._circle_plane(second, before, after, np.broadcast_to(direction(axes[0]), after.shape))
        # A point on the first axis is displaced along the intersection line of the planes of both circles.
        along = np.cross(direction(axes[1]), direction(axes[0]))
        along /= np.linalg.norm(along)
        forth = ((places[..., 1, :] - places[..., 0, :]) * along).sum(-1, keepdims=True) >= 0
        side = np.where(forth, 1.0, -1.0) * np.array([-1.0, 1.0])
        near = pga3.distance_point_line(places, first) <= ROOT
        mark = np.where(near[..., None], places + side[..., None] * along, places)
        after = np.broadcast_to(after[..., None, :], mark.shape)
        four = arms.turn_between_points(first, mark, after)
        five = arms.turn_between_points(second, before[..., None, :], arms.turned_point(first, after, -four))
        last = pga3.motor_relative(pga3.motor_product(turns.motion(0, four), turns.motion(1, five)), rest[..., None, :])
        six = _turned(axes[2], last)
        return joined(q, gap, np.stack([four, five, six], -1), gap_wrist)

    def _three(self, chain: Chain, start: Reals, goal: Reals) -> tuple[Reals, Reals]:
        """Return variables of the first three joints, (N, 4, 3), that take points to others."""
        meet = _shoulder(chain)
        second = chain.axes[1]
        if meet is not None:
            x, gap = self._path_sphere(
                chain, 2, start, np.broadcast_to(meet, goal.shape), pga3.distance_points(goal, meet)
            )
            twice = np.broadcast_to(goal[:, None], x.shape)
            y, gap_y = self._path_plane(chain, 0, twice, x, second)
            x = np.broadcast_to(x[:, :, None], y.shape)
        else:
            y, gap = self._path_plane(chain, 0, goal, start, second)
            foot = pga3.project_point_on_line(y, second)
            twice = np.broadcast_to(start[:, None], y.shape)
            x, gap_y = self._path_sphere(chain, 2, twice, foot, pga3.distance_points(y, foot))
            y = np.broadcast_to(y[:, :, None], x.shape)
        one = _amount(chain, 0, y, goal[:, None, None])
        three = _amount(chain, 2, start[:, None, None], x)
        two = arms.turn_between_points(second, x, y)
        q = np.stack([one, two, three], -1).reshape(-1, 4, 3)
        return q, np.minimum(gap[:, None], gap_y).repeat(2, axis=-1)

    def _parallel(self, goals: Reals) -> tuple[Reals, Reals]:
        assert isinstance(self.form, ThreeParallel)
        chain, point = self.form.chain, self.form.point
        axes, along = chain.axes, direction(chain.axes[1])
        goal = pga3.move_point(goals, point)
        y, gap = self._path_plane(chain, 0, goal, np.broadcast_to(point, goal.shape), axes[1])
        one = arms.turn_between_points(axes[0], y, goal[:, None])
        rest = pga3.motor_relative(chain.motion(0, one), goals[:, None])
        # on the unit sphere about the origin: rotations about the last two axes take the direction `before` to `after`
        fifth, sixth = _through_origin(axes[4]), _through_origin(axes[5])
        before = direction(pga3.move_line(pga3.motor_inverse(rest), axes[1]))
        after = np.broadcast_to(along, before.shape)
        x, gap_wrist = self._circle_plane(sixth, before, after, np.broadcast_to(direction(axes[4]), after.shape))
        turned = arms.turn_between_points(sixth, before[..., None, :], x)
        # If the last axis is parallel to the three axes, its angle is free here, but only some values may be feasible
        # for the remaining joints.
        free = pga3.distance_point_line(before, sixth) <= _SMALL
        six = np.where(free[..., None], np.array([0.0, np.pi]), turned)
        five = arms.turn_between_points(fifth, x, after[..., None, :])
        q, gap = joined(one[..., None], gap[:, None].repeat(2, axis=1), np.stack([five, six], -1), gap_wrist)
        tail = pga3.motor_product(chain.motion(4, q[..., 1]), chain.motion(5, q[..., 2]))
        middle = pga3.motor_between_frames(tail, np.repeat(rest, 2, axis=1))
        start = np.broadcast_to(pga3.line_support(axes[3]), (*middle.shape[:-1], 3))
        end = pga3.move_point(middle, start)
        foot = pga3.project_point_on_line(start, axes[1])
        x, gap_elbow = self.geometry.circle_sphere(axes[2], start, foot, pga3.distance_point_line(end, axes[1]))
        three = arms.turn_between_points(axes[2], start[..., None, :], x)
        two = arms.turn_between_points(axes[1], x, end[..., None, :])
        last = pga3.motor_relative(
            pga3.motor_product(chain.motion(1, two), chain.motion(2, three)), middle[..., None, :]
        )
        four = _turned(axes[3], last)
        q, gap = joined(q, gap, np.stack([two, three, four], -1), gap_elbow)
        return q[..., [0, 3, 4, 5, 1, 2]], gap


def _shoulder(chain: Chain) -> Reals | None:
    """Return the intersection point of the first two axes if both joints are revolute, otherwise None."""
    return None if any(chain.slides[:2]) else common_point(chain.axes[:2], chain.size)


def _through_origin(axis: Reals) -> Reals:
    """Return the line through the origin with the direction of another line."""
    return pga3.line_from_direction_moment(direction(axis), np.zeros(3))


def _amount(chain: Chain, joint: int, start: Reals, end: Reals) -> Reals:
    """Return the joint variable that moves one point to another."""
    axis = chain.axes[joint]
    if chain.slides[joint]:
        return pga3.position_along_line(end, axis) - pga3.position_along_line(start, axis)  # type: ignore[no-any-return]
    return arms.turn_between_points(axis, start, end)  # type: ignore[no-any-return]


def _turned(axis: Reals, motion: Reals) -> Reals:
    """Return the angle of a rotation about an axis, measured with a line across the axis."""
    across = pga3.line_from_direction_moment(np.eye(3)[np.argmin(np.abs(direction(axis)))], np.zeros(3))
    return arms.turn_between_lines(axis, across, pga3.move_line(motion, across))  # type: ignore[no-any-return]
