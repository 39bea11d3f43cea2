"""Relative poses against PoseLib and OpenCV on the same pairs, in space and on planes, with wrong pairs."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest
from relative_scenes import K, Views, cloud, degrees_off, plane, views

from algorithms.vision import VisionStatus, relative_pose
from generated import pga3

pytestmark = pytest.mark.peers

Array = np.ndarray[Any, Any]
MODEL = {"model": "PINHOLE", "width": 640, "height": 480, "params": [800.0, 800.0, 320.0, 240.0]}


def poselib_error(scene: Views, threshold: float) -> float:
    poselib = pytest.importorskip("poselib")
    options = {"max_epipolar_error": threshold, "success_prob": 0.999}
    pose, _ = poselib.estimate_relative_pose(scene.first, scene.second, MODEL, MODEL, options, {})
    return degrees_off(np.column_stack([pose.R, pose.t / max(np.linalg.norm(pose.t), 1e-300)]), scene.turn, scene.shift)


@pytest.mark.parametrize(
    ("flat", "wrong"),
    [*product([False, True], [0.0, 0.3, 0.6]), (False, 0.8)],  # four wrong pairs of five take seconds
)
def test_as_many_and_as_accurate_as_poselib(flat: bool, wrong: float) -> None:
    """Of 20 scenes, as many poses are right; on a plane, where PoseLib returns one of two motions, we return both."""
    rng = np.random.default_rng([round(10 * wrong), flat])
    ours, theirs = [], []
    for _ in range(20):
        scene = views(rng, plane(rng, 200) if flat else cloud(rng, 200), noise=0.5, wrong=wrong)
        found = relative_pose(scene.first, scene.second, K, threshold=1.5)
        off = [degrees_off(matrix, scene.turn, scene.shift) for matrix in pga3.motor_to_matrix(found.motors)]
        assert found.status != VisionStatus.OK or len(off) == 1
        ours.append(min(off, default=180.0))
        theirs.append(poselib_error(scene, 1.5))
    assert (np.array(ours) < 5).sum() >= (np.array(theirs) < 5).sum() - (wrong == 0.8)
    ratio = np.log(np.maximum(ours, 1e-3)) - np.log(np.maximum(theirs, 1e-3))
    assert np.exp(ratio.mean()) <= 1.1  # The mean ratio of paired errors varies less than a ratio of medians.


def test_without_wrong_pairs_as_accurate_as_opencv() -> None:
    """The pose of `recoverPose` from the matrix of `findEssentialMat`, and that of least squares over all pairs."""
    cv2 = pytest.importorskip("cv2")
    rng = np.random.default_rng(30)
    ours, theirs = [], []
    for _ in range(30):
        scene = views(rng, cloud(rng, 60), noise=0.5)
        found = relative_pose(scene.first[:, None], scene.second[:, None], K)
        matrix, mask = cv2.findEssentialMat(scene.first, scene.second, K, cv2.RANSAC, 0.999, 2.0)
        _, turn, shift, _ = cv2.recoverPose(matrix, scene.first, scene.second, K, mask=mask)
        ours.append(degrees_off(pga3.motor_to_matrix(found.motor), scene.turn, scene.shift))
        theirs.append(degrees_off(np.column_stack([turn, shift]), scene.turn, scene.shift))
    assert np.median(ours) <= 0.8 * np.median(theirs) and np.max(ours) <= np.max(theirs)


def test_motions_of_planes_are_those_of_opencv() -> None:
    """The decomposition of the homography has the true motion, and one near our second one.

    The second motion may place a few points just behind a camera, which the usual noise explains if it moves a little.
    """
    cv2 = pytest.importorskip("cv2")
    rng = np.random.default_rng(31)
    n_both = 0
    for _ in range(10):
        scene = views(rng, plane(rng, 40))
        found = relative_pose(scene.first, scene.second, K)
        matrix, _ = cv2.findHomography(scene.first, scene.second, 0)
        _, turns, shifts, _ = cv2.decomposeHomographyMat(matrix, K)
        options = [(turn, shift[:, 0] / np.linalg.norm(shift)) for turn, shift in zip(turns, shifts, strict=True)]
        off = [min(degrees_off(own, *each) for each in options) for own in pga3.motor_to_matrix(found.motors)]
        assert min(off) < 1e-3 and max(off) < 0.5
        n_both += len(found.motors) == 2
    assert n_both >= 5
