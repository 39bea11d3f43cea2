"""Grasping guided by two uncalibrated cameras: parallel orienting, centring, grasping and holding (section 14.6)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import isfinite, sqrt
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generated import visual_grasping as kernels

from ...arguments import Reals, finite_number, real_array
from .status import GraspStage, VisualStatus

N_MARKS, N_POINTS, N_ERRORS = 4, 12, 7
"""Marks of the hand, marks with corners of the box, and errors, in an image."""
_ROWS = {
    GraspStage.ORIENTING: [0, 1, 2],
    GraspStage.CENTRING: [0, 1, 2, 3],
    GraspStage.GRASPING: [0, 1, 2, 4, 5, 6],
    GraspStage.HOLDING: [0, 1, 2, 4, 5, 6],
}
_FLAT = 1e-3
"""Convexity, relative to squared sides, below which a face counts as seen from the side."""
_CROSSED = 0.02
"""Negative convexity that noise does not give to a hand seen from the side."""
_SINGULAR = 0.01
"""The least ratio of the responses to the worst and the best motion."""
_NO_MOTION = np.zeros(6)
"""The motion of a hand at rest."""


def _weights() -> dict[GraspStage, Reals]:
    found = {}
    for stage, rows in _ROWS.items():
        one = np.zeros(N_ERRORS)
        one[rows] = 1
        found[stage] = np.tile(one, 2)
    return found


_WEIGHTS = _weights()
_INDICES = {stage: np.flatnonzero(weights) for stage, weights in _WEIGHTS.items()}


@dataclass(frozen=True)
class GraspSettings:
    """Parameters of guided grasps.

    Parameters
    ----------
    lever : float
        Length in metres by which rotations are multiplied to compare them with translations; about half the size of
        the box.
    probe : float
        Length of the motions by which derivatives are estimated, in metres.
    largest : float
        Length of the largest motion of a step, in metres.
    coarse : float
        The errors in pixels, as root mean square, at which orienting and centring end.
    noise : float
        Standard deviation of image points in pixels.
    fine : float
        The largest error of a grasp without noise, in pixels.
    frames : int
        Number of images of the resting hand that are averaged while holding. Without noise, there is no averaging.
    rounds : int
        Number of corrections by averaged images.
    at_most : int
        Maximum number of motions.

    Raises
    ------
    TypeError
        If a length, an error or the noise is not a number.
    ValueError
        If a parameter is not positive (`noise` may be 0), or not finite.
    """

    lever: float = 0.05
    probe: float = 0.008
    largest: float = 0.02
    coarse: float = 4.0
    noise: float = 0.0
    fine: float = 1e-8
    frames: int = 640
    rounds: int = 7
    at_most: int = 200

    def __post_init__(self) -> None:
        for name in ("lever", "probe", "largest", "coarse", "fine"):
            if finite_number(getattr(self, name), name) <= 0:
                raise ValueError(f"{name}: {getattr(self, name)}; expected a positive number")
        if finite_number(self.noise, "noise") < 0:
            raise ValueError(f"noise: {self.noise}; expected a number of pixels of at least 0")
        for name in ("frames", "rounds", "at_most"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 1:
                raise ValueError(f"{name}: {value!r}; expected a positive integer")
            object.__setattr__(self, name, int(value))


@dataclass(frozen=True, eq=False)
class VisualErrors:
    """Errors of a grasp in two images.

    Attributes
    ----------
    rows : array, (2, 7)
        For each image three errors of orienting, one of centring, and three of grasping, in pixels.
    ratio : array, (2,)
        The distance of the centres of the faces between the fingers, divided by that of the tips.
    status : VisualStatus
    image, point : int
        Where the status is LOST_FEATURE: the first such image and point; otherwise -1.
    upright : bool
        Whether the bases of the fingers are on the side of the end 1 of the third axis.
    """

    rows: Reals
    ratio: Reals
    status: VisualStatus
    image: int = -1
    point: int = -1
    upright: bool = True


@dataclass(frozen=True, eq=False)
class GraspState:
    """What a guided grasp knows after some steps; the initial state has no arguments.

    Attributes
    ----------
    stage : GraspStage
    steps : int
        Number of motions and probes so far.
    jacobian : array, (14, 6)
        Estimated derivatives of the errors by rotations, times the lever, and by translations.
    previous : array, (14,)
        The errors before the last motion.
    motion : array, (6,)
        The last motion, with rotations multiplied by the lever.
    probe : int
        The number of probes so far.
    least : float
        The least error of the stage.
    worse : int
        Number of steps since then.
    corners : array, (2, 8, 2)
        Sums of the corners of the box in all images.
    images : int
        The number of all images.
    marks : array, (2, 4, 2)
        Sums of the marks of the resting hand.
    frames, rounds : int
        The number of images of the resting hand, and of corrections by them.
    """

    stage: GraspStage = GraspStage.PROBING
    steps: int = 0
    jacobian: Reals = field(default_factory=lambda: np.zeros((2 * N_ERRORS, 6)))
    previous: Reals = field(default_factory=lambda: np.zeros(2 * N_ERRORS))
    motion: Reals = field(default_factory=lambda: np.zeros(6))
    probe: int = 0
    least: float = np.inf
    worse: int = 0
    corners: Reals = field(default_factory=lambda: np.zeros((2, N_POINTS - N_MARKS, 2)))
    images: int = 0
    marks: Reals = field(default_factory=lambda: np.zeros((2, N_MARKS, 2)))
    frames: int = 0
    rounds: int = 0


@dataclass(frozen=True, eq=False)
class GraspStep:
    """A step of a guided grasp.

    Attributes
    ----------
    state : GraspState
        For the next step.
    motion : array, (6,)
        What the hand has to do: turn about its own origin by a rotation vector, in radians, and move by a translation,
        in metres, both along the axes of the base of the robot.
    closing : float
        What the opening of the fingers has to be multiplied by.
    error : float
        The root mean square of the errors of the stage, in pixels.
    status : VisualStatus
    """

    state: GraspState
    motion: Reals
    closing: float
    error: float
    status: VisualStatus


def visual_error(images: ArrayLike) -> VisualErrors:
    """Compute the errors of a grasp in two images.

    Parameters
    ----------
    images : array_like, (2, 12, 2)
        Pixels of the tips of both fingers, the bases of both, and the corners of the box, of which corner
        ``4 i + 2 j + k`` is at the ends i, j, k of its axes. The fingers are to close along the first axis, coming from
        the end 1 of the third. A missing point is NaN.

    Returns
    -------
    VisualErrors

    Raises
    ------
    TypeError
        If the pixels are not real numbers.
    ValueError
        If the shape is another one.
    """
    points = real_array(images, "images", (2, N_POINTS, 2), "pixels of 12 points in two images").astype(float)
    if points.ndim != 3:
        raise ValueError(f"images: shape {points.shape}; expected (2, {N_POINTS}, 2)")
    rows, ratio, flat, ahead = kernels.errors_of_image(points)
    return _judged(points, rows, ratio, flat, ahead)


def _judged(points: Reals, rows: Reals, ratio: Reals, flat: Reals, ahead: Reals) -> VisualErrors:
    status = VisualStatus.OK
    least, clear, hand = (min(pair) for pair in zip(*flat.tolist(), strict=True))
    if not isfinite(rows.sum()):
        lost = np.argwhere(~np.isfinite(points).all(-1))
        if len(lost):
            return VisualErrors(rows, ratio, VisualStatus.LOST_FEATURE, int(lost[0, 0]), int(lost[0, 1]))
        status = VisualStatus.DEGENERATE_VIEW
    elif least < -_FLAT or hand < -_CROSSED:
        status = VisualStatus.BEHIND_CAMERA
    elif clear < _FLAT:
        status = VisualStatus.DEGENERATE_VIEW
    return VisualErrors(rows, ratio, status, upright=min(ahead.tolist()) > 0)


def grasp_step(
    state: GraspState,
    images: ArrayLike,
    settings: GraspSettings | None = None,
    reachable: Callable[[NDArray[Any]], bool] | None = None,
) -> GraspStep:
    """Compute the next motion of a hand from the images after the last one.

    The cameras are not calibrated, and neither are their places nor that of the robot known. Six small motions give
    the derivatives of the errors, which each further motion corrects.

    Parameters
    ----------
    state : GraspState
        The state of the previous step, or ``GraspState()``.
    images : array_like, (2, 12, 2)
        As for `visual_error`.
    settings : GraspSettings, optional
    reachable : callable, optional
        Whether the robot can carry out a motion (6,), as in `GraspStep`.

    Returns
    -------
    GraspStep
        With a status other than OK, the motion is 0, and the step can be repeated with the state and other images.

    Raises
    ------
    TypeError, ValueError
        As for `visual_error`, and if `state` or `settings` has another type.
    """
    if not isinstance(state, GraspState) or not isinstance(settings, (GraspSettings, type(None))):
        raise TypeError(
            f"state: {type(state).__name__}, settings: {type(settings).__name__}; expected GraspState, GraspSettings"
        )
    own = _DEFAULT if settings is None else settings
    found = visual_error(images)
    if found.status is not VisualStatus.OK:
        return _resting(state, found.status)
    if state.stage is GraspStage.DONE:
        return _resting(state, VisualStatus.OK)
    if state.steps >= own.at_most:
        return _resting(state, VisualStatus.NOT_CONVERGED)
    errors, points = found.rows.reshape(-1), np.asarray(images, float)
    seen = replace(state, corners=state.corners + points[:, N_MARKS:], images=state.images + 1)
    if state.stage is GraspStage.PROBING:
        step = _probe(seen, errors, own)
    elif state.stage is GraspStage.HOLDING:
        step = _hold(seen, points, found, own)
    else:
        step = _approach(seen, errors, own)
    if reachable is not None and step.status is VisualStatus.OK and step.motion.any() and not reachable(step.motion):
        return _resting(state, VisualStatus.OUT_OF_REACH)
    return step


_DEFAULT = GraspSettings()


def _resting(state: GraspState, status: VisualStatus) -> GraspStep:
    return GraspStep(state, _NO_MOTION, 1.0, np.nan, status)


def _moving(state: GraspState, motion: Reals, error: float, settings: GraspSettings) -> GraspStep:
    """Return a step with a motion whose rotations are multiplied by the lever."""
    own = np.concatenate([motion[:3] / settings.lever, motion[3:]])
    return GraspStep(replace(state, motion=motion, steps=state.steps + 1), own, 1.0, error, VisualStatus.OK)


def _size(errors: Reals, stage: GraspStage) -> float:
    own = errors[_INDICES[stage]]
    return sqrt(own.dot(own) / len(own))


def _probe(state: GraspState, errors: Reals, settings: GraspSettings) -> GraspStep:
    jacobian = state.jacobian
    if state.probe:
        jacobian = jacobian.copy()
        jacobian[:, state.probe - 1] = (errors - state.previous) / settings.probe
        # A hand that should have moved by the probe and did not changes the images by noise only.
        if np.abs(errors - state.previous).max() <= 4 * settings.noise + settings.fine:
            return _resting(replace(state, probe=0), VisualStatus.HAND_DOES_NOT_MOVE)
    if state.probe < 6:
        motion = np.zeros(6)
        motion[state.probe] = settings.probe
        known = replace(state, jacobian=jacobian, previous=errors, probe=state.probe + 1)
        return _moving(known, motion, _size(errors, GraspStage.GRASPING), settings)
    values = np.linalg.svd(jacobian[_WEIGHTS[GraspStage.GRASPING] > 0], compute_uv=False)
    if not values[-1] > _SINGULAR * values[0]:
        return _resting(replace(state, probe=0), VisualStatus.DEGENERATE_CAMERAS)
    known = replace(state, jacobian=jacobian, motion=_NO_MOTION, stage=GraspStage.ORIENTING, least=np.inf, worse=0)
    return _approach(known, errors, settings)


def _improved(state: GraspState, errors: Reals, noise: float) -> Reals:
    if not state.motion.any():
        return state.jacobian
    response = np.abs(state.jacobian).mean()
    floor = (2 * noise / response) ** 2
    return np.asarray(kernels.improved_jacobian(state.jacobian, errors - state.previous, state.motion, floor))


def _solved(state: GraspState, errors: Reals, damping: float, settings: GraspSettings) -> Reals:
    weights = _WEIGHTS[state.stage]
    return np.asarray(kernels.step_of_hand(errors, state.jacobian, weights, damping, 1.0, settings.largest))


def _approach(state: GraspState, errors: Reals, settings: GraspSettings) -> GraspStep:
    """Orient, centre or grasp."""
    stage = state.stage
    jacobian = _improved(state, errors, settings.noise)
    limits = {GraspStage.GRASPING: max(settings.fine, 4 * settings.noise)}
    while stage is not GraspStage.HOLDING and _size(errors, stage) < limits.get(stage, settings.coarse):
        stage = GraspStage(stage + 1)
    size = _size(errors, stage)
    least, worse = (size, 0) if stage is not state.stage or size < state.least else (state.least, state.worse + 1)
    known = replace(state, stage=stage, jacobian=jacobian, previous=errors, least=least, worse=worse)
    if stage is GraspStage.HOLDING:
        rest = replace(known, motion=_NO_MOTION, marks=np.zeros((2, N_MARKS, 2)), frames=0, rounds=0)
        return GraspStep(rest, _NO_MOTION, 1.0, size, VisualStatus.OK)
    if worse > 10:
        again = replace(known, stage=GraspStage.PROBING, probe=0, least=np.inf, worse=0, motion=_NO_MOTION)
        return _probe(again, errors, settings)
    damping = 1e-3 if stage is not GraspStage.GRASPING else 1e-10
    return _moving(known, _solved(known, errors, damping, settings), size, settings)


def _hold(state: GraspState, images: Reals, found: VisualErrors, settings: GraspSettings) -> GraspStep:
    """Average images of the resting hand, correct it by them, and close the fingers at the end."""
    corrects = settings.noise > 0 and state.rounds < settings.rounds
    needed = 1
    if settings.noise > 0:
        # Each correction is by twice as many images as the one before; the last average decides whether all is well.
        needed = settings.frames >> (settings.rounds - 1 - state.rounds) if corrects else settings.frames // 4
    marks, frames = state.marks + images[:, :N_MARKS], state.frames + 1
    if frames < max(needed, 1):
        rest = replace(state, marks=marks, frames=frames)
        return GraspStep(rest, _NO_MOTION, 1.0, _size(found.rows.reshape(-1), state.stage), VisualStatus.OK)
    mean = visual_error(np.concatenate([marks / frames, state.corners / state.images], 1))
    if mean.status is not VisualStatus.OK:
        return _resting(state, mean.status)
    errors = mean.rows.reshape(-1)
    size, none = _size(errors, state.stage), np.zeros_like(marks)
    if corrects:
        jacobian = _improved(state, errors, settings.noise / np.sqrt(frames))
        known = replace(state, jacobian=jacobian, previous=errors, marks=none, frames=0, rounds=state.rounds + 1)
        return _moving(known, _solved(known, errors, 1e-10, settings), size, settings)
    if size > max(100 * settings.fine, settings.noise / 2):
        return _resting(state, VisualStatus.NOT_CONVERGED)
    if not mean.upright:
        return _resting(state, VisualStatus.UPSIDE_DOWN)
    closing = float(mean.ratio.mean())
    rest = replace(state, marks=none, frames=0, motion=_NO_MOTION)
    if abs(closing - 1) > max(1e-9, settings.noise / 100):
        return GraspStep(rest, _NO_MOTION, closing, size, VisualStatus.OK)
    return GraspStep(replace(rest, stage=GraspStage.DONE), _NO_MOTION, 1.0, size, VisualStatus.OK)
