"""Localization of an omnidirectional camera by landmarks that it recognises, without odometry or an earlier pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike

from generated import pga3

from ..arguments import Reals, finite_number, real_array
from .landmarks import LandmarkMap
from .localization import localize
from .status import VisionStatus

_AGREE = 4.0
"""Landmarks agree with a pose if the residual of their directions is at most this multiple of the noise."""


@dataclass(frozen=True, slots=True, eq=False)
class LandmarkPose:
    """Result of `localize_by_landmarks`."""

    pose: Reals
    """(8,) The unit motor from the camera frame to the world frame; NaN if the status is not OK."""
    status: VisionStatus
    """NO_CONSENSUS if no landmark is recognised, or if the recognised ones contradict each other."""
    residual: float
    """The root mean square of the angles between observed and expected directions, in radians."""
    landmarks: Reals
    """(g,) int, the landmark of each group of directions; -1 if none was recognised or if it contradicts the pose."""


def localize_by_landmarks(
    learned: LandmarkMap, places: Sequence[ArrayLike], groups: Sequence[ArrayLike], noise: float
) -> LandmarkPose:
    """Estimate the pose of a camera from groups of directions to landmarks at known places.

    Each group is recognised by its invariants and gives a pose by the homography of its plane. The pose with which most
    landmarks agree is then refined with the directions of all of these (Bayro-Corrochano 2010, 14.10).

    Parameters
    ----------
    learned : LandmarkMap
        Map of m landmarks.
    places : sequence of m array_like, (k, 3)
        World coordinates of the points of each landmark, in the order in which they were learned.
    groups : sequence of array_like, (n, 3)
        Directions in the camera frame, one group of at least eight for each landmark that is seen, in any order.
    noise : float
        Standard deviation of directions, in radians: that of a pixel divided by the focal length.

    Returns
    -------
    LandmarkPose
        The status is TOO_FEW without groups.

    Raises
    ------
    TypeError, ValueError
        If places do not match the landmarks, or if groups are not directions.

    Notes
    -----
    OK assumes that places are exact. If a landmark is larger or smaller than stated, the camera is farther away or
    nearer by the same factor, which a single landmark cannot show: its pose is wrong, with the status OK. Several
    landmarks of wrong sizes contradict each other, unless they are near together.
    """
    size = finite_number(noise, "noise")
    known = np.isfinite(learned.points[..., 0]).sum(1)
    points = [real_array(place, f"places[{k}]", (-1, 3), "x y z") for k, place in enumerate(places)]
    if [len(place) for place in points] != known.tolist():
        raise ValueError(
            f"places: {[len(p) for p in points]} points; expected {known.tolist()}, those of the landmarks"
        )
    none = np.full(len(groups), -1)
    if not len(groups):
        return LandmarkPose(np.full(8, np.nan), VisionStatus.TOO_FEW, np.nan, none)
    seen = []
    for g, group in enumerate(groups):
        directions = real_array(group, f"groups[{g}]", (-1, 3), "directions").astype(np.float64)
        found = learned.recognize(directions, size)
        if found.status == VisionStatus.OK:
            matched = found.matches >= 0
            unit = directions[matched] / np.linalg.norm(directions[matched], axis=-1, keepdims=True)
            seen.append((g, found.landmark, points[found.landmark][found.matches[matched]], unit))
    starts = [pose for _, _, place, unit in seen for pose in _poses_of_one(place, unit, size)]
    best: tuple[int, float, Reals, list[int]] | None = None
    for start in starts:
        # One landmark gives an uncertain pose: two of them say whether others agree.
        for j in range(len(seen)):
            pose = _refined(start, [seen[k] for k in sorted({*_agreeing(start, seen, _AGREE * size), j})])
            agreeing = _agreeing(pose, seen, _AGREE * size)
            if not agreeing:
                continue
            pose = _refined(pose, [seen[k] for k in agreeing])
            agreeing = _agreeing(pose, seen, _AGREE * size)
            if not agreeing:
                continue
            residual = float(np.sqrt(np.mean(np.concatenate([_off(pose, *seen[k][2:]) for k in agreeing]) ** 2)))
            if best is None or (-len(agreeing), residual) < best[:2]:
                best = -len(agreeing), residual, pose, agreeing
    if best is None or 2 * len(best[3]) <= len(seen):
        return LandmarkPose(np.full(8, np.nan), VisionStatus.NO_CONSENSUS, np.nan, none)
    _, residual, pose, agreeing = best
    for k in agreeing:
        none[seen[k][0]] = seen[k][1]
    return LandmarkPose(pose, VisionStatus.OK, residual, none)


_Seen = tuple[int, int, Reals, Reals]
"""Group and index of a recognised landmark, places (n, 3) of its points and directions (n, 3) to them."""


def _poses_of_one(place: Reals, unit: Reals, noise: float) -> list[Reals]:
    """Return the likely poses from one landmark, by a virtual camera that looks at its centre."""
    axis = unit.mean(0)
    frame = np.linalg.svd(axis[None])[2]
    frame[0] *= np.sign(frame[0] @ axis)
    frame[1] *= np.linalg.det(frame)
    rotation = np.eye(4)
    rotation[:3, :3] = frame[[1, 2, 0]]
    there = unit @ rotation[:3, :3].T
    found = localize(place, there[:, :2] / there[:, 2:], np.eye(3), noise=noise)
    return [np.asarray(pga3.motor_product(pose, pga3.motor_from_matrix(rotation))) for pose in found.poses]


def _off(pose: Reals, place: Reals, unit: Reals) -> Reals:
    """Return angles (n,) between the directions to places and those observed, as lengths of chords."""
    return np.asarray(np.linalg.norm(_difference(pose, place, unit), axis=-1))


def _difference(pose: Reals, place: Reals, unit: Reals) -> Reals:
    there = pga3.move_point_back(pose, place)
    return np.asarray(there / np.linalg.norm(there, axis=-1, keepdims=True) - unit)


def _agreeing(pose: Reals, seen: list[_Seen], limit: float) -> list[int]:
    return [k for k, (_, _, place, unit) in enumerate(seen) if np.sqrt(np.mean(_off(pose, place, unit) ** 2)) <= limit]


def _refined(start: Reals, seen: list[_Seen]) -> Reals:
    """Return the least-squares pose near `start`."""
    place, unit = (np.concatenate([each[k] for each in seen]) for k in (2, 3))
    size = float(np.abs(start[4:]).max()) or 1.0

    def moved(step: Reals) -> Reals:
        bivector = step * np.array([1, 1, 1, size, size, size])
        return np.asarray(pga3.motor_product(start, pga3.motor_exponential(bivector)))

    found = scipy.optimize.least_squares(
        lambda step: _difference(moved(step), place, unit).ravel(), np.zeros(6), method="lm"
    )
    return np.asarray(pga3.normalize_motor(moved(found.x)))
