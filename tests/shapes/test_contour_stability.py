"""OK is a promise: contours of gray images that are not near the boundary have another status."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial import cKDTree
from skimage import data, measure

from algorithms.shapes import ContourStatus, contour, trace_contour
from algorithms.shapes.contours import dense

Array = np.ndarray[Any, Any]


def is_right(path: Array, mask: Array) -> bool:
    """Whether a path is within 0.7 pixels on average and 3 at most of the boundary of a mask, in both directions."""
    lines = measure.find_contours(np.pad(mask, 1).astype(float), 0.5)
    truth, found = dense(max(lines, key=len)[:-1] - 1), dense(path)
    both = cKDTree(found).query(truth)[0], cKDTree(truth).query(found)[0]
    return bool(max(d.mean() for d in both) <= 0.7 and max(d.max() for d in both) <= 3)


def blob(rng: np.random.Generator, size: int = 96) -> Array:
    """A star-shaped region with a random boundary."""
    turns = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    radii = 24 + sum(5 / k * rng.normal() * np.cos(k * turns + rng.uniform(0, 6)) for k in range(2, 7))
    y, x = np.indices((size, size)) - size / 2
    return np.asarray(np.hypot(y, x) < np.interp(np.arctan2(y, x) % (2 * np.pi), turns, radii, period=2 * np.pi))


@pytest.mark.slow
def test_coins_that_are_ok_are_right() -> None:
    image = data.coins()
    labels, count = ndimage.label(ndimage.binary_opening(ndimage.binary_fill_holes(image > 107), iterations=2))
    certain, right = [], []
    for i, place in enumerate(ndimage.find_objects(labels), 1):
        if not 500 < (labels == i).sum() < 8000:
            continue
        for pad in (5, 12):
            part = tuple(slice(max(0, s.start - pad), s.stop + pad) for s in place)
            found = trace_contour(image[part])
            certain.append(found.status is ContourStatus.OK)
            right.append(is_right(found.path, labels[part] == i))
    assert count and not np.all(right)
    assert np.all(np.array(right)[certain]) and np.mean(certain) > 0.7


@pytest.mark.parametrize(
    ("blur", "noise", "bias", "share"),
    [(1, 0.05, 0, 1), (0, 0.3, 0, 1), (3, 0.02, 0, 1), (5, 0.02, 0, 0), (0, 1, 0, 0), (0, 0.05, 1.5, 0)],
)
def test_unseen_images(blur: float, noise: float, bias: float, share: float) -> None:
    rng = np.random.default_rng(7)
    certain = []
    for _ in range(3):
        mask = blob(rng)
        image = ndimage.gaussian_filter(mask.astype(float), blur) + bias * np.indices(mask.shape)[0] / len(mask)
        found = trace_contour(image + noise * rng.normal(size=mask.shape))
        certain.append(found.status is ContourStatus.OK)
        assert not certain[-1] or is_right(found.path, mask)
    assert np.mean(certain) == share


@pytest.mark.parametrize("gap", [0, 2])
def test_touching_objects_and_noise_are_uncertain(gap: float) -> None:
    rng = np.random.default_rng(3)
    y, x = np.indices((96, 120))
    two = (np.hypot(y - 48, x - 35) < 20) | (np.hypot(y - 48, x - 75 - gap) < 20)
    image = ndimage.gaussian_filter(two.astype(float), 1) + 0.03 * rng.normal(size=two.shape)
    assert trace_contour(image).status is ContourStatus.UNCERTAIN
    with pytest.warns(UserWarning, match=r"UNCERTAIN: .*trace_contour"):
        contour(image)
    # A mask says what the object is.
    assert trace_contour(two).status is ContourStatus.OK
    assert trace_contour(rng.normal(size=(80, 80))).status is not ContourStatus.OK
