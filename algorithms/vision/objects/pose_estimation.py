"""Poses of objects from points, straight edges and silhouettes in one or more images, verified before they are OK."""

from __future__ import annotations

from collections.abc import Sequence
from math import radians

from numpy.typing import ArrayLike

from generated import pga3

from ...arguments import Reals, finite_number
from ...elements import MOTOR, elements
from .image_arguments import checked_start
from .pose_judgement import judged, no_pose
from .pose_minima import PoseTask, groups_of_minima, minima
from .pose_models import EXACT, Measurements, ObjectModel, SharedErrors, View, measurements
from .pose_record import PoseEstimate as PoseEstimate
from .pose_status import PoseStatus

_TURN_LIMIT, _SHIFT_LIMIT = radians(0.2), 1 / 125
"""The largest bounds of errors of a pose that is OK: in radians, and in sizes of the model."""
_MORE = 2.0
"""From a probability: if the stated noise is as certain as by four residuals, one in eleven is more than twice it."""
_RETRIED = (PoseStatus.INCONSISTENT, PoseStatus.NOT_CONVERGED, PoseStatus.BEHIND_CAMERA)
"""The statuses after which other initial poses are tried."""


@elements(start=MOTOR)
def estimate_pose(
    model: ObjectModel,
    views: View | Sequence[View],
    start: ArrayLike | None = None,
    noise: float = 0.3,
    tolerance: tuple[float, float] | None = None,
    shared: SharedErrors | None = None,
) -> PoseEstimate:
    """Estimate the pose of an object from one or more images of it.

    Levenberg-Marquardt steps on motors minimise the distances in pixels between measurements and the images of the
    elements of the model, with robust weights (Geman and McClure). Without `start`, or if the descent from it finds no
    pose that explains the images, they begin at poses in closed form: from four or more points, or from the places and
    directions of spheres and cylinders. Other minima are searched from reversed and turned poses.

    Parameters
    ----------
    model : ObjectModel
    views : View or sequence of View
        The cameras, and the pixels at which they see the elements.
    start : array_like, (8,), optional
        A pose near the true one, such as that of the preceding image.
    noise : float
        The standard deviation of a pixel's coordinate, as certain as by four residuals. Larger residuals raise it, and
        with it the bounds; if they are too large for it, twice as much is tried, and more is INCONSISTENT.
    tolerance : (float, float), optional
        The largest `bounds` of the errors for which the status is OK: of the rotation, in radians, and of the
        displacement of the model's centre. By default 0.2 degrees, and the size of the model divided by 125, which is
        half a millimetre for a box of 5 x 7 x 9 centimetres.
    shared : SharedErrors, optional
        How well the focal length, the distortion of the lenses and the extents of the object are known: the bounds
        include what such errors change. By default all are exact, and one camera rarely shows that they are not.

    Returns
    -------
    PoseEstimate
        The status OK guarantees a minimum with residuals that the noise explains, all elements in front of the cameras,
        no motion that leaves the images as they are, no second pose that was found to be as good, distances that show
        no other focal length, distortion or size of the object, and errors below the tolerance with a probability of at
        least 0.999 each. SYMMETRIC guarantees the same up to motions that change no image. For every other status,
        `PoseStatus` states the cause.

    Raises
    ------
    TypeError, ValueError
        If shapes or types disagree, there is no view, `noise` is not positive, `start` is not a motor, or `tolerance`
        is not two positive numbers.
    """
    found = estimated_pose(model, views, start, noise, tolerance, True, shared)
    if found.status == PoseStatus.INCONSISTENT:
        return estimated_pose(model, views, start, _MORE * noise, tolerance, True, shared)
    return found


def estimated_pose(
    model: ObjectModel,
    views: View | Sequence[View],
    start: ArrayLike | None,
    noise: float,
    tolerance: tuple[float, float] | None = None,
    is_independent: bool = False,
    shared: SharedErrors | None = None,
) -> PoseEstimate:
    """Return the pose of `estimate_pose` for one standard deviation of pixels, which is not tried again with more.

    Only if errors of pixels are independent, other cameras and sizes of the object are tested.
    """
    seen = measurements(model, (views,) if isinstance(views, View) else tuple(views))
    if not finite_number(noise, "noise") > 0:
        raise ValueError(f"noise: {noise}; expected a positive number of pixels")
    limits = pose_limits(model, tolerance)
    guess = None if start is None else checked_start(start)
    if not seen.is_finite:
        return no_pose(PoseStatus.NOT_FINITE, seen)
    if seen.n_equations < 6:
        return no_pose(_why_too_few(model, seen, guess), seen)
    task = PoseTask(model, seen, noise, limits, is_independent, shared or EXACT)
    if guess is not None:
        found = judged(minima(guess[None], task), task)
        if found.status not in _RETRIED:
            return found
    for group in groups_of_minima(task):
        found = judged(group, task)
        if found.status not in _RETRIED:
            break
    return found


def pose_limits(model: ObjectModel, tolerance: tuple[float, float] | None) -> tuple[float, float]:
    """Return the largest bounds of errors of a pose that is OK: a tolerance after a check, or the default."""
    if tolerance is None:
        return _TURN_LIMIT, _SHIFT_LIMIT * model.size
    if len(tolerance) != 2:
        raise ValueError(f"tolerance: {len(tolerance)} numbers; expected two positive numbers, an angle and a length")
    turn, shift = (finite_number(each, "tolerance") for each in tolerance)
    if not (turn > 0 and shift > 0):
        raise ValueError(f"tolerance: {tolerance}; expected two positive numbers, an angle and a length")
    return turn, shift


def _why_too_few(model: ObjectModel, seen: Measurements, guess: Reals | None) -> PoseStatus:
    """Return why there are too few measurements."""
    if guess is not None:
        there = pga3.move_point(guess, model.centre)
        if not all(camera.depth(there) > 0 for camera in seen.cameras):
            return PoseStatus.BEHIND_CAMERA
    return PoseStatus.OCCLUDED if seen.n_equations + 2 * seen.n_missing >= 6 else PoseStatus.TOO_FEW
