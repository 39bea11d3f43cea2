"""Poses with unknown focal lengths, and from points and lines, against PoseLib on the same points."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from focal_scenes import CENTRE, seen_pairs, seen_points
from scenes_of_lines import K, seen_lines

from algorithms.vision import (
    VisionStatus,
    cameras_of_four_points,
    localize,
    localize_unknown_focal,
    relative_pose_unknown_focal,
)
from generated import pga3

pytestmark = pytest.mark.peers

Array = np.ndarray[Any, Any]
MODEL = {"model": "PINHOLE", "width": 800, "height": 600, "params": [800.0, 790.0, 400.0, 300.0]}


@pytest.mark.parametrize("noise", [0.0, 0.2])
def test_four_points_are_as_exact_as_those_of_poselib(noise: float) -> None:
    poselib = pytest.importorskip("poselib")
    ours, theirs = [], []
    for seed in range(200):
        points, pixels, focal, _, _ = seen_points(np.random.default_rng([120, seed]), 4, noise=noise)
        _, lengths, _ = cameras_of_four_points(points, pixels, CENTRE)
        ours.append(np.abs(lengths / focal - 1).min(initial=1.0))
        _, others = poselib.p4pf((pixels - CENTRE) / 500, points - points.mean(0), True)
        theirs.append(min((abs(each * 500 / focal - 1) for each in others), default=1.0))
    assert np.quantile(ours, 0.9) <= np.quantile(theirs, 0.9) and np.median(ours) < np.median(theirs)


@pytest.mark.parametrize("wrong", [0.0, 0.3, 0.6])
def test_poses_with_a_focal_length_are_found_at_least_as_often_as_by_samples_of_poselib(wrong: float) -> None:
    """PoseLib's wheel has no robust estimate; the best of as many samples of `p4pf` as are needed is compared."""
    poselib = pytest.importorskip("poselib")
    ours, theirs = [], []
    for seed in range(20):
        rng = np.random.default_rng([121, round(10 * wrong), seed])
        points, pixels, focal, _, _ = seen_points(rng, 100, wrong=wrong)
        found = localize_unknown_focal(points, pixels, CENTRE, threshold=2.0)
        assert found.status == VisionStatus.OK
        ours.append(abs(found.focal / focal - 1))
        best, places, image = (np.inf, 1.0), points - points.mean(0), pixels - CENTRE
        for _ in range({0.0: 3, 0.3: 27, 0.6: 268}[wrong]):
            chosen = rng.choice(100, 4, replace=False)
            for pose, length in zip(*poselib.p4pf(image[chosen] / 500, places[chosen], True), strict=True):
                there = places @ pose.R.T + pose.t
                squares = ((500 * length * there[:, :2] / there[:, 2:] - image) ** 2).sum(1)
                cost = float(np.minimum(np.where(there[:, 2] > 0, squares, 4), 4).sum())
                best = min(best, (cost, abs(500 * length / focal - 1)))
        theirs.append(best[1])
    assert (np.array(ours) < 0.02).sum() >= (np.array(theirs) < 0.02).sum() and np.median(ours) < np.median(theirs)


@pytest.mark.parametrize("wrong", [0.0, 0.3, 0.6])
def test_motions_with_a_focal_length_are_as_accurate_as_those_of_poselib(wrong: float) -> None:
    poselib = pytest.importorskip("poselib")
    ours, theirs, refused = [], [], 0
    for seed in range(20):
        one, two, focal, _, _ = seen_pairs(np.random.default_rng([122, round(10 * wrong), seed]), 150, wrong=wrong)
        found = relative_pose_unknown_focal(one, two, CENTRE, threshold=1.5)
        pair, _ = poselib.estimate_shared_focal_relative_pose(
            one, two, CENTRE, {"max_epipolar_error": 1.5, "success_prob": 0.999}, {}
        )
        if found.status != VisionStatus.OK:
            refused += 1
            continue
        ours.append(abs(found.focal / focal - 1))
        theirs.append(abs(pair.camera1.params[0] / focal - 1))
    assert refused <= 1 and np.median(ours) < 1.1 * np.median(theirs)


@pytest.mark.parametrize("wrong", [0.0, 0.3, 0.6])
@pytest.mark.parametrize(("n_points", "n_lines"), [(50, 50), (0, 100)])
def test_poses_of_points_and_lines_are_as_accurate_as_those_of_poselib(
    n_points: int, n_lines: int, wrong: float
) -> None:
    poselib = pytest.importorskip("poselib")
    ours, theirs = [], []
    options = {"max_reproj_error": 2.0, "max_epipolar_error": 2.0, "success_prob": 0.999}
    for seed in range(20):
        points, pixels, lines, image, pose, _, _ = seen_lines(
            np.random.default_rng([123, n_lines, round(10 * wrong), seed]), n_points, n_lines, wrong=wrong
        )
        found = localize(points, pixels, K, threshold=2.0, lines=lines, image_lines=image)
        assert found.status == VisionStatus.OK
        other, _ = poselib.estimate_absolute_pose_pnpl(
            pixels, points, image[:, 0], image[:, 1], lines[:, 0], lines[:, 1], MODEL, options, {}
        )
        ours.append(np.linalg.norm(pga3.motor_to_matrix(found.pose)[:3, 3] - pose[:3, 3]))
        theirs.append(np.linalg.norm(-other.R.T @ other.t - pose[:3, 3]))
    assert np.median(ours) < 1.1 * np.median(theirs)
