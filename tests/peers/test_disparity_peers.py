"""Disparities against OpenCV's semi-global matching, on the same bytes."""

from __future__ import annotations

import numpy as np
import pytest

from algorithms.wavelets import disparity

pytestmark = pytest.mark.peers


@pytest.mark.parametrize("corner", [(100, 170), (0, 0), (197, 341)], ids=str)
def test_fewer_errors_than_semi_global_matching(corner: tuple[int, int]) -> None:
    """Half as many wrong pixels of all with a measured disparity, and fewer of those for which there is a result."""
    cv2 = pytest.importorskip("cv2")
    left, right, truth = pytest.importorskip("skimage.data").stereo_motorcycle()
    part = slice(corner[0], corner[0] + 300), slice(corner[1], corner[1] + 400)
    one, two = (cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)[part] for image in (left, right))
    truth = truth[part]
    known = np.isfinite(truth) & (truth > 0)
    matcher = cv2.StereoSGBM_create(0, 80, 3, P1=8 * 9, P2=32 * 9)
    theirs = matcher.compute(one, two) / 16
    ours = disparity(one, two, 79)
    wrong = [np.abs(each - truth) > 1 for each in (ours.disparity, theirs)]
    assert wrong[0][known].mean() < 0.65 * (wrong[1] | (theirs < 0))[known].mean()
    results = [known & (ours.confidence > 0), known & (theirs >= 0)]
    assert results[0].sum() > results[1].sum()
    assert wrong[0][results[0]].mean() < 0.9 * wrong[1][results[1]].mean()
