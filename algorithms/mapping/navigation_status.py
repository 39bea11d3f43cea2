"""Statuses of floor plans, poses, fitted objects, paths and controllers."""

from __future__ import annotations

from ..evidence import Status


class PlanStatus(Status):
    """Whether a pose in a floor plan can be simulated."""

    OK = 0
    EMPTY = 1
    """The plan has no wall; nothing is hit."""
    WITHIN_WALL = 2
    """The pose is within a wall; nothing was measured."""
    NOT_FINITE = 3
    """The pose is not finite; nothing was measured."""


class LocalizationStatus(Status):
    """Whether the pose of a robot in a map is known."""

    OK = 0
    PREDICTED = 1
    """No measured line agrees with the map; the pose is the prediction."""
    UNOBSERVED = 2
    """The lines so far leave some direction undetermined; the prior alone fixes it."""
    INCONSISTENT = 3
    """The lines were used, but their innovations are far larger than the covariance permits."""
    LOST = 4
    """Most of what was measured recently does not agree with the map."""
    RELOCATED = 5
    """The robot was lost, and the pose was found again without the prediction."""
    NOT_FINITE = 6
    """The motion or its covariance is not finite; nothing was predicted."""


class FitStatus(Status):
    """Whether points determine an object."""

    OK = 0
    TOO_FEW = 1
    """There are too few finite points, or too few that agree."""
    DEGENERATE = 2
    """The points do not determine the object, for example a circle by points on a line."""
    NOT_CONVERGED = 3
    UNEXPLAINED = 4
    """Points at random would have as many points near some object, or the points contradict the object."""


class PathStatus(Status):
    """Whether pieces are a path."""

    OK = 0
    EMPTY = 1
    """The path has no piece, or no length."""
    ZERO_RADIUS = 2
    """An arc has the radius 0."""
    NOT_FINITE = 3


class FollowStatus(Status):
    """What a robot that follows a path does."""

    OK = 0
    SATURATED = 1
    """The curvature is limited; the distance from the path may increase."""
    SLOWED = 2
    """An obstacle on the path ahead limits the speed."""
    BLOCKED = 3
    """The robot stands in front of an obstacle on the path."""
    ARRIVED = 4
    """The robot is at the end of the path."""
    OFF_PATH = 5
    """The robot is farther from the path than permitted, and stands."""
    NO_PATH = 6
    """The path is not usable, see its status; the robot stands."""
    NOT_FINITE = 7
    """The pose is not finite; the robot stands."""
