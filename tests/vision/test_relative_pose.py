"""Relative poses of two views against the true motion: good, few, wrong and degenerate pairs, and their statuses."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy
from relative_scenes import SIZE, K, Views, cloud, degrees_off, essential, pixels, plane, views

from algorithms.evidence import Noise, largest_likely
from algorithms.evidence.status import WRONG
from algorithms.vision import Camera, Distortion, RelativePose, VisionStatus, relative_pose
from generated import pga3

Array = np.ndarray[Any, Any]


def error(found: RelativePose, scene: Views) -> float:
    return degrees_off(pga3.motor_to_matrix(found.motor), scene.turn, scene.shift)


@pytest.mark.parametrize("n_points", [8, 20, 100])
def test_exact_pairs(n_points: int) -> None:
    """The motor, E, the points and the covariance are those of the scene, up to rounding."""
    rng = np.random.default_rng(n_points)
    for _ in range(4):
        scene = views(rng, cloud(rng, n_points))
        found = relative_pose(scene.first, scene.second, K)
        if n_points == 8 and found.status == VisionStatus.AMBIGUOUS:
            continue  # Eight pairs may have a second motion that the usual noise cannot rule out.
        assert found.status == VisionStatus.OK and found.inliers.all() and found.residual < 1e-9
        assert error(found, scene) < 1e-6 and np.isclose(np.linalg.norm(pga3.motor_to_matrix(found.motor)[:3, 3]), 1)
        assert np.abs(found.points - scene.points).max() < 1e-6
        truth = essential(scene.turn, scene.shift)
        assert min(np.abs(found.essential - sign * truth).max() for sign in (1, -1)) < 1e-8
        assert np.linalg.matrix_rank(found.covariance, tol=1e-6 * np.trace(found.covariance)) == 5


def test_five_exact_pairs_have_the_true_motion_among_theirs() -> None:
    """Every other one fits as well, with all points in front of both cameras."""
    rng = np.random.default_rng(5)
    n_found = 0
    for _ in range(12):
        scene = views(rng, cloud(rng, 5, 2, 5))
        found = relative_pose(scene.first, scene.second, K)
        if found.status not in (VisionStatus.OK, VisionStatus.AMBIGUOUS):
            continue
        matrices = pga3.motor_to_matrix(found.motors)
        n_found += min(degrees_off(matrix, scene.turn, scene.shift) for matrix in matrices) < 1e-4
        assert (len(matrices) > 1) == (found.status == VisionStatus.AMBIGUOUS)
        assert np.isnan(found.motor).any() == (found.status == VisionStatus.AMBIGUOUS)
    assert n_found >= 9


def test_errors_are_those_that_the_covariance_states() -> None:
    """The squared errors in units of the covariance have the mean of chi-square, or less: noise has a prior."""
    rng = np.random.default_rng(8)
    squares = []
    for _ in range(40):
        scene = views(rng, cloud(rng, 40), noise=0.8)
        found = relative_pose(scene.first, scene.second, K)
        assert found.status == VisionStatus.OK
        matrix = pga3.motor_to_matrix(found.motor)
        turn = scipy.spatial.transform.Rotation.from_matrix(scene.turn @ matrix[:3, :3].T).as_rotvec()
        off = np.concatenate([turn, scene.shift - matrix[:3, 3]])
        squares.append(off @ np.linalg.pinv(found.covariance, rcond=1e-9) @ off)
    assert 3.7 < np.mean(squares) < 6.7 and 7 < np.quantile(squares, 0.9) < 12


@pytest.mark.parametrize("wrong", [0.0, 0.3, 0.6])
def test_wrong_pairs(wrong: float) -> None:
    rng = np.random.default_rng(round(10 * wrong))
    for _ in range(4):
        scene = views(rng, cloud(rng, 150), noise=0.4, wrong=wrong)
        found = relative_pose(scene.first, scene.second, K, threshold=1.2)
        assert found.status == VisionStatus.OK and error(found, scene) < 2
        assert found.inliers[~scene.wrong].mean() > 0.95 and found.inliers[scene.wrong].sum() <= 0.1 * wrong * 150 + 1
        assert np.isnan(found.points[~found.inliers]).all()
        again = relative_pose(scene.first, scene.second, K, threshold=1.2)
        assert np.array_equal(again.motor, found.motor)


def test_both_motions_of_a_plane() -> None:
    """Each explains the points, which are in front of both cameras and in a plane; other points decide."""
    rng = np.random.default_rng(11)
    ambiguous = 0
    for _ in range(6):
        flat = plane(rng, 60)
        scene = views(rng, flat)
        found = relative_pose(scene.first, scene.second, K)
        assert found.status in (VisionStatus.OK, VisionStatus.AMBIGUOUS)
        matrices = pga3.motor_to_matrix(found.motors)
        assert min(degrees_off(matrix, scene.turn, scene.shift) for matrix in matrices) < 1e-4
        x, y = (np.concatenate([each, np.ones((60, 1))], 1) @ np.linalg.inv(K).T for each in scene[:2])
        for matrix in matrices:
            turned, shift = x @ matrix[:3, :3].T, matrix[:3, 3]
            depth = -np.einsum("ni,ni->n", np.cross(y, shift), np.cross(y, turned)) / (np.cross(y, turned) ** 2).sum(1)
            space = x * depth[:, None]
            there = space @ matrix[:3, :3].T + shift
            assert (depth > 0).all() and (there[:, 2] > 0).all() and np.abs(pixels(there) - scene.second).max() < 1e-6
            assert np.linalg.svd(space - space.mean(0), compute_uv=False)[2] < 1e-6
        ambiguous += len(matrices) == 2
        more = np.concatenate([flat, cloud(rng, 8)])
        decided = relative_pose(pixels(more), pixels(more @ scene.turn.T + scene.shift), K)
        assert decided.status == VisionStatus.OK and error(decided, scene) < 1e-4
    assert ambiguous >= 3


def test_points_off_a_plane_refute_its_other_motion() -> None:
    """Eight pairs that it does not explain are too many to be wrong by chance, though wrong pairs are possible."""
    rng = np.random.default_rng(17)
    for _ in range(12):
        scene = views(rng, np.concatenate([plane(rng, 60), cloud(rng, 8)]), noise=0.4)
        found = relative_pose(scene.first, scene.second, K, threshold=1.5)
        assert found.status == VisionStatus.OK and error(found, scene) < 5


@pytest.mark.parametrize("threshold", [None, 1.5])
@pytest.mark.parametrize("noise", [0.0, 0.5])
def test_a_pure_rotation_has_no_translation(threshold: float | None, noise: float) -> None:
    rng = np.random.default_rng(12)
    for _ in range(5):
        scene = views(rng, cloud(rng, 80), noise=noise, shift=np.zeros(3), wrong=0.3 if threshold else 0)
        found = relative_pose(scene.first, scene.second, K, threshold=threshold)
        assert found.status == VisionStatus.DEGENERATE and np.isnan(found.motor).all()
        rotated = pga3.motor_to_matrix(found.rotation)
        assert degrees_off(rotated, scene.turn, np.zeros(3)) < (0.3 if noise else 1e-4)


def test_forward_motion_and_points_at_infinity() -> None:
    rng = np.random.default_rng(13)
    for _ in range(4):
        scene = views(rng, cloud(rng, 80), noise=0.3, shift=np.array([0, 0, -1.0]))
        assert error(relative_pose(scene.first, scene.second, K), scene) < 1.5
        scene = views(rng, np.concatenate([cloud(rng, 40), cloud(rng, 60, 1e4, 1e5)]), noise=0.3)
        found = relative_pose(scene.first, scene.second, K)
        assert found.status == VisionStatus.OK and error(found, scene) < 1.5
        assert np.isfinite(found.points[:40]).all() and found.inliers.all()


@pytest.mark.parametrize("threshold", [None, 1.5])
def test_points_of_a_line(threshold: float | None) -> None:
    rng = np.random.default_rng(14)
    for _ in range(5):
        ends = cloud(rng, 2)
        scene = views(rng, ends[0] + rng.uniform(-1, 1, (50, 1)) * (ends[1] - ends[0]) / 2, noise=0.4)
        found = relative_pose(scene.first, scene.second, K, threshold=threshold)
        assert found.status in (VisionStatus.DEGENERATE, VisionStatus.NO_CONSENSUS)


def test_random_pairs() -> None:
    """All over the images, and near each other as those of a search around each pixel."""
    rng = np.random.default_rng(15)
    for n_points in (20, 40):
        for _ in range(2):
            one = rng.uniform(0, 1, (n_points, 2)) * SIZE
            anywhere, near = rng.uniform(0, 1, (n_points, 2)) * SIZE, one + rng.uniform(-20, 20, (n_points, 2))
            assert relative_pose(one, anywhere, K).status == VisionStatus.NOT_CONVERGED
            for two in (anywhere, near):
                found = relative_pose(one, two, K, threshold=1.5)
                assert found.status in (VisionStatus.NO_CONSENSUS, VisionStatus.DEGENERATE)


def test_repeated_and_few_pairs() -> None:
    rng = np.random.default_rng(16)
    scene = views(rng, cloud(rng, 30))
    four = relative_pose(scene.first[:4], scene.second[:4], K)
    assert four.status == VisionStatus.TOO_FEW and four.inliers.shape == (4,) and four.motors.shape == (0, 8)
    repeated = [np.repeat(each[:4], 6, axis=0) for each in scene[:2]]
    assert relative_pose(*repeated, K).status == VisionStatus.TOO_FEW
    noisy = [each + 0.4 * rng.normal(size=each.shape) for each in repeated]
    assert relative_pose(*noisy, K).status in (VisionStatus.DEGENERATE, VisionStatus.NOT_CONVERGED)
    assert relative_pose(np.empty((0, 2)), np.empty((0, 2)), K).status == VisionStatus.TOO_FEW
    missing = scene.first.copy()
    missing[3, 0] = np.nan
    assert relative_pose(missing, scene.second, K, threshold=1.0).status == VisionStatus.NOT_FINITE


def test_residuals_of_one_pair_contradict_those_of_others() -> None:
    rng = np.random.default_rng(17)
    scene = views(rng, cloud(rng, 40), noise=0.3)
    scene.second[7] += 40
    assert relative_pose(scene.first, scene.second, K).status == VisionStatus.NOT_CONVERGED
    found = relative_pose(scene.first, scene.second, K, threshold=1.0)
    assert found.status == VisionStatus.OK and not found.inliers[7] and found.inliers.sum() >= 37


def test_different_cameras_types_and_layouts() -> None:
    """Skew, pixels that are not square, cameras with a pose, OpenCV's layout, float32, lists, and read-only arrays."""
    rng = np.random.default_rng(18)
    k = np.array([[700.0, 12, 300], [0, 650, 260], [0, 0, 1]])
    k_two = np.array([[1200.0, 0, 500], [0, 1150, 400], [0, 0, 1]])
    scene = views(rng, cloud(rng, 50), k=k, k_two=k_two)
    pose = pga3.motor_from_rotation_vector_translation(np.ones(3), np.array([5.0, 6, 7]))
    camera = Camera.from_intrinsics((700.0, 650.0), (300, 260), pose, skew=12)
    expected = relative_pose(scene.first, scene.second, k, k_two)
    assert expected.status == VisionStatus.OK and error(expected, scene) < 1e-5
    frozen = scene.first.copy()
    frozen.flags.writeable = False
    for one, two in (
        (scene.first[:, None], scene.second[:, None]),
        (scene.first.tolist(), scene.second.tolist()),
        (frozen, np.asfortranarray(scene.second)),
        (np.repeat(scene.first, 2, axis=0)[::2], scene.second),
    ):
        found = relative_pose(one, two, camera, 2 * k_two)
        assert np.abs(found.motor - expected.motor).max() < 1e-12
    single = relative_pose(scene.first.astype(np.float32), scene.second.astype(np.float32), k, k_two)
    assert single.status == VisionStatus.OK and error(single, scene) < 0.05


def test_cameras_with_distortion() -> None:
    """Pixels that a lens has moved by up to 40 give the motion of those of the camera without it."""
    rng = np.random.default_rng(77)
    scene = views(rng, cloud(rng, 60))
    camera = Camera(K, np.eye(8)[0], Distortion("brown", (-0.25, 0.08, 0.001, -0.002)))
    one, two = (camera.distort(seen) for seen in (scene.first, scene.second))
    assert np.abs(one - scene.first).max() > 5
    found, usual = relative_pose(one, two, camera), relative_pose(scene.first, scene.second, K)
    assert found.status == usual.status == VisionStatus.OK
    assert np.abs(found.motor - usual.motor).max() < 1e-8


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_units_of_pixels(scale: float) -> None:
    """Pixels, K and the threshold in other units, such as a focal length of 1, give the same motor."""
    rng = np.random.default_rng(19)
    scene = views(rng, cloud(rng, 60), noise=0.4, wrong=0.2)
    unit = np.diag([scale, scale, 1.0])
    for threshold in (None, 1.2):
        one = relative_pose(scene.first, scene.second, K, threshold=threshold)
        other = relative_pose(
            scale * scene.first, scale * scene.second, unit @ K, threshold=threshold and scale * threshold
        )
        assert one.status == other.status
        if threshold:
            assert one.status == VisionStatus.OK and np.abs(one.motor - other.motor).max() < 1e-6


def test_wrong_arguments() -> None:
    pairs = np.zeros((6, 2))
    with pytest.raises(ValueError, match="second: 5 points"):
        relative_pose(pairs, pairs[:5], K)
    with pytest.raises(ValueError, match="first: shape"):
        relative_pose(np.zeros((6, 3)), pairs, K)
    with pytest.raises(ValueError, match="threshold"):
        relative_pose(pairs, pairs, K, threshold=0.0)
    with pytest.raises(ValueError, match="upper triangular"):
        relative_pose(pairs, pairs, np.ones((3, 3)))


def test_the_bound_of_minima_that_see_other_noise() -> None:
    """It is that of the likelihood if all noise is shared; else differences exceed it less often than stated."""
    noise = Noise(1.0)
    assert np.isclose(largest_likely(np.array(10.0), 20, 20, noise), 10 - 2 * np.log(WRONG))
    rng = np.random.default_rng(20)
    for n in (5, 50):
        x, y = rng.chisquare(n, size=(2, 100000))
        bound = float(largest_likely(np.array(0.0), n, n, noise, n))
        share = (x - y > bound).mean()
        assert share < WRONG and bound < 4 * np.sqrt(4 * n) + 14
