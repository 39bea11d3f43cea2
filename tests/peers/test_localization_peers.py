"""Poses against the best of OpenCV's IPPE and SQPNP, each refined: never OK with three times their error."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pose_scenes import INTRINSICS, bent_board, camera_error, seen_from_somewhere, thick_points

from algorithms.vision import VisionStatus, localizations, localize
from generated import pga3

pytestmark = pytest.mark.peers

Array = np.ndarray[Any, Any]
TRIALS = 60


def opencvs(points: Array, pixels: Array) -> Array:
    """The pose with the least residual and all points before the camera, of points about their centroid."""
    cv2 = pytest.importorskip("cv2")
    about = points - points.mean(0)
    axes = np.linalg.svd(about)[2]
    axes[2] = np.cross(axes[0], axes[1])
    flat = about @ axes.T * [1, 1, 0]
    starts = []
    for plane, flag, basis in ((flat, cv2.SOLVEPNP_IPPE, axes), (about, cv2.SOLVEPNP_SQPNP, np.eye(3))):
        try:
            _, turns, shifts, _ = cv2.solvePnPGeneric(plane, pixels, INTRINSICS, None, flags=flag)
        except cv2.error:
            continue
        starts += [(cv2.Rodrigues(cv2.Rodrigues(r)[0] @ basis)[0], t) for r, t in zip(turns, shifts, strict=True)]
    best, result = np.inf, np.full((4, 4), np.nan)
    for r, t in starts:
        r, t = cv2.solvePnPRefineLM(about, pixels, INTRINSICS, None, r, t.copy(), (3, 200, 1e-14))
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = cv2.Rodrigues(r)[0], t[:, 0]
        there = about @ matrix[:3, :3].T + matrix[:3, 3]
        off = there[:, :2] / there[:, 2:] * 800 + [320, 240] - pixels
        if there[:, 2].min() > 0 and (off**2).sum() < best:
            best, result = float((off**2).sum()), matrix
    result = np.linalg.inv(result)
    result[:3, 3] += points.mean(0)
    return np.asarray(pga3.motor_from_matrix(result))


def scenes() -> list[tuple[str, Any]]:
    found: list[tuple[str, Any]] = [
        (f"board bent by {bend}", lambda rng, bend=bend: (bent_board(bend), 700.0, 0.0))
        for bend in (0.0, 0.5, 1.0, 2.0, 4.0, 5.0)
    ]
    for n_points, thickness, offset in (
        *((12, thickness, 0.0) for thickness in (1e-4, 5e-4, 1.2e-3, 3e-3, 1e-2, 0.1, 1.0)),
        *((10, 1.0, offset) for offset in (1e2, 1e3, 1e4, 1e6)),
        *((12, 3e-3, offset) for offset in (1e3, 1e6)),
        *((n, thickness, 0.0) for n in (4, 5, 6, 8) for thickness in (0.03, 1.0)),
    ):

        def make(rng: np.random.Generator, n: int = n_points, t: float = thickness, o: float = offset) -> Any:
            return thick_points(rng, n, t), rng.uniform(3, 8), o

        found.append((f"{n_points} points of thickness {thickness}, {offset} away", make))
    return found


@pytest.mark.parametrize(("name", "make"), scenes(), ids=[name for name, _ in scenes()])
def test_no_pose_is_worse_than_opencvs(name: str, make: Any) -> None:
    pytest.importorskip("cv2")
    rng = np.random.default_rng(len(name))
    views = []
    for _ in range(TRIALS):
        points, distance, offset = make(rng)
        views.append(seen_from_somewhere(rng, points, distance, offset, noise=0.5))
    many = localizations(np.array([v[0] for v in views]), np.array([v[1] for v in views]), INTRINSICS)
    refused = 0
    for (points, pixels, turn, centre), pose, status in zip(views, many.models, many.status, strict=True):
        one = localize(points, pixels, INTRINSICS)
        theirs = camera_error(opencvs(points, pixels), turn, centre)
        for found, state in ((one.pose, one.status), (pose, status)):
            if state == VisionStatus.AMBIGUOUS:  # Four points can leave two poses, one of which is right.
                errors = [camera_error(each, turn, centre) for each in one.poses]
                assert any(all(a <= 3 * b for a, b in zip(each, theirs, strict=True)) for each in errors)
                continue
            if state != VisionStatus.OK:
                refused += 1
                continue
            for ours, other in zip(camera_error(found, turn, centre), theirs, strict=True):
                assert ours <= 3 * other
    assert refused <= 0.02 * 2 * TRIALS
