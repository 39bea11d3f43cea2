"""Scenes that must not be OK: repeated matches, mirrored images, a threshold below the noise; and wrong arguments."""

from __future__ import annotations

import numpy as np
import pytest

from algorithms.estimation import ExtendedKalmanFilter, KalmanFilter, MotorFilter, RotorFilter, observability
from algorithms.evidence.noise import growth_by_threshold
from algorithms.vision import (
    Camera,
    VisionStatus,
    calibrate_from_planes,
    calibrate_stereo,
    localize,
    localize_rig,
    relative_pose,
    robust_fundamental_matrix,
    triangulation,
)
from generated import pga3

_K = np.array([[900.0, 0, 500], [0, 920.0, 400], [0, 0, 1]])


def _seen(points: np.ndarray) -> np.ndarray:
    pixels = points @ _K.T
    return pixels[:, :2] / pixels[:, 2:]


def _repeated(rng: np.random.Generator, size: tuple[int, int], spread: float, scale: float) -> np.ndarray:
    """Random places, six times each, up to a spread."""
    places = np.repeat(rng.uniform(-1, 1, size) * scale, 6, axis=0)
    return places + rng.normal(0, spread, places.shape)


def test_repeated_random_matches_have_no_consensus() -> None:
    """Detectors find one corner in several images of a pyramid: its matches agree with each other."""
    for seed in range(2):
        rng = np.random.default_rng(seed)
        one, two = (_repeated(rng, (14, 2), 0.3, 500.0) for _ in range(2))
        assert robust_fundamental_matrix(one, two, 1.5).status == VisionStatus.NO_CONSENSUS
        assert relative_pose(one, two, _K, threshold=1.5).status != VisionStatus.OK


def _pose(turn: list[float], place: list[float]) -> np.ndarray:
    return np.asarray(pga3.motor_from_rotation_vector_translation(np.array(turn, float), np.array(place, float)))


def test_repeated_random_pixels_have_no_pose() -> None:
    for seed in range(3):
        rng = np.random.default_rng(seed)
        points, pixels = _repeated(rng, (7, 3), 1e-3, 1.0), _repeated(rng, (7, 2), 0.3, 400.0)
        assert localize(points, pixels, _K).status != VisionStatus.OK


def test_repeats_do_not_hide_a_pose() -> None:
    rng = np.random.default_rng(3)
    points = _repeated(rng, (12, 3), 0.0, 1.0)
    pixels = _seen(points + np.array([0.1, 0.2, 5])) + rng.normal(0, 0.3, (72, 2))
    pixels[:20] = rng.uniform(0, 800, (20, 2))
    for threshold in (None, 1.5):
        assert localize(points, pixels, _K, threshold=threshold).status == VisionStatus.OK


def test_images_with_y_upwards_have_no_pose() -> None:
    """A few pixels of a mirrored image agree with a pose, and the others are near theirs."""
    rejected = 0
    for seed in range(10):
        rng = np.random.default_rng(seed)
        points = rng.uniform(-1, 1, (30, 3))
        pixels = _seen(points + np.array([0.1, 0.2, 6])) + rng.normal(0, 0.4, (30, 2))
        assert localize(points, pixels, _K, threshold=2.0).status == VisionStatus.OK
        mirrored = localize(points, pixels * [1, -1] + [0, 800], _K, threshold=2.0)
        rejected += mirrored.status != VisionStatus.OK
    assert rejected == 10


def test_mirrored_worlds_have_no_pose() -> None:
    """The image of a mirrored world is that of points whose depths are reversed, up to perspective.

    A fifth of the pixels are random. Wrong pixels leave the poses of the world itself OK.
    """
    rejected, axes = 0, np.array([[-1.0, 1, 1], [1, -1, 1], [1, 1, -1]])
    for seed in range(100):
        rng = np.random.default_rng(seed)
        points = rng.normal(size=(45, 3)) * [1.0, 0.8, 0.6]
        pixels = _seen(points + np.array([-0.3, 0.2, rng.uniform(6, 11)])) + rng.normal(0, 0.6, (45, 2))
        pixels[:9] = rng.uniform(0, 700, (9, 2))
        if seed < 20:
            assert localize(points, pixels, _K, threshold=2.5).status == VisionStatus.OK
        mirrored = localize(points * axes[seed % 3] + 20, pixels, _K, threshold=2.5)
        rejected += mirrored.status != VisionStatus.OK
    assert rejected == 100


def test_one_or_two_pixels_that_disagree_refuse_no_pose() -> None:
    """Two of eight pixels are 15 off, or noise of half the threshold takes some of twenty beyond it."""
    refused = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        points = rng.uniform(-1, 1, (20, 3))
        places, noise = _seen(points + np.array([0.1, 0.2, 6])), rng.normal(size=(20, 2))
        few = (places + 0.5 * noise)[:8]
        few[:2] += 15 * np.array([[0.6, 0.8], [0.8, -0.6]])
        refused += localize(points[:8], few, _K, threshold=2.0).status != VisionStatus.OK
        refused += localize(points, places + noise, _K, threshold=2.0).status != VisionStatus.OK
    assert refused <= 2


@pytest.mark.slow
def test_a_threshold_below_the_noise_raises_the_covariance_of_a_motion() -> None:
    """The errors of 60 motions have a mean square of 5 deviations: five parameters. Without the growth it is 21."""
    squares = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        turn, way = rng.normal(0, 0.05, 3), np.array([0.8, 0.3, 0.1])
        motor = pga3.motor_from_rotation_vector_translation(turn, way / np.linalg.norm(way))
        points = np.stack([*rng.uniform(-2, 2, (2, 150)), rng.uniform(4, 10, 150)], 1)
        pixels = [_seen(each) + rng.normal(0, 0.9, (150, 2)) for each in (points, pga3.move_point(motor, points))]
        found = relative_pose(*pixels, _K, threshold=1.2)
        if found.status != VisionStatus.OK:
            continue
        own, true = (pga3.motor_to_matrix(each) for each in (found.motor, motor))
        off = pga3.rotor_to_rotation_vector(pga3.rotor_from_matrix(own[:3, :3] @ true[:3, :3].T))
        step = np.concatenate([off, own[:3, 3] - true[:3, 3]])
        squares.append(step @ np.linalg.pinv(found.covariance, rcond=1e-9) @ step)
    assert len(squares) > 50
    assert 2 < np.mean(squares) < 10


def test_the_growth_of_the_variance_is_that_of_truncated_squares() -> None:
    """Estimates of the mean of normal numbers by truncated squares, with thresholds of 1.5 to 3 deviations."""
    rng = np.random.default_rng(0)
    for threshold in (1.5, 2.0, 3.0):
        residuals = rng.normal(size=(300, 500))
        centre = np.zeros((300, 1))
        for _ in range(40):
            near = np.abs(residuals - centre) <= threshold
            centre = (residuals * near).sum(1, keepdims=True) / near.sum(1, keepdims=True)
        size = np.abs(residuals - centre)
        within, beyond = int((size <= threshold).sum()), int(((size > threshold) & (size <= 2 * threshold)).sum())
        variance = (residuals**2)[size <= threshold].mean() / (within / 300)
        np.testing.assert_allclose(centre.var(), variance * growth_by_threshold(within, beyond), rtol=0.25)
    assert growth_by_threshold(10, 0) == pytest.approx(1, abs=1e-6)
    assert growth_by_threshold(10, 5) == np.inf


def test_equal_pixels_have_a_status() -> None:
    points, camera = np.random.default_rng(0).normal(size=(12, 3)), Camera(_K, np.eye(8)[0])
    assert localize(points, np.zeros((12, 2)), _K).status != VisionStatus.OK
    views = np.full((3, 12, 2), np.nan)
    for images in (views, np.zeros((3, 12, 2))):
        assert calibrate_stereo(points[:, :2], images, images, camera).status != VisionStatus.OK


def test_errors_name_what_is_no_sequence_or_empty() -> None:
    camera, views = Camera(_K, np.eye(8)[0]), np.zeros((3, 12, 2))
    for call, match in (
        (lambda: calibrate_from_planes([], views), "^planes: shape"),
        (lambda: calibrate_from_planes(np.zeros((0, 2)), views), r"^views\[0\]: 12 points; expected 0"),
        (lambda: calibrate_from_planes(None, views), "^planes: NoneType"),
        (lambda: calibrate_from_planes(views[0], None), "^views: NoneType"),
        (lambda: calibrate_stereo(views[0], None, views, camera), "^first: NoneType"),
        (lambda: calibrate_stereo(None, views, views, camera), "^planes: NoneType"),
        (lambda: triangulation([camera, camera], 3.0), "^pixels: float"),
        (lambda: localize_rig(np.eye(3), np.eye(3)[:, :2], None, np.zeros(3, int)), "^cameras: NoneType"),
        (lambda: observability(np.eye(8)[0], points=[[np.nan, 0, 0]]), "^points: nan"),
    ):
        with pytest.raises((TypeError, ValueError), match=match):
            call()


@pytest.mark.parametrize("gate", [np.nan, 0.0, -1.0])
def test_gates_are_positive(gate: float) -> None:
    """NaN let everything pass in one filter and nothing in the others."""
    one = np.eye(1)
    for create in (
        lambda: KalmanFilter([0.0], one, one, one, one, one, gate=gate),
        lambda: ExtendedKalmanFilter([0.0], one, gate=gate),
        lambda: RotorFilter(np.eye(4)[0], np.eye(3), gate=gate),
        lambda: MotorFilter(np.eye(8)[0], np.eye(6), gate=gate),
    ):
        with pytest.raises(ValueError, match=r"^gate: "):
            create()


def test_noise_of_rotors_is_not_negative() -> None:
    """A negative one left a covariance of 0 with the status OK."""
    with pytest.raises(ValueError, match=r"^noise: -1\.0; expected 0 or more"):
        RotorFilter(np.eye(4)[0], np.eye(3)).predict([0, 0, 0.1], 0.1, -1.0)


def test_the_growth_of_the_variance_in_the_plane_is_that_of_truncated_squares() -> None:
    """Estimates of a place by truncated squares of distances, whose deviations are compared with those of the inliers.

    Thresholds are 1.3 to 3 deviations.
    """
    rng = np.random.default_rng(1)
    for threshold in (1.3, 2.0, 3.0):
        places, centres = rng.normal(size=(150, 300, 2)), np.zeros((150, 1, 2))
        for _ in range(60):
            near = ((places - centres) ** 2).sum(-1, keepdims=True) <= threshold**2
            centres = (places * near).sum(1, keepdims=True) / near.sum(1, keepdims=True)
        squares = ((places - centres) ** 2).sum(-1)
        near, twice = squares <= threshold**2, squares <= 4 * threshold**2
        naive = squares[near].sum() / (2 * near.sum()) / near.sum(1).mean()
        found = growth_by_threshold(int(near.sum()), int((twice & ~near).sum()), 2)
        assert 0.8 < (centres**2).mean() / (naive * found) < 1.25


def test_a_threshold_near_the_noise_raises_the_deviations_of_a_pose() -> None:
    """Noise of 0.65 of the threshold. Without the growth, a tenth of the rotations is beyond four deviations."""
    ratios, cameras = [], [Camera(_K, _pose([0, a, 0], [a, 0, 0])) for a in (0.0, 0.7)]
    for seed in range(60):
        rng = np.random.default_rng(seed)
        points = np.stack([*rng.uniform(-2, 2, (2, 70)), rng.uniform(4, 9, 70)], 1)
        found = localize(points, _seen(points) + rng.normal(0, 1.3, (70, 2)), _K, threshold=2.0)
        which = np.arange(70) % 2
        there = np.where(which[:, None], pga3.move_point(cameras[1].pose, points), points)
        pixels = _seen(points) + rng.normal(0, 1.3, (70, 2))
        for each in (found, localize_rig(there, pixels, cameras, which, threshold=2.0)):
            if each.status == VisionStatus.OK:
                turn = pga3.motor_to_matrix(each.pose)[:3, :3]
                angle = np.linalg.norm(pga3.rotor_to_rotation_vector(pga3.rotor_from_matrix(turn)))
                ratios.append(angle / each.deviation[0])
    assert len(ratios) > 100
    # Deviations are those of the least certain of three directions.
    assert max(ratios) < 4.1
    assert np.median(ratios) > 0.4


def test_copies_of_pixels_make_no_pose_more_certain() -> None:
    rng = np.random.default_rng(5)
    cameras = [Camera(_K, _pose([0, 0, 0], [0, 0, 0]))]
    points = np.stack([*rng.uniform(-2, 2, (2, 20)), rng.uniform(4, 9, 20)], 1)
    pixels = _seen(points) + rng.normal(0, 0.5, (20, 2))
    pixels[:4] = rng.uniform(0, 800, (4, 2))
    again = rng.permutation(np.repeat(np.arange(20), 5))
    whole = np.concatenate([np.arange(20), again])
    for locate in (
        lambda *pairs: localize(*pairs, _K, threshold=2.0),
        lambda *pairs: localize_rig(*pairs, cameras, np.zeros(len(pairs[0]), int), threshold=2.0),
    ):
        once, often = locate(points, pixels), locate(points[whole], pixels[whole])
        assert once.status == often.status == VisionStatus.OK
        assert np.array_equal(once.deviation, often.deviation)
        assert np.array_equal(once.inliers[whole], often.inliers)


def test_poses_by_a_wrong_focal_length_are_refused_or_uncertain() -> None:
    """Without a threshold, residuals of a few pixels were taken for noise, and centres were off by tens of deviations.

    With the right one, few are refused.
    """
    refused = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        points = np.stack([*rng.uniform(-1.5, 1.5, (2, 24)), rng.uniform(-1, 1, 24)], 1)
        place = np.array([*rng.uniform(-0.5, 0.5, 2), rng.uniform(5, 7)])
        pixels = _seen(points + place) + rng.normal(0, 0.4 if seed % 2 else 1.1, (24, 2))
        factor = 1.0 if seed < 40 else rng.choice([0.7, 0.85, 1.15, 1.4])
        found = localize(points, pixels, _K * [[factor, 1, 1], [1, factor, 1], [1, 1, 1]])
        if seed < 40:
            assert found.status == VisionStatus.OK
            off = np.linalg.norm(pga3.motor_to_matrix(found.pose)[:3, 3] + place)
            assert off < 4.1 * found.deviation[1]
        else:
            refused += found.status != VisionStatus.OK
    assert refused == 20
