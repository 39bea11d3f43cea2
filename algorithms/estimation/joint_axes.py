"""The axis of a joint from tracked points, some of which may be wrong."""

from __future__ import annotations

from dataclasses import replace

from numpy.typing import ArrayLike

from ..arguments import finite_number
from .circles_of_points import BodyEyeStatus, JointAxis, Tracks, axis_of, tracks_of
from .robust_circles import LEAST_SHARE, noise_threshold, without_wrong_points


def joint_axis(
    points: ArrayLike,
    angles: ArrayLike | None = None,
    information: ArrayLike | None = None,
    refine: bool = True,
    threshold: float | None = None,
    seed: int = 0,
) -> JointAxis:
    """Estimate the axis of a rotating joint in the frame of an eye that it carries.

    The eye sees fixed points while only this joint moves, so that they run on circles about the joint's axis. The
    bisector planes of all pairs of points of a circle contain the axis; the start is the line nearest to all of them.
    Gauss-Newton steps then minimise the squared distances of the points from their circles, which all have this axis.

    Parameters
    ----------
    points : array_like, (n_frames, n_points, 3)
        Places of points in the frame of the eye, NaN where a point was not seen.
    angles : array_like, (n_frames,), optional
        Readings of the joint, of which only the order matters: the result is directed so that the joint rotates
        positively about it. By default angles increase from frame to frame.
    information : array_like, (n_frames, n_points, 3, 3), optional
        Inverse covariances of the points, for instance by `stereo_information`. Points are left out if theirs is not
        finite, or has a diagonal that is not positive. By default all points have the same isotropic noise.
    refine : bool
        Whether to refine the line nearest to the bisector planes.
    threshold : float, optional
        Points that are farther than this from their circles are rejected, and tracks of which most points are: in the
        unit of length, or in standard deviations if `information` is given. By default points are rejected if their
        distances contradict the noise: the stated one, or that of most of the points.
    seed : int, optional
        Of the random samples by which wrong points are found.

    Returns
    -------
    JointAxis

    Raises
    ------
    TypeError, ValueError
        If an argument has a different shape or type.
    """
    return axis_and_tracks(points, angles, information, refine, threshold, seed)[0]


def axis_and_tracks(
    points: ArrayLike,
    angles: ArrayLike | None,
    information: ArrayLike | None,
    refine: bool,
    threshold: float | None,
    seed: int,
) -> tuple[JointAxis, Tracks]:
    """Return the result of `joint_axis`, and the points that were used."""
    tracks = tracks_of(points, information)
    if threshold is None:
        found = axis_of(tracks, angles, refine)
        threshold = noise_threshold(found.line, tracks, seed)
        if threshold is None:
            return found, tracks
    elif not finite_number(threshold, "threshold") > 0:
        raise ValueError(f"threshold: {threshold}; expected a positive number")
    kept = without_wrong_points(tracks, threshold, seed)
    found = axis_of(kept, angles, refine)
    if found.status == BodyEyeStatus.OK and len(kept.points) < LEAST_SHARE * len(tracks.points):
        found = replace(found, status=BodyEyeStatus.NOT_CIRCLES)
    return found, kept
