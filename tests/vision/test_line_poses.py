"""Poses from points and lines: exact solutions of three, stated errors, wrong ones, units, and what is refused."""

import numpy as np
import pytest
from scenes_of_lines import SIZE, K, seen_lines

from algorithms.vision import Camera, Distortion, VisionStatus, localize
from generated import line_poses, matrices, pga3


def off(found, pose):
    """The angle and the distance from the true pose."""
    own = pga3.motor_to_matrix(found)
    angle = np.arccos(np.clip((np.trace(own[:3, :3].T @ pose[:3, :3]) - 1) / 2, -1, 1))
    return np.array([angle, np.linalg.norm(own[:3, 3] - pose[:3, 3])])


def test_rotations_solve_three_linear_equations():
    """The product of the numbers of equations in four homogeneous parameters is the largest number of solutions."""
    worst, residuals = [], []
    for seed in range(100):
        rng = np.random.default_rng([110, seed])
        truth = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        truth *= np.sign(np.linalg.det(truth))
        equations = rng.normal(size=(3, 3, 3))
        equations -= (equations * truth).sum((1, 2), keepdims=True) / 3 * truth
        coefficients, pencil = line_poses.rotation_polynomial(*equations)
        real, imaginary, n_real, _ = matrices.polynomial_roots(coefficients)
        assert n_real in (2, 4, 6, 8)
        found = line_poses.rotation_of_root(real[imaginary == 0], pencil)
        assert np.allclose(found @ np.swapaxes(found, 1, 2), np.eye(3))
        worst.append(np.abs(found - truth).max((1, 2)).min())
        residuals += [np.abs((equations * each).sum((1, 2))).max() for each in found]
    assert np.median(worst) < 1e-11 and np.quantile(worst, 0.98) < 1e-6
    assert np.median(residuals) < 1e-10 and np.quantile(residuals, 0.98) < 1e-5


@pytest.mark.parametrize(("n_points", "n_lines"), [(3, 1), (2, 2), (1, 3), (0, 5)])
def test_few_points_and_lines_without_noise(n_points, n_lines):
    for seed in range(10):
        *scene, pose, _, _ = seen_lines(np.random.default_rng([111, n_lines, seed]), n_points, n_lines, noise=0.0)
        found = localize(*scene[:2], K, lines=scene[2], image_lines=scene[3])
        assert found.status in (VisionStatus.OK, VisionStatus.AMBIGUOUS)
        assert min(off(each, pose).max() for each in found.poses) < 1e-7
        assert found.status == VisionStatus.AMBIGUOUS or (found.inliers.all() and found.line_inliers.all())


@pytest.mark.parametrize(("n_points", "n_lines", "wrong"), [(2, 3, 0.0), (10, 20, 0.0), (40, 40, 0.5), (0, 60, 0.4)])
def test_errors_are_as_stated(n_points, n_lines, wrong):
    ratios = []
    for seed in range(5):
        points, pixels, lines, image, pose, bad, bad_lines = seen_lines(
            np.random.default_rng([112, n_lines, seed]), n_points, n_lines, wrong=wrong
        )
        found = localize(points, pixels, K, threshold=2.0 if wrong else None, lines=lines, image_lines=image)
        assert found.status == VisionStatus.OK
        for own, spoiled in ((found.inliers, bad), (found.line_inliers, bad_lines)):
            assert len(own) == len(spoiled) and own[spoiled].sum() <= 0.1 * spoiled.sum()
            assert own[~spoiled].sum() >= 0.9 * (~spoiled).sum()
        ratios.append(off(found.pose, pose) / found.deviation)
    assert np.max(ratios) < 5 and 0.3 < np.median(ratios) < 2


@pytest.mark.parametrize(("n_points", "n_lines", "wrong"), [(0, 12, 0.2), (10, 10, 0.3), (0, 60, 0.5)])
def test_wrong_items_are_left_out_without_a_threshold(n_points, n_lines, wrong):
    """Wrong ones are anywhere in the image; they may touch what is seen of the right line."""
    ratios = []
    for seed in range(6):
        points, pixels, lines, image, pose, bad, bad_lines = seen_lines(
            np.random.default_rng([118, n_lines, seed]), n_points, n_lines, wrong=wrong
        )
        found = localize(points, pixels, K, lines=lines, image_lines=image)
        assert found.status == VisionStatus.OK
        assert not found.inliers[bad].any() and not found.line_inliers[bad_lines].any()
        assert found.inliers[~bad].all() and found.line_inliers[~bad_lines].all()
        ratios.append(off(found.pose, pose) / found.deviation)
    assert np.max(ratios) < 5 and 0.3 < np.median(ratios) < 2


@pytest.mark.parametrize(("n_points", "n_lines"), [(0, 6), (3, 6), (0, 40), (30, 30)])
def test_random_items_have_no_pose(n_points, n_lines):
    for seed in range(8):
        rng = np.random.default_rng([119, n_lines, seed])
        points, pixels, lines, image, *_ = seen_lines(rng, n_points, n_lines)
        pixels, image = (rng.uniform(0, 1, each.shape) * SIZE for each in (pixels, image))
        found = localize(points, pixels, K, lines=lines, image_lines=image)
        assert found.status != VisionStatus.OK and np.isnan(found.pose).all()


def test_lines_improve_a_pose():
    """The error of many scenes with lines is less than with their points alone."""
    errors = []
    for seed in range(10):
        points, pixels, lines, image, pose, *_ = seen_lines(np.random.default_rng([113, seed]), 8, 30)
        both = localize(points, pixels, K, lines=lines, image_lines=image)
        errors.append([off(both.pose, pose)[1], off(localize(points, pixels, K).pose, pose)[1]])
    with_lines, without = np.median(errors, axis=0)
    assert with_lines < 0.7 * without


@pytest.mark.parametrize(("unit", "origin"), [(1e-3, 0.0), (1e3, 0.0), (1.0, 1e6)])
def test_units_and_origins_do_not_matter(unit, origin):
    places = []
    for scale, place in ((1.0, 0.0), (unit, origin)):
        points, pixels, lines, image, pose, *_ = seen_lines(np.random.default_rng(114), 5, 5, unit=scale, origin=place)
        found = localize(points, pixels, K, lines=lines, image_lines=image)
        assert found.status == VisionStatus.OK
        places.append((pga3.motor_to_matrix(found.pose)[:3, 3] - pose[:3, 3]) / scale)
    assert np.allclose(*places, rtol=1e-5, atol=1e-9 + 2e-15 * origin)


def test_distortion_is_removed_from_lines():
    lens = Camera(K, np.eye(8)[0], Distortion("brown", (-0.2, 0.03)))
    points, pixels, lines, image, pose, *_ = seen_lines(np.random.default_rng(115), 4, 8, noise=0.0)
    found = localize(points, lens.distort(pixels), lens, lines=lines, image_lines=lens.distort(image))
    assert found.status == VisionStatus.OK and off(found.pose, pose).max() < 1e-6


def test_what_is_refused():
    rng = np.random.default_rng(116)
    points, pixels, lines, image, *_ = seen_lines(rng, 10, 10)

    def status(*scene, **options):
        return localize(*scene[:2], K, lines=scene[2], image_lines=scene[3], **options).status

    assert status(points[:1], pixels[:1], lines[:2], image[:2]) == VisionStatus.TOO_FEW
    assert status(points, pixels, lines * np.nan, image) == VisionStatus.NOT_FINITE
    assert status(points, pixels, lines[:, [0, 0]], image) == VisionStatus.DEGENERATE
    assert status(points, pixels, lines, image[:, [0, 0]]) == VisionStatus.DEGENERATE
    random = [rng.uniform(0, 1, each.shape) * SIZE for each in (pixels, image)]
    assert status(points, random[0], lines, random[1], threshold=2.0) == VisionStatus.NO_CONSENSUS
    assert status(points, random[0], lines, random[1]) in (VisionStatus.NOT_CONVERGED, VisionStatus.AMBIGUOUS)
    spoiled = image.copy()
    spoiled[0] += 30
    assert status(points[:2], pixels[:2], lines[:3], spoiled[:3]) == VisionStatus.NOT_CONVERGED
    none = np.empty((0, 3)), np.empty((0, 2))
    frame = np.linalg.inv(seen_lines(np.random.default_rng(117), 0, 8, noise=0.0)[4])
    parallel = np.stack([rng.uniform(-1, 1, (8, 3)) - np.array([0, 0, -6]), np.zeros((8, 3))], 1)
    parallel[:, 1] = parallel[:, 0] + [1, 0.3, 0.2]
    seen = parallel @ K.T
    along = status(*none, parallel @ frame[:3, :3] + frame[:3, 3], seen[..., :2] / seen[..., 2:])
    assert along == VisionStatus.DEGENERATE  # a translation along all of them shows nothing
    found = localize(points, pixels, K, lines=lines[:0], image_lines=image[:0])
    assert found.status == VisionStatus.OK and not len(found.line_inliers)
    with pytest.raises(ValueError, match="one of both"):
        localize(points, pixels, K, lines=lines)
    with pytest.raises(ValueError, match="expected 10, as many"):
        localize(points, pixels, K, lines=lines, image_lines=image[1:])
