"""Body-eye calibration: the pose of an eye on a pan-tilt head, from points that it tracks while each joint moves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from generated import pga3, vga3

from ..arguments import Reals, real_array
from ..evidence import largest_ratio
from .circles_of_points import BodyEyeStatus, JointAxis, Tracks, refined
from .joint_axes import axis_and_tracks

_PARALLEL = 1e-6
"""Axes are parallel if the sine of their angle is below this,"""
_UNCERTAIN = 3.0
"""or below this multiple of its standard deviation."""
_ROUNDING = 1e-11
"""From floating point: distances below this fraction of the coordinates of points and axes are rounding errors."""


@dataclass(frozen=True, slots=True, eq=False)
class BodyEye:
    """Result of `body_eye`: the chain of a pan-tilt head that carries an eye."""

    motor: Reals
    """(8,) The motor from the frame of the eye to that of the body, with both joints at 0. If the axes are parallel,
    one of the solutions; the identity if an axis is unknown."""
    status: BodyEyeStatus
    pan: JointAxis
    """The axis of the first joint in the frame of the eye."""
    tilt: JointAxis
    """The axis of the second joint in the frame of the eye."""
    axes: Reals
    """(2, 6) The axes in the frame of the body: those given, or those of the frame that the measured axes define."""
    residual: float
    """The root mean square distance of all points from their circles about the axes of the chain."""
    distance: float
    """The measured distance of the axes."""
    angle: float
    """The measured angle of the axes, in [0, pi]."""

    def pose(self, q: ArrayLike) -> Reals:
        """Return the motors (..., 8) from the frame of the eye to that of the body, for joint angles (..., 2)."""
        angles = real_array(q, "q", (2,), "pan and tilt")
        turns = [pga3.motor_from_line(axis, angles[..., k]) for k, axis in enumerate(self.axes)]
        return np.asarray(pga3.motor_product(pga3.motor_product(*turns), self.motor))

    def locate(self, q: ArrayLike, points: ArrayLike) -> Reals:
        """Return points (..., 3) of the eye in the frame of the body, for joint angles (..., 2)."""
        return np.asarray(pga3.move_point(self.pose(q), real_array(points, "points", (3,), "points")))


def body_eye(
    pan: ArrayLike,
    tilt: ArrayLike,
    axes: ArrayLike | None = None,
    pan_angles: ArrayLike | None = None,
    tilt_angles: ArrayLike | None = None,
    pan_information: ArrayLike | None = None,
    tilt_information: ArrayLike | None = None,
    refine: bool = True,
    threshold: float | None = None,
    seed: int = 0,
) -> BodyEye:
    """Calibrate an eye on a pan-tilt head by the circles of points that it tracks while one joint moves at a time.

    Each axis is that of `joint_axis`. The motor that moves both axes from the frame of the eye to the design axes in
    the frame of the body is the pose of the eye. It is then refined on all circles of both joints at once, so that the
    axes have exactly the angle and the distance of the design.

    Parameters
    ----------
    pan : array_like, (n_frames, n_points, 3)
        Places of fixed points in the frame of the eye while the first joint moves and the second is at 0; NaN where a
        point was not seen.
    tilt : array_like, (m_frames, m_points, 3)
        Places while the second joint moves. The angle of the first is arbitrary but constant.
    axes : array_like, (2, 6), optional
        The axes of both joints in the frame of the body, as lines of `generated.pga3`. By default the measured axes
        define this frame: z is along the first axis, the origin is its point next to the second axis, and the second
        axis is parallel to the plane of y and z, with a positive component along y (the simplified method, which needs
        no design).
    pan_angles, tilt_angles : array_like, (n_frames,) and (m_frames,), optional
        Readings of the joints; see `joint_axis`.
    pan_information, tilt_information : array_like, (..., 3, 3), optional
        Inverse covariances of the points.
    refine : bool
        Whether to refine axes and pose.
    threshold : float, optional
        Points and tracks that do not agree with their axis are rejected, see `joint_axis`. Which points were used is in
        ``pan.inliers`` and ``tilt.inliers`` of the result.
    seed : int, optional
        Of the random samples by which wrong points are found.

    Returns
    -------
    BodyEye
        The status is INCONSISTENT if the given axes have another angle or distance than the measured ones.

    Raises
    ------
    TypeError, ValueError
        If an argument has a different shape or type, or if the given axes are not lines.
    """
    design = None
    if axes is not None:
        design = np.asarray(pga3.normalize_line(real_array(axes, "axes", (2, 6), "lines").astype(np.float64)))
        if not np.isfinite(design).all():
            raise ValueError("axes: not lines with a direction; expected two lines of generated.pga3")
    first, pan_tracks = axis_and_tracks(pan, pan_angles, pan_information, refine, threshold, seed)
    second, tilt_tracks = axis_and_tracks(tilt, tilt_angles, tilt_information, refine, threshold, seed)
    parts = [pan_tracks, tilt_tracks]
    found = first, second
    worst = next((each.status for each in found if each.status != BodyEyeStatus.OK), BodyEyeStatus.OK)
    lines = np.stack([each.line for each in found])
    if not lines.any(1).all():
        nothing = np.eye(8)[0]
        return BodyEye(nothing, worst, first, second, np.zeros((2, 6)) if design is None else design, 0.0, 0.0, 0.0)
    angle, distance = float(pga3.angle_between_lines(*lines)), float(pga3.distance_lines(*lines))
    uncertain = _UNCERTAIN * float(np.hypot(*(each.deviation[0] for each in found)))
    if worst == BodyEyeStatus.OK and np.sin(angle) <= max(_PARALLEL, uncertain):
        worst = BodyEyeStatus.PARALLEL_AXES
    if design is None:
        motor = _frame_of(lines)
        residual = float(np.sqrt(sum(each.residual**2 for each in found) / 2))
        moved = np.asarray(pga3.move_line(motor, lines))
        return BodyEye(motor, worst, first, second, moved, residual, distance, angle)
    to_eye = pga3.motor_product(pga3.motor_inverse(_frame_of(lines)), _frame_of(design))
    fit = refined(parts, design, np.asarray(to_eye), refine)
    if worst == BodyEyeStatus.OK:
        worst = fit.status
    if worst == BodyEyeStatus.OK and _contradicted(fit.residual, found, parts):
        worst = BodyEyeStatus.INCONSISTENT
    motor = np.asarray(pga3.motor_inverse(fit.motor))
    return BodyEye(motor, worst, first, second, design, fit.residual, distance, angle)


def _contradicted(residual: float, found: tuple[JointAxis, JointAxis], parts: list[Tracks]) -> bool:
    """Return whether axes with the angle and the distance of the design leave more than free ones, by their noise."""
    free = sum(axis.residual**2 * part.size for axis, part in zip(found, parts, strict=True))
    more = residual**2 * sum(part.size for part in parts) - free
    freedom = sum(part.freedom for part in parts)
    noise = parts[0].noise
    rounding = sum(part.size * (_ROUNDING * float(np.abs(part.points).max())) ** 2 for part in parts)
    return bool(
        more > rounding + 2 * largest_ratio(2, noise.weight + freedom) * noise.raised(np.asarray(free), freedom)
    )


def _frame_of(lines: Reals) -> Reals:
    """Return the motor from the frame of two lines to the frame that they define."""
    origin, _ = pga3.closest_points_of_lines(*lines)
    pan, tilt = (pga3.line_to_direction_moment(line)[0] for line in lines)
    # Either axis of coordinates that is not parallel to both lines will do if the lines are parallel.
    across = next(each for each in (tilt, *np.eye(3)) if abs(each @ pan) < 1 - _PARALLEL**2 / 2)
    across = np.asarray(vga3.cross_product(across, pan))
    across /= np.sqrt(across @ across)
    plane = pga3.plane_from_point_normal(origin, pan)
    flag = pga3.motor_from_flag(origin, pga3.join_point_direction(origin, across), plane)
    return np.asarray(pga3.motor_inverse(flag))
