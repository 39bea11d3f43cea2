"""The axis of a joint from the circles on which tracked points run while the joint moves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import body_eye as kernels
from generated import pga3

from ..arguments import Reals, positive_number, real_array
from ..evidence import Noise, Status
from ..precision import CONVERGED, ROUNDING, SQUARED, TINY

_FEWEST = 3
"""Points of a circle that is used."""
_FARTHEST = 1e100
"""Coordinates above this, whose squares overflow, count as not seen."""
_ABOVE_NOISE = 9.0
"""Or the second eigenvalue is below this multiple of the first, which is noise."""
_ROUND = 0.3
"""Tracks are not circles if their residual exceeds this part of the radii."""
_LEAST_CHANGE, _ROUNDING_OF_COST, _DAMPING = 1e-8, 1e-28, 1e-10
"""Parameters of `generated.body_eye.refined_axes`."""


class BodyEyeStatus(Status):
    """Whether tracked points determine an axis, or the pose of an eye on a body."""

    OK = 0
    TOO_FEW = 1
    """No point was seen in three frames."""
    COLLINEAR = 2
    """The points run on parallel lines, or do not move by more than their noise: the joint moves too little."""
    NOT_CIRCLES = 3
    """The points do not run on circles about a common axis: the residual exceeds 0.3 of the radii, or more than half of
    the points were rejected."""
    NOT_CONVERGED = 4
    """The refinement ended before it was stationary."""
    PARALLEL_AXES = 5
    """The axes are parallel: the eye can be anywhere along them."""
    INCONSISTENT = 6
    """The measured axes contradict the angle or the distance of the given ones by more than their noise."""


@dataclass(frozen=True, slots=True, eq=False)
class JointAxis:
    """Result of `joint_axis`."""

    line: Reals
    """(6,) The axis as a unit line of `generated.pga3` in the frame of the eye; the joint rotates positively about it.
    0 if the status is TOO_FEW or COLLINEAR."""
    status: BodyEyeStatus
    residual: float
    """The root mean square distance of the points from the circles, in the unit of length."""
    deviation: Reals
    """(2,) Standard deviations of the direction, in radians, and of the position next to the points, estimated from the
    residual."""
    radii: Reals
    """(n_points,) The radius of each point's circle; NaN for points that were not used."""
    inliers: NDArray[np.bool_]
    """(n_frames, n_points) Which points were used: those that were seen in three frames and not rejected."""


class Tracks(NamedTuple):
    """The finite points of all circles with at least three, one after the other."""

    points: Reals
    information: Reals
    circle: NDArray[np.int64]
    frame: NDArray[np.int64]
    used: NDArray[np.int64]
    """The columns of the tracked points that have a circle."""
    counts: Reals
    scale: float
    """The mean information, by which `information` is divided."""
    n_frames: int
    n_points: int
    noise: Noise
    """The variance that divides `information`: 1 if the caller stated it, otherwise unknown."""

    @property
    def size(self) -> float:
        """The number of points times their mean information: the sum of squares of a residual of 1."""
        return float(self.information[:, [0, 2, 5]].sum() / 3 * self.scale)

    @property
    def freedom(self) -> int:
        """The number of residuals that are left for an axis."""
        return max(2 * len(self.points) - 2 * len(self.counts) - 4, 1)

    @property
    def is_used(self) -> NDArray[np.bool_]:
        """(n_frames, n_points) Which points are here."""
        found = np.zeros((self.n_frames, self.n_points), bool)
        found[self.frame, self.used[self.circle]] = True
        return found

    def subset(self, keep: NDArray[np.bool_]) -> Tracks:
        """Return some of the points, (n,) bool, without circles that have fewer than three of them."""
        counts = np.bincount(self.circle[keep], minlength=len(self.used))
        rows = keep & (counts >= _FEWEST)[self.circle]
        kept = counts >= _FEWEST
        return self._replace(
            points=self.points[rows], information=self.information[rows],
            circle=(np.cumsum(kept) - 1)[self.circle[rows]], frame=self.frame[rows], used=self.used[kept],
            counts=counts[kept].astype(np.float64),
        )  # fmt: skip


def stereo_information(points: ArrayLike, focal_length: float, baseline: float, pixel: float = 1.0) -> Reals:
    """Return the inverse covariances of points that a rectified stereo camera measures.

    Parameters
    ----------
    points : array_like, (..., 3)
        Places in the frame of the left camera, with z along the optical axis and x towards the right camera.
    focal_length : float
        In pixels.
    baseline : float
        The distance of the cameras, in the unit of length.
    pixel : float
        The standard deviation of image coordinates, in pixels: independent and equal for x in both images, and for the
        mean of y.

    Returns
    -------
    array, (..., 3, 3)
        NaN for points that are not in front of the cameras.

    Raises
    ------
    TypeError, ValueError
        If a number is not positive, or the points are not (..., 3) real numbers.
    """
    positive_number(baseline, "baseline")
    x, y, z = np.moveaxis(real_array(points, "points", (3,), "points").astype(np.float64), -1, 0)
    z = np.where(z > 0, z, np.nan)
    nothing, f = np.zeros_like(z), positive_number(focal_length, "focal_length") / positive_number(pixel, "pixel")
    with np.errstate(all="ignore"):
        left = np.stack([f / z, nothing, -f * x / z**2], -1)
        right = np.stack([f / z, nothing, -f * (x - baseline) / z**2], -1)
        row = np.sqrt(2.0) * np.stack([nothing, f / z, -f * y / z**2], -1)
    return np.asarray(sum(each[..., :, None] * each[..., None, :] for each in (left, right, row)))


class Fit(NamedTuple):
    """Lines moved to circles as one rigid body."""

    motor: Reals
    status: BodyEyeStatus
    residual: float
    normal: Reals
    """The normal matrix, divided by the variance of the residual."""
    radii: Reals


def tracks_of(points: ArrayLike, information: ArrayLike | None) -> Tracks:
    """Return the finite points of all circles with at least three."""
    given = real_array(points, "points", (-1, -1, 3), "frames, points and coordinates").astype(np.float64, copy=False)
    if given.ndim != 3:
        raise ValueError(f"points: shape {given.shape}; expected (n_frames, n_points, 3)")
    by_point = given.transpose(1, 0, 2)
    seen = np.asarray((np.abs(by_point) <= _FARTHEST).all(-1))
    weights = None
    if information is not None:
        matrices = real_array(information, "information", (*given.shape, 3), "inverse covariances").astype(np.float64)
        weights = matrices.transpose(1, 0, 2, 3)[..., [0, 1, 1, 2, 2, 2], [0, 0, 1, 0, 1, 2]]
        seen &= np.isfinite(weights).all(-1) & (weights[..., [0, 2, 5]] > 0).all(-1)
    counts = seen.sum(1)
    used = np.flatnonzero(counts >= _FEWEST)
    seen = seen[used]
    counts = counts[used]
    circle = np.repeat(np.arange(len(used)), counts)
    frame = np.nonzero(seen)[1]
    places = np.ascontiguousarray(by_point[used][seen])
    if weights is None:
        own, scale = np.tile([1.0, 0.0, 1.0, 0.0, 0.0, 1.0], (len(places), 1)), 1.0
    else:
        own = weights[used][seen]
        scale = float(own[:, [0, 2, 5]].mean()) if len(own) else 1.0
        own = np.ascontiguousarray(own / (scale if scale > 0 else 1.0))
    noise = Noise(0.0, 0.0) if information is None else Noise(1.0)
    n_frames, n_points = given.shape[:2]
    return Tracks(places, own, circle, frame, used, counts.astype(np.float64), scale, n_frames, n_points, noise)


def axis_of(tracks: Tracks, angles: ArrayLike | None, refine: bool) -> JointAxis:
    """Return the result of `joint_axis` for tracks."""
    status, line = first_axis(tracks)
    radii = np.full(tracks.n_points, np.nan)
    if status != BodyEyeStatus.OK:
        return JointAxis(line, status, 0.0, np.full(2, np.inf), radii, tracks.is_used)
    fit = refined([tracks], line[None], np.eye(8)[0], refine)
    line = _directed(np.asarray(pga3.move_line(fit.motor, line)), tracks, angles)
    radii[tracks.used] = fit.radii
    return JointAxis(line, fit.status, fit.residual, _deviation(fit, tracks, line), radii, tracks.is_used)


def first_axis(tracks: Tracks) -> tuple[BodyEyeStatus, Reals]:
    """Return the unrefined axis: the line nearest to all bisector planes, 0 if points do not determine it."""
    none = np.zeros(6)
    if not len(tracks.used):
        return BodyEyeStatus.TOO_FEW, none
    centre = tracks.points.mean(0)
    line, values, size = kernels.axis_of_circles(tracks.points, tracks.circle, tracks.counts, centre)
    noise, second, largest = values
    flat = second <= max(ROUNDING * largest, _ABOVE_NOISE * noise)
    still = largest <= SQUARED * len(tracks.points) * (size + (centre**2).sum())
    if flat or still or not np.isfinite(line).all():
        return BodyEyeStatus.COLLINEAR, none
    return BodyEyeStatus.OK, np.asarray(line)


def refined(parts: list[Tracks], lines: Reals, start: Reals, refine: bool = True) -> Fit:
    """Move one line (6,) for each part, all by the same motor, to the axes of the circles of the parts."""
    scale = max(part.scale for part in parts)
    """One common unit of information for all parts."""
    if len(parts) == 1:
        joined, information, circle = parts[0].points, parts[0].information, parts[0].circle
        each_line = np.repeat(lines, len(parts[0].used), 0)
    else:
        joined = np.concatenate([part.points for part in parts])
        information = np.concatenate([part.information * (part.scale / scale) for part in parts])
        shifts = np.cumsum([0, *(len(part.used) for part in parts)])
        circle = np.concatenate([part.circle + shift for part, shift in zip(parts, shifts, strict=False)])
        each_line = np.repeat(lines, [len(part.used) for part in parts], 0)
    # Without refinement, the steps still give the residual.
    free = np.ones(6) if refine else np.zeros(6)
    motor, sums, radii, _, converged = kernels.refined_axes(
        joined, information, circle, each_line, start, free, _LEAST_CHANGE, _ROUNDING_OF_COST, _DAMPING
    )
    normal, cost = sums[:6, :6], sums[6, 6]
    count = len(joined)
    residual = float(np.sqrt(max(float(cost), 0.0) / (information[:, [0, 2, 5]].mean() * count)))
    freedom = max(2 * count - 2 * len(radii) - (4 if len(parts) == 1 else 6), 1)
    variance = max(float(parts[0].noise.raised(cost * scale, freedom)) / scale, TINY)
    status = BodyEyeStatus.OK if converged > 0 else BodyEyeStatus.NOT_CONVERGED
    if not np.isfinite(motor).all() or not residual <= _ROUND * float(np.sqrt(np.mean(np.square(radii)))):
        status = BodyEyeStatus.NOT_CIRCLES
    return Fit(np.asarray(motor), status, residual, np.asarray(normal) / variance, np.asarray(radii))


def _directed(line: Reals, tracks: Tracks, angles: ArrayLike | None) -> Reals:
    """Return the line with the direction about which the joint rotates positively: fixed points rotate oppositely."""
    order = np.arange(tracks.n_frames, dtype=np.float64)
    if angles is not None:
        order = real_array(angles, "angles", (tracks.n_frames,), "readings").astype(np.float64)
    direction = pga3.line_to_direction_moment(line)[0]
    arms = tracks.points - pga3.line_support(line)
    follow = np.flatnonzero(np.diff(tracks.circle) == 0)
    swept = ((arms[follow] @ _cross_matrix(direction)) * -arms[follow + 1]).sum(1)
    moved = order[tracks.frame[follow + 1]] - order[tracks.frame[follow]]
    return -line if float(np.nansum(swept * np.sign(moved))) > 0 else line


def _deviation(fit: Fit, tracks: Tracks, line: Reals) -> Reals:
    """Return the standard deviations of a line's direction and of its position next to the points."""
    direction = pga3.line_to_direction_moment(line)[0]
    centre = pga3.project_point_on_unit_line(tracks.points.mean(0), line)
    # The twists of the kernel are e12 e13 e23 e01 e02 e03: angular velocities z, -y, x, and velocities of the origin.
    from_velocities = np.zeros((6, 6))
    from_velocities[[0, 1, 2], [2, 1, 0]] = 1.0, -1.0, 1.0
    from_velocities[3:, :3] = _cross_matrix(centre)
    from_velocities[3:, 3:] = np.eye(3)
    # Turns about the axis and shifts along it are undetermined.
    values, vectors = np.linalg.eigh(from_velocities.T @ fit.normal @ from_velocities)
    known = values > CONVERGED * values[-1]
    spread = vectors[:, known] / np.sqrt(values[known])
    return np.sqrt([(part**2).sum() - ((direction @ part) ** 2).sum() for part in (spread[:3], spread[3:])])


def _cross_matrix(v: Reals) -> Reals:
    """Return the matrix of the cross product with a vector from the left."""
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
