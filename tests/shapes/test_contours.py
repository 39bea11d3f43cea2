"""Contours of images against level lines of scikit-image and closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial import cKDTree
from skimage import data, measure

from algorithms.shapes import ContourStatus, adapted, contour, trace_contour
from algorithms.shapes.contours import crosses, dense
from generated import cga2, pga2
from tests.support.all_cases import all_cases

Array = np.ndarray[Any, Any]


def disc(radius: float, centre: tuple[float, float] = (40, 40), size: int = 81) -> Array:
    rows, columns = np.indices((size, size))
    return np.asarray(np.hypot(rows - centre[0], columns - centre[1]) < radius)


def distances(path: Array, mask: Array) -> tuple[float, float]:
    """The larger mean and the largest distance, in both directions, from the level line of scikit-image."""
    lines = measure.find_contours(np.pad(mask, 1).astype(float), 0.5)
    truth, found = dense(max(lines, key=len)[:-1] - 1), dense(path)
    there, back = cKDTree(found).query(truth)[0], cKDTree(truth).query(found)[0]
    return max(there.mean(), back.mean()), max(there.max(), back.max())


def coins() -> list[Array]:
    image = data.coins()
    labels, count = ndimage.label(ndimage.binary_opening(ndimage.binary_fill_holes(image > 107), iterations=2))
    return [labels == i for i in range(2, count + 1) if 500 < (labels == i).sum() < 5000]


def test_horse() -> None:
    image = data.horse()
    path = contour(image)
    mean, most = distances(path, ~image)
    assert len(path) <= 150 and mean < 0.3 and most < 1.5
    assert not crosses(path) and len(np.unique(path, axis=0)) == len(path)


def test_coins() -> None:
    masks = coins()
    assert len(masks) == 23
    for mask in masks[::4]:
        mean, most = distances(contour(mask), mask)
        assert mean < 0.3 and most < 1


def test_gray_disc_has_its_radius_and_curvature() -> None:
    image = ndimage.gaussian_filter(disc(25).astype(float), 2) * 90 + 10
    found = trace_contour(image, tolerance=0.1)
    radii = np.hypot(*(found.path - 40).T)
    assert found.status is ContourStatus.OK and abs(radii.mean() - 25) < 0.3 and np.ptp(radii) < 0.6
    assert abs(np.median(found.curvatures) - 1 / 25) < 0.004
    assert ((found.path - 40) / radii[:, None] * found.normals).sum(1).min() > 0.98
    assert (np.diff(found.curve[:, 0]) > 0).all() and found.curve[-1, 2] < found.curve[0, 2]


def test_motors_transport_lines_and_circles() -> None:
    found = trace_contour(ndimage.gaussian_filter(disc(25).astype(float), 2), tolerance=0.1)
    assert np.allclose(pga2.move_point(found.motors, np.zeros(2)), found.path)
    lines = pga2.move_line(found.motors, np.array([0.0, 1.0, 0.0]))
    assert np.allclose(np.abs(lines[:, :2]), np.abs(found.normals))
    circles = found.osculating_circles()
    assert np.abs(cga2.signed_distance_point_circle(found.path, circles)).max() < 1e-6
    assert 20 < np.median(np.sqrt(cga2.circle_radius_squared(circles))) < 30


def test_contour_follows_a_moved_shape() -> None:
    before = trace_contour(disc(20, (35, 38)))
    after = trace_contour(disc(23, (42, 41)))
    found = adapted(before, after.samples)
    assert found.status is ContourStatus.OK and len(found.path) == len(before.path)
    motions = pga2.motor_product(found.motors, pga2.motor_inverse(before.motors))
    shift = pga2.move_point(motions, before.path) - before.path
    assert np.allclose(shift.mean(0), [7, 3], atol=0.7)


def test_borders_and_components() -> None:
    cut = trace_contour(disc(30, (70, 40)))
    assert cut.status is ContourStatus.TOUCHES_BORDER and cut.path[:, 0].max() < 81
    two = disc(10, (20, 20)) | disc(18, (45, 45))
    found = trace_contour(two)
    assert found.n_components == 2 and np.allclose(found.samples.mean(0), 45, atol=0.5)
    other = trace_contour(two, near=(20, 20))
    assert np.allclose(other.samples.mean(0), 20, atol=0.5)


@all_cases("kind", [np.uint8, np.int16, np.uint16, np.int64, np.float32, bool])
def test_types_of_numbers(kind: type) -> None:
    assert distances(contour(disc(20).astype(kind)), disc(20))[1] < 1


@all_cases(
    "image, message",
    [
        (np.zeros((9, 9)), "all pixels are equal"),
        (np.zeros((0, 9)), "no elements"),
        (np.zeros((9, 9, 3)), "expected 2 axes"),
        (np.pad([[1.0]], 4), "the largest of 1 pixels"),
        (np.where(disc(20), np.nan, 0), "nan at"),
    ],
)
def test_errors_name_what_is_wrong(image: Array, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        contour(image)


def test_too_few_nodes_are_reported() -> None:
    image = data.horse()
    assert trace_contour(image, nodes=12).status in (ContourStatus.TOO_FAR, ContourStatus.CROSSING)
    with pytest.raises(ValueError, match="allow more nodes"):
        contour(image, nodes=12)


def test_samples_without_an_order_are_an_error() -> None:
    turn = np.linspace(0, 2 * np.pi, 300, endpoint=False)
    circle = 60 + 20 * np.stack([np.sin(turn), np.cos(turn)], 1)
    rows, columns = np.indices((120, 120))
    before = trace_contour(np.hypot(rows - 58, columns - 62) < 20)
    assert adapted(before, circle).status is ContourStatus.OK
    noisy = circle + np.random.default_rng(1).normal(0, 0.1, circle.shape)
    assert adapted(before, noisy).status is not ContourStatus.CROSSING
    with pytest.raises(ValueError, match=r"samples: 2.. of 300 points are not followed by a neighbour"):
        adapted(before, np.random.default_rng(0).permutation(circle))
    with pytest.raises(ValueError, match="samples: nan"):
        adapted(before, np.full((20, 2), np.nan))
